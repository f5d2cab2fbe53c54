"""The meshes of a planetary set over their cycle, all hubs standing where the mean load holds them.

Planets are in mesh one after the other: what a mesh does at the harmonic h, planet n does exp(i h z psi_n) later, z the
teeth that pass. So harmonics fall into classes h z mod N: what of them adds up about the axis, across it, or nowhere.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.errors import CaseError, ConvergenceError
from pmor.dynamics.whine.blades import Blades
from pmor.dynamics.whine.cycle import MOST_STEPS, PER_HARMONIC, SETTLED
from pmor.dynamics.whine.hill import FURTHER, MeshCycle, mesh_cycle
from pmor.line.hub_law import HubLaw, train_coordinates, train_law_at, train_rows
from pmor.machine.coupled_sets import SolvedSet
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
    uneven : float
        By how much the mean tangents of planets differ, over the largest.
    """

    meshes: MeshCycle
    load: FloatArray
    pitches: int
    blades: Blades
    uneven: float

    @property
    def each(self) -> int:
        """Coordinates of a planet."""
        return len(self.meshes.mean) // self.blades.count

    @property
    def tangent(self) -> FloatArray:
        """Mean tangent on the coordinates of `pmor.dynamics.whine.blades`, (K, K): the same wherever the carrier is."""
        return around(self.blades, self.meshes.mean)


def solved_cycle(solved: SolvedSet, blades: Blades, harmonics: int) -> SetCycle:
    """Return the cycle of a set of a gearbox under its load; errors as of `set_cycle`."""
    one, angles = solved.meshing, PER_HARMONIC * 2 * (harmonics + FURTHER)
    return set_cycle(one.settings.name, one.file, solved.solution, 0, blades, harmonics, angles)


def around(blades: Blades, tangent: FloatArray) -> FloatArray:
    """Return a tangent of all planets (K, K) in coordinates that stand still, its mean over a turn of the carrier."""
    each, found = np.eye(len(tangent) // blades.count), []
    for quarter in range(QUARTERS):
        turned = blades.at(0.5 * np.pi * quarter)
        whole = np.kron(turned, each)
        found.append(whole.T @ tangent @ whole)
    return np.asarray(np.mean(found, axis=0))


def set_cycle(
    name: str, file: SetFile, solution: SetSolution, row: int, blades: Blades, harmonics: int, angles: int
) -> SetCycle:
    """Return the harmonics of all meshes of a set along the deflection under which its load is the mean.

    Parameters
    ----------
    row : int
        Of the load in the solution.
    harmonics : int
        Of the first mesh.
    angles : int
        Of a pitch, at least.

    Raises
    ------
    CaseError
        Where pitches of the set differ.
    ConvergenceError
    """
    refuse_pitches(name, file)
    pitches = file.plan.cycle
    law, load = law_under_load(name, solution, row, file.alike_from(angles))
    cycle = mesh_cycle(law.force, law.tangent, load, pitches * (harmonics + FURTHER) - FURTHER)
    whole = np.kron(blades.matrix, np.eye(len(load) // blades.count))
    apart = whole.T @ cycle.mean @ whole - around(blades, cycle.mean)
    return SetCycle(cycle, load, pitches, blades, float(np.abs(apart).max() / np.abs(cycle.mean).max()))


def refuse_pitches(name: str, file: SetFile) -> None:
    """Refuse sets whose pitches differ: CaseError."""
    if file.pitches > file.plan.cycle:
        raise CaseError(
            f'set "{name}": motion takes sets that repeat with each mesh cycle: leave out eccentricities, '
            "pitch_deviations_um, holes and lugs"
        )


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
