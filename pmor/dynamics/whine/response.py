"""The response of a loaded gearbox over its speed: forces of meshes and bearings by source and harmonic."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from pmor.body.beam import NODE
from pmor.core.arrays import BoolArray, ComplexArray, FloatArray
from pmor.dynamics.whine.coherent import CoherentMeshes
from pmor.dynamics.whine.hill import MeshCycle, equations, mesh_forces, pressed
from pmor.dynamics.whine.modal import Modes, Receptance
from pmor.dynamics.whine.moving import MovingMachine
from pmor.dynamics.whine.orders import Order, Ports
from pmor.dynamics.whine.planets import HUBS
from pmor.dynamics.whine.set_cycle import SetCycle
from pmor.dynamics.whine.set_motion import SetMotion
from pmor.line.hub_law import COORDINATES
from pmor.machine.coupled import SolvedLoad

if TYPE_CHECKING:
    from pmor.dynamics.whine.parting import Parting

RPM = 2.0 * math.pi / 60.0
# Density times speed of sound of air at 20 deg C, N s/mm3.
AIR = 413.3e-9


@dataclass(frozen=True)
class Lines:
    """Motion by the K harmonics of a source at S speeds: complex, half of what is seen from zero to peak.

    Parameters
    ----------
    acting : ndarray, shape (S, K, q)
        Forces of the source on its ports of the machine whose meshes are closed by their mean stiffness.
    mesh_forces : ndarray, shape (S, K, M)
        Of all meshes in the transverse plane beside their means, N; of the sun's and the ring's meshes of a set the
        root mean square of all planets.
    parted : ndarray, shape (S, K, M)
        By how much their flanks part at the pitch point, mm.
    readings : ndarray, shape (S, K, o)
        As `Readings` tells them apart.
    """

    acting: ComplexArray
    mesh_forces: ComplexArray
    parted: ComplexArray
    readings: ComplexArray


@dataclass(frozen=True)
class MeshMotion:
    """Meshes about which motion is small: where their hubs stand, their cycle there, the receptance at rest, (q, q)."""

    standing: CoherentMeshes
    cycle: MeshCycle
    at_rest: FloatArray

    def moving(self, orders: Sequence[Order]) -> ComplexArray:
        """Return the receptance of the closed machine at the harmonics that are solved, 0 first, (S, K + 1, q, q)."""
        own, speeds = self.standing.ports, len(orders[0].speeds)
        still = np.broadcast_to(self.at_rest, (speeds, 1, *self.at_rest.shape))
        return np.concatenate([still, np.stack([order.ports(own, own) for order in orders], axis=1)], axis=1)

    def matrix(self, receptance: ComplexArray) -> ComplexArray:
        """Return the matrix of Hill's equations at harmonics of either sign at a speed."""
        return np.asarray(equations(self.cycle, receptance[None])[0])

    def pressed(self, cycle: MeshCycle, moved: ComplexArray) -> ComplexArray:
        """Return what meshes press with along a motion at harmonics of either sign, (2 K + 1, q)."""
        return pressed(cycle, moved)

    def forces(self, moving: ComplexArray, acting: ComplexArray) -> ComplexArray:
        """Return the forces of the meshes beside their means, (S, K + 1, M), by those on the closed machine."""
        return mesh_forces(self.cycle.mean, moving, acting)[..., ::COORDINATES]


@dataclass(frozen=True)
class Source:
    """Meshes that keep step, a set, an unbalanced shaft, or a torque that swings, and what it moves.

    Parameters
    ----------
    rate : float
        Its first harmonic over the speed of the first torque's shaft.
    ports : slice or ndarray of int
        On which it acts.
    orders : tuple of Order
        K, or of meshes further ones.
    constant : Lines
        By meshes of constant stiffness.
    told : ndarray of bool, shape (S, K)
        Lines below the highest frequency.
    mesh : MeshMotion, optional
    of_set : SetMotion, optional
    sidebands : tuple of (float, int)
        Of a set: harmonic of the sun's mesh, and order of the carrier's turn beside it, of each line.
    why_constant : str
        Why stiffness that varies is not found, so that `lines` are `constant`; else empty.
    """

    name: str
    rate: float
    ports: Ports
    orders: tuple[Order, ...]
    lines: Lines
    constant: Lines
    told: BoolArray
    mesh: MeshMotion | None = None
    of_set: SetMotion | None = None
    sidebands: tuple[tuple[float, int], ...] = ()
    why_constant: str = ""

    @property
    def places(self) -> tuple[tuple[float, int], ...]:
        """Harmonic, and order of a carrier's turn beside it, of each line; of meshes in step of the first."""
        if self.mesh is not None:
            told, first = self.mesh.standing.told, self.mesh.standing.own_passes[0]
            return tuple((n / first if n % first else n // first, 0) for n in told)
        return self.sidebands or ((1, 0),)

    def maker(self, line: int) -> tuple[str, float]:
        """Return the names of what makes a line, and its harmonic there; of the first mesh where these differ."""
        if self.mesh is None:
            return self.name, self.places[line][0]
        standing, harmonic = self.mesh.standing, self.mesh.standing.told[line]
        if standing.unlike:
            return self.name, self.places[line][0]
        makers = [
            (name, harmonic // count) for name, count in zip(standing.names, standing.own_passes, strict=True)
            if harmonic in standing.of_mesh(count)
        ]  # fmt: skip
        first = makers[0][1]
        names = (name if own == first else f"{name} (its harmonic {own})" for name, own in makers)
        return " and ".join(names), first

    def frequency_Hz(self, speeds_rpm: FloatArray) -> FloatArray:
        """Frequencies of the lines, (S, K)."""
        orders = [order.order for order in self.orders[: self.told.shape[1]]]
        return np.asarray(speeds_rpm[:, None] / 60.0 * orders)


@dataclass(frozen=True)
class Totals:
    """Forces over S speeds, rms of all lines: on all bearings (S, bearings), and of all meshes (S, M), N."""

    bearings: FloatArray
    meshes: FloatArray


@dataclass(frozen=True)
class LoadResponse:
    """A gearbox in small motion about a load, over S speeds of the first torque's shaft, rpm.

    Parameters
    ----------
    tangent : ndarray, shape (P, P)
        Mean stiffness of the meshes on their coordinates.
    sources : tuple of Source
        Meshes of two gears first, those together that keep step, then sets.
    cycles : tuple of SetCycle
        Of the sets.
    parting : Parting, optional
        Of flanks that part, where nonlinear motion is asked for.
    """

    solved: SolvedLoad
    machine: MovingMachine
    modes: Modes
    receptance: Receptance
    tangent: FloatArray
    speeds_rpm: FloatArray
    sources: tuple[Source, ...]
    cycles: tuple[SetCycle, ...] = ()
    parting: Parting | None = None

    @property
    def passing(self) -> tuple[Source, ...]:
        """Sources that are meshes, or sets."""
        return self.sources[: sum(source.mesh is not None for source in self.sources) + len(self.cycles)]

    @property
    def of_sets(self) -> tuple[Source, ...]:
        """Sources that are sets."""
        return self.passing[len(self.passing) - len(self.cycles) :]

    def source_of(self, number: int) -> tuple[Source, MeshMotion, int]:
        """Return the source in which a mesh of two gears is, its motion, and the place of the mesh there."""
        for source in self.sources:
            if source.mesh is not None and number in source.mesh.standing.numbers:
                return source, source.mesh, source.mesh.standing.numbers.index(number)
        raise IndexError(number)

    @property
    def lost(self) -> list[str]:
        """What was not found of flanks that part, and why."""
        return [f"load {self.solved.load.name}: {text}" for text in self.parting.lost] if self.parting else []

    @property
    def speed_of(self) -> str:
        """Words for what turns at the speeds."""
        return turning(of_set=not self.machine.gearbox.beams)

    @property
    def mesh_names(self) -> list[str]:
        """Names of all M meshes, those of two gears first."""
        of_sets = [f"{one.name}: {mesh}" for one in self.machine.sets for mesh in ("sun - planet", "planet - ring")]
        return [mesh.meshing.settings.name for mesh in self.solved.meshes] + of_sets

    def bearing_forces(self, readings: ComplexArray) -> ComplexArray:
        """Return forces and moments on what holds each bearing, (..., bearings, 6), from readings (..., o).

        Members of sets that stand in the housing follow the bearings, in axes of their plan.
        """
        bearings = self.machine.gearbox.bearings
        found = readings[..., : NODE * len(bearings)].reshape(*readings.shape[:-1], len(bearings), NODE).copy()
        place = self._first_of_sets + HUBS * len(self.machine.sets)
        for number, bearing in enumerate(bearings):
            for direction in bearing.rigid:
                found[..., number, direction] -= readings[..., place]  # a reaction acts on the shaft
                place += 1
        housed = [self.support_forces(n, readings)[..., one.housed, :] for n, one in enumerate(self.machine.sets)]
        return np.concatenate([found, *housed], axis=-2)

    def support_forces(self, number: int, readings: ComplexArray) -> ComplexArray:
        """Return forces and moments of a set on what holds sun, carrier and ring, (..., 3, 6), from readings (..., o).

        In axes of its plan: of sun and ring on shafts none; of the carrier those of all pins, about its hub.
        """
        sets, first = self.machine.sets, self._first_of_sets
        rigid = readings.shape[-1] - sum(len(one.matrices.constraints) for one in sets[number:])
        one, found = sets[number], readings[..., first + HUBS * number : first + HUBS * (number + 1)]
        held = one.on_supports @ one.matrices.constraints.T
        return (found - readings[..., rigid : rigid + held.shape[1]] @ held.T).reshape(*found.shape[:-1], 3, NODE)

    @property
    def _first_of_sets(self) -> int:
        """First reading of the supports of sets, behind those of bearings and housing."""
        return NODE * len(self.machine.gearbox.bearings) + self.machine.housing.stop - self.machine.housing.start

    def force_lines(self, source: Source, constant: bool = False) -> FloatArray:
        """Return the forces of a source's lines on all bearings, rms of the vector, (S, K, bearings), N."""
        force = self.bearing_forces((source.constant if constant else source.lines).readings)[..., :3]
        return np.asarray(np.sqrt(2.0 * (abs(force) ** 2).sum(axis=-1)) * source.told[..., None])

    @cached_property
    def rms(self) -> Totals:
        """Of all lines of all sources."""
        return self._totals(False)

    @cached_property
    def constant_rms(self) -> Totals:
        """By meshes of constant stiffness."""
        return self._totals(True)

    def _totals(self, constant: bool) -> Totals:
        bearings = [(self.force_lines(one, constant) ** 2).sum(axis=1) for one in self.sources]
        meshes = [
            2.0 * (abs((one.constant if constant else one.lines).mesh_forces) ** 2 * one.told[..., None]).sum(axis=1)
            for one in self.sources
        ]  # fmt: skip
        return Totals(np.asarray(np.sqrt(sum(bearings))), np.asarray(np.sqrt(sum(meshes))))

    def power(self, lines: Lines, source: Source) -> FloatArray:
        """Return the equivalent radiated power of the housing by lines, (S, K), mW: 0 where no surface is given."""
        omega = 2.0 * math.pi * source.frequency_Hz(self.speeds_rpm)
        normal = self.housing(lines.readings) @ self.machine.surface.T
        return np.asarray(2.0 * AIR * omega**2 * (abs(normal) ** 2).sum(axis=-1) * source.told)

    def housing(self, readings: ComplexArray) -> ComplexArray:
        """Return the displacements of the housing's coordinates, (..., H), from readings (..., o), mm."""
        first = NODE * len(self.machine.gearbox.bearings)
        return readings[..., first : first + self.machine.housing.stop - self.machine.housing.start]


def of_mesh(number: int) -> slice:
    """Return the coordinates of a mesh among those of all."""
    return slice(COORDINATES * number, COORDINATES * (number + 1))


def turning(of_set: bool) -> str:
    """Return words for what turns at the speeds, of a set by itself, or of a gearbox."""
    return "the member that the torque is on" if of_set else "the shaft of the first torque"
