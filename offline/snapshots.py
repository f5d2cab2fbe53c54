"""Full-FE contact at one pinion angle: the forces that the flanks exchange."""

from __future__ import annotations

import numpy as np

from pmor.contact.solve import SolvedPosition, solve_position
from pmor.model import ElasticModel
from pmor.storage.snapshot_file import Snapshots


def solve_snapshots(model: ElasticModel, phi: float, torques: tuple[float, ...]) -> Snapshots:
    """Solve full FE at one angle for all training torques.

    Parameters
    ----------
    model : ElasticModel
    phi : float
        Pinion angle, rad.
    torques : tuple of float
        N mm.

    Returns
    -------
    Snapshots
    """
    meshed = model.mesh.meshed
    solved = solve_position(meshed, phi, torques, model.elasticity_at)
    pairs = solved.position.pair_index
    force = np.zeros((len(torques), len(pairs), 2, model.pinion.compliance.shape[1]))
    ste = np.full(len(torques), np.nan)
    for t, equilibrium in enumerate(solved.equilibria):
        if equilibrium is None:
            continue
        ste[t] = equilibrium.lead * meshed.pair.pinion.base_radius * 1e3
        contact = equilibrium.contact
        nodal = contact.nodal_forces(contact.force, len(solved.position.nodes))
        _scatter(solved, nodal, force[t])
    # What holds nodes in their plane takes that component up, and it does no work.
    force[..., model.mesh.pinion.flank_held_axially] = 0.0
    return Snapshots(phi, pairs, force, ste, np.isfinite(ste))


def _scatter(solved: SolvedPosition, nodal: np.ndarray, force: np.ndarray) -> None:
    """Carry window forces to whole flanks: `force` has shape (pairs, 2, flank unknowns)."""
    position = solved.position
    for p in range(len(position.pair_index)):
        for gear in range(2):
            flank = force[p, gear].reshape(-1, 3)
            flank[position.flank_nodes[p][gear]] = nodal[position.window_slice(p, gear)]
