"""Meshes that share gears: an idler, a pinion that drives two wheels, two pinions on one wheel.

Flanks of one gear feel each other through its body: such meshes are solved at once as a train (`pmor.line.several`) on
the compliance of all of its hubs. The train has z along the torque of its first pinion and y of the machine. A mesh
whose pinion is loaded the other way is the image of its pair there, x to -x; that pair seen from its other end.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from pmor.case import Case
from pmor.case.models import coarser
from pmor.core.arrays import FloatArray
from pmor.gear.pair import GearPair
from pmor.line.hubs import HUB
from pmor.line.kernels.places import Lines
from pmor.line.several import GearTrain
from pmor.line.train import to_train
from pmor.machine.mesh_force import MeshFrame
from pmor.machine.settings import GearPlace, Mesh, Shaft
from pmor.pair.conditions import assembly_of
from pmor.results.loads import SweepStates
from pmor.results.sweep import SteSweep
from pmor.sets.kinematics import Meeting, Placement, placements
from pmor.sets.model import SetBody, SetMesh, build_train
from pmor.sets.plan import SetPlan
from pmor.sets.solution import SetSolution, solve_set
from pmor.sets.supports import ROTATION
from pmor.storage.gear_store import KeptGear, not_kept
from pmor_online.line_sweep import contact_loads, levers_of, line_states_of, load_shares
from pmor_online.mesh_error import error_percent

# Places along an axis that are one, mm: drawings are rounded.
ROUNDED_MM = 1e-3


@dataclass(frozen=True)
class GearGroup:
    """Meshes that share gears.

    Parameters
    ----------
    meshes : tuple of Mesh
    numbers : tuple of int
        Of these meshes in the gearbox.
    gears : tuple of GearPlace
    ends : tuple of (int, int)
        Gears that are pinion and wheel of each mesh.
    """

    meshes: tuple[Mesh, ...]
    numbers: tuple[int, ...]
    gears: tuple[GearPlace, ...]
    ends: tuple[tuple[int, int], ...]

    @property
    def closed(self) -> bool:
        """Whether there are several ways from one gear to another, or two gears on one shaft."""
        shafts = {gear.shaft for gear in self.gears}
        return len(self.meshes) >= len(self.gears) or len(shafts) < len(self.gears)


class GroupKey(NamedTuple):
    """What the train of a group depends on: its first mesh, and in which sense pinions are loaded about x."""

    name: str
    senses: tuple[float, ...]
    coarse: bool = False

    @property
    def on_half(self) -> GroupKey:
        """That of the train on half as many elements, for the error bar of the mesh."""
        return self._replace(coarse=True)


class PlacedGroup(NamedTuple):
    """A group under loads of some senses.

    Attributes
    ----------
    plan : SetPlan
        In axes of the train, its hubs held, under no load yet.
    placed : tuple of Placement
        Of its meshes.
    turn : ndarray, shape (6, 6)
        Takes wrenches on a hub from axes of the train into those of the machine.
    hubs : tuple of int
        First displacements of the nodes in the middles of its gears; empty without a system.
    cases : tuple of Case
        Of its meshes.
    """

    group: GearGroup
    key: GroupKey
    plan: SetPlan
    placed: tuple[Placement, ...]
    turn: FloatArray
    hubs: tuple[int, ...] = ()
    cases: tuple[Case, ...] = ()

    def frame(self, mesh: int) -> MeshFrame:
        """Return the directions of the axes of a pair in the machine, by the number of its mesh here."""
        place = self.placed[mesh]
        return MeshFrame((self.turn @ to_train(place.direction, place.image))[:3, :3])


def same_gear(one: GearPlace, other: GearPlace) -> bool:
    """Return whether two ends of meshes are one gear."""
    return one.shaft == other.shaft and abs(one.at_mm - other.at_mm) <= ROUNDED_MM


def gear_groups(meshes: Sequence[Mesh]) -> tuple[GearGroup, ...]:
    """Return the groups of meshes that share gears; meshes whose gears have no other one are in none."""
    together: list[list[int]] = []
    for number, mesh in enumerate(meshes):
        own = [number]
        for known in list(together):
            ends = [end for n in known for end in (meshes[n].pinion, meshes[n].wheel)]
            if any(same_gear(end, place) for end in ends for place in (mesh.pinion, mesh.wheel)):
                together.remove(known)
                own = [*known, *own]
        together.append(sorted(own))
    found = []
    for numbers in sorted(numbers for numbers in together if len(numbers) > 1):
        gears, own_ends = list[GearPlace](), list[tuple[int, int]]()
        for mesh in (meshes[number] for number in numbers):
            for place in (mesh.pinion, mesh.wheel):
                if not any(same_gear(place, gear) for gear in gears):
                    gears.append(place)
            pinion, wheel = (
                next(n for n, gear in enumerate(gears) if same_gear(place, gear)) for place in (mesh.pinion, mesh.wheel)
            )
            own_ends.append((pinion, wheel))
        found.append(GearGroup(tuple(meshes[n] for n in numbers), tuple(numbers), tuple(gears), tuple(own_ends)))
    return tuple(found)


def alike_from_both_ends(case: Case) -> bool:
    """Return whether a pair is the same seen from its other end."""
    assembly, pair = assembly_of(case), case.pair
    flanks, gears = assembly.pinion.mirrored and assembly.wheel.mirrored, (pair.pinion, pair.wheel)
    blanks = [blank for gear in gears if (blank := gear.light_blank(pair.face_width_mm)) is not None]
    even = all(blank.web_even and blank.held_offset_mm == 0.0 for blank in blanks) and not any(pair.holes)
    brought = any(gear.body is not None or gear.rim_gives for gear in gears)
    centred = all(gear.face_offset_mm == 0.0 for gear in gears)
    return flanks and even and not brought and not assembly.misalignment.tilted and centred


def seen_from_other_end(case: Case) -> Case:
    """Return a case whose flanks are the same from both ends as its image, x to -x, in axes that are not turned."""
    return replace(case, pair=replace(case.pair, helix_angle_deg=-case.pair.helix_angle_deg or 0.0))


def image_of(pair: GearPair) -> GearPair:
    """Return the geometry of that image."""
    pinion, wheel = (replace(tooth, helix_angle=-tooth.helix_angle or 0.0) for tooth in (pair.pinion, pair.wheel))
    return replace(pair, pinion=pinion, wheel=wheel)


def placed_group(
    group: GearGroup, pairs: Mapping[str, GearPair], shafts: Mapping[str, Shaft], senses: Mapping[str, float]
) -> PlacedGroup:
    """Place a group under loads of some senses.

    Parameters
    ----------
    senses : mapping of str to float
        Signs of the torques about x on the pinions, by mesh.
    """
    along = senses[group.meshes[0].name]
    y, z = np.array([0.0, 1.0, 0.0]), np.array([along, 0.0, 0.0])
    turn = np.kron(np.eye(2), np.column_stack([np.cross(y, z), y, z]))
    bodies = []
    for gear in group.gears:
        x_mm, y_mm, _ = turn[:3, :3].T @ np.array([0.0, *shafts[gear.shaft].at_mm])
        name = f'gear at {gear.at_mm:g} mm of shaft "{gear.shaft}"'
        bodies.append(SetBody(name, name, float(x_mm), float(y_mm)))
    own = [pairs[mesh.name] for mesh in group.meshes]
    sides = [round(along * senses[mesh.name]) for mesh in group.meshes]
    meetings = [Meeting(pair, *ends, side) for pair, ends, side in zip(own, group.ends, sides, strict=True)]
    placed = placements([body.centre for body in bodies], meetings)
    turning = [body for body in range(len(bodies)) if body != group.ends[0][1]]
    free = np.zeros((len(turning), HUB * len(bodies)))
    free[np.arange(len(turning)), HUB * np.array(turning) + ROTATION] = 1.0
    size = HUB * len(bodies)
    plan = SetPlan(
        bodies=tuple(bodies),
        meshes=tuple(SetMesh(mesh.name, *ends) for mesh, ends in zip(group.meshes, group.ends, strict=True)),
        planets=(), free=free, compliance=np.zeros((size, size)), displacement=np.zeros(size),
        eccentricity=np.zeros((len(bodies), 2)), driver=turning.index(group.ends[0][0]), load=np.zeros(len(turning)),
        torque_Nm=1.0, nominal_Nm=1.0, clockwise=False, rates=(Fraction(1),) * len(meetings),
    )  # fmt: skip
    key = GroupKey(group.meshes[0].name, tuple(senses[mesh.name] for mesh in group.meshes))
    return PlacedGroup(group, key, plan, placed, turn)


def group_trains(
    groups: Iterable[PlacedGroup], kept: KeptGear = not_kept, executor: Executor | None = None
) -> dict[str | GroupKey, GearTrain]:  # fmt: skip
    """Return the trains of groups by their keys, each once: the same group is under several loads."""
    found = dict[str | GroupKey, GearTrain]()
    for placed in groups:
        if placed.key not in found:
            found[placed.key] = group_train(placed, placed.cases, kept, executor)
            halves = [half for case in placed.cases if (half := coarser(case)) is not None]
            if len(halves) == len(placed.cases):
                found[placed.key.on_half] = group_train(placed, halves, kept, executor)
    return found


def group_train(
    placed: PlacedGroup, cases: Sequence[Case], kept: KeptGear = not_kept, executor: Executor | None = None
) -> GearTrain:
    """Solve the finite elements of the gears of a group, each once, and put its train together, its hubs held."""
    own = {
        mesh.name: seen_from_other_end(case) if place.image else case
        for mesh, case, place in zip(placed.group.meshes, cases, placed.placed, strict=True)
    }
    plan = placed.plan
    return build_train(own, plan.bodies, plan.meshes, plan.free, plan.compliance, kept, executor, placed.placed)


def group_under(
    placed: PlacedGroup, train: GearTrain, forces: FloatArray, angles: int, displacement: FloatArray | None = None
) -> SetSolution:
    """Solve a group over its mesh cycles under the torques that make mean forces of its meshes.

    Parameters
    ----------
    train : GearTrain
        On what its hubs stand on.
    forces : ndarray, shape (M,)
        In the transverse planes, N.
    displacement : ndarray, shape (6 B,), optional
        Of its hubs by other loads, in axes of the train.
    """
    torque = float(forces[0]) * train.meshes[0].pair.base_radius
    plan = replace(placed.plan, load=-train.closing.T @ forces / torque)
    plan = plan if displacement is None else replace(plan, displacement=displacement)
    repeats = [len(body.support.compliance) for body in train.bodies if body.support is not None]
    for mesh in train.meshes:
        flanks = zip(mesh.bodies, (mesh.assembly.pinion, mesh.assembly.wheel), strict=True)
        repeats += [flank.repeats_after(train.bodies[body].teeth) for body, flank in flanks]
    return solve_set(plan, train, np.array([1e-3 * torque]), angles, math.lcm(1, *repeats))


def _ste_mm(solution: SetSolution, number: int) -> FloatArray:
    """By how much the pinion of a mesh runs ahead along its line of action, (D, A), mm."""
    mesh = solution.train.meshes[number]
    rotations = solution.found.movement @ solution.train.free
    return np.asarray(-rotations[..., [HUB * body + ROTATION for body in mesh.bodies]] @ mesh.smooth_rows[:, ROTATION])


def mesh_sweep(
    placed: PlacedGroup, solution: SetSolution, number: int, coarse: SetSolution | None = None
) -> SteSweep:
    """Return a mesh of a group, by its number, as a sweep of its pair; its transmission error without the others'.

    That counts the rotations of both gears along its line of action.

    Parameters
    ----------
    coarse : SetSolution, optional
        The same on half as many elements, for the error bar of the mesh.
    """
    one = solution.placed.placed[number]
    mesh, meshed = one.mesh, one.mesh.pair.meshed
    ste_mm = _ste_mm(solution, number)
    again = Lines(*(np.concatenate([array] * solution.cycles) for array in one.lines))
    lines = again._replace(first_pair=solution.first_pair(number))
    advance, converged = ste_mm / meshed.pair.pinion.base_radius, solution.converged
    force = np.where(converged[..., None], solution.found.force[..., one.part], 0.0)
    levers, sections = levers_of(lines, np.nan_to_num(advance)), len(meshed.width)
    grid = (*converged.shape, force.shape[2] // sections)
    by_pair = -(force * levers).reshape(*grid, sections).sum(axis=3)
    pairs = lines.first_pair[:, None] + np.arange(grid[2])
    share, pair_index = load_shares(pairs, by_pair)
    of_lines = line_states_of(meshed, lines, force, converged, pairs, levers)
    loads = contact_loads(lines, meshed.sections.z, levers, force, converged)
    torque_Nm = 1e-3 * by_pair.sum(axis=2).mean(axis=1)
    error = None
    if coarse is not None:
        mean_um = np.abs(np.nanmean(1e3 * ste_mm, axis=1))
        error = error_percent(1e3 * ste_mm, 1e3 * _ste_mm(coarse, number), mean_um, placed.cases)
    return SteSweep(
        phi_rad=np.asarray(mesh.start + mesh.rate * solution.phi_rad), torque_Nm=torque_Nm,
        ste_um=1e3 * ste_mm, pair_share=share, pair_index=pair_index, newton_steps=solution.found.steps,
        converged=converged, seconds=0.0, pitch_rad=meshed.pair.pitch,
        states=SweepStates(advance, pairs, np.zeros((*grid, 0)), loads, of_lines),
        overloaded=np.zeros(converged.shape, dtype=bool), mesh_error_percent=error,
    )  # fmt: skip
