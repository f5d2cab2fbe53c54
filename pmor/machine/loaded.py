"""A gearbox under one of its load cases: the system of shafts, bearings and meshes."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from pmor.body.beam import NODE, Beam
from pmor.body.bearing_faults import InnerGeometry
from pmor.body.play import BearingWithPlay
from pmor.case import Case
from pmor.case.coast import other_flank
from pmor.core.arrays import FloatArray
from pmor.gear.pair import GearPair
from pmor.machine.groups import PlacedGroup, image_of
from pmor.machine.load_settings import LoadCase
from pmor.machine.mesh_force import MeshFrame, hub_wrenches, mesh_frame
from pmor.machine.model import GearboxModel, other_key, pinion_senses, placed_groups, seat_on, set_torques
from pmor.machine.set_frame import MEMBERS, SetFrame, set_frame
from pmor.machine.settings import HOUSING, Bearing, Mesh, PlanetarySet
from pmor.machine.system import Equilibrium, Seat, System, solve_system
from pmor.machine.turning import Turning, standing, turning_loads
from pmor.machine.weights import gear_weight, hanging_weights, set_weights, shaft_weight
from pmor.pair.model import gear_pair
from pmor.sets.loader import SetFile

DIRECTIONS = ("along x", "along y", "along z", "about x", "about y", "about z")
# Displacement of the inner ring: along x, y, z, about y, about z.
BEARING_ROWS = (0, 1, 2, 4, 5)
AXIAL, RADIAL, TORSION, TILT = (0,), (1, 2), (3,), (4, 5)
ABOUT_AXIS = 3


class Supported(NamedTuple):
    """A bearing in the system.

    Attributes
    ----------
    rows : ndarray, shape (6, n)
        Displacement of the shaft in the bearing against that to which it goes.
    rigid : tuple of int
        Directions held without any play, in the order of `rows`.
    springs : ndarray, shape (6,)
        Stiffness, N/mm and N mm/rad.
    """

    settings: Bearing
    rows: FloatArray
    rigid: tuple[int, ...]
    springs: FloatArray
    law: InnerGeometry | BearingWithPlay | None


class SetMeshing(NamedTuple):
    """A planetary set in the system.

    Attributes
    ----------
    hubs : (int or None, int or None, int or None)
        First displacements of the nodes on which sun, carrier and ring stand; None of the housing.
    frame : SetFrame
    wrenches : ndarray, shape (3, 6)
        On these hubs, by a unit torque on the sun, N mm.
    hanging : ndarray, shape (B, 3)
        Weights of the bodies that no shaft carries, planets on their pins above all, in axes of the machine, N.
    """

    settings: PlanetarySet
    file: SetFile
    hubs: tuple[int | None, ...]
    frame: SetFrame
    wrenches: FloatArray
    hanging: FloatArray

    @property
    def turns(self) -> bool:
        """Whether the carrier turns."""
        return self.hubs[MEMBERS.index("carrier")] is not None

    @property
    def hanging_in_plan(self) -> FloatArray:
        """Weights of these bodies as wrenches on their hubs, in axes of the plan at angle 0, (6 B,)."""
        found = np.zeros((len(self.hanging), NODE))
        found[:, :3] = self.hanging @ self.frame.turn[:3, :3]
        return found.ravel()

    @property
    def housing(self) -> int:
        """Number of the gear that stands still with the housing, of a carrier that turns."""
        return next(n for n, body in enumerate(self.file.plan.bodies) if body.member == self.file.held)

    @property
    def scale(self) -> FloatArray:
        """What makes wrenches by a unit torque pure numbers, (6,)."""
        planet = self.file.plan.bodies[self.file.plan.planets[0]]
        return np.repeat([math.hypot(planet.x, planet.y), 1.0], 3)


class Meshing(NamedTuple):
    """A gear mesh in the system.

    Attributes
    ----------
    hubs : (int, int)
        First displacements of the nodes in the middles of pinion and wheel.
    wrenches : ndarray, shape (2, 6)
        On both hubs, by a unit force in the transverse plane.
    other : bool
        Whether the flanks carry that the case and the first load have unloaded: `pair` is the image then.
    coast : bool
        Whether these are the coast flanks of the drawing.
    """

    settings: Mesh
    pair: GearPair
    frame: MeshFrame
    hubs: tuple[int, int]
    wrenches: FloatArray
    other: bool = False
    coast: bool = False

    @property
    def key(self) -> str:
        """Name of its reduced pair."""
        return other_key(self.settings.name) if self.other else self.settings.name

    def of_case(self, case: Case) -> Case:
        """Return the case of the flanks that carry."""
        return other_flank(case) if self.other else case


@dataclass(frozen=True)
class LoadedGearbox:
    """A gearbox under one load case.

    Parameters
    ----------
    beams : mapping of str to Beam
    first : mapping of str to int
        First displacement of each shaft.
    balances : tuple of ndarray, shape (n,)
        Rows of the rotations that are held.
    load : ndarray, shape (n,)
        Of torques, forces and moments that stand in the housing.
    weight : ndarray, shape (n,)
    housing : ndarray, shape (6 h, 6 h)
        Stiffness of the seats, whose displacements are the last ones; empty of a rigid housing.
    groups : tuple of PlacedGroup
        Of the meshes that share gears.
    turning : tuple of Turning
        Loads that turn with shafts, which have no mean.
    """

    beams: Mapping[str, Beam]
    first: Mapping[str, int]
    bearings: tuple[Supported, ...]
    meshes: tuple[Meshing, ...]
    sets: tuple[SetMeshing, ...]
    balances: tuple[FloatArray, ...]
    load: FloatArray
    weight: FloatArray
    housing: FloatArray
    groups: tuple[PlacedGroup, ...] = ()
    turning: tuple[Turning, ...] = ()

    @property
    def over_turns(self) -> bool:
        """Whether sets are solved over turns of their carrier alone: on rolling bearings, under loads that turn."""
        return bool(self.system.seats or self.turning)

    @property
    def grouped(self) -> set[int]:
        """Numbers of the meshes that share gears."""
        return {number for placed in self.groups for number in placed.group.numbers}

    @cached_property
    def structure(self) -> FloatArray:
        """Stiffness of shafts and housing, shape (n, n)."""
        size = len(self.load)
        stiffness, seat = np.zeros((size, size)), size - len(self.housing)
        for name, beam in self.beams.items():
            rows = slice(self.first[name], self.first[name] + NODE * len(beam.stations))
            stiffness[rows, rows] = beam.stiffness()
        stiffness[seat:, seat:] = self.housing
        return stiffness

    @cached_property
    def system(self) -> System:
        """The system of equations."""
        size = len(self.load)
        stiffness, constraints, seats = self.structure.copy(), list[FloatArray](), list[Seat]()
        names, rotations = [], np.tile(np.arange(NODE) >= ABOUT_AXIS, size // NODE)
        for name, beam in self.beams.items():
            names += [f"shaft {name}, at {place:g} mm, {way}" for place in beam.stations for way in DIRECTIONS]
        names += [f"seat {n} of the housing, {way}" for n in range(len(self.housing) // NODE) for way in DIRECTIONS]
        for bearing in self.bearings:
            constraints += [bearing.rows[i] for i in bearing.rigid]
            stiffness += np.einsum("i,ij,ik->jk", bearing.springs, bearing.rows, bearing.rows)
            if bearing.law is not None:
                seats.append(Seat(bearing.rows[list(BEARING_ROWS)], bearing.law))
        constraints += self.balances
        constraints += [row_of(one.hubs, one.wrenches, size) for one in self.sets]
        constraints += [row_of(mesh.hubs, mesh.wrenches, size) for mesh in self.meshes]
        return System(stiffness, seats, np.array(constraints), names, rotations)

    @cached_property
    def reactions(self) -> dict[str, slice]:
        """Where the reactions of an equilibrium are: of rigid bearings, of held rotations, of sets, of meshes."""
        parts = {
            "bearings": sum(len(bearing.rigid) for bearing in self.bearings), "balances": len(self.balances),
            "sets": len(self.sets), "meshes": len(self.meshes),
        }  # fmt: skip
        ends = np.cumsum([0, *parts.values()]).tolist()
        return {name: slice(*both) for name, both in zip(parts, pairwise(ends), strict=True)}

    def solve(self) -> Equilibrium:
        """Solve the equilibrium."""
        return solve_system(self.system, self.load + self.weight)


def loaded(model: GearboxModel, load: LoadCase) -> LoadedGearbox:
    """Return a gearbox under one of its load cases."""
    beams, first, size = model.beams(), dict[str, int](), 0
    for name, beam in beams.items():
        first[name], size = size, size + NODE * len(beam.stations)
    housing = np.zeros((0, 0)) if model.housing is None else model.housing
    seat, size = size, size + len(housing)

    def node(name: str, place: float) -> int:
        return first[name] + NODE * beams[name].node_at(place)

    force, balances = np.zeros(size), list[FloatArray]()
    for torque in load.torques:
        at = node(torque.shaft, torque.at_mm) + ABOUT_AXIS
        if torque.torque_Nm == "balance":
            balances.append(_unit(at, size))
        else:
            force[at] += 1e3 * torque.torque_Nm
    in_housing = standing(load)
    for one in in_housing.forces:
        force[node(one.shaft, one.at_mm) + np.arange(3)] += one.x_N, one.y_N, one.z_N
    for moment in in_housing.moments:
        force[node(moment.shaft, moment.at_mm) + np.array(TILT)] += 1e3 * moment.y_Nm, 1e3 * moment.z_Nm
    shafts = model.shafts
    bearings = []
    for bearing in model.sections.bearings:
        rows = np.zeros((NODE, size))
        rows[:, node(bearing.shaft, bearing.at_mm) + np.arange(NODE)] = np.eye(NODE)
        if bearing.to == HOUSING and len(housing):
            rows[:, seat + np.arange(NODE)] -= np.eye(NODE)
            seat += NODE
        elif bearing.to != HOUSING:
            place, reach = seat_on(shafts[bearing.to], bearing.at_mm + shafts[bearing.shaft].start_mm)
            rows[:, node(bearing.to, place) + np.arange(NODE)] -= _arm(reach)
        bearings.append(_supported(bearing, rows))
    torques = set_torques(model, load)
    sets = tuple(
        _set_meshing(one, model, node, -1.0 if torques[one.name] < 0.0 else 1.0) for one in model.sections.sets
    )
    senses, groups = pinion_senses(model, load), list[PlacedGroup]()
    frames = dict[str, tuple[GearPair, MeshFrame]]()
    for placed in placed_groups(model, load):
        groups.append(placed._replace(hubs=tuple(node(gear.shaft, gear.at_mm) for gear in placed.group.gears)))
        for number, (mesh, stands) in enumerate(zip(placed.group.meshes, placed.placed, strict=True)):
            pair = model.pairs[mesh.name]
            frames[mesh.name] = image_of(pair) if stands.image else pair, placed.frame(number)
    meshes = []
    for mesh in model.sections.meshes:
        pinion, wheel = (node(gear.shaft, gear.at_mm) for gear in (mesh.pinion, mesh.wheel))
        other = mesh.name in model.turned and senses[mesh.name] != model.first_senses[mesh.name]
        coast = other != (mesh.name in model.cases and model.cases[mesh.name].flank == "coast")
        pair, frame = frames.get(mesh.name) or _pair_and_frame(mesh, model, senses[mesh.name], other, coast)
        meshes.append(Meshing(mesh, pair, frame, (pinion, wheel), hub_wrenches(pair, frame), other, coast))
    weight = _weights(model, beams, first, meshes, sets, size)
    return LoadedGearbox(
        beams, first, tuple(bearings), tuple(meshes), sets, tuple(balances), force, weight, housing, tuple(groups),
        turning_loads(model, load, node, size),
    )  # fmt: skip


def _weights(
    model: GearboxModel, beams: Mapping[str, Beam], first: Mapping[str, int], meshes: Sequence[Meshing],
    sets: Sequence[SetMeshing], size: int,
) -> FloatArray:  # fmt: skip
    """Weights of shafts and gears on all displacements, (n,)."""
    gravity, found = model.sections.gravity.vector, np.zeros(size)
    if not any(gravity):
        return found
    for name, shaft in model.shafts.items():
        own = shaft_weight(shaft, beams[name], gravity)
        found[first[name] : first[name] + len(own)] += own
    weighed = set[int]()
    for mesh in meshes:
        for hub, mass, face in zip(mesh.hubs, model.masses_kg[mesh.settings.name], mesh.pair.faces, strict=True):
            if hub not in weighed:  # a gear in several meshes is one
                found[hub : hub + NODE] += gear_weight(mass, face, mesh.frame, gravity)
            weighed.add(hub)
    for body in model.sections.masses:
        node = first[body.shaft] + NODE * beams[body.shaft].node_at(body.at_mm)
        found[node : node + 3] += body.mass_kg * np.asarray(gravity)
    for one in sets:
        sun = one.settings.members.get("sun")
        filled = 0.0 if sun is None else 0.5 * model.shafts[sun.shaft].section_at(sun.at_mm).outer_mm
        found += row_of(one.hubs, set_weights(one.file, one.frame, filled, gravity), size)
    return found


def _arm(reach: float) -> FloatArray:
    """What a rigid arm along the axis makes of the displacement of a node."""
    moved = np.eye(NODE)
    moved[1, 5], moved[2, 4] = reach, -reach
    return moved


def _pair_and_frame(
    mesh: Mesh, model: GearboxModel, sense: float, other: bool, coast: bool
) -> tuple[GearPair, MeshFrame]:
    """Pair whose flanks carry, and its frame: z of the drawing stays where the first load has it if that matters."""
    pinion_at, wheel_at = (np.array(model.shafts[gear.shaft].at_mm) for gear in (mesh.pinion, mesh.wheel))
    pair = model.pairs[mesh.name]
    frame = mesh_frame(pinion_at, wheel_at, -sense if coast else sense, pair.wheel.teeth < 0)
    if coast:  # the image of the drawing, x to -x
        frame = MeshFrame(frame.axes * np.array([-1.0, 1.0, 1.0]))
    return gear_pair(other_flank(model.cases[mesh.name])) if other else pair, frame


def _set_meshing(one: PlanetarySet, model: GearboxModel, node: Callable[[str, float], int], sense: float) -> SetMeshing:
    file, members = model.sets[one.name], one.members
    x = {member: model.shafts[place.shaft].start_mm + place.at_mm for member, place in members.items()}
    # The middle of the face width is where the sun is, or the first other member on a shaft.
    frame = set_frame(file.plan, sense, [next(iter(x.values())) - x.get(member, 0.0) for member in MEMBERS])
    hubs = tuple(node(members[name].shaft, members[name].at_mm) if name in members else None for name in MEMBERS)
    hanging = hanging_weights(file, members, model.sections.gravity.vector)
    return SetMeshing(one, file, hubs, frame, frame.in_machine(file.plan.wrench @ frame.carried), hanging)


def row_of(hubs: Sequence[int | None], wrenches: FloatArray, size: int) -> FloatArray:
    """Return wrenches on hubs as loads on all displacements, (n,); None of the hubs is the housing."""
    row = np.zeros(size)
    for hub, wrench in zip(hubs, wrenches, strict=True):
        if hub is not None:
            row[hub : hub + NODE] += wrench
    return row


def _supported(bearing: Bearing, rows: FloatArray) -> Supported:
    law = bearing.law
    rigid, springs = list[int](), np.zeros(NODE)
    if law is None or isinstance(law, BearingWithPlay):
        for value, directions in (
            (bearing.axial_N_per_mm, AXIAL), (bearing.radial_N_per_mm, RADIAL), (bearing.tilt_Nmm_per_rad, TILT),
            (bearing.torsion_Nmm_per_rad, TORSION),
        ):  # fmt: skip
            if value == "rigid":
                rigid += directions
            elif not isinstance(value, str) and law is None:
                springs[list(directions)] = value
    return Supported(bearing, rows, tuple(rigid), springs, law)


def _unit(place: int, size: int) -> FloatArray:
    row = np.zeros(size)
    row[place] = 1.0
    return row
