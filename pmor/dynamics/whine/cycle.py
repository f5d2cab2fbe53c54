"""The meshes of a loaded gearbox over their cycles, their hubs standing where the mean load holds them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.errors import ConvergenceError
from pmor.dynamics.whine.hill import FURTHER, MeshCycle, mesh_cycle
from pmor.gear.condition import Condition
from pmor.line.hub_law import HubLaw, law_at, mesh_coordinates
from pmor.machine.coupled import SolvedLoad, SolvedMesh, condition_of, in_axes_of_pair
from pmor_online.model import ReducedPair, online_angles

# Steps of the deflection until its mean force is the load; of the load, what is left.
MOST_STEPS, SETTLED = 20, 1e-6
# Angles of a mesh cycle to each harmonic of its stiffness.
PER_HARMONIC = 8


@dataclass(frozen=True)
class StandingMesh:
    """A mesh whose hubs stand.

    Parameters
    ----------
    load : ndarray, shape (2,)
        Mean forces on its coordinates, N and N mm.
    displacement : ndarray, shape (12,)
        Of both hubs.
    harmonics : int
        Told.
    backwards : bool
        Whether the mesh passes against its pinion's angle, as where the wheel drives.
    taken_out : ndarray, shape (2, 2), optional
        Compliance of modes of its gears, which the machine has: displacements are those beside it.
    settled : HubLaw, optional
        The law there, where it was found already.
    """

    name: str
    reduced: ReducedPair
    condition: Condition
    load: FloatArray
    displacement: FloatArray
    harmonics: int
    backwards: bool = False
    taken_out: FloatArray | None = None
    settled: HubLaw | None = None

    def law(self) -> HubLaw:
        """Return the forces over the cycle; ConvergenceError where some are not found."""
        if self.settled is not None:
            return self.settled
        pair, count = self.reduced.meshed.pair, PER_HARMONIC * 2 * (self.harmonics + FURTHER)
        law = law_at(self.reduced.lines, online_angles(pair.pitch, count, 1), self.condition, self.displacement,
                     self.taken_out)  # fmt: skip
        if not law.converged.all():
            raise ConvergenceError(f"mesh {self.name}: contact was not found between hubs that stand", [])
        return law

    def cycle(self) -> MeshCycle:
        """Return the harmonics of the forces over time."""
        law = self.law()
        found = mesh_cycle(law.force, law.tangent, self.load, self.harmonics)
        return MeshCycle(found.force.conj(), found.tangent.conj()) if self.backwards else found

    def without(self, compliance: FloatArray) -> StandingMesh:
        """Return the mesh whose law is without a compliance (2, 2), at the same load.

        Raises
        ------
        ConvergenceError
            Where what is left is no stiffness.
        """
        left = np.linalg.inv(self.law().tangent) - compliance
        if np.linalg.eigvalsh(left).min() <= 0.0:
            raise ConvergenceError(f"mesh {self.name}: modes of its gears are softer than its flanks", [])
        return _settled(replace(self.moved(compliance @ self.load), taken_out=compliance))

    def moved(self, coordinates: FloatArray) -> StandingMesh:
        """Return the mesh with its coordinates moved by so much, (2,)."""
        by_hubs = np.linalg.pinv(mesh_coordinates(self.reduced.meshed.pair))
        return replace(self, displacement=self.displacement + by_hubs.T @ coordinates, settled=None)


def standing_meshes(solved: SolvedLoad, pairs: Mapping[str, ReducedPair], harmonics: int) -> list[StandingMesh]:
    """Return all meshes of a loaded gearbox, at the deflections under which their loads are the means.

    Parameters
    ----------
    pairs : mapping of str to ReducedPair
        As of `pmor.machine.coupled.solve_load`.

    Raises
    ------
    ConvergenceError
    """
    return [_under_load(mesh, pairs[mesh.meshing.key], harmonics) for mesh in solved.meshes]


def _under_load(mesh: SolvedMesh, reduced: ReducedPair, harmonics: int) -> StandingMesh:
    pair, name = reduced.meshed.pair, mesh.meshing.settings.name
    by_hubs = np.linalg.pinv(mesh_coordinates(pair))
    load = by_hubs @ in_axes_of_pair(mesh.meshing.frame) @ mesh.meshing.wrenches.ravel() * mesh.force
    displacement = mesh.displacement.ravel().copy()
    # The pinion's advance, which the compliance of hubs leaves out.
    displacement[5] = 1e-3 * float(np.mean(mesh.sweep.ste_um)) / pair.pinion.base_radius
    return _settled(StandingMesh(name, reduced, condition_of(reduced, mesh.torque), load, displacement, harmonics))


def _settled(standing: StandingMesh) -> StandingMesh:
    """The mesh at the deflection under which its load is the mean."""
    load = standing.load
    for _ in range(MOST_STEPS):
        law = standing.law()
        more = law.force.mean(axis=0) - load
        if abs(more[0]) <= SETTLED * load[0]:
            return replace(standing, settled=law)
        standing = standing.moved(np.linalg.solve(law.tangent.mean(axis=0), more))
    raise ConvergenceError(f"mesh {standing.name}: no deflection found under which its mean force is the load", [])
