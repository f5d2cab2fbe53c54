"""STE and error estimate at scattered states, for a greedy sampling."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import Executor

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.threads import in_order
from pmor.gear.condition import Condition
from pmor.reduction.basis import Basis
from pmor_online.model import reduced_pair
from pmor_online.sweep import TOLERANCE, sweep_reduced_pair


def estimate_errors(
    basis: Basis, phi: FloatArray, conditions: Sequence[Condition], tolerance: float = TOLERANCE,
    executor: Executor | None = None,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Solve the reduced model at scattered states.

    Parameters
    ----------
    basis : Basis
        With the compliance for the error estimate.
    phi : ndarray, shape (n,)
        Pinion angles, rad.
    conditions : sequence of n Condition
    tolerance : float
        See `pmor_online.sweep.sweep_reduced_pair`.
    executor : concurrent.futures.Executor, optional
        Takes several states at a time.

    Returns
    -------
    ste_um, ste_error_um : ndarray, shape (n,)
        STE and the estimate of its error, um; NaN where not converged.
    """
    reduced = reduced_pair(basis)

    def solve(i: int) -> tuple[float, float]:
        sweep = sweep_reduced_pair(reduced, phi[i : i + 1], [conditions[i]], tolerance=tolerance)
        return sweep.ste_um[0, 0], np.nan if sweep.ste_error_um is None else sweep.ste_error_um[0, 0]

    found = np.array(list(in_order(solve, range(len(phi)), executor))).reshape(-1, 2)
    return found[:, 0], found[:, 1]
