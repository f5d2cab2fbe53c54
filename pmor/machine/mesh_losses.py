"""Losses of a mesh as plain data."""

from __future__ import annotations

import math
from typing import Any

from pmor.gear.pair import GearPair
from pmor.machine.settings import Lubricant
from pmor.results.losses import SlidingLoads, friction_schlenk, loss_factor


def mesh_losses(
    pair: GearPair, lines: SlidingLoads, force_N: float, pinion_rpm: float | None, lubricant: Lubricant
) -> dict[str, Any]:
    """Return loss factor, friction and power lost in a mesh; null without a speed, or at rest.

    Parameters
    ----------
    lines : SlidingLoads
        Over whole pitches, under one torque.
    force_N : float
        In the transverse plane, mean.
    pinion_rpm : float or None
        Against the line of centres: that of the gears of a set counts from its carrier.
    """
    factor = float(loss_factor(pair, lines)[0])
    if not pinion_rpm:
        return {"loss_factor": factor, "friction": None, "power_W": None, "losses_W": None, "efficiency": None}
    friction = lubricant.friction
    if friction == "schlenk":
        of_oil = lubricant.viscosity_mPas, lubricant.roughness_um, lubricant.lubricant_factor
        friction = friction_schlenk(pair, force_N, pinion_rpm, *of_oil)
    power = 1e-3 * force_N * pair.pinion.base_radius * per_second(abs(pinion_rpm))
    lost = float(friction) * factor
    return {
        "loss_factor": factor, "friction": friction, "power_W": power, "losses_W": power * lost,
        "efficiency": 1.0 - lost,
    }  # fmt: skip


def per_second(rpm: float) -> float:
    """Return an angular speed, rad/s."""
    return rpm * 2.0 * math.pi / 60.0
