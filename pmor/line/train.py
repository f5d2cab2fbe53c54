"""Gears of a train, and its meshes: each a pair of its own, with the line of centres at some angle.

Where the pinion of a mesh drives clockwise it is the image of a pair, x to -x, that drives counter-clockwise: teeth
count the other way round there, and helices have the other hand.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pmor.body.far_compliance import FarCompliance
from pmor.body.rim import RimMotion
from pmor.body.root_stress import RootStressShapes
from pmor.body.support import Support
from pmor.case.blank import HolesCase
from pmor.core.arrays import FloatArray
from pmor.core.conventions import rotation_z
from pmor.gear.condition import Assembly
from pmor.gear.pair import GearPair
from pmor.line.pair import LinePair

IMAGE = np.array([-1.0, 1.0, 1.0, 1.0, -1.0, -1.0])


@dataclass(frozen=True)
class TrainMesh:
    """A mesh of a train.

    Parameters
    ----------
    pair : LinePair
        In its own frame; of a mesh whose pinion drives clockwise the image. Equal meshes share it.
    bodies : (int, int)
        Of pinion and wheel.
    direction : float
        From the pinion, of the y axis of the pair, counter-clockwise from that of the train, rad.
    image : bool
        Whether the pair is the image of the mesh.
    start, rate : float
        Pinion's angle in the frame of the pair at angle 0 of the train, rad, and by how much it turns with it.
    first_tooth : (int, int)
        Number on its body, in the frame of the pair, of the tooth that the pair counts as 0.
    assembly : Assembly
        Flanks of pinion and wheel.
    """

    pair: LinePair
    bodies: tuple[int, int]
    direction: float
    image: bool
    start: float
    rate: float
    first_tooth: tuple[int, int] = (0, 0)
    assembly: Assembly = Assembly()

    @cached_property
    def to_train(self) -> FloatArray:
        """Matrix that takes wrenches on the hub of a gear from the frame of the pair to that of the train, (6, 6)."""
        return to_train(self.direction, self.image)

    @cached_property
    def smooth_rows(self) -> FloatArray:
        """Wrenches on both hubs by a unit force at the pitch point, in axes of the train, (2, 6)."""
        return smooth_rows(self.pair.meshed.pair, self.direction, self.image)


def to_train(direction: float, image: bool) -> FloatArray:
    """Return the matrix that takes wrenches on a hub from the frame of a pair to that of a train, (6, 6).

    Parameters
    ----------
    direction, image
        As in `TrainMesh`.
    """
    turn = np.kron(np.eye(2), rotation_z(direction))
    return np.asarray(turn * IMAGE if image else turn)


def smooth_rows(pair: GearPair, direction: float = 0.0, image: bool = False, coast: bool = False) -> FloatArray:
    """Return wrenches on the hubs of pinion and wheel by a unit force along the line of action at the pitch point.

    By displacements of the hubs they say by how much the flanks part.

    Parameters
    ----------
    direction, image
        As in `TrainMesh`; by default axes of the pair.
    coast : bool
        Of the flanks that do not carry.

    Returns
    -------
    ndarray, shape (2, 6)
        In axes of the train, N and N mm.
    """
    alpha, side = pair.working_pressure_angle, -1.0 if coast else 1.0
    force = np.array([side * math.cos(alpha), -math.sin(alpha), side * math.tan(pair.base_helix_angle)])
    radius, rows = pair.pinion.base_radius / math.cos(alpha), []
    for sign, arm in ((1.0, radius), (-1.0, radius - pair.centre_distance)):
        moment = arm * force[2], 0.0, -arm * force[0]
        rows.append(to_train(direction, image) @ (sign * np.array([*force, *moment])))
    return np.stack(rows)


@dataclass(frozen=True)
class TrainBody:
    """A gear of a train.

    Parameters
    ----------
    name : str
    teeth : int
    far : FarCompliance or None
        Between teeth that are in mesh at several places; None of gears with a single mesh.
    image : bool
        Whether `far` and `root_stress` are those of its image: of a gear all of whose meshes are images.
    root_stress : RootStressShapes or None
        Where it was asked for.
    support : Support or None
        Of a ring at lugs, or a gear with holes: by what its teeth differ; as `far`, in its image where that is.
    other_stress : RootStressShapes or None
        Of the other flanks, where these are unlike.
    holes : HolesCase or None
        Of its web, whose places count from the middle of tooth 0; as `far`, in its image where that is.
    rim_motion : RimMotion or None
        Of a ring, all of whose meshes load the same side of its teeth.
    """

    name: str
    teeth: int
    far: FarCompliance | None = None
    image: bool = False
    root_stress: RootStressShapes | None = None
    support: Support | None = None
    other_stress: RootStressShapes | None = None
    holes: HolesCase | None = None
    rim_motion: RimMotion | None = None
