"""Everything that a ladder of meshes leaves in its folder, and the summary on the screen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

from pmor.lab.convergence.figures import convergence_figure
from pmor.lab.convergence.run import PLANE, QUANTITIES, Convergence, Level
from pmor.report.page import Block, Picture
from pmor.report.table import Table
from pmor.storage.results_folder import remove_working_folder
from pmor.work.pieces import PARTS
from pmor.work.results import Report
from pmor.work.table import Columns, table, text_lines

#: what `write_convergence` may leave
FILES = ("convergence.json", "convergence.md", "report.html", "convergence.png")
WIDTHS = {PLANE: "Plane strain", "half": "Half the face width", "whole": "The whole face width"}


def write_convergence(found: Convergence, out: Path) -> None:
    """Write `convergence.json`, `convergence.md`, `report.html` and the picture; finished meshes are given up.

    Parameters
    ----------
    found : Convergence
    out : Path

    Raises
    ------
    OutputError
    """
    content = {
        "case": found.case.name,
        "levels": [_row(found, level) for level in found.levels],
        "limits": [
            {"width": width, "quantity": quantity, "limit_um": limit}
            for (width, quantity), limit in found.limits.items()
        ],
    }
    Report("convergence", content, f"Mesh convergence: {found.case.title}", _blocks(found), found.case).write(out)
    remove_working_folder(out / PARTS)


def convergence_text(found: Convergence) -> str:
    """Return the tables for the screen."""
    lines = [f"Mesh convergence: {found.case.title}"]
    for shown in _tables(found):
        lines += [f"  {shown.title}", *(f"    {line}" for line in text_lines(shown))]
    return "\n".join(lines)


def _row(found: Convergence, level: Level) -> dict[str, Any]:
    errors = {f"{q.removesuffix('_um')}_error_percent": found.error_percent(level, q) for q in QUANTITIES}
    row = asdict(level)
    return row | errors | {"left_out": row.pop("reason") or None}


def _blocks(found: Convergence) -> list[Block]:
    case = found.case
    caption = (
        "Largest error of the STE at the pitch point, in the middle of double contact and on the mean, against the "
        "limit, over elements along the profile and over the time of the finite elements."
    )
    return [
        "The STE by exact line loads on finer and finer meshes of the bodies, against its limit: Aitken's "
        f"extrapolation of the three finest quadratic meshes, at {case.torque_Nm:g} N m. "
        "Over the width there are half as many elements as along the profile; a row counts those that are meshed.",
        Picture("convergence.png", caption, convergence_figure(found)),
        *_tables(found),
    ]


def _tables(found: Convergence) -> Sequence[Table]:
    shown = []
    for width in dict.fromkeys(level.width for level in found.levels):
        rows = [level for level in found.levels if level.width == width and not level.reason]
        lost = [f"{v.element} {v.n_profile} x {v.n_width} ({v.reason})" for v in found.levels
                if v.width == width and v.reason]  # fmt: skip
        limits = ", ".join(
            f"{name} {found.limits[width, q]:.5g}" for q, name in QUANTITIES.items() if (width, q) in found.limits
        )
        note = f"Limits, µm: {limits}." + (f" Left out: {'; '.join(lost)}." if lost else "")
        shown.append(table(WIDTHS[width], _columns(found), rows, note))
    return shown


def _columns(found: Convergence) -> Columns:
    def off(quantity: str) -> Any:
        return lambda level: _short(found.error_percent(level, quantity))

    def value(quantity: str) -> Any:
        return lambda level: getattr(level, quantity)

    return {
        "element": lambda level: level.element,
        "elements": lambda level: f"{level.n_profile} x {level.n_width}",
        **{f"{name}, µm": value(quantity) for quantity, name in QUANTITIES.items()},
        **{f"{name}, %": off(quantity) for quantity, name in QUANTITIES.items()},
        "finite elements, s": lambda level: level.offline_s,
    }


def _short(value: float | None) -> float | None:
    """Two digits: the extrapolated limit is worth no more."""
    return None if value is None else float(f"{value:.2g}")
