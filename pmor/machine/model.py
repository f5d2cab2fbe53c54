"""From the settings of a gearbox to its system of shafts, bearings and meshes."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from pmor.body.beam import NODE, Beam, CircularSection, ShaftMaterial, refined, stations_of
from pmor.body.rolling_bearing import RollingBearing
from pmor.case import Case
from pmor.case.coast import other_flank
from pmor.core.arrays import FloatArray
from pmor.gear.pair import GearPair
from pmor.machine.groups import GearGroup, PlacedGroup, alike_from_both_ends, gear_groups, image_of, placed_group
from pmor.machine.mesh_force import MeshFrame, hub_wrenches, mesh_frame
from pmor.machine.set_frame import MEMBERS, SetFrame, set_frame
from pmor.machine.settings import (
    HOUSING,
    Bearing,
    GearboxSections,
    GearPlace,
    LoadCase,
    MemberPlace,
    Mesh,
    PlanetarySet,
    Shaft,
)
from pmor.machine.system import Equilibrium, Seat, System, solve_system
from pmor.machine.weights import gear_weight, set_weights, shaft_weight
from pmor.pair.model import gear_pair
from pmor.sets.kinematics import member_speeds, torque_ratios
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
    inner: RollingBearing | None


class SetMeshing(NamedTuple):
    """A planetary set in the system.

    Attributes
    ----------
    hubs : (int or None, int or None, int or None)
        First displacements of the nodes on which sun, carrier and ring stand; None of the housing.
    frame : SetFrame
    wrenches : ndarray, shape (3, 6)
        On these hubs, by a unit torque on the sun, N mm.
    """

    settings: PlanetarySet
    file: SetFile
    hubs: tuple[int | None, ...]
    frame: SetFrame
    wrenches: FloatArray

    @property
    def turns(self) -> bool:
        """Whether the carrier turns."""
        return self.hubs[MEMBERS.index("carrier")] is not None

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


def other_key(name: str) -> str:
    """Return the name of the reduced pair of a mesh whose other flanks carry."""
    return f"{name}, other flanks"


@dataclass(frozen=True)
class HousingMatrices:
    """A housing by its seats, six coordinates each, and further coordinates behind them; shape (H, H).

    Parameters
    ----------
    stiffness : ndarray
        N/mm, and so on.
    mass : ndarray, optional
        t; without it the housing has none.
    surface : ndarray, optional
        Integrals of products of normal displacements over the surface, mm2.
    """

    stiffness: FloatArray
    mass: FloatArray | None = None
    surface: FloatArray | None = None

    def at_seats(self, seats: int) -> FloatArray:
        """Return the stiffness of the seats alone, further coordinates free, (6 h, 6 h)."""
        count = NODE * seats
        own, further = self.stiffness[:count, :count], self.stiffness[count:, :count]
        return np.asarray(own - further.T @ np.linalg.solve(self.stiffness[count:, count:], further))


@dataclass(frozen=True)
class GearboxModel:
    """Shafts as beams, and what joins them.

    Parameters
    ----------
    sections : GearboxSections
        Checked (`pmor.machine.loader`).
    pairs : mapping of str to GearPair
        Of the meshes, by name.
    housing : ndarray, shape (6 h, 6 h), optional
        Stiffness of the seats of the h bearings to the housing; rigid by default.
    housing_matrices : HousingMatrices, optional
        Of the housing in motion, where a file gives them.
    sets : mapping of str to SetFile
        Of the planetary sets, by name.
    masses_kg : mapping of str to (float, float)
        Of pinion and wheel of the meshes, by name: of gears that are heavy.
    cases : mapping of str to Case
        Of the meshes, by name: those that share gears need them.
    longest_mm : mapping of str to float
        Of the elements of a shaft, by name: motion bends them. At rest elements of any length are exact.
    """

    sections: GearboxSections
    pairs: Mapping[str, GearPair]
    housing: FloatArray | None = None
    housing_matrices: HousingMatrices | None = None
    sets: Mapping[str, SetFile] = field(default_factory=dict)
    masses_kg: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    cases: Mapping[str, Case] = field(default_factory=dict)
    longest_mm: Mapping[str, float] = field(default_factory=dict)

    @property
    def shafts(self) -> dict[str, Shaft]:
        """By name."""
        return {shaft.name: shaft for shaft in self.sections.shafts}

    @property
    def groups(self) -> tuple[GearGroup, ...]:
        """Meshes that share gears."""
        return gear_groups(self.sections.meshes)

    @cached_property
    def first_senses(self) -> dict[str, float]:
        """Signs of the torques on the pinions under the first load, by mesh."""
        return pinion_senses(self, self.sections.loads[0])

    @cached_property
    def turned(self) -> set[str]:
        """Names of the meshes that loads turn both ways and that differ then: each load has flanks of its own."""
        senses = [pinion_senses(self, load) for load in self.sections.loads]
        found = set[str]()
        for name, case in self.cases.items():
            both = len({sense[name] for sense in senses}) > 1 and name not in self.shared
            same = case.other_flanks == (case.pinion_modification, case.wheel_modification)
            if both and not (same and alike_from_both_ends(case)):
                found.add(name)
        return found

    def reduced_cases(self, cases: Mapping[str, Case]) -> dict[str, Case]:
        """Return the cases of the reduced pairs by their keys: of meshes that share no gears, and other flanks."""
        alone = {name: case for name, case in cases.items() if name not in self.shared}
        return alone | {other_key(name): other_flank(cases[name]) for name in self.turned}

    @property
    def shared(self) -> set[str]:
        """Names of the meshes in these."""
        return {mesh.name for group in self.groups for mesh in group.meshes}

    @property
    def seats(self) -> int:
        """Bearings to the housing."""
        return sum(bearing.to == HOUSING for bearing in self.sections.bearings)

    def beams(self) -> dict[str, Beam]:
        """Return the shafts' beams, with a node at each place where something acts."""
        found = {}
        for shaft in self.sections.shafts:
            borders = np.cumsum([0.0, *(section.length_mm for section in shaft.sections)])
            stations = stations_of(borders, self._places(shaft.name))
            if shaft.name in self.longest_mm:
                stations = refined(stations, self.longest_mm[shaft.name])
            middles = 0.5 * (stations[1:] + stations[:-1])
            which = np.searchsorted(borders, middles) - 1
            sections = [CircularSection(shaft.sections[i].outer_mm, shaft.sections[i].inner_mm) for i in which]
            material = ShaftMaterial(1e3 * shaft.youngs_modulus_GPa, shaft.poisson_ratio)
            found[shaft.name] = Beam(stations, sections, material)
        return found

    def _places(self, name: str) -> list[float]:
        """All places along a shaft where something acts, mm."""
        said, shafts = self.sections, self.shafts
        gears: list[GearPlace | MemberPlace] = [gear for mesh in said.meshes for gear in (mesh.pinion, mesh.wheel)]
        gears += [member for one in said.sets for member in one.members.values()]
        loads = [place for load in said.loads for place in load.places]
        bearings = [one for one in said.bearings if one.shaft == name]
        masses = [one.at_mm for one in said.masses if one.shaft == name]
        carried = [seat_on(shafts[name], one.at_mm + shafts[one.shaft].start_mm)[0] for one in said.bearings
                   if one.to == name]  # fmt: skip
        found = [gear.at_mm for gear in gears if gear.shaft == name] + [bearing.at_mm for bearing in bearings]
        found += [place for shaft, place in loads if shaft == name]
        return found + carried + masses


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
        Of torques, forces and moments.
    weight : ndarray, shape (n,)
    housing : ndarray, shape (6 h, 6 h)
        Stiffness of the seats, whose displacements are the last ones; empty of a rigid housing.
    groups : tuple of PlacedGroup
        Of the meshes that share gears.
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
            if bearing.inner is not None:
                seats.append(Seat(bearing.rows[list(BEARING_ROWS)], bearing.inner))
        constraints += self.balances
        constraints += [_row(one.hubs, one.wrenches, size) for one in self.sets]
        constraints += [_row(mesh.hubs, mesh.wrenches, size) for mesh in self.meshes]
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
    for one in load.forces:
        force[node(one.shaft, one.at_mm) + np.arange(3)] += one.x_N, one.y_N, one.z_N
    for moment in load.moments:
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
        beams, first, tuple(bearings), tuple(meshes), sets, tuple(balances), force, weight, housing, tuple(groups)
    )


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
        found += _row(one.hubs, set_weights(one.file, one.frame, filled, gravity), size)
    return found


def seat_on(shaft: Shaft, x: float) -> tuple[float, float]:
    """Return the place on a shaft that holds a joint at x, mm, and by how much a coupling reaches from there."""
    place = min(max(x - shaft.start_mm, 0.0), shaft.length)
    return place, x - shaft.start_mm - place


def _arm(reach: float) -> FloatArray:
    """What a rigid arm along the axis makes of the displacement of a node."""
    moved = np.eye(NODE)
    moved[1, 5], moved[2, 4] = reach, -reach
    return moved


def speeds_rpm(model: GearboxModel, load: LoadCase) -> dict[str, float]:
    """Return the speeds about x of the shafts that turn with that of the first torque; none without a speed."""
    if load.speed_rpm is None:
        return {}
    found = {load.torques[0].shaft: load.speed_rpm}
    for _ in model.sections.shafts:
        for bearing in model.sections.bearings:
            if bearing.couples:
                for one, two in ((bearing.shaft, bearing.to), (bearing.to, bearing.shaft)):
                    found |= {two: found[one]} if one in found and two not in found else {}
        for mesh in model.sections.meshes:
            pair, (one, two) = model.pairs[mesh.name], (mesh.pinion.shaft, mesh.wheel.shaft)
            ratio = pair.wheel.base_radius / pair.pinion.base_radius
            if one in found:
                found.setdefault(two, -found[one] / ratio)
            elif two in found:
                found[one] = -found[two] * ratio
        for planetary in model.sections.sets:
            file, members = model.sets[planetary.name], planetary.members
            on = next((member for member, place in members.items() if place.shaft in found), None)
            if on is not None:
                turning = member_speeds(file.teeth, on, file.held, found[members[on].shaft])
                for member, place in members.items():
                    found.setdefault(place.shaft, turning[member])
    return found


def placed_groups(model: GearboxModel, load: LoadCase) -> list[PlacedGroup]:
    """Return the meshes that share gears as they stand under a load."""
    senses = pinion_senses(model, load)
    return [
        placed_group(group, model.pairs, model.shafts, senses)._replace(
            cases=tuple(model.cases[mesh.name] for mesh in group.meshes)
        )
        for group in model.groups
    ]


def pinion_senses(model: GearboxModel, load: LoadCase) -> dict[str, float]:
    """Return the signs of the torques about x that drive the pinions, by mesh."""
    return {name: -1.0 if torque < 0.0 else 1.0 for name, torque in pinion_torques(model, load).items()}


def pinion_torques(model: GearboxModel, load: LoadCase) -> dict[str, float]:
    """Return the torques about x that drive the pinions, by mesh, N m, as `joint_torques`."""
    return {mesh.name: torque for mesh, torque in zip(model.sections.meshes, joint_torques(model, load), strict=False)}


def set_torques(model: GearboxModel, load: LoadCase) -> dict[str, float]:
    """Return the torques about x on the suns, by set, N m, as `joint_torques`."""
    found = joint_torques(model, load)[len(model.sections.meshes) :]
    return {one.name: torque for one, torque in zip(model.sections.sets, found, strict=False)}


def joint_torques(model: GearboxModel, load: LoadCase) -> list[float]:
    """Return the torques about x on the pinions of all meshes, on the suns of all sets, and in all couplings, N m.

    Without losses, from the balance of each shaft; least squares where power is split, of which the signs alone count.
    """
    return _balanced(model, load)[0]


def held_torques(model: GearboxModel, load: LoadCase) -> dict[str, float]:
    """Return the torques about x that hold shafts against the others, by shaft, N m, as `joint_torques`."""
    held = [torque.shaft for torque in load.torques if torque.torque_Nm == "balance"]
    return dict(zip(held, _balanced(model, load)[1], strict=True))


def _balanced(model: GearboxModel, load: LoadCase) -> tuple[list[float], list[float]]:
    """Torques of all joints, and those that hold."""
    said = model.sections
    couplings = [bearing for bearing in said.bearings if bearing.couples]
    joints = len(said.meshes) + len(said.sets) + len(couplings)
    rows = {shaft.name: i for i, shaft in enumerate(said.shafts)}
    held = [torque for torque in load.torques if torque.torque_Nm == "balance"]
    matrix = np.zeros((len(rows), joints + len(held)))
    for column, mesh in enumerate(said.meshes):
        pair = model.pairs[mesh.name]
        # Torque of the pinion's shaft that enters the mesh; both gears turn against each other.
        matrix[rows[mesh.pinion.shaft], column] -= 1.0
        matrix[rows[mesh.wheel.shaft], column] -= pair.wheel.base_radius / pair.pinion.base_radius
    for column, planetary in enumerate(said.sets, start=len(said.meshes)):
        ratios = torque_ratios(model.sets[planetary.name].teeth)
        for member, place in planetary.members.items():
            matrix[rows[place.shaft], column] -= ratios[member] / ratios["sun"]
    for column, coupling in enumerate(couplings, start=joints - len(couplings)):
        matrix[rows[coupling.shaft], column] -= 1.0
        matrix[rows[coupling.to], column] += 1.0
    for column, torque in enumerate(held, start=joints):
        matrix[rows[torque.shaft], column] = 1.0
    given = np.zeros(len(rows))
    for torque in load.torques:
        if torque.torque_Nm != "balance":
            given[rows[torque.shaft]] += torque.torque_Nm
    found = np.linalg.lstsq(matrix, -given, rcond=None)[0]
    return [float(torque) for torque in found[:joints]], [float(torque) for torque in found[joints:]]


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
    return SetMeshing(one, file, hubs, frame, frame.in_machine(file.plan.wrench @ frame.carried))


def _row(hubs: Sequence[int | None], wrenches: FloatArray, size: int) -> FloatArray:
    row = np.zeros(size)
    for hub, wrench in zip(hubs, wrenches, strict=True):
        if hub is not None:
            row[hub : hub + NODE] += wrench
    return row


def _supported(bearing: Bearing, rows: FloatArray) -> Supported:
    inner = bearing.inner
    rigid, springs = list[int](), np.zeros(NODE)
    if inner is None:
        for value, directions in (
            (bearing.axial_N_per_mm, AXIAL), (bearing.radial_N_per_mm, RADIAL), (bearing.tilt_Nmm_per_rad, TILT),
            (bearing.torsion_Nmm_per_rad, TORSION),
        ):  # fmt: skip
            if value == "rigid":
                rigid += directions
            elif not isinstance(value, str):
                springs[list(directions)] = value
    return Supported(bearing, rows, tuple(rigid), springs, inner)


def _unit(place: int, size: int) -> FloatArray:
    row = np.zeros(size)
    row[place] = 1.0
    return row
