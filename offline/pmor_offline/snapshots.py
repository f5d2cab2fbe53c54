"""Full-FE contact at one pinion angle: the forces that the flanks exchange."""

from __future__ import annotations

from itertools import groupby

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.pair.model import ElasticModel
from pmor.penalty.pair import as_penalty
from pmor.penalty.solve import SolvedPosition, solve_position
from pmor.reduction.basis import Snapshots
from pmor_offline.sampling import TrainingPosition


def solve_snapshots(
    model: ElasticModel, training: TrainingPosition, estimate_percent: float = float("nan")
) -> Snapshots:
    """Solve full FE at one angle under all its conditions.

    Parameters
    ----------
    estimate_percent : float
        Error estimate for which the position was chosen.
    """
    solved: list[SolvedPosition] = []
    for _, conditions in groupby(training.conditions, lambda condition: condition.assembly):
        # Torques that follow each other with the same axes and flanks share windows, and start from each other.
        solved.append(
            solve_position(as_penalty(model.mesh.meshed), training.phi, list(conditions), model.elasticity_at)
        )
    pairs = np.unique(np.concatenate([s.position.pair_index for s in solved]))
    count = len(training.conditions)
    force = np.zeros((count, len(pairs), 2, model.pinion.compliance.shape[1]))
    ste = np.full(count, np.nan)
    states = ((s, e) for s in solved for e in s.equilibria)
    for t, (position, equilibrium) in enumerate(states):
        if equilibrium is None:
            continue
        ste[t] = equilibrium.advance * model.mesh.meshed.pair.pinion.base_radius * 1e3
        contact = equilibrium.contact
        nodal = contact.nodal_forces(contact.force, len(position.position.nodes))
        _scatter(position, nodal, np.searchsorted(pairs, position.position.pair_index), force[t])
    # The constraint that keeps nodes in their plane takes that component up, and it does no work.
    force[..., model.mesh.pinion.flank_held_axially] = 0.0
    return Snapshots(
        phi=training.phi, conditions=training.conditions, pair_index=pairs, force=force, ste_um=ste,
        converged=np.isfinite(ste), estimate_percent=estimate_percent,
    )  # fmt: skip


def _scatter(solved: SolvedPosition, nodal: FloatArray, places: np.ndarray, force: FloatArray) -> None:
    """Carry window forces to whole flanks: `force` has shape (pairs, 2, flank unknowns)."""
    position = solved.position
    for p, place in enumerate(places):
        for gear in range(2):
            flank = force[place, gear].reshape(-1, 3)
            flank[position.flank_nodes[p][gear]] = nodal[position.window_slice(p, gear)]
