"""The tooth as a beam: its outline, where it is loaded, and the integrals of its bending."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.gear.classical.tooth_beam import beam_integrals, involute_function, tooth_beam, tooth_load
from tests.support.beams import ALPHA, paper_beam, prismatic_beam

QUADRATURE = 2e-4  # trapezoidal rule over the 800 points of the tooth outline


# --- tooth outline -------------------------------------------------------------------------------------------------


def test_involute_function_of_20_degrees():
    assert_allclose(involute_function(ALPHA), 0.014904, atol=5e-7)  # as tabulated


def test_tooth_thickness_at_the_pitch_circle_is_half_the_pitch():
    beam = paper_beam()
    radius = np.hypot(beam.y_mm, beam.half_thickness_mm)
    arc = 2 * 42.0 * np.interp(42.0, radius, np.arctan2(beam.half_thickness_mm, beam.y_mm))
    assert_allclose(arc, np.pi * 4.0 / 2, rtol=QUADRATURE)


@pytest.mark.parametrize("shift", [-0.2, 0.0, 0.5, 1.0])
@pytest.mark.parametrize("z", [12, 21, 60])
def test_outline_reaches_from_root_to_tip_circle_without_folding(z, shift):
    beam = tooth_beam(z, 4.0, ALPHA, shift, addendum=0.8)
    radius = np.hypot(beam.y_mm, beam.half_thickness_mm)
    assert_allclose(radius[[0, -1]], [2.0 * z - 4.0 * (1.25 - shift), 2.0 * z + 4.0 * (0.8 + shift)])
    assert (np.diff(beam.y_mm) > 0).all()
    assert (beam.half_thickness_mm > 0).all()


def test_fillet_joins_the_involute_smoothly_without_undercut():
    beam = paper_beam()
    slope = np.diff(beam.half_thickness_mm) / np.diff(beam.y_mm)
    joint = np.argmin(np.abs(np.hypot(beam.y_mm, beam.half_thickness_mm) - beam.start_radius_mm))
    assert abs(slope[joint] - slope[joint - 2]) < 0.01


def test_start_of_involute_follows_from_the_rack():
    """r_F = sqrt(r_b^2 + (r sin a - h / sin a)^2), h the depth of the rack's straight flank below the pitch line."""
    h = 4.0 * (1.25 - 0.38 * (1 - np.sin(ALPHA)))
    expected = np.hypot(42 * np.cos(ALPHA), 42 * np.sin(ALPHA) - h / np.sin(ALPHA))
    assert_allclose(paper_beam().start_radius_mm, expected, rtol=1e-12)


def test_undercut_removes_the_foot_of_the_involute():
    """z = 10 is undercut: the involute starts above the base circle and the tooth has a waist."""
    beam = tooth_beam(10, 4.0, ALPHA)
    assert beam.start_radius_mm > beam.base_radius_mm * 1.001
    start = np.searchsorted(np.hypot(beam.y_mm, beam.half_thickness_mm), beam.start_radius_mm)
    assert beam.half_thickness_mm[:start].min() < beam.half_thickness_mm[start]
    jump = np.abs(np.diff(beam.half_thickness_mm))[start - 3 : start + 3].max()
    assert jump < 0.05


def test_impossible_teeth_are_refused():
    with pytest.raises(ValueError, match="tip radius"):
        tooth_beam(21, 4.0, ALPHA, rack_tip_radius=0.5)
    with pytest.raises(ValueError, match="pointed"):
        tooth_beam(12, 4.0, ALPHA, profile_shift=1.0)


def test_line_of_action_is_tangent_to_the_base_circle():
    """Distance from the gear's axis to the line of action is the base radius, at every contact radius."""
    beam = paper_beam()
    load = tooth_load(beam, np.linspace(40.0, 46.0, 7))
    distance = load.y_mm * np.cos(load.angle_rad) - load.half_thickness_mm * np.sin(load.angle_rad)
    assert_allclose(distance, beam.base_radius_mm, rtol=1e-12)
    assert (np.diff(load.angle_rad) > 0).all()


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
