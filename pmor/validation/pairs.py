"""The pairs of the published figures."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

from pmor.case import Case, make_case
from pmor.gear.pair import GearPair
from pmor.line.full_model import solve_angle
from pmor.line.layered_pair import LayeredPair
from pmor.pair.conditions import nominal_condition
from pmor.pair.model import ElasticModel, elastic_model, gear_pair, mesh_model

#: drawings that a public program, a public gearbox file or a standard's example gives, by name
DRAWINGS: dict[str, dict[str, Any]] = {
    "FVA high-speed stage 27/51": {
        "module_mm": 4.5, "helix_angle_deg": 21.0, "face_width_mm": 50.0, "torque_Nm": 500.0,
        "pinion": {"teeth": 27, "profile_shift": 0.231415, "bore_radius_mm": 26.0},
        "wheel": {"teeth": 51, "profile_shift": 0.231415, "bore_radius_mm": 49.2},
    },
    "FVA low-speed stage 23/34": {
        "module_mm": 6.5, "helix_angle_deg": 10.0, "face_width_mm": 74.0, "torque_Nm": 1000.0,
        "pinion": {"teeth": 23, "profile_shift": 0.15074, "bore_radius_mm": 30.4},
        "wheel": {"teeth": 34, "profile_shift": 0.15074, "bore_radius_mm": 44.9},
    },
    "helical pair 17/43": {
        "module_mm": 1.0, "helix_angle_deg": 20.0, "face_width_mm": 10.0, "torque_Nm": 20.0,
        "pinion": {"teeth": 17, "bore_radius_mm": 4.0}, "wheel": {"teeth": 43, "bore_radius_mm": 10.0},
    },
    "spur pair 17/43": {
        "module_mm": 1.0, "face_width_mm": 10.0, "torque_Nm": 20.0,
        "pinion": {"teeth": 17, "bore_radius_mm": 4.0}, "wheel": {"teeth": 43, "bore_radius_mm": 10.0},
    },
    "ISO/TR 6336-30, example 1, 17/103": {
        "module_mm": 8.0, "helix_angle_deg": 15.8, "face_width_mm": 100.0, "centre_distance_mm": 500.0,
        "torque_Nm": 9000.0, "pinion": {"teeth": 17, "profile_shift": 0.145, "bore_radius_mm": 30.0},
        "wheel": {"teeth": 103, "bore_radius_mm": 100.0},
    },
    "Ohio State rig 50/50": {
        "module_mm": 3.0, "face_width_mm": 20.0, "centre_distance_mm": 150.0, "teeth": 50, "bore_radius_mm": 25.0,
        "youngs_modulus_GPa": 206.0, "torque_Nm": 340.0,
    },
    "paper's pair 21/21": {
        "module_mm": 4.0, "face_width_mm": 20.0, "teeth": 21, "bore_radius_mm": 20.0, "torque_Nm": 100.0,
    },
}  # fmt: skip


@cache
def drawn(name: str) -> GearPair:
    """Return the geometry of one of `DRAWINGS`."""
    return gear_pair(make_case(name, **DRAWINGS[name]))


def full(case: Case) -> ElasticModel:
    """Return full FE of a case."""
    return elastic_model(case, mesh_model(case))


def ste_um(case: Case, model: ElasticModel, phi: float) -> float:
    """Return the transmission error of full FE with line contact at a pinion angle (rad), under a case's own load."""
    meshed = model.mesh.meshed
    assert isinstance(meshed, LayeredPair)
    (state,) = solve_angle(meshed, model.elasticity_at, phi, [nominal_condition(case)]).states
    return math.nan if state is None else float(1e3 * state.advance * meshed.pair.pinion.base_radius)


def after_entry(pair: GearPair, pitches: float) -> float:
    """Return the pinion angle so many pitches after a tooth pair has come into mesh at mid width, rad."""
    return pair.roll_position_range[0] + pitches * pair.pitch
