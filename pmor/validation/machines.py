"""Rolling bearings and losses beside published ones, and the pairs of the published figures."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np

from pmor.body.bearing_equilibrium import loaded_bearing
from pmor.body.bearing_rows import DOF
from pmor.body.rolling_bearing import BallBearing
from pmor.case import Case, make_case
from pmor.gear.pair import GearPair
from pmor.gear.tooth import Tooth
from pmor.line.full_model import solve_angle
from pmor.line.layered_pair import LayeredPair
from pmor.pair.conditions import nominal_condition
from pmor.pair.model import ElasticModel, elastic_model, gear_pair, mesh_model
from pmor.results.load_distribution import friction_schlenk, loss_factor
from pmor.validation.check import Check

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


BALL: dict[str, Any] = {
    "balls": 7, "ball_diameter_mm": 11.5, "pitch_diameter_mm": 43.5, "youngs_modulus_GPa": 210.0
}  # fmt: skip
DISPLACEMENT_RTOL, TILT_RTOL = 1e-3, 0.02
# Clearance in mm, forces and moments on the inner ring (N, N mm), its displacements in um and mrad by direction: a
# public repository gives these as those of a commercial program.
BEARINGS: list[tuple[float, tuple[float, ...], dict[int, float]]] = [
    (0.0, (0.0, 1e3, 0.0, 0.0, 0.0), {1: 15.1101}),
    (0.0, (1e3, 0.0, 0.0, 0.0, 0.0), {0: 133.5381}),
    (0.0, (0.0, 0.0, 0.0, 0.0, 1e3), {4: 3.6957}),
    (0.01, (0.0, 1e3, 0.0, 0.0, 0.0), {1: 21.223}),
    (0.01, (1e3, 0.0, 0.0, 0.0, 0.0), {0: 149.1717}),
    (0.01, (1e3, 1e3, 0.0, 0.0, 0.0), {1: 19.5923, 0: 146.4603, 4: 2.6872}),
]
DIRECTIONS = {0: "axial displacement", 1: "radial displacement", 4: "tilt"}
LOADS = "axial force", "radial force", "", "", "moment"
# Pairs of the FZG rig and of the literature: teeth, module, helix angle, shifts, centre distance, tip radii; H_V.
C14 = (16, 24), 4.5, 0.0, (0.1817, 0.1715), 91.5, (41.318, 59.272)
FACTORS = {
    "FZG C14": (C14, 0.19863),
    "20/30, module 3.5, 15 deg": (((20, 30), 3.5, 15.0, (0.1809, 0.0891), 91.5, (40.336, 58.132)), 0.16390),
    "30/30, module 2": (((30, 30), 2.0, 0.0, (0.0, 0.0), 60.0, (32.0, 32.0)), 0.14944),
    "17/43, module 1": (((17, 43), 1.0, 0.0, (0.0, 0.0), 30.0, (9.5, 22.5)), 0.18012),
}
FACTOR_DIGITS, FRICTION = 1e-5, 0.0451


def bearings() -> list[Check]:
    """Return the checks of a ball bearing."""
    source = "commercial program, by a public repository"
    constant = BallBearing(**BALL).stiffness_constant
    found = [Check("Hertz's constant of a ball", "N/mm^1.5", 333375.6, constant, "public repository", 1e-6)]
    for clearance, force, said in BEARINGS:
        loaded = loaded_bearing(BallBearing(**BALL, clearance_mm=clearance), np.array(force))
        place = np.full(DOF, math.nan) if loaded is None else loaded.place
        loads = " and ".join(name for name, value in zip(LOADS, force, strict=True) if value)
        found += [
            Check(f"ball bearing, clearance {clearance:g} mm, {loads}: {DIRECTIONS[where]}",
                  "µm" if where < 3 else "mrad", theirs, float(1e3 * place[where]), source,
                  DISPLACEMENT_RTOL if where < 3 else TILT_RTOL)
            for where, theirs in said.items()
        ]  # fmt: skip
    return found


def losses() -> list[Check]:
    """Return the checks of loss factors of rigid pairs, after Ohlendorf, and of Schlenk's friction."""
    found = []
    for name, (geometry, theirs) in FACTORS.items():
        pair = _pair(*geometry)
        ours = float(loss_factor(pair, _shared_equally(pair))[0])
        found.append(Check(f"loss factor H_V, {name}", "1", theirs, ours, "published", FACTOR_DIGITS / theirs))
    pair = _pair(*C14)
    friction = friction_schlenk(pair, 2e5 / pair.pinion.base_radius, 1500.0, 13.28, 0.355, 0.85)
    words = "friction after Schlenk, FZG C14, 200 N m"
    return [*found, Check(words, "1", FRICTION, friction, "independent script", 5e-5 / FRICTION)]


def _pair(
    teeth: Sequence[int], module: float, helix_deg: float, shifts: Sequence[float], distance: float,
    tips: Sequence[float],
) -> GearPair:  # fmt: skip
    """A pair by its drawing, 14 mm wide."""
    beta, gears = math.radians(helix_deg), []
    for count, shift, tip, hand in zip(teeth, shifts, tips, (1, -1), strict=True):
        addendum = (tip - 0.5 * module * count / math.cos(beta)) / module - shift
        gears.append(Tooth(count, module, math.radians(20.0), hand * beta, shift, addendum))
    return GearPair(gears[0], gears[1], 14.0, distance)


def _shared_equally(pair: GearPair, count: int = 20000) -> Any:
    """Rigid transverse sections whose pairs in contact share the load equally, as line loads of a sweep."""
    (start, end), _ = pair.active_rolls
    pairs = np.arange(math.ceil(pair.contact_ratio) + 1)
    on_pinion = start + (np.arange(count)[:, None] + 0.5) / count * pair.pitch + pair.pitch * pairs
    on_wheel = (pair.action_length - pair.pinion.base_radius * on_pinion) / pair.wheel.base_radius
    carries = on_pinion < end
    return SimpleNamespace(
        roll_rad=np.stack([on_pinion, on_wheel], axis=-1)[:, :, None],
        load_N_per_mm=(carries / carries.sum(axis=1, keepdims=True))[None, ..., None], width_mm=np.ones(1),
    )  # fmt: skip
