"""The result of a ladder of meshes: its files, page, picture and summary."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pmor.case import Case
from pmor.core.shown import brief
from pmor.report.chart import COLOURS
from pmor.report.page import Block, Picture, Warning
from pmor.report.style import log_log, panels
from pmor.report.table import Columns, Table, table, text_lines, two_digits
from pmor.work.results import Report, writing_results

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: files that `Convergence.write` leaves, the picture where a limit is known
FILES = ("convergence.json", "convergence.md", "report.html", "convergence.png")
ELEMENTS = ("hex20", "hex8i", "hex8")
PROFILE_ELEMENTS = (4, 8, 16, 32, 64)
PLANE = "plane_strain"
WIDTHS = {PLANE: "Plane strain", "half": "Half the face width", "whole": "The whole face width"}
#: transmission errors that are held against their limits, and their names
QUANTITIES = {
    "ste_pitch_point_um": "pitch point",
    "ste_mid_double_contact_um": "double contact",
    "ste_mean_um": "mean",
    "ste_peak_to_peak_um": "peak-to-peak",
}


@dataclass(frozen=True)
class Level:
    """A mesh of the ladder with its results."""

    width: str  # Part of the face width that is meshed (`pmor.case.width`)
    element: str
    # Elements over the profile, and over the meshed width
    n_profile: int
    n_width: int
    # At the pitch point, in the middle of double contact, over the pitch; None where it was skipped
    ste_pitch_point_um: float | None = None
    ste_mid_double_contact_um: float | None = None
    ste_mean_um: float | None = None
    ste_peak_to_peak_um: float | None = None
    offline_s: float | None = None  # Wall time of meshing and finite elements
    reason: str = ""  # Why it was skipped, if it was


@brief
@dataclass(frozen=True)
class Convergence:
    """Levels of a ladder of meshes, and their limits."""

    case: Case
    levels: tuple[Level, ...]
    limits: dict[tuple[str, str], float]  # Extrapolated, um, by width and quantity
    failures: tuple[str, ...] = ()  # Meshes that did not converge, and why

    def error_percent(self, level: Level, quantity: str) -> float | None:
        """Return the distance of a mesh from the limit of a quantity, % of it."""
        value, limit = getattr(level, quantity), self.limits.get((level.width, quantity))
        return None if value is None or limit is None else 100.0 * (value / limit - 1.0)

    def write(self, folder: Path | str, *, overwrite: bool = False) -> None:
        """Write `convergence.json`, `convergence.md`, `report.html` and the picture; remove finished meshes."""
        data = {
            "case": self.case.name,
            "levels": [self._row(level) for level in self.levels],
            "failures": list(self.failures),
            "limits": [{"width": w, "quantity": q, "limit_um": limit} for (w, q), limit in self.limits.items()],
        }
        caption = (
            "Largest error of the STE at the pitch point, in the middle of double contact and on the mean, against the "
            "limit, over elements along the profile and over the time of the finite elements."
        )
        # Without a limit, or with all meshes skipped, there is nothing to draw on logarithmic axes.
        drawn = any(_largest(self, level) for level in self.levels)
        blocks: list[Block] = [
            *map(Warning, self.failures),
            "The STE by exact line loads on finer and finer meshes of the bodies, against its limit: Aitken's "
            f"extrapolation of the three finest quadratic meshes, at {self.case.torque_Nm:g} N m. "
            "Over the width there are half as many elements as along the profile; a row counts those that are meshed.",
            *([Picture("convergence.png", caption, _figure(self))] if drawn else []),
            *self._tables(),
        ]
        report = Report("convergence", data, f"Mesh convergence: {self.case.title}", blocks, self.case)
        with writing_results(folder, FILES, self.case.text, overwrite=overwrite) as held:
            report.write(held)

    def __str__(self) -> str:
        """The tables for the screen."""
        lines = [f"Mesh convergence: {self.case.title}"]
        for shown in self._tables():
            lines += [f"  {shown.title}", *(f"    {line}" for line in text_lines(shown))]
        return "\n".join([*lines, *(f"  ! {failure}" for failure in self.failures)])

    def _row(self, level: Level) -> dict[str, Any]:
        errors = {f"{q.removesuffix('_um')}_error_percent": self.error_percent(level, q) for q in QUANTITIES}
        row = asdict(level)
        return row | errors | {"skipped": row.pop("reason") or None}

    def _tables(self) -> Iterator[Table]:
        for width in dict.fromkeys(level.width for level in self.levels):
            own = [level for level in self.levels if level.width == width]
            skipped = [f"{v.element} {v.n_profile} x {v.n_width} ({v.reason})" for v in own if v.reason]
            limits = [f"{name} {self.limits[width, q]:.5g}" for q, name in QUANTITIES.items()
                      if (width, q) in self.limits]  # fmt: skip
            note = f"Limits, µm: {', '.join(limits)}." + (f" Skipped: {'; '.join(skipped)}." if skipped else "")
            yield table(WIDTHS[width], self._columns(), [level for level in own if not level.reason], note)

    def _columns(self) -> Columns:
        def error(quantity: str) -> Any:
            # The extrapolated limit is worth no more than two digits.
            return lambda level: two_digits(self.error_percent(level, quantity))

        return {
            "element": attrgetter("element"),
            "elements": lambda level: f"{level.n_profile} x {level.n_width}",
            **{f"{name}, µm": attrgetter(quantity) for quantity, name in QUANTITIES.items()},
            **{f"{name}, %": error(quantity) for quantity, name in QUANTITIES.items()},
            "finite elements, s": attrgetter("offline_s"),
        }


def _figure(result: Convergence) -> Figure:
    """Largest error over elements along the profile and over time; solid over the width, dashed in plane strain."""
    with panels(2, 9.0, 4.4, legend=3, sharey=True) as (figure, (over_elements, over_time)):
        for element, colour in zip(ELEMENTS, COLOURS, strict=False):
            for width in dict.fromkeys(level.width for level in result.levels):
                levels = [v for v in result.levels if (v.element, v.width) == (element, width)]
                known = [(level, error) for level in levels if (error := _largest(result, level)) > 0.0]
                errors = [error for _, error in known]
                line: dict[str, Any] = {"color": colour, "ls": "--" if width == PLANE else "-", "marker": "o", "ms": 4,
                                        "mfc": "none" if width == PLANE else colour}  # fmt: skip
                name = f"{element}, {'plane strain' if width == PLANE else f'{width} width'}"
                over_elements.plot([level.n_profile for level, _ in known], errors, label=name, **line)
                over_time.plot([level.offline_s or math.nan for level, _ in known], errors, label=name, **line)
        log_log(over_elements, PROFILE_ELEMENTS)
        log_log(over_time)
        over_elements.set_xlabel("Elements along the profile")
        over_time.set_xlabel("Time of the finite elements [s]")
        over_elements.set_ylabel("Largest error of the STE [%]")
    return figure


def _largest(result: Convergence, level: Level) -> float:
    errors = (result.error_percent(level, q) for q in QUANTITIES if q != "ste_peak_to_peak_um")
    return max((abs(error) for error in errors if error is not None), default=0.0)
