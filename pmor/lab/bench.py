"""Run time by phase and by size: what a position of the reduced model costs, and where the offline time goes."""

from __future__ import annotations

import json
import math
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from pmor.body.elastic_gear import elastic_gear
from pmor.case import Case, change_case, without_models
from pmor.core.progress import Progress
from pmor.core.threads import threads
from pmor.fe.condensation import condense_sector, sector_stiffness
from pmor.gear.condition import ALIGNED, Assembly
from pmor.gear.modification import Modification
from pmor.jobs.offline import run_offline
from pmor.lab.core.stages import measure_stages
from pmor.lab.core.timing import ms_per_position, times_in_turn
from pmor.lab.phases import PHASES, repeat_phase
from pmor.line.layered_pair import layers_of
from pmor.pair.conditions import conditions_of, nominal_condition
from pmor.pair.model import elastic_model, neighbouring_teeth
from pmor.penalty.kernels.newton import solve_state
from pmor.penalty.kernels.state import Load
from pmor.penalty.kernels.sweep import place_position
from pmor.penalty.pair import as_penalty
from pmor.penalty.solve import window_depth
from pmor.report.data_files import write_summary_json
from pmor.report.markdown import write_markdown
from pmor.report.provenance import machine
from pmor.report.table import Table
from pmor.results.load_distribution import effective_contact_ratio, face_load_factor, line_states
from pmor.results.sweep import SteSweep
from pmor.storage.basis_file import read_basis
from pmor.work.cost import meshed_within_memory, stages
from pmor.work.table import Columns, table, text_lines
from pmor_online.conditions import sweep_assemblies
from pmor_online.errors import estimate_errors
from pmor_online.model import ReducedPair, online_angles, reduced_pair
from pmor_online.readings import derivatives, flank_maps, forces_on_gears, harris_sweep
from pmor_online.sweep import TOLERANCE, largest_size, sweep_pair, sweep_reduced_pair

REPEATS = 15
ANGLES = 200  # a full pitch
# Online cost does not depend on how densely the basis was trained: few angles keep the benchmark short.
TRAINING_ANGLES = 12
PHASE_LOOPS = 300
# Angles, and torques, of the sweep that is shared out between threads.
SWEEP_SIDE = 100
# Of line loads: how far axes are tilted, what helix the pair gets, and a sweep over modifications.
TILT_UM, HELIX_DEG = 20.0, 20.0
RELIEFS, RELIEF_ANGLES, RELIEF_LOADS = 1000, 32, (0.5, 1.0, 1.5)
# Of the sweep that results are read off.
READ_ANGLES, READ_REPEATS = 200, 9

Row = dict[str, Any]


@dataclass(frozen=True)
class Variant:
    """A case whose reduced model is timed."""

    label: str
    case: Case


def variants(case: Case) -> list[Variant]:
    """Return the case itself and its neighbours in mesh, scheme, refinement and family of shapes."""
    listed = [Variant("case", _changed(case))]
    for n in (4, 8, 16, 32):
        changed = _changed(case, mesh={"profile_elements": n}, contact={"scheme": "line"})
        listed.append(Variant("elements over the profile", changed))
    for n, lodm in ((4, 8), (8, 4), (16, 2), (32, 1)):
        changed = _changed(case, mesh={"profile_elements": n}, contact={"scheme": "direct", "lodm_profile": lodm})
        listed.append(Variant("elements x LoDM = 32", changed))
    for lodm in (1, 2, 4, 8):
        changed = _changed(case, contact={"scheme": "direct", "lodm_profile": lodm})
        listed.append(Variant("LoDM over the profile", changed))
    both = {"scheme": "direct", "lodm_profile": 4, "lodm_width": 4}
    listed.append(Variant("LoDM over both", _changed(case, contact=both)))
    for width in (2, 4, 8):
        listed.append(Variant("elements over the width", _changed(case, mesh={"width_elements": width})))
    listed.append(Variant("whole width", _changed(case, mesh={"width": "whole"})))
    listed += line_load_variants(case)
    points = {"scheme": "direct"}
    for label, reduction in (
        ("flank lines", {"shapes": "flank_lines"}),
        ("no error bar", {"shapes": "flank_lines", "error_estimate": False}),
        ("shapes at positions", {"shapes": "positions"}),
    ):
        listed.append(Variant(label, _changed(case, contact=points, reduction=reduction)))
    return listed


def line_load_variants(case: Case) -> list[Variant]:
    """Return what line loads are timed on: a case itself, its axes tilted, and with a helix and sixteen sections."""
    changes: dict[str, dict[str, Any]] = {
        "line loads": {},
        "line loads, tilted axes": {"misalignment": {"in_plane_um": TILT_UM}},
        "line loads, helical": {"pair": {"helix_angle_deg": HELIX_DEG}, "mesh": {"width_elements": 4}},
    }
    lines = {"contact": {"scheme": "line"}, "reduction": {"shapes": "line_loads"}}
    return [Variant(label, _changed(case, **lines, **more)) for label, more in changes.items()]


def run_bench(case: Case, jobs: int) -> dict[str, Any]:
    """Measure everything.

    Parameters
    ----------
    case : Case
    jobs : int
        Threads of the parallel sweep.

    Returns
    -------
    dict
        ``rows``, each with ``phase``, ``scheme``, ``n_profile``, ``n_width``, ``lodm_profile``, ``lodm_width``,
        ``median_ms`` and ``repeats``; and ``machine``.
    """
    rows = offline_rows(case)
    listed = variants(case)
    with tempfile.TemporaryDirectory() as folder, Progress(len(listed), "bases") as progress:
        models, sizes = [], []
        for i, variant in enumerate(listed):
            models.append(_basis(variant.case, path := Path(folder) / f"{i}.h5"))
            sizes.append(path.stat().st_size / 2**20)
            progress.step()
    rows += [row | {"basis_mib": size} for row, size in zip(sweep_rows(listed, models), sizes, strict=True)]
    lines = next(i for i, variant in enumerate(listed) if variant.label == "line loads")
    rows += line_load_rows(listed[lines].case, models[lines])
    trained = next(i for i, variant in enumerate(listed) if variant.case.reduction.trained)
    rows += phase_rows(listed[trained].case, models[trained])
    rows += parallel_rows(case, models[0], jobs)
    rows += start_rows(case)
    rows += stage_rows(case)
    return {"rows": rows, "machine": machine()}


def offline_rows(case: Case) -> list[Row]:
    """Time the offline stage of the case step by step, once."""
    seconds: dict[str, float] = {}

    def timed(name: str, work: Callable[[], Any]) -> Any:
        start = time.perf_counter()
        result = work()
        seconds[name] = time.perf_counter() - start
        return result

    mesh = timed("mesh", lambda: meshed_within_memory(case))
    gear = case.pair.pinion
    elastic = gear.youngs_modulus_GPa * 1e3, gear.poisson_ratio, case.mesh.element
    neighbours, layers = neighbouring_teeth(mesh.meshed.pair), layers_of(mesh.meshed)
    columns = layers[0].columns if layers else 0
    timed("elements", lambda: sector_stiffness(mesh.pinion, *elastic))
    timed("condensed", lambda: condense_sector(mesh.pinion, *elastic, layer_columns=columns))
    timed("ring", lambda: elastic_gear(mesh.pinion, *elastic, neighbours, layer_columns=columns))
    model = elastic_model(case, mesh)
    with tempfile.TemporaryDirectory() as folder:
        timed("snapshots", lambda: run_offline(case, model, Path(folder) / "basis.h5", estimate=estimate_errors))
    # Each of these calls contains the one before.
    seconds["ring"] -= seconds["condensed"]
    seconds["condensed"] -= seconds["elements"]
    names = {
        "mesh": "offline: mesh",
        "elements": "offline: elements, one gear",
        "condensed": "offline: elimination, one gear",
        "ring": "offline: ring, one gear",
        "snapshots": "offline: full contact and basis file",
    }
    return [_row(label, case, [1e3 * seconds[name]]) for name, label in names.items()]


def sweep_rows(listed: list[Variant], models: list[ReducedPair]) -> list[Row]:
    """Time one position of each variant: sweeps over a pitch, one thread, all variants in turn."""
    work = {}
    for i, (variant, model) in enumerate(zip(listed, models, strict=True)):
        phi = online_angles(model.meshed.pair.pitch, ANGLES)
        sweep = partial(sweep_reduced_pair, model, phi, [nominal_condition(variant.case)])
        work[i] = partial(ms_per_position, sweep)
    with Progress(REPEATS, "sweeps") as progress:
        times = times_in_turn(work, REPEATS, progress.step)
    return [
        {**_row(f"position: {variant.label}", variant.case, times[i]), "unknowns": largest_size(models[i])}
        for i, variant in enumerate(listed)
    ]


def line_load_rows(case: Case, model: ReducedPair) -> list[Row]:
    """Time all that line loads take offline, and a sweep over many tip reliefs of both gears."""

    def offline_ms() -> float:
        start = time.perf_counter()
        with tempfile.TemporaryDirectory() as folder:
            _basis(case, Path(folder) / "basis.h5")
        return 1e3 * (time.perf_counter() - start)

    pair, phi = model.meshed.pair, online_angles(model.meshed.pair.pitch, RELIEF_ANGLES)
    starts = [math.degrees(0.3 * active[0] + 0.7 * active[1]) for active in pair.active_rolls]
    assemblies = [
        Assembly(ALIGNED, *(Modification(tip_relief_um=amount, tip_relief_start_roll_deg=start) for start in starts))
        for amount in np.linspace(1.0, 40.0, RELIEFS).tolist()
    ]
    torques = [tuple(case.torque_Nm * share for share in RELIEF_LOADS)] * RELIEFS

    def sweep_ms() -> float:
        start = time.perf_counter()
        sweep_assemblies(model, phi, assemblies, torques)
        return 1e3 * (time.perf_counter() - start)

    times = times_in_turn({"offline": offline_ms, "reliefs": sweep_ms}, 3)
    what = f"conditions: {RELIEFS} tip reliefs x {RELIEF_ANGLES} angles x {len(RELIEF_LOADS)} torques"
    rows = [_row("offline: line loads, in all", case, times["offline"]), _row(what, case, times["reliefs"])]
    return rows + reading_rows(case, model)


def reading_rows(case: Case, model: ReducedPair) -> list[Row]:
    """Time what is read off line loads beside the transmission error, together with the sweep and without it."""
    conditions = conditions_of(case, [case.torque_Nm * share for share in RELIEF_LOADS])
    phi = online_angles(model.meshed.pair.pitch, READ_ANGLES)

    def sweep(recorded: bool) -> SteSweep:
        return sweep_reduced_pair(model, phi, conditions, recorded=recorded)

    def read() -> None:
        kept = sweep(True)
        face_load_factor(line_states(kept))
        effective_contact_ratio(kept)
        forces_on_gears(model.meshed, kept)
        derivatives(model, kept, conditions[0].assembly)

    kept = sweep(True)

    def draw() -> None:
        for d in range(len(conditions)):
            flank_maps(model.meshed, kept, d)
        harris_sweep(model)

    works = {
        f"results: STE alone, {READ_ANGLES} angles x {len(conditions)} torques": lambda: sweep(False),
        "results: with stiffness, pressure, K_Hbeta, forces, derivatives": read,
        "results: flank maps and Harris map": draw,
    }
    times = times_in_turn({name: _timed_ms(work) for name, work in works.items()}, READ_REPEATS)
    return [_row(name, case, found) for name, found in times.items()]


def _timed_ms(work: Callable[[], Any]) -> Callable[[], float]:
    def timed() -> float:
        start = time.perf_counter()
        work()
        return 1e3 * (time.perf_counter() - start)

    return timed


def phase_rows(case: Case, model: ReducedPair) -> list[Row]:
    """Time the phases of one evaluation, averaged over a pitch."""
    meshed, condition = as_penalty(model.meshed), nominal_condition(case)
    pair, family, pair_count = sweep_pair(meshed, condition.assembly), model.family, meshed.tooth_pair_count
    depth = window_depth(meshed, condition)
    load = Load(condition.given_torque, meshed.expected_approach(condition.given_torque), False)
    phases = range(len(PHASES))
    found: dict[int, list[float]] = {phase: [] for phase in phases}
    points = []
    for phi in online_angles(meshed.pair.pitch, 20).tolist():
        position = place_position(phi, depth, pair, family, pair_count, meshed.clearance(condition.assembly))
        coordinates, start_advance = (
            np.zeros(position.active_shapes.size),
            pair.kinematics.first_touch + load.approach / meshed.pair.pinion.base_radius,
        )
        advance = solve_state(pair, position, load, coordinates, start_advance, 40, TOLERANCE).advance
        for phase in phases:
            arguments = pair, position, family, load, coordinates, advance
            points.append(repeat_phase(phase, 1, *arguments))
            start = time.perf_counter()
            repeat_phase(phase, PHASE_LOOPS, *arguments)
            found[phase].append(1e3 * (time.perf_counter() - start) / PHASE_LOOPS)
    sweep = sweep_reduced_pair(model, online_angles(meshed.pair.pitch, ANGLES), [condition])
    evaluations = float(np.mean(sweep.newton_steps)) + 1.0
    return [
        {**_row(f"phase: {PHASES[phase]}", case, [float(np.mean(times))], PHASE_LOOPS),
         "per_position": evaluations if phase else 1.0, "points": float(np.mean(points))}
        for phase, times in found.items()
    ]  # fmt: skip


def parallel_rows(case: Case, model: ReducedPair, jobs: int) -> list[Row]:
    """Time a sweep over angles and torques with one thread and with `jobs`; say whether they agree to the bit."""
    phi = online_angles(model.meshed.pair.pitch, SWEEP_SIDE)
    loads = case.torque_Nm * np.linspace(0.1, case.offline.torques_Nm[-1] / case.torque_Nm, SWEEP_SIDE)
    results = {}

    def sweep_ms(count: int) -> float:
        with threads(count) as executor:
            results[count] = sweep_reduced_pair(model, phi, conditions_of(case, loads), executor)
        return 1e3 * results[count].seconds

    times = times_in_turn({count: partial(sweep_ms, count) for count in (1, jobs)}, 5)
    same = bool(np.array_equal(results[1].ste_um, results[jobs].ste_um))
    efficiency = median(times[1]) / (jobs * median(times[jobs]))
    what = f"sweep: {SWEEP_SIDE} angles x {SWEEP_SIDE} torques"
    return [
        {**_row(what, case, found), "threads": count, "equal_to_the_bit": same, "efficiency": efficiency}
        for count, found in times.items()
    ]  # fmt: skip


def start_rows(case: Case) -> list[Row]:
    """Time how long the command needs to answer at all."""

    def start_ms() -> float:
        start = time.perf_counter()
        subprocess.run([sys.executable, "-m", "pmor", "--help"], check=True, capture_output=True)
        return 1e3 * (time.perf_counter() - start)

    return [_row("start: pmor --help", case, times_in_turn({"start": start_ms}, 5)["start"])]


def stage_rows(case: Case) -> list[Row]:
    """Time the stages of a run, with their peak memory, beside what was told of them beforehand."""
    told = {stage.name: stage for stage in stages(case)}
    return [
        {**_row(f"run: {name}", case, [1e3 * found["seconds"]]), "peak_mib": found["peak_mib"],
         "told_ms": 1e3 * told[name].seconds, "told_mib": told[name].memory / 2**20}
        for name, found in measure_stages(case).items()
    ]  # fmt: skip


def bench_table(result: dict[str, Any], before: dict[str, Any] | None) -> Table:
    """Return the table; with an earlier result, each time as a ratio to the one measured then."""
    old = {_key(row): row["median_ms"] for row in before["rows"]} if before else {}
    columns: Columns = {
        "phase": _name,
        "scheme": "scheme",
        "mesh": lambda row: f"{row['n_profile']} x {row['n_width']}",
        "LoDM": lambda row: f"{row['lodm_profile']}, {row['lodm_width']}" if row["lodm_profile"] else "-",
        "ms": "median_ms",
        "peak MiB": lambda row: f"{row['peak_mib']:.0f}" if "peak_mib" in row else "",
        "basis MiB": lambda row: f"{row['basis_mib']:.2g}" if "basis_mib" in row else "",
        "told": lambda row: f"{row['told_ms']:.0f} ms, {row['told_mib']:.0f} MiB" if "told_ms" in row else "",
    }
    if before:
        ratios = {key: f"{row['median_ms'] / old[key]:.2f}" for row in result["rows"] if (key := _key(row)) in old}
        columns = {**columns, "ratio to the earlier run": lambda row: ratios.get(_key(row), "")}
    m = result["machine"]
    note = f"medians, one thread unless said; {m['cpu']}, {m['cores']} cores, Python {m['python']}"
    return table("Run time by phase and by size", columns, result["rows"], note)


def bench_text(result: dict[str, Any], before: dict[str, Any] | None) -> str:
    """Return the table for the screen."""
    shown = bench_table(result, before)
    return "\n".join([*text_lines(shown), shown.note])


def write_bench(result: dict[str, Any], before: dict[str, Any] | None, path: Path) -> None:
    """Write the JSON file, and the table as Markdown beside it.

    Raises
    ------
    OutputError
    """
    write_summary_json(path, result)
    write_markdown(path.with_suffix(".md"), "Benchmark", [bench_table(result, before)])


def read_bench(path: Path) -> dict[str, Any] | None:
    """Return an earlier result; None when there is none that can be read."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return found if isinstance(found, dict) and "rows" in found else None


def _name(row: Row) -> str:
    return f"{row['phase']}, {row['threads']} threads" if row.get("threads", 1) > 1 else str(row["phase"])


def _key(row: Row) -> tuple[Any, ...]:
    return (_name(row), *(row.get(name) for name in ("scheme", "n_profile", "n_width", "lodm_profile", "lodm_width")))


def _row(phase: str, case: Case, times: list[float], repeats: int | None = None) -> Row:
    nodal = case.contact.kind == "nodal"
    return {
        "phase": phase,
        "scheme": case.contact.scheme,
        "n_profile": case.mesh.profile_elements,
        "n_width": case.mesh.width_elements,
        "lodm_profile": case.contact.lodm_profile if nodal else None,
        "lodm_width": case.contact.lodm_width if nodal else None,
        "median_ms": median(times),
        "repeats": repeats or len(times),
    }


def _changed(case: Case, **changes: dict[str, Any]) -> Case:
    """The case with other keys, and trained at few angles."""
    return change_case(without_models(case), **changes, offline={"angles_per_pitch": TRAINING_ANGLES})


def _basis(case: Case, path: Path) -> ReducedPair:
    run_offline(case, elastic_model(case, meshed_within_memory(case)), path, estimate=estimate_errors)
    return reduced_pair(read_basis(path))
