"""Designs that are trains on fixed axes: their keys by the names of gears and meshes, and their figures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from pmor.campaigns.settings import OF_TRAINS
from pmor.case.schema import SECTIONS
from pmor.core.ranges import Place, SignedTorque
from pmor.pair.drawn import gear_inertias
from pmor.results.quantities import TABLE, Quantity
from pmor.sets.layout import PAIR, SHARED
from pmor.sets.loader import SetFile
from pmor.sets.preview import pairs_of
from pmor.sets.settings import Amount, Angle, Direction, SetSections, Torsion

Data = dict[str, Any]
GEARS = "gears"
OF_MESH = ("k_h_beta", "flank_pressure_max_MPa", "line_load_max_N_per_mm", "contact_ratio", "share_max")
OF_GEAR = ("max_principal_MPa",)
ORDERS = 3
# Of the axis of a gear, in `at_mm`.
AXES = ("x_mm", "y_mm")


@dataclass(frozen=True, kw_only=True)
class GearKeys:
    """Keys of a gear of a train that designs may change: its axis, mm, its torque, and its errors."""

    x_mm: Place = 0.0
    y_mm: Place = 0.0
    torque_Nm: SignedTorque = 0.0
    timing_mrad: Angle = 0.0
    torsion_Nmm_per_rad: Torsion = "rigid"
    eccentricity_um: Amount = 0.0
    eccentricity_deg: Direction = 0.0


def known_of(said: SetSections, sections: Mapping[str, type]) -> dict[str, type]:
    """Return the sections whose keys designs of a train may change, of those of a set file."""
    pairs = dict.fromkeys((PAIR, *(mesh.pair for mesh in said.meshes)), SECTIONS[PAIR])
    found: dict[str, type] = {f"{GEARS}.{gear.name}": GearKeys for gear in said.gears}
    for gear in said.gears:
        role = "wheel" if said.members.get(gear.name, {}).get("internal") else "pinion"
        found |= {f"{gear.name}{name.removeprefix(role)}": kind for name, kind in SECTIONS.items()
                  if name.split(".")[0] == role}  # fmt: skip
    return found | pairs | {name: sections[name] for name in (*SHARED[1:], "sweep", "lubricant")}


def figures_in(said: SetSections) -> tuple[Quantity, ...]:
    """Return the names of all results of a train, those of its parts behind their names."""
    named = [("-".join(mesh.gears), OF_MESH) for mesh in said.meshes] + [(gear.name, OF_GEAR) for gear in said.gears]
    of_parts = [
        replace(TABLE[key], key=f"{name}.{key}", symbol=f"{name}: {TABLE[key].symbol}")
        for name, own in named for key in own
    ]  # fmt: skip
    of_parts_alone = {*OF_GEAR, "contact_ratio", "line_load_max_N_per_mm"}
    return (*(TABLE[key] for key in OF_TRAINS if key not in of_parts_alone), *of_parts)


def changed_gears(gears: list[Data], changes: Mapping[str, Mapping[str, Any]]) -> list[Data]:
    """Return the list `[[gears]]` of a set file with the keys of a design, by sections such as ``gears.NAME``."""
    found = []
    for gear in gears:
        keys = dict(changes.get(f"{GEARS}.{gear['name']}", {}))
        axis = [keys.pop(key, at) for key, at in zip(AXES, gear["at_mm"], strict=False)]
        found.append({**gear, **keys, "at_mm": [*axis, *gear["at_mm"][len(AXES) :]]})
    return found


def figures_of_train(file: SetFile, data: Data) -> dict[str, float | None]:
    """Return all figures of a train at its nominal torque, from the content of its `set.json`."""
    orders, pairs, masses = data["ste_harmonics_um"], pairs_of(file), dict[str, float]()
    found: dict[str, float | None] = {key: data[key] for key in ("ste_mean_um", "ste_peak_to_peak_um")}
    found["ste_peak_to_peak_worst_um"] = _largest([row["ste_peak_to_peak_um"] for row in data["torques"]])
    found |= {f"ste_order_{k + 1}_um": orders[k] if k < len(orders) else None for k in range(ORDERS)}
    for key in ("k_h_beta", "flank_pressure_max_MPa"):
        found[key] = _largest([row[key] for row in data["meshes"]])
    ends = [(mesh.pinion, mesh.wheel) for mesh in file.plan.meshes]
    shared = [any(own[place] == other[place] for other in ends if other != own for place in range(2)) for own in ends]
    shares = [row["share_max"] for row, beside in zip(data["meshes"], shared, strict=True) if beside]
    found["share_max"] = _largest(shares)
    for row, mesh in zip(data["meshes"], file.plan.meshes, strict=True):
        found |= {f"{mesh.case}.{key}": row[key] for key in OF_MESH}
        bodies = (file.plan.bodies[number].name for number in (mesh.pinion, mesh.wheel))
        inertias = gear_inertias(file.cases[mesh.case], pairs[mesh.case])
        masses |= {name: inertia.mass_kg for name, inertia in zip(bodies, inertias, strict=True)}
    stresses = {row["name"]: row for row in data["root_stress"]}
    for body in file.plan.bodies:
        found |= {f"{body.name}.{key}": stresses.get(body.name, {}).get(key) for key in OF_GEAR}
    return found | {"mass_kg": sum(masses.values())}


def _largest(values: list[float | None]) -> float | None:
    known = [value for value in values if value is not None]
    return max(known) if known else None
