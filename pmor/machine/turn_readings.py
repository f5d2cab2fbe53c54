"""What an engineer reads off a set over a turn of its carrier: load sharing, rows of planet bearings, supports."""

from __future__ import annotations

from typing import Any

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.machine.carrier_turn import CarrierTurn
from pmor.machine.coupled_sets import SolvedSet
from pmor.machine.loaded import LoadedGearbox
from pmor.machine.set_frame import MEMBERS
from pmor.sets.lost import known
from pmor.sets.solution import on_planets

# Orders of the carrier's turn that are told.
ORDERS = 3
Data = dict[str, Any]


def turn_data(gearbox: LoadedGearbox, one: SolvedSet) -> Data | None:
    """Return what stands in `gearbox.json` of a set over a turn of its carrier; None of one that was not turned.

    `k_gamma` is the largest load of a planet over the mean of all; force of a bearing row over the mean of all rows;
    amplitudes of orders of the carrier are those of the force across a support. Of the positions that have a solution.
    """
    turn = one.turn
    if turn is None:
        return None
    share, rows = planet_shares(turn, one), planet_rows(turn)
    plan = one.meshing.file.plan
    assert plan.on_pins is not None, "of a planetary set"
    return {
        "angle_deg": turn.angle_deg.tolist(),
        "converged": bool(turn.converged.all()),
        "k_gamma": known(np.max, share) * share.shape[1],
        "planet_share": share.T.tolist(),
        "planet_rows": [
            {"planet": plan.bodies[body].name, "at_mm": place, "largest_N": known(np.max, row),
             "largest_at_deg": float(turn.angle_deg[np.nan_to_num(row).argmax()]),
             "largest_over_mean": known(np.max, row) / known(np.mean, rows)}
            for body, of_planet in zip(plan.planets, rows.transpose(1, 2, 0), strict=True)
            for place, row in zip(plan.on_pins.pin.bearings_mm, of_planet, strict=True)
        ],
        "supports": [
            {"name": bearing.settings.name, **_force_data(force)}
            for bearing, force in zip(gearbox.bearings, turn.bearing_force.transpose(1, 0, 2), strict=True)
        ],
        "members": {
            member: {
                "across_um": (1e3 * moved[:, 1:3]).T.tolist(),
                "along_um": (1e3 * moved[:, 0]).tolist(),
                "tilt_mrad": (1e3 * moved[:, 4:]).T.tolist(),
            }
            for member, moved in zip(MEMBERS, turn.hub_displacement.transpose(1, 0, 2), strict=True)
        },
    }


def _force_data(force: FloatArray) -> Data:
    """Least, mean and largest force across a support, and along its axis, (P, 6); and its orders."""
    across = np.hypot(force[:, 1], force[:, 2])
    lines = np.abs(np.fft.rfft(across)[1 : ORDERS + 1]) * 2.0 / len(across)
    return {
        "radial_force_min_N": known(np.min, across), "radial_force_mean_N": known(np.mean, across),
        "radial_force_max_N": known(np.max, across), "axial_force_mean_N": known(np.mean, force[:, 0]),
        "carrier_orders_N": lines.tolist(),
    }  # fmt: skip


def planet_shares(turn: CarrierTurn, one: SolvedSet) -> FloatArray:
    """Return the share of each planet in what the meshes carry around, (P, N)."""
    force = one.solution.outwards_and_around(on_planets(one.meshing.file.plan, turn.hub_wrench)[..., :2])[..., 1]
    return np.asarray(force / force.sum(axis=1, keepdims=True))


def planet_rows(turn: CarrierTurn) -> FloatArray:
    """Return forces across the bearing rows of all planets, (P, N, b), N."""
    return np.asarray(np.linalg.norm(turn.pin_load[..., :2], axis=-1))
