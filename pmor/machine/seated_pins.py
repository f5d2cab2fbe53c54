"""Planets on their pins condensed to their rolling bearings and hubs, as `pmor.machine.seated` does it with shafts.

Axes are those of the plan, which turn with the carrier. Inner rings are pins; of a bearing x is the axis, y points
outwards and z around.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from pmor.body.bearing_equilibrium import loaded_bearing
from pmor.body.bearing_faults import InnerGeometry
from pmor.body.rolling_bearing import DOF, BearingState
from pmor.core.arrays import FloatArray, IntArray
from pmor.line.hubs import HUB
from pmor.machine.loaded import SetMeshing
from pmor.machine.seated import SeatedMachine
from pmor.sets.pins import PlanetsOnPins
from pmor.sets.plan import SetPlan
from pmor.sets.shafts import onto_bodies, shaft_of


@dataclass(frozen=True)
class SeatedPins:
    """The planets of a set on bearings by their inner geometry.

    Parameters
    ----------
    on_pins : PlanetsOnPins
    carried : ndarray, shape (6 B, 6 N)
        Displacements of all bodies by those of the planets.
    seats : tuple of (int, int), length s
        Planet, and bearing on its pin.
    laws : tuple of InnerGeometry, length s
    turns : ndarray, shape (s, 5, 4)
        Displacement of the pin against the planet, in axes of the bearing, by that of the planet against the pin.
    """

    on_pins: PlanetsOnPins
    carried: FloatArray
    seats: tuple[tuple[int, int], ...]
    laws: tuple[InnerGeometry, ...]
    turns: FloatArray

    @property
    def springs(self) -> FloatArray:
        """Of the bearings, by which the planets of the plan stand, in their axes, (5 s,)."""
        found = np.zeros((len(self.seats), DOF))
        found[:, 1:] = self.on_pins.pin.springs[[bearing for _, bearing in self.seats]]
        return found.ravel()

    def gaps(self, apart: FloatArray) -> FloatArray:
        """Return by what bearings differ from their springs, as gaps of those, (..., N, b, 4).

        Parameters
        ----------
        apart : ndarray, shape (..., 5 s)
            Forces of the springs less those of the bearings.
        """
        pin, parts = self.on_pins.pin, apart.reshape(*apart.shape[:-1], -1, DOF)
        found = np.zeros((*apart.shape[:-1], self.on_pins.count, len(pin.bearings_mm), 4))
        planets, bearings = np.array(self.seats).T
        by_seat = np.einsum("...sd,sdf->...sf", parts, self.turns) * _inverse(pin.springs)[bearings]
        found[..., planets, bearings, :] = by_seat
        return found

    def beside(self, machine: SeatedMachine, wrench: FloatArray) -> SeatedMachine:
        """Return a machine with these seats after its own, and the hubs of the planets after its hubs.

        Parameters
        ----------
        wrench : ndarray, shape (6 B,)
            On all bodies in the mean.
        """
        seats, hubs, springs = DOF * len(self.seats), HUB * self.on_pins.count, self.springs
        unit = np.eye(seats + hubs)
        loads, gaps = unit[:, seats:].reshape(-1, self.on_pins.count, HUB), self.gaps(unit[:, :seats])
        gives = _inverse(springs)
        carried = self.on_pins.on_bearings(loads, gaps)
        planets, bearings = np.array(self.seats).T
        forces = np.einsum("usf,sdf->usd", carried[:, planets, bearings], self.turns)
        at_seats = (forces.reshape(len(unit), -1) + unit[:, :seats]) * gives
        own = np.hstack([at_seats, self.on_pins.moved(loads, gaps).reshape(len(unit), -1)])
        count, size = machine.seats, len(machine.at_rest)
        ours, theirs = np.split(np.arange(size + len(unit)), [size])
        order = np.concatenate([ours[:count], theirs[:seats], ours[count:], theirs[seats:]])
        whole = np.zeros((len(order), len(order)))
        whole[:size, :size], whole[size:, size:] = machine.flexibility, 0.5 * (own + own.T)
        pressed = np.concatenate([machine.carried, np.zeros((*machine.carried.shape[:2], len(unit)))], axis=2)
        return replace(
            machine, bearings=(*machine.bearings, *self.laws), stand_in=np.concatenate([machine.stand_in, springs]),
            flexibility=whole[np.ix_(order, order)],
            at_rest=np.concatenate([machine.at_rest, np.zeros(len(unit))])[order],
            start=np.concatenate([machine.start, self._start(wrench)]), carried=pressed[..., order],
            turning=np.pad(machine.turning, ((0, 0), (0, len(unit))))[:, order],
        )  # fmt: skip

    def _start(self, wrench: FloatArray) -> FloatArray:
        """Displacements of the pins in their bearings by loads that these share as springs, (5 s,)."""
        loads = self.on_pins.on_bearings((wrench @ self.carried).reshape(-1, HUB))
        found = np.zeros((len(self.seats), DOF))
        for number, (planet, bearing) in enumerate(self.seats):
            alone = loaded_bearing(self.laws[number], self.turns[number] @ loads[planet, bearing])
            if alone is not None:
                found[number, 1:] = alone.place[1:]
        return found.ravel()

    def states(self, place: FloatArray) -> dict[tuple[int, int], list[BearingState]]:
        """Return the states of the bearings of each planet and place on its pin at displacements (P, s, 5)."""
        return {
            seat: [law.state(moved) for moved in place[:, number]]
            for number, (seat, law) in enumerate(zip(self.seats, self.laws, strict=True))
        }


def seated_pins(one: SetMeshing) -> SeatedPins | None:
    """Return the planets of a set on rolling bearings; None where none has a law."""
    plan, on_pins = one.file.plan, one.file.plan.on_pins
    if on_pins is None or not any(on_pins.rolling):
        return None
    seats, turns = list[tuple[int, int]](), list[FloatArray]()
    for planet, number in enumerate(plan.planets):
        along = math.atan2(plan.bodies[number].y, plan.bodies[number].x)
        out, around = np.array([[math.cos(along), math.sin(along)], [-math.sin(along), math.cos(along)]])
        turn = np.zeros((DOF, 4))
        # Slopes in planes of outwards and around are about axes across them.
        turn[1, :2], turn[2, :2], turn[3, 2:], turn[4, 2:] = -out, -around, around, -out
        for bearing, law in enumerate(on_pins.rolling):
            if law is not None:
                seats.append((planet, bearing))
                turns.append(turn)
    laws = tuple(law for _, bearing in seats if (law := on_pins.rolling[bearing]) is not None)
    return SeatedPins(on_pins, onto_bodies(plan.bodies)[:, _columns(plan)], tuple(seats), laws, np.array(turns))


def _columns(plan: SetPlan) -> IntArray:
    """Displacements of the planets among those of all shafts."""
    first = sorted(set(shaft_of(plan.bodies)))
    return np.concatenate([HUB * first.index(planet) + np.arange(HUB) for planet in plan.planets])


def _inverse(springs: FloatArray) -> FloatArray:
    """What springs give; nothing of those that are not there."""
    return np.divide(1.0, springs, out=np.zeros_like(springs), where=springs > 0.0)
