"""The matrix of what can be asked of which machine, from the one table of refusals.

    python -m tests.programs.capability_page [FILE]

writes it to `cases/manual/capabilities.md`, or a file. Each row is the machine that `tests.support.matrix` writes; a
test runs every cell.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import pmor
from pmor.case.capability import ASKED, NAMES, why_not
from tests.support.matrix import ROWS, written_row

PAGE = "cases/manual/capabilities.md"
HEAD = """# What can be asked of which machine

`python -m tests.programs.capability_page` makes this page from the table of refusals in `pmor/case/capability.py`; a
test runs every cell on a small machine. A number is a reason below, in the words of the program; `pmor plan` says the
same of a file of one's own.
"""


def page() -> str:
    """Return the page."""
    reasons: list[str] = []
    lines = ["| machine | " + " | ".join(NAMES[asked].replace(",", "") for asked in ASKED) + " |",
             "| --- |" + " :-: |" * len(ASKED)]  # fmt: skip
    for row in ROWS:
        with tempfile.TemporaryDirectory() as folder:
            machine = pmor.load(written_row(row, Path(folder)))
            cells = [_cell(why_not(machine, asked), reasons) for asked in ASKED]
        lines.append(f"| {row} | {' | '.join(cells)} |")
    numbered = [f"{number}. {reason[0].upper()}{reason[1:]}." for number, reason in enumerate(reasons, start=1)]
    return "\n".join([HEAD, *lines, "", *numbered]) + "\n"


def _cell(why: str, reasons: list[str]) -> str:
    if not why:
        return "✓"
    if why not in reasons:
        reasons.append(why)
    return str(reasons.index(why) + 1)


def main(path: str = PAGE) -> None:
    """Write the page."""
    Path(path).write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
