"""Everything that a run of the matrix leaves in its folder, and the summary on the screen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path

from pmor.core.progress import format_time
from pmor.lab.stability.figures import penalty_figure, steps_figure
from pmor.lab.stability.matrix import matrix
from pmor.lab.stability.measure import MOST_STEPS, Entry
from pmor.lab.stability.run import Stability
from pmor.lab.stability.variants import REFERENCES
from pmor.report.page import Block, Heading, Picture, Warning
from pmor.report.table import Table
from pmor.storage.results_folder import remove_working_folder
from pmor.work.pieces import PARTS
from pmor.work.results import Report
from pmor.work.table import Columns, table

#: what `write_stability` may leave
FILES = ("stability.json", "stability.md", "report.html", "penalty.png", "steps.png")


def write_stability(stability: Stability, seconds: float, out: Path) -> None:
    """Write `stability.json`, `stability.md`, `report.html` and the pictures; finished variants are given up.

    Parameters
    ----------
    stability : Stability
    seconds : float
        Wall time of the run.
    out : Path

    Raises
    ------
    OutputError
    """
    law = stability.law
    content = {
        "case": stability.case.name,
        "entries": [asdict(entry) for entry in stability.entries],
        "n_entries": len(stability.entries),
        "n_failed": len(stability.failed),
        "penalty_exponent": None if law is None else law.exponent,
        "ste_penalty_free_um": None if law is None else law.limit_um,
        "seconds": seconds,
    }
    title = f"Stability: {stability.case.title}"
    Report("stability", content, title, _blocks(stability, seconds), stability.case).write(out)
    remove_working_folder(out / PARTS)


def stability_text(stability: Stability) -> str:
    """Return the short summary for the screen: the verdicts, and whatever did not hold."""
    entries = stability.entries
    steps = max((e.newton_steps for e in entries if e.newton_steps is not None), default=None)
    lines = [
        f"Stability: {stability.case.title}",
        f"  {len(entries)} variants: {sum(e.ok for e in entries)} ok, {sum(e.explained for e in entries)} explained "
        f"limits, {len(stability.failed)} failed",
    ]
    if steps is not None:
        lines.append(f"  {steps} Newton steps at most, {MOST_STEPS} allowed")
    if stability.law is not None:
        lines.append(f"  STE above its penalty-free limit falls as k^{stability.law.exponent:.3f}")
    return "\n".join([*lines, *(f"  ! {entry.name}: {entry.note}" for entry in stability.failed)])


def verdict(entry: Entry) -> str:
    """Return ok, refused, limit (both explained) or failed."""
    if entry.explained:
        return "refused" if entry.converged is None else "limit"
    return "ok" if entry.ok else "failed"


def _blocks(stability: Stability, seconds: float) -> list[Block]:
    base, entries = stability.base, stability.entries
    against = {variant.name: variant.against for variant in matrix(base)}
    blocks: list[Block] = [Warning(f"{entry.name}: {entry.note}") for entry in stability.failed]
    blocks += [
        f"{len(entries)} variants of the case, each far from the usual in one respect: "
        f"{sum(e.ok for e in entries)} ok, {sum(e.explained for e in entries)} refused or warned "
        f"of before anything was solved, and {len(stability.failed)} failed; {format_time(seconds)} in all. "
        f"Base: {base.mesh.profile_elements} x {base.mesh.width_elements} elements on a flank, {base.torque_Nm:g} N m. "
        "Full FE is solved at eight positions over a pitch, exact entry and exit of a pair among them.",
        Table("What the columns mean", ("column", "meaning"), _meanings()),
    ]
    if stability.law is not None:
        caption = (
            "STE minus its penalty-free limit, median over the positions. A soft penalty widens the strip of contact; "
            f"a stiff one is a spring in series with the teeth: fitted exponent {stability.law.exponent:.3f}."
        )
        blocks += [Heading("Penalty"), Picture("penalty.png", caption, penalty_figure(stability.law))]
    if any(entry.condition for entry in entries):
        caption = "Newton steps over the condition of the matrix that they factor, largest of all positions."
        blocks.append(Picture("steps.png", caption, steps_figure(entries)))
    blocks.append(Heading("All variants"))
    columns = _columns(against)
    for group in dict.fromkeys(entry.group for entry in entries):
        own = [entry for entry in entries if entry.group == group]
        blocks += [table(group, columns, own), *(f"{entry.name}: {entry.note}." for entry in own if entry.note)]
    return blocks


def _columns(against: Mapping[str, str]) -> Columns:
    return {
        # Names stay on one line; the table may scroll instead.
        "variant": lambda e: e.name.replace(" ", "\u00a0"),
        "result": verdict,
        "steps": lambda e: e.newton_steps,
        "condition": lambda e: _short(e.condition),
        "difference": lambda e: _short(e.difference_rel),
        "against": lambda e: "" if e.difference_rel is None else against.get(e.name, ""),
        "energy": lambda e: _short(e.energy_balance_rel),
        "torque": lambda e: _short(e.torque_balance_rel),
        "STE, µm": lambda e: e.ste_mean_um,
        "s": lambda e: round(e.seconds, 1),
    }


def _short(value: float | None) -> float | None:
    """Two digits: what an order of magnitude is worth."""
    return None if value is None else float(f"{value:.2g}")


def _meanings() -> list[tuple[str, str]]:
    return [
        ("result", f"ok: converged everywhere in at most {MOST_STEPS} Newton steps, balanced, and as close to what it "
         "is held against as it should be; refused: a check before the solution says why; limit: solved, with "
         "a warning that it is not to be trusted; failed: the note says what"),
        ("steps", "largest number of Newton steps at any position; of a reduced model, of its sweep"),
        ("condition", "condition number of the matrix that a Newton step factors, 1-norm, estimated"),
        ("difference", "largest difference of the STE to what it is held against, over the mean of that"),
        *((f"against: {word}", text) for word, text in REFERENCES.items() if word != "nothing"),
        ("energy", "work of a torque that grows by 1 % against the energy that is stored, relative. The bilinear "
         "shares in which forces go to the nodes (the paper's) are not quite the derivative of the smooth gap: 1-2 % "
         "here, and 1e-7 with facets, where they are"),
        ("STE", "mean over the positions"),
        ("torque", "moment of the nodal forces about the pinion's axis against the applied torque, relative"),
    ]  # fmt: skip
