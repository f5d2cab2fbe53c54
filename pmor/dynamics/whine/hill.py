"""Small motion of one mesh over its harmonics, its stiffness varying over the cycle: Hill's equations.

About a mean deflection the mesh pushes its hubs apart with w(phi) - k(phi) x. With the machine closed by the mean k_0,
H its receptance at the mesh, and harmonics of the cycle x(phi) = sum_n x_n exp(i n phi),

    x_n = H(n W) f_n,    f_n = w_n - sum_(j != n) k_(n-j) x_j,                                               (1)

a linear system for all harmonics at once. Without the sum it is time-invariant, as gear programs have it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pmor.core.arrays import ComplexArray, FloatArray, IntArray

# Harmonics that are solved beyond those that are wanted.
FURTHER = 1


@dataclass(frozen=True)
class MeshCycle:
    """Forces and tangents of a mesh along a fixed mean deflection, by harmonics.

    Parameters
    ----------
    force : ndarray of complex, shape (K + 1, 2)
        w_n on both coordinates, or on those of all meshes of a set, less the mean load: N, N mm.
    tangent : ndarray of complex, shape (2 K + 1, 2, 2)
        k_n.
    """

    force: ComplexArray
    tangent: ComplexArray

    @property
    def mean(self) -> FloatArray:
        """Mean tangent, (2, 2)."""
        return np.asarray(self.tangent[0].real)


def mesh_cycle(force: FloatArray, tangent: FloatArray, load: FloatArray, harmonics: int) -> MeshCycle:
    """Return the harmonics of forces (A, 2) and tangents (A, 2, 2) over the cycle, under a mean load (2,)."""
    angles, most = len(force), harmonics + FURTHER
    forces = np.fft.rfft(force - load, axis=0)[: most + 1] / angles
    return MeshCycle(forces, np.fft.rfft(tangent, axis=0)[: 2 * most + 1] / angles)


def hill(
    cycle: MeshCycle, receptance: ComplexArray, closed_by: FloatArray | None = None, shapes: ComplexArray | None = None
) -> ComplexArray:
    """Return the forces f_n of (1) on the closed machine, shape (S, K + 1, 2).

    Parameters
    ----------
    receptance : ndarray of complex, shape (S, K + 1, 2, 2)
        H at harmonics 0, 1, ..., K of S speeds.
    closed_by : ndarray, shape (2, 2), optional
        Mean tangent that closes the machine, where it is another one.
    shapes : ndarray of complex, shape (K + 1, P, 2), optional
        What the P coordinates of the cycle do at each harmonic, orthonormal: those of equal planets.
    """
    orders = np.arange(-receptance.shape[1] + 1, receptance.shape[1])
    right = signed(cycle.force[: receptance.shape[1]], orders)
    if shapes is not None:
        right = np.einsum("npq,np->nq", signed(shapes, orders).conj(), right)
    found = np.linalg.solve(equations(cycle, receptance, closed_by, shapes), right.reshape(-1, 1))
    return np.asarray(found.reshape(len(receptance), *right.shape)[:, receptance.shape[1] - 1 :])


def equations(
    cycle: MeshCycle, receptance: ComplexArray, closed_by: FloatArray | None = None, shapes: ComplexArray | None = None
) -> ComplexArray:
    """Return the matrices of (1) for the forces, f + k H f = w, of all harmonics of either sign, (S, 4 K + 2, ...)."""
    further = 0.0 if closed_by is None else cycle.mean - closed_by
    speeds, count, size = receptance.shape[:3]
    orders = np.arange(-count + 1, count)
    apart, every = orders[:, None] - orders, size * len(orders)
    varying = np.where((apart == 0)[..., None, None], further, signed(cycle.tangent, apart))
    if shapes is not None:
        by = signed(shapes, orders)
        varying = np.einsum("npa,njpq,jqb->njab", by.conj(), varying, by, optimize=True)
    blocks = varying.transpose(0, 2, 1, 3).reshape(every, every)
    matrix = np.empty((speeds, every, every), dtype=complex)
    for place, order in enumerate(orders):
        own, columns = receptance[:, abs(order)], slice(size * place, size * (place + 1))
        matrix[:, :, columns] = blocks[:, columns] @ (own if order >= 0 else own.conj())
    matrix[:, np.arange(every), np.arange(every)] += 1.0
    return matrix


def mesh_forces(closed_by: FloatArray, receptance: ComplexArray, closing: ComplexArray) -> ComplexArray:
    """Return the forces of the mesh beside its mean load, (S, K + 1, 2), by those of `hill` on the closed machine."""
    return np.asarray(closing - np.einsum("ab,snb->sna", closed_by, moved(receptance, closing)))


def moved(receptance: ComplexArray, closing: ComplexArray) -> ComplexArray:
    """Return the coordinates of the mesh, x_n, (S, K + 1, 2)."""
    return np.asarray(np.einsum("snab,snb->sna", receptance, closing))


def time_invariant(cycle: MeshCycle) -> ComplexArray:
    """Return the forces f_n of a mesh of constant stiffness, by its transmission error at fixed load, (K + 1, 2)."""
    count, size = cycle.force.shape
    orders = np.arange(-count + 1, count)
    matrix = signed(cycle.tangent, orders[:, None] - orders).transpose(0, 2, 1, 3).reshape(size * len(orders), -1)
    moved = np.linalg.solve(matrix, signed(cycle.force, orders).ravel()).reshape(-1, size)[count - 1 :]
    return np.asarray(moved @ cycle.mean.T)


def signed(harmonics: ComplexArray, orders: IntArray) -> ComplexArray:
    """Return harmonics by orders of either sign, of a real signal."""
    found = harmonics[abs(orders)]
    negative = (orders < 0).reshape(*orders.shape, *(1,) * (harmonics.ndim - 1))
    return np.asarray(np.where(negative, found.conj(), found))
