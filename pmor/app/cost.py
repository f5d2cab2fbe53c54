"""What a case takes of the computer: peak memory and time of each stage, from sizes alone, before anything is solved.

Memory is counted from the arrays that live at the same time. Times are counted in operations, for one core of
`REFERENCE_FLOPS`; other computers differ. Both were fitted on the cases of `pmor.lab.core.stages`, and hold within a
factor of two there.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

from pmor.case import Case, other_models
from pmor.case.coarser import coarser
from pmor.case.live_page import takes_whole_width
from pmor.case.width import intervals_across, meshed_width, whole_width
from pmor.core.errors import CaseError
from pmor.core.keeping import is_kept
from pmor.core.memory import MemoryLimit, memory_limits, memory_text
from pmor.fe.nested_dissection import UNDIVIDED
from pmor.gear.meshed_pair import LOCAL_SHARE
from pmor.gear.pair import GearPair
from pmor.gear.tooth import Tooth
from pmor.line.kernels.loads import solve_lines
from pmor.line.sections import loaded_components
from pmor.mesh.fillet import MOST_COLUMNS
from pmor.mesh.sector import build_sector
from pmor.pair.conditions import assembly_of, full_solves, misalignments, torques_of, training_values
from pmor.pair.model import approach_estimate, contact_scheme, neighbouring_teeth
from pmor.penalty.kernels.sweep import sweep_reduced
from pmor.penalty.solve import WINDOW_MARGIN

DOUBLE = 8  # bytes
MIB = 2**20
# Measured on Linux with Python 3.11: interpreter and libraries; with those of the solver; with compiled kernels; what a
# page takes on top of that; and all of it while kernels are compiled.
START_BYTES, SOLVER_BYTES, KERNEL_BYTES, PAGE_BYTES, COMPILING_BYTES = (n * MIB for n in (130, 175, 195, 65, 800))
# Of linear and of quadratic elements: unknowns of one; its matrix, and what is left over on the way.
ELEMENT_UNKNOWNS, ELEMENT_BYTES = {1: 24, 2: 60}, {1: 7_000, 2: 40_000}
# Points along a fillet, about; patterns of forces that the stress there takes, over the flank's unknowns.
FILLET_POINTS, PATTERNS = 20, 0.25
# A sweep takes so many times the size of the basis file: read, unpacked, and made ready for the kernels.
UNPACKED = 4
# Addresses that libraries reserve beyond the memory they use, with one thread.
RESERVED_BYTES = 400 * MIB
# Stages that take the same whatever the case.
COMPILING, START = CASELESS = ("compiling kernels, once", "start")
FINITE_ELEMENTS = "finite elements"
# Seconds on the reference computer: a core with this many operations per second on dense matrices.
FLOPS = 13e9
ELEMENT_S, SOLVER_S = {1: 90e-6, 2: 250e-6}, 0.15
FILLET_S = 0.1
FULL_S, FULL_ENTRY_S, POSITION_S = 5e-3, 30e-9, 8e-3
REDUCED_S, REDUCED_MEMBER_S, SWEEP_S = 30e-6, 1.5e-8, 0.2
START_S, BASIS_S, RESULTS_S, PAGE_S = 1.2, 0.6, 0.05, 2.8
# Of line loads with the full FE of line contact, and of trained shapes with that of their scheme.
LINES_COMPILING_S, SHAPES_COMPILING_S = 30.0, 60.0
# Shapes of a line over the width where the axes tilt; states at which a greedy sampling estimates errors, per solve.
TILTED_SHAPES, GREEDY_STATES = 8, 200


@dataclass(frozen=True)
class GearSize:
    """Sizes of a gear's finite elements.

    Parameters
    ----------
    teeth : int
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
    """

    teeth: int
    lines: int
    layers: int
    tooth: tuple[int, int]
    ring: tuple[int, int]
    order: int = 1
    stresses: int = 0

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


def gear_size(case: Case, tooth: Tooth, bore_radius_mm: float, face_width_mm: float) -> GearSize:
    """Return the sizes of a gear's mesh: its transverse section is made, which takes no time, and not its volume.

    Raises
    ------
    GeometryError, MeshError
    """
    mesh = case.mesh
    section = build_sector(tooth, bore_radius_mm, face_width_mm, mesh.profile_elements, 1, mesh.spacing,
                           "plane_strain", order=mesh.order)  # fmt: skip
    blocks = section.tooth_rows, section.ring_rows
    tooth_block, ring_block = ((len(rows), len(rows[0]) // len(section.z)) for rows in blocks)
    layers = intervals_across(case) + 1
    columns = layers if mesh.order == 2 else 2 * layers - 1
    stressed = columns if columns <= MOST_COLUMNS else (columns + 1) // 2
    stresses = 2 * 3 * FILLET_POINTS * stressed if case.root_stress else 0
    return GearSize(tooth.teeth, mesh.profile_intervals + 1, layers, tooth_block, ring_block, mesh.order, stresses)


@dataclass(frozen=True)
class Stage:
    """What a stage of a run takes.

    Parameters
    ----------
    name : str
    memory : int
        Bytes at most, of the whole process.
    seconds : float
        With kernels that are compiled.
    """

    name: str
    memory: int
    seconds: float


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


def _compiling_seconds(cases: Iterable[Case]) -> float:
    by_lines = {case.reduction.shapes == "line_loads" for case in cases}
    lines = LINES_COMPILING_S if True in by_lines and not is_kept(solve_lines) else 0.0
    return lines + (SHAPES_COMPILING_S if False in by_lines and not is_kept(sweep_reduced) else 0.0)


def stages(case: Case, pair: GearPair) -> tuple[Stage, ...]:
    """Return the stages of `pmor run` in their order; where kernels are not compiled yet, that comes first.

    Those of other models that the case compares have their names.

    Raises
    ------
    GeometryError, MeshError
    """
    others, sharing = dict(other_models(case)), sharing_bodies(case)
    seconds = _compiling_seconds((case, *others.values()))
    compiling = (Stage(COMPILING, COMPILING_BYTES, seconds),) if seconds else ()
    *own, report = _stages_of(case, pair)
    held = _held(pair_size(case, pair)) if others else 0
    further = [
        replace(stage, name=f"{stage.name}, {scheme}", memory=stage.memory + held)
        for scheme, other in others.items()
        for stage in _stages_of(other, pair)[:-1]
        if stage.name != FINITE_ELEMENTS or scheme not in sharing
    ]
    return (*compiling, Stage(START, START_BYTES, START_S), *own, *further, report)


def sharing_bodies(case: Case) -> tuple[str, ...]:
    """Return the models that a case compares whose finite elements are solved for the one before them already."""
    found, before = list[str](), case
    for scheme, other in other_models(case):
        without_layer, width = other.contact.kind != "line", meshed_width(before) == meshed_width(other)
        if without_layer and width and other.mesh == before.mesh:
            found.append(scheme)
        before = other
    return tuple(found)


def _stages_of(case: Case, pair: GearPair) -> tuple[Stage, ...]:
    """Stages of one model, from its finite elements on."""
    size = pair_size(case, pair)
    torques = len(case.online.torques_Nm) + sum(len(torques_of(case, condition)) for condition in case.conditions)
    sweep = case.pitches * case.online.angles_per_pitch * torques
    compared = case.compare.angles * len(case.compare.torques_Nm)
    # Not all that the finite elements took in small pieces goes back to the system.
    kept = _held(size) + max(ELEMENT_BYTES[gear.order] // 3 * gear.elements for gear in size.gears)
    basis = _basis(size)
    training = kept + 2 * basis + size.solves * size.pairs * 3 * size.flank * 2 * DOUBLE
    reduced = 1.0 + size.active_shapes
    full_s, reduced_s = FULL_S + FULL_ENTRY_S * size.window**2, REDUCED_S + REDUCED_MEMBER_S * reduced**2.2
    online = kept + 2 * basis
    searched = GREEDY_STATES * size.solves if case.offline.sampling == "greedy" else 0
    coarse = coarser(case)
    coarse_size = pair_size(coarse, pair) if coarse else None
    if coarse_size:
        training = max(training, kept + SOLVER_BYTES + _largest(coarse_size))
    coarse_s = sum(map(_solving_seconds, coarse_size.gears)) if coarse_size else 0.0
    trained_s = coarse_s + size.solves * full_s + size.positions * POSITION_S + searched * reduced_s + BASIS_S
    drawn = set(case.output.format if case.output.plots else ())
    drawn |= {case.output.shown_as} if case.output.report else set()
    whole_size = pair_size(whole_width(case), pair) if takes_whole_width(case) else None
    page = max(PAGE_BYTES * bool(drawn), SOLVER_BYTES - KERNEL_BYTES + _largest(whole_size) if whole_size else 0)
    whole_s = sum(map(_solving_seconds, whole_size.gears)) if whole_size else 0.0
    return (
        Stage(FINITE_ELEMENTS, SOLVER_BYTES + _largest(size), sum(map(_solving_seconds, size.gears)) + SOLVER_S),
        Stage("training", KERNEL_BYTES + training, trained_s),
        Stage("sweep", KERNEL_BYTES + online, sweep * reduced_s + SWEEP_S),
        Stage("comparison", KERNEL_BYTES + online + 3 * DOUBLE * size.window**2, compared * (full_s + reduced_s)),
        Stage("report", KERNEL_BYTES + online + page, RESULTS_S + whole_s + PAGE_S * len(drawn)),
    )


def refuse_beyond_memory(case: Case, found: tuple[Stage, ...], limits: Sequence[MemoryLimit] | None = None) -> None:
    """Raise CaseError when a stage takes more memory than there is.

    Parameters
    ----------
    case : Case
    found : tuple of Stage
    limits : sequence of MemoryLimit, optional
        Those on this process by default.
    """
    largest, mesh = max(found, key=lambda stage: stage.memory), case.mesh
    smaller = f", or lower [mesh] profile_elements = {mesh.profile_elements} or width_elements = {mesh.width_elements}"
    _refuse(f"{case.name}: {largest.name}", largest.memory, smaller * (largest.name not in CASELESS), limits)


def refuse_large_basis(path: Path, limits: Sequence[MemoryLimit] | None = None) -> None:
    """Raise CaseError when a sweep with a basis file takes more memory than there is; a missing file is no matter."""
    if path.is_file():
        _refuse(str(path), KERNEL_BYTES + UNPACKED * path.stat().st_size, ", or train with fewer elements", limits)


def _refuse(what: str, memory: int, smaller: str, limits: Sequence[MemoryLimit] | None) -> None:
    for limit in memory_limits() if limits is None else limits:
        needed = memory + RESERVED_BYTES * limit.of_addresses
        if needed > limit.size:
            raise CaseError(
                f"{what}: takes about {memory_text(needed)} of {'addresses' if limit.of_addresses else 'memory'}, and "
                f"{limit.source} {memory_text(limit.size)}: {limit.remedy}{smaller}"
            )


def pair_size(case: Case, pair: GearPair) -> PairSize:
    """Return the sizes of a case; nothing is meshed but transverse sections.

    Raises
    ------
    GeometryError, MeshError
    """
    both = [
        gear_size(case, tooth, gear.bore_radius_mm, case.pair.face_width_mm)
        for tooth, gear in ((pair.pinion, case.pair.pinion), (pair.wheel, case.pair.wheel))
    ]
    alike = case.mesh.share_identical and pair.pinion == pair.wheel and case.pair.pinion == case.pair.wheel
    gear, rows, solves = both[0], rows_in_contact(case, pair), full_solves(case)
    pairs = math.floor(pair.total_contact_ratio + 1.0) + 1
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
        tuple(both[:1] if alike else both), neighbouring_teeth(pair), pairs, rows, positions if solves else 0, solves,
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


def _solving(gear: GearSize, neighbours: int) -> int:
    """Bytes while a gear is condensed and the ring is closed."""
    flank, side, across = gear.known * gear.flank, gear.known * gear.side, _across(gear)
    rest, elements = flank + 2 * side, ELEMENT_BYTES[gear.order] * gear.elements
    fronts = (across + rest) ** 2 + (across + flank) ** 2 + (across + 2 * side) ** 2
    ring = 2 * rest**2 + (neighbours + 8) * side**2 + 8 * side * flank + (6 * neighbours + 6) * gear.flank**2
    stresses = 3 * gear.stresses * (rest + gear.flank)
    return int(max(elements + DOUBLE * fronts, DOUBLE * (ring + stresses)))


def _kept(gear: GearSize, neighbours: int) -> int:
    """Bytes of a gear's model: compliance, condensed stiffness, surface layer."""
    flank, side = gear.known * gear.flank, gear.known * gear.side
    stresses = 3 * gear.stresses * gear.flank
    return int(DOUBLE * ((2 * neighbours + 2) * gear.flank**2 + (flank + 2 * side) ** 2 + stresses))


def _held(size: PairSize) -> int:
    """Bytes of the models of the gears that finite elements are solved for."""
    return sum(_kept(gear, size.neighbours) for gear in size.gears)


def _largest(size: PairSize) -> int:
    """Bytes while the gears are solved one after the other."""
    solving = [_solving(gear, size.neighbours) for gear in size.gears]
    before = [0, _kept(size.gears[0], size.neighbours)]
    return max(a + b for a, b in zip(solving, before, strict=False))


def _basis(size: PairSize) -> int:
    """Bytes of a basis: displacements of the shapes, their products, compliance for the error estimate."""
    teeth, loaded = 2 * size.neighbours + 1, size.flank * size.components // 3
    shapes = 2 * teeth * size.shapes * (size.flank + size.shapes)
    stresses = int(PATTERNS * loaded) * sum(3 * gear.stresses + loaded for gear in size.gears if gear.stresses)
    return DOUBLE * (shapes + len(size.gears) * (size.neighbours + 1) * loaded**2 + stresses)


def _solving_seconds(gear: GearSize) -> float:
    """Time of a gear's finite elements: the eliminations, the harmonics of the ring, its compliance."""
    flank, side = gear.known * gear.flank, gear.known * gear.side
    (tooth_rows, tooth_columns), (ring_rows, ring_columns) = (
        tuple((count - 1) // gear.order for count in block) for block in (gear.tooth, gear.ring)
    )
    layers = (gear.layers - 1) // gear.order
    # The tooth goes on into the ring and ends at its flank, the ring at its side faces; the bore is held.
    total = _dissection((tooth_rows, tooth_columns, layers), (True, False, True, False, False, False), gear.order)
    total += _dissection((ring_rows, ring_columns, layers), (False, True, True, True, False, False), gear.order)
    total += _elimination(_across(gear), flank + 2 * side)
    total += 3.0 * flank**3 + 20.0 * side * flank**2 + 30.0 * side**2 * flank + gear.teeth / 2.0 * side**3
    # The stresses are carried through the elimination, and then over to the forces on three teeth.
    total += 12.0 * gear.stresses * (flank + 2 * side) * flank
    return total / FLOPS + ELEMENT_S[gear.order] * gear.elements + (FILLET_S if gear.stresses else 0.0)


def _across(gear: GearSize) -> float:
    """Unknowns of the face that tooth and ring share."""
    return 3 * gear.known * gear.layers * gear.tooth[1]


@cache
def _dissection(sizes: tuple[int, ...], shared: tuple[bool, ...], order: int) -> float:
    """Operations that eliminate what is inside a block of elements, as `pmor.fe.nested_dissection` divides it.

    `sizes` are its elements along each axis, `shared` tells which of its six faces (two to an axis) others share.
    """
    faces = [_face(sizes, axis, order) for axis in range(3)]
    border = sum(faces[face // 2] for face in range(6) if shared[face])
    if math.prod(sizes) * ELEMENT_UNKNOWNS[order] <= UNDIVIDED:
        every = 3.0 * _nodes(sizes, order)
        return _elimination(max(every - border, 0.0), min(border, every))
    axis = max(range(3), key=lambda i: sizes[i])
    total = _elimination(faces[axis], border)
    for half, end in ((sizes[axis] // 2, 1), (sizes[axis] - sizes[axis] // 2, 0)):
        cut = tuple(half if i == axis else size for i, size in enumerate(sizes))
        total += _dissection(cut, tuple(s or face == 2 * axis + end for face, s in enumerate(shared)), order)
    return total


def _face(sizes: tuple[int, ...], axis: int, order: int) -> float:
    """Unknowns of a face of a block of elements across an axis."""
    p, q = (size for i, size in enumerate(sizes) if i != axis)
    return 3.0 * ((order * p + 1) * (order * q + 1) - (order - 1) * p * q)


def _nodes(sizes: tuple[int, ...], order: int) -> float:
    """Nodes of a block of elements: quadratic ones have some on each edge, those of linear ones are the corners."""
    corners = math.prod(size + 1 for size in sizes)
    edges = sum(size * corners / (size + 1) for size in sizes)
    return corners + (order - 1) * edges


def _elimination(front: float, rest: float) -> float:
    """Operations that eliminate a front which is coupled to the rest."""
    return front**3 / 3.0 + front**2 * rest + front * rest**2
