"""Peaks of a response: a made-up curve over the speed."""

import numpy as np
import pytest

from pmor.dynamics.force_table import tabulate
from pmor.dynamics.gear_model import GearModel, Support
from pmor.dynamics.measure import BRANCHES, HZ, Task, solve, with_speeds
from pmor.dynamics.output import _peaks
from pmor.dynamics.peaks import NO_SINGLE, PROMINENCE, peaks_of
from pmor.dynamics.quantities import UM
from pmor.gear.inertia import Inertia

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


def test_a_harmonic_beyond_those_that_are_told_is_found_and_a_peak_that_none_makes_is_said_to_be_one():
    """At 170 Hz the sixth of the mode at 1,000 Hz, three are told; without any the other peak is as high."""
    branch = [point(150.0, 1.0), point(170.0, 2.0), point(190.0, 1.0), point(950.0, 1.0), point(990.0, 2.0),
              point(1050.0, 1.0)]  # fmt: skip
    found = peaks_of([branch], MODES, lambda _, place, order: 1.0 if (place, order) == (1, 6) else 1.99)
    assert [(peak["order"], peak["mode"], peak["made_by_one"]) for peak in found] == [(6, 2, True), (1, 2, False)]
    assert found[0]["order_um"] is None
    shown = _peaks([with_speeds({"torque_Nm": 1.0, "peaks": found}, 20)])
    assert [row[6] for row in shown.rows] == [6, NO_SINGLE]
    assert "no single harmonic makes this peak" in shown.note


def small_pair(low_Hz, high_Hz):
    """A pair whose wheel gives way on a bearing, with these natural frequencies, and the stiffness of its mesh.

    By the sum and the product of both squares; the softer mode has little strain in the mesh.
    """
    stiffness, bearing_mass = 3e5, 1e-3
    low, high = (low_Hz / HZ) ** 2, (high_Hz / HZ) ** 2
    half = 0.5 * (low + high - stiffness / bearing_mass)
    mass = stiffness / (half + np.sqrt(half**2 - low * high))
    spring = low * high * mass * bearing_mass / stiffness
    support = Support(1, 1, bearing_mass, spring, 0.006 * np.sqrt(spring * bearing_mass), 1.0)
    gears = Inertia(1.0, 1.0, 1.0), Inertia(1.0, 1.0, 1.0)
    return GearModel(gears, mass, (support,), np.zeros((2, 3)), 40.0), stiffness


@pytest.mark.parametrize(
    ("limits", "forces", "order", "mode", "near"),
    [((820.0, 870.0), {1: 100.0}, 1, 1, 846.0), ((2030.0, 2120.0), {1: 300.0, 3: 5.0}, 3, 2, 2073.0)],
)
def test_a_pair_by_construction_has_its_peak_by_the_harmonic_that_meets_a_mode(limits, forces, order, mode, near):
    """Of a mode with hardly any strain in the mesh, and by the third harmonic, though the first is larger."""
    model, stiffness = small_pair(846.0, 6229.0)

    def force(phase, x):
        return np.maximum(stiffness * x + sum(size * np.cos(k * phase) for k, size in forces.items()), 0.0)

    law = tabulate(force, -2e-3, 0.05, tolerance=1e-3)
    found = solve(Task(model, law, 100.0, None, 0.01, limits, True, 0), BRANCHES)
    (peak,) = found["peaks"]
    assert abs(peak["mesh_frequency_Hz"] - near) < 0.01 * near
    assert (peak["order"], peak["mode"], peak["made_by_one"]) == (order, mode, True)
    assert [round(one["natural_frequency_Hz"]) for one in found["modes"]] == [846, 6229]
    assert found["modes"][0]["mesh_strain_energy_share"] < 0.01
    assert order == 1 or peak["order_um"] < 300.0 / stiffness * UM
    (row,) = _peaks([with_speeds(found, 20)]).rows
    assert (row[6], row[8]) == (order, mode)


def test_speeds_stand_beside_all_frequencies():
    """A pinion of 20 teeth has 1,000 Hz at 3,000 rpm."""
    found = with_speeds({"folds": [{"mesh_frequency_Hz": 1000.0}], "natural_frequencies_Hz": [1000.0, 500.0]}, 20)
    assert found == {"folds": [{"mesh_frequency_Hz": 1000.0, "speed_rpm": 3000.0}],
                     "natural_frequencies_Hz": [1000.0, 500.0], "natural_speeds_rpm": [3000.0, 1500.0]}  # fmt: skip
