"""What an engineer reads off a set over a turn of its carrier: load sharing, rows of planet bearings, supports."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from pmor.body.bearing_faults import InnerGeometry
from pmor.body.bearing_readings import ON_PINS, rolling_data
from pmor.body.rolling_bearing import BearingState
from pmor.core.arrays import FloatArray
from pmor.machine.carrier_turn import CarrierTurn
from pmor.machine.coupled_sets import SolvedSet
from pmor.machine.loaded import LoadedGearbox
from pmor.machine.set_frame import MEMBERS
from pmor.machine.turn_orders import courses, orders_told, planet_rows, planet_shares
from pmor.sets.lost import known

# Orders of the carrier's turn that are told.
ORDERS = 3
# Of the largest force of all supports.
ROUND_OFF = 1e-9
Data = dict[str, Any]


def turn_data(gearbox: LoadedGearbox, one: SolvedSet) -> Data | None:
    """Return what stands in `gearbox.json` of a set over a turn of its carrier; None of one that was not turned.

    `k_gamma` is the largest load of a planet over the mean of all; force of a bearing row over the mean of all rows;
    amplitudes of orders of the carrier are those of the force across a support, and of all else in `by_order`. Of the
    positions that have a solution.
    """
    turn = one.turn
    if turn is None:
        return None
    share, rows = planet_shares(turn, one), planet_rows(turn)
    told = orders_told(turn, share.shape[1])
    plan = one.meshing.file.plan
    assert plan.on_pins is not None, "of a planetary set"
    return {
        "angle_deg": turn.angle_deg.tolist(),
        "turns": turn.turns,
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
            {"name": bearing.settings.name, **_force_data(force, turn.turns)}
            for bearing, force in zip(gearbox.bearings, _rounded(turn.bearing_force).transpose(1, 0, 2), strict=True)
        ],
        "carrier_orders": told,
        "by_order": [course.data(turn, told) for course in courses(gearbox, one)],
        "members": {
            member: {
                "across_um": (1e3 * moved[:, 1:3]).T.tolist(),
                "along_um": (1e3 * moved[:, 0]).tolist(),
                "tilt_mrad": (1e3 * moved[:, 4:]).T.tolist(),
            }
            for member, moved in zip(MEMBERS, turn.hub_displacement.transpose(1, 0, 2), strict=True)
        },
    }


def _rounded(force: FloatArray) -> FloatArray:
    """Forces on supports (P, s, 6), none where it is round-off: a shaft may stand within the clearance of a bearing."""
    along = np.nan_to_num(np.abs(force[..., :3]))
    return np.where(along.max(axis=(0, 2), keepdims=True) > ROUND_OFF * along.max(initial=0.0), force, 0.0)


def _force_data(force: FloatArray, turns: int) -> Data:
    """Least, mean and largest force across a support, and along its axis, (P, 6); and its orders."""
    across = np.hypot(force[:, 1], force[:, 2])
    lines = np.abs(np.fft.rfft(across)[turns : ORDERS * turns + 1 : turns]) * 2.0 / len(across)
    return {
        "radial_force_min_N": known(np.min, across), "radial_force_mean_N": known(np.mean, across),
        "radial_force_max_N": known(np.max, across), "axial_force_mean_N": known(np.mean, force[:, 0]),
        "carrier_orders_N": lines.tolist(),
    }  # fmt: skip


def states_over(turns: Sequence[CarrierTurn], law: InnerGeometry, seat: int) -> list[BearingState]:
    """Return the states of a bearing on a shaft over a turn of a carrier: of several that which changes its load most.

    Parameters
    ----------
    seat : int
        Its number among the rolling bearings on shafts.
    """
    every = [[law.state(moved) for moved in turn.rings[turn.converged, seat]] for turn in turns if turn.converged.any()]
    return max(every, key=lambda states: np.ptp([one.force[:3] for one in states], axis=0).max(), default=[])


def pin_bearings_over(turn: CarrierTurn | None, planets: Sequence[Data]) -> list[list[Data]]:
    """Return the entries of the bearings of all planets, with elements and life over a turn where that was solved."""
    found = [list(planet["bearings"]) for planet in planets]
    if turn is not None and turn.pins is not None and turn.converged.any():
        by_law = turn.pins.states(turn.rings[turn.converged, -len(turn.pins.seats) :])
        for law, ((planet, bearing), states) in zip(turn.pins.laws, by_law.items(), strict=True):
            own = found[planet][bearing]
            found[planet][bearing] = own | rolling_data(law, states, ON_PINS, own.get("bearing_rpm"))
    return found
