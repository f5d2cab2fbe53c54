"""Masses on springs and dampers under the force of a mesh, and their dynamic stiffness along it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pmor.core.arrays import FloatArray

#: of the equations of statics, relative to the load: more is a load that nothing holds
UNBALANCED = 1e-9


@dataclass(frozen=True)
class Oscillator:
    """M q'' + C q' + K q + l F(psi, l . q) = f, of n degrees of freedom; symmetric matrices, the mesh not in them."""

    # shape (n, n)
    mass: FloatArray
    damping: FloatArray
    stiffness: FloatArray
    lever: FloatArray  # shape (n,): l: how far the flanks run ahead along the line of action per displacement
    load: FloatArray  # shape (n,): f, constant

    @property
    def size(self) -> int:
        """Degrees of freedom."""
        return len(self.lever)


def mesh_stiffness_of(oscillator: Oscillator, frequency: FloatArray) -> tuple[NDArray[np.complex128], ...]:
    """Return the dynamic stiffness d that the mesh feels, d x + F = 0, and its derivative by the frequency.

    With Z = K - w^2 M + i w C it is 1 / (l . Z^-1 l); complex, (k,) each, by angular frequencies (k,).
    """
    w = np.asarray(frequency, dtype=float)[:, None, None]
    impedance = oscillator.stiffness - w**2 * oscillator.mass + 1j * w * oscillator.damping
    moved = np.linalg.solve(impedance, np.broadcast_to(oscillator.lever[:, None], (len(w), oscillator.size, 1)))[..., 0]
    stiffness = 1.0 / (moved @ oscillator.lever)
    rate = -2.0 * w * oscillator.mass + 1j * oscillator.damping
    return stiffness, np.einsum("ki,kij,kj->k", moved, rate, moved) * stiffness**2


def static_stiffness_of(oscillator: Oscillator) -> tuple[float, float]:
    """Return stiffness d and force f that the mesh feels at rest, d x + F = f; d = 0 where nothing but it holds.

    ValueError where the load moves masses that neither bearings nor mesh hold.
    """
    n, scale = oscillator.size, _scale(oscillator)
    bordered = np.zeros((n + 1, n + 1))
    bordered[:n, :n] = scale[:, None] * oscillator.stiffness * scale
    bordered[:n, n] = bordered[n, :n] = scale * oscillator.lever
    right = np.zeros((n + 1, 2))
    right[:n, 0], right[n, 1] = scale * oscillator.load, 1.0
    # Least squares: the rotation of both gears together is free and does not matter.
    solution = np.linalg.lstsq(bordered, right, rcond=None)[0]
    if np.abs(bordered @ solution - right).max() > UNBALANCED * max(np.abs(right).max(), 1e-300):
        raise ValueError("the load moves masses that neither bearings nor mesh hold")
    return -float(solution[n, 1]), float(solution[n, 0])


def position_under(oscillator: Oscillator, force: float, along: float) -> FloatArray:
    """Return the displacements at rest, (n,), under the load and a mesh force, at a displacement along the line."""
    scale = _scale(oscillator)
    rows = np.vstack([scale[:, None] * oscillator.stiffness * scale, scale * oscillator.lever])
    right = np.append(scale * (oscillator.load - oscillator.lever * force), along)
    return np.asarray(scale * np.linalg.lstsq(rows, right, rcond=None)[0])


def _scale(oscillator: Oscillator) -> FloatArray:
    """Displacements that make all stiffnesses alike: those of bearings may be far from those of the mesh."""
    own = np.diag(oscillator.stiffness)
    return np.where(own > 0.0, 1.0 / np.sqrt(np.where(own > 0.0, own, 1.0)), 1.0)


def motion_of(oscillator: Oscillator, frequency: FloatArray, forces: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Return the amplitudes of all degrees of freedom under the mesh forces of frequencies, (k, n)."""
    w = np.asarray(frequency, dtype=float)[:, None, None]
    impedance = oscillator.stiffness - w**2 * oscillator.mass + 1j * w * oscillator.damping
    return np.asarray(np.linalg.solve(impedance, -forces[:, None, None] * oscillator.lever[:, None])[..., 0])
