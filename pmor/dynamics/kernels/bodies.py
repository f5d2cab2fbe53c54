"""Gears as bodies of a multibody program: from their coordinates to what a mesh feels, and its forces back onto them.

The program counts in metres and its own axes, with coordinates of its own for rotations; a mesh in millimetres and the
axes of the pair. With G the angular velocity per rate of the coordinates, moments act on these as G^T M (virtual work).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.compiling import allocating
from pmor.line.kernels.hubs import contact_of_hubs

# Coordinates of a rotation: an angle about a fixed axis; four Euler parameters; angles about x, y and z, each in axes
# that the ones before have turned; a rotation vector, whose rates are the angular velocity in the body's own axes.
ANGLE, EULER_PARAMETERS, XYZ, ROTATION_VECTOR = 0, 1, 2, 3
# Half a turn about the line of centres takes a pair to itself, and the backs of its teeth to where flanks were.
HALF_TURN = np.array([-1.0, 1.0, -1.0, -1.0, 1.0, -1.0, -1.0, 1.0, -1.0, -1.0, 1.0, -1.0])
# Radians below which a rotation vector has its linear terms alone.
SMALL = 1e-6
MM = 1e3


class GearBody(NamedTuple):
    """A gear as a body.

    Attributes
    ----------
    rotation : int
        `ANGLE`, `EULER_PARAMETERS`, `XYZ` or `ROTATION_VECTOR`.
    first, last : int
        Of its coordinates, the last one excluded: an angle alone, or a displacement and a rotation.
    reference : ndarray, shape (1,), (3,) or (4,)
        Rotation where coordinates are zero; of an angle, 1 where it counts about z of the pair, -1 against it.
    axes : ndarray, shape (3, 3)
        Columns: axes of the pair, in those of the body.
    arm : ndarray, shape (3,)
        From the body's own point to the middle of its teeth, in axes of the body, m.
    origin : ndarray, shape (3,)
        Of the body's own point, seen from where the drawing has the middle of the teeth, in axes of the pair, m.
    arm_now : ndarray, shape (3,)
        The arm where the body is, in axes of the pair.
    spins : ndarray, shape (3, 3) or (3, 4)
        G where the body is, in axes of the pair.
    """

    rotation: int
    first: int
    last: int
    reference: FloatArray
    axes: FloatArray
    arm: FloatArray
    origin: FloatArray
    arm_now: FloatArray
    spins: FloatArray


class Meshing(NamedTuple):
    """How two gears mesh.

    Attributes
    ----------
    axes : ndarray, shape (3, 3)
        Columns: axes of the pair, in those of the program.
    closing : ndarray, shape (12,)
        Approach of the flanks along the line of action per displacement (mm) and rotation of both hubs, mm.
    pitch : float
        Of the pinion, rad.
    backlash : float
        Along the line of action, mm; infinite where the backs of teeth carry nothing.
    damping : float
        N s/mm.
    """

    axes: FloatArray
    closing: FloatArray
    pitch: float
    backlash: float
    damping: float


@allocating
def orientation(rotation, q):
    """Return the rotation matrix of a body, and G, from the coordinates of its rotation."""
    if rotation == EULER_PARAMETERS:
        fixed = np.array([[-q[1], q[0], -q[3], q[2]], [-q[2], q[3], q[0], -q[1]], [-q[3], -q[2], q[1], q[0]]])
        own = np.array([[-q[1], q[0], q[3], -q[2]], [-q[2], -q[3], q[0], q[1]], [-q[3], q[2], -q[1], q[0]]])
        return fixed @ own.T, 2.0 * fixed
    if rotation == XYZ:
        s, c = np.sin(q), np.cos(q)
        first = np.array([[1.0, 0.0, 0.0], [0.0, c[0], -s[0]], [0.0, s[0], c[0]]])
        second = first @ np.array([[c[1], 0.0, s[1]], [0.0, 1.0, 0.0], [-s[1], 0.0, c[1]]])
        third = second @ np.array([[c[2], -s[2], 0.0], [s[2], c[2], 0.0], [0.0, 0.0, 1.0]])
        return third, np.array([[1.0, first[0, 1], second[0, 2]], [0.0, first[1, 1], second[1, 2]],
                                [0.0, first[2, 1], second[2, 2]]])  # fmt: skip
    skew = np.array([[0.0, -q[2], q[1]], [q[2], 0.0, -q[0]], [-q[1], q[0], 0.0]])
    angle = np.sqrt(q @ q)
    turned = np.eye(3) + skew
    if angle > SMALL:
        turned = np.eye(3) + np.sin(angle) / angle * skew + (1.0 - np.cos(angle)) / angle**2 * (skew @ skew)
    return turned, turned


@allocating
def gear_motion(bodies, meshing, coordinates, rates, displacement):
    """Find how both gears stand and move.

    Parameters
    ----------
    bodies : two GearBody
        Of pinion and wheel; what is of now is filled.
    meshing : Meshing
    coordinates, rates : ndarray, shape (n,)
        Of both bodies, from where displacements are zero.
    displacement : ndarray, shape (12,)
        Filled: of both hubs, without their rotation about the axis, mm and rad.

    Returns
    -------
    tuple of (float, float, float, float)
        Pinion's kinematic angle, to which the wheel is turned, and its advance, rad; the approach of the flanks, mm,
        and its speed, mm/s.
    """
    into, closing = meshing.axes.T, meshing.closing
    angles, speed = np.zeros(2), 0.0
    for gear in range(2):
        body, hub = bodies[gear], slice(6 * gear, 6 * gear + 6)
        q, rate = coordinates[body.first : body.last], rates[body.first : body.last]
        if body.rotation == ANGLE:
            angles[gear] = body.reference[0] * q[0]
            speed += closing[hub][5] * body.reference[0] * rate[0]
            continue
        turned, spins = orientation(body.rotation, body.reference + q[3:])
        turned, moved = into @ turned, displacement[hub]
        body.arm_now[:], body.spins[:] = turned @ body.arm, into @ spins
        moved[:3] = MM * (body.origin + into @ q[:3] + body.arm_now)
        seen = turned @ body.axes
        angles[gear] = np.arctan2(seen[1, 0] - seen[0, 1], seen[0, 0] + seen[1, 1])
        moved[3], moved[4] = -seen[1, 2], seen[0, 2]
        spin = body.spins @ rate[3:]
        speed += MM * (closing[hub][:3] @ (into @ rate[:3] + np.cross(spin, body.arm_now))) + closing[hub][3:] @ spin
    ratio, radius = closing[11] / closing[5], closing[5]
    advance = angles[0] + ratio * angles[1]
    # Teeth are alike, and angles of bodies end after a turn.
    advance -= meshing.pitch * np.round(advance / meshing.pitch)
    return -ratio * angles[1], advance, radius * advance + closing @ displacement, speed


@allocating
def gear_forces(bodies, meshing, wrench, drag, forces):
    """Fill the generalised forces on all coordinates of both bodies, N and N m, where `gear_motion` found them.

    Parameters
    ----------
    bodies, meshing
        As in `gear_motion`.
    wrench : ndarray, shape (12,)
        Forces and moments on both hubs, in axes of the pair, N and N mm.
    drag : float
        Force of damping against the approach of the flanks, N.
    forces : ndarray, shape (n,)
    """
    for gear in range(2):
        body, hub = bodies[gear], slice(6 * gear, 6 * gear + 6)
        on_hub = wrench[hub] - drag * meshing.closing[hub]
        if body.rotation == ANGLE:
            forces[body.first] = body.reference[0] * on_hub[5] / MM
            continue
        forces[body.first : body.first + 3] = meshing.axes @ on_hub[:3]
        moment = on_hub[3:] / MM + np.cross(body.arm_now, on_hub[:3])
        forces[body.first + 3 : body.last] = body.spins.T @ moment


@allocating
def mesh_of_gears(bodies, meshing, contact, placed, coordinates, rates, displacement, forces):
    """Fill the forces of a mesh on all coordinates of both gears, from line loads where these are.

    Parameters
    ----------
    contact, placed
        As in `contact_of_hubs`: wrenches there are those on the hubs.
    bodies, meshing, coordinates, rates, displacement
        As in `gear_motion`; under the backs of teeth displacements are seen after half a turn.
    forces : ndarray, shape (n,)
        As in `gear_forces`.

    Returns
    -------
    tuple of (bool, bool, float, float)
        Whether contact was found, and whether some section is overloaded; the pinion's kinematic angle and its
        advance, rad.
    """
    phi, advance, approach, speed = gear_motion(bodies, meshing, coordinates, rates, displacement)
    if approach > -0.5 * meshing.backlash:
        converged, overloaded = contact_of_hubs(contact, placed, phi, advance, displacement)
    else:
        play = meshing.backlash / meshing.closing[5]
        displacement *= HALF_TURN
        converged, overloaded = contact_of_hubs(contact, placed, play - phi, -advance - play, displacement)
        placed.wrench[:] *= HALF_TURN
    gear_forces(bodies, meshing, placed.wrench, meshing.damping * speed, forces)
    return converged, overloaded, phi, advance
