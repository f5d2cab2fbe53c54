"""The meshes of a loaded machine over their cycles, their hubs standing where the mean load holds them.

A pair stands by itself; meshes that share gears, and those of a set, stand together. Of a pair that repeats after
several pitches hubs follow what is slower than the mesh frequency, as gears out of centre have them do: along this path
x_s of the first coordinate its forces are w + k x_s, and its tangents k.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TypeVar

import numpy as np

from pmor.core.arrays import ComplexArray, FloatArray
from pmor.core.errors import ConvergenceError
from pmor.dynamics.law import alike_cycles
from pmor.dynamics.whine.hill import FURTHER, MeshCycle, mesh_cycle
from pmor.gear.condition import Condition
from pmor.gear.modification import Modification
from pmor.line.hub_law import (
    COORDINATES,
    HubLaw,
    hub_moves,
    laws_at,
    mesh_coordinates,
    train_coordinates,
    train_law_at,
    train_rows,
)
from pmor.line.several import GearTrain, PlacedTrain
from pmor.machine.coupled import SolvedLoad, SolvedMesh, condition_of, in_axes_of_pair
from pmor.sets.solution import SetSolution
from pmor_online.model import ReducedPair, keeping_sections, online_angles

# Steps of the deflection until its mean force is the load; of the load, what is left.
MOST_STEPS, SETTLED = 20, 1e-6
# Of the load, what slow forces and their mean are left on a path: motion beside it is small.
FOLLOWED = 1e-2
# Angles of a mesh cycle to each harmonic of its stiffness.
PER_HARMONIC = 8
# Amounts of a flank that change their sign in its image, which is seen from the other end.
FROM_END_TO_END = "helix_slope_um", "twist_um"
GEARS = "pinion", "wheel"


@dataclass(frozen=True)
class StandingMesh:
    """A mesh whose hubs stand.

    Parameters
    ----------
    number : int
        In its gearbox.
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
    path : ndarray of complex, shape (p,), optional
        Lines 0 to p - 1 over p pitches of how far the hubs go along the first coordinate, mm.
    near : ndarray, shape (1, A, N), optional
        As of `laws_at`, of a mesh whose pitches are alike.
    """

    name: str
    number: int
    reduced: ReducedPair
    condition: Condition
    load: FloatArray
    displacement: FloatArray
    harmonics: int
    backwards: bool = False
    taken_out: FloatArray | None = None
    settled: HubLaw | None = None
    path: ComplexArray | None = None
    near: FloatArray | None = None

    @cached_property
    def kinds(self) -> tuple[int, ...]:
        """Kind of each pitch until teeth and bodies stand as before; one where all are alike."""
        kinds = alike_cycles(self.reduced, self.condition.assembly)
        return kinds if len(set(kinds)) > 1 else kinds[:1]

    @property
    def pitches(self) -> int:
        """After which it repeats."""
        return len(self.kinds)

    @property
    def angles(self) -> int:
        """Of a pitch."""
        return PER_HARMONIC * 2 * (self.harmonics + FURTHER)

    @property
    def slow(self) -> FloatArray:
        """The path at all angles of all pitches, mm."""
        count = self.pitches * self.angles
        return np.zeros(count) if self.path is None else np.fft.irfft(self.path * count, count)

    @property
    def names(self) -> tuple[str, ...]:
        """Its own."""
        return (self.name,)

    @property
    def numbers(self) -> tuple[int, ...]:
        """Its own."""
        return (self.number,)

    def flank(self, mesh: int, gear: int) -> Modification:
        """Return the flank of pinion (0) or wheel (1) of a mesh by its place here."""
        return self.condition.wheel if gear else self.condition.pinion

    def with_flank(self, mesh: int, gear: int, flank: Modification) -> StandingMesh:
        """Return the mesh with another flank of pinion or wheel, its hubs where they are."""
        condition = self.condition
        changed = replace(condition, wheel=flank) if gear else replace(condition, pinion=flank)
        return replace(self, condition=changed, settled=None)

    def law(self) -> HubLaw:
        """Return the forces over all pitches along the path; ConvergenceError where some are not found.

        Without a path pitches of a kind are found once.
        """
        if self.settled is not None:
            return self.settled
        pair, kinds = self.reduced.meshed.pair, self.kinds if self.path is None else range(self.pitches)
        angles, mean = online_angles(pair.pitch, self.angles), mesh_coordinates(pair).T @ self.displacement
        along, each = mean + self.slow.reshape(self.pitches, -1, 1) * np.eye(1, COORDINATES), dict[int, HubLaw]()
        for place, kind in enumerate(kinds):
            if kind not in each:
                phi = pair.pitch * place + angles
                at = self.reduced.lines, phi, self.condition, along[place][None], self.taken_out
                each[kind] = laws_at(*at, self.near if self.pitches == 1 else None)
        if not all(law.converged.all() for law in each.values()):
            raise ConvergenceError(f"mesh {self.name}: contact was not found between hubs that stand", [])
        in_turn = [each[kind] for kind in kinds]
        force, tangent = (np.concatenate([getattr(law, key)[0] for law in in_turn]) for key in ("force", "tangent"))
        near = in_turn[0].sections if self.pitches == 1 else None
        return HubLaw(force, tangent, np.ones(len(force), dtype=bool), near)

    def cycle(self) -> MeshCycle:
        """Return the harmonics of the forces over time."""
        law = self.law()
        return _cycle(self, law, law.force + law.tangent[..., 0] * self.slow[:, None], self.pitches)

    def keeping(self) -> StandingMesh:
        """Return the mesh, near which others are found in less time; for one thread alone."""
        if self.pitches > 1:  # sections of many pitches are large
            return self
        return replace(self, reduced=keeping_sections(self.reduced), near=self.law().sections)

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
        return settled_pair(replace(self.moved(compliance @ self.load), taken_out=compliance))

    def moved(self, coordinates: FloatArray, near: FloatArray | None = None) -> StandingMesh:
        """Return the mesh with its coordinates moved by so much, (2,)."""
        displacement = self.displacement + hub_moves(self.reduced.meshed.pair) @ coordinates
        return replace(self, displacement=displacement, settled=None, near=self.near if near is None else near)


@dataclass(frozen=True)
class StandingTrain:
    """Meshes of a train whose hubs stand; K coordinates, two of each mesh.

    Parameters
    ----------
    numbers : tuple of int
        Of the meshes in their gearbox; of a set none.
    load : ndarray, shape (K,)
        Mean forces on their coordinates, N and N mm.
    coordinates : ndarray, shape (K,)
        Where they stand, beside `displacement` of all hubs (6 B,), in axes of the train: by errors or other loads.
    pitches, angles : int
        Of the first gear until all meshes stand as before, and to each.
    harmonics, backwards, settled
        As of `StandingMesh`; the first pinion's angle.
    """

    names: tuple[str, ...]
    numbers: tuple[int, ...]
    train: GearTrain
    displacement: FloatArray
    load: FloatArray
    coordinates: FloatArray
    pitches: int
    angles: int
    harmonics: int
    backwards: bool = False
    settled: HubLaw | None = None

    @property
    def name(self) -> str:
        """All of them."""
        return " and ".join(self.names)

    @cached_property
    def placed(self) -> PlacedTrain:
        """The train over its cycle."""
        pitch = self.train.meshes[0].pair.meshed.pair.pitch
        return self.train.place(pitch * np.arange(self.pitches * self.angles) / self.angles, self.displacement)

    def flank(self, mesh: int, gear: int) -> Modification:
        """Return the flank of pinion (0) or wheel (1) of a mesh by its place here."""
        assembly = self.train.meshes[mesh].assembly
        return assembly.wheel if gear else assembly.pinion

    def with_flank(self, mesh: int, gear: int, flank: Modification) -> StandingTrain:
        """Return the meshes with another flank of pinion or wheel of one, in all where it carries."""
        meshes = list(self.train.meshes)
        for place, end in self.same_flank(mesh, gear):
            before = meshes[place].assembly
            after = replace(before, wheel=flank) if end else replace(before, pinion=flank)
            meshes[place] = replace(meshes[place], assembly=after)
        return replace(self, train=replace(self.train, meshes=tuple(meshes)), settled=None)

    def same_flank(self, mesh: int, gear: int) -> list[tuple[int, int]]:
        """Return meshes and their gears that have a flank: a gear has one in all that load it on the same side."""
        own, flank = self._side(mesh, gear), self.flank(mesh, gear)
        ends = [(place, end) for place in range(len(self.names)) for end in range(len(GEARS))]
        return [one for one in ends if self._side(*one) == own and self.flank(*one) == flank]

    def _side(self, mesh: int, gear: int) -> tuple[int, bool]:
        """Gear, and whether its mesh turns it counter-clockwise."""
        one = self.train.meshes[mesh]
        return one.bodies[gear], bool(one.smooth_rows[gear, ABOUT_AXIS] > 0.0)

    def law(self) -> HubLaw:
        """Return the forces over the cycle; ConvergenceError where some are not found."""
        if self.settled is not None:
            return self.settled
        law = train_law_at(self.placed, self.coordinates)
        if not law.converged.all():
            raise ConvergenceError(f"mesh {self.name}: contact was not found between hubs that stand", [])
        return law

    def cycle(self) -> MeshCycle:
        """Return the harmonics of the forces over time."""
        law = self.law()
        return _cycle(self, law, law.force, 1)

    def keeping(self) -> StandingTrain:
        """Return the meshes themselves: they are placed anew with each flank."""
        return self

    def moved(self, coordinates: FloatArray, near: FloatArray | None = None) -> StandingTrain:
        """Return the meshes with their coordinates moved by so much, (K,)."""
        return replace(self, coordinates=self.coordinates + coordinates, settled=None)


Standing = TypeVar("Standing", StandingMesh, StandingTrain)
# Rotation of a hub about its axis, in axes of a train.
ABOUT_AXIS = 5


def standing_meshes(solved: SolvedLoad, pairs: Mapping[str, ReducedPair], harmonics: int) -> list[StandingMesh]:
    """Return the meshes of a loaded gearbox that share no gears, where their loads are the means.

    Parameters
    ----------
    pairs : mapping of str to ReducedPair
        As of `pmor.machine.coupled.solve_load`.

    Raises
    ------
    ConvergenceError
    """
    alone = [number for number in range(len(solved.meshes)) if number not in solved.gearbox.grouped]
    return [_under_load(solved.meshes[n], n, pairs[solved.meshes[n].meshing.key], harmonics) for n in alone]


def standing_trains(solved: SolvedLoad, harmonics: int) -> list[StandingTrain]:
    """Return the meshes of a loaded gearbox that share gears, as `standing_meshes`."""
    angles = PER_HARMONIC * 2 * (harmonics + FURTHER)
    found = []
    for placed in solved.gearbox.groups:
        standing = train_under_load(solved.groups[placed.key], 0, 1, angles, harmonics)
        names = tuple(mesh.name for mesh in placed.group.meshes)
        found.append(replace(standing, names=names, numbers=placed.group.numbers))
    return found


def _under_load(mesh: SolvedMesh, number: int, reduced: ReducedPair, harmonics: int) -> StandingMesh:
    pair, name = reduced.meshed.pair, mesh.meshing.settings.name
    load = hub_moves(pair).T @ in_axes_of_pair(mesh.meshing.frame) @ mesh.meshing.wrenches.ravel() * mesh.force
    displacement = mesh.displacement.ravel().copy()
    # The pinion's advance, which the compliance of hubs leaves out.
    displacement[5] = 1e-3 * float(np.mean(mesh.sweep.ste_um)) / pair.pinion.base_radius
    condition = condition_of(reduced, mesh.torque)
    return settled_pair(StandingMesh(name, number, reduced, condition, load, displacement, harmonics))


def train_under_load(solution: SetSolution, row: int, pitches: int, angles: int, harmonics: int) -> StandingTrain:
    """Return the meshes of a solved train at the deflection whose mean force is that under its load.

    Parameters
    ----------
    row : int
        Of the load in the solution.
    pitches, angles, harmonics
        As of `StandingTrain`.

    Raises
    ------
    ConvergenceError
    """
    train, plan = solution.train, solution.plan
    names = tuple(mesh.case for mesh in plan.meshes)
    if not solution.left(row).all():
        raise ConvergenceError(f"mesh {' and '.join(names)}: contact was not found at all positions", [])
    force = solution.found.force[row].reshape(solution.cycles, len(solution.placed.phi), -1).mean(axis=0)
    load = np.einsum("an,anc->c", force, train_rows(solution.placed)) / len(force)
    each = load[:: len(load) // len(names)]
    for number in np.flatnonzero(abs(each) <= SETTLED * abs(each).max()).tolist():
        text = f"mesh {names[number]}, {number + 1} of {len(names)}: carries nothing over the whole cycle, as of a gear"
        raise ConvergenceError(f"{text} out of place: raise the torque, or lower what puts it there", [])
    moved = train_coordinates(train).T @ solution.hub_displacement[row].reshape(len(solution.phi_rad), -1).mean(axis=0)
    return _settled(StandingTrain(names, (), train, plan.displacement, load, moved, pitches, angles, harmonics))


def settled_pair(standing: StandingMesh) -> StandingMesh:
    """Return a mesh at the deflection under which its load is the mean, along the path that goes with it.

    Raises
    ------
    ConvergenceError
    """
    if standing.pitches == 1:
        kept = keeping_sections(standing.reduced)
        return replace(_settled(replace(standing, reduced=kept)), reduced=standing.reduced)
    none = np.zeros(standing.pitches, dtype=complex)
    found = _following(replace(standing, harmonics=0, path=none, settled=None))
    return _settled(replace(standing, displacement=found.displacement, path=found.path, settled=None), FOLLOWED)


def _following(standing: StandingMesh) -> StandingMesh:
    """A mesh along a path on which its force slower than the mesh frequency is nearly the load; ConvergenceError."""
    assert standing.path is not None
    for _ in range(MOST_STEPS):
        law = standing.law()
        more, tangent = law.force.mean(axis=0) - standing.load, law.tangent.mean(axis=0)
        slow = np.fft.rfft(law.force[:, 0])[: standing.pitches] / len(law.force)
        slow[0] = 0.0
        if max(2.0 * np.linalg.norm(slow), abs(more[0])) <= FOLLOWED * standing.load[0]:
            return standing
        path = standing.path + slow / tangent[0, 0]
        standing = replace(standing.moved(np.linalg.solve(tangent, more)), path=path)
    raise ConvergenceError(
        f"mesh {standing.name}: no path of its hubs found on which forces slower than the mesh frequency are within "
        f"{100.0 * FOLLOWED:g} % of the load", [],
    )  # fmt: skip


def _settled(standing: Standing, within: float = SETTLED) -> Standing:
    """Meshes at the deflection under which their load is the mean, within a share of it."""
    load = standing.load
    forces = slice(None, None, len(load) // len(standing.names))
    for _ in range(MOST_STEPS):
        law = standing.law()
        more = law.force.mean(axis=0) - load
        if (abs(more[forces]) <= within * abs(load[forces]).max()).all():
            return replace(standing, settled=law)
        standing = standing.moved(np.linalg.solve(law.tangent.mean(axis=0), more), law.sections)
    raise ConvergenceError(f"mesh {standing.name}: no deflection found under which its mean force is the load", [])


def _cycle(standing: StandingMesh | StandingTrain, law: HubLaw, force: FloatArray, pitches: int) -> MeshCycle:
    """Harmonics over time, of meshes that pass one way or the other."""
    found = mesh_cycle(force, law.tangent, standing.load, standing.harmonics, pitches)
    return found.conj if standing.backwards else found
