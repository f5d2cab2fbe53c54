"""What a comparison of reductions leaves in its folder, and its summary on the screen."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pmor.core.progress import format_time
from pmor.jobs.states import SMALLEST_ERROR_UM, state_text
from pmor.lab.comparison.decay import SAMPLINGS
from pmor.lab.comparison.figures import SAMPLING_NAMES, decay_figure, estimate_figure, run_time_figure
from pmor.lab.comparison.measures import WANTED_EFFECTIVITY
from pmor.lab.comparison.run import Comparison
from pmor.lab.comparison.table import EFFORT, NAMES, WORTH, comparison_table, effort_note, free_parameters, worth_note
from pmor.report.page import Block, Heading, Picture, Warning
from pmor.report.provenance import machine
from pmor.storage.results_folder import remove_working_folder
from pmor.work.pieces import PARTS
from pmor.work.results import Report
from pmor.work.table import Columns, table, text_lines

# What the page says where line contact is compared.
LINE_LOADS = (
    "Line contact needs no trained shapes. Exact line loads are full FE to what its solver leaves, for every torque, "
    "axis and modification, while any trained basis has the error of its training and an end to its ranges. What "
    "trained shapes are still good for: the schemes of contact points (direct, paper, facet), which have no line "
    "loads; amplitudes as states of a flexible body, which want a few fixed coordinates, whereas line loads come and "
    "go with the sections that touch; and the paper's method to hold others against."
)

#: what `write_comparison` leaves
FILES = (
    "reductions.json", "reductions.md", "reductions.html", "error_run_time.png", "decay.png", "estimate.png",
)  # fmt: skip


def write_comparison(comparison: Comparison, seconds: float, out: Path) -> None:
    """Write `reductions.json`, `reductions.md`, `reductions.html` and the pictures.

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
    title = f"Reductions and error bars: {comparison.case.title}"
    blocks = _blocks(comparison, seconds)
    data = content(comparison, seconds)
    Report("reductions", data, title, blocks, comparison.case, data["machine"], "reductions.html").write(out)
    remove_working_folder(out / PARTS)


def content(comparison: Comparison, seconds: float) -> dict[str, Any]:
    """Return everything that was measured as plain data."""
    truth, decay = comparison.truth, comparison.decay
    return {
        "case": comparison.case.name,
        "states": [truth.states.where(i) | {"ste_um": ste} for i, ste in enumerate(truth.full.ste_um.tolist())],
        "entries": comparison.entries,
        "decay": decay.points,
        "greedy_estimate": [{"solves": n, "percent": percent} for n, percent in decay.estimate],
        "target_percent": decay.target_percent,
        "solves_to_target": {name: decay.reached(name) for name in decay.points},
        "failures": list(comparison.failures),
        "machine": machine(),
        "seconds": seconds,
    }


def comparison_text(comparison: Comparison) -> str:
    """Return the summary for the screen: the table, and the solves that an accuracy takes."""
    whole = comparison_table(comparison, "", {**EFFORT, **WORTH})
    lines = [*text_lines(whole), "", *_reached(comparison), *(f"! {failure}" for failure in comparison.failures)]
    return "\n".join([f"Reductions: {comparison.case.title}", *(f"  {line}" for line in lines)])


def _reached(comparison: Comparison) -> list[str]:
    """Say how many solves each sampling takes to the tolerance."""
    decay = comparison.decay
    greedy = decay.reached("greedy")
    sentences = []
    for name in SAMPLINGS:
        found, most = decay.reached(name), max(p["solves"] for p in decay.points[name])
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
            run_time_figure(entries),
        ),
        Picture(
            "decay.png",
            "STE error of flank lines over the number of full solves, looked at four times per doubling. The greedy "
            "sampling is followed beyond the tolerance of the case. Grids differ in their numbers of angles and of "
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


def _blocks(comparison: Comparison, seconds: float) -> list[Block]:
    case, states, pictures = comparison.case, comparison.truth.states, _pictures(comparison)
    ranges = ((NAMES[name], getattr(case.offline, name)) for name in free_parameters(case))
    declared = ", ".join(f"{name} {v[0]:g} to {v[-1]:g} {unit}" for (name, unit), v in ranges)
    places: Columns = {
        "reduction": "label",
        "STE": lambda e: state_text(e["worst_ste_at"]),
        "line load": lambda e: None if e["worst_load_at"] is None else state_text(e["worst_load_at"]),
    }
    return [
        *(Warning(f"not converged: {failure}") for failure in comparison.failures),
        f"The reductions of this program over one pitch and all that the case declares ({declared or 'one torque'}), "
        f"each made from at most {case.offline.solves} full solves, and held against full FE on the same mesh "
        f"({case.mesh.profile_elements} x {case.mesh.width_elements} elements on a flank) at {len(states.phi)} states "
        f"that none of them was trained at. {format_time(seconds)} in all.",
        comparison_table(comparison, "What they cost", EFFORT, effort_note(comparison)),
        comparison_table(comparison, "What they are worth", WORTH, worth_note()),
        *([LINE_LOADS] if case.contact.scheme == "line" else []),
        "Of trained shapes the default is flank_lines with what [offline] sampling says: nothing is interpolated over "
        "the angle or any parameter, so that any training serves it, and the greedy sampling can go by its error "
        "estimate.",
        *pictures[:1],
        Heading("Solves that an accuracy takes"),
        *(f"{sentence[0].upper()}{sentence[1:]}." for sentence in _reached(comparison)),
        *pictures[1:2],
        Heading("Error estimate"),
        *pictures[2:],
        table("Where the largest errors sit", places, comparison.entries),
    ]
