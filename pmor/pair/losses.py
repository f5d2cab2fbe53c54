"""Power that meshes lose, from the loss factor of their line loads, speed and lubricant; means over a duty cycle.

A duty cycle is a listing of what meshes bear how often, without damage; of rolling bearings it has their life. Means of
powers are by time; the efficiency is that of the work.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from pmor.body.bearing_readings import duty_lives
from pmor.case.duty import Lubricant, Timed, shares
from pmor.gear.pair import GearPair
from pmor.results.load_distribution import friction_schlenk

Data = dict[str, Any]
LISTED = ("torque_Nm", "flank_pressure_max_MPa", "root_stress_max_MPa")


def mesh_losses(
    pair: GearPair, factor: float, force_N: float, pinion_rpm: float | None, lubricant: Lubricant
) -> dict[str, Any]:
    """Return friction, power and power lost in a mesh; None without a speed, at rest, or where they are not known.

    A mesh that carries nothing loses nothing.

    Parameters
    ----------
    factor : float
        H_VL, `pmor.results.load_distribution.loss_factor`.
    force_N : float
        In the transverse plane, mean.
    pinion_rpm : float or None
        Against the line of centres: that of the gears of a set counts from its carrier.
    """
    nothing: dict[str, Any] = dict.fromkeys(("friction", "power_W", "losses_W", "efficiency"))
    if not pinion_rpm or not math.isfinite(force_N):
        return nothing
    if not math.isfinite(factor):
        return nothing | ({"power_W": 0.0, "losses_W": 0.0} if force_N == 0.0 else {})
    friction = lubricant.friction
    if friction == "schlenk":
        of_oil = lubricant.viscosity_mPas, lubricant.roughness_um, lubricant.lubricant_factor
        friction = friction_schlenk(pair, force_N, pinion_rpm, *of_oil)
    power = 1e-3 * force_N * pair.pinion.base_radius * per_second(abs(pinion_rpm))
    lost = float(friction) * factor
    return {"friction": friction, "power_W": power, "losses_W": power * lost, "efficiency": 1.0 - lost}


def total(rows: list[dict[str, Any]], key: str) -> float | None:
    """Return the sum of a figure over rows; None where one of them is not known."""
    known = [row[key] for row in rows if row[key] is not None]
    return sum(known) if len(known) == len(rows) else None


def per_second(rpm: float) -> float:
    """Return an angular speed, rad/s."""
    return rpm * 2.0 * math.pi / 60.0


def duty_data(loads: Sequence[Timed], entries: Sequence[Data]) -> Data | None:
    """Return the duty cycle; None without one, or where a load has no result.

    Parameters
    ----------
    entries : sequence of mapping
        Of the loads: ``power_W``, ``losses_W``, and ``meshes``, each with its ``name``, the same of it, speeds of both
        gears (``pinion_rpm``, ``wheel_rpm``) and what `LISTED` names; of machines with rolling bearings those.
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
        "bearings": duty_lives([load.name for load in loads], entries, fractions),
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
