"""Quantities of motion, from cycles and runs that are made up."""

from types import SimpleNamespace

import numpy as np
import pytest

from pmor.dynamics import quantities
from pmor.dynamics.integration import SAMPLES, Motion
from pmor.dynamics.measure import HIGHEST_ORDER, follow
from pmor.dynamics.quantities import Cycle
from pmor.dynamics.whine.parting import ranges_of


def test_contact_is_lost_while_neither_flanks_nor_backs_touch(monkeypatch):
    """Coast flanks push with negative forces; bearings carry what is across the axis."""
    size, bearing = 4, np.zeros((4, 2, 3))
    bearing[1, 0], bearing[2, 1] = (3.0, 4.0, 12.0), (-5.0, 12.0, 84.0)
    cycle = Cycle(
        phase=np.arange(size), displacement=np.array([0.01, -0.002, 0.0, 0.02]), velocity=np.zeros(size),
        force=np.array([-1.0, 0.0, 0.0, 9.0]), bearing=bearing, positions=np.zeros((size, 0)),
    )  # fmt: skip
    monkeypatch.setattr(quantities, "cycle_of", lambda *arguments: cycle)
    unknowns = np.array([0.01, 3e-3, 4e-3, 0.0, 0.0, 0.0, 1e-3])
    found = quantities.quantities(None, SimpleNamespace(cycles=1), unknowns, 1.0)
    assert found.contact_loss == 0.5
    assert (found.smallest_force_N, found.largest_force_N) == (-1.0, 9.0)
    assert found.dynamic_factor == pytest.approx(4.5)
    assert found.separation_um == pytest.approx(2.0)
    assert found.dte_orders_um[:3] == pytest.approx((5.0, 0.0, 1.0))
    assert found.bearing_force_N == pytest.approx((5.0, 13.0))


def test_motion_of_flanks_that_part_is_looked_for_around_the_speeds_where_they_do():
    """Down to 0.8 and up to 1.1 of them, within the speeds asked for; ranges that overlap are one."""
    speeds, parted = np.linspace(100.0, 1000.0, 10), np.zeros(10, dtype=bool)
    parted[[0, 5, 6, 9]] = True
    expected = ((100.0, 110.0), (480.0, 770.0), (800.0, 1000.0))
    np.testing.assert_allclose(ranges_of(speeds, parted), expected)


def test_a_line_at_the_order_of_a_shaft_keeps_its_height_and_its_order():
    """Once to 21 mesh cycles 10 um, 1 um in each, a sideband: no lines beside them, rms about the mean of all."""
    period, cycles = 21, 210
    phase = 2.0 * np.pi * np.arange(1, cycles * SAMPLES + 1) / SAMPLES
    x = 1e-3 * (10.0 * np.sin(phase / period) + np.cos(phase) + 0.2 * np.cos(22.0 / 21.0 * phase))
    zero = np.zeros((len(x), 2))
    run = Motion(phase, np.full(len(x), 1000.0), zero, x, 1.0 + 0.0 * x, period)
    points, spectra = follow([run], cycles, period)
    expected = np.zeros(int(HIGHEST_ORDER * period) + 1)
    expected[[1, 21, 22]] = 10.0, 1.0, 0.2
    for amplitudes in spectra["amplitude_um"]:
        np.testing.assert_allclose(amplitudes, expected, atol=1e-4)  # five digits are kept
    np.testing.assert_allclose(spectra["order"], np.arange(len(expected)) / period, rtol=1e-12)
    exact = np.sqrt(0.5 * (100.0 + 1.0 + 0.04))
    np.testing.assert_allclose([point["dte_rms_um"] for point in points], exact, rtol=1e-9)
    np.testing.assert_allclose([point["separation_um"] for point in points], -1e3 * x.min(), rtol=1e-2)
