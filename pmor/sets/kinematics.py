"""Kinematics of gears that mesh with several others: where teeth stand, and which flanks carry.

Axes stand still: a planetary set is seen from its carrier. Angles are counter-clockwise from the y axis of the train. A
gear that drives clockwise makes the image of a pair (`pmor.line.several`).

Gears on one shaft turn together. The angle between them is chosen where a loop of meshes closes, once for all shafts
whose gears are the same: another stepped planet is then put in with other teeth of its first gear in mesh.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import NamedTuple

from pmor.core.errors import GeometryError
from pmor.gear.pair import GearPair

# Of a pitch: teeth that miss each other by less are taken to meet.
MISSES = 1e-6


class Centre(NamedTuple):
    """Axis of a gear, mm.

    Attributes
    ----------
    member : str
        Gears of one member are equal.
    on : int or None
        Number of another gear on the same shaft, the first one that meshes; None of that one and of single gears.
    """

    name: str
    x: float
    y: float
    member: str = ""
    on: int | None = None


class Meeting(NamedTuple):
    """A mesh: its pair, and the numbers of the bodies that are its pinion and its wheel.

    Attributes
    ----------
    sense : {-1, 1, 0}
        Of the torque on the pinion, counter-clockwise positive; 0 where the pinion drives what stands after it.
    """

    pair: GearPair
    pinion: int
    wheel: int
    sense: int = 0


class Placement(NamedTuple):
    """How a mesh stands in the train: as in `pmor.line.train.TrainMesh`."""

    direction: float
    image: bool
    start: float
    rate: float
    first_tooth: tuple[int, int]


def torque_ratios(teeth: tuple[float, float]) -> dict[str, float]:
    """Return what the torques on sun, ring and carrier from outside are in the ratio of.

    Speeds that are weighted with it add up to 0 (Willis 1841).

    Parameters
    ----------
    teeth : (float, float)
        Of sun and ring; with stepped planets z_r z_p1 / z_p2, of the second gears of which the ring meshes.
    """
    return {"sun": teeth[0], "ring": teeth[1], "carrier": -sum(teeth)}


def member_speeds(teeth: tuple[float, float], on: str, held: str, speed: float) -> dict[str, float]:
    """Return the speeds of sun, ring and carrier of a planetary set (Willis 1841), in the unit of `speed`.

    Parameters
    ----------
    teeth : (float, float)
        Of sun and ring; with stepped planets z_r z_p1 / z_p2, of the second gears of which the ring meshes.
    on, held : {"sun", "ring", "carrier"}
        Member that has the speed, and the one that stands still.
    """
    weights, found = torque_ratios(teeth), {on: speed, held: 0.0}
    last = next(member for member in weights if member not in found)
    found[last] = -weights[on] * speed / weights[last]
    return {member: found[member] for member in weights}


def pair_direction(pinion: Centre, wheel: Centre, pair: GearPair) -> float:
    """Return the angle of the y axis of a pair: towards the wheel's centre, of a ring away from it."""
    sign = math.copysign(1.0, pair.centre_distance)
    return math.atan2(-sign * (wheel.x - pinion.x), sign * (wheel.y - pinion.y))


class _Turn(NamedTuple):
    """A gear: sense in which it drives or is driven, angle of its tooth 0 at 0 and by how much it turns."""

    sense: int
    start: float
    rate: float


def placements(centres: Sequence[Centre], meetings: Sequence[Meeting]) -> tuple[Placement, ...]:
    """Return how the meshes of a train stand; the pinion of the first one drives counter-clockwise.

    Meshes whose senses are given are a tree, in any order; a pinion is turned until its teeth meet those of a wheel.

    Raises
    ------
    GeometryError
        When gears are driven both ways, or teeth do not meet.
    """
    teeth = {meeting.pinion: meeting.pair.pinion.teeth for meeting in meetings}
    teeth |= {meeting.wheel: abs(meeting.pair.wheel.teeth) for meeting in meetings}
    train = _Turning(centres, teeth)
    train.turns[meetings[0].pinion] = _Turn(1, 0.0, 1.0)
    left = list(meetings)
    while left:
        meeting = next(mesh for mesh in left if not mesh.sense or {mesh.pinion, mesh.wheel} & set(train.turns))
        left.remove(meeting)
        train.mesh(meeting)
    return tuple(train.placement(meeting) for meeting in meetings)


def mesh_rates(centres: Sequence[Centre], meetings: Sequence[Meeting]) -> tuple[Fraction, ...]:
    """Return the cycles that each mesh passes in one of the first mesh."""
    turned = {_first_on_shaft(centres, meetings[0].pinion): Fraction(1, abs(meetings[0].pair.pinion.teeth))}
    found = []
    for meeting in meetings:
        cycles = turned[_first_on_shaft(centres, meeting.pinion)] * abs(meeting.pair.pinion.teeth)
        turned[_first_on_shaft(centres, meeting.wheel)] = cycles / abs(meeting.pair.wheel.teeth)
        found.append(cycles)
    return tuple(found)


def _first_on_shaft(centres: Sequence[Centre], body: int) -> int:
    on = centres[body].on
    return body if on is None else on


def speed_ratio(teeth: tuple[float, float], on: str, held: str) -> float:
    """Return the speed of a member over that of the one that it drives: `member_speeds` of those."""
    (driven,) = (speed for member, speed in member_speeds(teeth, on, held, 1.0).items() if member not in (on, held))
    return 1.0 / driven


@dataclass(frozen=True)
class _Turning:
    """Gears as far as they are placed; by how much gears are ahead of the first one on their shaft, by members, rad."""

    centres: Sequence[Centre]
    teeth: Mapping[int, int]
    turns: dict[int, _Turn] = field(default_factory=dict)
    ahead: dict[tuple[str, str], float] = field(default_factory=dict)

    def mesh(self, meeting: Meeting) -> None:
        """Place the gears of a mesh; where both shafts stand already, turn what can be turned until teeth meet."""
        pinion, wheel = meeting.pinion, meeting.wheel
        if pinion not in self.turns and meeting.sense:
            rate = -self.turns[wheel].rate * meeting.pair.wheel.base_radius / meeting.pair.pinion.base_radius
            self.turns[pinion] = _Turn(meeting.sense, self._direction(meeting), rate)
            self._assemble(meeting, [pinion])
            return
        if _first_on_shaft(self.centres, pinion) not in self.turns:
            name = self.centres[pinion].name
            raise GeometryError(f"gear {name}: drives before anything drives it: list meshes from the driven gear on")
        closes = _first_on_shaft(self.centres, wheel) in self.turns
        loose = [body for body in (pinion, wheel) if self._kind(body) not in self.ahead and self._on(body) != body]
        self._stand(pinion)
        if closes:
            self._stand(wheel)
            self._refuse_two_ways(meeting)
            self._assemble(meeting, loose)
        else:
            self.turns[wheel] = self._counted(meeting)
        for body in loose:
            self.ahead[self._kind(body)] = self.turns[body].start - self.turns[self._on(body)].start

    def placement(self, meeting: Meeting) -> Placement:
        """Return how a mesh stands; GeometryError where its teeth miss each other."""
        own, misses = self._pinion(meeting), self._misses(meeting)
        if abs(misses - round(misses)) > MISSES:
            pinion, wheel = self.centres[meeting.pinion].name, self.centres[meeting.wheel].name
            raise GeometryError(
                f"gear {wheel}: its teeth miss those of gear {pinion} by {misses - round(misses):.3f} pitches: "
                "move the gear to where it can be assembled, or change tooth numbers"
            )
        direction = self._direction(meeting)
        start, rate = own.sense * (own.start - direction), own.sense * own.rate
        return Placement(direction, own.sense < 0, start, rate, (0, own.sense * round(misses)))

    def _stand(self, body: int) -> None:
        """Place a gear on a shaft that stands already."""
        on = self.turns[self._on(body)]
        self.turns.setdefault(body, on._replace(start=on.start + self.ahead.get(self._kind(body), 0.0)))

    def _pinion(self, meeting: Meeting) -> _Turn:
        """How the pinion of a mesh turns, in the sense in which it is loaded there."""
        own = self.turns[meeting.pinion]
        return own._replace(sense=meeting.sense or own.sense)

    def _driven(self, meeting: Meeting) -> _Turn:
        """How the driven gear of a mesh turns."""
        own, pair, direction = self._pinion(meeting), meeting.pair, self._direction(meeting)
        turned = pair.wheel_tooth_rotation(own.sense * (own.start - direction))
        return _Turn(
            -own.sense if pair.wheel.teeth > 0 else own.sense,
            direction + own.sense * (math.pi + turned),
            -own.rate * pair.pinion.base_radius / pair.wheel.base_radius,
        )

    def _counted(self, meeting: Meeting) -> _Turn:
        """The same; where the pinion drives, its teeth counted from the one nearest to the pinion at angle 0."""
        own, driven, pair = self.turns[meeting.pinion], self._driven(meeting), meeting.pair
        if meeting.sense:
            return driven
        nearest = round(own.sense * (self._direction(meeting) - own.start) / pair.pitch)
        return driven._replace(start=driven.start - own.sense * nearest * pair.wheel.angular_pitch)

    def _refuse_two_ways(self, meeting: Meeting) -> None:
        known, wanted = self.turns[meeting.wheel], self._driven(meeting)
        if known.sense != wanted.sense or abs(known.rate - wanted.rate) > MISSES * abs(wanted.rate):
            pinion, wheel = self.centres[meeting.pinion].name, self.centres[meeting.wheel].name
            raise GeometryError(f"gear {wheel}: is driven another way by gear {pinion} than by the one before it")

    def _assemble(self, meeting: Meeting, loose: Sequence[int]) -> None:
        """Let the teeth of a mesh meet: turn a gear that is loose on its shaft, or put a shaft in with other teeth."""
        pinion, wheel = meeting.pair.pinion, meeting.pair.wheel
        misses, on = self._misses(meeting), self._on(meeting.pinion)
        if meeting.wheel in loose:
            self._turn([meeting.wheel], (misses - round(misses)) * wheel.angular_pitch)
        elif meeting.pinion in loose:
            self._turn([meeting.pinion], (misses - round(misses)) * pinion.angular_pitch)
        elif on != meeting.pinion:
            shaft = [body for body in self.turns if self._on(body) == on]
            pitch = 2.0 * math.pi / self.teeth[on]
            for tooth in range(self.teeth[on]):
                after = misses - tooth * pitch / pinion.angular_pitch
                if abs(after - round(after)) < MISSES:
                    self._turn(shaft, tooth * pitch)
                    return

    def _turn(self, bodies: Sequence[int], angle: float) -> None:
        for body in bodies:
            self.turns[body] = self.turns[body]._replace(start=self.turns[body].start + angle)

    def _misses(self, meeting: Meeting) -> float:
        """By how many pitches the driven gear of a mesh stands behind where its teeth meet."""
        return (self._driven(meeting).start - self.turns[meeting.wheel].start) / meeting.pair.wheel.angular_pitch

    def _on(self, body: int) -> int:
        return _first_on_shaft(self.centres, body)

    def _kind(self, body: int) -> tuple[str, str]:
        """Gears of these members stand alike on all of their shafts."""
        return self.centres[self._on(body)].member, self.centres[body].member

    def _direction(self, meeting: Meeting) -> float:
        return pair_direction(self.centres[meeting.pinion], self.centres[meeting.wheel], meeting.pair)
