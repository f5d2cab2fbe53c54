"""Sizes of a case: unknowns of its meshes, shapes, solves; nothing is meshed but transverse sections."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from pmor.case import Case
from pmor.case.width import intervals_across
from pmor.fe.fillet import MOST_COLUMNS
from pmor.fe.sector import build_sector
from pmor.gear.pair import GearPair
from pmor.gear.tooth import Tooth
from pmor.line.sections import loaded_components
from pmor.pair.blank import blank_below
from pmor.pair.conditions import assembly_of, full_solves, misalignments, training_values
from pmor.pair.model import approach_estimate, contact_scheme, sector_ends, sector_meshes
from pmor.penalty.pair import LOCAL_SHARE
from pmor.penalty.solve import WINDOW_MARGIN

# Points along a fillet, about.
FILLET_POINTS = 20
# Shapes of a line over the width where the axes tilt.
TILTED_SHAPES = 8


@dataclass(frozen=True)
class BlankSize:
    """Sizes of what a ring of sectors stands on.

    Parameters
    ----------
    largest : int
        Harmonics of the interface go from minus it to it.
    blocks : tuple of (int, int)
        Rows and columns of elements of hub, web and rim.
    interface : int
        Unknowns of a sector's interface.
    holes : (int, int, int)
        Amplitudes that feel holes, unknowns of the circles and of a side of a sector of the web; 0 without.
    """

    largest: int
    blocks: tuple[tuple[int, int], ...]
    interface: int
    holes: tuple[int, int, int] = (0, 0, 0)


@dataclass(frozen=True)
class GearSize:
    """Sizes of a gear's finite elements.

    Parameters
    ----------
    lines : int
        Rows of nodes on the flank, from the start of the involute to the tip.
    layers : int
        Columns of nodes over the face width, as far as it is meshed.
    tooth, ring : two int
        Rows and columns of nodes of the two blocks of a transverse section.
    order : int
        Intervals between nodes along the edge of an element.
    stresses : int
        Along both fillets, of all columns; 0 where they are not asked for.
    blank : BlankSize or None
        Of a gear whose sectors end in its rim.
    """

    teeth: int
    lines: int
    layers: int
    tooth: tuple[int, int]
    ring: tuple[int, int]
    order: int = 1
    stresses: int = 0
    blank: BlankSize | None = None

    @property
    def flank(self) -> int:
        """Unknowns of a flank."""
        return 3 * self.lines * self.layers

    @property
    def side(self) -> int:
        """Unknowns of a side face without the bore."""
        return 3 * self.layers * (self.ring[0] - 1)

    @property
    def elements(self) -> int:
        """Elements of a sector."""
        blocks = (self.tooth, self.ring)
        cells = sum((rows - 1) * (columns - 1) for rows, columns in blocks) * (self.layers - 1)
        return cells // self.order**3

    @property
    def known(self) -> float:
        """Share of a surface's nodes that elements have: quadratic ones have none in the middle of their faces."""
        return 1.0 if self.order == 1 else 0.75


def gear_size(case: Case, tooth: Tooth, end_mm: float, face_width_mm: float) -> GearSize:
    """Return the sizes of a gear's mesh: its transverse section is made, which takes no time, and not its volume.

    GeometryError or MeshError where there is no such gear.
    """
    mesh = case.mesh
    section = build_sector(tooth, end_mm, face_width_mm, mesh.profile_elements, 1, mesh.spacing,
                           "plane_strain", order=mesh.order)  # fmt: skip
    blocks = section.tooth_rows, section.ring_rows
    tooth_block, ring_block = ((len(rows), len(rows[0]) // len(section.z)) for rows in blocks)
    layers = intervals_across(case) + 1
    columns = layers if mesh.order == 2 else 2 * layers - 1
    stressed = columns if columns <= MOST_COLUMNS else (columns + 1) // 2
    stresses = 2 * 3 * FILLET_POINTS * stressed if case.root_stress else 0
    return GearSize(abs(tooth.teeth), mesh.profile_intervals + 1, layers, tooth_block, ring_block, mesh.order, stresses)


def blank_sizes(case: Case, pair: GearPair) -> list[BlankSize | None]:
    """Return the sizes of the blanks by dimensions of pinion and wheel, whose sectors are meshed; None of others."""
    if not any(case.pair.blanks):
        return [None, None]
    found = list[BlankSize | None]()
    gears = zip((case.pair.pinion, case.pair.wheel), (pair.pinion, pair.wheel), sector_meshes(case, pair), strict=True)
    for place, (gear, tooth, mesh) in enumerate(gears):
        light = gear.light_blank(case.pair.face_width_mm) is not None
        blank = blank_below(case, gear, tooth, mesh, place) if light else None
        if blank is None:
            found.append(None)
            continue
        blocks = tuple((len(block.radii) - 1, block.z.shape[-1] - 1) for block in blank.blocks)
        holes = (0, 0, 0) if blank.web is None else blank.web.unknowns()
        found.append(BlankSize(blank.largest, blocks, 3 * len(mesh.interface), holes))
    return found


@dataclass(frozen=True)
class PairSize:
    """Sizes of a case.

    Parameters
    ----------
    gears : tuple of GearSize
        Those that finite elements are solved for: one where the gears are identical.
    neighbours : int
        Neighbouring teeth on either side that the compliance covers.
    pairs : int
        Tooth pairs that can touch at a time.
    rows : int
        Rows of elements of a flank that contact reaches.
    positions, solves : int
        Pinion angles of the training, and full solves in all.
    shapes : int
        Shapes of a flank in the basis.
    active_shapes : int
        Those of them within range of contact.
    components : int
        Of the contact forces, in the compliance that line loads and the error estimate keep; 0 without either.
    """

    gears: tuple[GearSize, ...]
    neighbours: int
    pairs: int
    rows: int
    positions: int
    solves: int
    shapes: int
    active_shapes: int
    components: int

    @property
    def flank(self) -> int:
        """Unknowns of a flank, of the gear with more."""
        return max(gear.flank for gear in self.gears)

    @property
    def window(self) -> int:
        """Unknowns of all parts of flanks that contact reaches at a position."""
        return 2 * self.pairs * self.flank * min(self.rows + 1, self.gears[0].lines) // self.gears[0].lines


def pair_size(case: Case, pair: GearPair) -> PairSize:
    """Return the sizes of a case; nothing is meshed but transverse sections.

    GeometryError or MeshError where there is no such pair or mesh.
    """
    both = [
        replace(gear_size(case, tooth, end, case.pair.face_width_mm), blank=blank)
        for tooth, end, blank in zip(
            (pair.pinion, pair.wheel), sector_ends(case, pair), blank_sizes(case, pair), strict=True
        )
    ]
    alike = case.mesh.share_identical and pair.pinion == pair.wheel and case.pair.pinion == case.pair.wheel
    alike = alike and not any(case.pair.holes)
    gear, rows, solves = both[0], rows_in_contact(case, pair), full_solves(case)
    pairs = pair.most_touching_pairs
    per_line = 1
    if case.reduction.shapes == "static_modes":
        per_line = 2 * gear.layers
    elif any(len(values) > 1 for values in training_values(case.offline)[:-1]):
        per_line = min(TILTED_SHAPES, gear.layers)
    shapes, active_shapes = per_line * gear.lines, 2 * pairs * per_line * (rows + 1)
    if not case.reduction.by_line:
        per_position = max(len(case.offline.torques_Nm) * misalignments(case), 1)
        shapes = math.ceil(2.5 * case.offline.angles_per_pitch) * per_position
        active_shapes = 2 * pairs * per_position
    if case.reduction.shapes == "line_loads":
        shapes, active_shapes = 0, 2 * gear.layers  # as many sections carry on two tooth pairs
    positions = case.offline.angles_per_pitch if case.offline.sampling == "grid" else solves
    kept = case.reduction.error_estimate or case.reduction.shapes == "line_loads"
    components = loaded_components(case.contact.kind != "nodal", case.pair.helix_angle_deg != 0.0) if kept else 0
    return PairSize(
        tuple(both[:1] if alike else both), pair.neighbouring_teeth, pairs, rows, positions if solves else 0, solves,
        shapes, active_shapes, components,
    )  # fmt: skip


def rows_in_contact(case: Case, pair: GearPair) -> int:
    """Return about how many element rows of a flank contact can touch under the nominal load."""
    first, last = pair.pinion.form_roll_angle, pair.pinion.tip_roll_angle
    row = 0.5 * pair.pinion.base_radius * (last**2 - first**2) / case.mesh.profile_intervals
    local = 1.0 if case.contact.scheme == "facet" else LOCAL_SHARE
    # Line contact is on the line of action; points need a row on either side.
    spacing = 0.0 if case.contact.scheme == "line" else 1.5 * row / contact_scheme(case).lodm_profile
    depth = WINDOW_MARGIN * approach_estimate(case, pair) + assembly_of(case).spread
    half = math.sqrt(2.0 * local * depth * pair.pitch_point_radius)
    # An inclined line of contact crosses as many rows as its ends are apart on the profile.
    turn = abs(pair.pinion.twist_per_length) * pair.common_width
    inclined = turn * pair.pinion.base_radius * math.tan(pair.working_pressure_angle)
    return min(case.mesh.profile_intervals, math.ceil((2.0 * max(half, spacing) + inclined) / row) + 1)
