"""Kinematics of gears that mesh with several others: where teeth stand, and which flanks carry.

Axes stand still: a planetary set is seen from its carrier. Angles are counter-clockwise from the y axis of the train. A
gear that drives clockwise makes the image of a pair (`pmor.line.several`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from pmor.core.errors import GeometryError
from pmor.gear.pair import GearPair

# Of a pitch: teeth that miss each other by less are taken to meet.
MISSES = 1e-6


class Centre(NamedTuple):
    """Axis of a gear, mm."""

    name: str
    x: float
    y: float


class Meeting(NamedTuple):
    """A mesh: its pair, and the numbers of the bodies that are its pinion and its wheel; the pinion drives."""

    pair: GearPair
    pinion: int
    wheel: int


class Placement(NamedTuple):
    """How a mesh stands in the train: as in `pmor.line.several.TrainMesh`."""

    direction: float
    image: bool
    start: float
    rate: float
    first_tooth: tuple[int, int]


def torque_ratios(teeth: tuple[int, int]) -> dict[str, float]:
    """Return what the torques on sun, ring and carrier from outside are in the ratio of.

    Speeds that are weighted with it add up to 0 (Willis 1841).

    Parameters
    ----------
    teeth : (int, int)
        Of sun and ring.
    """
    return {"sun": teeth[0], "ring": teeth[1], "carrier": -sum(teeth)}


def member_speeds(teeth: tuple[int, int], on: str, held: str, speed: float) -> dict[str, float]:
    """Return the speeds of sun, ring and carrier of a planetary set (Willis 1841), in the unit of `speed`.

    Parameters
    ----------
    teeth : (int, int)
        Of sun and ring.
    on, held : {"sun", "ring", "carrier"}
        Member that has the speed, and the one that stands still.
    """
    weights, found = torque_ratios(teeth), {on: speed, held: 0.0}
    last = next(member for member in weights if member not in found)
    found[last] = -weights[on] * speed / weights[last]
    return {member: found[member] for member in weights}


class _Turn(NamedTuple):
    """A gear: sense in which it drives or is driven, angle of its tooth 0 at 0 and by how much it turns."""

    sense: int
    start: float
    rate: float


def placements(centres: Sequence[Centre], meetings: Sequence[Meeting]) -> tuple[Placement, ...]:
    """Return how the meshes of a train stand; the pinion of the first one drives counter-clockwise.

    Raises
    ------
    GeometryError
        When gears are driven both ways, or teeth do not meet.
    """
    turns = {meetings[0].pinion: _Turn(1, 0.0, 1.0)}
    found = []
    for meeting in meetings:
        if meeting.pinion not in turns:
            name = centres[meeting.pinion].name
            raise GeometryError(f"gear {name}: drives before anything drives it: list meshes from the driven gear on")
        own, pair = turns[meeting.pinion], meeting.pair
        direction = _direction(centres[meeting.pinion], centres[meeting.wheel], pair)
        side = own.sense
        start, rate = side * (own.start - direction), side * own.rate
        wheel = _Turn(
            -side if pair.wheel.teeth > 0 else side,
            direction + side * (math.pi + pair.wheel_tooth_rotation(start)),
            -side * rate * pair.pinion.base_radius / pair.wheel.base_radius,
        )
        known = turns.setdefault(meeting.wheel, wheel)
        names = centres[meeting.pinion].name, centres[meeting.wheel].name
        if known.sense != wheel.sense or abs(known.rate - wheel.rate) > MISSES * abs(wheel.rate):
            raise GeometryError(f"gear {names[1]}: is driven another way by gear {names[0]} than by the one before it")
        tooth = (wheel.start - known.start) / pair.wheel.angular_pitch
        if abs(tooth - round(tooth)) > MISSES:
            raise GeometryError(
                f"gear {names[1]}: its teeth miss those of gear {names[0]} by {tooth - round(tooth):.3f} pitches: "
                "move the gear to where it can be assembled, or change tooth numbers"
            )
        found.append(Placement(direction, side < 0, start, rate, (0, side * round(tooth))))
    return tuple(found)


def _direction(pinion: Centre, wheel: Centre, pair: GearPair) -> float:
    """Angle of the y axis of a pair: towards the wheel's centre, of a ring away from it."""
    sign = math.copysign(1.0, pair.centre_distance)
    return math.atan2(-sign * (wheel.x - pinion.x), sign * (wheel.y - pinion.y))
