"""Arrays of a sweep for tables."""

from __future__ import annotations

import numpy as np

from pmor.export.tables import ResultArray
from pmor.gear.pair import GearPair
from pmor.results.sweep import SteSweep, mesh_stiffness, orders_of

STATE = ("torque", "angle")
TORQUE_TEXT = "on the pinion"


def sweep_entries(sweep: SteSweep, pair: GearPair) -> dict[str, ResultArray]:
    """Return transmission error, load sharing, stiffness and orders of a sweep by their names."""
    torque = ResultArray(sweep.torque_Nm, "N m", STATE[:1], TORQUE_TEXT)
    angle = ResultArray(sweep.phi_rad, "rad", STATE[1:], "pinion angle")
    rotation = 1e3 * sweep.ste_um / pair.pinion.base_radius
    stiffness = mesh_stiffness(sweep, pair.pinion.base_radius, pair.common_width).secant
    found = {
        "ste/torque": torque, "ste/phi": angle,
        "ste/ste": ResultArray(
            sweep.ste_um, "um", STATE, "static transmission error along the transverse line of action"
        ),
        "ste/rotation": ResultArray(rotation, "urad", STATE, "the same as rotation of the pinion"),
        "ste/converged": ResultArray(sweep.converged, "1", STATE, "1 where the position converged"),
        "ste/pair_index": ResultArray(
            sweep.pair_index, "1", ("pair",), "tooth pair: at the roll position phi + 2 pi j / z1"
        ),
        "ste/pair_share": ResultArray(
            sweep.pair_share, "1", (*STATE, "pair"), "share of the torque that a pair carries"
        ),
        "stiffness/torque": torque, "stiffness/phi": angle,
        "stiffness/secant": ResultArray(
            stiffness, "N/(mm um)", STATE, "force along the line of action per width over STE"
        ),
    }  # fmt: skip
    if sweep.unloaded_um is not None:
        found["ste/unloaded"] = ResultArray(sweep.unloaded_um, "um", STATE, "transmission error of rigid flanks")
    bar = sweep.error_bar_um
    if bar is not None:
        found["ste/error_bar"] = ResultArray(bar, "um", STATE, "estimated error of reduction and mesh")
    if sweep.converged.all():
        orders = [orders_of(sweep, row) for row in range(len(sweep.torque_Nm))]
        found |= {
            "orders/torque": torque,
            "orders/order": ResultArray(orders[0].order, "1", ("order",), "periods per turn of the pinion"),
            "orders/amplitude": _of_orders(
                "um", "of the transmission error, zero to peak", [o.amplitude for o in orders]
            ),
            "orders/phase": _of_orders("rad", "of the cosine at pinion angle 0", [o.phase for o in orders]),
        }
    return found


def _of_orders(unit: str, text: str, rows: list[np.ndarray]) -> ResultArray:
    return ResultArray(np.stack(rows), unit, ("torque", "order"), text)
