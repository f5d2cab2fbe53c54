"""Equations of the meshes of a planetary set: unknown forces at harmonics, and what they do at lines in the housing.

Where stiffness varies these are (1) of `pmor.dynamics.whine.hill`, for N equal planets as one, or for all together;
with a mean stiffness each line stands by itself.
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
    orders : tuple of Order
        n.
    by : ndarray of complex, shape (n + 1, P, q)
        Forces on the coordinates by the unknowns of each harmonic, 0 first.
    lines : tuple of int or None
        Of each line the number of its harmonic; of one that round-off makes of equal planets none.
    shapes : ndarray of complex, shape (n + 1, K, q), optional
        What the meshes do at each harmonic; by default unknowns are theirs.
    """

    of_set: SetCycle
    own: slice
    cycle: MeshCycle
    standing: CoherentMeshes | None
    still: FloatArray
    orders: tuple[Order, ...]
    by: ComplexArray
    lines: tuple[int | None, ...]
    shapes: ComplexArray | None = None

    @cached_property
    def at_rest(self) -> FloatArray:
        """Receptance at rest on the coordinates of the meshes, (K, K)."""
        return self.of_set.seen_by_planets(self.still)

    def moving(self, orders: Sequence[Order]) -> ComplexArray:
        """Return the receptance of the closed machine on the unknowns along orders, 0 first, (S, n + 1, q, q)."""
        speeds = len(orders[0].speeds) if orders else 0
        still = np.broadcast_to(self.still, (speeds, *self.still.shape))
        ports = [still, *(order.ports(self.own, self.own) for order in orders)]
        found = [by.conj().T @ one @ by for by, one in zip(self.by, ports, strict=True)]
        return np.stack(found, axis=1).astype(complex)

    def answer(self, cycle: MeshCycle | None = None) -> ComplexArray:
        """Return the forces on the coordinates at all lines, (S, L, P), of the set or with another cycle of its own."""
        closed_by = None if cycle is None else self.cycle.mean
        forces = hill(cycle or self.cycle, self.moving(self.orders), closed_by, self.shapes)
        found = np.zeros((len(forces), len(self.lines), len(self.still)), dtype=complex)
        for line, harmonic in enumerate(self.lines):
            if harmonic is not None:
                found[:, line] = forces[:, harmonic] @ self.by[harmonic].T
        return found

    def matrix(self, receptance: ComplexArray) -> ComplexArray:
        """Return the matrix of the equations for the unknowns at harmonics of either sign at a speed."""
        return np.asarray(equations(self.cycle, receptance[None], shapes=self.shapes)[0])

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
        forces, speeds = self._forces(cycle or self.cycle), len(self.orders[0].speeds) if self.orders else 0
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
