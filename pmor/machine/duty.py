"""The duty cycle of a gearbox: means over its load cases by their time, and the load spectrum of each mesh.

A listing, without damage: what bears how often how much. Means of powers are by time; the efficiency is that of the
work.
"""

from __future__ import annotations

from collections.abc import Sequence

from pmor.machine.model import GearboxModel
from pmor.machine.readings import Data
from pmor.machine.settings import LoadCase

LISTED = ("torque_Nm", "flank_pressure_max_MPa", "root_stress_max_MPa")


def shares(loads: Sequence[LoadCase]) -> tuple[float, ...]:
    """Return the shares of the load cases in the operating time, which add up to 1; empty without a duty cycle."""
    parts = [load.hours or load.fraction or 0.0 for load in loads]
    return tuple(part / sum(parts) for part in parts) if all(parts) else ()


def duty_data(model: GearboxModel, entries: Sequence[Data]) -> Data | None:
    """Return the duty cycle; None without one, or where a load case has no result.

    Parameters
    ----------
    entries : sequence of mapping
        Of the load cases in `gearbox.json`.
    """
    loads = model.sections.loads
    fractions = shares(loads)
    if not fractions or len(entries) < len(loads):
        return None
    power, lost = (_mean([entry[key] for entry in entries], fractions) for key in ("power_W", "losses_W"))
    hours = [load.hours for load in loads]
    return {
        "hours": sum(one for one in hours if one) or None,
        "power_W": power,
        "losses_W": lost,
        "efficiency": _efficiency(power, lost),
        "meshes": [_mesh(i, entries, fractions) for i in range(len(model.sections.meshes))],
        "spectrum": _spectrum(model, entries, fractions, hours),
    }


def _mesh(number: int, entries: Sequence[Data], fractions: Sequence[float]) -> Data:
    meshes = [entry["meshes"][number] for entry in entries]
    power, lost = (_mean([mesh[key] for mesh in meshes], fractions) for key in ("power_W", "losses_W"))
    return {
        "name": meshes[0]["name"], "power_W": power, "losses_W": lost, "efficiency": _efficiency(power, lost),
    }  # fmt: skip


def _spectrum(
    model: GearboxModel, entries: Sequence[Data], fractions: Sequence[float], hours: Sequence[float | None]
) -> list[Data]:
    """Rows of a load spectrum: of each mesh all load cases, the largest torque first."""
    rows = []
    for number, mesh in enumerate(model.sections.meshes):
        own = []
        for entry, fraction, time in zip(entries, fractions, hours, strict=True):
            row = {"mesh": mesh.name, "load": entry["name"], "fraction": fraction, "hours": time}
            for gear, place in (("pinion", mesh.pinion), ("wheel", mesh.wheel)):
                speed = entry["speeds_rpm"].get(place.shaft)
                row[f"{gear}_rpm"] = speed
                row[f"{gear}_cycles"] = None if time is None or speed is None else 60.0 * time * abs(speed)
            own.append(row | {key: entry["meshes"][number][key] for key in LISTED})
        rows += sorted(own, key=lambda row: -row["torque_Nm"])
    return rows


def _mean(values: Sequence[float | None], fractions: Sequence[float]) -> float | None:
    known = [value for value in values if value is not None]
    return sum(f * v for f, v in zip(fractions, known, strict=True)) if len(known) == len(values) else None


def _efficiency(power: float | None, lost: float | None) -> float | None:
    return 1.0 - lost / power if power and lost is not None else None
