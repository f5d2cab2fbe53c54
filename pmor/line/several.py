"""Gears that mesh with several others: idlers, stars, planetary sets, placed and solved with all meshes at once.

All axes stand still: a planetary set is seen from its carrier. Gears and meshes are in `pmor.line.train`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from pmor.body.far_compliance import ROWS
from pmor.body.support import carried_shapes, support_flexibility
from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.gear.condition import ALIGNED, Assembly
from pmor.line.hubs import HUB, hub_rows
from pmor.line.kernels.coupling import Gathered, couple, gather
from pmor.line.kernels.flexibility import Flexibility, make_all_ready
from pmor.line.kernels.movements import Levers
from pmor.line.kernels.places import Lines, line_deviations
from pmor.line.kernels.several import SeveralResults, differentiate_meshes, solve_meshes
from pmor.line.kernels.tip_corner import Corner, LineLaw
from pmor.line.layered_pair import place_sections
from pmor.line.pair import LinePair, section_patterns
from pmor.line.train import TrainBody, TrainMesh

TILTS = (3, 4)
CORNERS, CORNER = 4, LineLaw._fields.index("corner")
# Tuples of corners have a multiple of this length: kernels are compiled for each length.
TOGETHER = 8
NONE = np.empty((0, 0))
# By how much the numbers of the teeth of pinion and wheel that are in mesh change in a pitch.
LATER = (-1, 1)
# Of a mesh cycle: by which less than whole ones are off.
WHOLE = 1e-6
# Approach of flanks, over the one to expect, up to which sections are made ready first.
REACH = 2.0
MOST_ROUNDS = 8
# Memory of the flexibilities that are held at a time.
MOST_BYTES = 2**28


@dataclass(frozen=True)
class GearTrain:
    """Gears and their meshes.

    Parameters
    ----------
    free : ndarray, shape (K, 6 B)
        Movements of the hubs of all bodies that are free: mm and rad by a unit of each.
    compliance : ndarray, shape (6 B, 6 B)
        Displacements of the hubs under forces and moments on them, without those of `free`; mm/N and so on.
    """

    bodies: tuple[TrainBody, ...]
    meshes: tuple[TrainMesh, ...]
    free: FloatArray
    compliance: FloatArray

    @cached_property
    def kinds(self) -> tuple[LinePair, ...]:
        """Pairs that differ."""
        found: list[LinePair] = []
        for mesh in self.meshes:
            if not any(mesh.pair is kind for kind in found):
                found.append(mesh.pair)
        return tuple(found)

    @cached_property
    def corners(self) -> tuple[Corner, ...]:
        """Corners of all pairs that differ, four of each, for the kernels."""
        found: list[Corner] = []
        for kind in self.kinds:
            corners = kind.meshed.corners
            found += [*corners, *corners[: CORNERS - len(corners)]]
        return (*found, *(found[0],) * (-len(found) % TOGETHER))

    @cached_property
    def closing(self) -> FloatArray:
        """Change of the gap of smooth flanks of each mesh by each movement, (M, K), mm or 1."""
        rows = np.zeros((len(self.meshes), HUB * len(self.bodies)))
        for row, mesh in zip(rows, self.meshes, strict=True):
            for body, wrench in zip(mesh.bodies, mesh.smooth_rows, strict=True):
                row[HUB * body : HUB * (body + 1)] += wrench
        return np.asarray(rows @ self.free.T)

    @cached_property
    def _carried(self) -> dict[int, tuple[FloatArray, FloatArray]]:
        return {}

    def carried(self, mesh: TrainMesh) -> tuple[FloatArray, FloatArray]:
        """Return the shapes of the far compliance of both bodies at the rows of nodes of each section, for `gather`."""
        key = id(mesh)
        if key not in self._carried:
            meshed = mesh.pair.meshed
            (first, share), rows = meshed.carriers
            found = []
            for gear, body in enumerate(mesh.bodies):
                far = self.bodies[body].far
                if far is None:
                    found.append(np.zeros((len(first[gear]), max(rows[gear], ROWS), mesh.pair.components, 0)))
                else:
                    found.append(
                        carried_shapes(far.shapes, (first[gear], share[gear]), rows[gear], mesh.pair.components)
                    )
            self._carried[key] = found[0], found[1]
        return self._carried[key]

    @cached_property
    def rates(self) -> FloatArray:
        """By how much each body turns with the angle of the train, counter-clockwise, (B,)."""
        found = np.zeros(len(self.bodies))
        for mesh in self.meshes:
            pair, rate = mesh.pair.meshed.pair, -mesh.rate if mesh.image else mesh.rate
            found[list(mesh.bodies)] = rate, -rate * pair.pinion.base_radius / pair.wheel.base_radius
        return found

    def mesh_cycles(self, pitches: int) -> FloatArray:
        """Return the cycles that each mesh passes in pitches of the first gear, (M,)."""
        pitch = self.meshes[0].pair.meshed.pair.pitch
        return np.array([pitches * pitch * mesh.rate / mesh.pair.meshed.pair.pitch for mesh in self.meshes])

    def mesh_forces(self, loads: FloatArray) -> FloatArray:
        """Return the forces of all meshes that hold loads (D, K), shared as equal meshes do, (D, M), N."""
        return np.asarray(-np.linalg.lstsq(self.closing.T, loads.T, rcond=None)[0].T)

    def place(self, phi: FloatArray, displacement: FloatArray | None = None) -> PlacedTrain:
        """Place all meshes at angles of the train (A,), rad.

        Parameters
        ----------
        displacement : ndarray, shape (6 B,), optional
            Of all hubs: errors of axes, mm and rad.
        """
        return PlacedTrain(self, np.asarray(phi, dtype=float), displacement)


@dataclass(frozen=True)
class PlacedMesh:
    """Sections of one mesh, their wrenches on both hubs in axes of the train, (A, N, 2, 6), their part of the whole."""

    mesh: TrainMesh
    lines: Lines
    rows: FloatArray
    part: slice


@dataclass(frozen=True)
class PlacedTrain:
    """A train at A angles, ready to be solved under any load; for one thread at a time."""

    train: GearTrain
    phi: FloatArray
    displacement: FloatArray | None

    @cached_property
    def ready(self) -> BoolArray:
        """Sections whose flexibilities are filled, (A, N)."""
        return np.zeros(self.lines.gap.shape, dtype=bool)

    @cached_property
    def between(self) -> FloatArray:
        """Flexibilities of all sections, filled as `solve` needs them, (A, N, N), mm/N."""
        return np.zeros((*self.lines.gap.shape, self.lines.gap.shape[1]))

    def blocks(self) -> Iterator[PlacedTrain]:
        """Yield the train at all angles, some at a time, so that the flexibilities of each stay within `MOST_BYTES`."""
        angles, size = self.lines.gap.shape
        most = max(MOST_BYTES // (8 * size**2), 1)
        if angles <= most:
            yield self
            return
        for first in range(0, angles, most):
            yield replace(self, phi=self.phi[first : first + most])

    @cached_property
    def placed(self) -> tuple[PlacedMesh, ...]:
        """All meshes."""
        found, first = [], 0
        for mesh in self.train.meshes:
            meshed = mesh.pair.meshed
            lines = place_sections(meshed, mesh.start + mesh.rate * self.phi, ALIGNED, mesh.pair.components)
            rows = hub_rows(meshed.pair, lines, meshed.sections.z)
            if meshed.mirrored:
                # A section and its image do not tilt.
                rows.reshape(*rows.shape[:2], 2, HUB)[..., TILTS] = 0.0
            turned = rows.reshape(*rows.shape[:2], 2, HUB) @ mesh.to_train.T
            found.append(PlacedMesh(mesh, lines, turned, slice(first, first + rows.shape[1])))
            first += rows.shape[1]
        return tuple(found)

    @cached_property
    def lines(self) -> Lines:
        """Sections of all meshes, their gaps with displaced hubs and deviations of the flanks."""
        gaps, laws = [], []
        for one in self.placed:
            gaps.append(one.lines.gap + _deviation(one, one.mesh.assembly))
            law = one.lines.law.copy()
            kind = next(n for n, kind in enumerate(self.train.kinds) if kind is one.mesh.pair)
            law[..., CORNER] += CORNERS * kind
            laws.append(law)
        joined = {
            name: np.concatenate([getattr(one.lines, name) for one in self.placed], axis=1)
            for name in ("lever", "mate_lever", "lever_slope", "corner_advance", "roll")
        }
        first, gap = self.placed[0].lines, np.concatenate(gaps, axis=1)
        if self.displacement is not None:
            gap += self.opened(self.displacement)
        return Lines(
            first_pair=first.first_pair, gap=gap, law=np.concatenate(laws, axis=1),
            row=first.row[:, :0], gradient=first.gradient[:, :0], **joined,
        )  # fmt: skip

    @cached_property
    def levers(self) -> Levers:
        """How the sections answer to the free movements."""
        train = self.train
        base = np.array([mesh.pair.base_radius for mesh in train.meshes])
        mesh = np.concatenate([np.full(one.rows.shape[1], number) for number, one in enumerate(self.placed)])
        rows = np.concatenate([self._on_bodies(one, train.free) for one in self.placed], axis=1)
        return Levers(np.ascontiguousarray(rows), -train.closing / base[:, None], mesh)

    @cached_property
    def width(self) -> FloatArray:
        """Width of all sections, mm."""
        of_meshes = (one.mesh.pair.meshed for one in self.placed)
        return np.concatenate([np.tile(meshed.width, meshed.tooth_pair_count) for meshed in of_meshes])

    def opened(self, displacement: FloatArray) -> FloatArray:
        """Change of all gaps by displaced hubs, (6 B,), or at each angle (A, 6 B): (A, N), mm."""
        moved = np.broadcast_to(displacement, (len(self.phi), displacement.shape[-1])).reshape(len(self.phi), -1, HUB)
        found = [np.einsum("angr,agr->an", one.rows, moved[:, list(one.mesh.bodies)]) for one in self.placed]
        return np.concatenate(found, axis=1)

    def deviation(self, assemblies: Sequence[Assembly]) -> FloatArray:
        """Return the deviations of the flanks of other assemblies of all meshes, pitch left out, mm, (A, N)."""
        found = [_deviation(one, assembly) for one, assembly in zip(self.placed, assemblies, strict=True)]
        return np.concatenate(found, axis=1)

    def pitch_deviation(self, pitch: int) -> FloatArray:
        """Deviations of the teeth that are in mesh so many pitches later, in all sections, mm, (A, N)."""
        found = np.zeros(self.lines.gap.shape)
        for one, later in zip(self.placed, np.rint(self.train.mesh_cycles(pitch)).astype(int), strict=True):
            tooth = section_teeth(one) + later * np.array(LATER)
            for gear, flank in enumerate(one.mesh.pair.meshed.deviations(one.mesh.assembly)):
                if flank.pitch.size:
                    found[:, one.part] += flank.pitch[tooth[..., gear] % flank.pitch.size]
        return found

    def solve(self, loads: FloatArray, deviation: FloatArray = NONE, pitch: int = 0) -> SeveralResults:
        """Solve all angles under loads on the free movements, (D, K), N mm or N.

        Parameters
        ----------
        deviation : ndarray, shape (A, N), optional
            By how much further the flanks stand off, mm.
        pitch : int
            So many pitches of the first gear later than the train is placed, whole ones of all meshes: other teeth of
            gears whose teeth differ are in mesh.
        """
        loads = np.atleast_2d(np.asarray(loads, dtype=float))
        train, lines = self.train, self.lines
        mean = train.mesh_forces(loads)
        softness = np.array([
            mesh.pair.meshed.expected_approach(mesh.pair.base_radius) for mesh in train.meshes
        ])  # fmt: skip
        angles, size = lines.gap.shape
        grid = len(loads), angles
        results = SeveralResults(
            np.zeros((*grid, loads.shape[1])), np.zeros(grid, dtype=np.int64), np.zeros(grid, dtype=bool),
            np.zeros((*grid, size)), np.full(grid, -1),
        )  # fmt: skip
        gap = lines.gap + deviation if deviation.size else lines.gap
        # Those of this solution alone, so that it does not depend on what was solved before.
        ready = self._likely(gap, REACH * mean.max(axis=0) * softness)
        unused, at_supports = train.meshes[0].pair.compliance, self._at_supports(pitch)
        for _ in range(MOST_ROUNDS):
            self._make_ready(ready)
            solve_meshes(
                lines, self.levers, Flexibility(self._between(at_supports), ready), deviation, loads, mean, softness,
                self.width, unused, train.corners, results,
            )  # fmt: skip
            missing = self._closed(gap, at_supports, results) & ~ready
            if not missing.any():
                break
            ready |= missing.any(axis=0)
        else:
            results.converged[missing.any(axis=2)] = False
        return results

    def differentiate(
        self, found: SeveralResults, by_movement: FloatArray, by_force: FloatArray, deviation: FloatArray = NONE,
        pitch: int = 0,
    ) -> FloatArray:  # fmt: skip
        """Return the derivatives of a figure of solved states by the deviation of each section, (D, A, N), per mm.

        Loads stay as they are. They are those of the sections that carry: exact but where one begins to.

        Parameters
        ----------
        found, deviation, pitch
            As `solve` gives and takes them.
        by_movement : ndarray, shape (D, A, K)
            Derivatives of the figure by the movements in each state, per rad or mm.
        by_force : ndarray, shape (D, A, N)
            By the forces, per N.
        """
        rates = np.zeros(found.force.shape)
        self._make_ready(np.asarray((found.force > 0.0).any(axis=0)))
        differentiate_meshes(
            self.lines, self.levers, Flexibility(self._between(self._at_supports(pitch)), self.ready), deviation,
            self.width, self.train.meshes[0].pair.compliance, self.train.corners, found, by_movement, by_force, rates,
        )  # fmt: skip
        return rates

    def levers_at(self, movement: FloatArray) -> FloatArray:
        """Return l, turned where the pinion's corners carry, at movements (..., A, K): shape (..., A, N, K)."""
        ahead = self.levers.ahead[self.levers.mesh]
        further = np.maximum(movement @ ahead.T - self.lines.corner_advance, 0.0)
        return np.asarray(self.levers.rows + (self.lines.lever_slope * further)[..., None] * ahead)

    def _likely(self, gap: FloatArray, reach: FloatArray) -> BoolArray:
        """Sections of each mesh that stand off by less than a reach (M,), mm, where its first one touches."""
        likely = np.zeros(gap.shape, dtype=bool)
        for one, near in zip(self.placed, reach, strict=True):
            off = gap[:, one.part] / -one.lines.lever * one.mesh.pair.base_radius
            likely[:, one.part] = off <= off.min(axis=1, keepdims=True) + near
        return likely

    def _closed(self, gap: FloatArray, at_supports: FloatArray, results: SeveralResults) -> BoolArray:
        """Sections whose flanks would overlap, but for the deflection of their own mesh, (D, A, N)."""
        rigid = gap + np.einsum("ank,dak->dan", self.levers.rows, results.movement)
        rigid += np.einsum(
            "anr,dar->dan", self._support_rows, np.einsum("anr,dan->dar", self._support_rows, results.force)
        )
        if at_supports.size:
            rigid += np.einsum("anm,dam->dan", at_supports, results.force)
        return np.asarray(rigid < 0.0)

    @cached_property
    def _support_rows(self) -> FloatArray:
        """Rows V of which the flexibility of what hubs stand on is V V^T, (A, N, r)."""
        values, vectors = np.linalg.eigh(self.train.compliance)
        kept = values > 1e-14 * max(values[-1], 1e-300)
        root = (vectors[:, kept] * np.sqrt(values[kept])).T
        return np.concatenate([self._on_bodies(one, root) for one in self.placed], axis=1)

    @cached_property
    def _on_supports(self) -> tuple[tuple[TrainBody, IntArray, list[FloatArray], list[IntArray], list[float]], ...]:
        """Gears whose teeth differ: where their sections are; of each tooth rows, numbers, and how these count on."""
        found = []
        for number, body in enumerate(self.train.bodies):
            if body.support is None:
                continue
            at, rows, tooth, senses = [], list[FloatArray](), list[IntArray](), list[float]()
            cycles = zip(self.placed, self.train.mesh_cycles(1).tolist(), strict=True)
            uses = ((one, gear, n) for one, n in cycles for gear in range(2) if one.mesh.bodies[gear] == number)
            for one, gear, in_a_pitch in uses:
                meshed, pairs = one.mesh.pair.meshed, one.mesh.pair.meshed.tooth_pair_count
                flipped = one.mesh.image != body.image
                patterns = body.support.backs if flipped else body.support.rows
                assert patterns is not None
                rows += np.split(section_patterns(one.mesh.pair.meshed, one.lines, gear, patterns), pairs, axis=1)
                # In its image a tooth has the opposite number.
                sense = -1 if flipped else 1
                tooth += list(sense * section_teeth(one)[:, :: len(meshed.width), gear].T)
                senses += [sense * LATER[gear] * in_a_pitch] * pairs
                at.append(np.arange(one.part.start, one.part.stop))
            found.append((body, np.concatenate(at), rows, tooth, senses))
        return tuple(found)

    def _at_supports(self, pitch: int) -> FloatArray:
        """By what gears whose teeth differ give way between all sections so many pitches later, (A, N, N), mm/N.

        Empty without such gears.
        """
        found = np.zeros(self.between.shape if self._on_supports else (0, 0, 0))
        for body, at, rows, tooth, senses in self._on_supports:
            assert body.support is not None
            later = [numbers + round(sense * pitch) for numbers, sense in zip(tooth, senses, strict=True)]
            found[:, at[:, None], at] += support_flexibility(body.support, body.teeth, rows, later)
        return found

    def _between(self, at_supports: FloatArray) -> FloatArray:
        """Flexibility between all sections that are ready, (A, N, N), mm/N."""
        return self.between + at_supports if at_supports.size else self.between

    def _make_ready(self, wanted: BoolArray) -> None:
        """Fill the flexibilities of further sections; those that were ready are filled again."""
        if not (wanted & ~self.ready).any():
            return
        ready = self.ready | wanted
        rows, (gathered, *compliance) = self._support_rows, self._far
        self.between[:] = rows @ rows.transpose(0, 2, 1) if rows.shape[2] else 0.0
        for one in self.placed:
            own = np.ascontiguousarray(ready[:, one.part])
            local = Flexibility(np.zeros((*own.shape, own.shape[1])), np.zeros(own.shape, dtype=bool))
            make_all_ready(one.lines, local, own, one.mesh.pair.compliance, len(one.mesh.pair.meshed.width))
            self.between[:, one.part, one.part] += local.between
            gather(one.lines, ready, self.train.carried(one.mesh), one.part.start, gathered)
        couple(self.between, ready, self.levers.mesh, gathered, *compliance)
        self.ready[:] = ready

    @cached_property
    def _far(self) -> tuple[Gathered, IntArray, IntArray, FloatArray, FloatArray]:
        """Where sections press on bodies, and the compliance of these, for `couple`."""
        bodies = self.train.bodies
        count = np.array([0 if body.far is None else body.far.shapes.shape[1] for body in bodies])
        teeth = np.array([body.teeth for body in bodies])
        rank, most = max(int(count.max()), 1), max(int(teeth[count > 0].max(initial=1)), 1)
        alike, backs = np.zeros((len(bodies), 2, most, rank, rank)), np.zeros((len(bodies), 2, most, rank, rank))
        for number, body in enumerate(bodies):
            if body.far is not None:
                z, r = body.teeth, count[number]
                alike[number, :, :z, :r, :r] = body.far.flanks, body.far.images
                backs[number, :, :z, :r, :r] = body.far.backs.transpose(0, 2, 1), body.far.backs
        on = np.concatenate([np.tile(one.mesh.bodies, (one.rows.shape[1], 1)) for one in self.placed])
        image = np.concatenate([
            np.tile([int(one.mesh.image != bodies[number].image) for number in one.mesh.bodies], (one.rows.shape[1], 1))
            for one in self.placed
        ])  # fmt: skip
        tooth = np.concatenate([section_teeth(one) for one in self.placed], axis=1)
        shapes = np.zeros((*self.lines.gap.shape, 2, rank))
        return Gathered(on, image, tooth, shapes), count, teeth, alike, backs

    def _on_bodies(self, one: PlacedMesh, directions: FloatArray) -> FloatArray:
        """Work of unit forces in the sections of a mesh by displacements of all hubs (r, 6 B), (A, N, r)."""
        total = np.zeros((*one.rows.shape[:2], len(directions)))
        for gear, body in enumerate(one.mesh.bodies):
            total += one.rows[:, :, gear] @ directions[:, HUB * body : HUB * (body + 1)].T
        return total


def _deviation(one: PlacedMesh, assembly: Assembly) -> FloatArray:
    """Return the deviations of both flanks of a mesh, added up, those of single teeth left out, (A, N), mm."""
    found = np.zeros_like(one.lines.gap)
    if assembly.modified:
        meshed = one.mesh.pair.meshed
        flanks = (flank._replace(pitch=np.empty(0)) for flank in meshed.deviations(assembly))
        line_deviations(one.lines, meshed.sections.z, *flanks, found)
    return found


def section_teeth(one: PlacedMesh) -> IntArray:
    """Return the numbers of the teeth that the sections of a mesh are on, (A, N, 2)."""
    place = np.arange(one.rows.shape[1]) // len(one.mesh.pair.meshed.sections.z)
    pairs, (pinion, wheel) = one.lines.first_pair[:, None] + place, one.mesh.first_tooth
    return np.stack([pinion + pairs, wheel - pairs], axis=-1)
