"""Equations of the meshes of a planetary set: unknown forces at harmonics, and what they do at lines in the housing.

Where stiffness varies these are (1) of `pmor.dynamics.whine.hill`, for N equal planets as one, or for all together.
What planets see of the housing at a harmonic is the sum of what it does at all orders at which the harmonic arrives
there, where it is alike all around. With a mean stiffness each line stands by itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pmor.core.arrays import ComplexArray, FloatArray
from pmor.dynamics.whine.coherent import CoherentMeshes
from pmor.dynamics.whine.hill import MeshCycle, equations, hill, pressed, signed
from pmor.dynamics.whine.orders import Order
from pmor.dynamics.whine.pitches import time_invariant
from pmor.dynamics.whine.set_cycle import SetCycle


@dataclass(frozen=True)
class SetMotion:
    """Meshes of a set whose stiffness varies; q unknowns at each of n harmonics, P coordinates of `blades`.

    Parameters
    ----------
    of_set : SetCycle
    own : slice
        Its coordinates among those of all meshes.
    cycle : MeshCycle
        Of the meshes on their K coordinates, over time.
    standing : CoherentMeshes or None
        The same, where they are no made-up ones.
    still : ndarray, shape (P, P)
        Receptance at rest.
    orders : tuple of tuple of Order
        n, of each harmonic those at which it arrives in the housing, w.
    by : ndarray of complex, shape (n + 1, w, P, q)
        Forces on the coordinates there by the unknowns of each harmonic, 0 first.
    lines : tuple of (int, int) or None
        Of each line the number of its harmonic, and which of its orders it is; of one that round-off makes of equal
        planets none.
    shapes : ndarray of complex, shape (n + 1, K, q), optional
        What the meshes do at each harmonic; by default unknowns are theirs.
    """

    of_set: SetCycle
    own: slice
    cycle: MeshCycle
    standing: CoherentMeshes | None
    still: FloatArray
    orders: tuple[tuple[Order, ...], ...]
    by: ComplexArray
    lines: tuple[tuple[int, int] | None, ...]
    shapes: ComplexArray | None = None

    @cached_property
    def at_rest(self) -> FloatArray:
        """Receptance at rest on the coordinates of the meshes, (K, K)."""
        return self.of_set.seen_by_planets(self.still)

    @cached_property
    def closed_by(self) -> FloatArray:
        """Mean tangent that closes the machine, as planets see it, (K, K)."""
        back = np.linalg.inv(self.of_set.blades.matrix)
        whole = np.kron(back, np.eye(self.of_set.each))
        return np.asarray(whole.T @ self.of_set.tangent @ whole)

    def moving(self, orders: Sequence[Sequence[Order]]) -> ComplexArray:
        """Return the receptance of the closed machine on the unknowns along orders, 0 first, (S, n + 1, q, q)."""
        speeds = len(orders[0][0].speeds) if orders else 0
        still = np.broadcast_to(self.still, (speeds, *self.still.shape))
        found = [sum(by.conj().T @ still @ by for by in self.by[0])]
        for each, by in zip(orders, self.by[1:], strict=True):
            ports = (order.ports(self.own, self.own) for order in each)
            found.append(sum(one.conj().T @ moved @ one for one, moved in zip(by, ports, strict=True)))
        return np.stack(found, axis=1).astype(complex)

    def answer(self, cycle: MeshCycle | None = None) -> ComplexArray:
        """Return the forces on the coordinates at all lines, (S, L, P), of the set or with another cycle of its own."""
        forces = hill(cycle or self.cycle, self.moving(self.orders), self.closed_by, self.shapes)
        found = np.zeros((len(forces), len(self.lines), len(self.still)), dtype=complex)
        for line, place in enumerate(self.lines):
            if place is not None:
                found[:, line] = forces[:, place[0]] @ self.by[place].T
        return found

    def matrix(self, receptance: ComplexArray) -> ComplexArray:
        """Return the matrix of the equations for the unknowns at harmonics of either sign at a speed."""
        return np.asarray(equations(self.cycle, receptance[None], self.closed_by, self.shapes)[0])

    def pressed(self, cycle: MeshCycle, moved: ComplexArray) -> ComplexArray:
        """Return what meshes press with along a motion at harmonics of either sign, w - k x, (2 n + 1, q)."""
        if self.shapes is None:
            return pressed(cycle, moved)
        by = signed(self.shapes, cycle.places)
        return np.asarray(np.einsum("npq,np->nq", by.conj(), pressed(cycle, np.einsum("npq,nq->np", by, moved))))


@dataclass(frozen=True)
class ConstantSet(SetMotion):
    """Meshes of a set by their mean stiffness: harmonics are lines, unknowns the forces on all coordinates.

    Parameters
    ----------
    harmonics : tuple of int
        Of the cycle, of each line.
    acts : ndarray of complex, shape (L, P, K)
        Forces on the coordinates by those of the meshes.
    """

    harmonics: tuple[int, ...] = ()
    acts: ComplexArray | None = None

    def answer(self, cycle: MeshCycle | None = None) -> ComplexArray:
        """Return the forces on the coordinates at all lines, (S, L, P)."""
        forces, speeds = self._forces(cycle or self.cycle), len(self.orders[0][0].speeds) if self.orders else 0
        if cycle is None:
            return np.array(np.broadcast_to(forces, (speeds, *forces.shape)))
        further = self.of_set.standing_still(cycle.mean - self.cycle.mean)
        moving = self.moving(self.orders)[:, 1:]
        return np.asarray(np.linalg.solve(np.eye(len(further)) + further @ moving, forces[..., None])[..., 0])

    def matrix(self, receptance: ComplexArray) -> ComplexArray:
        """Return none, (0, 0): each line is its own."""
        return np.zeros((0, 0), dtype=complex)

    def pressed(self, cycle: MeshCycle, moved: ComplexArray) -> ComplexArray:
        """Return what meshes press with along a motion at lines of either sign, (2 L + 1, P)."""
        forces = np.concatenate([np.zeros((1, moved.shape[1])), self._forces(cycle)])
        pressed = signed(forces, np.arange(-len(forces) + 1, len(forces)))
        return np.asarray(pressed - moved @ self.of_set.standing_still(cycle.mean).T)

    def _forces(self, cycle: MeshCycle) -> ComplexArray:
        assert self.acts is not None
        return np.asarray(np.einsum("lpk,lk->lp", self.acts, time_invariant(cycle)[list(self.harmonics)]))


def widened(part: ComplexArray | FloatArray, each: int) -> ComplexArray:
    """Return a matrix of planets over the coordinates of each."""
    return np.asarray(np.kron(part, np.eye(each)), dtype=complex)
