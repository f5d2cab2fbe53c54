"""A gearbox under a load as masses on springs: shafts with their inertia, gears as rigid discs, bearings by tangents.

Units are mm, N, s, t. About the loaded state

    M q'' + W G q' + K q = f + B^T w,

W the angular speed of the first torque's shaft, G of all shafts that spin with it, w the forces of the meshes on their
coordinates B q (`pmor.line.hub_law`). Displacements that rigid bearings hold are left out.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import block_diag, null_space

from pmor.body.beam import NODE
from pmor.core.arrays import FloatArray
from pmor.dynamics.whine.discs import KG, disc_matrices
from pmor.dynamics.whine.planets import MovingSet
from pmor.dynamics.whine.ringing import RingingGear
from pmor.gear.inertia import Inertia
from pmor.line.hub_law import COORDINATES, mesh_coordinates
from pmor.machine.coupled import SolvedLoad
from pmor.machine.load_settings import LoadCase
from pmor.machine.loaded import BEARING_ROWS, LoadedGearbox, Meshing, loaded
from pmor.machine.model import GearboxModel, speeds_rpm
from pmor.machine.system import tangent_of
from pmor.machine.weights import M3_OF_MM3, gears_on_shafts

# Elements to a bending wave of the highest frequency: natural frequencies are within 0.1 %.
PER_WAVE = 8
# Displacements of all shafts, at most: what is finer is cut.
MOST_UNKNOWNS = 900
# What would swing faster, rad/s, has no mass, such as a seat of a housing that is given by its stiffness alone.
FASTEST = 1e8
# Of the largest integral over the surface of a housing: a direction in which that does not move.
STILL = 1e-10


@dataclass(frozen=True)
class MovingMachine:
    """A gearbox under a load in small motion; n displacements, r of them free.

    Parameters
    ----------
    gearbox : LoadedGearbox
        Its shafts refined.
    load : LoadCase
    mass, stiffness, gyroscopic : ndarray, shape (n, n)
        t, N/mm, and moments at 1 rad/s of the first torque's shaft; and so on.
    meshes : ndarray, shape (2 M, n)
        Coordinates of all meshes by displacements.
    rates : mapping of str to float
        Speeds of the shafts about x over that of the first torque's.
    sense : float
        Of that speed: 1 or -1.
    surface : ndarray, shape (r, H)
        Root of the integrals over the housing's surface, mm; empty where none are given.
    sets : tuple of MovingSet
        Planetary sets, whose meshes follow the others'.
    ringing : int
        Displacements that are modes of gears, behind the housing.
    spun : ndarray, shape (n', n'), optional
        What the speed adds to the stiffness of these, at 1 rad/s.
    """

    gearbox: LoadedGearbox
    load: LoadCase
    mass: FloatArray
    stiffness: FloatArray
    gyroscopic: FloatArray
    meshes: FloatArray
    rates: Mapping[str, float]
    sense: float
    surface: FloatArray
    sets: tuple[MovingSet, ...] = ()
    ringing: int = 0
    spun: FloatArray | None = None

    @cached_property
    def constraints(self) -> FloatArray:
        """Rows of the displacements that rigid bearings hold, and rigid supports in sets, (c, n)."""
        rows = [bearing.rows[i] for bearing in self.gearbox.bearings for i in bearing.rigid]
        own = self.padded(np.array(rows)) if rows else np.zeros((0, len(self.mass)))
        return np.concatenate([own, *(one.matrices.constraints @ self.padded(one.by) for one in self.sets)])

    @cached_property
    def centrifugal(self) -> FloatArray:
        """Further stiffness at 1 rad/s, that goes with the square of the speed: of planets and blanks, (n, n)."""
        found = np.zeros_like(self.mass)
        if self.spun is not None:
            found[: len(self.spun), : len(self.spun)] += self.spun
        for one in self.sets:
            by = self.padded(one.by)
            found += by.T @ one.matrices.centrifugal @ by
        return found

    def padded(self, rows: FloatArray) -> FloatArray:
        """Return rows by the first displacements, such as those of shafts and seats, as rows by all."""
        return np.pad(rows, ((0, 0), (0, len(self.mass) - rows.shape[1])))

    @property
    def housing(self) -> slice:
        """Coordinates of the housing among the displacements."""
        first = len(self.gearbox.load) - len(self.gearbox.housing)
        return slice(first, len(self.mass) - self.ringing - sum(one.added for one in self.sets))

    @cached_property
    def free(self) -> FloatArray:
        """Displacements that they leave, in coordinates of unit mass, (n, r); those without mass follow the others.

        Each counts by its own mass or stiffness, so that masses may be as far apart as they like.
        """
        own = np.maximum(np.diagonal(self.mass), np.diagonal(self.stiffness) / FASTEST**2)
        scale = 1.0 / np.sqrt(np.where(own > 0.0, own, 1.0))
        rows = self.constraints * scale
        basis = scale[:, None] * _null_space(rows / np.linalg.norm(rows, axis=1, keepdims=True))
        masses, directions = np.linalg.eigh(basis.T @ self.mass @ basis)
        along = basis @ directions
        light = masses * FASTEST**2 < (along * (self.stiffness @ along)).sum(axis=0)
        heavy, massless = along[:, ~light] / np.sqrt(masses[~light]), along[:, light]
        if light.any():
            held = massless.T @ self.stiffness
            heavy = heavy - massless @ np.linalg.solve(held @ massless, held @ heavy)
        return np.asarray(heavy)

    def reactions(self, inner: FloatArray) -> FloatArray:
        """Return the forces of rigid bearings that balance inner forces K q + M q'' - f, (n, ...), on their shafts."""
        return np.asarray(np.linalg.pinv(self.constraints.T) @ inner)

    @property
    def heavy_housing(self) -> bool:
        """Whether the housing has mass: then it moves by itself."""
        return bool(np.any(self.mass[self.housing, self.housing]))

    def row(self, shaft: str, place: float, direction: int) -> FloatArray:
        """Return the row of a displacement of a shaft at a place along it, mm, (n,)."""
        found = np.zeros(len(self.mass))
        found[self.gearbox.first[shaft] + NODE * self.gearbox.beams[shaft].node_at(place) + direction] = 1.0
        return found

    def backwards(self, number: int) -> bool:
        """Whether a mesh passes against its pinion's angle: its pinion turns against the torque on it."""
        mesh = self.gearbox.meshes[number]
        turning = self.sense * self.rates[mesh.settings.pinion.shaft]
        return turning * mesh.frame.along * mesh.frame.hand < 0.0

    def mesh_rate(self, number: int) -> float:
        """Return the pitches that pass through a mesh by a turn of the first torque's shaft."""
        settings, pair = self.gearbox.meshes[number].settings, self.gearbox.meshes[number].pair
        return abs(self.rates[settings.pinion.shaft]) * abs(pair.pinion.teeth)


def moving_machine(
    model: GearboxModel, solved: SolvedLoad, highest_Hz: float, ringing: Sequence[RingingGear] = ()
) -> MovingMachine:
    """Return a gearbox in motion about its solution under a load.

    Parameters
    ----------
    highest_Hz : float
        Up to where shafts bend as they do: elements are short beside the wave.
    ringing : sequence of RingingGear
        Gears whose modes move too.
    """
    fine = replace(model, longest_mm=longest_elements(model, highest_Hz))
    gearbox = loaded(fine, solved.load)
    size = len(gearbox.load)
    rates = speeds_rpm(model, replace(solved.load, speed_rpm=1.0))
    mass, gyroscopic = np.zeros((size, size)), np.zeros((size, size))
    for name, beam in gearbox.beams.items():
        rows = slice(gearbox.first[name], gearbox.first[name] + NODE * len(beam.stations))
        # From t/mm^3 of kg/m^3.
        own = beam.inertia(KG * M3_OF_MM3 * model.shafts[name].density_kg_m3)
        mass[rows, rows] += own.mass
        gyroscopic[rows, rows] += rates.get(name, 0.0) * own.gyroscopic
    for hub, inertia, along, shaft in _bodies(model, gearbox):
        rows = slice(hub, hub + NODE)
        own_mass, own_spin = disc_matrices(inertia, along)
        mass[rows, rows] += own_mass
        gyroscopic[rows, rows] += rates.get(shaft, 0.0) * own_spin
    stiffness = tangent_of(gearbox.system, solved.equilibrium.bearings)
    if model.housing_matrices is not None:
        first = size - len(gearbox.housing)
        stiffness[first:, first:] -= gearbox.housing
        size = first + len(model.housing_matrices.stiffness)
        grown = ((0, size - len(mass)), (0, size - len(mass)))
        mass, gyroscopic, stiffness = (np.pad(matrix, grown) for matrix in (mass, gyroscopic, stiffness))
        stiffness[first:, first:] += model.housing_matrices.stiffness
        if model.housing_matrices.mass is not None:
            mass[first:, first:] += model.housing_matrices.mass
    meshes = np.concatenate([np.zeros((0, size)), *(_coordinates(mesh, size) for mesh in gearbox.meshes)])
    sense = -1.0 if (solved.load.speed_rpm or 1.0) < 0.0 else 1.0
    spun = np.zeros_like(mass)
    for gear in ringing:
        meshing = gearbox.meshes[gear.mesh]
        place = (meshing.settings.pinion, meshing.settings.wheel)[gear.gear]
        rate = rates.get(place.shaft, 0.0) * meshing.frame.along * meshing.frame.hand
        more = gear.matrices(rate)
        first_own, count = len(mass), len(more.stiffness)
        mass, gyroscopic, stiffness, spun = (
            block_diag(*both) for both in
            ((mass, more.mass), (gyroscopic, more.gyroscopic), (stiffness, more.stiffness), (spun, more.spun))
        )  # fmt: skip
        at_hub = slice(meshing.hubs[gear.gear], meshing.hubs[gear.gear] + NODE)
        mass[first_own:, at_hub] = gear.inertia @ meshing.frame.turn.T
        mass[at_hub, first_own:] = mass[first_own:, at_hub].T
        meshes = np.pad(meshes, ((0, 0), (0, count)))
        meshes[COORDINATES * gear.mesh : COORDINATES * (gear.mesh + 1), first_own:] = gear.coordinates
    return MovingMachine(
        gearbox, solved.load, mass, stiffness, gyroscopic, meshes, rates, sense, surface_of(model),
        ringing=len(mass) - size, spun=spun,
    )  # fmt: skip


def surface_of(model: GearboxModel) -> FloatArray:
    """Return R with R^T R the integrals over the surface of the housing, (r, H)."""
    matrices = model.housing_matrices
    if matrices is None or matrices.surface is None:
        return np.zeros((0, 0 if matrices is None else len(matrices.stiffness)))
    values, vectors = np.linalg.eigh(matrices.surface)
    kept = values > STILL * values[-1]
    return np.asarray((vectors[:, kept] * np.sqrt(values[kept])).T)


def longest_elements(model: GearboxModel, highest_Hz: float) -> dict[str, float]:
    """Return the length of the elements of each shaft that a bending wave at a frequency asks for, mm."""
    found, length = {}, sum(shaft.length for shaft in model.sections.shafts)
    for shaft in model.sections.shafts:
        outer = min(section.outer_mm for section in shaft.sections)
        # Wave of an Euler beam, 2 pi (E I / (rho A))^(1/4) / sqrt(omega), solid: I / A = d^2 / 16.
        speed = math.sqrt(1e3 * shaft.youngs_modulus_GPa / (KG * M3_OF_MM3 * shaft.density_kg_m3))
        wave = 2.0 * math.pi * math.sqrt(0.25 * outer * speed / (2.0 * math.pi * highest_Hz))
        found[shaft.name] = max(wave / PER_WAVE, NODE * length / MOST_UNKNOWNS)
    return found


def _bodies(model: GearboxModel, gearbox: LoadedGearbox) -> list[tuple[int, Inertia, float, str]]:
    """First displacement, inertia, place of the middle along x, and shaft of each gear and each further mass."""
    found: dict[int, tuple[int, Inertia, float, str]] = {}
    for mesh in gearbox.meshes:
        name, places = mesh.settings.name, (mesh.settings.pinion, mesh.settings.wheel)
        inertias = gears_on_shafts(model.cases[name], model.pairs[name], mesh.settings, model.shafts)
        for hub, inertia, face, place in zip(mesh.hubs, inertias, mesh.pair.faces, places, strict=True):
            along = mesh.frame.along * 0.5 * sum(face)
            found.setdefault(hub, (hub, inertia, along, place.shaft))
    bodies = [
        (gearbox.first[one.shaft] + NODE * gearbox.beams[one.shaft].node_at(one.at_mm),
         one.inertia, 0.0, one.shaft)
        for one in model.sections.masses
    ]  # fmt: skip
    return [*found.values(), *bodies]


def _coordinates(mesh: Meshing, size: int) -> FloatArray:
    """Coordinates of a mesh by all displacements, (2, n)."""
    rows = np.zeros((COORDINATES, size))
    turned = np.kron(np.eye(2), mesh.frame.turn) @ mesh_coordinates(mesh.pair)
    for hub, own in zip(mesh.hubs, np.split(turned, 2), strict=True):
        rows[:, hub : hub + NODE] += own.T
    return rows


def _null_space(rows: FloatArray) -> FloatArray:
    return null_space(rows) if len(rows) else np.eye(rows.shape[1])


def bearing_rows(machine: MovingMachine, solved: SolvedLoad) -> Sequence[FloatArray]:
    """Return the forces of each bearing on what holds it by displacements, along and about x, y, z, (6, n) each.

    Those of rigid directions are not in it (`MovingMachine.reactions`).
    """
    found, states = [], iter(solved.equilibrium.bearings)
    for bearing in machine.gearbox.bearings:
        rows = bearing.springs[:, None] * bearing.rows
        if bearing.law is not None:
            five = list(BEARING_ROWS)
            rows[five] += next(states).stiffness @ bearing.rows[five]
        found.append(machine.padded(rows))
    return found
