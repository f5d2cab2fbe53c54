"""Stress on webs and at the edges of their holes: figures, and in words."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from pmor.results.root_stress import GEARS
from pmor.results.web_stress import EDGES, WebCycle
from pmor_online.run import OnlineResult

#: figures of a part by the attributes of its cycle
VALUES = {"von_mises_max_MPa": "von_mises_MPa", "phi_rad": "phi_rad", "range_MPa": "range_MPa",
          "range_most_MPa": "most_MPa", "range_least_MPa": "least_MPa"}  # fmt: skip
PLACES = {"": "place", "range_": "range_place"}
AXES = "radius_mm", "angle_deg", "z_mm"


def web_stress_table(result: OnlineResult) -> list[dict[str, Any]]:
    """Return a row for each torque, gear and part of its web: plain values, None for what is not known."""
    return [
        {"torque_Nm": float(torque), "gear": gear, "part": part, **_figures(cycle, t)}
        for t, torque in enumerate(result.sweep.torque_Nm)
        for gear, cycles in zip(GEARS, result.web_stress, strict=True)
        for part, cycle in cycles.items()
    ]


def web_stress_figures(result: OnlineResult) -> list[dict[str, Any] | None] | None:
    """Return the stress of both webs at the nominal torque, by their parts; None where it was not asked for."""
    if not any(result.web_stress):
        return None
    return [
        {name: _figures(cycle, result.nominal) for name, cycle in cycles.items()} or None
        for cycles in result.web_stress
    ]


def _figures(cycle: WebCycle, torque: int) -> dict[str, float | None]:
    found = {key: float(getattr(cycle, name)[torque]) for key, name in VALUES.items()}
    for start, name in PLACES.items():
        places = zip(AXES, getattr(cycle, name)[torque].tolist(), strict=True)
        found |= {start + axis: value for axis, value in places}
    return {key: value if np.isfinite(value) else None for key, value in found.items()}


def web_stress_rows(result: OnlineResult) -> list[tuple[str, float | None, str, str]]:
    """Return the stress of both webs in words."""
    rows = list[tuple[str, float | None, str, str]]()
    for gear, parts in zip(GEARS, web_stress_figures(result) or (), strict=False):
        for part, s in (parts or {}).items():
            what = "stress at hole edges" if part == EDGES else "stress of web"
            if s["von_mises_max_MPa"] is None:
                rows.append((f"{what}, {gear}", None, "", "needs positions that converged"))
                continue
            place = f"r = {s['radius_mm']:.4g} mm, {s['angle_deg']:.4g} deg, z = {s['z_mm']:.3g} mm"
            note = f"largest von Mises, at {place}, pinion at {math.degrees(s['phi_rad']):.3g} deg"
            note += "; range over a load cycle "
            if s["range_MPa"] is None:
                note += "unknown: the sweep covers no whole one"
            else:
                note += f"{s['range_MPa']:.4g} MPa, {s['range_least_MPa']:.3g} to {s['range_most_MPa']:.3g} MPa"
            rows.append((f"{what}, {gear}", s["von_mises_max_MPa"], "MPa", note))
    return rows
