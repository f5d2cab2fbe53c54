"""Peaks of a response: a made-up curve over the speed."""

import numpy as np

from pmor.dynamics.measure import with_speeds
from pmor.dynamics.peaks import PROMINENCE, peaks_of

MODES = [
    {"natural_frequency_Hz": 400.0, "mesh_strain_energy_share": 1e-4},
    {"natural_frequency_Hz": 1000.0, "mesh_strain_energy_share": 0.9},
    {"natural_frequency_Hz": 3000.0, "mesh_strain_energy_share": 0.1},
]


def point(frequency, rms, stable=True, period=1, dominant=1.0, lost=0.0):
    amplitudes = {"dominant_order": dominant, "dominant_order_um": 1.4 * rms, "dte_orders_um": (0.9 * rms, 0.5, 0.2)}
    size = {"dte_rms_um": rms, "dte_peak_to_peak_um": 2.8 * rms, "dynamic_factor": 1.0 + rms, "contact_loss": lost}
    return {"mesh_frequency_Hz": frequency, "stable": stable, "period_mesh_cycles": period} | size | amplitudes


def test_a_peak_names_the_harmonic_without_which_it_is_gone_and_the_mode_nearest_to_it():
    """At 490 Hz order 1 is largest, but without order 2 motion is least; at 410 Hz a mode of little strain."""
    branch = [point(300.0, 1.0), point(410.0, 3.0), point(440.0, 1.0), point(490.0, 2.0), point(1500.0, 1.0)]
    left = {(1, 1): 0.5, (1, 2): 2.9, (1, 3): 3.0, (3, 1): 1.9, (3, 2): 0.4}
    first, second = peaks_of([branch], MODES, lambda branch, place, order: left.get((place, order)))
    assert (first["order"], first["mode"], first["dte_rms_without_um"]) == (1, 1, 0.5)
    assert (second["order"], second["mode"], second["order_um"]) == (2, 2, 0.5)
    assert (second["further_order"], second["dte_rms_without_further_um"]) == (1, 1.9)
    assert first["orders_tried"] == [1, 2, 3]
    np.testing.assert_allclose([first["over_natural"], second["over_natural"]], [1.025, 0.98], rtol=1e-14)


def test_where_flanks_part_the_harmonic_that_moves_most_is_named_of_those_without_which_motion_jumps_back():
    """At 550 Hz order 1 has come down from 1000 Hz, and order 2 would be beside that mode."""
    modes, left = MODES[1:], {1: 0.5, 2: 0.4}
    for lost, order in ((0.3, 1), (0.0, 2)):
        branch = [point(500.0, 1.0), point(550.0, 9.0, lost=lost), point(600.0, 1.0)]
        (peak,) = peaks_of([branch], modes, lambda branch, place, order: left.get(order))
        assert peak["order"] == order


def test_motion_of_several_cycles_has_its_largest_order_and_no_proof():
    branch = [point(1900.0, 1.0), point(2000.0, 3.0, period=2, dominant=0.5), point(2100.0, 1.0)]
    (peak,) = peaks_of([branch], MODES, lambda *place: 0.0)
    assert (peak["order"], peak["mode"], peak["dte_rms_without_um"]) == (0.5, 2, None)


def test_ripples_unstable_motion_ends_and_the_same_motion_twice_are_no_peaks():
    ripple = 1.0 + 0.9 * PROMINENCE
    branch = [point(2000.0, 9.0), point(1800.0, 1.0), point(1700.0, ripple), point(1600.0, 1.0),
              point(1200.0, 4.0, stable=False), point(1100.0, 1.0), point(900.0, 3.0), point(800.0, 2.0)]  # fmt: skip
    found = peaks_of([branch, branch[5:]], MODES, lambda *place: None)
    assert [peak["mesh_frequency_Hz"] for peak in found] == [900.0]


def test_speeds_stand_beside_all_frequencies():
    """A pinion of 20 teeth has 1,000 Hz at 3,000 rpm."""
    found = with_speeds({"folds": [{"mesh_frequency_Hz": 1000.0}], "natural_frequencies_Hz": [1000.0, 500.0]}, 20)
    assert found == {"folds": [{"mesh_frequency_Hz": 1000.0, "speed_rpm": 3000.0}],
                     "natural_frequencies_Hz": [1000.0, 500.0], "natural_speeds_rpm": [3000.0, 1500.0]}  # fmt: skip
