"""A pair prepared for line loads, and its sections placed at some angles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from pmor.body.far_compliance import ROWS, section_compliance
from pmor.body.support import Support, carried_rows, support_flexibility
from pmor.core.arrays import FloatArray
from pmor.gear.condition import Assembly, Misalignment
from pmor.line.hertz import WidthLimit, width_limit
from pmor.line.hubs import held_hubs, hub_rows
from pmor.line.kernels.derivatives import differentiate_lines
from pmor.line.kernels.flexibility import LAYOUT, Compliance, Flexibility, make_all_ready
from pmor.line.kernels.loads import COLD, WARM, solve_lines
from pmor.line.kernels.places import Lines, line_deviations
from pmor.line.kernels.tip_corner import Corners
from pmor.line.kernels.types import LineResults, Meshes
from pmor.line.layered_pair import LayeredPair, place_sections

NONE = np.empty((0, 0))
NO_FORCES = np.empty((0, 0, 0))


@dataclass(frozen=True)
class LinePair:
    """Flanks on their layers, and the compliance between their sections.

    Parameters
    ----------
    compliance : two ndarrays, shape (neighbours + 1, S, S, r c, r c)
        Between sections of the flanks of teeth 0, 1, ... apart, of pinion and wheel, mm/N (`line_compliance_between`).
    components : int
        c, of displacement: 2 without, 3 with those along the axis.
    flanks : two ndarrays
        Compliance of the flanks, as in `pmor.body.flank_compliance.FlankCompliance`, that it is of.
    supports : two Support or None
        The part of low rank of the compliance of pinion and wheel.
    kept : dict, optional
        Sections that stay placed for the next call with these angles and axes, on hubs that are held, and those of the
        last call; for one thread at a time. Without it none are kept.
    """

    meshed: LayeredPair
    compliance: tuple[FloatArray, FloatArray]
    components: int
    flanks: tuple[FloatArray, FloatArray] = field(repr=False)
    supports: tuple[Support | None, Support | None] = (None, None)
    kept: dict[tuple[bytes, Misalignment], tuple[PlacedSections, PlacedSections]] | None = None

    @property
    def base_radius(self) -> float:
        """Base radius of the pinion, mm."""
        return self.meshed.pair.pinion.base_radius

    @cached_property
    def size(self) -> int:
        """Number of sections of all tooth pairs that can touch."""
        return self.meshed.tooth_pair_count * len(self.meshed.width)

    @cached_property
    def meshes(self) -> Meshes:
        """The one mesh, whose movement is the pinion's advance, for the kernels."""
        return meshes_of([self], np.ones((1, 1)), np.array([[1.0 / self.base_radius]]))

    @cached_property
    def between_flanks(self) -> Compliance:
        """The compliance for the kernels."""
        return compliance_of([self])

    def place(self, phi: FloatArray, misalignment: Misalignment) -> PlacedSections:
        """Place the sections of all tooth pairs that can touch at pinion angles (A,), rad."""
        if self.kept is None:
            return self.placed(place_sections(self.meshed, phi, misalignment, self.components))
        key = phi.tobytes(), misalignment
        if key in self.kept:
            held, last = self.kept[key]
            held.make_ready_as(last)
        else:
            held = replace(self, meshed=self.meshed.on_hubs(None), kept=None).place(phi, misalignment)
        found = held.on(self)
        self.kept[key] = held, found
        return found

    def placed(self, lines: Lines) -> PlacedSections:
        """Return sections, held as `place_sections` places them, on what this pair stands on."""
        lines, between = on_supports(self.meshed, self.supports, lines)
        return PlacedSections(self, lines, new_flexibility(between))


@dataclass(frozen=True)
class PlacedSections:
    """Sections at A angles, ready to be solved under any load and with any flanks; for one thread at a time.

    Parameters
    ----------
    flexibility : Flexibility
        Its own workspace: of the sections that solutions have asked for.
    """

    pair: LinePair
    lines: Lines
    flexibility: Flexibility = field(repr=False, compare=False)

    def on(self, pair: LinePair) -> PlacedSections:
        """Return the same sections on the hubs of another pair: on one workspace where these give way alike.

        Otherwise on one of its own, in which what is ready here is ready too.
        """
        here, there = (one.meshed.hubs or held_hubs() for one in (self.pair, pair))
        lines = self.lines._replace(gap=self.lines.gap + self.hub_rows @ (there.offset - here.offset))
        more = there.compliance - here.compliance
        if not more.any():
            return PlacedSections(pair, lines, self.flexibility)
        between = self.flexibility.between + self.hub_rows @ more @ self.hub_rows.transpose(0, 2, 1)
        ready = self.flexibility.ready.copy()
        return PlacedSections(pair, lines, self.flexibility._replace(between=between, ready=ready))

    def make_ready_as(self, other: PlacedSections) -> None:
        """Make flexibilities ready that are ready between the same sections on other hubs."""
        if (other.flexibility.ready & ~self.flexibility.ready).any():
            make_all_ready(self.lines, self.pair.between_flanks, self.flexibility, other.flexibility.ready.copy())

    @cached_property
    def hub_rows(self) -> FloatArray:
        """As `pmor.line.hubs.hub_rows` gives them."""
        return hub_rows(self.pair.meshed.pair, self.lines, self.pair.meshed.sections.z)

    @cached_property
    def width_limit(self) -> WidthLimit:
        """Load of each section beyond which its contact is too wide for the layer."""
        return width_limit(self.pair.meshed, self.lines.law)

    @property
    def arrays(self) -> tuple[np.ndarray, ...]:
        """Arrays of the sections and their flexibilities."""
        return (*self.lines, *self.flexibility)

    @cached_property
    def nbytes(self) -> int:
        """Memory that these take."""
        return sum(array.nbytes for array in self.arrays)

    def deviation(self, assembly: Assembly) -> FloatArray:
        """Return the deviations of both flanks, added up, in all sections, mm, (A, N); empty where there are none."""
        if not assembly.modified:
            return NONE
        found = np.empty_like(self.lines.gap)
        line_deviations(self.lines, self.pair.meshed.sections.z, *self.pair.meshed.deviations(assembly), found)
        return found

    def solve(
        self, loads: FloatArray, held: bool = False, deviation: FloatArray = NONE, differentiated: bool = False,
        force: FloatArray | None = None,
    ) -> LineResults:  # fmt: skip
        """Solve all angles.

        Parameters
        ----------
        loads : ndarray, shape (D,) or (D, A)
            Torques, N mm, or advances, rad.
        held : bool
            Whether they are advances.
        deviation : ndarray
            As `deviation` gives it.
        differentiated : bool
            With the derivatives of the advance by deviations.
        force : ndarray, shape (D, A, N), optional
            Forces to begin with, N.
        """
        wanted = np.empty((len(loads), len(self.lines.gap), 1))
        wanted[..., 0].T[:] = loads.T  # faster than to broadcast, which counts where single angles are solved
        pair, rows = self.pair, self.lines.lever[..., None]
        found = no_results(wanted.shape, pair.size, pair.meshed.tooth_pair_count, True, differentiated)
        if force is not None:
            found.force[:] = force
        placed = self.lines, rows, pair.meshes, pair.between_flanks, self.flexibility, deviation
        solve_lines(*placed, wanted, held, COLD if force is None else WARM, found)
        if differentiated:
            differentiate_lines(*placed, found, np.ones(wanted.shape), NO_FORCES, found.sensitivity)
        return found


def new_flexibility(between: FloatArray) -> Flexibility:
    """Return the workspace of sections whose part of low rank, (A, N, N), is given."""
    grid = between.shape[:2]
    return Flexibility(
        between, np.zeros(grid, dtype=bool), NO_FORCES, np.empty((0, 0, 0), dtype=np.int64), np.empty((0, 0, 0, 0)),
        np.empty(0),
    )  # fmt: skip


def meshes_of(pairs: Sequence[LinePair], ahead: FloatArray, share: FloatArray) -> Meshes:
    """Return the pairs of meshes, one after the other, for the kernels; arguments as in `Meshes`."""
    every = [pair.meshed for pair in pairs]
    count = [meshed.tooth_pair_count for meshed in every]
    softness = [pair.meshed.expected_approach(pair.base_radius) for pair in pairs]
    corners = zip(*(meshed.corners for meshed in every), strict=True)
    return Meshes(
        mesh=np.repeat(np.arange(len(pairs)), [pair.size for pair in pairs]),
        tooth_pair=np.repeat(np.arange(sum(count)), np.repeat([len(meshed.width) for meshed in every], count)),
        width=np.concatenate([np.tile(meshed.width, meshed.tooth_pair_count) for meshed in every]),
        ahead=ahead, share=share,
        softness=np.array(softness), corners=Corners(*map(np.concatenate, corners)),
    )  # fmt: skip


def compliance_of(pairs: Sequence[LinePair]) -> Compliance:
    """Return the compliance of meshes, one after the other, without what bodies that they share give way."""
    kinds = list({id(pair): pair for pair in pairs}.values())
    layout, first = np.zeros((len(pairs), LAYOUT), dtype=np.int64), 0
    # On flanks with fewer rows than carry a section the first of these is -1, without a share: before the first block.
    flanks = [flank for kind in kinds for flank in (kind.meshed.pinion, kind.meshed.wheel)]
    few = min(len(flank.roll_angle) for flank in flanks) < ROWS
    before = max(kind.components * (gear.shape[-1] + 1) for kind in kinds for gear in kind.compliance) if few else 0
    start = before + np.cumsum([[0, 0]] + [[gear.size for gear in kind.compliance] for kind in kinds], axis=0)
    for row, pair in zip(layout, pairs, strict=True):
        kind = next(n for n, kind in enumerate(kinds) if kind is pair)
        pinion, wheel = pair.compliance
        row[:] = (
            first, len(pair.meshed.width), len(pinion), start[kind, 0], pinion.shape[-1], start[kind, 1],
            wheel.shape[-1],
        )  # fmt: skip
        first += pair.size
    blocks = [[kind.compliance[gear].reshape(-1) for kind in kinds] for gear in range(2)]
    blocks = [[np.zeros(before), *own] if few else own for own in blocks]
    pinions, wheels = (own[0] if len(own) == 1 else np.concatenate(own) for own in blocks)
    nobody = np.zeros((first, 2), dtype=np.int64)
    return Compliance(
        blocks=(pinions, wheels), layout=layout, mesh=np.repeat(np.arange(len(pairs)), [pair.size for pair in pairs]),
        body=nobody, image=nobody, rank=np.empty(0, dtype=np.int64), teeth=np.empty(0, dtype=np.int64),
        alike=np.empty((0, 0, 0, 0, 0)), backs=np.empty((0, 0, 0, 0, 0)),
    )  # fmt: skip


def on_supports(
    meshed: LayeredPair, supports: tuple[Support | None, Support | None], lines: Lines
) -> tuple[Lines, FloatArray]:
    """Return placed sections on what the gears' bodies and hubs stand on, and the flexibilities that it adds.

    Returns
    -------
    Lines
        Their gaps with what other loads do to the hubs.
    ndarray, shape (A, N, N)
        mm/N.
    """
    if meshed.hubs is None:
        total = np.zeros((*lines.gap.shape, lines.gap.shape[1]))
    else:
        rows = hub_rows(meshed.pair, lines, meshed.sections.z)
        total = rows @ meshed.hubs.compliance @ rows.transpose(0, 2, 1)
        lines = lines._replace(gap=lines.gap + rows @ meshed.hubs.offset)
    if not any(supports):
        return lines, total
    pairs = [lines.first_pair + place for place in range(meshed.tooth_pair_count)]
    gears = meshed.pair.pinion, meshed.pair.wheel
    for gear, (support, sense) in enumerate(zip(supports, (1, -1), strict=True)):
        if support is not None:  # wheel teeth count against tooth pairs
            by_pair = np.split(section_patterns(meshed, lines, gear, support.rows), meshed.tooth_pair_count, axis=1)
            total += support_flexibility(support, abs(gears[gear].teeth), by_pair, [sense * pair for pair in pairs])
    return lines, total


def line_compliance_between(
    meshed: LayeredPair, gears: tuple[FloatArray, FloatArray], components: int
) -> tuple[FloatArray, FloatArray]:
    """Return the compliance between the sections of flanks, with what their layers add to plane strain.

    Parameters
    ----------
    gears, components
        As in `pmor.body.flank_compliance.FlankCompliance`.

    Returns
    -------
    two ndarrays, shape (neighbours + 1, S, S, r c, r c)
        As `section_compliance` returns them.
    """
    found = section_compliance(gears, components, *meshed.carriers)
    if not meshed.free_ends:
        return found
    for gear, between in enumerate(found[: 1 if found[0] is found[1] else 2]):
        added, normals = meshed.layer_coupling[gear], row_normals(meshed, gear, components)
        size = normals.size
        by_rows = 0.5 * (added[:, None] + added)  # rows, rows, sections, sections
        pressed = np.einsum("ri,rqst,qj->striqj", normals, by_rows, normals)
        between[0, :, :, :size, :size] += pressed.reshape(*between.shape[1:3], size, size)
    return found


def row_normals(meshed: LayeredPair, gear: int, components: int) -> FloatArray:
    """Return the normals of the rows of nodes on a spur flank, shape (n, c)."""
    known = meshed.gears[gear]
    angle = known.half_angle - known.roll
    return np.stack([np.cos(angle), np.sin(angle), np.zeros(len(angle))], axis=-1)[:, :components]


def section_patterns(meshed: LayeredPair, lines: Lines, gear: int, patterns: FloatArray) -> FloatArray:
    """Return what unit forces in placed sections are in patterns of forces over a flank of a gear, (A, N, q).

    Parameters
    ----------
    gear : int
        0 the pinion, 1 the wheel.
    patterns : ndarray, shape (n, q)
    """
    (column, share), node_rows = meshed.carriers
    return carried_rows(
        patterns, (column[gear], share[gear]), node_rows[gear], lines.row[..., gear], lines.gradient[:, :, gear]
    )


def no_results(
    grid: tuple[int, ...], size: int, pairs: int = 0, tangent: bool = False, differentiated: bool = False
) -> LineResults:
    """Return empty results of `solve_lines` of `size` sections.

    Parameters
    ----------
    grid : (int, int, int)
        Loads, angles, movements.
    pairs : int
        Tooth pairs whose torques are wanted.
    tangent, differentiated : bool
        Whether the stiffness is wanted, and the sensitivities.
    """
    states = grid[:2]
    return LineResults(
        movement=np.zeros(grid),
        steps=np.zeros(states, dtype=np.int64),
        converged=np.zeros(states, dtype=bool),
        force=np.zeros((*states, size)),
        loose=np.empty(states, dtype=np.int64),
        torque=np.zeros((*states, pairs) if pairs else (0, 0, 0)),
        stiffness=np.zeros((*grid, grid[2]) if tangent else (0, 0, 0, 0)),
        sensitivity=np.zeros((*states, size) if differentiated else (0, 0, 0)),
    )


def joined_results(parts: Sequence[LineResults], axis: int = 1) -> LineResults:
    """Return results of several blocks of angles, or along axis 0 of several loads, as one."""
    return LineResults(*(np.concatenate(arrays, axis=axis) for arrays in zip(*parts, strict=True)))
