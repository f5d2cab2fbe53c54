"""The table of a comparison of reductions, and what its columns mean."""

from __future__ import annotations

from collections.abc import Sequence

from pmor.case import Case
from pmor.lab.comparison.measure import Entry
from pmor.lab.comparison.measures import SMALLEST_ERROR_UM, WANTED_EFFECTIVITY
from pmor.lab.comparison.run import Comparison
from pmor.lab.comparison.variants import PARAMETERS
from pmor.report.table import Cell, Table

COLUMNS = (
    "reduction", "training", "solves", "unknowns", "offline, s", "basis, MiB", "online, ms",
    "STE error max / rms, %", "line load, %", "estimate / error", "in 0.3-5, %", "rank corr.",
)  # fmt: skip


# Columns of the table that says what a reduction costs, and of the one that says what it is worth.
EFFORT, WORTH = (0, 1, 2, 3, 4, 5, 6), (0, 1, 7, 8, 9, 10, 11)
NAMES = {
    "torques_Nm": ("torque", "N m"), "in_plane_um": ("tilt in plane", "µm"),
    "out_of_plane_um": ("tilt out of plane", "µm"), "centre_distance_um": ("centre distance", "µm"),
}  # fmt: skip


def table_rows(comparison: Comparison) -> list[tuple[Cell, ...]]:
    """Return the cells under `COLUMNS`, a row for each reduction."""
    return [_row(entry, times) for entry, times in zip(comparison.entries, comparison.online_ms, strict=True)]


def table_of(comparison: Comparison, title: str, columns: Sequence[int], note: str) -> Table:
    """Return some columns of the table for the page; text stays on one line, and the table may scroll instead."""
    rows = [[_unbroken(row[i]) for i in columns] for row in table_rows(comparison)]
    return Table(title, [COLUMNS[i] for i in columns], rows, note)


def _unbroken(cell: Cell) -> Cell:
    return cell.replace(" ", "\u00a0") if isinstance(cell, str) else cell


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


def effort_note(comparison: Comparison) -> str:
    """Say what the columns `EFFORT` mean."""
    axes = " x ".join(["angles", *(NAMES[name][0] for name in free_parameters(comparison.case))])
    return (
        f"Training: sampling and how many of its solves; of a grid the numbers of {axes}. Offline: full solves, their "
        "choice and the basis with its file, one thread; finite elements, the same for all, not included. Online: "
        "median over sweeps of 200 angles, per position. In parentheses: what the error estimate adds."
    )


def worth_note() -> str:
    """Say what the columns `WORTH` mean."""
    low, high = WANTED_EFFECTIVITY
    return (
        "Line load: largest error of any section over the peak load of its state. Estimate / error: 2.5, 50 and 97.5 % "
        f"quantiles over the states with a true error above {SMALLEST_ERROR_UM:g} µm, their number in parentheses, and "
        f"the share of them within {low:g} to {high:g}. Rank correlation (Spearman): of estimate and error over all "
        "states."
    )


def free_parameters(case: Case) -> list[str]:
    """Return the parameters that have a range, by their keys in [offline]."""
    return [name for name in PARAMETERS if len(getattr(case.offline, name)) > 1]
