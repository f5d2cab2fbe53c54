r"""Harris's rule for tip relief, written for tooth pairs that are coupled, held against the line loads of a spur pair.

Harris (Proc. Inst. Mech. Eng. 172 (1958) 87): relief that begins at the highest point of single contact on both gears
and grows evenly from there takes the same sum off the two pairs of double contact wherever they are. Both share the
load, so that the sum E moves the STE by E / 2, up to that of single contact: the STE of unmodified flanks differs by

    STE_single - STE_double = E / 2,    E = 2 (STE_single - STE_double),

where STE_single and STE_double are those of the middle of single and of double contact, elastic coupling between
neighbouring teeth, and contact beyond the path, included.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.errors import ConvergenceError
from pmor.core.roots_and_minima import least_between
from pmor.gear.condition import Assembly
from pmor.gear.modification import Modification
from pmor.gear.pair import GearPair
from pmor.pair.conditions import assembly_of
from pmor_online.model import ReducedPair, online_angles
from pmor_online.variants import VariantSolver

# Largest amount tried, over that of the rule, and how many; angles per pitch.
AMOUNTS, LARGEST_RATIO, ANGLES = 61, 2.5, 64


@dataclass(frozen=True)
class HarrisRule:
    """Peak-to-peak STE under one torque over the amount of tip relief from the highest point of single contact."""

    torque_Nm: float
    # shape (n,)
    amount_um: FloatArray
    peak_to_peak_um: FloatArray
    rule_um: float  # Amount by the rule
    found_um: float  # Amount of the least peak-to-peak


def obeys(pair: GearPair) -> bool:
    """Whether there is a rule for a pair: spur, with one or two pairs of teeth in contact."""
    return pair.pinion.twist_per_length == 0.0 and 1.0 < pair.contact_ratio < 2.0


def harris_rule(reduced: ReducedPair, torque_Nm: float) -> HarrisRule:
    """Hold the rule against the least peak-to-peak of a pair that `obeys`, under one torque.

    ConvergenceError where a position did not converge.
    """
    pair, misalignment = reduced.meshed.pair, assembly_of(reduced.basis.case).misalignment
    single = VariantSolver(reduced, _middles(pair), (torque_Nm,)).solve(Assembly(misalignment)).ste_um[0]
    rule = 2.0 * float(single[0] - single[1])
    phi = online_angles(pair.pitch, ANGLES, reduced.basis.case.pair.repeats_after)
    solver = VariantSolver(reduced, phi, (torque_Nm,))

    def spread(amount: float) -> float:
        pinion, wheel = (
            Modification(tip_relief_um=float(amount), tip_relief_start_roll_deg=math.degrees(start))
            for start in highest_single_contact(pair)
        )
        return float(np.ptp(solver.solve(Assembly(misalignment, pinion, wheel)).ste_um[0]))

    amounts = np.linspace(0.0, LARGEST_RATIO * rule, AMOUNTS)
    values = np.array([spread(amount) for amount in amounts])
    if not np.isfinite(values).all():
        raise ConvergenceError(f"Harris's rule at {torque_Nm:g} N m: a position did not converge", [])
    least = int(values.argmin())
    near = amounts[max(least - 1, 0)], amounts[min(least + 1, AMOUNTS - 1)]
    quietest = least_between(spread, *near, 1e-3 * rule)
    return HarrisRule(torque_Nm, amounts, values, rule, quietest)


def highest_single_contact(pair: GearPair) -> tuple[float, float]:
    """Roll angles on pinion and wheel of the highest point of single contact, rad."""
    (pinion, _), (wheel, _) = pair.active_rolls
    return pinion + pair.pitch, wheel + pair.pitch * pair.pinion.base_radius / pair.wheel.base_radius


def _middles(pair: GearPair) -> FloatArray:
    """Pinion angles in the middle of single and of double contact, rad."""
    (start, end), _ = pair.active_rolls
    return np.array([pair.roll_position(0.5 * (start + end)), pair.roll_position(0.5 * (start + end - pair.pitch))])
