"""Picture of the conditions that a case lists: peak-to-peak over the torque, and the curves."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from pmor.report.panels import panels
from pmor.report.style import COLOURS, legend_label
from pmor.report.sweep_figures import periodic
from pmor.results.sweep import SteSweep, peak_to_peak_um
from pmor_online.conditions import ConditionSweep

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Letters of a name that a legend has room for.
LONGEST_NAME = 28
# The last colour, black, is that of the case's own condition.
MOST_COLOURED = len(COLOURS) - 1


def conditions_figure(own: SteSweep, nominal: int, conditions: Sequence[ConditionSweep]) -> Figure:
    """Peak-to-peak STE over the torque, and STE over the angle at each one's own torque, a colour per condition.

    Of more conditions than there are colours those with the least peak-to-peak at their own torque are in colour, and
    the others grey.

    Parameters
    ----------
    own : SteSweep
        Of the case's own condition, drawn dashed.
    nominal : int
        Index of its torque.
    """
    with panels(1, 7.6, 6.4, rows=2) as (figure, (over_torque, over_angle)):
        coloured = _least(conditions, MOST_COLOURED)
        # The coloured ones on top of the others.
        for number in sorted(range(len(conditions)), key=coloured.__contains__):
            drawn: dict[str, Any] = {"color": "#bbbbbb", "lw": 0.7}
            if number in coloured:
                drawn = {"color": COLOURS[coloured.index(number)], "label": _label(conditions[number].name)}
            _draw(over_torque, over_angle, conditions[number].sweep, conditions[number].own, drawn)
        _draw(over_torque, over_angle, own, nominal, {"color": "black", "ls": "--", "label": "the case's own"})
        over_torque.set_ylim(bottom=0.0)
        over_torque.set(xlabel="Pinion torque [N m]", ylabel="STE peak-to-peak [µm]")
        over_angle.set(xlabel="Pinion angle [deg]", ylabel="STE at own torque [µm]")
        over_angle.margins(x=0.0)
        title = "Condition"
        if len(coloured) < len(conditions):
            title += f"\n(the {len(coloured)} with the least\npeak-to-peak of {len(conditions)})"
        figure.legend(*over_torque.get_legend_handles_labels(), loc="outside right upper", title=title)
    return figure


def _draw(over_torque: Axes, over_angle: Axes, sweep: SteSweep, torque: int, drawn: dict[str, Any]) -> None:
    over_torque.plot(sweep.torque_Nm, peak_to_peak_um(sweep), marker="o", ms=3.5, **drawn)
    over_angle.plot(*periodic(sweep, sweep.ste_um[torque]), **drawn)


def _least(conditions: Sequence[ConditionSweep], most: int) -> list[int]:
    """Numbers of at most so many conditions, in their order: those with the least peak-to-peak at their own torque."""
    spans = [float(peak_to_peak_um(found.sweep)[found.own]) for found in conditions]
    return sorted(np.argsort(spans, kind="stable")[:most].tolist())  # NaN comes last


def _label(name: str) -> str:
    return legend_label(name if len(name) <= LONGEST_NAME else f"{name[: LONGEST_NAME - 1]}…")
