"""A set solved over a mesh cycle, and what an engineer reads off it."""

from __future__ import annotations

from collections.abc import Collection
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from pmor.case import Case
from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.core.threads import in_order, one_thread
from pmor.line.hertz import width_limit
from pmor.line.hubs import HUB
from pmor.line.kernels.flexibility import Flexibility
from pmor.line.kernels.places import Lines
from pmor.line.kernels.types import LineResults
from pmor.line.pair import NONE, joined_results
from pmor.line.several import GearTrain, PlacedTrain, Workspaces
from pmor.results.load_distribution import face_load_factor
from pmor.results.loads import LineStates
from pmor.results.quantities import Figures, figures_of_mesh
from pmor.results.solution import MeshView, PartView, place_of
from pmor.results.sweep import Orders, orders
from pmor.sets.plan import SetPlan, hubs_off
from pmor.sets.ring import RingDeflection, ring_deflection
from pmor.sets.root_stress import GearStress, root_stress_of_set
from pmor.sets.shafts import at_place, shaft_of
from pmor_online.line_sweep import levers_of, line_states_of
from pmor_online.mesh_error import error_percent

NO_ROWS: IntArray = np.empty(0, dtype=np.int64)
# Mean force of a mesh, over that of the one that carries most.
NOTHING = 1e-9
# Of the deviations of hubs, that are taken in steps.
LEAST_SHARE = 1e-2


class FaceLoads(NamedTuple):
    """Line loads of a mesh, (D, A, P, S), N/mm, and widths of the sections (S,), mm."""

    load_N_per_mm: FloatArray
    width_mm: FloatArray


@dataclass(frozen=True, eq=False)
class SetSolution:
    """A set over one or several pitches of its first gear, under D torques, at A angles in all.

    Parameters
    ----------
    placed : PlacedTrain
        Over a cycle of all meshes, which is passed once or several times.
    torque_Nm : ndarray, shape (D,)
        On the first gear.
    found : LineResults
        Movements and forces; NaN where not converged.
    pitches : int
        Of the first gear, that are solved.
    mesh_error_percent : ndarray, shape (D,), or None
        Error bar of the mesh over the mean transmission error; None where it was not asked for.
    """

    plan: SetPlan
    placed: PlacedTrain
    torque_Nm: FloatArray
    found: LineResults
    pitches: int
    mesh_error_percent: FloatArray | None = None

    @property
    def train(self) -> GearTrain:
        """Gears and meshes."""
        return self.placed.train

    @property
    def phi_rad(self) -> FloatArray:
        """Angles of the first gear, (A,)."""
        starts = self.pitch_rad * (self.pitches // self.cycles) * np.arange(self.cycles)
        return np.asarray((starts[:, None] + self.placed.phi).ravel())

    @property
    def cycles(self) -> int:
        """How often the positions in which the set is placed are passed."""
        return self.converged.shape[1] // len(self.placed.phi)

    @property
    def angles_per_pitch(self) -> int:
        """Angles to a pitch of the first gear."""
        return self.converged.shape[1] // self.pitches

    @property
    def repeats(self) -> bool:
        """Whether all meshes stand as before after the pitches that are solved."""
        return self.pitches % self.plan.cycle == 0

    @property
    def pitch_rad(self) -> float:
        """Pitch of the first gear."""
        return self.train.meshes[0].pair.meshed.pair.pitch

    @property
    def converged(self) -> BoolArray:
        """(D, A)."""
        return self.found.converged

    def left(self, torque: int) -> BoolArray:
        """Positions that have a solution under a torque by its number, (A,); where none has, all of them, NaN."""
        there = self.converged[torque]
        return there if there.any() else ~there

    @cached_property
    def ste_um(self) -> FloatArray:
        """By how much the first gear runs ahead along its line of action, all held members at rest, (D, A), um."""
        radius = self.train.meshes[0].pair.base_radius
        return np.asarray(1e3 * radius * self.found.movement[..., self.plan.driver])

    @cached_property
    def mesh_force_N(self) -> FloatArray:
        """Force of each mesh in the transverse plane, (D, A, M)."""
        return np.stack([self.found.force[..., one.part].sum(axis=2) for one in self.placed.placed], axis=2)

    @property
    def beside(self) -> list[list[int]]:
        """Meshes that share a load with each one, itself among them: of one driving gear, else of one driven gear."""
        ends = [(mesh.pinion, mesh.wheel) for mesh in self.plan.meshes]
        found = []
        for own in ends:
            together = [[n for n, end in enumerate(ends) if end[place] == own[place]] for place in range(2)]
            found.append(together[0] if len(together[0]) > 1 else together[1])
        return found

    @cached_property
    def mesh_share(self) -> FloatArray:
        """Share of each mesh in the torque of all that share it, (D, A, M)."""
        total = np.stack([self.mesh_force_N[..., meshes].sum(axis=2) for meshes in self.beside], axis=2)
        return np.divide(self.mesh_force_N, total, out=np.full(total.shape, np.nan), where=total != 0.0)

    @cached_property
    def hub_wrench(self) -> FloatArray:
        """Forces and moments of the meshes on the hubs, in axes of the train, (D, A, B, 6), N and N mm."""
        grid = self.converged.shape
        total = np.zeros((grid[0], self.cycles, len(self.placed.phi), len(self.train.bodies), HUB))
        force = self.found.force.reshape(*total.shape[:3], -1)
        for one in self.placed.placed:
            for gear, body in enumerate(one.mesh.bodies):
                total[..., body, :] += np.einsum(
                    "dkan,anr->dkar", force[..., one.part], one.rows[:, :, gear], optimize=True
                )
        return total.reshape(*grid, *total.shape[3:])

    @cached_property
    def hub_displacement(self) -> FloatArray:
        """Displacement of all hubs from where a set without load has them, (D, A, B, 6), mm and rad."""
        grid = *self.converged.shape, len(self.train.bodies), HUB
        wrench = self.hub_wrench.reshape(*grid[:2], -1)
        moved = wrench @ self.train.compliance + self.found.movement @ self.train.free
        return np.asarray(moved.reshape(grid))

    def mesh_displacement(self, mesh: int) -> FloatArray:
        """Displacement of both hubs of a mesh from the drawing, errors too, in axes of its pair, (D, A, 2, 6)."""
        one = self.train.meshes[mesh]
        return np.asarray(self._from_the_drawing[:, :, list(one.bodies)] @ one.to_train)

    @cached_property
    def _from_the_drawing(self) -> FloatArray:
        return self.hub_displacement + hubs_off(self.plan, self.plan.displacement, self.train.rates, self.phi_rad)

    @cached_property
    def planet_share(self) -> FloatArray:
        """Share of each planet in the torque that pins carry, (D, A, N)."""
        force = self.tangential_pin_force_N
        total = force.sum(axis=2, keepdims=True)
        return np.divide(force, total, out=np.full(force.shape, np.nan), where=total != 0.0)

    @cached_property
    def tangential_rows(self) -> FloatArray:
        """Force on each pin, in the sense in which the torque turns the sun, by unit forces in the sections, (a, n, N).

        At the a angles at which the set is placed.
        """
        found = np.zeros((len(self.placed.phi), self.found.force.shape[2], len(self.plan.planets), 2))
        shafts = shaft_of(self.plan.bodies)
        for one in self.placed.placed:
            for gear, body in enumerate(one.mesh.bodies):
                if shafts[body] in self.plan.planets:
                    found[:, one.part, self.plan.planets.index(shafts[body])] += one.rows[:, :, gear, :2]
        return np.asarray(self.outwards_and_around(found)[..., 1])

    @cached_property
    def tangential_pin_force_N(self) -> FloatArray:
        """Force on each pin in the sense in which the torque turns the sun, (D, A, N)."""
        return np.asarray(self.outwards_and_around(self.planet_wrench[..., :2])[..., 1])

    @cached_property
    def pin_force_N(self) -> FloatArray:
        """Force across each pin, (D, A, N)."""
        return np.asarray(np.linalg.norm(self.planet_wrench[..., :2], axis=3))

    @cached_property
    def planet_wrench(self) -> FloatArray:
        """Forces and moments of the meshes on the planets, of stepped ones about the first gear, (D, A, N, 6)."""
        return on_planets(self.plan, self.hub_wrench)

    @cached_property
    def planet_displacement_mm(self) -> FloatArray:
        """Displacement of each planet's middle, outwards and as the torque turns the sun, (D, A, N, 2)."""
        return self.outwards_and_around(self.hub_displacement[:, :, list(self.plan.planets), :2])

    @cached_property
    def planet_tilt_rad(self) -> FloatArray:
        """Slopes along z of the axis of each planet in the same directions, (D, A, N, 2)."""
        turned = self.hub_displacement[:, :, list(self.plan.planets), 3:5]
        return self.outwards_and_around(np.stack([turned[..., 1], -turned[..., 0]], axis=-1))

    @cached_property
    def bearing_loads(self) -> FloatArray:
        """Loads on the b bearings of each planet, as in `pmor.sets.pins.PlanetOnPin`, (D, A, N, b, 4)."""
        assert self.plan.on_pins is not None, "of a planetary set"
        return self.plan.on_pins.on_bearings(self.planet_wrench)

    @cached_property
    def windup_rad(self) -> FloatArray:
        """By how much one cheek of the carrier turns against the other, (D, A)."""
        assert self.plan.on_pins is not None, "of a planetary set"
        return self.plan.on_pins.windup_angle(self.planet_wrench)

    def outwards_and_around(self, vectors: FloatArray) -> FloatArray:
        """Return components of vectors on the planets (..., N, 2), outwards and in the sense of the sun's torque."""
        places = np.array([(body.x, body.y) for body in (self.plan.bodies[n] for n in self.plan.planets)])
        outwards = places / np.linalg.norm(places, axis=1)[:, None]
        around = np.stack([-outwards[:, 1], outwards[:, 0]], axis=1)
        return np.asarray(np.einsum("...nr,dnr->...nd", vectors, np.stack([outwards, around])))

    @property
    def k_gamma(self) -> FloatArray:
        """Mesh load factor: largest mean load of a planet in a mesh cycle over the mean of all, (D,).

        Of the positions that have a solution; NaN without planets.
        """
        if not self.plan.planets:
            return np.full(len(self.torque_Nm), np.nan)
        share = self.planet_share.reshape(len(self.torque_Nm), self.pitches, -1, len(self.plan.planets))
        there = np.isfinite(share)
        total, count = np.where(there, share, 0.0).sum(axis=2), there.sum(axis=2)
        mean = np.divide(total, count, out=np.full(total.shape, np.nan), where=count > 0)
        return np.asarray(len(self.plan.planets) * np.fmax.reduce(mean.reshape(len(mean), -1), axis=1))

    def face_loads(self, mesh: int) -> FaceLoads:
        """Line loads of a mesh by its number, 0 where not converged: less than `lines` for what needs no more."""
        one = self.placed.placed[mesh]
        width = one.mesh.pair.meshed.width
        force = np.where(self.converged[..., None], self.found.force[..., one.part], 0.0)
        return FaceLoads(force.reshape(*self.converged.shape, -1, len(width)) / width, width)

    @property
    def mesh_names(self) -> list[str]:
        """Gears of each mesh."""
        return [" - ".join(self.train.bodies[body].name for body in one.bodies) for one in self.train.meshes]

    def mesh(self, name: str) -> MeshView:
        """Return a mesh by its name, such as "sun - planet 1", with all that is read off its line contact."""
        number = place_of("mesh", name, self.mesh_names)
        return MeshView(name, self.train.meshes[number].pair.meshed.pair, self.lines(number))

    def gear(self, name: str) -> PartView:
        """Return what the meshes do to a gear by its name, and how far it moves, in axes of the train."""
        number = place_of("gear", name, [body.name for body in self.plan.bodies])
        return PartView(name, self.hub_wrench[:, :, number], self.hub_displacement[:, :, number])

    def support(self, name: str) -> PartView:
        """Return what a gear, on its pin or shaft, carries into what it stands on, in axes of the train."""
        number = place_of("support", name, [body.name for body in self.plan.bodies if body.on is None])
        wrench = sum(
            self.hub_wrench[:, :, body] @ at_place(self.plan.bodies[body].z - self.plan.bodies[number].z)
            for body, on in enumerate(shaft_of(self.plan.bodies)) if on == number
        )
        return PartView(name, np.asarray(wrench), self.hub_displacement[:, :, number])

    def lines(self, mesh: int) -> LineStates:
        """Line contact of a mesh by its number, as that of a pair: what is read off it is read alike."""
        one = self.placed.placed[mesh]
        passed = one.lines._replace(row=NO_ROWS, gradient=NONE)
        lines = Lines._make(np.tile(values, (self.cycles, *[1] * (values.ndim - 1))) for values in passed)
        levers = levers_of(lines, self.found.movement @ self.train.joined.ahead[mesh])
        pairs = self.first_pair(mesh)[:, None] + np.arange(one.mesh.pair.meshed.tooth_pair_count)
        force = self.found.force[..., one.part]
        return line_states_of(one.mesh.pair.meshed, lines, force, self.converged, pairs, levers)

    @cached_property
    def mesh_figures(self) -> tuple[Figures, ...]:
        """What is read off the line contact of each mesh, one after the other: all of them may be large."""
        return tuple(map(self.figures_of, range(len(self.placed.placed))))

    def figures_of(self, mesh: int) -> Figures:
        """Return what is read off the line contact of a mesh by its number."""
        pair = self.placed.placed[mesh].mesh.pair.meshed.pair
        return {**figures_of_mesh(pair, self.lines(mesh)), "k_h_beta": self.k_h_beta(mesh)}

    @property
    def carrying(self) -> BoolArray:
        """Whether each mesh carries anything, (D, M): what is left of one that does not is round-off."""
        mean = np.nan_to_num(self.mesh_force_N).mean(axis=1)
        return np.asarray(~(mean <= NOTHING * mean.max(axis=1, keepdims=True)))

    def first_pair(self, mesh: int) -> IntArray:
        """Numbers of the first tooth pair of the line loads of a mesh, (A,); as the pinion turns on they fall."""
        one, placed = self.placed.placed[mesh], self.pitches // self.cycles
        later = [round(self.train.mesh_cycles(placed * cycle)[mesh]) for cycle in range(self.cycles)]
        return np.asarray((one.lines.first_pair - np.array(later)[:, None]).ravel())

    def k_h_beta(self, mesh: int) -> FloatArray:
        """Face load factor of a mesh under each torque, (D,); NaN where it carries nothing."""
        return np.where(self.carrying[:, mesh], face_load_factor(self.face_loads(mesh)), np.nan)

    @cached_property
    def root_stress(self) -> tuple[GearStress, ...]:
        """Root stress of all bodies; none where it was not asked for."""
        return root_stress_of_set(self.placed, self.found, self.pitches)

    @cached_property
    def ring_deflection(self) -> RingDeflection | None:
        """Deflection of a ring with several meshes."""
        return ring_deflection(self.placed, self.found, self.pitches, self.plan.clockwise)

    def ste_orders(self, torque: int) -> Orders:
        """Orders of the transmission error over all pitches under a torque by its number, um."""
        return orders(self.phi_rad, self.ste_um[torque], self.pitches * self.pitch_rad)

    def mesh_orders(self, torque: int) -> FloatArray:
        """Amplitudes of the whole orders of the first mesh, um; NaN where meshes do not stand as before at the end."""
        found = self.ste_orders(torque).amplitude[self.pitches - 1 :: self.pitches]
        return found if self.repeats else np.full_like(found, np.nan)


def on_planets(plan: SetPlan, wrench: FloatArray) -> FloatArray:
    """Return wrenches on all bodies (..., B, 6) as those on planets, of stepped ones about the first, (..., N, 6)."""
    total = np.zeros((*wrench.shape[:-2], len(plan.planets), HUB))
    for number, (body, on) in enumerate(zip(plan.bodies, shaft_of(plan.bodies), strict=True)):
        if on in plan.planets:
            place = body.z - plan.bodies[on].z
            total[..., plan.planets.index(on), :] += wrench[..., number, :] @ at_place(place)
    return total


def solve_set(
    plan: SetPlan, train: GearTrain, torques_Nm: FloatArray, angles: int, pitches: int = 1,
    executor: Executor | None = None,
) -> SetSolution:  # fmt: skip
    """Solve a set over pitches of its first gear.

    Parameters
    ----------
    torques_Nm : ndarray, shape (D,)
        On the first gear.
    angles : int
        Of a pitch.
    pitches : int
        After which the set repeats; others are solved as they are.
    executor : concurrent.futures.Executor, optional
        Of threads: shares out blocks of angles, whose results do not depend on it.
    """
    pitch, placed = train.meshes[0].pair.meshed.pair.pitch, plan.placed_pitches(pitches)
    phi = pitch * np.arange(placed * angles) / angles
    return solve_on(plan, train.place(phi, plan.displacement), torques_Nm, pitches, executor)


def with_mesh_error(solved: SetSolution, cases: Collection[Case], coarse: GearTrain | None) -> SetSolution:
    """Return a set with the error bar of the mesh, by its train on half as many elements; as it is without one."""
    if coarse is None:
        return solved
    again = solve_set(solved.plan, coarse, solved.torque_Nm, solved.angles_per_pitch, solved.pitches)
    mean = np.abs([np.mean(row[np.isfinite(row)]) for row in solved.ste_um])
    return replace(solved, mesh_error_percent=error_percent(solved.ste_um, again.ste_um, mean, list(cases)))


@one_thread()
def solve_on(
    plan: SetPlan, placed: PlacedTrain, torques_Nm: FloatArray, pitches: int = 1, executor: Executor | None = None,
    workspaces: Workspaces | None = None,
) -> SetSolution:  # fmt: skip
    """Solve a set over pitches, placed as the same set with other errors or none.

    Parameters
    ----------
    workspaces : Workspaces, optional
        Of the placed set; several solutions may share them.
    """
    loads, starts = 1e3 * torques_Nm[:, None] * plan.load, range(0, pitches, plan.placed_pitches(pitches))
    lending = Workspaces(placed.blocks) if workspaces is None else workspaces

    def solve(number: int) -> list[LineResults]:
        block = lending.blocks[number]
        with lending.lent(number) as workspace:
            return [solve_placed(block, loads, errors_of(plan, block, start), start, workspace) for start in starts]

    blocks = list(in_order(solve, range(len(lending.blocks)), executor))
    found = joined_results([block[number] for number in range(len(starts)) for block in blocks])
    return SetSolution(plan, placed, torques_Nm, found, pitches)


def solve_placed(
    placed: PlacedTrain, loads: FloatArray, deviation: FloatArray = NONE, pitch: int = 0,
    workspace: Flexibility | None = None, before: LineResults | None = None,
) -> LineResults:  # fmt: skip
    """Solve a train at its angles, as `PlacedTrain.solve`; NaN where not converged, or beyond the range of contact.

    Hubs that stand off by far more than flanks give way, such as a heavy sun that floats, are taken there in steps.
    """
    found = placed.solve(loads, deviation, pitch, workspace, before)
    if deviation.size and not found.converged.all():
        found = _approached(placed, loads, deviation, pitch, workspace)
    for one in placed.placed:
        found.converged[width_limit(one.mesh.pair.meshed, one.lines.law).exceeded(found.force[..., one.part])] = False
    for values in (found.movement, found.force):
        values[~found.converged] = np.nan
    return found


def _approached(
    placed: PlacedTrain, loads: FloatArray, deviation: FloatArray, pitch: int, workspace: Flexibility | None
) -> LineResults:
    """Solve a train from one without deviations on, each of whose states begins from the one before."""
    found, share, step = placed.solve(loads, NONE, pitch, workspace), 0.0, 1.0
    while share < 1.0:
        tried = placed.solve(loads, min(share + step, 1.0) * deviation, pitch, workspace, found)
        if tried.converged.all() or step < LEAST_SHARE:
            found, share, step = tried, share + step, 2.0 * step
        else:
            step *= 0.5
    return found


def errors_of(plan: SetPlan, placed: PlacedTrain, pitch: int) -> FloatArray:
    """By how much flanks stand off by errors beyond those of the placed set in a pitch, (A, N), mm; empty without."""
    pitch_rad, found = placed.train.meshes[0].pair.meshed.pair.pitch, NONE
    moved = plan.displacement - (0.0 if placed.displacement is None else placed.displacement)
    displacement = hubs_off(plan, moved, placed.train.rates, placed.phi + pitch * pitch_rad)
    if displacement.any():
        found = placed.opened(displacement.reshape(len(placed.phi), -1))
    meshes = zip(plan.meshes, placed.train.meshes, strict=True)
    assemblies = [of_plan.assembly or mesh.assembly for of_plan, mesh in meshes]
    if any(assembly.uneven for assembly in assemblies):
        deviation = placed.tooth_deviation(pitch, assemblies)
        found = found + deviation if found.size else deviation
    return found
