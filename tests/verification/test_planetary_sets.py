"""Identities of planetary sets: phasing, balance, and how planets share the load (FIELD, section 9)."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.support.small_sets import MODULE, RING, SUN, mean_forces, planetary

TORQUE = 1e5
# Of the mean: what rounding leaves of orders that the phasing of equal planets forbids.
FORBIDDEN = 1e-8
# Sets whose planets are all in the same phase: teeth, neighbours and assembly go together.
IN_PHASE = {3: (18, 18, 54), 4: (20, 20, 60), 5: (20, 20, 60), 6: (36, 18, 72)}
# One pin ahead by e, over k e: the part of it that is no movement of the sun, which floats.
FLOATING = {
    3: (0.0, 0.0, 0.0),
    4: (0.25, -0.25, 0.25, -0.25),
    5: (0.4, -0.32361, 0.12361, 0.12361, -0.32361),
    6: (1 / 2, -1 / 3, 0.0, 1 / 6, 0.0, -1 / 3),
}
# mm; of the forces by it, with which meshes get stiffer.
AHEAD, LINEAR = 1e-5, 2e-3


def loads(train, torque=TORQUE):
    return np.r_[torque, np.zeros(len(train.free) - 1)]


def angles(train, count):
    return np.linspace(0.0, train.meshes[0].pair.meshed.pair.pitch, count, endpoint=False)


def rigid(train):
    """The same set, whose meshes do not feel each other through the bodies of its gears."""
    return replace(train, bodies=tuple(replace(body, far=None) for body in train.bodies))


@pytest.mark.parametrize(
    ("floating", "helix", "width"), [(False, 0.0, "half"), (True, 0.0, "half"), (True, 12.0, "whole")]
)
def test_orders_that_phasing_forbids_are_not_there(floating, helix, width):
    """Planets follow each other by a third of a pitch: of the orders of the mesh every third one is left."""
    train = planetary(3, floating, helix=helix, width=width)[1]
    found = train.place(angles(train, 18)).solve(loads(train))
    assert found.converged.all()
    orders = np.abs(np.fft.rfft(found.movement[0, :, 0])) / 18
    allowed = np.arange(len(orders)) % 3 == 0
    assert (orders[~allowed] < FORBIDDEN * orders[0]).all()
    assert orders[3] > 1e-4 * orders[0]


def test_equal_planets_in_phase_share_equally_and_leave_the_sun_alone():
    train = planetary(3, True, IN_PHASE[3])[1]
    placed = train.place(angles(train, 4))
    found = placed.solve(loads(train))
    forces = mean_forces(placed, found).reshape(4, 3, 2)
    assert_allclose(forces, np.broadcast_to(forces[:, :1], forces.shape), rtol=1e-9)
    assert_allclose(found.movement[0, :, -2:], 0.0, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("floating", [False, True])
def test_torques_are_as_the_tooth_numbers(floating):
    """At each angle those of sun, ring and carrier add up; over a mesh cycle they are as the tooth numbers."""
    cases, train = planetary(3, floating)
    placed = train.place(angles(train, 24))
    distance = cases["sun"].pair.pinion.teeth + cases["sun"].pair.wheel.teeth
    around = 0.5 * MODULE * distance * np.exp(2j * np.pi * (np.arange(3) / 3 + 0.25))
    centres = [0.0, 0.0, *around]
    found = placed.solve(loads(train))
    assert found.converged.all()
    # About the axis, of all meshes on sun, ring and the pins of the planets.
    about = {"sun": 0.0, "ring": 0.0, "carrier": 0.0}
    for one in placed.placed:
        wrench = np.einsum("ang,an->ag", one.rows.reshape(24, -1, 12), found.force[0][:, one.part]).reshape(24, 2, 6)
        for gear, body in enumerate(one.mesh.bodies):
            x, y = np.real(centres[body]), np.imag(centres[body])
            moment = wrench[:, gear, 5] + x * wrench[:, gear, 1] - y * wrench[:, gear, 0]
            about[placed.train.bodies[body].name if body < 2 else "carrier"] += moment
    assert_allclose(about["sun"] + about["ring"] + about["carrier"], 0.0, rtol=0.0, atol=1e-8 * TORQUE)
    mean = {name: float(np.mean(value)) for name, value in about.items()}
    # A corner that carries meets its mate off the line of action.
    assert_allclose(mean["ring"] / mean["sun"], RING / SUN, rtol=1e-3)
    assert_allclose(mean["carrier"] / mean["sun"], -(SUN + RING) / SUN, rtol=1e-3)


def by_a_pin_ahead(train, planets, teeth):
    """Change of the forces on the sun by a first planet that stands ahead, mean over the angles, N/mm."""
    found = []
    for ahead in (0.0, AHEAD):
        displacement = np.zeros(6 * len(train.bodies))
        displacement[6 * 2] = ahead  # the first planet stands on the y axis
        placed = train.place(angles(train, 2), displacement)
        solved = placed.solve(loads(train, 1e6))
        assert solved.converged.all()
        found.append(mean_forces(placed, solved)[:, ::2])
    return (found[1] - found[0]).mean(axis=0) / AHEAD


@pytest.mark.parametrize("planets", [3, 4, 5, 6])
def test_a_pin_ahead_shares_the_load_as_springs_do(planets):
    teeth = IN_PHASE[planets]
    held, floating = (planetary(planets, floats, teeth)[1] for floats in (False, True))
    change = by_a_pin_ahead(rigid(held), planets, teeth)
    k = change[0] / (1.0 - 1.0 / planets)
    assert k > 0.0
    assert_allclose(change[1:] / k, -1.0 / planets, rtol=LINEAR)
    shared = by_a_pin_ahead(rigid(floating), planets, teeth) / k
    assert_allclose(shared, FLOATING[planets], rtol=0.0, atol=LINEAR)
    # In one body the meshes of the sun feel each other, which makes planets against each other up to a fifth stiffer.
    coupled = by_a_pin_ahead(floating, planets, teeth) / k
    assert_allclose(coupled, coupled[0] / max(FLOATING[planets][0], 1e-3) * np.array(FLOATING[planets]), atol=0.01)


def test_a_planet_that_a_pin_error_unloads_carries_nothing_and_the_others_all():
    train = planetary(3, False, IN_PHASE[3])[1]
    displacement = np.zeros(6 * len(train.bodies))
    displacement[6 * 2] = -1.0
    placed = train.place(angles(train, 3), displacement)
    found = placed.solve(loads(train))
    assert found.converged.all()
    forces = mean_forces(placed, found).reshape(3, 3, 2)
    assert_allclose(forces[:, 0], 0.0, rtol=0.0, atol=1e-6)
    assert_allclose(forces[:, 1:, 0].sum(axis=1), TORQUE / train.meshes[0].pair.base_radius, rtol=1e-2)
