"""Snapshots: solutions of full FE at a pinion angle, from which a basis is made."""

from __future__ import annotations

from dataclasses import dataclass

from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.gear.condition import Condition


@dataclass(frozen=True)
class Snapshots:
    """Full-FE equilibria at one pinion angle: P tooth pairs that can touch, T conditions, f flank unknowns per tooth.

    Parameters
    ----------
    phi : float
        Pinion angle, rad.
    conditions : tuple of T Condition
    pair_index : ndarray of int, shape (P,)
    force : ndarray, shape (T, P, 2, f)
        Nodal forces on the flanks of pinion and wheel, N; those on a node and on its image together.
    ste_um : ndarray, shape (T,)
        NaN where not converged.
    converged : ndarray of bool, shape (T,)
    estimate_percent : float
        Largest error estimate before this angle was chosen (`pmor.reduction.basis.Training`); NaN if none was made.
    """

    phi: float
    conditions: tuple[Condition, ...]
    pair_index: IntArray
    force: FloatArray
    ste_um: FloatArray
    converged: BoolArray
    estimate_percent: float = float("nan")

    @property
    def failures(self) -> tuple[str, ...]:
        """Name the solutions that are missing."""
        missing = (c for c, ok in zip(self.conditions, self.converged, strict=True) if not ok)
        return tuple(f"phi = {self.phi:.6g} rad, torque = {1e-3 * c.torque:g} N m" for c in missing)
