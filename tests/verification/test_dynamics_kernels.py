"""Each compiled kernel of dynamics against a slow, obvious twin, and many degrees of freedom against one."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from pmor.core.errors import ConvergenceError
from pmor.dynamics.force_law import forces_at, static_displacement
from pmor.dynamics.force_table import table_error, tabulate
from pmor.dynamics.harmonic_balance import Balance, rest, rms, solve_at
from pmor.dynamics.integration import integrate
from pmor.dynamics.kernels.laws import VaryingStiffness
from pmor.dynamics.oscillator import Oscillator, static_stiffness_of
from pmor.dynamics.response import response
from pmor.dynamics.stability import monodromy
from tests.support.motion import along_line_of_action, state_of

LAW = VaryingStiffness(stiffness=1.0, variation=0.2, pulls=False)


def on_bearings(stiffness):
    """A mesh whose gears sit on bearings too: their rotation and two displacements, along the line of action."""
    bearings = np.diag([0.0, stiffness, stiffness])
    mass = np.diag([1.0, 0.8, 1.2])
    damping = np.diag([0.1, 0.0, 0.0]) + 1e-2 * bearings / max(stiffness, 1.0)
    return Oscillator(mass, damping, bearings, np.array([1.0, 1.0, -1.0]), np.array([1.0, 0.0, 0.0]))


def curved(phase, x):
    """A law like that of a mesh: it begins at another displacement at each phase, with a slope that rises from 0."""
    beyond = np.maximum(np.asarray(x) - 0.1 * np.sin(phase), 0.0)
    return (1.0 + 0.2 * np.cos(2.0 * phase)) * beyond / (1.0 - 0.1 * np.log(np.maximum(beyond, 1e-300)))


def accelerations(oscillator, force):
    return lambda q, v, t: np.linalg.solve(
        oscillator.mass,
        oscillator.load - oscillator.damping @ v - oscillator.stiffness @ q
        - oscillator.lever * force(t, oscillator.lever @ q),
    )  # fmt: skip


def test_integration_over_time_is_that_of_another_program():
    oscillator, speed, n = on_bearings(3.0), 0.8, 3
    acceleration = accelerations(oscillator, lambda t, x: (1.0 + 0.2 * np.cos(speed * t)) * max(x, 0.0))
    start = np.array([1.5, 0.3, -0.2, 0.0, 0.5, 0.0])
    motion = integrate(oscillator, LAW, start, (speed, speed), 5, tolerance=1e-10)
    assert (motion.force == 0.0).mean() > 0.05
    slow = solve_ivp(
        lambda t, y: np.append(y[n:], acceleration(y[:n], y[n:], t)), (0.0, 10.0 * np.pi / speed), start,
        "DOP853", motion.phase / speed - 1e-14, rtol=1e-11, atol=1e-11,
    )  # fmt: skip
    np.testing.assert_allclose(motion.states, slow.y.T, atol=1e-7)  # steps at tolerances of 1e-10 and 1e-11


def test_newton_steps_have_the_derivatives_of_their_residual(rng):
    balance = Balance(on_bearings(3.0), tabulate(curved, -0.2, 3.0, tolerance=1e-4), cycles=2, harmonics=5)
    unknowns, way, speed, step = 0.05 * rng.normal(size=balance.size), rng.normal(size=balance.size), 0.7, 1e-6
    unknowns[0] = 1.5
    _, matrix, rate = balance.residual(unknowns, speed)
    ahead, behind = (balance.residual(unknowns + sign * step * way, speed)[0] for sign in (1.0, -1.0))
    faster, slower = (balance.residual(unknowns, speed + sign * step)[0] for sign in (1.0, -1.0))
    np.testing.assert_allclose(matrix @ way, (ahead - behind) / (2.0 * step), atol=1e-7)
    np.testing.assert_allclose(rate, (faster - slower) / (2.0 * step), rtol=1e-6, atol=1e-7)  # central differences


def test_a_disturbance_grows_as_the_difference_of_two_motions_does():
    oscillator, speed = on_bearings(3.0), 0.8
    balance = Balance(oscillator, LAW._replace(pulls=True), cycles=1, harmonics=8)
    unknowns = solve_at(balance, speed, rest(balance))
    start, difference = state_of(balance, unknowns, speed), 1.0  # the mesh pulls: of any size
    for i, column in enumerate(monodromy(balance, unknowns, speed).T):
        beside = start + difference * np.eye(6)[i]
        end = integrate(oscillator, balance.law, beside, (speed, speed), 1, tolerance=1e-12).states[-1]
        np.testing.assert_allclose((end - start) / difference, column, atol=1e-6)  # fourth order; measured 3e-7


def test_harmonic_balance_of_many_degrees_of_freedom_is_motion_over_time():
    oscillator, speed = on_bearings(3.0), 0.6
    balance = Balance(oscillator, LAW, cycles=1, harmonics=20)
    unknowns = solve_at(balance, speed, rest(balance))
    start = state_of(balance, unknowns, speed)
    motion = integrate(oscillator, LAW, start, (speed, speed), 100)
    np.testing.assert_allclose(motion.states[-1], start, atol=1e-3 * np.abs(start).max())
    np.testing.assert_allclose(motion.rms[-1], rms(unknowns), rtol=1e-3)


def test_gears_that_turn_together_are_not_held_and_need_not_be():
    turning = Oscillator(np.eye(2), 0.1 * np.eye(2), np.zeros((2, 2)), np.array([1.0, 1.0]), np.array([1.0, 1.0]))
    assert static_stiffness_of(turning) == pytest.approx((0.0, 1.0), abs=1e-12)
    with pytest.raises(ValueError, match="neither bearings nor mesh"):
        static_stiffness_of(Oscillator(turning.mass, turning.damping, turning.stiffness, turning.lever, np.eye(2)[0]))


def test_a_table_is_its_law_as_well_as_it_is_asked_to():
    for tolerance in (1e-3, 1e-5):
        found = table_error(tabulate(curved, -0.2, 2.0, tolerance=tolerance), curved, 40, np.random.default_rng(1))
        assert found.largest < 2.0 * tolerance  # held at places between values, not all


def test_stiffness_of_a_table_is_the_derivative_of_its_force(rng):
    table = tabulate(curved, -0.2, 2.0, tolerance=1e-4, backlash=0.5)
    phase, x, step = rng.uniform(-10.0, 10.0, 200), rng.uniform(-2.3, 1.9, 200), 1e-6
    exact = (forces_at(table, phase, x + step)[0] - forces_at(table, phase, x - step)[0]) / (2.0 * step)
    np.testing.assert_allclose(forces_at(table, phase, x)[1], exact, atol=1e-6)


def test_back_flanks_push_the_other_way_beyond_the_backlash(rng):
    table, phase = tabulate(curved, -0.2, 2.0, tolerance=1e-4, backlash=0.5), rng.uniform(0.0, 6.0, 50)
    between, beyond = rng.uniform(-0.4, -0.1, 50), rng.uniform(0.2, 1.5, 50)
    assert not forces_at(table, phase, between)[0].any()
    np.testing.assert_allclose(
        forces_at(table, phase, -0.5 - beyond)[0], -forces_at(table, -phase, beyond)[0], rtol=1e-12
    )


def test_beyond_its_range_a_table_gives_no_force_and_nobody_takes_it_for_one():
    table = tabulate(curved, -0.2, 2.0, tolerance=1e-4)
    assert np.isnan(forces_at(table, np.zeros(1), np.full(1, 2.5))[0]).all()
    heavy = along_line_of_action(1.0, 0.1, 10.0)
    with pytest.raises(ConvergenceError, match="leaves the range of the force law"):
        integrate(heavy, table, np.array([1.0, 0.0]), (1.0, 1.0), 10)
    with pytest.raises(ConvergenceError):
        response(heavy, table, (0.5, 1.5))
    with pytest.raises(ConvergenceError, match="not borne"):
        static_displacement(table, 10.0, np.zeros(1), (-0.2, 1.9))
