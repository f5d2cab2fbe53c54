"""Small motion of meshes over their harmonics, their stiffness varying over the cycle: Hill's equations.

About a mean deflection a mesh pushes its hubs apart with w(phi) - k(phi) x. With the machine closed by the mean k_0,
H its receptance at the mesh, and harmonics of the cycle x(phi) = sum_n x_n exp(i n phi),

    x_n = H(n W) f_n,    f_n = w_n - sum_(j != n) k_(n-j) x_j,                                               (1)

a linear system for all harmonics at once. Without the sum it is time-invariant, as gear programs have it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pmor.core.arrays import ComplexArray, FloatArray, IntArray

# Harmonics that are solved beyond those that are wanted: modes that strain the mesh meet them at low speeds, and give
# them back to the others (forces of a spur mesh were 33 % wrong with one, 6 % with three).
FURTHER = 3
# Speeds that are solved at a time: matrices of all are large.
BLOCK = 64


@dataclass(frozen=True)
class MeshCycle:
    """Forces and tangents of meshes along a fixed mean deflection, by harmonics; P coordinates, of a mesh 2.

    Parameters
    ----------
    force : ndarray of complex, shape (K + 1, P)
        w_n less the mean load, at the harmonics that are solved: N, N mm.
    tangent : ndarray of complex, shape (L, P, P)
        k_n at the harmonics 0, 1, ..., up to twice the largest that is solved.
    solved : ndarray of int, shape (K + 1,), optional
        These harmonics, 0 first; by default 0, 1, ..., K.
    pitches : int
        After which a mesh repeats whose pitches differ: harmonics are those of so many.
    """

    force: ComplexArray
    tangent: ComplexArray
    solved: IntArray | None = None
    pitches: int = 1

    @property
    def mean(self) -> FloatArray:
        """Mean tangent, (P, P)."""
        return np.asarray(self.tangent[0].real)

    @property
    def places(self) -> IntArray:
        """Places of the harmonics of either sign among those that are solved, negative ones first, (2 K + 1,)."""
        return np.arange(-len(self.force) + 1, len(self.force))

    @property
    def harmonics(self) -> IntArray:
        """Those that are solved, 0 first, (K + 1,)."""
        return np.arange(len(self.force)) if self.solved is None else self.solved

    @property
    def orders(self) -> IntArray:
        """The harmonics of either sign at these places, (2 K + 1,)."""
        return np.asarray(np.sign(self.places) * self.harmonics[abs(self.places)])

    @property
    def varying(self) -> ComplexArray:
        """k_(n - j) between harmonics of either sign, (2 K + 1, 2 K + 1, P, P)."""
        return signed(self.tangent, self.orders[:, None] - self.orders)

    def beside(self, orders: IntArray, closed_by: FloatArray | None = None) -> ComplexArray:
        """Return k between orders of either sign (m,) beside the mean tangent that closes the machine, (m, m, P, P).

        That is the cycle's own, where no other one is given.
        """
        apart, further = orders[:, None] - orders, 0.0 if closed_by is None else self.mean - closed_by
        return np.where((apart == 0)[..., None, None], further, signed(self.tangent, apart))

    @property
    def conj(self) -> MeshCycle:
        """The same run through the other way."""
        return MeshCycle(self.force.conj(), self.tangent.conj(), self.solved, self.pitches)


def mesh_cycle(
    force: FloatArray, tangent: FloatArray, load: FloatArray, harmonics: int, pitches: int = 1
) -> MeshCycle:  # fmt: skip
    """Return the harmonics of forces (A, 2) and tangents (A, 2, 2) over so many pitches, under a mean load (2,).

    Parameters
    ----------
    harmonics : int
        Of a pitch.
    """
    angles, most = len(force), pitches * (harmonics + FURTHER)
    forces = np.fft.rfft(force - load, axis=0)[: most + 1] / angles
    return MeshCycle(forces, np.fft.rfft(tangent, axis=0)[: 2 * most + 1] / angles, pitches=pitches)


def hill(
    cycle: MeshCycle, receptance: ComplexArray, closed_by: FloatArray | None = None, shapes: ComplexArray | None = None
) -> ComplexArray:
    """Return the forces f_n of (1) on the closed machine, shape (S, K + 1, P).

    Parameters
    ----------
    receptance : ndarray of complex, shape (S, K + 1, P, P)
        H at the harmonics that are solved, at S speeds.
    closed_by : ndarray, shape (P, P), optional
        Mean tangent that closes the machine, where it is another one.
    shapes : ndarray of complex, shape (K + 1, P, 2), optional
        What the P coordinates of the cycle do at each harmonic, orthonormal: those of equal planets.
    """
    places = cycle.places
    right = signed(cycle.force, places)
    if shapes is not None:
        right = np.einsum("npq,np->nq", signed(shapes, places).conj(), right)
    found = [
        np.linalg.solve(equations(cycle, receptance[first : first + BLOCK], closed_by, shapes), right.reshape(-1, 1))
        for first in range(0, len(receptance), BLOCK)
    ]
    return np.asarray(np.concatenate(found).reshape(-1, *right.shape)[:, len(cycle.force) - 1 :])


def equations(
    cycle: MeshCycle, receptance: ComplexArray, closed_by: FloatArray | None = None, shapes: ComplexArray | None = None
) -> ComplexArray:
    """Return the matrices of (1) for the forces, f + k H f = w, of harmonics of either sign, (S, 2 K P + P, ...)."""
    places, varying = cycle.places, cycle.beside(cycle.orders, closed_by)
    if shapes is not None:
        by = signed(shapes, places)
        varying = np.einsum("npa,njpq,jqb->njab", by.conj(), varying, by, optimize=True)
    return closing(varying, signed(receptance, places, 1))


def pressed(cycle: MeshCycle, moved: ComplexArray) -> ComplexArray:
    """Return what meshes press with along a motion at harmonics of either sign, w - k x, (2 K + 1, P) each."""
    return np.asarray(signed(cycle.force, cycle.places) - np.einsum("njab,jb->na", cycle.varying, moved))


def closing(varying: ComplexArray, receptance: ComplexArray) -> ComplexArray:
    """Return the matrices of f + k H f for the forces at m orders, (..., m q, m q).

    Parameters
    ----------
    varying : ndarray, shape (m, m, q, q)
        k of the differences of the orders.
    receptance : ndarray, shape (..., m, q, q)
    """
    count, size = receptance.shape[-3:-1]
    blocks = varying.transpose(0, 2, 1, 3).reshape(count * size, -1)
    matrix = np.empty((*receptance.shape[:-3], count * size, count * size), dtype=complex)
    for place in range(count):
        columns = slice(size * place, size * (place + 1))
        matrix[..., columns] = blocks[:, columns] @ receptance[..., place, :, :]
    matrix[..., np.arange(count * size), np.arange(count * size)] += 1.0
    return matrix


def mesh_forces(closed_by: FloatArray, receptance: ComplexArray, closing: ComplexArray) -> ComplexArray:
    """Return the forces of the mesh beside its mean load, (S, K + 1, 2), by those of `hill` on the closed machine."""
    return np.asarray(closing - np.einsum("ab,snb->sna", closed_by, moved(receptance, closing)))


def moved(receptance: ComplexArray, closing: ComplexArray) -> ComplexArray:
    """Return the coordinates of the mesh, x_n, (S, K + 1, 2)."""
    return np.asarray(np.einsum("snab,snb->sna", receptance, closing))


def signed(harmonics: ComplexArray, orders: IntArray, axis: int = 0) -> ComplexArray:
    """Return harmonics, along an axis, by orders of either sign, of a real signal."""
    found = harmonics[(slice(None),) * axis + (abs(orders),)]
    negative = (orders < 0).reshape(*orders.shape, *(1,) * (harmonics.ndim - 1 - axis))
    return np.asarray(np.where(negative, found.conj(), found))
