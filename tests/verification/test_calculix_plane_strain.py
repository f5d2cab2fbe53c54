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

from pmor.gear.condition import Condition
from pmor.lab.rivals.calculix import PROGRAM, calculix_available
from pmor.validation.calculix import CORNER_RTOL, CORNERS, INSIDE, INSIDE_RTOL, WIDTH, corner_angle, plane
from pmor.validation.pairs import after_entry
from tests.support.calculix_plane import plane_ste_um
from tests.support.states import states_at

PENALTY_N_MM3 = 5e7
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
    load, half_width = (
        np.array([values[found.pair == p].mean() for p in np.unique(found.pair)])
        for values in (found.line_load, found.patches()[:, 0])
    )
    return 1e3 * found.advance * meshed.pair.pinion.base_radius, load, half_width


def calculix(name, torque, phi, ours_um, half_width):
    case, model = plane(name)
    fine, reach = 0.25 * half_width.min(), 2.0 * half_width.max()
    given, pair = replace(case, torque_Nm=torque / WIDTH), model.mesh.meshed.pair
    return plane_ste_um(given, pair, phi, fine, reach, PENALTY_N_MM3, ours_um)


@pytest.mark.parametrize(("name", "torque", "share", "known_um"), INSIDE)
def test_line_contact_between_the_tips_gives_the_ste_of_calculix(name, torque, share, known_um):
    phi = after_entry(plane(name)[1].mesh.meshed.pair, share)
    ours, load, half_width = solved(name, torque, phi)
    entered = 1e3 * np.sum(load / load.sum() * 4.0 * load / (math.pi**2 * half_width * PENALTY_N_MM3))
    theirs = calculix(name, torque, phi, ours, half_width) - entered
    print(f"\n{name} at {share:g}: {ours:.4f} um, CalculiX {theirs:.4f} um: {1e2 * (ours / theirs - 1.0):+.3f} %")  # noqa: T201
    assert_allclose(ours, theirs, rtol=INSIDE_RTOL)
    assert_allclose(theirs, known_um, rtol=RECORDED)


@pytest.mark.parametrize(("name", "torque", "end", "beyond", "known_um"), CORNERS)
def test_line_contact_at_a_corner_gives_the_ste_of_calculix(name, torque, end, beyond, known_um):
    phi = corner_angle(name, end, beyond)
    ours, _, half_width = solved(name, torque, phi)
    theirs = calculix(name, torque, phi, ours, half_width)
    print(f"\n{name}, {torque:g} N m, {end}: {ours:.4f}, CalculiX {theirs:.4f} um: {1e2 * (ours / theirs - 1):+.3f} %")  # noqa: T201
    assert_allclose(ours, theirs, rtol=CORNER_RTOL)
    assert_allclose(theirs, known_um, rtol=RECORDED)
