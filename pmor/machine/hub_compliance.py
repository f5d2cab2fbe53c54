"""What hubs on shafts stand on: shafts, bearings and housing, condensed to them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy.linalg import null_space

from pmor.body.beam import NODE
from pmor.body.play import BearingWithPlay
from pmor.core.arrays import FloatArray, IntArray
from pmor.machine.loaded import ABOUT_AXIS, LoadedGearbox
from pmor.machine.system import ARM, UNITS, Equilibrium, tangent_of

# Least stiffness by which a bearing holds its shaft where it lies loose in the linearised machine, N/mm.
LOOSE = 1.0


def compliance_below(gearbox: LoadedGearbox, equilibrium: Equilibrium, hubs: Sequence[int]) -> FloatArray:
    """Return the compliance below hubs in axes of the machine, of their bearings' tangents, (6 n, 6 n).

    Shafts are held against rotation at one place each, those of the hubs there: forces of meshes are those of the
    torques, and bending does not depend on the angle of a shaft.

    Parameters
    ----------
    hubs : sequence of int, length n
        First displacements of their nodes.
    """
    compliance = fields_below(gearbox, equilibrium, hubs)[_places(hubs)]
    return np.asarray(0.5 * (compliance + compliance.T))


def fields_below(gearbox: LoadedGearbox, equilibrium: Equilibrium, hubs: Sequence[int]) -> FloatArray:
    """Return the displacements of all nodes under unit wrenches on hubs, (n, 6 h), as of `compliance_below`."""
    system, (_, basis) = gearbox.system, held_shafts(gearbox, hubs)
    tangent = tangent_of(system, equilibrium.bearings)
    for seat, state in zip(system.seats, equilibrium.bearings, strict=True):
        if isinstance(seat.bearing, BearingWithPlay) or not state.stiffness.any():
            tangent += seat.rows.T @ _held(state.stiffness) @ seat.rows
    return np.asarray(basis @ np.linalg.solve(basis.T @ tangent @ basis, basis[_places(hubs)].T))


def held_shafts(gearbox: LoadedGearbox, hubs: Sequence[int]) -> tuple[FloatArray, FloatArray]:
    """Return what is held of shafts as of `compliance_below`, and the displacements that this leaves.

    Returns
    -------
    (ndarray, ndarray), shapes (m, n) and (n, f)
        Rows of rigid bearings in their order, then of rotations; a basis.
    """
    rigid = [row for bearing in gearbox.bearings for row in bearing.rows[list(bearing.rigid)]]
    turned = {start: start + ABOUT_AXIS for start in gearbox.first.values()}
    for hub in hubs:
        turned[max(start for start in turned if start <= hub)] = hub + ABOUT_AXIS
    held = np.array(rigid + [np.eye(len(gearbox.load))[place] for place in turned.values()])
    scale = np.where(gearbox.system.rotations, 1.0 / ARM, 1.0)
    return held, np.asarray(scale[:, None] * null_space(held * scale))


def _held(stiffness: FloatArray) -> FloatArray:
    """Return what holds an inner ring where it lies loose in its clearance, by its stiffness, (5, 5)."""
    values, ways = np.linalg.eigh(stiffness * np.outer(UNITS, UNITS))
    ways = ways / UNITS[:, None]
    return np.asarray(ways @ np.diag(np.maximum(LOOSE - values, 0.0)) @ ways.T)


def _places(hubs: Sequence[int]) -> IntArray:
    """Displacements of hubs."""
    return np.concatenate([hub + np.arange(NODE) for hub in hubs])
