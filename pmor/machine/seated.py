"""A loaded gearbox condensed to its rolling bearings and some hubs: bearings by their law, all else linear.

With A the flexibility of what is linear between the places of interest, x the displacements there (q of the inner rings
against the outer ones, h of hubs), f(q) the forces of the bearings and w those on the hubs,

    x = x_0 + A [k q - f(q); w],                                                                                (1)

where springs k stand in for the bearings in A, so that it is finite where a shaft lies loose in its clearances.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from pmor.body.beam import NODE
from pmor.body.rolling_bearing import DOF, BearingState, RollingBearing
from pmor.core.arrays import FloatArray
from pmor.machine.hub_compliance import held_shafts
from pmor.machine.loaded import LoadedGearbox
from pmor.machine.system import ARM, FIRST_GUESS, UNITS, Equilibrium


class Linearised(NamedTuple):
    """The machine about a state of its bearings: h = offset + compliance w, q = seat_offset + seat_compliance w."""

    offset: FloatArray
    compliance: FloatArray
    seat_offset: FloatArray
    seat_compliance: FloatArray


@dataclass(frozen=True)
class SeatedMachine:
    """What equation (1) says.

    Parameters
    ----------
    bearings : tuple of RollingBearing, length b
    stand_in : ndarray, shape (5 b,)
        k.
    flexibility : ndarray, shape (5 b + n, 5 b + n)
        A.
    at_rest : ndarray, shape (5 b + n,)
        x_0, of all loads but those on the hubs.
    numbers : tuple of int
        Of the bearings, among all supports.
    start : ndarray, shape (5 b,)
        Displacements of the inner rings under the mean loads.
    carried, carried_at_rest : ndarray, shape (s, 6, 5 b + n) and (s, 6)
        What shafts press on all supports, these bearings left out: by forces at the places, and at rest.
    rates : ndarray, shape (R,)
        Of loads that turn with shafts, over that of the angle.
    turning, carried_turning : ndarray, shape (2 R, 5 b + n) and (2 R, s, 6)
        What they add at rest: all at angle 0, then all a quarter turn on.
    """

    bearings: tuple[RollingBearing, ...]
    stand_in: FloatArray
    flexibility: FloatArray
    at_rest: FloatArray
    numbers: tuple[int, ...]
    start: FloatArray
    carried: FloatArray
    carried_at_rest: FloatArray
    rates: FloatArray
    turning: FloatArray
    carried_turning: FloatArray

    def at(self, angle: float) -> SeatedMachine:
        """Return the machine with the loads that turn where an angle has them, rad."""
        if not len(self.rates):
            return self
        share = np.concatenate([np.cos(self.rates * angle), np.sin(self.rates * angle)])
        return replace(
            self, at_rest=self.at_rest + share @ self.turning,
            carried_at_rest=self.carried_at_rest + np.tensordot(share, self.carried_turning, 1),
        )  # fmt: skip

    @property
    def seats(self) -> int:
        """Number of displacements of inner rings."""
        return len(self.stand_in)

    def states(self, place: FloatArray) -> list[BearingState]:
        """Return the states of the bearings by the displacements of their inner rings, (5 b,)."""
        return [one.state(moved) for one, moved in zip(self.bearings, place.reshape(-1, DOF), strict=True)]

    def linearised(self, place: FloatArray, states: Sequence[BearingState], added: float) -> Linearised:
        """Return the machine about displacements of its inner rings (5 b,).

        Parameters
        ----------
        added : float
            Stiffness that holds each inner ring where it is, N/mm: shortens steps of rings that lie loose.
        """
        n = self.seats
        tangent = np.zeros((n, n))
        for number, state in enumerate(states):
            rows = slice(DOF * number, DOF * (number + 1))
            tangent[rows, rows] = _held(state, added)
        own, hubs = self.flexibility[:n, :n], self.flexibility[n:, n:]
        push, stiffer = self.stand_in * place - self.forces_of(states), np.diag(self.stand_in) - tangent
        inverse = np.linalg.inv(np.eye(n) - own @ stiffer)
        step = inverse @ (self.at_rest[:n] - place + own @ push)
        by_hubs = inverse @ self.flexibility[:n, n:]
        across = self.flexibility[n:, :n]
        compliance = hubs + across @ stiffer @ by_hubs
        offset = self.at_rest[n:] + across @ (push + stiffer @ step)
        return Linearised(offset, 0.5 * (compliance + compliance.T), place + step, by_hubs)

    def forces_of(self, states: Sequence[BearingState]) -> FloatArray:
        """Return f, (5 b,)."""
        return np.concatenate([state.force for state in states]) if states else np.zeros(0)

    def forces_told(
        self, place: FloatArray, states: Sequence[BearingState], added: float, there: FloatArray
    ) -> FloatArray:
        """Return f at other displacements as the linearised machine has it, (5 b,)."""
        step = (there - place).reshape(-1, DOF)
        moved = [_held(state, added) @ one for state, one in zip(states, step, strict=True)]
        return self.forces_of(states) + (np.concatenate(moved) if moved else np.zeros(0))

    def forces_at(self, place: FloatArray, pressed: FloatArray, wrench: FloatArray) -> FloatArray:
        """Return the forces at all places, (5 b + n,), with those of the bearings (5 b,) and the wrench on the hubs."""
        return np.concatenate([self.stand_in * place - pressed, wrench])


def _held(state: BearingState, added: float) -> FloatArray:
    """Stiffness of a bearing, and of what holds its ring where it is."""
    return np.asarray(state.stiffness + np.diag(added / UNITS**2))


def seated(
    gearbox: LoadedGearbox, equilibrium: Equilibrium, hubs: Sequence[int], still: FloatArray, rates: Sequence[float]
) -> SeatedMachine:
    """Return a loaded gearbox condensed to its rolling bearings and to hubs.

    Shafts are held against rotation as in `pmor.machine.hub_compliance`.

    Parameters
    ----------
    hubs : sequence of int
        First displacements of their nodes.
    still : ndarray, shape (n,)
        All loads on the machine that stand, without those on the hubs that are to come.
    rates : sequence of float, length R
        Of the loads that turn.
    """
    size, system = len(gearbox.load), gearbox.system
    held, basis = held_shafts(gearbox, hubs)
    scale = np.where(system.rotations, 1.0 / ARM, 1.0)
    rows = np.concatenate([seat.rows for seat in system.seats] + [np.eye(size)[hub : hub + NODE] for hub in hubs])
    stiffness = system.stiffness.copy()
    for seat in system.seats:
        stiffness += seat.rows.T @ np.diag(FIRST_GUESS * UNITS**-2) @ seat.rows
    turning = [one.load[quarter] for quarter in (0, 1) for one in gearbox.turning]
    loads = np.column_stack([rows.T, *turning, still])
    moved = basis @ np.linalg.solve(basis.T @ stiffness @ basis, basis.T @ loads)
    reaction = np.linalg.lstsq((held * scale).T, scale[:, None] * (stiffness @ moved - loads), rcond=None)[0]
    carried, first = [], 0
    for bearing in gearbox.bearings:
        pressed = bearing.springs[:, None] * (bearing.rows @ moved)
        pressed[list(bearing.rigid)] -= reaction[first : first + len(bearing.rigid)]
        first += len(bearing.rigid)
        carried.append(pressed)
    whole, places = np.array(carried), len(rows)
    return SeatedMachine(
        tuple(seat.bearing for seat in system.seats), np.tile(FIRST_GUESS * UNITS**-2, len(system.seats)),
        rows @ moved[:, :places], rows @ moved[:, -1], tuple(n for n, one in enumerate(gearbox.bearings) if one.law),
        rows[: DOF * len(system.seats)] @ equilibrium.displacement, whole[..., :places], whole[..., -1],
        np.array(rates), (rows @ moved[:, places:-1]).T, np.moveaxis(whole[..., places:-1], -1, 0),
    )  # fmt: skip
