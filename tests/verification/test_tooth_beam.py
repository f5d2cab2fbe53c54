"""The tooth as a beam: its outline, where it is loaded, and the integrals of its bending."""

from itertools import product

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.gear.classical.tooth_beam import beam_integrals, tooth_beam, tooth_load
from pmor.gear.tooth import Tooth
from tests.support.beams import ALPHA, paper_beam, prismatic_beam

QUADRATURE = 2e-4  # trapezoidal rule over the 800 points of the tooth outline


# --- tooth outline -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("z", "shift"), list(product([10, 12, 21, 60], [-0.2, 0.0, 0.5])))
def test_outline_is_that_of_the_generated_tooth_which_shares_no_code_with_it(z, shift):
    beam, tooth = tooth_beam(z, 4.0, ALPHA, shift, addendum=0.8), Tooth(z, 4.0, ALPHA, 0.0, shift, addendum=0.8)
    roll = np.linspace(tooth.form_roll_angle, tooth.tip_roll_angle, 2001)
    x, y = np.concatenate([tooth.root_section(np.linspace(1.0, 0.0, 4001)), tooth.flank_section(roll[1:])]).T
    radius = np.hypot(beam.y_mm, beam.half_thickness_mm)
    # Chords of 400 points; the crossing of an undercut fillet and the involute falls between two of them.
    place = 2e-2 if tooth.is_undercut else 1e-5
    assert_allclose(beam.half_thickness_mm, np.interp(radius, np.hypot(x, y), -x), rtol=0.0, atol=place)
    assert_allclose(beam.start_radius_mm, np.linalg.norm(tooth.flank_section(roll[0])), rtol=0.0, atol=place)
    assert_allclose(radius[[0, -1]], [tooth.root_radius, tooth.tip_radius])
    assert (np.diff(beam.y_mm) > 0).all(), "it does not fold"


def test_impossible_teeth_are_refused():
    with pytest.raises(ValueError, match="tip radius"):
        tooth_beam(21, 4.0, ALPHA, rack_tip_radius=0.5)
    with pytest.raises(ValueError, match="pointed"):
        tooth_beam(12, 4.0, ALPHA, profile_shift=1.0)


def test_contact_outside_the_involute_is_refused():
    with pytest.raises(ValueError, match="leaves the involute"):
        tooth_load(paper_beam(), [38.0])


# --- beam integrals ------------------------------------------------------------------------------------------------


def test_prismatic_beam_gives_the_cantilever_formula():
    """int (l - y)^2 / d^3 dy = l^3 / (3 d^3): times 12 that is the tip deflection P l^3 / (3 E I)."""
    beam = prismatic_beam(2.0, 37.0, 47.0)
    bending, shear = beam_integrals(beam, np.array([45.0]), np.array([45.0]))
    assert_allclose(bending, 8.0**3 / (3 * 4.0**3), rtol=1e-6)
    assert_allclose(shear, 8.0 / 4.0, rtol=1e-12)


def test_integrals_agree_with_direct_quadrature_of_one_load():
    """Slow twin: integrate (y_l - y)^2 / d^3 itself on a fine grid instead of assembling it from moments."""
    beam = paper_beam()
    load = tooth_load(beam, [44.0])
    y = np.linspace(beam.y_mm[0], load.y_mm[0], 200_001)
    thickness = 2 * np.interp(y, beam.y_mm, beam.half_thickness_mm)
    bending, shear = beam_integrals(beam, load.y_centre_line_mm, load.y_mm)
    assert_allclose(bending, np.trapezoid((load.y_centre_line_mm - y) ** 2 / thickness**3, y), rtol=QUADRATURE)
    assert_allclose(shear, np.trapezoid(1 / thickness, y), rtol=QUADRATURE)
