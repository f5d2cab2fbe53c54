"""A gear pair with meshed flanks: geometry, kinematics and deviations, shared by line contact and penalty contact."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

from pmor.core.arrays import FloatArray
from pmor.gear.clearance import refuse_working_geometry
from pmor.gear.condition import ALIGNED, Assembly, Misalignment
from pmor.gear.flank_deviation import kernel_deviation
from pmor.gear.kernels.deviation import Deviation
from pmor.gear.kernels.motion import axial_opening, section_offset
from pmor.gear.kernels.types import Gear, Kinematics
from pmor.gear.modification import Modification
from pmor.gear.pair import GearPair
from pmor.gear.tip_edge import TipEdge
from pmor.gear.tooth import Tooth

K = TypeVar("K")
V = TypeVar("V")

# Most misalignments, and most modifications, whose kernel data is kept.
MOST_KEPT = 64


@dataclass(frozen=True)
class Flank:
    """Loaded flank of a gear, undeformed, in the tooth frame.

    Parameters
    ----------
    nodes : ndarray, shape (n + 1, m + 1, 3)
        From the start of the involute to the tip, along +z, mm.
    roll_angle : ndarray, shape (n + 1,)
        rad.
    """

    nodes: FloatArray
    roll_angle: FloatArray

    @property
    def columns(self) -> int:
        """Number of nodes along the width."""
        return self.nodes.shape[1]


@dataclass(frozen=True)
class MeshedPair:
    """A gear pair with meshed flanks.

    Parameters
    ----------
    stiffness_estimate : float
        Rough stiffness of one tooth pair along the line of action, N/mm: where searches start, how large windows are.
    mirrored : bool
        The flanks are halves up to a plane of symmetry at mid width; every contact point counts twice.
    order : int
        Intervals between nodes along the edge of an element.
    """

    pair: GearPair
    pinion: Flank
    wheel: Flank
    stiffness_estimate: float
    mirrored: bool = False
    order: int = 1

    @cached_property
    def tooth_pair_count(self) -> int:
        """Largest number of tooth pairs that can touch together."""
        return self.pair.most_touching_pairs

    def kinematics(self, misalignment: Misalignment) -> Kinematics:
        """Kinematics for the kernels, with the wheel's axis in a place.

        Raises
        ------
        GeometryError
            Where the pair does not mesh there.
        """
        return _kept(self._kinematics, misalignment, self._make_kinematics)

    def _make_kinematics(self, misalignment: Misalignment) -> Kinematics:
        pair, width = self.pair, self.pair.face_width
        if misalignment != ALIGNED:
            refuse_working_geometry(pair, [misalignment])
        (start, end), (low, high) = pair.roll_position_range, pair.common_face
        apart = math.copysign(1e-3, pair.centre_distance)
        kinematics = Kinematics(
            action_length=pair.action_length,
            pressure_angle=pair.working_pressure_angle,
            centre_distance=pair.centre_distance,
            pitch=pair.pitch,
            path_start=start,
            path_end=end,
            offset_y=apart * misalignment.centre_distance_um,
            slope_x=1e-3 * (misalignment.out_of_plane_um / width),
            slope_y=apart * (misalignment.in_plane_um / width),
            face_low=low,
            face_high=high,
        )
        # The gap is a function of z and one of the roll angle, added: the least of both meet at a corner of the face.
        across = min(section_offset(kinematics, self.gears, z)[3] for z in (low, high))
        along = min(axial_opening(kinematics, self.gears, roll) for roll in pair.pinion_roll_range)
        return kinematics._replace(first_touch=(across + along) / pair.pinion.base_radius)

    @cached_property
    def _kinematics(self) -> dict[Misalignment, Kinematics]:
        return {}

    @cached_property
    def _deviations(self) -> dict[tuple[Modification, Modification], tuple[Deviation, Deviation]]:
        return {}

    @cached_property
    def gears(self) -> tuple[Gear, Gear]:
        """Flanks of pinion and wheel for the kernels."""
        flanks, teeth = (self.pinion, self.wheel), (self.pair.pinion, self.pair.wheel)
        pinion, wheel = map(_gear, flanks, teeth, self.pair.tip_edges)
        return pinion, wheel

    def deviations(self, assembly: Assembly) -> tuple[Deviation, Deviation]:
        """Return the deviations of pinion and wheel for the kernels."""
        return _kept(self._deviations, (assembly.pinion, assembly.wheel), self._make_deviations)

    def _make_deviations(self, modifications: tuple[Modification, Modification]) -> tuple[Deviation, Deviation]:
        pair, (pinion, wheel) = self.pair, modifications
        active, faces = pair.active_rolls, pair.faces
        of_pinion = kernel_deviation(pinion, pair.pinion, active[0], faces[0])
        return of_pinion, kernel_deviation(wheel, pair.wheel, active[1], faces[1])

    def expected_approach(self, torque: float) -> float:
        """Return the approach of the flanks to expect under a pinion torque (N mm), mm."""
        return torque / self.pair.pinion.base_radius / self.stiffness_estimate

    def expected_closing(self, torque: float, misalignment: Misalignment) -> float:
        """Return how far the first touching sections of flanks on tilted axes close up under a torque (N mm), mm.

        The gap grows evenly over the face width, which carries load as far as it is closed, like a bed of springs.
        """
        approach, spread = self.expected_approach(torque), misalignment.spread
        return approach + 0.5 * spread if approach > 0.5 * spread else math.sqrt(2.0 * approach * spread)


def _kept(known: dict[K, V], key: K, make: Callable[[K], V]) -> V:
    """Return the stored value of a key, made where it is missing; a full store is emptied first."""
    if key not in known:
        if len(known) >= MOST_KEPT:
            known.clear()
        known[key] = make(key)
    return known[key]


def _gear(flank: Flank, tooth: Tooth, edge: TipEdge) -> Gear:
    return Gear(
        nodes=flank.nodes,
        roll=flank.roll_angle,
        base_radius=tooth.base_radius,
        form_roll=tooth.form_roll_angle,
        tip_roll=edge.roll_angle,
        half_angle=tooth.base_half_angle,
        twist=tooth.twist_per_length,
        edge_radius=edge.radius,
        undercut_roll=tooth.form_roll_angle if tooth.is_undercut else 0.0,
    )
