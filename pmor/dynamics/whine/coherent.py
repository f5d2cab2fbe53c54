"""Meshes that keep step with each other: their lines meet, and add up with their phases.

Meshes that share a gear have one frequency, and phases from tooth numbers and centres. So have meshes on one shaft
whose tooth numbers are in the ratio of small whole numbers: harmonics of one are harmonics of the other. Their phases
depend on how gears are put on the shaft; here a tooth of each stands in line with a tooth of the first, at mid width.
Such meshes are one problem of Hill, each harmonic of the common cycle once. A mesh whose pitches differ is taken by
itself: what its lines share with those of others adds up by squares.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import cached_property

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.dynamics.whine.cycle import StandingMesh, StandingTrain
from pmor.dynamics.whine.hill import FURTHER, MeshCycle
from pmor.dynamics.whine.moving import MovingMachine
from pmor.gear.modification import Modification
from pmor.line.hub_law import COORDINATES
from pmor.machine.loaded import Meshing

# Of a ratio of frequencies: rounding.
EXACT = 1e-9


@dataclass(frozen=True)
class CoherentMeshes:
    """Meshes that keep step, those of each part by themselves.

    Parameters
    ----------
    parts : tuple of StandingMesh or StandingTrain
    passes : tuple of int
        Cycles of each part in the common one.
    ahead : tuple of float
        Of its own cycle, by how much each part is ahead at time 0.
    """

    parts: tuple[StandingMesh | StandingTrain, ...]
    passes: tuple[int, ...] = (1,)
    ahead: tuple[float, ...] = (0.0,)

    @property
    def names(self) -> tuple[str, ...]:
        """Of all M meshes."""
        return tuple(name for part in self.parts for name in part.names)

    @property
    def name(self) -> str:
        """All of them."""
        return " and ".join(self.names)

    @property
    def numbers(self) -> tuple[int, ...]:
        """Of the meshes in their gearbox."""
        return tuple(number for part in self.parts for number in part.numbers)

    @property
    def own_passes(self) -> tuple[int, ...]:
        """Cycles of each mesh in the common one."""
        return tuple(count for part, count in zip(self.parts, self.passes, strict=True) for _ in part.names)

    @property
    def ports(self) -> IntArray:
        """Coordinates of the meshes among those of all in the gearbox, (2 M,)."""
        return np.asarray((COORDINATES * np.array(self.numbers)[:, None] + np.arange(COORDINATES)).ravel())

    @property
    def load(self) -> FloatArray:
        """Mean forces on the coordinates, (2 M,)."""
        return np.concatenate([part.load for part in self.parts])

    @property
    def unlike(self) -> bool:
        """Whether it is one mesh whose pitches differ, which has all harmonics of its cycle."""
        return len(self.parts) == 1 and self.passes[0] > 1

    @cached_property
    def told(self) -> tuple[int, ...]:
        """Harmonics of the common cycle that are told: those of any mesh."""
        if self.unlike:
            return tuple(range(1, self.passes[0] * self.parts[0].harmonics + 1))
        return tuple(sorted({harmonic for count in self.passes for harmonic in self.of_mesh(count)}))

    def of_mesh(self, count: int, further: int = 0) -> range:
        """Return the harmonics of the common cycle that are those of a mesh with so many cycles in it."""
        return range(count, count * (self.parts[0].harmonics + further) + 1, count)

    def mean_force(self) -> FloatArray:
        """Return the mean forces on the coordinates where the hubs stand, (2 M,)."""
        return np.concatenate([part.law().force.mean(axis=0) for part in self.parts])

    def moved(self, coordinates: FloatArray) -> CoherentMeshes:
        """Return the meshes with their coordinates moved by so much, (2 M,)."""
        ends = np.cumsum([len(part.load) for part in self.parts])[:-1]
        parts = zip(self.parts, np.split(coordinates, ends), strict=True)
        return replace(self, parts=tuple(part.moved(own) for part, own in parts))

    def keeping(self) -> CoherentMeshes:
        """Return the meshes, near which others are found in less time; for one thread alone."""
        return replace(self, parts=tuple(part.keeping() for part in self.parts))

    def flank(self, mesh: int, gear: int) -> Modification:
        """Return the flank of pinion (0) or wheel (1) of a mesh by its place among `names`."""
        part, place = self._at(mesh)
        return self.parts[part].flank(place, gear)

    def with_flank(self, mesh: int, gear: int, flank: Modification) -> CoherentMeshes:
        """Return the meshes with another flank of pinion or wheel of one, their hubs where they are."""
        part, place = self._at(mesh)
        changed = self.parts[part].with_flank(place, gear, flank)
        return replace(self, parts=(*self.parts[:part], changed, *self.parts[part + 1 :]))

    def told_before(self, mesh: int, gear: int) -> bool:
        """Return whether the flank of a gear carries in meshes before this one too."""
        part, place = self._at(mesh)
        own = self.parts[part]
        return isinstance(own, StandingTrain) and min(own.same_flank(place, gear)) < (place, gear)

    def image(self, mesh: int) -> bool:
        """Return whether a mesh is the image of its drawing."""
        part, place = self._at(mesh)
        own = self.parts[part]
        return isinstance(own, StandingTrain) and own.train.meshes[place].image

    def _at(self, mesh: int) -> tuple[int, int]:
        """Part, and place in it, of a mesh by its place among all."""
        places = [(part, place) for part, one in enumerate(self.parts) for place in range(len(one.names))]
        return places[mesh]

    def cycle(self) -> MeshCycle:
        """Return the harmonics of the common cycle over time; ConvergenceError where some forces are not found."""
        cycles = [part.cycle() for part in self.parts]
        if len(cycles) == 1:
            return cycles[0]
        further = {harmonic for count in self.passes for harmonic in self.of_mesh(count, FURTHER)}
        solved = np.array([0, *self.told, *sorted(further - set(self.told))])
        size, first = len(self.load), 0
        force = np.zeros((len(solved), size), dtype=complex)
        tangent = np.zeros((2 * int(solved.max()) + 1, size, size), dtype=complex)
        for part, own, count, ahead in zip(self.parts, cycles, self.passes, self.ahead, strict=True):
            at = slice(first, first + len(part.load))
            turned = np.exp(2j * math.pi * (-ahead if part.backwards else ahead) * np.arange(len(own.tangent)))
            stiffness = turned[:, None, None] * own.tangent
            kept = count * np.arange(len(stiffness)) < len(tangent)
            tangent[: count * kept.sum() : count, at, at] = stiffness[kept]
            harmonics = np.arange(len(own.force))
            places = (solved[:, None] == count * harmonics).argmax(axis=0)
            force[places, at] = turned[harmonics, None] * own.force
            first = at.stop
        return MeshCycle(force, tangent, solved)


def coherent_meshes(machine: MovingMachine, parts: Sequence[StandingMesh | StandingTrain]) -> list[CoherentMeshes]:
    """Return the meshes of a machine, those together that keep step: of which harmonics that are told meet."""
    rates = [machine.mesh_rate(part.numbers[0]) for part in parts]
    ahead, left = ahead_of(machine, parts), [number for number, part in enumerate(parts) if part.pitches == 1]
    found = [CoherentMeshes((part,), (part.pitches,)) for part in parts if part.pitches > 1]
    while left:
        ratios = {left.pop(0): Fraction(1)}
        while meeting := [
            (number, ratios[known] * ratio) for known in ratios for number in left
            if (ratio := _ratio(rates[number], rates[known], parts[0].harmonics))
        ]:  # fmt: skip
            number, ratio = meeting[0]
            ratios[number] = ratio
            left.remove(number)
        scale = math.lcm(*(ratio.denominator for ratio in ratios.values()))
        passes = [int(ratio * scale) for ratio in ratios.values()]
        common = math.gcd(*passes)
        found.append(CoherentMeshes(
            tuple(parts[number] for number in ratios), tuple(count // common for count in passes),
            tuple(ahead[number] for number in ratios),
        ))  # fmt: skip
    return found


def _ratio(one: float, other: float, harmonics: int) -> Fraction | None:
    """Ratio of two frequencies that share a harmonic among those that are told."""
    ratio = Fraction(one / other).limit_denominator(harmonics)
    near = 0 < ratio.numerator <= harmonics and abs(float(ratio) * other - one) <= EXACT * one
    return ratio if near else None


def ahead_of(machine: MovingMachine, parts: Sequence[StandingMesh | StandingTrain]) -> list[float]:
    """Return by how much of its cycle each part is ahead at time 0, teeth on a shaft in line as far as that goes."""
    shafts, found = dict[str, float](), [0.0] * len(parts)
    left = list(range(len(parts)))
    while left:
        known = (n for n in left for end in gears_of(machine, parts[n]) if end.shaft in shafts)
        number = next(known, left[0])
        ends = gears_of(machine, parts[number])
        left.remove(number)
        if on := next((end for end in ends if end.shaft in shafts), None):
            found[number] = (shafts[on.shaft] - on.start) / on.by_cycle
        for end in ends:
            shafts.setdefault(end.shaft, end.start + end.by_cycle * found[number])
        for joint in machine.gearbox.bearings:
            both = joint.settings.shaft, joint.settings.to
            if joint.settings.couples and set(both) & set(shafts):
                angle = next(shafts[shaft] for shaft in both if shaft in shafts)
                shafts |= {shaft: angle for shaft in both if shaft not in shafts}
    return found


@dataclass(frozen=True)
class GearAngle:
    """A gear of a mesh: angle about x of one of its teeth at the beginning of the cycle, rad, and by a cycle."""

    shaft: str
    start: float
    by_cycle: float


def gears_of(machine: MovingMachine, part: StandingMesh | StandingTrain) -> list[GearAngle]:
    """Return the gears of a part, pinion and wheel of each mesh."""
    found = []
    for place, number in enumerate(part.numbers):
        mesh = machine.gearbox.meshes[number]
        own = part.train.meshes[place] if isinstance(part, StandingTrain) else None
        first = part.train.meshes[0] if isinstance(part, StandingTrain) else None
        pitch = mesh.pair.pinion.angular_pitch if first is None else first.pair.meshed.pair.pitch / first.rate
        start, rate = (0.0, 1.0) if own is None else (own.start, own.rate)
        found += _pinion_and_wheel(mesh, start, rate * pitch)
    return found


def _pinion_and_wheel(mesh: Meshing, start: float, by_cycle: float) -> list[GearAngle]:
    """Pinion and wheel of a mesh, of which the pinion stands at an angle of its pair."""
    y, sense = mesh.frame.axes[:, 1], mesh.frame.along * mesh.frame.hand
    angle = math.atan2(y[2], y[1])
    roll = mesh.pair.wheel_tooth_rotation(start), mesh.pair.wheel_tooth_rotation(start + by_cycle)
    settings = mesh.settings
    return [
        GearAngle(settings.pinion.shaft, angle + sense * start, sense * by_cycle),
        GearAngle(settings.wheel.shaft, angle + sense * (math.pi + roll[0]), sense * (roll[1] - roll[0])),
    ]
