"""K_v of ISO 6336-1, method B, beside the dynamic factor that motion has."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pmor.case import Case
from pmor.dynamics.measure import HZ, Data
from pmor.gear.classical.iso6336 import (
    COARSE_GRADE,
    RANGES,
    DynamicFactor,
    single_from_mesh_stiffness,
)
from pmor.gear.made_flanks import flank_tolerances
from pmor.gear.pair import GearPair

# Speeds at which K_v is given.
SPEEDS = 200


def iso_factor(case: Case, pair: GearPair, response: Data) -> DynamicFactor:
    """Return K_v of a pair under the torque of a response, with the mean mesh stiffness that the response has."""
    grade, teeth = case.dynamics.accuracy_grade, (pair.pinion, pair.wheel)
    allowed = [flank_tolerances(t.module, 2.0 * abs(t.reference_radius), pair.face_width, grade) for t in teeth]
    pitch, form = (max(getattr(own, key) for own in allowed) for key in ("single_pitch", "profile_form"))
    reliefs = case.pinion_modification.tip_relief_um, case.wheel_modification.tip_relief_um
    return DynamicFactor(
        line_load=1e3 * response["torque_Nm"] / (pair.pinion.reference_radius * pair.common_width),
        stiffness=single_from_mesh_stiffness(
            response["mesh_stiffness_mean_N_per_um"] / pair.common_width, pair.contact_ratio
        ),
        contact_ratio=pair.total_contact_ratio,
        pitch_um=float(pitch) * math.cos(pair.pinion.transverse_pressure_angle),
        form_um=float(form),
        relief_um=0.5 * sum(reliefs) if grade < COARSE_GRADE else None,
    )


def resonance_Hz(mass: float, response: Data) -> float:
    """Return the mesh frequency of resonance ratio 1, equation (6) of the standard; mass on rigid bearings, t."""
    return HZ * math.sqrt(1e3 * response["mesh_stiffness_mean_N_per_um"] / mass)


def rated(case: Case, pair: GearPair, mass: float, response: Data) -> Data:
    """Return K_v over the speeds of a response, and its inputs, for `dynamics.json`."""
    factor, resonance = iso_factor(case, pair, response), resonance_Hz(mass, response)
    lowest, highest = response["mesh_frequencies_Hz"]
    frequency = np.linspace(lowest, highest, SPEEDS)
    return {
        "accuracy_grade": case.dynamics.accuracy_grade,
        "resonance_Hz": resonance,
        "single_stiffness_N_per_mm_um": factor.stiffness,
        "base_pitch_deviation_um": factor.pitch_um,
        "profile_form_deviation_um": factor.form_um,
        "mesh_frequency_Hz": frequency.tolist(),
        "k_v": factor.at(frequency / resonance).tolist(),
    }


def by_range(case: Case, pair: GearPair, mass: float, response: Data) -> Sequence[Data]:
    """Return the largest dynamic factor and K_v of a response in each range of the standard.

    Returns
    -------
    sequence of dict
        `torque_Nm`, `range`, `from` and `to` (resonance ratios), `dynamic_factor` (of stable motion; None where there
        is none), `k_v`, `k_v_without_deviations`.
    """
    factor, resonance = iso_factor(case, pair, response), resonance_Hz(mass, response)
    exact = replace(factor, pitch_um=0.0, form_um=0.0)
    lowest, highest = (f / resonance for f in response["mesh_frequencies_Hz"])
    points = [point for branch in response["branches"] for point in branch if point["stable"]]
    ends = [lowest, *factor.limits, highest]
    rows = []
    for name, begin, end in zip(RANGES, [lowest, *factor.limits], [*factor.limits, highest], strict=True):
        low, high = max(begin, ends[0]), min(end, ends[-1])
        if low >= high:
            continue
        inside = [p["dynamic_factor"] for p in points if low < p["mesh_frequency_Hz"] / resonance <= high]
        # A range begins beyond its lower limit, where K_v may jump.
        ratio = np.linspace(float(np.nextafter(low, high)), high, SPEEDS)
        rows.append({
            "torque_Nm": response["torque_Nm"], "range": name, "from": low, "to": high,
            "dynamic_factor": max(inside, default=None), "k_v": float(factor.at(ratio).max()),
            "k_v_without_deviations": float(exact.at(ratio).max()),
        })  # fmt: skip
    return rows
