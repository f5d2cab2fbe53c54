"""Peak memory and time of each stage of a case, from sizes alone, before anything is solved.

Front doors refuse with it (`refuse_beyond_memory`, `meshed_within_memory`) before anything is meshed. Both are counted
from sizes (`pmor.work.sizes`, `pmor.work.finite_element_cost`).
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from pmor.case import Case, other_models
from pmor.case.models import coarser
from pmor.case.width import case_of_page, meshed_width, takes_whole_width
from pmor.core.errors import InsufficientMemoryError
from pmor.core.keeping import is_kept
from pmor.core.memory import MemoryLimit, memory_limits, memory_text
from pmor.core.progress import format_time
from pmor.gear.meshed_pair import MeshedPair
from pmor.gear.pair import GearPair
from pmor.line.kernels.loads import solve_lines
from pmor.pair.conditions import torques_of
from pmor.pair.limits import range_warnings
from pmor.pair.model import MeshModel, approach_estimate, gear_pair, mesh_model
from pmor.penalty.kernels.sweep import sweep_reduced
from pmor.work.finite_element_cost import DOUBLE, ELEMENT_BYTES, held_bytes, solving_bytes, solving_seconds
from pmor.work.sizes import PairSize, pair_size

_LOG = logging.getLogger("pmor")
MIB = 2**20
# Measured on Linux with Python 3.11: interpreter and libraries; with those of the solver; with compiled kernels; a page
# on top of that; and all of it while kernels are compiled.
START_BYTES, SOLVER_BYTES, KERNEL_BYTES, PAGE_BYTES, COMPILING_BYTES = (n * MIB for n in (155, 175, 240, 40, 800))
# Patterns of forces that the stress along the fillets takes, over the flank's unknowns.
PATTERNS = 0.25
# Measured in sweeps: of a position, a tooth pair in it, a recorded section in it; of a torque, an assembly.
POSITION_BYTES, PAIR_BYTES, SECTION_BYTES, TORQUE_BYTES, ASSEMBLY_BYTES = 100, 32, 200, 1_000, 12_000
# Smaller sweeps fit wherever the libraries do: the limits of the system are not looked up.
SMALL_BYTES = 64 * MIB
# A sweep takes so many times the size of the basis file: read, unpacked, and made ready for the kernels.
UNPACKED = 4
# Addresses that libraries reserve beyond the memory they use, with one thread.
RESERVED_BYTES = 400 * MIB
# Stages that take the same whatever the case.
COMPILING, START = CASELESS = ("compiling kernels, once", "start")
FINITE_ELEMENTS = "finite elements"
# Seconds on the reference computer (`pmor.work.finite_element_cost.FLOPS`).
SOLVER_S = 0.15
FULL_S, FULL_ENTRY_S, POSITION_S = 5e-3, 30e-9, 8e-3
# Full FE of line contact, over the square of the unknowns of a flank: of a position, and so many more before the first.
# What is read off line loads beside the sweep, and of each pair that tolerances draw.
LINE_ENTRY_S, LINE_START, READINGS_S, DRAWN_S = 1.1e-7, 6, 1.4, 6e-3
REDUCED_S, REDUCED_MEMBER_S, SWEEP_S = 30e-6, 1.5e-8, 0.2
START_S, BASIS_S, RESULTS_S, PICTURES_S, PAGE_S = 1.3, 0.7, 0.3, 3.2, 0.4
# Of line loads with the full FE of line contact, and of trained shapes with that of their scheme.
LINES_COMPILING_S, SHAPES_COMPILING_S = 30.0, 60.0
# States at which a greedy sampling estimates errors, per solve.
GREEDY_STATES = 200


@dataclass(frozen=True)
class Stage:
    """Peak memory and time of a stage of a run.

    Parameters
    ----------
    memory : int
        Bytes at most, of the whole process.
    seconds : float
        With kernels that are compiled.
    """

    name: str
    memory: int
    seconds: float


@dataclass(frozen=True)
class Plan:
    """What `pmor plan` tells of a file.

    Parameters
    ----------
    parts : callable
        Gives the parts of its text, one by one: the first ones stand where there is too little memory for the others.
    seconds : mapping of str to float
        Of one core, by the names of the commands that answer the file; without bodies that are kept.
    compiling_s : float
        Beside these, once: of kernels that are not compiled yet.
    """

    parts: Callable[[], Iterable[str]]
    seconds: Mapping[str, float]
    compiling_s: float

    @property
    def text(self) -> str:
        """All parts."""
        return "\n\n".join(self.parts())


def whole(found: Sequence[Stage]) -> Stage:
    """Return all stages as one."""
    return Stage("in all", max(one.memory for one in found), sum(one.seconds for one in found))


def seconds_of(found: Iterable[Stage], *names: str) -> float:
    """Return the time of stages whose names begin with one of these; by default of all but the one that compiles."""
    return sum(one.seconds for one in found if (one.name.startswith(names) if names else one.name != COMPILING))


def compiling_seconds(cases: Iterable[Case] = ()) -> float:
    """Return the time in which kernels are compiled that are not kept yet, of line loads by default, s."""
    by_lines = {case.reduction.shapes == "line_loads" for case in cases} or {True}
    lines = LINES_COMPILING_S if True in by_lines and not is_kept(solve_lines) else 0.0
    return lines + (SHAPES_COMPILING_S if False in by_lines and not is_kept(sweep_reduced) else 0.0)


def body_seconds(case: Case) -> float:
    """Return the time of the finite elements of a case, s, and of half as many for its error bar."""
    pair, cases = gear_pair(case), [one for one in (case, coarser(case)) if one is not None]
    return sum(solving_seconds(pair_size(one, pair)) + SOLVER_S for one in cases)


def drawn_seconds(case: Case, angles: int, torques: int, position: float) -> float:
    """Return the time of the pairs that the tolerances of a case draw, each position of so many seconds."""
    said, teeth = case.tolerances, (case.pair.pinion.teeth, abs(case.pair.wheel.teeth))
    if said is None:
        return 0.0
    pitches = max(case.pitches, max(teeth) if said.of_teeth else 1)
    return said.samples * (DRAWN_S + pitches * angles * torques * position)


def stages(case: Case) -> tuple[Stage, ...]:
    """Return the stages of `pmor run` in their order; where kernels are not compiled yet, that comes first.

    GeometryError or MeshError where there is no such pair or mesh.

    Those of other models that the case compares have their names.
    """
    pair, others, sharing = gear_pair(case), dict(other_models(case)), sharing_bodies(case)
    seconds = compiling_seconds((case, *others.values()))
    compiling = (Stage(COMPILING, COMPILING_BYTES, seconds),) if seconds else ()
    *own, pictures, report = _stages_of(case, pair)
    held = held_bytes(pair_size(case, pair)) if others else 0
    further = [
        replace(stage, name=f"{stage.name}, {scheme}", memory=stage.memory + held)
        for scheme, other in others.items()
        for stage in _stages_of(other, pair)[:-2]
        if stage.name != FINITE_ELEMENTS or scheme not in sharing
    ]
    return (*compiling, Stage(START, START_BYTES, START_S), *own, *further, pictures, report)


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
    sweep = case.pitches * case.online.angles_per_pitch * _swept_torques(case)
    compared = case.compare.angles * len(case.compare.torques_Nm)
    # Not all that the finite elements took in small pieces goes back to the system.
    kept = held_bytes(size) + max(ELEMENT_BYTES[gear.order] // 3 * gear.elements for gear in size.gears)
    basis = _basis(size)
    training = kept + 2 * basis + size.solves * size.pairs * 3 * size.flank * 2 * DOUBLE
    reduced = 1.0 + size.active_shapes
    full_s, reduced_s = FULL_S + FULL_ENTRY_S * size.window**2, REDUCED_S + REDUCED_MEMBER_S * reduced**2.2
    solved, window, read_s, online = compared * full_s, 3 * DOUBLE * size.window**2, 0.0, kept + 2 * basis
    if case.contact.kind == "line":
        solved, window = (compared + LINE_START) * LINE_ENTRY_S * size.flank**2, 0
        read_s, online = READINGS_S, kept + UNPACKED * basis
    read_s += drawn_seconds(case, case.online.angles_per_pitch, len(case.online.torques_Nm), reduced_s)
    online += _sweep_bytes(sweep, size.pairs)
    searched = GREEDY_STATES * size.solves if case.offline.sampling == "greedy" else 0
    coarse = coarser(case)
    coarse_size = pair_size(coarse, pair) if coarse else None
    if coarse_size:
        training = max(training, kept + solving_bytes(coarse_size))
    coarse_s = solving_seconds(coarse_size) if coarse_size else 0.0
    trained_s = coarse_s + size.solves * full_s + size.positions * POSITION_S + searched * reduced_s + BASIS_S
    paged = case.output.report or case.output.plots
    by_matplotlib = set(case.output.format if case.output.plots else ()) - {"svg"}
    whole_size = pair_size(case_of_page(case), pair) if takes_whole_width(case) else None
    if whole_size:
        training = max(training, kept + basis + solving_bytes(whole_size))
        trained_s += solving_seconds(whole_size)
    page = PAGE_BYTES * paged
    return (
        Stage(FINITE_ELEMENTS, SOLVER_BYTES + solving_bytes(size), solving_seconds(size) + SOLVER_S),
        Stage("training", KERNEL_BYTES + training, trained_s),
        Stage("sweep", KERNEL_BYTES + online, sweep * reduced_s + SWEEP_S + read_s + RESULTS_S),
        Stage("comparison", KERNEL_BYTES + online + window, solved + compared * reduced_s),
        Stage("pictures", KERNEL_BYTES + online + page, PICTURES_S * len(by_matplotlib)),
        Stage("report", KERNEL_BYTES + online + page, PAGE_S * paged),
    )


def refuse_beyond_memory(case: Case, limits: Sequence[MemoryLimit] | None = None) -> None:
    """Refuse a case when a stage of its run takes more memory than there is.

    Parameters
    ----------
    limits : sequence of MemoryLimit, optional
        Those on this process by default.

    Raises
    ------
    CaseError
        With the stage, the memory it takes, the limit, and what to do.
    GeometryError, MeshError
    """
    largest, mesh = max(stages(case), key=lambda stage: stage.memory), case.mesh
    smaller = f", or lower [mesh] profile_elements = {mesh.profile_elements} or width_elements = {mesh.width_elements}"
    _refuse(f"{case.name}: {largest.name}", largest.memory, smaller * (largest.name not in CASELESS), limits)


def meshed_within_memory(case: Case) -> MeshModel:
    """Mesh both gears of a case that fits into memory: front doors mesh by this alone; the log warns of unusual pairs.

    Raises
    ------
    CaseError, GeometryError, MeshError
        As `refuse_beyond_memory` and `pmor.pair.model.mesh_model`.
    """
    refuse_beyond_memory(case)
    mesh = mesh_model(case)
    pair = mesh.meshed.pair
    for warning in range_warnings(case, pair, approach_estimate(case, pair)):
        _LOG.warning("%s", warning)
    return mesh


def refuse_large_sweep(
    name: str, meshed: MeshedPair, angles: int, torques: int, assemblies: int = 1, sections: int = 0
) -> None:
    """Raise CaseError when a sweep takes more memory than there is.

    Parameters
    ----------
    name : str
        Of the case.
    angles, torques, assemblies : int
        Their numbers.
    sections : int
        Recorded in each position.
    """
    memory = assemblies * (ASSEMBLY_BYTES + torques * TORQUE_BYTES)
    memory += assemblies * _sweep_bytes(angles * torques, meshed.tooth_pair_count, sections)
    if memory > SMALL_BYTES:
        times = f"{angles} angles x {torques} torques" + f" x {assemblies} assemblies" * (assemblies > 1)
        _refuse(f"{name}: a sweep of {times}", KERNEL_BYTES + memory, ", or sweep fewer at a time")


def refuse_large_sweep_of(case: Case, meshed: MeshedPair) -> None:
    """Raise CaseError when the sweep of a case, with its conditions, takes more memory than there is."""
    refuse_large_sweep(case.name, meshed, case.pitches * case.online.angles_per_pitch, _swept_torques(case))


def _swept_torques(case: Case) -> int:
    return len(case.online.torques_Nm) + sum(len(torques_of(case, condition)) for condition in case.conditions)


def plan_texts(*parts: Iterable[str]) -> Iterator[str]:
    """Yield the parts of a plan, each of lines, that have any."""
    return (text for lines in parts if (text := "\n".join(lines)))


def stage_lines(every: Sequence[Stage], more: str = "") -> list[str]:
    """Return what a plan says of stages, and of all of them."""
    lines = [f"Stages: peak memory and time of one core, within a factor of two{more}"]
    rows = ((stage.name, memory_text(stage.memory), format_time(stage.seconds)) for stage in (*every, whole(every)))
    return [*lines, *(f"  {name:<34} {memory:>8}  {seconds:>12}" for name, memory, seconds in rows)]


def left_out_lines(rows: Iterable[tuple[str, str]]) -> list[str]:
    """Return what a plan says is left out: what, and why."""
    return ["Left out: what, because", *(f"  {what:<34} {why}" for what, why in rows)]


def _sweep_bytes(positions: int, pairs: int, sections: int = 0) -> int:
    return positions * (POSITION_BYTES + PAIR_BYTES * pairs + SECTION_BYTES * sections)


def refuse_large_basis(path: Path) -> None:
    """Raise CaseError when a sweep with a basis file takes more memory than there is; a missing file is no matter."""
    if path.is_file():
        _refuse(str(path), KERNEL_BYTES + UNPACKED * path.stat().st_size, ", or train with fewer elements")


def _refuse(what: str, memory: int, smaller: str, limits: Sequence[MemoryLimit] | None = None) -> None:
    for limit in memory_limits() if limits is None else limits:
        needed = memory + RESERVED_BYTES * limit.of_addresses
        if needed > limit.size:
            raise InsufficientMemoryError(
                f"{what}: takes about {memory_text(needed)} of {'addresses' if limit.of_addresses else 'memory'}, and "
                f"{limit.source} {memory_text(limit.size)}: {limit.remedy}{smaller}"
            )


def loaded_bytes(case: Case) -> int:
    """Bytes of the basis of a case once it is read, unpacked, and made ready for sweeps."""
    return UNPACKED * _basis(pair_size(case, gear_pair(case)))


def _basis(size: PairSize) -> int:
    """Bytes of a basis: displacements of the shapes, their products, compliance for the error estimate."""
    teeth, loaded = 2 * size.neighbours + 1, size.flank * size.components // 3
    shapes = 2 * teeth * size.shapes * (size.flank + size.shapes)
    stresses = int(PATTERNS * loaded) * sum(3 * gear.stresses + loaded for gear in size.gears if gear.stresses)
    return DOUBLE * (shapes + len(size.gears) * (size.neighbours + 1) * loaded**2 + stresses)
