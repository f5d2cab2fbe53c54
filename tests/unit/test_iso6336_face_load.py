"""Misalignment and face load factor after ISO 6336-1, method C."""

from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.body.beam import Beam, CircularSection, ShaftMaterial
from pmor.case import change_case, parse_case
from pmor.gear.classical.iso6336 import (
    face_load_factor,
    running_in,
    shaft_misalignment,
    sliced_face_load_factor,
)
from pmor.machine.iso import sliced_k_h_beta
from pmor.machine.mesh_force import f_beta_um
from pmor.pair.model import gear_pair
from tests.support.gearboxes import SMALL_CASE

EXACT = [(4 / 3, 1.66667), (2.0, 2.0), (8 / 3, 2.30940), (16 / 3, 3.26599), (32 / 3, 4.61880)]


@pytest.mark.parametrize(("size", "factor"), EXACT)
def test_face_load_factor_is_that_of_slices_that_are_not_coupled(size, factor):
    """Thin slices of stiffness c under F_by c / w, exactly: partly lifted off from 2 on."""
    assert_allclose(face_load_factor(size * 150.0 / 20.0, 20.0, 150.0), factor, rtol=1e-5)


@pytest.mark.parametrize(("size", "factor"), EXACT)
@pytest.mark.parametrize("turned", [1.0, -1.0])
def test_slices_over_any_gap_have_the_exact_factor_of_a_tilt(size, factor, turned):
    """The largest is half a slice from the end."""
    z = (np.arange(4000) + 0.5) / 4000
    overlap = 7.0 + turned * size * 150.0 / 20.0 * z
    assert_allclose(sliced_face_load_factor(overlap, 150.0), factor, rtol=2e-3)
    assert_allclose(sliced_face_load_factor(np.full(7, -3.0), 150.0), 1.0, rtol=1e-12)


def test_slices_of_a_mesh_see_its_shafts_its_axes_and_its_flanks():
    """A tilt of the hubs alone; levelled by a helix slope of either gear, or by the axes of the case."""
    case = parse_case(SMALL_CASE, "small", "small")
    pair, moved = gear_pair(case), np.zeros((2, 6))
    moved[:, 3:5] = [[1.5e-4, -4e-4], [-2e-4, 3e-4]]
    mesh = SimpleNamespace(meshing=SimpleNamespace(pair=pair), displacement=moved, force=4000.0)
    tilt, line_load = f_beta_um(pair, moved), 4000.0 / pair.common_width
    expected = face_load_factor(abs(tilt), 20.0, line_load)
    assert expected > 1.2
    assert_allclose(sliced_k_h_beta(mesh, case), expected, rtol=3e-3)
    relative = 1e3 * pair.face_width * (moved[1] - moved[0])
    axes = {"in_plane_um": relative[3], "out_of_plane_um": -relative[4]}
    flanks = ({f"{gear}.modification": {"helix_slope_um": tilt}} for gear in ("pinion", "wheel"))
    for change in ({"misalignment": axes}, *flanks):
        assert_allclose(sliced_k_h_beta(mesh, change_case(case, **change)), 1.0, atol=1e-6)


def test_f_sh_worked_by_hand():
    """27 teeth, m 4.5, 21 deg, b 50, on 60 mm between bearings 110 apart, 3 mm off towards the torque; 567 N m."""
    diameter = 27 * 4.5 / np.cos(np.radians(21.0))
    line_load = 567e3 / (0.5 * diameter) / 50.0
    bent = 0.48 * 110.0 * 3.0 / diameter**2 * (diameter / 60.0) ** 4
    expected = line_load * 0.023 * (abs(0.7 + bent) + 0.3) * (50.0 / diameter) ** 2
    assert_allclose(shaft_misalignment(line_load, 50.0, diameter, 60.0, 110.0, 3.0), expected, rtol=1e-12)
    assert_allclose(expected, 0.714, atol=1e-3)


def test_bending_in_f_sh_is_that_of_a_beam():
    """Without stiffening, K' = 0.8: slope of a simply supported shaft under F_t / cos 20 deg, times the face width.

    Rounded constants, a small offset: within 10 %.
    """
    diameter, span, offset, force, width = 40.0, 400.0, 40.0, 1000.0, 20.0
    place = 0.5 * span + offset
    beam = Beam(np.array([0.0, place, span]), [CircularSection(diameter)] * 2, ShaftMaterial(206e3, 0.3))
    free = [i for i in range(18) if i not in (0, 1, 2, 3, 13, 14)]
    load = np.zeros(18)
    load[7] = force / np.cos(np.radians(20.0))
    moved = np.zeros(18)
    moved[free] = np.linalg.solve(beam.stiffness()[np.ix_(free, free)], load[free])
    by_beam = 1e3 * width * abs(moved[11])
    with_offset, without = (
        shaft_misalignment(force / width, width, diameter, diameter, span, s) for s in (offset, 0.0)
    )
    assert_allclose(with_offset - without, by_beam, rtol=0.1)


def test_torsion_and_bending_load_the_same_end_or_take_each_other_away():
    values = [shaft_misalignment(100.0, 40.0, 60.0, 55.0, 200.0, s) for s in (30.0, 0.0, -30.0)]
    assert values[0] > values[1]
    assert values[1] == pytest.approx(100.0 * 0.023 * (40.0 / 60.0) ** 2)
    assert shaft_misalignment(100.0, 40.0, 60.0, 55.0, 200.0, 10.0) > shaft_misalignment(
        100.0, 40.0, 60.0, 52.0, 200.0, 10.0
    )  # stiffened by the body of the pinion


def test_running_in_ends_at_six_micrometres():
    assert running_in(10.0) == pytest.approx(1.5)
    assert running_in(100.0) == 6.0
