"""The result of a matrix: its files, page and summary."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pmor.case import Case
from pmor.core.progress import format_time
from pmor.core.shown import brief
from pmor.lab.stability.matrix import matrix
from pmor.lab.stability.measure import MOST_STEPS, Entry
from pmor.lab.stability.variants import REFERENCES
from pmor.report.chart import COLOURS
from pmor.report.page import Block, Heading, Picture, Warning
from pmor.report.style import log_log, new_figure, plot_style
from pmor.report.table import Columns, Table, table, two_digits
from pmor.work.results import Report, writing_results

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: files that `Stability.write` may leave
FILES = ("stability.json", "stability.md", "report.html", "penalty.png")
MEANINGS = (
    ("result", f"ok: converged everywhere in at most {MOST_STEPS} Newton steps, balanced, and as close to its "
     "reference as it should be; refused: a check before the solution says why; limit: solved, with a warning that "
     "it is not to be trusted; failed: the note says why"),
    ("steps", "largest number of Newton steps at any position; of a reduced model, of its sweep"),
    ("condition", "condition number of the matrix that a Newton step factors, 1-norm, estimated"),
    ("difference", "largest difference of the STE to the reference, over the mean of that"),
    *((f"against: {word}", text) for word, text in REFERENCES.items() if word != "nothing"),
    ("torque", "moment of the nodal forces about the pinion's axis against the applied torque, relative"),
    ("STE", "mean over the positions"),
)  # fmt: skip


@dataclass(frozen=True)
class PenaltyLaw:
    """Convergence of the STE to its limit as the penalty grows."""

    penalty: tuple[float, ...]  # N/mm^3
    # STE minus its penalty-free limit, median over the positions, um: where a tip corner or a single point carries the
    # load, the set of points that carry changes up to a higher penalty
    above_limit_um: tuple[float, ...]
    limit_um: float  # STE without penalty, median over the positions, um
    exponent: float  # Fitted over the stiff ones, down to the error of the solver; -1 is the law of a series spring


@brief
@dataclass(frozen=True)
class Stability:
    """Entries of the variants of a case."""

    case: Case  # As it was given
    base: Case  # The case that the variants change
    entries: tuple[Entry, ...]
    law: PenaltyLaw | None  # None when the penalties were not run, or did not converge
    seconds: float  # Wall time of the run

    @property
    def failures(self) -> tuple[str, ...]:
        """Variants that are neither ok nor explained, and why."""
        return tuple(f"{entry.name}: {entry.note}" for entry in self.entries if not (entry.ok or entry.explained))

    def write(self, folder: Path | str, *, overwrite: bool = False) -> None:
        """Write `stability.json`, `stability.md`, `report.html` and the pictures; remove finished variants."""
        data = {
            "case": self.case.name,
            "entries": [asdict(entry) for entry in self.entries],
            "n_entries": len(self.entries),
            "n_failed": len(self.failures),
            "penalty_exponent": None if self.law is None else self.law.exponent,
            "ste_penalty_free_um": None if self.law is None else self.law.limit_um,
            "seconds": self.seconds,
        }
        report = Report("stability", data, f"Stability: {self.case.title}", list(self._blocks()), self.case)
        with writing_results(folder, FILES, self.case.text, overwrite=overwrite) as held:
            report.write(held)

    def __str__(self) -> str:
        """The verdicts, and whatever did not hold."""
        steps = max((e.newton_steps for e in self.entries if e.newton_steps is not None), default=None)
        lines = [f"Stability: {self.case.title}", f"  {self._counts()}"]
        if steps is not None:
            lines.append(f"  {steps} Newton steps at most, {MOST_STEPS} allowed")
        if self.law is not None:
            lines.append(f"  STE above its penalty-free limit falls as k^{self.law.exponent:.3f}")
        return "\n".join([*lines, *(f"  ! {failure}" for failure in self.failures)])

    def _counts(self) -> str:
        ok, explained = sum(e.ok for e in self.entries), sum(e.explained for e in self.entries)
        return f"{len(self.entries)} variants: {ok} ok, {explained} explained limits, {len(self.failures)} failed"

    def _blocks(self) -> Iterator[Block]:
        base = self.base
        yield from map(Warning, self.failures)
        yield (
            f"Each variant of the case is far from the usual in one respect. {self._counts()}; "
            f"{format_time(self.seconds)} in all. Base: {base.mesh.profile_elements} x {base.mesh.width_elements} "
            f"elements on a flank, {base.torque_Nm:g} N m. Full FE is solved at eight positions over a pitch, exact "
            "entry and exit of a pair among them."
        )
        yield Table("Columns", ("column", "meaning"), MEANINGS)
        if self.law is not None:
            caption = (
                "STE minus its penalty-free limit, median over the positions. A soft penalty widens the contact; a "
                f"stiff one is a spring in series with the teeth: fitted exponent {self.law.exponent:.3f}."
            )
            yield Heading("Penalty")
            yield Picture("penalty.png", caption, _penalty_figure(self.law))
        yield Heading("All variants")
        columns = _columns({variant.name: variant.against for variant in matrix(base)})
        for group in dict.fromkeys(entry.group for entry in self.entries):
            own = [entry for entry in self.entries if entry.group == group]
            yield table(group, columns, own)
            yield from (f"{entry.name}: {entry.note}." for entry in own if entry.note)


def verdict(entry: Entry) -> str:
    """Return ok, refused, limit (both explained) or failed."""
    if entry.explained:
        return "refused" if entry.converged is None else "limit"
    return "ok" if entry.ok else "failed"


def _columns(against: dict[str, str]) -> Columns:
    return {
        # Names stay on one line; the table may scroll instead.
        "variant": lambda e: e.name.replace(" ", "\u00a0"),
        "result": verdict,
        "steps": lambda e: e.newton_steps,
        "condition": lambda e: two_digits(e.condition),
        "difference": lambda e: two_digits(e.difference_rel),
        "against": lambda e: "" if e.difference_rel is None else against.get(e.name, ""),
        "torque": lambda e: two_digits(e.torque_balance_rel),
        "STE, µm": lambda e: e.ste_mean_um,
        "s": lambda e: round(e.seconds, 1),
    }


def _penalty_figure(law: PenaltyLaw) -> Figure:
    """STE above its penalty-free limit over the penalty, with the line of slope -1 through the stiffest ones."""
    penalty, above = np.array(law.penalty), np.array(law.above_limit_um)
    with plot_style():
        figure = new_figure(7.2, 4.0)
        axes = figure.add_subplot()
        shown = above > 0.0
        axes.loglog(penalty[shown], above[shown], "o-", color=COLOURS[0], label="STE minus its limit, median")
        anchor = np.flatnonzero(shown & (penalty >= 1e8))
        if len(anchor):
            line = above[anchor[0]] * penalty[anchor[0]] / penalty
            axes.loglog(penalty, line, "--", color=COLOURS[1], label="1/k")
        log_log(axes)
        axes.set(xlabel="Contact penalty k [N/mm³]", ylabel="STE above the limit k → ∞ [µm]")
        axes.legend()
    return figure
