"""The force of a gear mesh on both gears, as a force and a moment on each hub.

The case of a pair has its pinion's axis along z, the wheel at y = a, which is negative of a ring, and a pinion that
drives counter-clockwise about z. In the machine, axes are x. Where the pinion's torque about x is negative the pair is
seen from the other end.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.gear.pair import GearPair


class MeshFrame(NamedTuple):
    """Directions of the case's axes in the machine.

    Attributes
    ----------
    axes : ndarray, shape (3, 3)
        Columns: x, y, z of the case.
    """

    axes: FloatArray

    @property
    def turn(self) -> FloatArray:
        """Matrix that takes wrenches on a hub, and its displacements, from axes of the case to the machine's, (6, 6).

        Of an image, x to -x, moments and rotations have the other sign.
        """
        return np.asarray(np.kron(np.diag([1.0, self.hand]), self.axes), dtype=np.float64)

    @property
    def hand(self) -> float:
        """-1 of an image, +1 of others."""
        return float(np.sign(np.linalg.det(self.axes)))

    @property
    def along(self) -> float:
        """+1 where z of the case is x of the machine, -1 where it points the other way."""
        return float(self.axes[0, 2])


def mesh_frame(pinion_at: FloatArray, wheel_at: FloatArray, sense: float, ring: bool = False) -> MeshFrame:
    """Return the frame of a pair.

    Parameters
    ----------
    pinion_at, wheel_at : ndarray, shape (2,)
        y and z of the axes, mm.
    sense : float
        Sign of the pinion's torque about x.
    ring : bool
        The wheel is a ring: its axis is on the other side of the pinion's.
    """
    across = pinion_at - wheel_at if ring else wheel_at - pinion_at
    y = np.array([0.0, *(across / np.linalg.norm(across))])
    z = np.array([sense, 0.0, 0.0])
    return MeshFrame(np.column_stack([np.cross(y, z), y, z]))


def normal_of(pair: GearPair) -> FloatArray:
    """Return the force on the wheel of a unit force in the transverse plane, in axes of the case, shape (3,).

    The base helix angle adds the axial part: a right-handed pinion that drives counter-clockwise is pushed along +z.
    """
    angle = pair.working_pressure_angle
    return np.array([-math.cos(angle), math.sin(angle), -math.tan(pair.base_helix_angle)])


def hub_wrenches(pair: GearPair, frame: MeshFrame) -> FloatArray:
    """Return forces and moments on pinion and wheel by a unit force at the pitch point, in axes of the machine.

    Returns
    -------
    ndarray, shape (2, 6)
        N and N mm about the middles of both gears.
    """
    pitch_radius = pair.centre_distance * pair.pinion.base_radius / pair.base_distance
    found = []
    for sign, arm in ((-1.0, pitch_radius), (1.0, pitch_radius - pair.centre_distance)):
        force = sign * frame.axes @ normal_of(pair)
        found.append(np.concatenate([force, np.cross(arm * frame.axes[:, 1], force)]))
    return np.array(found)


def f_beta_um(pair: GearPair, displacement: FloatArray) -> FloatArray:
    """Return the misalignment F_beta: by how much more the flanks overlap at the end with the larger z, um.

    It is the face width times the difference of the slopes of both hubs along the transverse line of action, shafts
    alone: without deviations of the flanks, and before these adapt.

    Parameters
    ----------
    displacement : ndarray, shape (..., 2, 6)
        Of both hubs, in axes of the pair, mm and rad.
    """
    angle = pair.working_pressure_angle
    slopes = -math.cos(angle) * displacement[..., 4] - math.sin(angle) * displacement[..., 3]
    return np.asarray(1e3 * pair.face_width * (slopes[..., 0] - slopes[..., 1]))
