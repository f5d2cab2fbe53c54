"""What is read off rolling bearings by inner geometry: rows, loads of elements, life; of shafts and planets alike.

Keys are those of `pmor.results.quantities`; a life of None is that of a bearing that carries nothing, or is not known.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from pmor.body.bearing_equilibrium import loaded_bearing
from pmor.body.bearing_faults import InnerGeometry
from pmor.body.bearing_life import added_up, dynamic_rating_N, hours, reference_life
from pmor.body.rolling_bearing import BearingState
from pmor.core.arrays import FloatArray

Data = dict[str, Any]
# Of a planet's bearing: the planet turns around a load that stands on the pin.
ON_PINS = (False, True)


def rolling_data(
    bearing: InnerGeometry, states: Sequence[BearingState], turns: tuple[bool, bool], speed_rpm: float | None
) -> Data:  # fmt: skip
    """Return what is told of a bearing.

    Parameters
    ----------
    states : sequence of BearingState
        That take the same time, such as over a turn of a carrier: loads are those of the one with the largest of an
        element, pressure is the largest of all, and damage of all adds up.
    turns : (bool, bool)
        Whether inner and outer ring turn against the load.
    speed_rpm : float or None
        Of one ring against the other.
    """
    state = max(states, key=lambda one: float(one.element_force.max()))
    worst = max(states, key=lambda one: one.pressure)
    lives = [reference_life(bearing, one.lamina_force, turns) for one in states]
    life = None if None in lives else added_up(lives, [1.0 / len(states)] * len(states))  # type: ignore[arg-type]
    force, azimuth = state.lamina_force.sum(axis=2), np.degrees(bearing.azimuth) % 360.0
    rows = [
        {"at_mm": place, "force_N": row[:3].tolist(), "radial_force_N": float(np.hypot(*row[1:3])),
         "loaded_elements": int(np.count_nonzero(own)), "element_azimuth_deg": at.tolist(),
         "element_force_N": own.tolist()}
        for place, row, own, at in zip(bearing.row_places, state.row_force, force, azimuth, strict=True)
    ]  # fmt: skip
    return {
        "turn_positions": len(states),
        "element_force_N": force.ravel().tolist(),
        "loaded_elements": int(np.count_nonzero(force)),
        "contact_pressure_max_MPa": worst.pressure,
        "static_safety": worst.static_safety if worst.pressure > 0.0 else None,
        "rows": rows,
        "dynamic_rating_N": dynamic_rating_N(bearing),
        "reference_life_1e6": _finite(life),
        "bearing_rpm": speed_rpm,
        "reference_life_h": None if life is None or speed_rpm is None else _finite(hours(life, speed_rpm)),
    }


def pin_bearing_data(
    bearings: Sequence[InnerGeometry | None], loads: FloatArray, angle: float, speed_rpm: float | None
) -> list[Data]:  # fmt: skip
    """Return what is told of the bearings of a planet on its pin, azimuths from outwards on; nothing of others.

    Parameters
    ----------
    loads : ndarray, shape (P, b, 4)
        Of the planet on the bearings, as in `pmor.sets.pins.PlanetOnPin`, that take the same time each.
    angle : float
        Where the pin stands, from x of the plan towards y, rad.
    """
    found = list[Data]()
    for number, bearing in enumerate(bearings):
        if bearing is None:
            found.append({})
            continue
        along, across = math.cos(angle), math.sin(angle)
        turned = np.array([[along, across], [-across, along]])
        forces, moments = loads[:, number, :2] @ turned.T, loads[:, number, 2:] @ turned.T
        # The pin is the inner ring; moments in planes are about axes across them.
        on_inner = -np.column_stack([np.zeros(len(loads)), forces, -moments[:, 1], moments[:, 0]])
        states, near = list[BearingState](), None
        for force in on_inner[np.isfinite(on_inner).all(axis=1)]:
            if (near := loaded_bearing(bearing, force, near)) is not None:
                states.append(near.state)
        found.append(rolling_data(bearing, states, ON_PINS, speed_rpm) if len(states) == len(loads) else {})
    return found


def rolling_bearings(load: Data) -> Iterator[Data]:
    """Yield the rolling bearings by inner geometry of a load of a gearbox, or of a set under a torque, with names."""
    for bearing in load.get("bearings", ()):
        if bearing.get("rows"):
            yield bearing
    for one in (load, *load.get("sets", ())):
        place = "" if one is load else f"{one['name']}: "
        for planet in one.get("planets", ()):
            for bearing in planet["bearings"]:
                if bearing.get("rows"):
                    yield {**bearing, "name": f"{place}{planet['name']}, {bearing['at_mm']:g} mm"}


def row_table(loads: Mapping[str, Data]) -> list[Data]:
    """Return the rows of all rolling bearings under all loads, by the loads' names: rows of `bearings.csv`."""
    whole = ("contact_pressure_max_MPa", "static_safety", "dynamic_rating_N", "bearing_rpm", "turn_positions",
             "reference_life_1e6", "reference_life_h")  # fmt: skip
    return [
        {
            "load": name, "bearing": bearing["name"], "row": number, "at_mm": row["at_mm"],
            **{f"{way}_N": value for way, value in zip("xyz", row["force_N"], strict=True)},
            "radial_force_N": row["radial_force_N"], "loaded_elements": row["loaded_elements"],
            "element_force_max_N": max(row["element_force_N"]), **{key: bearing[key] for key in whole},
        }
        for name, load in loads.items() for bearing in rolling_bearings(load)
        for number, row in enumerate(bearing["rows"], start=1)
    ]  # fmt: skip


def element_arrays(bearing: Data) -> dict[str, np.ndarray]:
    """Return the loads of a bearing's elements as arrays of a results file."""
    return {
        "row/at": np.array([row["at_mm"] for row in bearing["rows"]]),
        "row/force": np.array([row["force_N"] for row in bearing["rows"]]),
        "element/azimuth": np.array([row["element_azimuth_deg"] for row in bearing["rows"]]),
        "element/force": np.array([row["element_force_N"] for row in bearing["rows"]]),
    }


def duty_lives(names: Sequence[str], loads: Sequence[Data], fractions: Sequence[float]) -> list[Data]:
    """Return the life of each bearing over a duty cycle, h, by the shares of the loads in the time, and what wears it.

    None where that under a load is not known; a bearing that nowhere carries has none.
    """
    found = list[Data]()
    for rows in zip(*(tuple(rolling_bearings(load)) for load in loads), strict=True):
        lives = [row["reference_life_h"] or (math.inf if _rests(row) else math.nan) for row in rows]
        life = added_up(lives, fractions)
        told: Data = dict.fromkeys(("reference_life_h", "most_damage", "damage_share"))
        if math.isfinite(life):
            worn = [life * part / one for one, part in zip(lives, fractions, strict=True)]
            share, most = max(zip(worn, names, strict=True))
            told = {"reference_life_h": life, "most_damage": most, "damage_share": share}
        found.append({"name": rows[0]["name"], **told})
    return found


def _rests(row: Data) -> bool:
    """Whether a load does not wear a bearing: it carries nothing, or does not turn."""
    return row["bearing_rpm"] is not None and (row["loaded_elements"] == 0 or row["bearing_rpm"] == 0.0)


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
