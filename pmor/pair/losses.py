"""Power that a mesh loses, from the loss factor of its line loads, speed and lubricant."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pmor.core.ranges import Range
from pmor.gear.pair import GearPair
from pmor.results.load_distribution import friction_schlenk


@dataclass(frozen=True, kw_only=True)
class Lubricant:
    """What friction in the meshes depends on (section `[lubricant]`).

    Parameters
    ----------
    friction : "schlenk" or float
        Mean coefficient of friction: after Schlenk (1995), or a number. Formulas differ by up to a factor of two.
    viscosity_mPas : float
        Dynamic viscosity at the temperature of the oil.
    roughness_um : float
        Ra of the flanks, mean of both gears.
    lubricant_factor : float
        X_L of Schlenk's formula: 1 of mineral oil.
    """

    friction: Annotated[float, Range(0.0, 1.0)] | Literal["schlenk"] = "schlenk"
    viscosity_mPas: Annotated[float, Range(0.1, 1e5, "mPa s")] = 20.0
    roughness_um: Annotated[float, Range(0.01, 100.0, "um")] = 0.4
    lubricant_factor: Annotated[float, Range(0.1, 3.0)] = 1.0


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
