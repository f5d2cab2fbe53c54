"""Tables of losses, duty cycles and tolerances, of pairs, sets and gearboxes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pmor.body.bearing_readings import rolling_bearings, row_table
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


ROW_COLUMNS: Columns = {
    "load": "load", "bearing": "bearing", "row": "row", **heads("radial_force_N"), "axial [N]": "x_N",
    **heads("loaded_elements"), "largest force of an element [N]": "element_force_max_N",
}  # fmt: skip
LIFE_COLUMNS: Columns = {
    "load": "load", "bearing": "name",
    **heads("contact_pressure_max_MPa", "static_safety", "dynamic_rating_N", "bearing_rpm", "turn_positions",
            "reference_life_1e6", "reference_life_h"),
}  # fmt: skip
DUTY_LIFE_COLUMNS: Columns = {
    "bearing": "name", **heads("reference_life_h"), "most damage under": "most_damage", **heads("damage_share")
}  # fmt: skip
ROWS = (
    "Of bearings by inner geometry, rows in the order of x: forces of the inner ring on each; of planets those of the "
    "pin, against the planet."
)
MEAN = "Under the mean loads."
OVER_TURN = (
    "Over a turn of the carrier where positions are more than 1: forces are those of the position with the largest "
    "load of an element, and life is that of all positions, whose damages add up; else under the mean loads."
)
LIFE = (
    "Static safety: C_0 / P_0 by the pressure of the most loaded element; at C_0 ISO 76:2006 has 4,200 MPa of balls, "
    "4,000 MPa of rollers. L_10r: basic reference rating life, ISO/TS 16281:2008, by the loads of all elements, turns "
    "of one ring against the other in millions; C as given, or of ISO 281:2007. –: carries nothing, does not turn, no "
    "speed is said, or a contact angle above 45°, for which C is that of a thrust bearing. Factors for reliability, "
    "lubricant and cleanliness are left out."
)
DUTY_LIFE = (
    "Over the duty cycle: damages of all loads add up by their time (Palmgren and Miner). –: carries nothing in any "
    "load, or its life is not known in one."
)


def rolling_tables(loads: Mapping[str, Any], duty: Mapping[str, Any] | None) -> list[Table]:
    """Return rows and life of all rolling bearings by inner geometry, by the names of the loads; none without any."""
    rows = row_table(loads)
    if not rows:
        return []
    whole = [{"load": name, **bearing} for name, load in loads.items() for bearing in rolling_bearings(load)]
    turns = any(row["turn_positions"] > 1 for row in rows)
    life = LIFE_COLUMNS if turns else {head: key for head, key in LIFE_COLUMNS.items() if key != "turn_positions"}
    found = [
        table("Rows of rolling bearings", ROW_COLUMNS, rows, f"{ROWS} {OVER_TURN if turns else MEAN}"),
        table("Life of rolling bearings", life, whole, f"{LIFE} {OVER_TURN}" if turns else LIFE),
    ]
    if duty and duty["bearings"]:
        title = "Life of rolling bearings over the duty cycle"
        found.append(table(title, DUTY_LIFE_COLUMNS, duty["bearings"], DUTY_LIFE))
    return found


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
