"""The picture of the matrix: the law of the penalty."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from pmor.report.style import COLOURS, new_figure, plot_style

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def penalty_figure(penalties: Sequence[float], above_limit_um: Sequence[float]) -> Figure:
    """STE above its penalty-free limit over the penalty, with the line of slope -1 through the stiffest ones."""
    penalty, above = np.array(penalties), np.array(above_limit_um)
    with plot_style():
        figure = new_figure(7.2, 4.0)
        axes = figure.add_subplot()
        shown = above > 0.0
        axes.loglog(penalty[shown], above[shown], "o-", color=COLOURS[0], label="STE minus its limit, median")
        anchor = np.flatnonzero(shown & (penalty >= 1e8))
        if len(anchor):
            line = above[anchor[0]] * penalty[anchor[0]] / penalty
            axes.loglog(penalty, line, "--", color=COLOURS[1], label="1/k")
        axes.set_xlabel("Contact penalty k [N/mm³]")
        axes.set_ylabel("STE above the limit k → ∞ [µm]")
        axes.legend()
    return figure
