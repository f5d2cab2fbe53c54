"""Gears that mesh with several others: idlers, stars, planetary sets, placed and solved with all meshes at once.

All axes stand still: a planetary set is seen from its carrier. Gears and meshes are in `pmor.line.train`.
"""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from pmor.body.far_compliance import ROWS
from pmor.body.support import carried_shapes, support_flexibility
from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.gear.condition import ALIGNED, Assembly
from pmor.gear.kernels.deviation import deviations_at
from pmor.line.hubs import HUB, hub_rows
from pmor.line.kernels.derivatives import differentiate_lines
from pmor.line.kernels.flexibility import Compliance, Flexibility, gather, make_all_ready
from pmor.line.kernels.loads import FOLLOWING, WARM, solve_lines
from pmor.line.kernels.places import Lines, line_deviations
from pmor.line.kernels.types import LineResults, Meshes
from pmor.line.layered_pair import place_sections
from pmor.line.pair import NONE, compliance_of, meshes_of, new_flexibility, no_results, section_patterns
from pmor.line.train import TrainBody, TrainMesh

TILTS = (3, 4)
# By how much the numbers of the teeth of pinion and wheel that are in mesh change in a pitch.
LATER = (-1, 1)
# Of a mesh cycle: by which less than whole ones are off.
WHOLE = 1e-6
# Angles that are solved at a time: enough blocks to share out, whatever the number of threads.
ANGLES_PER_BLOCK = 16
# Of flexibilities that are held at a time, and that are kept for the next solution.
MOST_BYTES, MOST_KEPT_BYTES = 2**28, 2**28


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
    def closing(self) -> FloatArray:
        """Change of the gap of smooth flanks of each mesh by each movement, (M, K), mm or 1."""
        rows = np.zeros((len(self.meshes), HUB * len(self.bodies)))
        for row, mesh in zip(rows, self.meshes, strict=True):
            for body, wrench in zip(mesh.bodies, mesh.smooth_rows, strict=True):
                row[HUB * body : HUB * (body + 1)] += wrench
        return np.asarray(rows @ self.free.T)

    @cached_property
    def carried(self) -> tuple[tuple[FloatArray, FloatArray], ...]:
        """Shapes of the far compliance of both bodies of each mesh at the nodes of its sections, for `gather`."""
        pinions, wheels = ([self._carried(mesh, gear) for mesh in self.meshes] for gear in range(2))
        return tuple(zip(pinions, wheels, strict=True))

    def _carried(self, mesh: TrainMesh, gear: int) -> FloatArray:
        (first, share), rows = mesh.pair.meshed.carriers
        far = self.bodies[mesh.bodies[gear]].far
        if far is None:
            return np.zeros((len(first[gear]), max(rows[gear], ROWS), mesh.pair.components, 0))
        return carried_shapes(far.shapes, (first[gear], share[gear]), rows[gear], mesh.pair.components)

    @cached_property
    def joined(self) -> Meshes:
        """All meshes one after the other, for the kernels."""
        pairs = [mesh.pair for mesh in self.meshes]
        base = np.array([pair.base_radius for pair in pairs])
        share = -np.linalg.pinv(self.closing.T)
        return meshes_of(pairs, -self.closing / base[:, None], np.ascontiguousarray(share))

    @cached_property
    def compliance_between(self) -> Compliance:
        """Compliance of all gears, for the kernels."""
        near, bodies = compliance_of([mesh.pair for mesh in self.meshes]), self.bodies
        count = np.array([0 if body.far is None else body.far.shapes.shape[1] for body in bodies])
        if not count.any():
            return near
        teeth = np.array([body.teeth for body in bodies])
        grid = len(bodies), 2, int(teeth[count > 0].max()), int(count.max()), int(count.max())
        alike, backs = np.zeros(grid), np.zeros(grid)
        for number, body in enumerate(bodies):
            if body.far is not None:
                z, r = body.teeth, count[number]
                alike[number, :, :z, :r, :r] = body.far.flanks, body.far.images
                backs[number, :, :z, :r, :r] = body.far.backs.transpose(0, 2, 1), body.far.backs
        on = np.array([mesh.bodies for mesh in self.meshes])
        image = np.array([[int(mesh.image != bodies[n].image) for n in mesh.bodies] for mesh in self.meshes])
        return near._replace(
            body=on[near.mesh], image=image[near.mesh], rank=count, teeth=teeth, alike=alike, backs=backs
        )

    @cached_property
    def support_root(self) -> FloatArray:
        """Rows V of which the compliance of what hubs stand on is V^T V, (r, 6 B)."""
        values, vectors = np.linalg.eigh(self.compliance)
        kept = values > 1e-14 * max(values[-1], 1e-300)
        return np.asarray((vectors[:, kept] * np.sqrt(values[kept])).T)

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
    """A train at A angles, ready to be solved under any load; threads may share it."""

    train: GearTrain
    phi: FloatArray
    displacement: FloatArray | None

    @cached_property
    def blocks(self) -> tuple[PlacedTrain, ...]:
        """The train at all angles, some at a time, so that the flexibilities of each stay within `MOST_BYTES`."""
        size = sum(mesh.pair.size for mesh in self.train.meshes)
        most = min(max(MOST_BYTES // (8 * size**2), 1), ANGLES_PER_BLOCK)
        if len(self.phi) <= most:
            return (self,)
        return tuple(replace(self, phi=self.phi[first : first + most]) for first in range(0, len(self.phi), most))

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
        placed = [one.lines for one in self.placed]
        gap = np.concatenate([one.lines.gap + _deviation(one, one.mesh.assembly) for one in self.placed], axis=1)
        if self.displacement is not None:
            gap += self.opened(self.displacement)
        most = max(lines.gradient.shape[3] for lines in placed)
        gradients = [_with_components(lines.gradient, most // 4) for lines in placed]
        joined = {
            name: np.concatenate([getattr(lines, name) for lines in placed], axis=1)
            for name in ("lever", "mate_lever", "lever_slope", "corner_advance", "roll", "law", "row")
        }
        return Lines(
            first_pair=placed[0].first_pair, gap=gap, gradient=np.concatenate(gradients, axis=1), **joined
        )

    @cached_property
    def rows(self) -> FloatArray:
        """Change of all gaps by the free movements, (A, N, K), mm or 1."""
        return np.concatenate([self.on_bodies(one, self.train.free) for one in self.placed], axis=1)

    def opened(self, displacement: FloatArray) -> FloatArray:
        """Change of all gaps by displaced hubs, (6 B,), or at each angle (A, 6 B): (A, N), mm."""
        moved = np.broadcast_to(displacement, (len(self.phi), displacement.shape[-1])).reshape(len(self.phi), -1, HUB)
        found = [np.einsum("angr,agr->an", one.rows, moved[:, list(one.mesh.bodies)]) for one in self.placed]
        return np.concatenate(found, axis=1)

    def deviation(self, assemblies: Sequence[Assembly]) -> FloatArray:
        """Return the deviations of other assemblies of all meshes, those of single teeth left out, mm, (A, N)."""
        found = [_deviation(one, assembly) for one, assembly in zip(self.placed, assemblies, strict=True)]
        return np.concatenate(found, axis=1)

    def tooth_deviation(self, pitch: int, assemblies: Sequence[Assembly]) -> FloatArray:
        """Deviations of the teeth of assemblies that are in mesh so many pitches later, in all sections, mm, (A, N)."""
        found = np.zeros(self.lines.gap.shape)
        cycles = np.rint(self.train.mesh_cycles(pitch)).astype(int)
        for one, later, assembly in zip(self.placed, cycles, assemblies, strict=True):
            tooth, meshed = section_teeth(one) + later * np.array(LATER), one.mesh.pair.meshed
            z = np.resize(meshed.sections.z, tooth.shape[:2])  # those of all tooth pairs, at all angles
            for gear, flank in enumerate(meshed.deviations(assembly.of_teeth)):
                if flank.present:
                    own = np.empty(z.size)
                    deviations_at(flank, one.lines.roll[..., gear].ravel(), z.ravel(), tooth[..., gear].ravel(), own)
                    found[:, one.part] += own.reshape(z.shape)
        return found

    def workspace(self) -> Flexibility:
        """Return the flexibilities of all sections, filled as `solve` needs them; for one thread at a time."""
        train, root = self.train, self.train.support_root
        rows = np.concatenate([self.on_bodies(one, root) for one in self.placed], axis=1)
        grid = rows.shape[:2]
        between = rows @ rows.transpose(0, 2, 1) if len(root) else np.zeros((*grid, grid[1]))
        found = new_flexibility(between)
        if not len(train.compliance_between.rank):
            return found
        rank = int(train.compliance_between.rank.max())
        shapes = np.zeros((*grid, 2, rank))
        for one, carried in zip(self.placed, train.carried, strict=True):
            gather(one.lines, carried, one.part.start, shapes)
        tooth = np.concatenate([section_teeth(one) for one in self.placed], axis=1)
        return found._replace(tooth=tooth, shapes=shapes, moved=np.empty(rank))

    def solve(
        self, loads: FloatArray, deviation: FloatArray = NONE, pitch: int = 0, workspace: Flexibility | None = None,
        before: LineResults | None = None,
    ) -> LineResults:
        """Solve all angles under loads on the free movements, (D, K), N mm or N, each from those before.

        Parameters
        ----------
        deviation : ndarray, shape (A, N), optional
            By how much further the flanks stand off, mm.
        pitch : int
            So many pitches of the first gear later than the train is placed, whole ones of all meshes: other teeth of
            gears whose teeth differ are in mesh.
        workspace : Flexibility, optional
            Of an earlier solution; the result does not depend on it.
        before : LineResults, optional
            Of these angles under loads close by, from which it begins.
        """
        loads = np.atleast_2d(np.asarray(loads, dtype=float))
        angles, size = self.lines.gap.shape
        everywhere = np.repeat(loads[:, None], angles, axis=1)
        found = no_results(everywhere.shape, size)
        if before is not None:
            found.force[:], found.movement[:] = before.force, before.movement
        start = FOLLOWING if before is None else WARM
        solve_lines(*self._sections(workspace, pitch), deviation, everywhere, False, start, found)
        return found

    def differentiate(
        self, found: LineResults, by_movement: FloatArray, by_force: FloatArray, deviation: FloatArray = NONE,
        pitch: int = 0, workspace: Flexibility | None = None,
    ) -> FloatArray:  # fmt: skip
        """Return the derivatives of a figure of solved states by the deviation of each section, (D, A, N), per mm.

        Loads stay as they are. They are those of the sections that carry: exact but where one begins to.

        Parameters
        ----------
        found, deviation, pitch, workspace
            As `solve` gives and takes them.
        by_movement : ndarray, shape (D, A, K)
            Derivatives of the figure by the movements in each state, per rad or mm.
        by_force : ndarray, shape (D, A, N)
            By the forces, per N.
        """
        rates = np.zeros(found.force.shape)
        by_movement, by_force = np.ascontiguousarray(by_movement), np.ascontiguousarray(by_force)
        differentiate_lines(*self._sections(workspace, pitch), deviation, found, by_movement, by_force, rates)
        return rates

    def make_ready(self, workspace: Flexibility, wanted: BoolArray) -> None:
        """Fill the flexibilities of sections, (A, N), in a workspace."""
        make_all_ready(self.lines, self.train.compliance_between, workspace, wanted.copy())

    def _sections(
        self, workspace: Flexibility | None, pitch: int
    ) -> tuple[Lines, FloatArray, Meshes, Compliance, Flexibility]:
        """Return what the kernels solve with."""
        workspace = self.workspace() if workspace is None else workspace
        if self._on_supports:
            given = workspace.further if workspace.further.size else 0.0
            workspace = workspace._replace(further=self._at_supports(pitch) + given)
        return self.lines, self.rows, self.train.joined, self.train.compliance_between, workspace

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
        """By what gears whose teeth differ give way between all sections so many pitches later, (A, N, N), mm/N."""
        found = np.zeros((*self.lines.gap.shape, self.lines.gap.shape[1]))
        for body, at, rows, tooth, senses in self._on_supports:
            assert body.support is not None
            later = [numbers + round(sense * pitch) for numbers, sense in zip(tooth, senses, strict=True)]
            found[:, at[:, None], at] += support_flexibility(body.support, body.teeth, rows, later)
        return found

    def on_bodies(self, one: PlacedMesh, directions: FloatArray) -> FloatArray:
        """Work of unit forces in the sections of a mesh by displacements of all hubs (r, 6 B), (A, N, r)."""
        total = np.zeros((*one.rows.shape[:2], len(directions)))
        for gear, body in enumerate(one.mesh.bodies):
            total += one.rows[:, :, gear] @ directions[:, HUB * body : HUB * (body + 1)].T
        return total


class Workspaces:
    """Workspaces of a placed train by blocks of its angles: those that no thread has are lent again.

    Parameters
    ----------
    blocks : sequence of PlacedTrain
    """

    def __init__(self, blocks: Sequence[PlacedTrain]) -> None:
        self.blocks = tuple(blocks)
        self._idle: list[list[Flexibility]] = [[] for _ in self.blocks]
        self._kept_bytes, self._lock = 0, threading.Lock()

    @contextmanager
    def lent(self, block: int) -> Iterator[Flexibility]:
        """Lend the workspace of a block, which serves one thread at a time."""
        with self._lock:
            idle = self._idle[block]
            workspace = idle.pop() if idle else None
            self._kept_bytes -= 0 if workspace is None else workspace.between.nbytes
        if workspace is None:
            workspace = self.blocks[block].workspace()
        try:
            yield workspace
        finally:
            with self._lock:
                if self._kept_bytes + workspace.between.nbytes <= MOST_KEPT_BYTES:
                    self._idle[block].append(workspace)
                    self._kept_bytes += workspace.between.nbytes


def _with_components(gradient: FloatArray, components: int) -> FloatArray:
    """Return gradients by so many components of displacement, (A, N, 2, 4 c): those that are missing are 0."""
    own = gradient.reshape(*gradient.shape[:3], 4, -1)
    if own.shape[4] == components:
        return gradient
    found = np.zeros((*own.shape[:4], components))
    found[..., : own.shape[4]] = own
    return found.reshape(*gradient.shape[:3], -1)


def _deviation(one: PlacedMesh, assembly: Assembly) -> FloatArray:
    """Return the deviations of both flanks of a mesh, added up, those of single teeth left out, (A, N), mm."""
    found = np.zeros_like(one.lines.gap)
    if assembly.modified:
        meshed = one.mesh.pair.meshed
        line_deviations(one.lines, meshed.sections.z, *meshed.deviations(assembly.alike), found)
    return found


def section_teeth(one: PlacedMesh) -> IntArray:
    """Return the numbers of the teeth that the sections of a mesh are on, (A, N, 2)."""
    place = np.arange(one.rows.shape[1]) // len(one.mesh.pair.meshed.sections.z)
    pairs, (pinion, wheel) = one.lines.first_pair[:, None] + place, one.mesh.first_tooth
    return np.stack([pinion + pairs, wheel - pairs], axis=-1)
