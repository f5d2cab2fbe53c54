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
from pmor.dynamics.whine.cycle import PER_HARMONIC, StandingTrain, train_under_load
from pmor.dynamics.whine.hill import FURTHER, MeshCycle
from pmor.dynamics.whine.planets import MovingSet
from pmor.sets.loader import SetFile
from pmor.sets.solution import SetSolution

# Quarters of a turn over which the orders of a tangent around the axis have their mean.
QUARTERS = 4
# Harmonics that are solved beyond those that are wanted.
BEYOND = 1


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
    standing : StandingTrain, optional
        The meshes, where they are no made-up ones.
    """

    meshes: MeshCycle
    load: FloatArray
    pitches: int
    blades: Blades
    turns: bool
    uneven: float
    standing: StandingTrain | None = None

    @property
    def each(self) -> int:
        """Coordinates of a planet."""
        return len(self.meshes.mean) // self.blades.count

    @property
    def tangent(self) -> FloatArray:
        """Mean tangent on the coordinates of `blades`, (K, K), over a turn of a carrier that turns."""
        return self.standing_still(self.meshes.mean)

    def standing_still(self, tangent: FloatArray) -> FloatArray:
        """Return a mean tangent of all planets in coordinates of `blades`, over a turn of a carrier that turns."""
        return np.asarray(np.mean([_at(self.blades, tangent, quarter) for quarter in self._quarters], axis=0))

    def seen_by_planets(self, at_rest: FloatArray) -> FloatArray:
        """Return a receptance at rest of coordinates of `blades` on those of all meshes, (K, K), over such a turn."""
        wholes = [_whole(self.blades, self.each, quarter) for quarter in self._quarters]
        return np.asarray(np.mean([whole @ at_rest @ whole.T for whole in wholes], axis=0))

    def of_planets(self, mesh: int) -> FloatArray:
        """Return rows of the forces of the sun's (0) or ring's mesh (1) by those of `blades`, over root N, (N, K)."""
        square: FloatArray = np.diagonal(self.blades.matrix.T @ self.blades.matrix).astype(float)
        rows: FloatArray = np.eye(len(self.meshes.mean))[mesh * self.each // 2 :: self.each]
        return np.asarray(rows / np.sqrt(self.blades.count * square)[:, None], dtype=np.float64)

    @property
    def _quarters(self) -> range:
        return range(QUARTERS if self.turns else 1)


def _at(blades: Blades, tangent: FloatArray, quarter: int) -> FloatArray:
    """A tangent of all planets in coordinates that stand still, the carrier turned by quarters, (K, K)."""
    whole = _whole(blades, len(tangent) // blades.count, quarter)
    return np.asarray(whole.T @ tangent @ whole)


def _whole(blades: Blades, each: int, quarter: int) -> FloatArray:
    return np.asarray(np.kron(blades.at(0.5 * np.pi * quarter), np.eye(each)), dtype=np.float64)


def set_cycle(one: MovingSet, file: SetFile, solution: SetSolution, row: int, harmonics: int) -> SetCycle:
    """Return the harmonics of all meshes of a set along the deflection under which its load is the mean.

    What other loads do to the hubs in the housing, which turns against the carrier, is left out.

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
    angles = file.alike_from(PER_HARMONIC * 2 * (harmonics + BEYOND))
    try:
        standing = train_under_load(solution, row, pitches, angles, pitches * (harmonics + BEYOND) - FURTHER)
        cycle = standing.cycle()
    except ConvergenceError as error:
        raise ConvergenceError(f"set {one.name}: {error}: no motion about this load", []) from None
    still, *turned = (_at(blades, cycle.mean, quarter) for quarter in range(QUARTERS))
    apart = max(float(np.abs(other - still).max()) for other in turned) / float(np.abs(cycle.mean).max())
    return SetCycle(cycle, standing.load, pitches, blades, one.carrier != 0.0, apart, standing)
