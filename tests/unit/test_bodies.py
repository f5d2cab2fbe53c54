"""Gears as bodies of a multibody program: orientations, motion of the hubs, and forces by virtual work."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from pmor.dynamics.kernels.bodies import (
    ANGLE,
    EULER_PARAMETERS,
    MM,
    ROTATION_VECTOR,
    XYZ,
    GearBody,
    Meshing,
    gear_forces,
    gear_motion,
    orientation,
)

ROUND_OFF = 1e-12
# Central differences over a millionth.
DIFFERENCE = 1e-7
PITCH, RADIUS, MATE = 0.2, 40.0, 60.0
# To compile the kernels takes twenty seconds; those of exudyn's bodies are all that needs them.
pytestmark = pytest.mark.slow


def coordinates_of(kind, rotation):
    """Coordinates of a rotation, by another way than the kernel's."""
    if kind == EULER_PARAMETERS:
        return np.roll(rotation.as_quat(), 1)
    return rotation.as_euler("XYZ") if kind == XYZ else rotation.as_rotvec()


def skewed(matrix):
    return 0.5 * np.array([matrix[2, 1] - matrix[1, 2], matrix[0, 2] - matrix[2, 0], matrix[1, 0] - matrix[0, 1]])


@pytest.mark.parametrize("kind", [EULER_PARAMETERS, XYZ, ROTATION_VECTOR])
def test_orientations_are_those_of_scipy(kind, rng):
    for rotation in Rotation.random(20, random_state=rng):
        turned, _ = orientation(kind, coordinates_of(kind, rotation))
        assert_allclose(turned, rotation.as_matrix(), atol=ROUND_OFF)
    assert_allclose(orientation(ROTATION_VECTOR, np.zeros(3))[0], np.eye(3), atol=0.0)


@pytest.mark.parametrize("kind", [EULER_PARAMETERS, XYZ])
def test_rates_of_coordinates_make_the_angular_velocity(kind, rng):
    for rotation in Rotation.random(10, random_state=rng):
        q = coordinates_of(kind, rotation)
        rate = rng.standard_normal(len(q))
        if kind == EULER_PARAMETERS:
            rate -= (rate @ q) * q  # their length stays
        step = 1e-6
        ahead, behind = (orientation(kind, q + sign * step * rate)[0] for sign in (1.0, -1.0))
        turned, velocities = orientation(kind, q)
        spin = skewed((ahead - behind) / (2.0 * step) @ turned.T)
        assert_allclose(velocities @ rate, spin, atol=DIFFERENCE * np.abs(spin).max())


def body(kind, first, middle, place, axes, reference):
    """A body at a place whose gear has its middle elsewhere, turned by `reference` where coordinates are zero."""
    if kind == ANGLE:
        return GearBody(kind, first, first + 1, np.array([-1.0]), axes, *np.zeros((3, 3)), np.zeros((3, 3)))
    turned, known = reference.as_matrix(), coordinates_of(kind, reference)
    own, arm = np.ascontiguousarray(turned.T @ axes), turned.T @ (middle - place)
    last, origin = first + 3 + len(known), axes.T @ (place - middle)
    return GearBody(kind, first, last, known, own, arm, origin, np.zeros(3), np.zeros((3, len(known))))


def gears(kind, rng):
    """A pair whose axis is x of the program; the wheel with an arm and turned."""
    axes = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
    turned = Rotation.from_rotvec([0.4, -0.7, 0.2])
    pinion = body(kind, 0, np.zeros(3), np.zeros(3), axes, Rotation.identity())
    place = np.array([0.03, 0.1, -0.02])
    wheel = body(kind, pinion.last, np.array([0.0, 0.1, 0.0]), place, axes, turned)
    closing = np.r_[rng.standard_normal(5), RADIUS, rng.standard_normal(5), MATE]
    return (pinion, wheel), Meshing(axes, closing, PITCH, np.inf, 0.0)


def moved(kind, start, axes, spin, tilt):
    """Coordinates of a body that turns by `spin` about the axis and then by the vector `tilt`, in axes of the pair."""
    turned = Rotation.from_rotvec(axes @ tilt) * Rotation.from_rotvec(spin * axes[:, 2])
    if kind == ANGLE:
        return np.array([-spin])
    reference = Rotation.from_matrix(axes @ start.axes.T)
    return np.r_[np.zeros(3), coordinates_of(kind, turned * reference) - start.reference]


@pytest.mark.parametrize("kind", [ANGLE, EULER_PARAMETERS, XYZ, ROTATION_VECTOR])
def test_turns_and_tilts_are_told_apart(kind, rng):
    (pinion, wheel), meshing = gears(kind, rng)
    tilts = np.zeros((2, 3)) if kind == ANGLE else np.array([[2e-4, -1e-4, 0.0], [1e-4, 3e-4, 0.0]])
    turns = np.array([0.9, -0.6 + 1e-3])
    q = np.concatenate([
        moved(kind, one, meshing.axes, *how) for one, *how in zip((pinion, wheel), turns, tilts, strict=True)
    ])  # fmt: skip
    displacement = np.zeros(12)
    phi, advance, approach, speed = gear_motion((pinion, wheel), meshing, q, np.zeros_like(q), displacement)
    assert_allclose(phi, -turns[1] * MATE / RADIUS, atol=ROUND_OFF)
    assert_allclose(advance, turns[0] + turns[1] * MATE / RADIUS, atol=ROUND_OFF)
    assert_allclose(displacement.reshape(2, 6)[:, 3:], tilts, atol=1e-7)  # of the second order in tilts
    assert_allclose(approach, RADIUS * advance + meshing.closing @ displacement, rtol=ROUND_OFF)
    assert speed == 0.0


def test_angles_count_modulo_a_pitch(rng):
    bodies, meshing = gears(ANGLE, rng)
    expected = gear_motion(bodies, meshing, np.array([-0.5, 0.3335]), np.zeros(2), np.zeros(12))[1]
    for pitches in (-7, 1, 1000):
        q = np.array([-0.5 - pitches * PITCH, 0.3335])
        assert_allclose(gear_motion(bodies, meshing, q, np.zeros(2), np.zeros(12))[1], expected, atol=1e-10)


@pytest.mark.parametrize("kind", [ANGLE, EULER_PARAMETERS, XYZ, ROTATION_VECTOR])
def test_forces_on_coordinates_do_the_work_of_those_on_hubs(kind, rng):
    """Power of the generalised forces by rates = power of wrench and drag by the motion of the hubs, by differences."""
    bodies, meshing = gears(kind, rng)
    tilt = 1e-5 * np.ones(3)
    turned = zip(bodies, (0.7, 0.42), strict=True)
    q = np.concatenate([moved(kind, one, meshing.axes, turn, tilt) for one, turn in turned])
    rate, step = rng.standard_normal(len(q)), 1e-6
    if kind == EULER_PARAMETERS:
        for one in bodies:
            e = slice(one.first + 3, one.last)
            now = one.reference + q[e]
            rate[e] -= (rate[e] @ now) * now
    wrench = rng.standard_normal(12) * np.tile([1.0, 1.0, 1.0, 50.0, 50.0, 50.0], 2)
    forces, seen = np.zeros(len(q)), []
    # A rotation vector's rates are no derivatives of it.
    for sign in (1.0, -1.0):
        there = q + sign * step * rate
        if kind == ROTATION_VECTOR:
            for one in bodies:
                v = slice(one.first + 3, one.last)
                now = Rotation.from_rotvec(one.reference + q[v]) * Rotation.from_rotvec(sign * step * rate[v])
                there[v] = now.as_rotvec() - one.reference
        displacement = np.zeros(12)
        phi, advance, _, _ = gear_motion(bodies, meshing, there, rate, displacement)
        displacement[11] = -phi * RADIUS / MATE
        displacement[5] = phi + advance
        seen.append(displacement)
    motion = (seen[0] - seen[1]) / (2.0 * step)
    drag = 3.0
    speed = gear_motion(bodies, meshing, q, rate, np.zeros(12))[3]
    gear_forces(bodies, meshing, wrench, drag, forces)
    power = (wrench - drag * meshing.closing) @ motion / MM
    # Tilts of 1e-5 turn moments about the axis into such across it.
    assert_allclose(forces @ rate, power, rtol=1e-4, atol=1e-4 * np.abs(power).max())
    assert_allclose(speed, meshing.closing @ motion, rtol=1e-4)
