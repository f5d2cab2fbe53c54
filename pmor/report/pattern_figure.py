"""Picture of the contact pressure on unrolled flanks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from pmor.report.panels import panels
from pmor.results.root_stress import GEARS
from pmor_online.contact_pattern import ContactPattern

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def contact_pattern_figure(patterns: Sequence[ContactPattern]) -> Figure:
    """Contact pressure on the unrolled flanks, a panel per tooth pair, one scale for all."""
    n = len(patterns)
    if n == 0:
        raise ValueError("no tooth pair to show a contact pattern for")
    with panels(n, 1.6 + 3.0 * n, 4.2, sharey=True) as (figure, columns):
        top = float(np.nanmax([1.0, *(pattern.largest for pattern in patterns)]))
        for panel, pattern in zip(columns, patterns, strict=True):
            loaded = np.ma.masked_less_equal(pattern.pressure, 0.0)
            image = panel.pcolormesh(
                pattern.width, np.degrees(pattern.roll_angle), loaded, vmin=0.0, vmax=top, edgecolors="none"
            )
            panel.set_facecolor("#f4f4f4")
            panel.grid(False)
            title = f"{GEARS[pattern.gear].capitalize()} flank, {100 * pattern.share:.0f} % of torque\n"
            at_most = "a sharp edge carries all" if np.isnan(pattern.largest) else f"largest {pattern.largest:.0f} MPa"
            title += at_most if pattern.pressure.any() else "no contact"
            panel.set(title=title, xlabel="Position over face width [mm]")
        columns[0].set_ylabel("Roll angle along the profile [deg]\n(root to tip)")
        at_edge = any(pattern.at_edge for pattern in patterns)
        extend = "max" if at_edge else "neither"
        figure.colorbar(image, ax=columns, label="Contact pressure [MPa]", shrink=0.9, extend=extend)
        if at_edge:
            words = "Beyond the scale: a sharp tip edge carries, at which the pressure has no bound"
            figure.supxlabel(words, fontsize=9)
    return figure
