"""The table of published figures and ours, as a page."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from pmor.core.version import __version__
from pmor.report.markdown import write_markdown
from pmor.report.page import Block
from pmor.report.table import Columns, table
from pmor.validation.bodies import BODIES
from pmor.validation.calculix import root_stress, transmission_error
from pmor.validation.check import Check
from pmor.validation.machines import bearings, losses
from pmor.validation.motion import benchmark
from pmor.validation.programs import load_over_the_face, public_pairs, relief_without_load
from pmor.validation.sheets import data_sheets, geometry, standards

#: themes of the table, each with what makes its rows
THEMES: dict[str, Callable[[], list[Check]]] = {
    "data sheets": data_sheets,
    "geometry": geometry,
    "standards": standards,
    "load over the face": load_over_the_face,
    "relief": relief_without_load,
    "transmission error": transmission_error,
    "public pairs": public_pairs,
    "root stress": root_stress,
    "bearings": bearings,
    "losses": losses,
    "motion": benchmark,
}
SUMMARY: Columns = {
    "theme": lambda theme: theme[0],
    "figures": lambda theme: len(theme[1]),
    "largest difference, %": lambda theme: f"{max((100.0 * one.difference for one in theme[1]), key=abs):+.4f}",
    "too far": lambda theme: sum(not check.holds for check in theme[1]),
}
COLUMNS: Columns = {
    "quantity": lambda check: check.quantity,
    "unit": lambda check: check.unit,
    "theirs": lambda check: f"{check.theirs:.7g}",
    "pmor": lambda check: f"{check.ours:.{digits_of(check.theirs)}g}",
    "difference, %": lambda check: f"{100.0 * check.difference:+.4f}",
    "allowed, %": lambda check: f"{100.0 * check.tolerance:.2g}",
    "source": lambda check: check.source,
}
WORDS = (
    f"`pmor lab validation` made this page with pmor {__version__}: each row is computed anew. *Allowed* is "
    "what digits and method of the source leave open; a test asks whether each row keeps to it. An *independent "
    "script* shares no code with pmor and follows the standard or the drawing. Runs of CalculiX take minutes: their "
    "figures are recorded, and `pytest -m slow tests/verification` makes them anew. SAP, LPSTC and HPSTC: start of the "
    "active profile, lowest and highest point of single tooth contact."
)
BESIDE = (
    "Identities, limits and twins that have no published figure (patch tests, symmetry, balance of forces and energy, "
    "Hertz's law, strips on a wedge, flank coordinates against py_gearworks, exact derivatives) are tests in "
    "`tests/verification`. The claims of Cosco et al. (ISMA 2016) about their own method are judged by [a study]"
    "(../results/study/study.md)."
)


def digits_of(value: float) -> int:
    """Return the significant digits of ours that are shown beside a figure: one more than it has, four at least."""
    return max(len(f"{abs(value):.7g}".replace(".", "").strip("0")) + 1, 4)


def write_page(path: Path) -> list[Check]:
    """Compute all rows, write the page, and return the rows."""
    themes = {name: rows() for name, rows in THEMES.items()}
    checks = [check for rows in themes.values() for check in rows]
    blocks: list[Block] = [
        WORDS, table("By theme", SUMMARY, themes.items()), table("All figures", COLUMNS, checks), *BODIES, BESIDE,
    ]  # fmt: skip
    write_markdown(path, "Validation", blocks)
    return checks
