"""Masses on springs and dampers under the force of a mesh, and their dynamic stiffness along it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from pmor.core.arrays import ComplexArray, FloatArray

#: of the equations of statics, relative to the load: more is a load that nothing holds
UNBALANCED = 1e-9
# From more masses on free motion is by its modes; condition of these, above which they are nearly alike.
FEW, MOST_ALIKE = 8, 1e7


class FreeModes(NamedTuple):
    """Motion without the mesh by 2n complex modes, a' = values a, that push and are seen at the mesh."""

    values: ComplexArray  # shape (2n,)
    states: ComplexArray  # shape (2n, 2n): Displacements and velocities by amplitudes
    amplitudes: ComplexArray  # shape (2n, 2n): And back


@dataclass(frozen=True)
class Oscillator:
    """M q'' + C q' + K q + l^T F(psi, l q) = f, of n degrees of freedom; the mesh is not in the matrices.

    A mesh has one coordinate along the line of action, or r.
    """

    # shape (n, n)
    mass: FloatArray
    damping: FloatArray
    stiffness: FloatArray
    # shape (n,) or (r, n): l: how far the flanks run ahead along the line of action per displacement
    lever: FloatArray
    load: FloatArray  # shape (n,): f, constant

    @property
    def size(self) -> int:
        """Degrees of freedom."""
        return self.lever.shape[-1]

    @property
    def rows(self) -> FloatArray:
        """Coordinates of the mesh by displacements, (r, n)."""
        return np.atleast_2d(self.lever)

    @cached_property
    def free(self) -> FloatArray:
        """Rates of displacements and velocities by these without the mesh, (2n, 2n)."""
        inverse, n = np.linalg.inv(self.mass), self.size
        below = -inverse @ self.stiffness, -inverse @ self.damping
        return np.block([[np.zeros((n, n)), np.eye(n)], [*below]])

    @cached_property
    def push(self) -> FloatArray:
        """Accelerations per force of the mesh, (n, r)."""
        return np.ascontiguousarray(-np.linalg.solve(self.mass, self.rows.T))

    @cached_property
    def modes(self) -> FreeModes | None:
        """Free motion by modes; None of few masses, and where modes are alike, as with a rotation nothing holds."""
        if self.size <= FEW:
            return None
        values, states = np.linalg.eig(self.free)
        return FreeModes(values, states, np.linalg.inv(states)) if np.linalg.cond(states) < MOST_ALIKE else None


def mesh_receptance_of(oscillator: Oscillator, frequency: FloatArray) -> tuple[ComplexArray, ComplexArray]:
    """Return the receptance that the mesh feels, l Z^-1 l^T, and its derivative by the frequency.

    Z = K - w^2 M + i w C; complex, (k, r, r) each, by angular frequencies (k,).
    """
    rows, modes = oscillator.rows, oscillator.modes
    if modes is not None:
        answer = 1.0 / (1j * np.asarray(frequency, dtype=float)[:, None] - modes.values)
        by, n = rows @ modes.states[: oscillator.size], oscillator.size
        pushed = -modes.amplitudes[:, n:] @ oscillator.push
        return np.asarray((by * answer[:, None]) @ pushed), np.asarray((-1j * by * answer[:, None] ** 2) @ pushed)
    impedance = _impedance(oscillator, frequency)
    moved, seen = (
        np.linalg.solve(matrix, np.broadcast_to(rows.T, (len(matrix), *rows.T.shape)))
        for matrix in (impedance, impedance.transpose(0, 2, 1))
    )
    w = np.asarray(frequency, dtype=float)[:, None, None]
    rate = -2.0 * w * oscillator.mass + 1j * oscillator.damping
    return np.asarray(rows @ moved, dtype=complex), np.asarray(-seen.transpose(0, 2, 1) @ rate @ moved)


def _impedance(oscillator: Oscillator, frequency: FloatArray) -> ComplexArray:
    w = np.asarray(frequency, dtype=float)[:, None, None]
    return np.asarray(oscillator.stiffness - w**2 * oscillator.mass + 1j * w * oscillator.damping)


def static_stiffness_of(oscillator: Oscillator) -> tuple[FloatArray, FloatArray]:
    """Return stiffness d, (r, r), and force f, (r,), that the mesh feels at rest, d x + F = f.

    d = 0 where nothing but the mesh holds. ValueError where the load moves masses that neither bearings nor mesh hold.
    """
    n, scale, rows = oscillator.size, _scale(oscillator), oscillator.rows
    bordered = np.zeros((n + len(rows), n + len(rows)))
    bordered[:n, :n] = scale[:, None] * oscillator.stiffness * scale
    bordered[n:, :n] = scale * rows
    bordered[:n, n:] = bordered[n:, :n].T
    right = np.zeros((n + len(rows), 1 + len(rows)))
    right[:n, 0], right[n:, 1:] = scale * oscillator.load, np.eye(len(rows))
    # Least squares: the rotation of both gears together is free and does not matter.
    solution = np.linalg.lstsq(bordered, right, rcond=None)[0]
    if np.abs(bordered @ solution - right).max() > UNBALANCED * max(np.abs(right).max(), 1e-300):
        raise ValueError("the load moves masses that neither bearings nor mesh hold")
    return np.asarray(-solution[n:, 1:], dtype=float), np.asarray(solution[n:, 0], dtype=float)


def position_under(oscillator: Oscillator, force: FloatArray, along: FloatArray) -> FloatArray:
    """Return the displacements at rest, (n,), under the load and mesh forces, at coordinates, (r,) each."""
    scale, rows = _scale(oscillator), oscillator.rows
    matrix = np.vstack([scale[:, None] * oscillator.stiffness * scale, scale * rows])
    right = np.append(scale * (oscillator.load - force @ rows), along)
    return np.asarray(scale * np.linalg.lstsq(matrix, right, rcond=None)[0])


def _scale(oscillator: Oscillator) -> FloatArray:
    """Displacements that make all stiffnesses alike: those of bearings may be far from those of the mesh."""
    own = np.diag(oscillator.stiffness)
    return np.where(own > 0.0, 1.0 / np.sqrt(np.where(own > 0.0, own, 1.0)), 1.0)


def motion_of(oscillator: Oscillator, frequency: FloatArray, forces: ComplexArray) -> ComplexArray:
    """Return the amplitudes of all degrees of freedom, (k, n), under the mesh forces of frequencies, (k, r)."""
    return np.asarray(
        np.linalg.solve(_impedance(oscillator, frequency), -(forces @ oscillator.rows)[..., None])[..., 0]
    )
