"""The table of a comparison of reductions, and what its columns mean."""

from __future__ import annotations

from pmor.case import Case
from pmor.jobs.states import SMALLEST_ERROR_UM
from pmor.lab.comparison.measure import Row
from pmor.lab.comparison.measures import WANTED_EFFECTIVITY
from pmor.lab.comparison.run import Comparison
from pmor.lab.comparison.variants import PARAMETERS
from pmor.report.table import Table
from pmor.work.table import Columns, table

NAMES = {
    "torques_Nm": ("torque", "N m"), "in_plane_um": ("tilt in plane", "µm"),
    "out_of_plane_um": ("tilt out of plane", "µm"), "centre_distance_um": ("centre distance", "µm"),
}  # fmt: skip
DASH = "–"

ENTRY: Columns = {
    "reduction": lambda e: _unbroken(e["shapes"]),
    "training": lambda e: _unbroken(e["training"]) if e["solves"] else DASH,
}
# What a reduction costs, and what it is worth.
EFFORT: Columns = {
    "solves": "solves",
    "unknowns": "unknowns",
    "offline, s": lambda e: _short(e["offline_s"]),
    "basis, MiB": lambda e: _with_estimate(e["basis_without_mib"], e["basis_mib"]),
    "online, ms": lambda e: _with_estimate(e["online_without_ms"], e["online_ms"]),
}
WORTH: Columns = {
    "STE error max / rms, %": lambda e: _joined(e["ste_error_max_percent"], e["ste_error_rms_percent"]),
    "line load, %": lambda e: _short(e["load_error_percent"]),
    "estimate / error": lambda e: _spread(e["effectivity"]),
    "in 0.3-5, %": lambda e: _fixed(e["effectivity"]["wanted_share"], 100.0, 1),
    "rank corr.": lambda e: _fixed(e["effectivity"]["rank_correlation"], 1.0, 3),
}


def comparison_table(comparison: Comparison, title: str, columns: Columns, note: str = "") -> Table:
    """Return columns of the table, a row for each reduction; text stays on one line, and the table may scroll."""
    return table(title, {**ENTRY, **columns}, comparison.entries, note)


def _unbroken(text: str) -> str:
    return text.replace(" ", "\u00a0")


def _joined(*values: float | None) -> str:
    return _unbroken(" / ".join(map(_short, values)))


def _spread(found: Row) -> str:
    quantiles = _joined(found["low"], found["median"], found["high"])
    return f"{quantiles}\u00a0({found['states']})" if found["states"] else DASH


def _fixed(value: float | None, factor: float, digits: int) -> str:
    return DASH if value is None else f"{factor * value:.{digits}f}"


def _with_estimate(without: float, with_it: float) -> str:
    """A quantity without the error estimate, and by how much the estimate raises it."""
    return _unbroken(f"{_short(without)} ({100.0 * (with_it / without - 1.0):+.0f} %)")


def _short(value: float | None) -> str:
    """Three digits, or a dash."""
    return DASH if value is None or value != value else f"{value:.3g}"


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
