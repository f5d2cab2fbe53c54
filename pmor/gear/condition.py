"""Conditions of a gear pair: torque, misalignment, deviations of the flanks.

A pair has gears, meshes and a contact scheme (`pmor.gear.meshed_pair.MeshedPair`). Its state depends on the pinion's
angle and on a condition: the torque on the pinion, the place of the wheel's axis, and the deviations of the flanks.
Shafts and housings deflect and have tolerances: the wheel's axis is off by some hundredths of a millimetre. The
finite-element models of the gears are made in frames of their own and do not depend on it.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated, TypeVar

from pmor.core.ranges import micrometres
from pmor.core.shown import brief
from pmor.core.wording import suggesting
from pmor.gear.modification import UNMODIFIED, Modification

T = TypeVar("T")
Deviation = Annotated[float, micrometres(-1000.0, 1000.0)]


@brief
@suggesting
@dataclass(frozen=True)
class Misalignment:
    """Offset and tilt of the wheel's axis as a rigid body; by default none.

    Deviations in and across the plane of the axes are those of ISO/TR 10064-3.

    Parameters
    ----------
    in_plane_um : float
        Deviation from parallel in the plane of the axes, over the face width: at the face with the larger z the axes
        are farther apart by half of it, um.
    out_of_plane_um : float
        Deviation across that plane, over the face width: at the face with the larger z the wheel's axis is off along
        +x by half of it, um.
    centre_distance_um : float
        Increase of the centre distance at mid width, um.
    """

    in_plane_um: Deviation = 0.0
    out_of_plane_um: Deviation = 0.0
    centre_distance_um: Deviation = 0.0

    @property
    def tilted(self) -> bool:
        """Whether the axes are not parallel."""
        return self.in_plane_um != 0.0 or self.out_of_plane_um != 0.0

    @property
    def spread(self) -> float:
        """Most that the gap between aligned flanks can differ over the face width, mm."""
        return 1e-3 * (abs(self.in_plane_um) + abs(self.out_of_plane_um))


ALIGNED = Misalignment()


@brief
@suggesting
@dataclass(frozen=True)
class Assembly:
    """Misalignment and modifications of a pair; by default aligned axes and plain involutes.

    Parameters
    ----------
    pinion, wheel : Modification
        Of their loaded flanks.
    """

    misalignment: Misalignment = ALIGNED
    pinion: Modification = UNMODIFIED
    wheel: Modification = UNMODIFIED

    @property
    def modified(self) -> bool:
        """Whether any flank deviates from the involute helicoid."""
        return self.pinion.present or self.wheel.present

    @property
    def uneven(self) -> bool:
        """Whether teeth of a gear differ."""
        return bool(self.pinion.tooth_keys or self.wheel.tooth_keys)

    @property
    def of_teeth(self) -> Assembly:
        """What differs from tooth to tooth, alone."""
        return Assembly(self.misalignment, self.pinion.of_teeth, self.wheel.of_teeth)

    @property
    def alike(self) -> Assembly:
        """What all teeth of a gear have."""
        return Assembly(self.misalignment, self.pinion.alike, self.wheel.alike)

    @property
    def backs_mirror_flanks(self) -> bool:
        """Whether the coast flanks touch as mirror images of the drive flanks, of the same modifications."""
        return not self.misalignment.tilted and self.pinion.mirrored and self.wheel.mirrored

    @property
    def spread(self) -> float:
        """Most that the gap can differ over the flanks from that of aligned involutes, mm."""
        return self.misalignment.spread + self.flank_spread

    @property
    def flank_spread(self) -> float:
        """Most that deviations of both flanks can differ from place to place and from tooth to tooth, mm."""
        return 1e-3 * (self.pinion.largest_um + self.wheel.largest_um)


PLAIN = Assembly()


@dataclass(frozen=True, kw_only=True)
class Condition:
    """Everything that a state of a pair depends on beside the pinion's angle.

    Parameters
    ----------
    torque : float
        On the pinion, N mm, positive.
    pinion, wheel : Modification
        Of their loaded flanks.
    """

    torque: float
    misalignment: Misalignment = ALIGNED
    pinion: Modification = UNMODIFIED
    wheel: Modification = UNMODIFIED

    @property
    def assembly(self) -> Assembly:
        """Axes and flanks."""
        return Assembly(self.misalignment, self.pinion, self.wheel)

    @property
    def torque_Nm(self) -> float:
        """The torque in N m as it was written: rid of what changing its unit to and fro leaves in the last digits."""
        return float(f"{1e-3 * self.torque:.12g}")

    @property
    def load_text(self) -> str:
        """The load of the pair, for messages."""
        return f"torque = {self.torque * 1e-3:.6g} N m"


def at_torques(
    torques: Iterable[float],
    misalignment: Misalignment = ALIGNED,
    pinion: Modification = UNMODIFIED,
    wheel: Modification = UNMODIFIED,
) -> tuple[Condition, ...]:
    """Return a condition for each torque (N mm), with the same axes and flanks."""
    return tuple(
        Condition(torque=float(torque), misalignment=misalignment, pinion=pinion, wheel=wheel) for torque in torques
    )


def common_misalignment(conditions: Iterable[Condition | Assembly]) -> Misalignment:
    """Return the axes of conditions that are solved together, whose flanks may differ.

    Raises
    ------
    ValueError
        When they differ, or there is no condition.
    """
    return _common((condition.misalignment for condition in conditions), "axes")


def common_build(conditions: Iterable[Condition]) -> Assembly:
    """Return the axes and flanks of conditions that are solved together.

    Raises
    ------
    ValueError
        When they differ, or there is no condition.
    """
    return _common((condition.assembly for condition in conditions), "axes and flanks")


def _common(values: Iterable[T], name: str) -> T:
    unlike = set(values)
    if len(unlike) != 1:
        raise ValueError(f"conditions that are solved together need the same {name}, not {len(unlike)} of them")
    return unlike.pop()
