"""The picture of a ladder of meshes: error over elements and over time."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from pmor.lab.convergence.run import ELEMENTS, PLANE, PROFILE_ELEMENTS, QUANTITIES, Convergence, Level
from pmor.report.panels import log_log, panels
from pmor.report.style import COLOURS

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def convergence_figure(found: Convergence) -> Figure:
    """Largest error over elements along the profile and over time; solid over the width, dashed in plane strain."""
    widths = list(dict.fromkeys(level.width for level in found.levels))
    with panels(2, 9.0, 4.4, legend=3, sharey=True) as (figure, (over_elements, over_time)):
        for element, colour in zip(ELEMENTS, COLOURS, strict=False):
            for width in widths:
                levels = [v for v in found.levels if (v.element, v.width) == (element, width) and not v.reason]
                known = [(level, error) for level in levels if (error := _largest(found, level)) > 0.0]
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


def _largest(found: Convergence, level: Level) -> float:
    errors = (found.error_percent(level, q) for q in QUANTITIES if q != "ste_peak_to_peak_um")
    return max((abs(error) for error in errors if error is not None), default=0.0)
