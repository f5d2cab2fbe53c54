"""Discretisation error of the bodies' mesh: an error bar from the same sweep on half as many elements.

The line loads are exact on their mesh and the local law knows no mesh. The remaining error is that of the finite
elements of bodies and fillets. Half as many elements over profile and width are off by several times as much: of the
difference, as a root mean square over the pitch, a fixed share is the error of the finer mesh (Richardson's
extrapolation, Phil. Trans. A 210 (1911) 307, with a measured rate; `tests/verification/test_mesh_error.py`). One or two
elements over the width are held against four times as many. On a blank the harmonics that are left out are part of it,
by the bound that their number is found by.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pmor.body.blank import LEFT_OUT
from pmor.case import Case
from pmor.case.models import halved
from pmor.core.arrays import FloatArray
from pmor.gear.condition import Condition
from pmor.results.sweep import SteSweep, ste_mean_um
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.model import ReducedPair

# Of the difference to half as many elements, by the order of the elements: twice the quadratic ones leave a third of
# the error, and a sixth in plane strain; linear ones half, whose interior is not refined with the flank.
SHARE = {1: 0.9, 2: 0.55}
SHARE_IN_PLANE_STRAIN = {1: 0.9, 2: 0.18}
# Pinion angles at which the meshes are compared, at most; the difference varies slowly over them.
ANGLES = 24


def with_mesh_error(sweep: SteSweep, reduced: ReducedPair, conditions: Sequence[Condition]) -> SteSweep:
    """Return a sweep with the error bar of the mesh, where its basis holds the coarser mesh.

    Parameters
    ----------
    reduced : ReducedPair
        The model of the sweep.
    conditions : sequence of Condition
        Those of the sweep.
    """
    if reduced.coarser is None:
        return sweep
    places = np.unique(np.linspace(0, len(sweep.phi_rad), ANGLES, endpoint=False, dtype=int))
    coarse = sweep_line_loads(reduced.coarser, sweep.phi_rad[places], conditions).ste_um
    mean = np.abs(ste_mean_um(replace(sweep, ste_um=sweep.deflection_um)))
    cases = [reduced.basis.case]
    return replace(sweep, mesh_error_percent=error_percent(sweep.ste_um[:, places], coarse, mean, cases))


def error_percent(fine_um: FloatArray, coarse_um: FloatArray, mean_um: FloatArray, cases: Sequence[Case]) -> FloatArray:
    """Return the error bar of the mesh over a mean transmission error, (D,), %.

    Parameters
    ----------
    fine_um, coarse_um : ndarray, shape (D, A)
        Transmission error, and that on the elements of `pmor.case.models.halved`.
    mean_um : ndarray, shape (D,)
    cases : sequence of Case
        Of all meshes in it.
    """
    squares = (fine_um - coarse_um) ** 2
    difference = np.full(len(squares), np.nan)
    known = np.isfinite(squares).any(axis=1)
    difference[known] = np.sqrt(np.nanmean(squares[known], axis=1))
    left_out = LEFT_OUT if any(any(case.pair.blanks) for case in cases) else 0.0
    return np.asarray(100.0 * (max(map(_share, cases)) * difference / mean_um + left_out))


def _share(case: Case) -> float:
    """Share of the difference to a coarser mesh that is the error of the finer one."""
    mesh, other = case.mesh, halved(case)
    share = (SHARE_IN_PLANE_STRAIN if mesh.width == "plane_strain" else SHARE)[mesh.order]
    if other is not None and other.mesh.width_elements > mesh.width_elements:
        # Four times as many over the width, in two steps that leave the rest share / (1 + share) of the error each.
        share = 1.0 / (1.0 - (share / (1.0 + share)) ** 2)
    return share
