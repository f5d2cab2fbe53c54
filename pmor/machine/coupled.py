"""Shafts, bearings and the line loads of all meshes together.

The forces of a mesh depend on how its hubs stand, and the hubs on the forces. Each mesh is solved exactly on its hubs'
compliance S (`pmor.line.hubs`), which is that of the loaded machine without this mesh; where its mean force lies goes
back into the machine, until it no longer moves. Of one mesh on linear supports the first step is exact. Meshes have
different periods: each is swept under the mean forces of the others.
"""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from pmor.body.beam import NODE
from pmor.core.arrays import FloatArray
from pmor.core.errors import ConvergenceError
from pmor.gear.condition import Condition
from pmor.gear.pair import GearPair
from pmor.line.hubs import HUB, Hubs, mean_wrench
from pmor.line.several import GearTrain
from pmor.machine.carrier_turn import SetPositions
from pmor.machine.coupled_sets import SolvedSet, mean_wrenches, placed_sets, solved_sets
from pmor.machine.fixed_point import Mixing
from pmor.machine.groups import GroupKey, PlacedGroup, group_under, mesh_sweep
from pmor.machine.hub_compliance import compliance_below
from pmor.machine.load_settings import LoadCase
from pmor.machine.loaded import ABOUT_AXIS, LoadedGearbox, Meshing, loaded
from pmor.machine.mesh_force import MeshFrame
from pmor.machine.model import GearboxModel
from pmor.machine.system import Equilibrium
from pmor.pair.conditions import nominal_condition
from pmor.pair.samples import Samples
from pmor.results.sweep import SteSweep
from pmor.sets.solution import SetSolution
from pmor_online.mesh_error import with_mesh_error
from pmor_online.model import ReducedPair, on_hubs, online_angles
from pmor_online.sweep import sweep_reduced_pair

# Angles of a pitch over which the mean force of a mesh is found.
MEAN_ANGLES = 16
MOST_ROUNDS = 40
# Of planetary sets by name, and of meshes that share gears by their key.
Trains = Mapping[str | GroupKey, GearTrain]
NO_TRAINS: Trains = MappingProxyType({})
# Change of the place of a mesh force from round to round, over the centre distance.
SETTLED = 1e-9
# Of forces across that sets bring to their shafts, over those of their torque at the planets' axes: two sets on a shaft
# push each other to and fro, and the contact in them is solved no better than to a tenth of this.
SETS_SETTLED = 1e-6


#: largest root stress of pinion and wheel, MPa; None where it was not found
RootStresses = tuple[float, float] | None


class SolvedMesh(NamedTuple):
    """A mesh on its supports under one load case.

    Attributes
    ----------
    meshing : Meshing
        Its frame, and the mean wrench on both hubs by a unit force.
    force : float
        In the transverse plane, N.
    torque : float
        On the pinion, N mm.
    displacement : ndarray, shape (2, 6)
        Of both hubs without the rotation about their axes, in axes of the pair, mm and rad.
    sweep : SteSweep
        On its supports.
    samples : Samples or None
        Pairs within the tolerances of its case, on the same supports; none before they are drawn (`pmor.machine.run`).
    """

    meshing: Meshing
    force: float
    torque: float
    hubs: Hubs
    displacement: FloatArray
    sweep: SteSweep
    root_stress: RootStresses = None
    samples: Samples | None = None


class RigidMesh(NamedTuple):
    """A mesh on rigid supports.

    Attributes
    ----------
    sweep : SteSweep
        Under all loads.
    row : int
        Of this load.
    """

    sweep: SteSweep
    row: int
    root_stress: RootStresses


@dataclass(frozen=True)
class SolvedLoad:
    """A gearbox in equilibrium under one load case.

    Parameters
    ----------
    rigid : tuple of RigidMesh
        The same meshes on rigid supports, and none before they are compared (`pmor.machine.run`).
    sets : tuple of SolvedSet
    groups : mapping of GroupKey to SetSolution
        Of the meshes that share gears.
    """

    load: LoadCase
    gearbox: LoadedGearbox
    equilibrium: Equilibrium
    meshes: tuple[SolvedMesh, ...]
    rigid: tuple[RigidMesh, ...] = ()
    sets: tuple[SolvedSet, ...] = ()
    groups: Mapping[GroupKey, SetSolution] = field(default_factory=dict)


def solve_load(
    model: GearboxModel, load: LoadCase, pairs: Mapping[str, ReducedPair], angles: int,
    start: LoadedGearbox | None = None, trains: Trains = NO_TRAINS, executor: Executor | None = None,
) -> SolvedLoad:  # fmt: skip
    """Solve a gearbox under one load case, and sweep its meshes.

    Parameters
    ----------
    pairs : mapping of str to ReducedPair
        Of the meshes, by name, by line loads over the whole width.
    angles : int
        Of a pitch, in the sweeps.
    start : LoadedGearbox, optional
        Under this load, with forces of meshes close to where they will be.
    trains : mapping
        Of the planetary sets by name, and of the meshes that share gears by their key, all hubs held. Without them
        these are not solved, and keep the wrenches of `start`.
    executor : concurrent.futures.Executor, optional
        Of threads: shares out angles.

    Raises
    ------
    ConvergenceError
    GeometryError
    """
    gearbox = loaded(model, load) if start is None else start
    mixing, positions = Mixing(), placed_sets(gearbox, trains)
    for _ in range(MOST_ROUNDS):
        equilibrium = gearbox.solve()
        moved, meshes = 0.0, list[Meshing]()
        for number, mesh in enumerate(gearbox.meshes):
            if number in gearbox.grouped:
                meshes.append(mesh)
                continue
            force = mesh_force(gearbox, equilibrium, number)
            hubs = hubs_of(gearbox, equilibrium, mesh, force)
            wrench = _mean_wrench(pairs[mesh.key], mesh, force, hubs)
            moved = max(moved, float(np.abs(wrench - mesh.wrenches).max()) / abs(mesh.pair.centre_distance))
            meshes.append(mesh._replace(wrenches=wrench))
        for placed in gearbox.groups if trains else ():
            solution = _group_solution(gearbox, equilibrium, placed, trains[placed.key], MEAN_ANGLES)
            for place, number in enumerate(placed.group.numbers):
                mesh = gearbox.meshes[number]
                wrench = _mean_in_group(solution, place, mesh, mesh_force(gearbox, equilibrium, number))
                moved = max(moved, float(np.abs(wrench - mesh.wrenches).max()) / abs(mesh.pair.centre_distance))
                meshes[number] = mesh._replace(wrenches=wrench)
        before = np.array([one.wrenches * one.scale for one in gearbox.sets])
        after = before.copy()
        for number, one in enumerate(gearbox.sets if trains else ()):
            after[number] = one.scale * mean_wrenches(
                gearbox, equilibrium, number, trains[one.settings.name], positions.get(number), executor
            )
        settled = float(np.abs(after - before).max(initial=0.0)) < SETS_SETTLED
        if moved < SETTLED and settled:
            return _solved(load, gearbox, equilibrium, pairs, angles, trains, positions, executor)
        gearbox = replace(gearbox, meshes=tuple(meshes))
        if not settled:
            mixed = mixing.next(before.ravel(), after.ravel()).reshape(before.shape)
            moved_on = (one._replace(wrenches=new / one.scale) for one, new in zip(gearbox.sets, mixed, strict=True))
            gearbox = replace(gearbox, sets=tuple(moved_on))
    raise ConvergenceError(f"load {load.name}: mesh forces still move after {MOST_ROUNDS} rounds", [])


def mesh_force(gearbox: LoadedGearbox, equilibrium: Equilibrium, number: int) -> float:
    """Return the force of a mesh in the transverse plane, N."""
    return float(equilibrium.reactions[gearbox.reactions["meshes"]][number])


def hubs_of(gearbox: LoadedGearbox, equilibrium: Equilibrium, mesh: Meshing, force: float) -> Hubs:
    """Return the compliance below both hubs of a mesh (`compliance_below`), and what all other loads do to them."""
    places = np.concatenate([hub + np.arange(NODE) for hub in mesh.hubs])
    turn = in_axes_of_pair(mesh.frame)
    compliance = turn @ compliance_below(gearbox, equilibrium, mesh.hubs) @ turn.T
    moved = turn @ equilibrium.displacement[places]
    moved[[ABOUT_AXIS + 2, HUB + ABOUT_AXIS + 2]] = 0.0
    offset = moved - compliance @ (force * turn @ mesh.wrenches.ravel())
    return Hubs(compliance, np.asarray(offset))


def in_axes_of_pair(frame: MeshFrame) -> FloatArray:
    """Return the rotation that takes wrenches and displacements of both hubs into axes of the pair."""
    return np.asarray(np.kron(np.eye(2), frame.turn.T))


def condition_of(reduced: ReducedPair, torque: float) -> Condition:
    """Return a torque on the pinion (N mm), with the axes and flanks of the case."""
    return replace(nominal_condition(reduced.basis.case), torque=torque)


def swept_angles(reduced: ReducedPair, angles: int) -> FloatArray:
    """Return the angles of a mesh, so many to a pitch, until all of its teeth stand as before, rad."""
    return online_angles(reduced.meshed.pair.pitch, angles, reduced.basis.case.repeats_after)


def _mean_wrench(reduced: ReducedPair, mesh: Meshing, force: float, hubs: Hubs) -> FloatArray:
    """Return the mean wrench on both hubs by a unit force of the mesh, in axes of the machine, shape (2, 6)."""
    condition = condition_of(reduced, force * mesh.pair.pinion.base_radius)
    pair = on_hubs(reduced, hubs).lines
    placed = pair.place(swept_angles(reduced, MEAN_ANGLES), condition.misalignment)
    found = placed.solve(np.array([condition.torque]), False, placed.deviation(condition.assembly))
    if not found.converged.all():
        raise ConvergenceError(f"mesh {mesh.settings.name}: {condition.load_text}: contact was not found", [])
    mean = mean_wrench(placed.hub_rows, found.force[0]) / force
    _close_torques(mean, mesh.pair)
    return np.asarray((in_axes_of_pair(mesh.frame).T @ mean).reshape(2, HUB))


def _close_torques(mean: FloatArray, pair: GearPair) -> None:
    """Give the mean wrench of a unit force, in axes of the pair (12,), the torques that energy asks for.

    Under a constant torque a mesh hands on over its cycle what work it takes: torques are in the ratio of the tooth
    numbers, and the force across the line of centres holds both. Rows of sections, whose levers stand where a tip
    corner turns them, and few angles miss that by some 1e-4.
    """
    mean[[ABOUT_AXIS + 2, HUB + ABOUT_AXIS + 2]] = -pair.pinion.base_radius, -pair.wheel.base_radius
    across = pair.base_distance / pair.centre_distance
    mean[[0, HUB]] = across, -across


def _solved(
    load: LoadCase, gearbox: LoadedGearbox, equilibrium: Equilibrium, pairs: Mapping[str, ReducedPair], angles: int,
    trains: Trains, positions: Mapping[int, SetPositions], executor: Executor | None,
) -> SolvedLoad:  # fmt: skip
    """Sweep all meshes in equilibrium; those that share gears where their trains are there."""
    meshes, groups = dict[int, SolvedMesh](), dict[GroupKey, SetSolution]()
    for number, mesh in enumerate(gearbox.meshes):
        if number not in gearbox.grouped:
            reduced, force = pairs[mesh.key], mesh_force(gearbox, equilibrium, number)
            hubs = hubs_of(gearbox, equilibrium, mesh, force)
            condition = condition_of(reduced, force * mesh.pair.pinion.base_radius)
            phi = swept_angles(reduced, angles)
            on = on_hubs(reduced, hubs)
            sweep = sweep_reduced_pair(on, phi, [condition], executor, recorded=True)
            meshes[number] = _solved_mesh(mesh, force, hubs, with_mesh_error(sweep, on, [condition]))
    for placed in gearbox.groups if trains else ():
        solution = _group_solution(gearbox, equilibrium, placed, trains[placed.key], angles)
        groups[placed.key], coarse = solution, None
        if (half := placed.key.on_half) in trains:
            coarse = _group_solution(gearbox, equilibrium, placed, trains[half], angles)
        for place, number in enumerate(placed.group.numbers):
            mesh, force = gearbox.meshes[number], mesh_force(gearbox, equilibrium, number)
            hubs = hubs_of(gearbox, equilibrium, mesh, force)
            meshes[number] = _solved_mesh(mesh, force, hubs, mesh_sweep(placed, solution, place, coarse))
    sets = solved_sets(gearbox, equilibrium, trains, positions, executor)
    swept = tuple(meshes[number] for number in sorted(meshes))
    return SolvedLoad(load, gearbox, equilibrium, swept, sets=sets, groups=groups)


def _solved_mesh(mesh: Meshing, force: float, hubs: Hubs, sweep: SteSweep) -> SolvedMesh:
    wrench = in_axes_of_pair(mesh.frame) @ mesh.wrenches.ravel()
    displacement = (hubs.offset + hubs.compliance @ wrench * force).reshape(2, HUB)
    return SolvedMesh(mesh, force, force * mesh.pair.pinion.base_radius, hubs, displacement, sweep)


def _group_solution(
    gearbox: LoadedGearbox, equilibrium: Equilibrium, placed: PlacedGroup, train: GearTrain, angles: int
) -> SetSolution:
    """Solve meshes that share gears at once, on the compliance below all of their hubs."""
    turn, group = np.kron(np.eye(len(placed.hubs)), placed.turn), placed.group
    compliance = turn.T @ compliance_below(gearbox, equilibrium, placed.hubs) @ turn
    wrench, moved = np.zeros((len(placed.hubs), HUB)), np.zeros((len(placed.hubs), HUB))
    for number, ends in zip(group.numbers, group.ends, strict=True):
        mesh = gearbox.meshes[number]
        wrench[list(ends)] += mesh_force(gearbox, equilibrium, number) * mesh.wrenches
    for body, hub in enumerate(placed.hubs):
        moved[body] = equilibrium.displacement[hub : hub + HUB]
    offset = (moved @ placed.turn).ravel()
    offset[HUB - 1 :: HUB] = 0.0
    offset -= compliance @ (wrench @ placed.turn).ravel()
    forces = np.array([mesh_force(gearbox, equilibrium, number) for number in group.numbers])
    return group_under(placed, replace(train, compliance=compliance), forces, angles, offset)


def _mean_in_group(solution: SetSolution, place: int, mesh: Meshing, force: float) -> FloatArray:
    """Return the mean wrench on both hubs by a unit force of a mesh of a group, in axes of the machine, (2, 6)."""
    if not solution.converged.all():
        torque = 1e-3 * force * mesh.pair.pinion.base_radius
        raise ConvergenceError(f"mesh {mesh.settings.name}: {torque:.6g} N m: contact was not found", [])
    one = solution.placed.placed[place]
    loads = solution.found.force[0][:, one.part].reshape(solution.cycles, len(one.rows), -1).mean(axis=0)
    mean = mean_wrench(one.rows.reshape(*one.rows.shape[:2], -1), loads) / force
    in_pair = (mean.reshape(2, HUB) @ one.mesh.to_train).ravel()
    _close_torques(in_pair, mesh.pair)
    return np.asarray((in_axes_of_pair(mesh.frame).T @ in_pair).reshape(2, HUB))
