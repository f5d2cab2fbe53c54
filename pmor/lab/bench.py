"""Run time by phase and by size: cost of a position of the reduced model, and of the offline stage."""

from __future__ import annotations

import json
import math
import subprocess
import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple

import numpy as np

from pmor.body.elastic_gear import elastic_gear
from pmor.case import Case, change_case, without_models
from pmor.core.errors import ExternalProgramError
from pmor.core.shown import brief
from pmor.core.threads import threads
from pmor.fe.condensation import condense_sector, sector_stiffness
from pmor.gear.condition import ALIGNED, Assembly
from pmor.gear.modification import Modification
from pmor.lab.core.measures import ms_per_position, times_in_turn
from pmor.lab.core.motion import motion_times
from pmor.lab.core.stages import measure_stages
from pmor.lab.core.starts import LIBRARIES, start_times
from pmor.line.layered_pair import layers_of
from pmor.machine.loader import GearboxFile
from pmor.pair.conditions import conditions_of, nominal_condition
from pmor.pair.model import elastic_model
from pmor.report.data_files import write_summary_json
from pmor.report.markdown import write_markdown
from pmor.report.page import machine
from pmor.report.table import Columns, Table, table, text_lines
from pmor.results.load_distribution import effective_contact_ratio, face_load_factor, line_states
from pmor.results.sweep import SteSweep
from pmor.storage.basis_file import read_basis
from pmor.work.cost import meshed_within_memory, stages
from pmor.work.offline import run_offline
from pmor.work.pace import LOG, Pace
from pmor_online.conditions import sweep_assemblies
from pmor_online.model import ReducedPair, online_angles, reduced_pair
from pmor_online.readings import derivatives, flank_maps, forces_on_gears, harris_sweep
from pmor_online.sweep import largest_size, sweep_reduced_pair

REPEATS = 15
ANGLES = 200  # a full pitch
# Online cost does not depend on how densely the basis was trained: few angles keep the benchmark short.
TRAINING_ANGLES = 12
# Angles, and torques, of the sweep that is shared out between threads.
SWEEP_SIDE = 100
# Of line loads: tilt of the axes, helix of the pair, and a sweep over modifications.
TILT_UM, HELIX_DEG = 20.0, 20.0
RELIEFS, RELIEF_ANGLES, RELIEF_LOADS = 1000, 32, (0.5, 1.0, 1.5)
# Of the sweep that results are read off.
READ_ANGLES, READ_REPEATS = 200, 9

Row = dict[str, Any]


class Variant(NamedTuple):
    """A case whose reduced model is timed."""

    label: str
    case: Case


def variants(case: Case) -> list[Variant]:
    """Return the case itself and its neighbours in mesh, scheme and refinement; shapes: `pmor lab reductions`."""

    def direct(**lodm: int) -> Case:
        return _changed(case, contact={"scheme": "direct", **lodm}, reduction={"shapes": "flank_lines"})

    def mesh(**keys: Any) -> Case:
        return _changed(case, mesh=keys, contact={"scheme": "line"}, reduction={"shapes": "line_loads"})

    return [
        Variant("case", _changed(case)),
        *(Variant("elements over the profile", mesh(profile_elements=n)) for n in (4, 8, 16, 32)),
        *(Variant("elements over the width", mesh(width_elements=n)) for n in (2, 4, 8)),
        Variant("whole width", mesh(width="whole")),
        *(Variant("LoDM over the profile", direct(lodm_profile=n)) for n in (1, 2, 4, 8)),
        Variant("LoDM over both", direct(lodm_profile=4, lodm_width=4)),
        *line_load_variants(case),
    ]


def line_load_variants(case: Case) -> list[Variant]:
    """Return the cases of line loads: the case itself, with tilted axes, and with a helix and sixteen sections."""
    changes: dict[str, dict[str, Any]] = {
        "line loads": {},
        "line loads, tilted axes": {"misalignment": {"in_plane_um": TILT_UM}},
        "line loads, helical": {"pair": {"helix_angle_deg": HELIX_DEG}, "mesh": {"width_elements": 4}},
    }
    lines = {"contact": {"scheme": "line"}, "reduction": {"shapes": "line_loads"}}
    return [Variant(label, _changed(case, **lines, **more)) for label, more in changes.items()]


@brief
@dataclass(frozen=True)
class Bench:
    """Run times: rows (``phase``, ``scheme``, sizes, ``median_ms``, ``repeats``), machine, rows of an earlier run."""

    rows: list[Row]
    machine: dict[str, Any]
    before: list[Row]

    def write(self, path: Path) -> None:
        """Write the JSON file, and the table as Markdown beside it."""
        write_summary_json(path, {"rows": self.rows, "machine": self.machine})
        write_markdown(path.with_suffix(".md"), "Benchmark", [self._table()])

    def __str__(self) -> str:
        """The table for the screen."""
        shown = self._table()
        return "\n".join([*text_lines(shown), shown.note])

    def _table(self) -> Table:
        columns: Columns = {
            "phase": _name,
            "scheme": "scheme",
            "mesh": lambda row: f"{row['n_profile']} x {row['n_width']}",
            "LoDM": lambda row: f"{row['lodm_profile']}, {row['lodm_width']}" if row["lodm_profile"] else "-",
            "ms": "median_ms",
            "peak MiB": lambda row: f"{row['peak_mib']:.0f}" if "peak_mib" in row else "",
            "basis MiB": lambda row: f"{row['basis_mib']:.2g}" if "basis_mib" in row else "",
            "starts": lambda row: f"{row['starts']:.2g}" if "starts" in row else "",
            "told": lambda row: f"{row['told_ms']:.0f} ms, {row['told_mib']:.0f} MiB" if "told_ms" in row else "",
        }
        if self.before:
            old = {_key(row): row["median_ms"] for row in self.before}
            ratios = {key: f"{row['median_ms'] / old[key]:.2f}" for row in self.rows if (key := _key(row)) in old}
            columns = {**columns, "ratio to the earlier run": lambda row: ratios.get(_key(row), "")}
        m = self.machine
        note = f"medians, one thread unless stated; {m['cpu']}, {m['cores']} cores, Python {m['python']}"
        return table("Run time by phase and by size", columns, self.rows, note)


def run(
    case: Case | GearboxFile, *, jobs: int = 2, before: Sequence[Row] = (),
    progress: Callable[[int], None] | None = None,
) -> Bench:  # fmt: skip
    """Measure everything of a pair; of a gearbox its motion.

    Parameters
    ----------
    jobs : int
        Threads of the parallel sweep.
    before : sequence of dict
        Rows of an earlier run, to compare with (`read_rows`).
    progress : callable, optional
        As in `pmor.app.capabilities`: further bases.
    """
    with threads(jobs):
        pass  # refused now, not after minutes
    if isinstance(case, GearboxFile):
        meshed = next(iter(case.cases.values()))
        moved = [_row(what, meshed, times) for what, times in motion_times(case, jobs).items()]
        return Bench(moved, machine(), list(before))
    rows, listed, step = offline_rows(case), variants(case), progress or (lambda count: None)
    pace, models, sizes = Pace("bases", len(listed)), list[ReducedPair](), list[float]()
    with tempfile.TemporaryDirectory() as folder:
        for i, variant in enumerate(listed):
            pace.tell(variant.label)
            models.append(_basis(variant.case, path := Path(folder) / f"{i}.h5"))
            sizes.append(path.stat().st_size / 2**20)
            pace.step()
            step(1)
    rows += [row | {"basis_mib": size} for row, size in zip(sweep_rows(listed, models), sizes, strict=True)]
    lines = next(i for i, variant in enumerate(listed) if variant.label == "line loads")
    rows += line_load_rows(listed[lines].case, models[lines])
    rows += parallel_rows(case, models[0], jobs)
    for measure in (start_rows, stage_rows):
        try:
            rows += measure(case)
        except (ExternalProgramError, subprocess.SubprocessError, OSError) as error:  # minutes of work are not lost
            LOG.warning("left out: %s", error)
    return Bench(rows, machine(), list(before))


def offline_rows(case: Case) -> list[Row]:
    """Time the offline stage of the case step by step, once."""
    mesh, meshing = _timed(lambda: meshed_within_memory(case))
    gear = case.pair.pinion
    elastic = gear.youngs_modulus_GPa * 1e3, gear.poisson_ratio, case.mesh.element
    neighbours, layers = mesh.meshed.pair.neighbouring_teeth, layers_of(mesh.meshed)
    columns = layers[0].columns if layers else 0
    # Once before the clock runs: first calls import and compile.
    elastic_gear(mesh.pinion, *elastic, neighbours, layer_columns=columns)
    _, elements = _timed(lambda: sector_stiffness(mesh.pinion, *elastic))
    _, condensed = _timed(lambda: condense_sector(mesh.pinion, *elastic, layer_columns=columns))
    _, ring = _timed(lambda: elastic_gear(mesh.pinion, *elastic, neighbours, layer_columns=columns))
    model = elastic_model(case, mesh)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "basis.h5"
        _, snapshots = _timed(lambda: run_offline(case, model, path))
    times = {
        "mesh": meshing,
        "elements, one gear": elements,
        "elimination, one gear": condensed - elements,  # each of these calls contains the one before
        "ring, one gear": ring - condensed,
        "full contact and basis file": snapshots,
    }
    return [_row(f"offline: {name}", case, [ms]) for name, ms in times.items()]


def sweep_rows(listed: list[Variant], models: list[ReducedPair]) -> list[Row]:
    """Time one position of each variant: sweeps over a pitch, one thread, all variants in turn."""
    work = {}
    for i, (variant, model) in enumerate(zip(listed, models, strict=True)):
        phi = online_angles(model.meshed.pair.pitch, ANGLES)
        sweep = partial(sweep_reduced_pair, model, phi, [nominal_condition(variant.case)])
        work[i] = partial(ms_per_position, sweep)
    times = times_in_turn(work, REPEATS)
    return [
        {**_row(f"position: {variant.label}", variant.case, times[i]), "unknowns": largest_size(models[i])}
        for i, variant in enumerate(listed)
    ]


def line_load_rows(case: Case, model: ReducedPair) -> list[Row]:
    """Time all that line loads take offline, and a sweep over many tip reliefs of both gears."""

    def offline() -> None:
        with tempfile.TemporaryDirectory() as folder:
            _basis(case, Path(folder) / "basis.h5")

    pair, phi = model.meshed.pair, online_angles(model.meshed.pair.pitch, RELIEF_ANGLES)
    starts = [math.degrees(0.3 * active[0] + 0.7 * active[1]) for active in pair.active_rolls]
    assemblies = [
        Assembly(ALIGNED, *(Modification(tip_relief_um=amount, tip_relief_start_roll_deg=start) for start in starts))
        for amount in np.linspace(1.0, 40.0, RELIEFS).tolist()
    ]
    torques = [tuple(case.torque_Nm * share for share in RELIEF_LOADS)] * RELIEFS

    sweep = partial(sweep_assemblies, model, phi, assemblies, torques)
    times = times_in_turn({"offline": _timed_ms(offline), "reliefs": _timed_ms(sweep)}, 3)
    what = f"conditions: {RELIEFS} tip reliefs x {RELIEF_ANGLES} angles x {len(RELIEF_LOADS)} torques"
    rows = [_row("offline: line loads, in all", case, times["offline"]), _row(what, case, times["reliefs"])]
    return rows + reading_rows(case, model)


def reading_rows(case: Case, model: ReducedPair) -> list[Row]:
    """Time the results of line loads beyond the transmission error, with the sweep and without it."""
    conditions = conditions_of(case, [case.torque_Nm * share for share in RELIEF_LOADS])
    phi = online_angles(model.meshed.pair.pitch, READ_ANGLES)

    def sweep(recorded: bool) -> SteSweep:
        return sweep_reduced_pair(model, phi, conditions, recorded=recorded)

    def read() -> None:
        kept = sweep(True)
        face_load_factor(line_states(kept))
        effective_contact_ratio(line_states(kept))
        forces_on_gears(model.meshed, kept)
        derivatives(model, kept, conditions[0].assembly)

    kept = sweep(True)

    def draw() -> None:
        for d in range(len(conditions)):
            flank_maps(model.meshed, kept, d)
        harris_sweep(model)

    works = {
        f"results: STE alone, {READ_ANGLES} angles x {len(conditions)} torques": lambda: sweep(False),
        "results: with stiffness, pressure, K_Hβ, forces, derivatives": read,
        "results: flank maps and Harris map": draw,
    }
    times = times_in_turn({name: _timed_ms(work) for name, work in works.items()}, READ_REPEATS)
    return [_row(name, case, ms) for name, ms in times.items()]


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
        {**_row(what, case, ms), "threads": count, "equal_to_the_bit": same, "efficiency": efficiency}
        for count, ms in times.items()
    ]  # fmt: skip


def start_rows(case: Case) -> list[Row]:
    """Time what is waited for at the command line, in starts of Python with its libraries too."""
    times = start_times(case)
    once = median(times[LIBRARIES])
    return [{**_row(f"start: {name}", case, ms), "starts": median(ms) / once} for name, ms in times.items()]


def stage_rows(case: Case) -> list[Row]:
    """Time the stages of a run, with their peak memory, beside the estimates of `pmor plan`."""
    told = {stage.name: stage for stage in stages(case)}
    return [
        {**_row(f"run: {name}", case, [1e3 * measured.pop("seconds")]), **measured,
         "told_ms": 1e3 * told[name].seconds, "told_mib": told[name].memory / 2**20}
        for name, measured in measure_stages(case).items()
    ]  # fmt: skip


def read_rows(path: Path) -> list[Row]:
    """Return the rows of an earlier run; none where there is none that can be read."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return []
    return content.get("rows", []) if isinstance(content, dict) else []


def _name(row: Row) -> str:
    return f"{row['phase']}, {row['threads']} threads" if row.get("threads", 1) > 1 else str(row["phase"])


def _key(row: Row) -> tuple[Any, ...]:
    return (_name(row), *(row.get(name) for name in ("scheme", "n_profile", "n_width", "lodm_profile", "lodm_width")))


def _row(phase: str, case: Case, times: list[float]) -> Row:
    nodal = case.contact.kind == "nodal"
    return {
        "phase": phase,
        "scheme": case.contact.scheme,
        "n_profile": case.mesh.profile_elements,
        "n_width": case.mesh.width_elements,
        "lodm_profile": case.contact.lodm_profile if nodal else None,
        "lodm_width": case.contact.lodm_width if nodal else None,
        "median_ms": median(times),
        "repeats": len(times),
    }


def _changed(case: Case, **changes: dict[str, Any]) -> Case:
    """The case with other keys, and trained at few angles."""
    return change_case(without_models(case), **changes, offline={"angles_per_pitch": TRAINING_ANGLES})


def _basis(case: Case, path: Path) -> ReducedPair:
    run_offline(case, elastic_model(case, meshed_within_memory(case)), path)
    return reduced_pair(read_basis(path))


def _timed_ms(work: Callable[[], Any]) -> Callable[[], float]:
    return lambda: _timed(work)[1]


def _timed(work: Callable[[], Any]) -> tuple[Any, float]:
    """Do work and return its result and time, ms."""
    start = time.perf_counter()
    result = work()
    return result, 1e3 * (time.perf_counter() - start)
