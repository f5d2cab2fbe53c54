"""`pmor.results.sweep`: what is read off a sweep, on signals whose answer is known in closed form."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.results.sweep import (
    mesh_stiffness,
    peak_to_peak_um,
    ripple_um,
    single_pair_zone,
    ste_mean_um,
    torque_exponent,
)
from tests.support.sweeps import made_up_sweep

ROUND_OFF = 1e-12  # sums of a few hundred terms of order one


def make_sweep(ste, torque=(100.0,), single=False):
    """Sweep with the given STE (n_torques, n_angles); `single` marks the angles at which one pair carries all."""
    return made_up_sweep(ste, torque, np.where(np.reshape(single, (-1, 1)), [1.0, 0.0], [0.6, 0.4]))


def test_shapes_that_do_not_belong_together_are_refused():
    with pytest.raises(ValueError, match=r"ste_um has shape \(1, 8\), expected \(2, 8\)"):
        make_sweep(np.zeros(8), torque=(1.0, 2.0))


def test_mean_and_peak_to_peak_use_the_converged_positions():
    sweep = make_sweep([[1.0, 2.0, np.nan, 6.0], [np.nan] * 4], torque=(50.0, 100.0))
    assert_allclose(ste_mean_um(sweep), [3.0, np.nan], rtol=ROUND_OFF)
    assert_allclose(peak_to_peak_um(sweep), [5.0, np.nan], rtol=ROUND_OFF)


def test_single_pair_zone_wraps_around_the_pitch():
    single = np.zeros(20, bool)
    single[[17, 18, 19, 0, 1, 2, 8, 9]] = True
    assert_allclose(single_pair_zone(make_sweep(np.zeros(20), single=single), 0), [17, 18, 19, 0, 1, 2])


@pytest.mark.parametrize("shift", [0, 30, 77], ids=["inside", "wrapped", "wrapped-late"])
def test_ripple_is_what_a_quartic_leaves_over(shift):
    """Quartic plus a fast sine over the zone: the quartic goes, amplitude / sqrt(2) stays, wherever the zone lies."""
    n = 120
    ste, single = np.full(n, 20.0), np.zeros(n, bool)
    t = np.arange(60) / 60
    ste[:60] = 3.0 + t - 4 * t**2 + 5 * t**3 - 2 * t**4 + 0.05 * np.sin(2 * np.pi * 12 * t)
    single[:60] = True
    sweep = make_sweep(np.roll(ste, -shift), single=np.roll(single, -shift))
    # A quartic takes a per mille or two of a sine of 12 periods with it.
    assert_allclose(ripple_um(sweep, 0), 0.05 / np.sqrt(2), rtol=1e-2)


def test_mesh_stiffness_of_a_linear_spring():
    """STE = F_n / (b c): secant and tangent both give c, whatever the order of the torques."""
    torque, radius, width, c = np.array([160.0, 30.0, 100.0]), 40.0, 20.0, np.array([14.0, 16.0, 18.0])
    ste = 1e3 * torque[:, None] / radius / width / c
    result = mesh_stiffness(make_sweep(ste, torque), radius, width)
    assert_allclose(result.secant, np.broadcast_to(c, (3, 3)), rtol=ROUND_OFF)
    assert_allclose(result.tangent, np.broadcast_to(c, (2, 3)), rtol=ROUND_OFF)
    assert_allclose(result.tangent_torque_Nm, [65.0, 130.0])


def test_mesh_stiffness_without_deflection_or_convergence_is_nan():
    result = mesh_stiffness(make_sweep([0.0, np.nan, 2.0]), 40.0, 20.0)
    assert np.isnan(result.secant[0, :2]).all()
    assert result.secant[0, 2] > 0
    assert result.tangent is None


def test_exponent_over_the_torque_is_that_of_a_power_law():
    torques = np.array([10.0, 50.0, 200.0])
    sweep = make_sweep(3.0 * torques[:, None] ** 0.9 * np.ones(8), torques)
    assert_allclose(torque_exponent(sweep), 0.9, rtol=ROUND_OFF)
    assert np.isnan(torque_exponent(make_sweep(np.ones(8))))
