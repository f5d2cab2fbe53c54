"""Pictures of the matrix: the law of the penalty, and Newton steps and condition over all variants."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from pmor.lab.stability.measure import MOST_STEPS, Entry
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


def steps_figure(entries: tuple[Entry, ...]) -> Figure:
    """Newton steps over the condition of the Newton matrix, one marker per variant."""
    points = [(e.condition, e.newton_steps, e.ok) for e in entries if e.condition and e.newton_steps is not None]
    with plot_style():
        figure = new_figure(7.2, 3.6)
        axes = figure.add_subplot()
        for good, colour, label in ((True, COLOURS[0], "ok"), (False, COLOURS[1], "failed")):
            chosen = [(condition, steps) for condition, steps, ok in points if ok is good]
            if chosen:
                axes.semilogx(*zip(*chosen, strict=True), "o", ms=4, color=colour, alpha=0.7, label=label)
        axes.axhline(MOST_STEPS, color="0.4", ls="--", lw=1.0, label=f"allowed: {MOST_STEPS}")
        axes.set_ylim(0, None)
        axes.set_xlabel("Condition of the Newton matrix (estimate)")
        axes.set_ylabel("Newton steps, largest")
        axes.legend(loc="lower right")
    return figure
