"""Line contact in plane strain against CalculiX: whole rings of second-order elements, flanks that resolve the contact.

Elements on the flanks are a quarter of Hertz's half-width. CalculiX has a penalty k, by which Hertz's pressure lets the
flanks enter each other by 4 w / (pi^2 b k): that is taken off where no corner carries.

Slow: ``pytest -n 0 -m slow tests/verification/test_calculix_plane_strain.py -s``, two to five minutes each; figures are
in `pmor.validation.calculix` and the manual. At corners flank elements of half the length move CalculiX by 0.02 %;
penalties of 2e7 and 1e8 differ by 0.5 %.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.case import make_case
from pmor.gear.condition import Condition
from pmor.lab.rivals.calculix import PROGRAM, calculix_available
from pmor.validation.calculix import CORNER_RTOL, CORNERS, INSIDE, PLANE, WIDTH, corner_angle, inside_rtol, plane
from pmor.validation.machines import after_entry, full
from tests.support.calculix_plane import plane_ste_um
from tests.support.states import states_at

PENALTY_N_MM3 = 5e7
# Pitches since entry and CalculiX's STE (um) of the internal pair, 24 N m on a face of 8 mm.
SOLID, SOLID_RTOL = [(0.15, 3.4049), (0.75, 5.5270)], 1e-2
RECORDED = 1e-3  # of what CalculiX gave
pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(not calculix_available(), reason=f"CalculiX ({PROGRAM}) is not installed"),
]


def solved(name, torque, phi):
    """STE (um), and for each tooth pair in contact line load and half-width."""
    _, model = plane(name)
    meshed = model.mesh.meshed
    (found,) = states_at(model, phi, [Condition(torque=1e3 * torque / WIDTH)])
    return read_off(found, meshed.pair)


def read_off(found, pair):
    """STE (um) of a state, and for each tooth pair in contact line load and half-width."""
    load, half_width = (
        np.array([values[found.pair == p].mean() for p in np.unique(found.pair)])
        for values in (found.line_load, found.patches()[:, 0])
    )
    return 1e3 * found.advance * pair.pinion.base_radius, load, half_width


def entered_um(load, half_width):
    """By how much CalculiX's flanks enter each other under Hertz's pressure, um."""
    return 1e3 * np.sum(load / load.sum() * 4.0 * load / (math.pi**2 * half_width * PENALTY_N_MM3))


def calculix(name, torque, phi, ours_um, half_width):
    case, model = plane(name)
    fine, reach = 0.25 * half_width.min(), 2.0 * half_width.max()
    given, pair = replace(case, torque_Nm=torque / WIDTH), model.mesh.meshed.pair
    return plane_ste_um(given, pair, phi, fine, reach, PENALTY_N_MM3, ours_um)


@pytest.mark.parametrize(("name", "torque", "share", "known_um"), INSIDE)
def test_line_contact_between_the_tips_gives_the_ste_of_calculix(name, torque, share, known_um):
    phi = after_entry(plane(name)[1].mesh.meshed.pair, share)
    ours, load, half_width = solved(name, torque, phi)
    theirs = calculix(name, torque, phi, ours, half_width) - entered_um(load, half_width)
    print(f"\n{name} at {share:g}: {ours:.4f} um, CalculiX {theirs:.4f} um: {1e2 * (ours / theirs - 1.0):+.3f} %")  # noqa: T201
    assert_allclose(ours, theirs, rtol=inside_rtol(name))
    assert_allclose(theirs, known_um, rtol=RECORDED)


@pytest.mark.parametrize(("share", "known_um"), SOLID)
def test_a_pinion_in_a_ring_in_three_dimensions_gives_the_ste_of_calculix(share, known_um):
    """Half of a face of 8 mm on two layers of elements, arcs of thin rims; a minute to five."""
    drawn = {key: dict(value) if isinstance(value, dict) else value for key, value in PLANE["internal"].items()}
    drawn["pinion"] |= {"bore_radius_mm": 20.0}
    drawn["wheel"] |= {"rim_thickness_mm": 5.0}
    mesh = {"profile_elements": 16, "width_elements": 8}
    case = make_case("solid", **drawn, face_width_mm=8.0, torque_Nm=24.0, mesh=mesh)
    model = full(case)
    pair = model.mesh.meshed.pair
    phi = after_entry(pair, share)
    (found,) = states_at(model, phi, [Condition(torque=1e3 * case.torque_Nm)])
    ours, load, half_width = read_off(found, pair)
    fine, reach = 0.5 * half_width.min(), 2.0 * half_width.max()
    theirs = plane_ste_um(case, pair, phi, fine, reach, PENALTY_N_MM3, ours, layers=2, beside=2)
    theirs -= entered_um(load, half_width)
    print(f"\nring in 3-D at {share:g}: {ours:.4f} um, CalculiX {theirs:.4f} um: {1e2 * (ours / theirs - 1.0):+.3f} %")  # noqa: T201
    assert_allclose(ours, theirs, rtol=SOLID_RTOL)
    assert_allclose(theirs, known_um, rtol=RECORDED)


@pytest.mark.parametrize(("name", "torque", "end", "beyond", "known_um"), CORNERS)
def test_line_contact_at_a_corner_gives_the_ste_of_calculix(name, torque, end, beyond, known_um):
    phi = corner_angle(name, end, beyond)
    ours, _, half_width = solved(name, torque, phi)
    theirs = calculix(name, torque, phi, ours, half_width)
    print(f"\n{name}, {torque:g} N m, {end}: {ours:.4f}, CalculiX {theirs:.4f} um: {1e2 * (ours / theirs - 1):+.3f} %")  # noqa: T201
    assert_allclose(ours, theirs, rtol=CORNER_RTOL)
    assert_allclose(theirs, known_um, rtol=RECORDED)
