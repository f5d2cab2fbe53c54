"""From the settings of a gearbox to its system of shafts, bearings and meshes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from pmor.body.beam import NODE, Beam, CircularSection, ShaftMaterial, refined, stations_of
from pmor.case import Case
from pmor.case.coast import other_flank
from pmor.core.arrays import FloatArray
from pmor.gear.pair import GearPair
from pmor.machine.groups import GearGroup, PlacedGroup, alike_from_both_ends, gear_groups, placed_group
from pmor.machine.load_settings import LoadCase
from pmor.machine.settings import HOUSING, GearboxSections, GearPlace, MemberPlace, Shaft
from pmor.sets.kinematics import member_speeds, torque_ratios
from pmor.sets.loader import SetFile


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
    def of_housing(self) -> dict[str, FloatArray]:
        """Matrices of the housing by the keys of a file."""
        given = {"stiffness": self.housing} if self.housing_matrices is None else vars(self.housing_matrices)
        return {key: matrix for key, matrix in given.items() if matrix is not None}

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


def seat_on(shaft: Shaft, x: float) -> tuple[float, float]:
    """Return the place on a shaft that holds a joint at x, mm, and by how much a coupling reaches from there."""
    place = min(max(x - shaft.start_mm, 0.0), shaft.length)
    return place, x - shaft.start_mm - place


def speeds_rpm(model: GearboxModel, load: LoadCase) -> dict[str, float]:
    """Return the speeds about x of the shafts that turn with that of the first torque; none without a speed."""
    return {} if load.speed_rpm is None else turning_together(model, load.torques[0].shaft, load.speed_rpm)


def turning_together(model: GearboxModel, shaft: str, speed: float) -> dict[str, float]:
    """Return the speeds about x of the shafts that turn with one that has a speed."""
    found = {shaft: speed}
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
