"""Directions of a planetary set in the machine, and how its hubs move with the members that stand on shafts.

The plan of a set has its axis along z, its first planet above the sun on the y axis, and a sun that is loaded
counter-clockwise (`pmor.sets.plan`). In the machine, the axis is x and y is y. Where the torque on the sun about x is
negative the set is seen from the other end, as pairs are.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.line.hubs import HUB
from pmor.line.train import IMAGE
from pmor.sets.layout import SECOND_PLANET
from pmor.sets.plan import SetPlan
from pmor.sets.settings import Member

MEMBERS: tuple[Member, ...] = ("sun", "carrier", "ring")
# Planets are carried by the carrier.
CARRIED_BY = {"sun": 0, "planet": 1, SECOND_PLANET: 1, "ring": 2}

# Of the hubs of all members, x and y of displacements and of rotations, and rotations about the axis.
ACROSS = np.concatenate([HUB * member + np.array([0, 1, 3, 4]) for member in range(len(MEMBERS))])
ABOUT = HUB * np.arange(len(MEMBERS)) + 5


class SetFrame(NamedTuple):
    """A planetary set in the machine.

    Attributes
    ----------
    turn : ndarray, shape (6, 6)
        Takes wrenches on a hub, and its displacements, from axes of the plan into those of the machine.
    carried : ndarray, shape (6 B, 18)
        Displacements of the hubs of all bodies, in axes of the plan, by those of sun, carrier and ring.
    """

    turn: FloatArray
    carried: FloatArray

    def in_machine(self, values: FloatArray) -> FloatArray:
        """Return wrenches on the hubs of the members, (18,) in axes of the plan, in those of the machine, (3, 6)."""
        return np.asarray(values.reshape(len(MEMBERS), HUB) @ self.turn.T)

    def in_plan(self, values: FloatArray) -> FloatArray:
        """Return wrenches on the hubs of the members, (3, 6) in axes of the machine, in those of the plan, (18,)."""
        return np.asarray((values @ self.turn).ravel())


def set_frame(plan: SetPlan, sense: float, off_mm: Sequence[float]) -> SetFrame:
    """Return the frame of a set.

    Parameters
    ----------
    sense : float
        Sign of the torque on the sun about x.
    off_mm : sequence of float, length 3
        x of the middle of the sun's face width against those of the hubs of sun, carrier and ring.
    """
    along = -sense if plan.clockwise else sense
    y, z = np.array([0.0, 1.0, 0.0]), np.array([along, 0.0, 0.0])
    turn = np.kron(np.eye(2), np.column_stack([np.cross(y, z), y, z]))
    carried = np.zeros((HUB * len(plan.bodies), HUB * len(MEMBERS)))
    for number, body in enumerate(plan.bodies):
        member = CARRIED_BY[body.member]
        arm = np.array([body.x, body.y, along * off_mm[member] + body.z])
        rows, columns = slice(HUB * number, HUB * (number + 1)), slice(HUB * member, HUB * (member + 1))
        carried[rows, columns] = np.eye(HUB)
        carried[HUB * number : HUB * number + 3, columns.start + 3 : columns.stop] = np.cross(np.eye(3), arm).T
    return SetFrame(turn * IMAGE if plan.clockwise else turn, carried)


def turned(values: FloatArray, angle: FloatArray | float) -> FloatArray:
    """Return wrenches on hubs, or their displacements, (..., 6 n), turned counter-clockwise by angles (...), rad."""
    found = values.reshape(*values.shape[:-1], -1, 2, 3).copy()
    across = found[..., :2] @ [1.0, 1j] * np.exp(1j * np.asarray(angle))[..., None, None]
    found[..., 0], found[..., 1] = across.real, across.imag
    return found.reshape(values.shape)
