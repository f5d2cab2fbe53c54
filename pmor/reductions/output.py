"""What a comparison of reductions leaves in its folder, and its summary on the screen."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

from online.plots import save_png
from online.report import Cell, Table, format_cell
from online.run import provenance
from online.tables import write_summary_json
from pmor.bench import machine
from pmor.progress import format_time
from pmor.reductions.decay import SAMPLINGS
from pmor.reductions.figures import SAMPLING_NAMES, decay_figure, estimate_figure, run_time_figure
from pmor.reductions.measure import Entry, plain_entry
from pmor.reductions.measures import SMALLEST_ERROR_UM, WANTED_EFFECTIVITY
from pmor.reductions.run import Comparison
from pmor.reductions.states import state_text
from pmor.storage.atomic import atomic_path
from pmor.study.report import Block, Heading, Picture, Warning, study_html

COLUMNS = (
    "reduction", "training", "solves", "unknowns", "offline, s", "basis, MiB", "online, ms",
    "STE error max / rms, %", "line load, %", "estimate / error", "in 0.3-5, %", "rank corr.",
)  # fmt: skip


def write_comparison(comparison: Comparison, seconds: float, out: Path) -> None:
    """Write `reductions.json`, `reductions.html` and the pictures.

    Parameters
    ----------
    comparison : Comparison
    seconds : float
        Wall time of the run.
    out : Path

    Raises
    ------
    OutputError
    """
    write_summary_json(out / "reductions.json", content(comparison, seconds))
    pictures = _pictures(comparison)
    for picture in pictures:
        save_png(picture.figure, out / picture.file_name)
    with atomic_path(out / "reductions.html") as temporary:
        title = f"Reductions and error bars: {comparison.case.title}"
        temporary.write_text(study_html(title, _blocks(comparison, pictures, seconds)), encoding="utf-8")


def content(comparison: Comparison, seconds: float) -> dict[str, Any]:
    """Return everything that was measured as plain data."""
    truth, decay = comparison.truth, comparison.decay
    timed = zip(comparison.entries, comparison.online_ms, strict=True)
    return {
        "case": comparison.case.name,
        "states": [truth.states.where(i) | {"ste_um": ste} for i, ste in enumerate(truth.full.ste_um.tolist())],
        "entries": [
            plain_entry(entry, truth.states) | {"online_ms": slow, "online_without_ms": fast}
            for entry, (slow, fast) in timed
        ],
        "decay": {name: [asdict(point) for point in points] for name, points in decay.points.items()},
        "greedy_estimate": [{"solves": n, "percent": percent} for n, percent in decay.estimate],
        "target_percent": decay.target_percent,
        "solves_to_target": {name: decay.reached(name) for name in decay.points},
        "failures": list(comparison.failures),
        "machine": machine(),
        "seconds": seconds,
    }


def comparison_text(comparison: Comparison) -> str:
    """Return the summary for the screen: the table as Markdown, and the solves that an accuracy takes."""
    table = _table(comparison)
    lines = [f"Reductions: {comparison.case.title}", "", _line(table.columns), _line(["---"] * len(table.columns))]
    lines += [_line([format_cell(cell) for cell in row]) for row in table.rows]
    lines += ["", *(f"  {sentence}" for sentence in _reached(comparison))]
    return "\n".join([*lines, *(f"  ! {failure}" for failure in comparison.failures)])


def _line(cells: Any) -> str:
    return "| " + " | ".join(cells) + " |"


def _table(comparison: Comparison) -> Table:
    rows = [_row(entry, times) for entry, times in zip(comparison.entries, comparison.online_ms, strict=True)]
    return Table("Reductions", COLUMNS, rows, _note(comparison))


def _row(entry: Entry, times: tuple[float, float]) -> tuple[Cell, ...]:
    errors, found = entry.errors, entry.errors.effectivity
    slow, fast = times
    spread = f"{_short(found.low)} / {_short(found.median)} / {_short(found.high)} ({found.states})"
    return (
        entry.shapes, entry.training if entry.solves else "–", entry.solves, entry.unknowns, _short(entry.offline_s),
        _with_estimate(entry.basis_without_mib, entry.basis_mib), _with_estimate(fast, slow),
        f"{_short(errors.max_percent)} / {_short(errors.rms_percent)}", _short(entry.load_error_percent),
        spread if found.states else "–",
        "–" if found.wanted_share is None else f"{100.0 * found.wanted_share:.1f}",
        "–" if found.rank_correlation is None else f"{found.rank_correlation:.3f}",
    )  # fmt: skip


def _with_estimate(without: float, with_it: float) -> str:
    """A quantity without the error estimate, and by how much the estimate raises it."""
    return f"{_short(without)} ({100.0 * (with_it / without - 1.0):+.0f} %)"


def _short(value: float | None) -> str:
    """Three digits, or a dash."""
    return "–" if value is None or value != value else f"{value:.3g}"


def _note(comparison: Comparison) -> str:
    low, high = WANTED_EFFECTIVITY
    return (
        f"Errors over {len(comparison.truth.full.ste_um)} unseen states. Offline: full solves, their choice and the "
        "basis with its file, one thread; finite elements, the same for all, not included. Line load: largest error "
        "of any section over the peak load of its state. Online: median over sweeps of 200 angles. In parentheses "
        "behind basis and online: what the error estimate adds. Estimate / error: "
        f"2.5, 50 and 97.5 % quantiles over the states with a true error above {SMALLEST_ERROR_UM:g} µm, their number "
        f"in parentheses, and the share of them within {low:g} to {high:g}. Rank correlation (Spearman): of estimate "
        "and error over all states."
    )


def _reached(comparison: Comparison) -> list[str]:
    """Say how many solves each sampling takes to the tolerance."""
    decay = comparison.decay
    greedy = decay.reached("greedy")
    sentences = []
    for name in SAMPLINGS:
        found, most = decay.reached(name), max(p.solves for p in decay.points[name])
        goal = f"at most {decay.target_percent:g} % everywhere"
        if found is None:
            sentences.append(f"{SAMPLING_NAMES[name]}: not {goal} with up to {most} solves")
            continue
        ratio = f", {found / greedy:.2g} times the greedy ones" if greedy and name != "greedy" else ""
        sentences.append(f"{SAMPLING_NAMES[name]}: {goal} with {found} solves{ratio}")
    return sentences


def _pictures(comparison: Comparison) -> list[Picture]:
    entries, decay = comparison.entries, comparison.decay
    low, high = WANTED_EFFECTIVITY
    return [
        Picture(
            "error_run_time.png",
            "Largest STE error over the unseen states against the run time of a position. Static modes, without "
            "training, show what is left to full FE by the solver alone.",
            run_time_figure(entries, comparison.online_ms),
        ),
        Picture(
            "decay.png",
            "STE error of flank lines over the number of full solves. Grids differ in their numbers of angles and of "
            "values of each parameter; the line joins the best of those with no more solves.",
            decay_figure(decay),
        ),
        Picture(
            "estimate.png",
            f"Error estimate against true error at all unseen states. Solid: equal; dashed: {low:g} and {high:g} "
            f"times; dotted: {SMALLEST_ERROR_UM:g} µm, below which errors are not counted.",
            estimate_figure(entries),
        ),
    ]


def _blocks(comparison: Comparison, pictures: list[Picture], seconds: float) -> list[Block]:
    case, states = comparison.case, comparison.truth.states
    ranges = (("torque", case.offline.torques_Nm, "N m"), ("tilt in plane", case.offline.in_plane_um, "µm"),
              ("tilt out of plane", case.offline.out_of_plane_um, "µm"),
              ("centre distance", case.offline.centre_distance_um, "µm"))  # fmt: skip
    declared = ", ".join(f"{name} {v[0]:g} to {v[-1]:g} {unit}" for name, v, unit in ranges if len(v) > 1)
    places = [(entry.label, state_text(states.where(entry.errors.worst)),
               "–" if entry.worst_load is None else state_text(states.where(entry.worst_load)))
              for entry in comparison.entries]  # fmt: skip
    return [
        *(Warning(f"not converged: {failure}") for failure in comparison.failures),
        f"The reductions of this program over one pitch and all that the case declares ({declared or 'one torque'}), "
        f"each made from at most {case.offline.solves} full solves, and held against full FE on the same mesh "
        f"({case.mesh.profile_elements} x {case.mesh.width_elements} elements on a flank) at {len(states.phi)} states "
        f"that none of them was trained at. {format_time(seconds)} in all.",
        _table(comparison),
        "The default is flank_lines with what [offline] sampling says: nothing is interpolated over the angle or any "
        "parameter, so that any training serves it, and the greedy sampling can go by its error estimate.",
        *pictures[:1],
        Heading("Solves that an accuracy takes"),
        *(f"{sentence[0].upper()}{sentence[1:]}." for sentence in _reached(comparison)),
        *pictures[1:2],
        Heading("Error estimate"),
        *pictures[2:],
        Table("Where the largest errors sit", ("reduction", "STE", "line load"), places),
        Heading("Provenance"),
        Table("Machine and software", ("item", "value"), provenance(case)),
    ]
