"""STE and error estimate at scattered states: what a greedy sampling asks a basis for."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pmor.arrays import FloatArray
from pmor.contact.condition import Condition
from pmor.reduction.basis import Basis
from pmor_online.model import reduced_pair
from pmor_online.sweep import TOLERANCE, sweep_reduced_pair


def estimate_errors(
    basis: Basis, phi: FloatArray, conditions: Sequence[Condition], tolerance: float = TOLERANCE
) -> tuple[FloatArray, FloatArray]:
    """Solve the reduced model at scattered states.

    Parameters
    ----------
    basis : Basis
        With what the error estimate needs.
    phi : ndarray, shape (n,)
        Pinion angles, rad.
    conditions : sequence of n Condition
    tolerance : float
        See `pmor_online.sweep.sweep_reduced_pair`.

    Returns
    -------
    ste_um, ste_error_um : ndarray, shape (n,)
        STE and the estimate of what it lacks, um; NaN where not converged.
    """
    reduced = reduced_pair(basis)
    ste, error = np.full((2, len(phi)), np.nan)
    for i, condition in enumerate(conditions):
        sweep = sweep_reduced_pair(reduced, phi[i : i + 1], [condition], tolerance=tolerance)
        ste[i] = sweep.ste_um[0, 0]
        if sweep.ste_error_um is not None:
            error[i] = sweep.ste_error_um[0, 0]
    return ste, error
