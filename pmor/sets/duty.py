"""The duty cycle of a set or a gearbox: means over its loads by their time, and the load spectrum of each mesh.

A listing, without damage: what bears how often how much. Means of powers are by time; the efficiency is that of the
work.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NoReturn, Protocol

Data = dict[str, Any]
LISTED = ("torque_Nm", "flank_pressure_max_MPa", "root_stress_max_MPa")
# By which the shares of a duty cycle may miss 1: they are rounded.
ROUNDED_SHARE = 5e-3


class Timed(Protocol):
    """A load with its time."""

    @property
    def name(self) -> str: ...  # noqa: D102

    @property
    def fraction(self) -> float | None: ...  # noqa: D102

    @property
    def hours(self) -> float | None: ...  # noqa: D102


def shares(loads: Sequence[Timed]) -> tuple[float, ...]:
    """Return the shares of the loads in the operating time, which add up to 1; empty without a duty cycle."""
    parts = [load.hours or load.fraction or 0.0 for load in loads]
    return tuple(part / sum(parts) for part in parts) if all(parts) else ()


def check_duty(loads: Sequence[Timed], refuse: Callable[[str, str], NoReturn]) -> None:
    """Refuse a duty cycle that is not whole."""
    given = [[load for load in loads if getattr(load, key) is not None] for key in ("fraction", "hours")]
    for key, those in zip(("fraction", "hours"), given, strict=True):
        if those and len(those) < len(loads):
            other = next(load for load in loads if load not in those)
            rule = f"has no {key}, and others have one: a duty cycle needs it in all load cases, or in none"
            refuse(f'[[loads]] "{other.name}"', rule)
    if all(given):
        refuse("[[loads]]: fraction, hours", "say the same: leave one of them out")
    total = sum(load.fraction or 0.0 for load in loads)
    if given[0] and abs(total - 1.0) > ROUNDED_SHARE:
        rule = f"adds up to {total:.4g}, and must to 1: correct one of them, or write hours"
        refuse("[[loads]]: fraction", rule)


def duty_data(loads: Sequence[Timed], entries: Sequence[Data]) -> Data | None:
    """Return the duty cycle; None without one, or where a load has no result.

    Parameters
    ----------
    entries : sequence of mapping
        Of the loads: ``power_W``, ``losses_W``, and ``meshes``, each with its ``name``, the same of it, speeds of both
        gears (``pinion_rpm``, ``wheel_rpm``) and what `LISTED` names.
    """
    fractions = shares(loads)
    if not fractions or len(entries) < len(loads):
        return None
    names = [mesh["name"] for mesh in entries[0]["meshes"]]
    of_meshes = [[entry["meshes"][number] for entry in entries] for number in range(len(names))]
    return {
        "hours": sum(load.hours for load in loads if load.hours) or None,
        **_means(entries, fractions),
        "meshes": [
            {"name": name, **_means(rows, fractions)} for name, rows in zip(names, of_meshes, strict=True)
        ],
        "spectrum": [row for rows in of_meshes for row in _spectrum(loads, rows, fractions)],
    }  # fmt: skip


def _means(rows: Sequence[Data], fractions: Sequence[float]) -> Data:
    found: Data = {}
    for key in ("power_W", "losses_W"):
        known = [row[key] for row in rows if row[key] is not None]
        whole = len(known) == len(rows)
        found[key] = sum(f * value for f, value in zip(fractions, known, strict=True)) if whole else None
    power, lost = found["power_W"], found["losses_W"]
    return {**found, "efficiency": 1.0 - lost / power if power and lost is not None else None}


def _spectrum(loads: Sequence[Timed], rows: Sequence[Data], fractions: Sequence[float]) -> list[Data]:
    """Return rows of the load spectrum of a mesh, the largest torque first."""
    found = []
    for load, mesh, fraction in zip(loads, rows, fractions, strict=True):
        row = {"mesh": mesh["name"], "load": load.name, "fraction": fraction, "hours": load.hours}
        for gear in ("pinion", "wheel"):
            speed = mesh[f"{gear}_rpm"]
            row[f"{gear}_rpm"] = speed
            row[f"{gear}_cycles"] = None if not load.hours or speed is None else 60.0 * load.hours * abs(speed)
        found.append(row | {key: mesh[key] for key in LISTED})
    return sorted(found, key=lambda row: -(row["torque_Nm"] or 0.0))
