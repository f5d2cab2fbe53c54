"""Tooth stiffness after ISO 6336: values by hand, laws, and its range."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.gear.classical import iso6336
from tests.support.beams import ALPHA


def test_iso_single_stiffness_of_the_paper_pair():
    """By hand: q' = 0.04723 + (0.15551 + 0.25791)/21 = 0.066917, c' = 0.8 * 0.975 / q' = 11.656 N/(mm um)."""
    assert_allclose(iso6336.single_stiffness(21, 21), 0.78 / 0.0669167, rtol=1e-5)


def test_iso_single_stiffness_of_racks_and_standard_gears():
    """The standard's own round figures: c' about 14 N/(mm um) and c_gamma about 20 for common gears."""
    assert 10 < iso6336.single_stiffness(20, 40) < 15
    assert_allclose(iso6336.single_stiffness(1e9, 1e9, dedendum=1.2), 0.8 / 0.04723, rtol=1e-6)


def test_iso_mesh_stiffness_is_linear_in_contact_ratio():
    assert_allclose(iso6336.mesh_stiffness(14.0, 1.6), 14.0 * 1.45)


def test_iso_low_load_factor():
    full = iso6336.single_stiffness(21, 21, specific_load_N_per_mm=100.0)
    assert_allclose(full, iso6336.single_stiffness(21, 21))
    assert_allclose(iso6336.single_stiffness(21, 21, specific_load_N_per_mm=50.0), full * 0.5**0.25)
    assert_allclose(iso6336.single_stiffness(21, 21, specific_load_N_per_mm=99.999), full, rtol=1e-5)


def test_iso_monotone_laws():
    assert iso6336.single_stiffness(40, 40) > iso6336.single_stiffness(20, 20)
    assert iso6336.single_stiffness(21, 21, dedendum=1.4) < iso6336.single_stiffness(21, 21)
    assert_allclose(iso6336.single_stiffness(21, 21, modulus_ratio=0.5), 0.5 * iso6336.single_stiffness(21, 21))


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ({"x_1": 0.1, "x_2": 0.2}, "below x_2"),
        ({"x_1": 1.5, "x_2": 1.0}, "not in -0.5 to 2"),
        ({"helix_angle_rad": 0.9}, "helix"),
        ({"specific_load_N_per_mm": 2000.0}, "1600"),
    ],
)
def test_iso_warns_outside_its_range(arguments, text):
    with pytest.warns(UserWarning, match=text):
        iso6336.single_stiffness(21, 21, **arguments)


def test_iso_warns_of_a_small_contact_ratio():
    with pytest.warns(UserWarning, match="below 1.2"):
        iso6336.mesh_stiffness(14.0, 1.1)


def test_virtual_tooth_number():
    assert iso6336.virtual_tooth_number(21, 0.0, ALPHA) == 21
    # z_n is close to z / cos^3(beta)
    beta = np.radians(15)
    assert_allclose(iso6336.virtual_tooth_number(21, beta, ALPHA), 21 / np.cos(beta) ** 3, rtol=0.01)


@pytest.mark.parametrize(
    ("teeth", "helix_deg", "shift", "expected"),
    [
        ((27, 51), 21.0, 0.231415, 13.7622),
        ((23, 34), 10.0, 0.15074, 13.2130),
        ((17, 43), 20.0, 0.0, 12.2176),
    ],
)
def test_iso_single_stiffness_of_helical_pairs_from_drawings(teeth, helix_deg, shift, expected):
    """Two pairs whose drawings the FVA publishes as REXS, and 17/43; computed independently, to four decimals."""
    helix = np.radians(helix_deg)
    virtual = [iso6336.virtual_tooth_number(z, helix, np.radians(20.0)) for z in teeth]
    found = iso6336.single_stiffness(*virtual, shift, shift, helix_angle_rad=helix)
    assert_allclose(found, expected, atol=5e-5)
