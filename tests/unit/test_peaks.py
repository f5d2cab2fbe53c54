"""Peaks of a response: a made-up curve over the speed."""

import numpy as np

from pmor.dynamics.measure import with_speeds
from pmor.dynamics.solution import PROMINENCE, peaks_of

MODES = [
    {"natural_frequency_Hz": 400.0, "mesh_strain_energy_share": 1e-4},
    {"natural_frequency_Hz": 1000.0, "mesh_strain_energy_share": 0.9},
    {"natural_frequency_Hz": 3000.0, "mesh_strain_energy_share": 0.1},
]


def point(frequency, rms, order=1.0, stable=True):
    amplitudes = {"dominant_order": order, "dominant_order_um": 1.4 * rms, "dynamic_factor": 1.0 + rms}
    size = {"dte_rms_um": rms, "dte_peak_to_peak_um": 2.8 * rms}
    return {"mesh_frequency_Hz": frequency, "stable": stable} | size | amplitudes


def test_a_peak_names_the_order_and_the_mode_that_it_excites():
    """Order 2 at 480 Hz excites the mode of 1,000 Hz, and not that of 400 Hz, which the mesh does not move."""
    branch = [point(300.0, 1.0), point(480.0, 2.0, 2.0), point(700.0, 1.0), point(980.0, 5.0), point(1500.0, 1.0),
              point(2950.0, 2.0), point(3500.0, 0.5)]  # fmt: skip
    found = peaks_of({"branches": [branch], "modes": MODES})
    assert [(peak["mesh_frequency_Hz"], peak["order"], peak["mode"]) for peak in found] == [
        (480.0, 2.0, 2), (980.0, 1.0, 2), (2950.0, 1.0, 3)]  # fmt: skip
    np.testing.assert_allclose([peak["over_natural"] for peak in found], [0.96, 0.98, 2950.0 / 3000.0], rtol=1e-14)
    assert found[1]["order_um"] == 7.0


def test_ripples_unstable_motion_ends_and_the_same_motion_twice_are_no_peaks():
    ripple = 1.0 + 0.9 * PROMINENCE
    branch = [point(2000.0, 9.0), point(1800.0, 1.0), point(1700.0, ripple), point(1600.0, 1.0),
              point(1200.0, 4.0, stable=False), point(1100.0, 1.0), point(900.0, 3.0), point(800.0, 2.0)]  # fmt: skip
    found = peaks_of({"branches": [branch, branch[5:]], "modes": MODES})
    assert [peak["mesh_frequency_Hz"] for peak in found] == [900.0]


def test_speeds_stand_beside_all_frequencies():
    """A pinion of 20 teeth has 1,000 Hz at 3,000 rpm."""
    found = with_speeds({"folds": [{"mesh_frequency_Hz": 1000.0}], "natural_frequencies_Hz": [1000.0, 500.0]}, 20)
    assert found == {"folds": [{"mesh_frequency_Hz": 1000.0, "speed_rpm": 3000.0}],
                     "natural_frequencies_Hz": [1000.0, 500.0], "natural_speeds_rpm": [3000.0, 1500.0]}  # fmt: skip
