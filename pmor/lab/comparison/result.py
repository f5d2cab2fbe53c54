"""The result of a comparison of reductions: its files, page and summary."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pmor.case import Case
from pmor.core.progress import format_time
from pmor.core.shown import brief
from pmor.lab.comparison.curves import SAMPLINGS, Curves
from pmor.lab.comparison.figures import SAMPLING_NAMES, decay_figure, estimate_figure, run_time_figure
from pmor.lab.comparison.measure import WANTED_EFFECTIVITY, Row, Truth
from pmor.lab.comparison.variants import PARAMETERS
from pmor.report.page import Block, Heading, Picture, Warning, machine
from pmor.report.table import Columns, table, text_lines
from pmor.work.results import Report, writing_results
from pmor.work.states import SMALLEST_ERROR_UM, state_text

#: files that `Comparison.write` leaves
FILES = (
    "reductions.json", "reductions.md", "reductions.html", "error_run_time.png", "decay.png", "estimate.png",
)  # fmt: skip
NAMES = {
    "torques_Nm": ("torque", "N m"), "in_plane_um": ("tilt in plane", "µm"),
    "out_of_plane_um": ("tilt out of plane", "µm"), "centre_distance_um": ("centre distance", "µm"),
}  # fmt: skip
LOW, HIGH = WANTED_EFFECTIVITY
DASH = "–"
ENTRY: Columns = {
    "reduction": lambda e: _unbroken(e["shapes"]),
    "training": lambda e: _unbroken(e["training"]) if e["solves"] else DASH,
}
EFFORT: Columns = {
    "solves": "solves",
    "unknowns": "unknowns",
    "offline, s": lambda e: _short(e["offline_s"]),
    "basis, MiB": lambda e: _with_estimate(e["basis_without_mib"], e["basis_mib"]),
    "online, ms": lambda e: _with_estimate(e["online_without_ms"], e["online_ms"]),
}
WORTH: Columns = {
    "STE error max / rms, %": lambda e: _joined(e["ste_error_max_percent"], e["ste_error_rms_percent"]),
    "estimate / error": lambda e: _spread(e["effectivity"]),
    "in 0.3-5, %": lambda e: _fixed(e["effectivity"]["wanted_share"], 100.0, 1),
    "rank corr.": lambda e: _fixed(e["effectivity"]["rank_correlation"], 1.0, 3),
    "largest STE error at": lambda e: state_text(e["worst_ste_at"]),
}
WORTH_NOTE = (
    "Estimate / error: 2.5, 50 and 97.5 % quantiles over the states with a true error above "
    f"{SMALLEST_ERROR_UM:g} µm, their number in parentheses, and the share of them within {LOW:g} to {HIGH:g}. Rank "
    "correlation (Spearman): of estimate and error over all states."
)
CAPTIONS = {
    "error_run_time": "Largest STE error over the unseen states against the run time of a position. Static modes, "
    "without training, show the error of the solver alone.",
    "decay": "STE error of flank lines over the number of full solves, four points per doubling. The greedy sampling "
    "goes on beyond the tolerance of the case.",
    "estimate": f"Error estimate against true error at all unseen states. Solid: equal; dashed: {LOW:g} and {HIGH:g} "
    f"times; dotted: {SMALLEST_ERROR_UM:g} µm, below which errors are not counted.",
}


@brief
@dataclass(frozen=True)
class Comparison:
    """Reductions and samplings at equal conditions."""

    case: Case
    truth: Truth
    # Plain data of each reduction, in the order of the table: `pmor.lab.comparison.measure.effort` and `worth`, and
    # ``online_ms``, ``online_without_ms`` per position, with and without the error estimate
    entries: tuple[Row, ...]
    curves: Curves
    failures: tuple[str, ...]  # States that did not converge anywhere
    seconds: float  # Wall time of the run

    def data(self) -> dict[str, Any]:
        """Return everything that was measured as plain data."""
        states, curves = self.truth.states, self.curves
        return {
            "case": self.case.name,
            "states": [states.where(i) | {"ste_um": ste} for i, ste in enumerate(self.truth.ste_um.tolist())],
            "entries": self.entries,
            "decay": curves.points,
            "greedy_estimate": [{"solves": n, "percent": percent} for n, percent in curves.estimate],
            "target_percent": curves.target_percent,
            "solves_to_target": {name: curves.reached(name) for name in curves.points},
            "failures": list(self.failures),
            "machine": machine(),
            "seconds": self.seconds,
        }

    def write(self, folder: Path | str, *, overwrite: bool = False) -> None:
        """Write `reductions.json`, `reductions.md`, `reductions.html` and the pictures; remove finished reductions."""
        title = f"Reductions and error bars: {self.case.title}"
        report = Report("reductions", self.data(), title, list(self._blocks()), self.case, page="reductions.html")
        with writing_results(folder, FILES, self.case.text, overwrite=overwrite) as held:
            report.write(held)

    def __str__(self) -> str:
        """The table, and the solves that an accuracy takes."""
        whole = table("", {**ENTRY, **EFFORT, **WORTH}, self.entries)
        lines = [*text_lines(whole), "", *self._reached(), *(f"! {failure}" for failure in self.failures)]
        return "\n".join([f"Reductions: {self.case.title}", *(f"  {line}" for line in lines)])

    def _reached(self) -> Iterator[str]:
        """Say how many solves each sampling takes to the tolerance."""
        curves = self.curves
        greedy, goal = curves.reached("greedy"), f"at most {curves.target_percent:g} % everywhere"
        for name in SAMPLINGS:
            solves = curves.reached(name)
            if solves is None:
                most = max(p["solves"] for p in curves.points[name])
                yield f"{SAMPLING_NAMES[name]}: not {goal} with up to {most} solves"
            else:
                ratio = f", {solves / greedy:.2g} times the greedy ones" if greedy and name != "greedy" else ""
                yield f"{SAMPLING_NAMES[name]}: {goal} with {solves} solves{ratio}"

    def _blocks(self) -> Iterator[Block]:
        case = self.case
        free = [name for name in PARAMETERS if len(getattr(case.offline, name)) > 1]
        ranges = ((NAMES[name], getattr(case.offline, name)) for name in free)
        declared = ", ".join(f"{name} {v[0]:g} to {v[-1]:g} {unit}" for (name, unit), v in ranges)
        axes = " x ".join(["angles", *(NAMES[name][0] for name in free)])

        def picture(name: str, figure: Any) -> Picture:
            return Picture(f"{name}.png", CAPTIONS[name], figure)

        yield from (Warning(f"not converged: {failure}") for failure in self.failures)
        yield (
            f"The reductions of this program over one pitch and all ranges of the case ({declared or 'one torque'}), "
            f"each made from at most {case.offline.solves} full solves, and compared with full FE on the same mesh "
            f"({case.mesh.profile_elements} x {case.mesh.width_elements} elements on a flank) at "
            f"{len(self.truth.states.phi)} states that none of them was trained at. {format_time(self.seconds)} in all."
        )
        yield table("Cost", {**ENTRY, **EFFORT}, self.entries, (
            f"Training: sampling and number of its solves; of a grid the numbers of {axes}. Offline: full solves, "
            "their choice and the basis with its file, one thread; finite elements, the same for all, not included. "
            "Online: median over sweeps of 200 angles, per position. In parentheses: added by the error estimate."
        ))  # fmt: skip
        yield table("Accuracy", {**ENTRY, **WORTH}, self.entries, WORTH_NOTE)
        yield (
            "The default is flank_lines with the [offline] sampling of the case: nothing is interpolated over the "
            "angle or any parameter, so that any training serves it, and the greedy sampling follows its error "
            "estimate."
        )
        yield picture("error_run_time", run_time_figure(self.entries))
        yield Heading("Solves that an accuracy takes")
        yield from (f"{sentence[0].upper()}{sentence[1:]}." for sentence in self._reached())
        yield picture("decay", decay_figure(self.curves))
        yield Heading("Error estimate")
        yield picture("estimate", estimate_figure(self.entries))


def _unbroken(text: str) -> str:
    """Text that stays on one line; the table may scroll."""
    return text.replace(" ", "\u00a0")


def _joined(*values: float | None) -> str:
    return _unbroken(" / ".join(map(_short, values)))


def _spread(row: Row) -> str:
    quantiles = _joined(row["low"], row["median"], row["high"])
    return f"{quantiles}\u00a0({row['states']})" if row["states"] else DASH


def _fixed(value: float | None, factor: float, digits: int) -> str:
    return DASH if value is None else f"{factor * value:.{digits}f}"


def _with_estimate(without: float, with_it: float) -> str:
    return _unbroken(f"{_short(without)} ({100.0 * (with_it / without - 1.0):+.0f} %)")


def _short(value: float | None) -> str:
    """Three digits, or a dash."""
    return DASH if value is None or value != value else f"{value:.3g}"
