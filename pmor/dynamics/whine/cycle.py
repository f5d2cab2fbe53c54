"""The meshes of a loaded gearbox over their cycles, their hubs standing where the mean load holds them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.errors import ConvergenceError
from pmor.dynamics.whine.hill import MeshCycle, mesh_cycle
from pmor.line.hub_law import HubLaw, law_at, mesh_coordinates
from pmor.machine.coupled import SolvedLoad, SolvedMesh, condition_of, in_axes_of_pair
from pmor_online.model import ReducedPair, online_angles

# Steps of the deflection until its mean force is the load; of the load, what is left.
MOST_STEPS, SETTLED = 20, 1e-6


def mesh_cycles(solved: SolvedLoad, pairs: Mapping[str, ReducedPair], harmonics: int, angles: int) -> list[MeshCycle]:
    """Return the harmonics of all meshes of a loaded gearbox, along the deflection under which its load is the mean.

    Parameters
    ----------
    pairs : mapping of str to ReducedPair
        As of `pmor.machine.coupled.solve_load`.
    angles : int
        Of a mesh cycle.

    Raises
    ------
    ConvergenceError
    """
    found = []
    for mesh in solved.meshes:
        law, load = law_under_load(mesh, pairs[mesh.meshing.key], angles)
        found.append(mesh_cycle(law.force, law.tangent, load, harmonics))
    return found


def law_under_load(mesh: SolvedMesh, reduced: ReducedPair, angles: int) -> tuple[HubLaw, FloatArray]:
    """Return the law of a mesh at the deflection whose mean force is that under its load, and this force, (2,)."""
    pair, condition = reduced.meshed.pair, condition_of(reduced, mesh.torque)
    phi, columns = online_angles(pair.pitch, angles, 1), mesh_coordinates(pair)
    by_hubs = np.linalg.pinv(columns)
    load = by_hubs @ in_axes_of_pair(mesh.meshing.frame) @ mesh.meshing.wrenches.ravel() * mesh.force
    displacement = mesh.displacement.ravel().copy()
    # The pinion's advance, which the compliance of hubs leaves out.
    displacement[5] = 1e-3 * float(np.mean(mesh.sweep.ste_um)) / pair.pinion.base_radius
    for _ in range(MOST_STEPS):
        law = law_at(reduced.lines, phi, condition, displacement)
        if not law.converged.all():
            break
        more = law.force.mean(axis=0) - load
        if abs(more[0]) <= SETTLED * load[0]:
            return law, load
        displacement += by_hubs.T @ np.linalg.solve(law.tangent.mean(axis=0), more)
    name = mesh.meshing.settings.name
    raise ConvergenceError(f"mesh {name}: no deflection found under which its mean force is the load", [])
