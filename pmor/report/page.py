"""Self-contained HTML pages, made of blocks: text, warnings, tables, pictures, a live model, designs to explore.

Styles are inline and pictures are data URIs: a page can be mailed, archived and printed without anything beside it.
The layout is in `templates`.

The section of provenance names machine and software of a run, and allows to repeat it.
"""

from __future__ import annotations

import base64
import hashlib
import json
import os
import platform
import re
import sys
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pmor.case import Case
from pmor.core.keeping import kernels_folder
from pmor.core.threads import linear_algebra_threads
from pmor.core.version import __version__
from pmor.report.chart import Chart
from pmor.report.live.motion import MotionSection
from pmor.report.live.section import LiveSection
from pmor.report.style import data_uri, picture_bytes
from pmor.report.svg import chart_file, chart_svgs, dark_rules
from pmor.report.svg_marks import unbroken
from pmor.report.table import Table, format_cell
from pmor.results.verdict import Verdict
from pmor.storage.atomic import atomic_path

if TYPE_CHECKING:
    from jinja2 import Template
    from matplotlib.figure import Figure

    from pmor.report.explorer import Designs


@dataclass(frozen=True)
class Heading:
    """A section's heading."""

    text: str


@dataclass(frozen=True)
class Warning:
    """A warning beside the numbers."""

    text: str


@dataclass(frozen=True)
class Picture:
    """A picture and the name of its file beside the page.

    Charts are drawn in milliseconds as SVG. By matplotlib a drawing takes longer than most results: file and page
    share it.
    """

    file_name: str
    caption: str
    figure: Chart | Figure
    drawn: dict[str, bytes] = field(default_factory=dict, repr=False, compare=False)

    @property
    def picture_format(self) -> str:
        """That of its file."""
        return self.file_name.rpartition(".")[2]

    def content(self, picture_format: str) -> bytes:
        """Return the content of a file of a format."""
        if picture_format not in self.drawn:
            if isinstance(self.figure, Chart) and picture_format == "svg":
                self.drawn[picture_format] = chart_file(self.figure)
            else:
                self.drawn[picture_format] = picture_bytes(_by_matplotlib(self.figure), picture_format)
        return self.drawn[picture_format]

    def clear(self) -> bool:
        """Whether it has no ground of its own."""
        return not isinstance(self.figure, Chart) and self.figure.patch.get_alpha() == 0.0

    def several(self) -> bool:
        """Whether a chart has more than one panel."""
        return isinstance(self.figure, Chart) and sum(panel.shown for panel in self.figure.panels) > 1

    def svgs(self) -> list[str]:
        """Return a chart as elements of a page, one after the other; nothing of what matplotlib draws."""
        return chart_svgs(self.figure) if isinstance(self.figure, Chart) else []


def _by_matplotlib(figure: Chart | Figure) -> Figure:
    if not isinstance(figure, Chart):
        return figure
    from pmor.report.replay import figure_of

    return figure_of(figure)


# Those that run: data are of another type.
SCRIPT = re.compile("<script>(.*?)</script>", re.DOTALL)
# What readers of the source are told, and pages need not carry.
COMMENT_LINE = re.compile(r"^ *//.*\n", re.MULTILINE)
#: parts of a page; text is a paragraph
Block = str | Heading | Verdict | Warning | Table | Picture
#: of the page of any machine, in the order of reading
THEMES = (
    "Gear data", "Change the pair", "Transmission error", "Stiffness and load sharing", "Flanks",
    "Losses and duty cycle", "Root stress", "Shafts and bearings", "Tolerances", "Accuracy and run time",
)  # fmt: skip


def by_theme(*parts: Mapping[str, Sequence[Any]]) -> dict[str, list[Any]]:
    """Return blocks of the parts of a page, by theme; within a theme part after part, none where there is no block."""
    themes = {theme: [block for part in parts for block in part.get(theme, ())] for theme in THEMES}
    return {theme: blocks for theme, blocks in themes.items() if blocks}


def themed(*parts: Mapping[str, Sequence[Any]]) -> list[Any]:
    """Return the blocks of the parts of a page below the headings of their themes."""
    return [shown for theme, blocks in by_theme(*parts).items() for shown in (Heading(theme), *blocks)]


def write_page(path: Path, title: str, blocks: Iterable[Block | LiveSection | MotionSection | Designs]) -> None:
    """Write a page; the target is replaced only when it is complete; OutputError where it cannot be."""
    page = page_html(title, blocks)
    with atomic_path(path) as temporary:
        temporary.write_text(page, encoding="utf-8")


def page_html(title: str, blocks: Iterable[Block | LiveSection | MotionSection | Designs]) -> str:
    """Return a page as text. Tables without rows are left out with their titles.

    Its policy of content security lets no script run but its own, told by their hashes, and nothing be fetched.
    """
    named = [(type(block).__name__, block) for block in blocks]
    page = html_template("page.html").render(title=title, blocks=named, kinds={name for name, _ in named})
    page = SCRIPT.sub(lambda script: COMMENT_LINE.sub("", script.group()), page)
    hashes = {base64.b64encode(hashlib.sha256(script.encode()).digest()).decode() for script in SCRIPT.findall(page)}
    allowed = " ".join(f"'sha256-{value}'" for value in sorted(hashes)) or "'none'"
    return page.replace("SCRIPTS", allowed, 1)


def html_template(name: str) -> Template:
    """Return a template of `pmor/report/templates`; values are escaped."""
    from jinja2 import Environment, FileSystemBytecodeCache, PackageLoader, StrictUndefined

    folder = kernels_folder()  # templates are compiled as well
    environment = Environment(
        loader=PackageLoader("pmor.report"), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True, keep_trailing_newline=True,
        bytecode_cache=None if folder is None else FileSystemBytecodeCache(str(folder)),
    )  # fmt: skip
    environment.filters.update(format_cell=format_cell, unbroken=unbroken, data_uri=data_uri, json_text=_json_text)
    environment.globals.update(dark_rules=dark_rules)
    return environment.get_template(name)


def _json_text(data: object) -> str:
    """Data for a script: no tag ends or begins in it."""
    text = json.dumps(data, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c")


def machine() -> dict[str, Any]:
    """Return names of processor, system and software, and the number of threads of linear algebra."""
    import h5py
    import numba
    import scipy

    return {
        "cpu": _cpu_model(), "cores": os.cpu_count(), "system": f"{platform.system()} {platform.machine()}",
        "python": sys.version.split()[0], "linear_algebra_threads": linear_algebra_threads(), "pmor": __version__,
        "numpy": np.__version__, "scipy": scipy.__version__, "numba": numba.__version__, "h5py": h5py.__version__
    }  # fmt: skip


def provenance(case: Case | None = None, measured_on: Mapping[str, Any] | None = None) -> list[Block]:
    """Return the section of a page: date, machine, software and case.

    Parameters
    ----------
    measured_on : mapping, optional
        Result of `machine` on the machine that measured the run times; by default this machine.
    """
    rows: list[tuple[str, Any]] = [("date", datetime.now(UTC).isoformat(timespec="seconds"))]
    rows += (machine() if measured_on is None else measured_on).items()
    if case is not None:
        rows.append(("case file, SHA-256", hashlib.sha256(case.text.encode()).hexdigest()))
    return [Heading("Provenance"), Table("Machine and software", ("item", "value"), rows, folded=True)]


def _cpu_model() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()
