"""The meshes of a planetary set over their cycle, all hubs standing where the mean load holds them.

Planets are in mesh one after the other: what a mesh does at the harmonic h, planet n does exp(i h z psi_n) later, z the
teeth that pass. So harmonics fall into classes h z mod N: what of them adds up about the axis, across it, or nowhere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.errors import ConvergenceError
from pmor.dynamics.whine.blades import Blades
from pmor.dynamics.whine.cycle import MOST_STEPS, PER_HARMONIC, SETTLED
from pmor.dynamics.whine.hill import FURTHER, MeshCycle, mesh_cycle
from pmor.dynamics.whine.planets import MovingSet
from pmor.line.hub_law import HubLaw, train_coordinates, train_law_at, train_rows
from pmor.sets.loader import SetFile
from pmor.sets.solution import SetSolution

# Quarters of a turn over which the orders of a tangent around the axis have their mean.
QUARTERS = 4


@dataclass(frozen=True)
class SetCycle:
    """Harmonics of all meshes of a set, and their mean stiffness as the housing sees it.

    Parameters
    ----------
    meshes : MeshCycle
        On K coordinates, planet by planet; harmonics of the whole cycle of all meshes.
    load : ndarray, shape (K,)
        Mean forces, N and N mm.
    pitches : int
        Of the sun's teeth in that cycle.
    blades : Blades
    turns : bool
        Whether the carrier turns.
    uneven : float
        By how much the mean tangents of planets differ, over the largest.
    """

    meshes: MeshCycle
    load: FloatArray
    pitches: int
    blades: Blades
    turns: bool
    uneven: float

    @property
    def each(self) -> int:
        """Coordinates of a planet."""
        return len(self.meshes.mean) // self.blades.count

    @property
    def tangent(self) -> FloatArray:
        """Mean tangent on the coordinates of `blades`, (K, K), over a turn of a carrier that turns."""
        quarters = range(QUARTERS if self.turns else 1)
        return np.asarray(np.mean([_at(self.blades, self.meshes.mean, quarter) for quarter in quarters], axis=0))


def _at(blades: Blades, tangent: FloatArray, quarter: int) -> FloatArray:
    """A tangent of all planets in coordinates that stand still, the carrier turned by quarters, (K, K)."""
    whole = np.kron(blades.at(0.5 * np.pi * quarter), np.eye(len(tangent) // blades.count))
    return np.asarray(whole.T @ tangent @ whole)


def set_cycle(one: MovingSet, file: SetFile, solution: SetSolution, row: int, harmonics: int) -> SetCycle:
    """Return the harmonics of all meshes of a set along the deflection under which its load is the mean.

    Parameters
    ----------
    file : SetFile
        That repeats with each mesh cycle.
    row : int
        Of the load in the solution.
    harmonics : int
        Of the first mesh.

    Raises
    ------
    ConvergenceError
    """
    pitches, blades = file.plan.cycle, one.coordinates.blades
    angles = file.alike_from(PER_HARMONIC * 2 * (harmonics + FURTHER))
    law, load = law_under_load(one.name, solution, row, angles)
    cycle = mesh_cycle(law.force, law.tangent, load, pitches * (harmonics + FURTHER) - FURTHER)
    still, *turned = (_at(blades, cycle.mean, quarter) for quarter in range(QUARTERS))
    apart = max(float(np.abs(other - still).max()) for other in turned) / float(np.abs(cycle.mean).max())
    return SetCycle(cycle, load, pitches, blades, one.carrier != 0.0, apart)


def law_under_load(name: str, solution: SetSolution, row: int, angles: int) -> tuple[HubLaw, FloatArray]:
    """Return the law of a set at the deflection whose mean force is that under its load, and this force, (K,).

    What other loads do to the hubs in the housing, which turns against the carrier, is left out.
    """
    train, plan = solution.train, solution.plan
    there = solution.left(row)
    if not there.all():
        raise ConvergenceError(f"set {name}: contact was not found at all positions: no motion about this load", [])
    pitch = train.meshes[0].pair.meshed.pair.pitch
    phi = pitch * np.arange(plan.cycle * angles) / angles
    placed, columns = train.place(phi, plan.displacement), train_coordinates(train)
    force = solution.found.force[row].reshape(solution.cycles, len(solution.placed.phi), -1).mean(axis=0)
    load = np.einsum("an,anc->c", force, train_rows(solution.placed)) / len(force)
    moved = columns.T @ solution.hub_displacement[row].reshape(len(solution.phi_rad), -1).mean(axis=0)
    for _ in range(MOST_STEPS):
        law = train_law_at(placed, moved)
        if not law.converged.all():
            break
        more = law.force.mean(axis=0) - load
        if np.abs(more).max() <= SETTLED * np.abs(load).max():
            return law, load
        moved = moved + np.linalg.solve(law.tangent.mean(axis=0), more)
    raise ConvergenceError(f"set {name}: no deflection found under which its mean forces are those of the load", [])
