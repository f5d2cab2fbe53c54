"""Tables of losses, duty cycles and tolerances, of pairs, sets and gearboxes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pmor.report.table import Column, Columns, Table, heads, table
from pmor.results.load_distribution import PRESSURE
from pmor.results.quantities import TABLE
from pmor.results.root_stress import GEARS

LOSS_COLUMNS: Columns = heads("loss_factor", "friction", "losses_W", "efficiency")
LOSSES = "Load-dependent, of the line loads; formulas of friction differ by up to a factor of two. Without churning."


def _millions(key: str) -> Column:
    return lambda row: None if row[key] is None else 1e-6 * row[key]


def of_gear(key: str, gear: int) -> Column:
    """Return the column of a figure of pinion or wheel."""
    return lambda row: None if row[key] is None else row[key][gear]


SPECTRUM_COLUMNS: Columns = {
    "mesh": "mesh", "load": "load", "pinion torque [N m]": "torque_Nm", **heads("fraction", "pinion_rpm", "hours"),
    **{f"{gear} [10⁶ turns]": _millions(f"{gear}_cycles") for gear in GEARS}, **heads("flank_pressure_max_MPa"),
    **{f"root stress, {name} [MPa]": of_gear("root_stress_max_MPa", gear) for gear, name in enumerate(GEARS)},
}  # fmt: skip
# Of the spectrum, known with hours alone.
OF_HOURS = ("time [h]", "pinion [10⁶ turns]", "wheel [10⁶ turns]")
DUTY = "Means by time; the efficiency is that of the work."
SPECTRUM = (
    "What each mesh carries, and how often: revolutions of both gears. A list, without any damage. Pressure: "
    f"{PRESSURE}."
)


def spectrum_tables(duty: Mapping[str, Any]) -> list[Table]:
    """Return means and load spectrum of a duty cycle."""
    hidden = () if duty["hours"] else OF_HOURS
    timed = {head: column for head, column in SPECTRUM_COLUMNS.items() if head not in hidden}
    return [
        table("Duty cycle", {"mesh": "name", **heads("power_W", "losses_W", "efficiency")},
              [*duty["meshes"], {"name": "all", **duty}], DUTY),
        table("Load spectrum", timed, duty["spectrum"], SPECTRUM),
    ]  # fmt: skip


def tolerance_table(drawn: Mapping[str, Mapping[str, Any]], made: str) -> Table:
    """Return the percentiles of machines within tolerances under each torque.

    Parameters
    ----------
    drawn : mapping
        As `pmor.pair.samples.sample_data` has it, by what it is of: several, or a single one of all.
    """
    keys = ("as_filed", "mean", "percentile_50", "percentile_95", "percentile_99")
    rows = [
        (place, row["torque_Nm"], TABLE[name].head, *(row[name][key] for key in keys))
        for place, data in drawn.items() for row in data["torques"] for name in row if isinstance(row[name], dict)
    ]  # fmt: skip
    note = f"Values that so many of {next(iter(drawn.values()))['samples']} {made} stay below, each solved."
    columns = ("of", "torque [N m]", "", "as filed", "mean", "50 %", "95 %", "99 %")
    first = 0 if len(drawn) > 1 else 1
    return Table("Tolerances", columns[first:], [row[first:] for row in rows], note)
