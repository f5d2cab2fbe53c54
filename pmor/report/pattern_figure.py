"""Picture of the contact pressure on unrolled flanks."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from pmor.report.style import new_figure, plot_style
from pmor_online.contact_pattern import ContactPattern

if TYPE_CHECKING:
    from matplotlib.figure import Figure

GEARS = "Pinion", "Wheel"


def contact_pattern_figure(patterns: Sequence[ContactPattern]) -> Figure:
    """Contact pressure on the unrolled flanks, a panel per tooth pair, one scale for all."""
    with plot_style():
        n = len(patterns)
        if n == 0:
            raise ValueError("no tooth pair to show a contact pattern for")
        figure = new_figure(1.6 + 3.0 * n, 4.2)
        panels = np.atleast_1d(figure.subplots(1, n, sharey=True))
        top = max(float(pattern.pressure.max()) for pattern in patterns)
        for panel, pattern in zip(panels, patterns, strict=True):
            loaded = np.ma.masked_less_equal(pattern.pressure, 0.0)
            image = panel.pcolormesh(
                pattern.width, np.degrees(pattern.roll_angle), loaded, vmin=0.0, vmax=top or 1.0, edgecolors="none"
            )
            panel.set_facecolor("#f4f4f4")
            panel.grid(False)
            peak = float(pattern.pressure.max())
            title = f"{GEARS[pattern.gear]} flank, {100 * pattern.share:.0f} % of torque\n"
            panel.set_title(title + (f"peak {peak:.0f} MPa" if peak else "no contact"))
            panel.set_xlabel("Position over face width [mm]")
        panels[0].set_ylabel("Roll angle along the profile [deg]\n(root to tip)")
        figure.colorbar(image, ax=list(panels), label="Contact pressure [MPa]", shrink=0.9)
    return figure
