"""The relieved 50/50 pair of the Ohio State rig: at which load its transmission error varies least.

Thin slices put the least peak-to-peak at 200 N m; the body, which couples the teeth, moves it up. Slow, and prints the
curve: ``pytest -n 0 -m slow tests/verification/test_ohio_pair.py -s``.
"""

from pathlib import Path

import numpy as np
import pytest

import pmor
from pmor.case import load_case
from pmor.gear.condition import at_torques
from pmor.gear.modification import UNMODIFIED
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.model import online_angles

CASE = Path(__file__).parents[2] / "cases" / "osu_spur.toml"


@pytest.mark.slow
def test_relief_suits_a_load_between_240_and_300_newton_metres():
    case = load_case(CASE)
    reduced = pmor.train(case).reduced
    phi, torques = online_angles(reduced.meshed.pair.pitch, 200), np.arange(100.0, 401.0, 10.0)

    def peak_to_peak(torques_Nm, pinion, wheel):
        sweep = sweep_line_loads(reduced, phi, at_torques(1e3 * torques_Nm, pinion=pinion, wheel=wheel))
        assert sweep.converged.all()
        return np.ptp(sweep.ste_um, axis=1)

    found = peak_to_peak(torques, case.pinion_modification, case.wheel_modification)
    plain = peak_to_peak(np.array([85.0, 340.0]), UNMODIFIED, UNMODIFIED)
    for torque, value in zip(torques, found, strict=True):
        print(f"{torque:5.0f} N m: {value:.3f} um")  # noqa: T201
    print(f"without relief: {plain[0]:.2f} um at 85, {plain[1]:.2f} um at 340 N m")  # noqa: T201
    assert 240.0 <= torques[found.argmin()] <= 300.0
    assert found.min() <= 0.8
    assert plain[1] > 3.0 * plain[0]
