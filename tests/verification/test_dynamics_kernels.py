"""Compiled kernels of dynamics against slow twins; stability and folds of the benchmark of `pmor.validation.motion`."""

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.linalg import eigvalsh

from pmor.core.errors import ConvergenceError
from pmor.dynamics.continuation import Follower
from pmor.dynamics.force_law import forces_at, static_displacement
from pmor.dynamics.force_table import table_error, tabulate
from pmor.dynamics.harmonic_balance import Balance, rest, rms, solution_of, solve_at
from pmor.dynamics.integration import integrate, run_through
from pmor.dynamics.kernels.laws import VaryingStiffness
from pmor.dynamics.oscillator import Oscillator, static_stiffness_of
from pmor.dynamics.response import response
from pmor.dynamics.stability import between_orders, doublings, monodromy, stability_of
from pmor.validation.motion import BENCHMARK, DIGITS, followed
from tests.support.motion import along_line_of_action, monodromies, multipliers, state_of

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
    motion = integrate(oscillator, LAW, start, (speed, speed), 3, steps=4096)
    assert (motion.force == 0.0).mean() > 0.05
    slow = solve_ivp(
        lambda t, y: np.append(y[n:], acceleration(y[:n], y[n:], t)), (0.0, 6.0 * np.pi / speed), start,
        "DOP853", motion.phase / speed - 1e-14, rtol=1e-11, atol=1e-11,
    )  # fmt: skip
    np.testing.assert_allclose(motion.states, slow.y.T, atol=1e-7)  # steps of 3e-5, squared, where flanks meet; 1e-11


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
        end = integrate(oscillator, balance.law, beside, (speed, speed), 1, steps=256).states[-1]
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
    assert [part.item() for part in static_stiffness_of(turning)] == pytest.approx([0.0, 1.0], abs=1e-12)
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


def test_motion_is_stable_up_to_the_folds_and_unstable_between_them():
    branch, _ = followed(0.05)
    between = np.array([point.tangent[-1] > 0.0 for point in branch.points])
    stable = stability_of(np.linalg.eigvals(monodromies(branch)))
    clear = np.abs([point.tangent[-1] for point in branch.points]) > 2e-3  # of the folds themselves
    assert between[clear].sum() > 10
    np.testing.assert_array_equal(stable[clear], ~between[clear])


def test_a_multiplier_is_one_at_a_fold():
    branch, _ = followed(0.05)
    for fold in branch.folds:
        found = multipliers(branch.balance, fold.point.unknowns, fold.point.speed)
        # Kinks of the force are sampled, in the one place and in the other; measured 1e-3.
        np.testing.assert_allclose(found[0], 1.0, atol=3e-3)


@pytest.mark.parametrize("low", [0.55, 0.87])
def test_no_fold_is_lost_where_the_speeds_begin_amid_the_resonance(low):
    """At 0.87 three motions exist: the branch from above leaves the speeds there without having turned."""
    found = response(along_line_of_action(1.0, 0.1, 1.0), BENCHMARK, (low, 1.4))
    assert len(found.branches) == (2 if low > 0.6 else 1)
    run_up = [fold.point.speed for fold in found.folds if fold.kind == "run_up"]
    np.testing.assert_allclose(run_up, [0.9069], rtol=DIGITS)


def test_motion_not_found_at_the_upper_limit_is_come_to_from_above(monkeypatch):
    def fails_there(balance, speed, start):
        if speed == 1.4:
            raise ConvergenceError("made to fail")
        return solve_at(balance, speed, start)

    monkeypatch.setattr("pmor.dynamics.response.solve_at", fails_there)
    found = response(along_line_of_action(1.0, 0.1, 1.0), BENCHMARK, (0.55, 1.4))
    np.testing.assert_allclose([fold.point.speed for fold in found.folds], [0.8344, 0.9069], rtol=DIGITS)
    assert found.branches[0].speed.max() <= 1.4


def test_the_linear_oscillator_is_unstable_where_theory_says():
    """Limits by Hill's determinant, zeta 0.02."""
    branch, follow = followed(0.02, BENCHMARK._replace(pulls=True), (1.7, 2.3))
    limits = [point.speed for point in doublings(branch, follow, monodromies(branch), (1.7, 2.3), [])]
    np.testing.assert_allclose(limits, [2.08995, 1.90679], rtol=1e-5)
    inside = (branch.speed > limits[1]) & (branch.speed < limits[0])
    np.testing.assert_array_equal(stability_of(np.linalg.eigvals(monodromies(branch))), ~inside)


def test_complex_multipliers_that_leave_the_unit_circle_are_told():
    """A mesh that pulls, varying with the sum of two natural frequencies: motion sways, and no fold nor doubling."""
    oscillator = replace(on_bearings(3.0), damping=np.diag([0.004, 0.004, 0.004]))
    law = LAW._replace(pulls=True)
    mesh = np.outer(oscillator.lever, oscillator.lever)
    natural = np.sqrt(eigvalsh(oscillator.stiffness + mesh, oscillator.mass))
    together = natural[0] + natural[2]
    found = response(oscillator, law, (0.97 * together, 1.03 * together), 4)
    assert found.folds == found.doublings == ()
    assert len(found.swaying) == 2
    assert found.swaying[1] < together < found.swaying[0]
    inside = (found.branches[0].speed < found.swaying[0]) & (found.branches[0].speed > found.swaying[1])
    np.testing.assert_array_equal(found.stable[0], ~inside)


def test_no_doubling_is_told_of_outside_the_speeds_that_were_asked_for():
    branch, follow = followed(0.02, BENCHMARK._replace(pulls=True), (1.7, 2.3))
    limits = [point.speed for point in doublings(branch, follow, monodromies(branch), (2.0, 2.3), [])]
    np.testing.assert_allclose(limits, [2.08995], rtol=1e-5)


@pytest.mark.parametrize("zeta", [pytest.param(0.5, marks=pytest.mark.slow), 0.05])
def test_slow_motion_is_quasi_static_and_stable(zeta):
    """At 0.005 of the natural frequency x = 1 / (1 + 0.2 cos psi), to the order of the inertia, 0.005^2 x 0.2."""
    found = response(along_line_of_action(1.0, 2.0 * zeta, 1.0), BENCHMARK, (0.005, 0.01), 320)
    (branch,), (stable,) = found.branches, found.stable
    assert found.lost == ()
    assert found.doublings == ()
    assert stable.all()
    phase = branch.balance.phase
    for point in branch.points[:: len(branch.points) // 2]:
        displacement = branch.balance.displacement(point.unknowns)[0]
        # Of the damping, 2 zeta w dx/dpsi, at most.
        np.testing.assert_allclose(
            displacement, 1.0 / (1.0 + 0.2 * np.cos(phase)), atol=1e-4 + 0.7 * zeta * point.speed
        )


def test_quasi_static_motion_is_a_start_where_rest_is_none(monkeypatch):
    monkeypatch.setattr("pmor.dynamics.response.rest", lambda balance: np.full(balance.size, 1e3))
    found = response(along_line_of_action(1.0, 0.1, 1.0), BENCHMARK, (0.05, 0.06), 40)
    assert found.lost == ()
    assert found.stable[0].all()


@pytest.mark.parametrize("where", ["continuation", "stability"])
def test_a_place_that_is_not_found_costs_no_branch(monkeypatch, where):
    """In the first case the folds, in the second the doublings."""
    genuine = Follower.refine

    def refine(self, point, step, value):
        if value.__module__ == f"pmor.dynamics.{where}":
            raise ConvergenceError("made to fail")
        return genuine(self, point, step, value)

    monkeypatch.setattr(Follower, "refine", refine)
    law, limits = (BENCHMARK, (0.55, 1.4)) if where == "continuation" else (BENCHMARK._replace(pulls=True), (1.7, 2.3))
    found = response(along_line_of_action(1.0, 0.1 if where == "continuation" else 0.04, 1.0), law, limits)
    assert len(found.branches[0].points) > 10
    assert len(found.lost) == 2
    assert all(
        re.match(r"(jump|period doubling) near mesh frequency 0\.\d+ Hz: made to fail", lost) for lost in found.lost
    )


def test_singular_equations_are_a_failure_in_words():
    with pytest.raises(ConvergenceError, match="singular"):
        solution_of(np.zeros((2, 2)), np.ones(2))


def test_a_branch_whose_stability_is_unknown_is_named_and_leaves_the_others(monkeypatch):
    genuine = monodromy

    def fails_above(balance, unknowns, speed):
        if speed > 1.3:
            raise ConvergenceError("made to fail")
        return genuine(balance, unknowns, speed)

    monkeypatch.setattr("pmor.dynamics.response.monodromy", fails_above)
    found = response(along_line_of_action(1.0, 0.1, 1.0), BENCHMARK, (0.87, 1.4))
    assert [branch.points[0].speed for branch in found.branches] == [0.87]
    assert found.lost == ("branch from the upper limit: made to fail",)


@pytest.mark.slow
def test_motion_inside_the_instability_has_twice_the_period():
    found = response(along_line_of_action(1.0, 0.04, 1.0), BENCHMARK, (1.7, 2.3))
    assert [branch.balance.cycles for branch in found.branches] == [1, 2, 2]
    assert found.lost == ()
    upper, stable = found.branches[1], found.stable[1]
    inside = (upper.speed > 1.92) & (upper.speed < 2.08)
    assert inside.sum() > 2
    assert stable[inside].all()
    for point in np.array(upper.points, dtype=object)[inside][::2]:
        assert between_orders(point.unknowns) > 0.5
        start = state_of(upper.balance, point.unknowns, point.speed)
        motion = integrate(upper.balance.oscillator, BENCHMARK, start, (point.speed, point.speed), 200)
        samples = motion.displacement.reshape(100, -1)
        np.testing.assert_allclose(samples[-1].std(), rms(point.unknowns), rtol=1e-5)  # measured 3e-7
        assert np.ptp(samples[-1, :64] - samples[-1, 64:]) > 1.0


def test_integration_over_time_finds_what_harmonic_balance_found_at_thirty_speeds():
    branch, _ = followed(0.05, limits=(0.4, 1.5))
    held = stability_of(np.linalg.eigvals(monodromies(branch)))
    points = [p for p, stable in zip(branch.points, held, strict=True) if stable]
    chosen = [points[i] for i in np.linspace(0, len(points) - 1, 30).astype(int)]
    for point in chosen:
        start = state_of(branch.balance, point.unknowns, point.speed)
        motion = integrate(branch.balance.oscillator, BENCHMARK, start, (point.speed, point.speed), 60)
        np.testing.assert_allclose(motion.rms[-1], rms(point.unknowns), rtol=5e-4)  # asked for: 5e-3; measured 1.3e-4


@pytest.mark.parametrize(("speeds", "kind"), [((0.9, 0.915), "run_up"), ((0.842, 0.827), "run_down")])
def test_a_slow_run_jumps_at_the_folds(speeds, kind):
    branch, _ = followed(0.05)
    fold = next(fold.point.speed for fold in branch.folds if fold.kind == kind)
    balance = branch.balance
    unknowns = solve_at(balance, 0.7 if kind == "run_up" else 1.0, rest(balance))
    start = state_of(balance, unknowns, speeds[0])
    settled = integrate(balance.oscillator, BENCHMARK, start, (speeds[0], speeds[0]), 200).states[-1]
    pieces = list(run_through(balance.oscillator, BENCHMARK, settled, speeds, 3_000))
    size, speed = (np.concatenate([getattr(p, name) for p in pieces]) for name in ("rms", "cycle_speed"))
    jumped = size > 1.0 if kind == "run_up" else size < 1.0
    assert not jumped[0]
    assert jumped[-1]
    np.testing.assert_allclose(speed[jumped.argmax()], fold, rtol=5e-3)  # late by what the speed gains meanwhile


def test_free_vibration_with_contact_loss_keeps_its_energy():
    free = along_line_of_action(1.0, 0.0, 1.0)
    motion = integrate(free, BENCHMARK._replace(variation=0.0), np.array([3.0, 0.0]), (1.0, 1.0), 200, steps=512)
    assert (motion.force == 0.0).mean() > 0.4
    x, v = motion.states.T
    energy = 0.5 * v**2 + 0.5 * np.maximum(x, 0.0) ** 2 - x
    # Of the energy above rest, 2: steps of 2e-4, squared, each time flanks meet or part.
    assert np.abs(energy - 1.5).max() <= 1e-6 * 2.0
