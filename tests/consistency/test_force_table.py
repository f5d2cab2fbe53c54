"""The force law of a pair in a table, and the pair's motion on it."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

from pmor.case import load_case, parse_case
from pmor.contact.condition import PLAIN, at_torques
from pmor.dynamics.force_law import forces_at
from pmor.dynamics.force_table import table_error, tabulate
from pmor.dynamics.harmonic_balance import Balance, rest, rms, solve_at
from pmor.dynamics.inertia import disc, equivalent_mass
from pmor.dynamics.integration import integrate, state_of
from pmor.dynamics.operating import mean_stiffness, static_displacement
from pmor.dynamics.oscillator import along_line_of_action
from pmor.dynamics.response import response
from pmor.flank.modification import Modification
from pmor.pair.conditions import built_of
from pmor.pair.model import elastic_model, mesh_model
from pmor_offline.train import train
from pmor_online.line_sweep import line_force_law, sweep_line_loads
from pmor_online.mesh_force import mesh_force_of
from pmor_online.model import reduced_pair
from tests.small_case import case_text


@cache
def small_pair():
    mesh = {"profile_elements": 5, "width_elements": 2}
    text = case_text(mesh=mesh, contact={"scheme": "line"}, reduction={"shapes": "line_loads"})
    case = parse_case(text, "small", "small case")
    return reduced_pair(train(case, elastic_model(case, mesh_model(case))).basis)


@cache
def small_table():
    return tabulate(mesh_force_of(small_pair(), PLAIN), -0.001, 0.05)


def test_a_table_is_its_force_law_within_the_error_that_it_states(rng):
    found = table_error(small_table(), mesh_force_of(small_pair(), PLAIN), 25, rng)
    assert found.rms < 2e-5
    assert found.largest < 1e-4  # asked for; 5e-5 at the places between values that the table was made by


def test_the_force_law_at_the_lead_under_a_torque_is_that_torque():
    reduced, torque = small_pair(), 1e5
    phi = np.array([0.0, 0.1, 0.25])
    sweep = sweep_line_loads(reduced, phi, at_torques([torque]))
    leads = sweep.ste_um[0] * 1e-3 / reduced.meshed.pair.pinion.base_radius
    for angle, lead in zip(phi, leads, strict=True):
        law = line_force_law(reduced, np.array([angle]), [lead])
        np.testing.assert_allclose(1e3 * law.torque_Nm[0, 0], torque, rtol=1e-8)


def test_slow_motion_of_a_pair_is_its_static_transmission_error():
    reduced, table = small_pair(), small_table()
    load = 1e5 / reduced.meshed.pair.pinion.base_radius
    mass = 1e-3
    critical = 2.0 * np.sqrt(mean_stiffness(table, load, (-0.005, 0.045)) * mass)
    oscillator, speed = along_line_of_action(mass, 0.5 * critical, load), 3e-6 * critical / mass
    start = np.array([static_displacement(table, load, np.zeros(1), (-0.005, 0.045))[0], 0.0])
    moving = integrate(oscillator, table, start, (speed, speed), 1)
    static = static_displacement(table, load, moving.phase, (-0.005, 0.045))
    np.testing.assert_allclose(moving.displacement, static, atol=1e-4 * np.ptp(static))
    balance = Balance(oscillator, table, cycles=1, harmonics=100)
    found = balance.displacement(solve_at(balance, speed, rest(balance)))
    static = static_displacement(table, load, balance.phase, (-0.005, 0.045))
    np.testing.assert_allclose(found, static, atol=2e-3 * np.ptp(static))  # a curve with kinks has further harmonics


def test_backs_of_teeth_are_flanks_that_run_the_other_way():
    """In a symmetric pair with its backlash; the teeth are drawn symmetric about the line of centres at angle 0."""
    table = small_table()._replace(backlash=0.1)
    assert not forces_at(table, np.zeros(3), np.array([-0.09, -0.05, -0.01]))[0].any()
    front, back = (forces_at(table, np.array([a]), np.array([x]))[0] for a, x in ((1.0, 0.02), (-1.0, -0.12)))
    np.testing.assert_allclose(back, -front, rtol=1e-12)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("relieved", "damping", "torque_Nm", "run_up"),
    [
        (False, 0.02, 85.0, 0.94), (False, 0.02, 170.0, 0.95), (False, 0.02, 270.0, 0.96), (False, 0.02, 340.0, 0.97),
        (True, 0.02, 85.0, 0.87), (True, 0.02, 170.0, 0.95), (True, 0.02, 270.0, None), (True, 0.02, 340.0, None),
        (True, 0.05, 85.0, 0.88), (True, 0.05, 170.0, None), (False, 0.05, 170.0, None),
    ],
)  # fmt: skip
def test_the_ohio_pair_jumps_where_the_prototype_did(relieved, damping, torque_Nm, run_up):
    """Prototype: the same finite elements, integrated over time; run-up jumps over the natural frequency."""
    table, radii, inertia = ohio_table(relieved)
    load, mass = 1e3 * torque_Nm / radii[0], equivalent_mass(inertia, inertia, radii)
    stiffness = mean_stiffness(table, load, (-0.02, 0.055))
    natural = np.sqrt(stiffness / mass)
    oscillator = along_line_of_action(mass, 2.0 * damping * np.sqrt(stiffness * mass), load)
    found = response(oscillator, table, (0.6 * natural, 1.25 * natural))
    jumps = [fold.point.speed / natural for fold in found.folds if fold.kind == "run_up"]
    if run_up is None:
        assert jumps == []
    else:
        np.testing.assert_allclose(jumps[-1], run_up, atol=0.01)  # given to two digits
    main = found.branches[0]
    steady = [p for p, stable in zip(main.points, found.stable[0], strict=True) if stable]
    for point in steady[:: max(len(steady) // 20, 1)]:
        start = state_of(main.balance, point.unknowns, point.speed)
        motion = integrate(oscillator, table, start, (point.speed, point.speed), 200)
        np.testing.assert_allclose(motion.rms[-1], rms(point.unknowns), rtol=5e-3)


@cache
def ohio_table(relieved):
    case = load_case(Path(__file__).parents[2] / "cases" / "osu_spur.toml")
    reduced = reduced_pair(train(case, elastic_model(case, mesh_model(case))).basis)
    built = built_of(case)
    assert built.pinion != Modification()
    pair = reduced.meshed.pair
    table = tabulate(mesh_force_of(reduced, built if relieved else PLAIN), -0.03, 0.06, 400, 100)
    return table, (pair.pinion.base_radius, pair.wheel.base_radius), disc(75.0, 0.0, 20.0, 7810.0)
