"""The force law of a pair in a table, and the pair's motion on it."""

from functools import cache
from pathlib import Path

import numpy as np
import pytest

import pmor
from pmor.case import load_case
from pmor.dynamics.force_law import load_limit, mean_stiffness, static_displacement
from pmor.dynamics.force_table import Watched, table_error, tabulate
from pmor.dynamics.harmonic_balance import Balance, rest, rms, solve_at
from pmor.dynamics.integration import integrate
from pmor.gear.condition import PLAIN, Assembly, Misalignment, at_torques
from pmor.pair.conditions import assembly_of
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.mesh_force import LineLoadLaw, mesh_force_of, overload_of, place_phases
from tests.support.line_pairs import models, small_pair
from tests.support.motion import along_line_of_action


@cache
def small_table():
    return tabulate(mesh_force_of(small_pair(), PLAIN), -0.001, 0.05)


def test_a_table_is_its_force_law_within_the_error_that_it_states(rng):
    found = table_error(small_table(), mesh_force_of(small_pair(), PLAIN), 25, rng)
    assert found.rms < 2e-5
    assert found.largest < 1e-4  # asked for; 5e-5 at the places between values that the table was made by


def test_the_force_law_at_the_advance_under_a_torque_is_that_torque():
    reduced, torque = small_pair(), 1e5
    phi = np.array([0.0, 0.1, 0.25])
    sweep = sweep_line_loads(reduced, phi, at_torques([torque]))
    pair, force = reduced.meshed.pair, mesh_force_of(reduced)
    for angle, ste_um in zip(phi, sweep.ste_um[0], strict=True):
        found = force(2.0 * np.pi * angle / pair.pitch, 1e-3 * ste_um * np.ones(1))
        np.testing.assert_allclose(pair.pinion.base_radius * found, torque, rtol=1e-8)


@pytest.mark.slow
def test_slow_motion_of_a_pair_is_its_static_transmission_error():
    """Moved so slowly, the pair is at rest under its torque at each phase, where the torque-driven solution has it."""
    reduced, torque = small_pair(), 1e5
    radius, pitch = reduced.meshed.pair.pinion.base_radius, reduced.meshed.pair.pitch
    load, mass = torque / radius, 1e-3
    watched = Watched(load, 3e-5 * 3e-3 * 1e5)  # 3e-5 of a transmission error of 3 um, over a stiffness of 1e5 N/mm
    table = tabulate(mesh_force_of(reduced), -0.001, 0.05, [watched], 1e-3)
    critical = 2.0 * np.sqrt(mean_stiffness(table, load, (-0.001, 0.05)) * mass)
    oscillator, speed = along_line_of_action(mass, 0.5 * critical, load), 1e-6 * critical / mass
    start = np.array([static_displacement(table, load, np.zeros(1), (-0.001, 0.05))[0], 0.0])
    moving = integrate(oscillator, table, start, (speed, speed), 1)
    static = 1e-3 * sweep_line_loads(reduced, moving.phase / (2.0 * np.pi) * pitch, at_torques([torque])).ste_um[0]
    np.testing.assert_allclose(moving.displacement, static, atol=1e-4 * np.ptp(static))


def test_flanks_that_just_touch_carry_nothing_to_the_last_digit():
    """A gap of round-off has no sign: sections do not begin and let go over it without end."""
    pair = models("helical")[1].lines
    assembly = Assembly(Misalignment(out_of_plane_um=900.0))
    placed = place_phases(pair, np.linspace(0.0, 2.0 * np.pi, 512, endpoint=False), assembly)
    touch = (placed.lines.gap / -placed.lines.lever).min(axis=1)
    for places in range(-1, 3):
        found = placed.solve((touch + places * np.spacing(touch))[None], True, placed.deviation(assembly))
        assert found.converged.all()
        assert found.force.max() < 1e-10


def test_the_law_without_a_table_is_that_of_the_sweep_whatever_it_starts_from(rng):
    reduced = small_pair()
    law, sweep = LineLoadLaw(reduced, PLAIN, -0.001, 0.05), mesh_force_of(reduced)
    phase = rng.uniform(-20.0, 20.0, 40)
    for _ in range(3):  # the second and third time from the forces of the time before
        x = rng.uniform(-0.005, 0.05, 40)
        force, slope = law.forces(phase, x)
        exact = np.array([sweep(p, np.array([d]))[0] for p, d in zip(phase, x, strict=True)])
        np.testing.assert_allclose(force, exact, rtol=1e-9, atol=1e-9)  # Newton ends at 3e-6, and is quadratic
        ahead, behind = (law.forces(phase, x + step)[0] for step in (1e-8, -1e-8))
        np.testing.assert_allclose(slope, (ahead - behind) / 2e-8, rtol=1e-3, atol=1.0)  # a section may begin between
    assert np.isnan(law.forces(phase, np.full(40, 0.051))[0]).all()
    backed = LineLoadLaw(reduced, PLAIN, -0.001, 0.05, backlash=0.1)
    np.testing.assert_allclose(backed.forces(-phase, -0.1 - x)[0], -force, rtol=1e-9, atol=1e-9)


def test_the_limit_of_a_law_is_where_line_loads_overload_a_section(rng):
    """Backs of teeth mirror the flanks; under small displacements no section is overloaded at all."""
    reduced, backlash = small_pair(), 0.3
    table = small_table()._replace(high=1.5, backlash=backlash)
    limit, overloaded = load_limit(reduced, PLAIN, table), overload_of(reduced)
    phases = 2.0 * np.pi * (rng.integers(0, 64, 20) / 64.0 + rng.integers(-3, 3, 20))
    for phase in phases:
        edge = float(limit.displacement[round(phase * 64 / (2.0 * np.pi)) % 64])
        assert 0.7 < edge < 1.0
        around = edge + np.array([-2e-3, 2e-3])
        assert overloaded(phase, around).tolist() == [False, True]
        assert limit.exceeded(np.full(2, phase), around).tolist() == [False, True]
        assert limit.exceeded(np.full(2, -phase), -around - backlash).tolist() == [False, True]
    assert np.isinf(load_limit(reduced, PLAIN, small_table()).displacement).all()
    moved = limit.shifted(0.01)
    assert moved.exceeded(np.zeros(1), np.array([limit.displacement[0] + 0.009])).tolist() == [False]


def test_harmonic_balance_on_line_loads_is_that_on_their_table():
    reduced, table = small_pair(), small_table()
    law = LineLoadLaw(reduced, PLAIN, table.low, table.high)
    load, mass = 1e5 / reduced.meshed.pair.pinion.base_radius, 1e-3
    stiffness = mean_stiffness(table, load, (table.low, table.high))
    oscillator = along_line_of_action(mass, 0.1 * np.sqrt(stiffness * mass), load)
    for ratio in (0.5, 0.8, 1.2):
        one, two = (Balance(oscillator, which, cycles=1, harmonics=20) for which in (table, law))
        found = [solve_at(b, ratio * np.sqrt(stiffness / mass), rest(b)) for b in (one, two)]
        # The table: 5e-5 of a force four times the load.
        np.testing.assert_allclose(rms(found[0]), rms(found[1]), rtol=2e-4)


@pytest.mark.slow
def test_a_section_that_only_just_touches_is_in_equilibrium():
    """Its load is below the least one of the law; begun there, rounding threw it to and fro for ever.

    One state in four million of this pair.
    """
    case = load_case(Path(__file__).parents[2] / "cases" / "paper_relief.toml")
    reduced = pmor.train(case).reduced
    pair, assembly = reduced.meshed.pair, assembly_of(case)
    placed = place_phases(reduced.lines, np.array([2.0 * np.pi * 0.26407904754068884 / pair.pitch]), assembly)
    advance = np.array([0.009619448732414413 / pair.pinion.base_radius])
    assert placed.solve(advance, True, placed.deviation(assembly)).converged.all()
