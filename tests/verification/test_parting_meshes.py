"""Meshes that part in a flexible machine: modes and tables against integration over time, Hill's equations, line loads.

The box is that of `tests/support/gearboxes.py` with spur gears and a hundredth of critical damping: flanks part about
its mode of 2 kHz.
"""

from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.core.errors import ConvergenceError
from pmor.dynamics.harmonic_balance import Balance, rest, rms, solve_at
from pmor.dynamics.integration import SAMPLES, integrate
from pmor.dynamics.kernels.hub_table import ClosedMeshes, HubTable, table_forces
from pmor.dynamics.oscillator import Oscillator
from pmor.dynamics.response import response
from pmor.dynamics.stability import monodromy
from pmor.dynamics.whine.cycle import standing_meshes
from pmor.dynamics.whine.hill import FURTHER, hill, mesh_cycle, mesh_forces
from pmor.dynamics.whine.modal import closed, modes_of, receptance_of, transfer
from pmor.dynamics.whine.moving import moving_machine
from pmor.dynamics.whine.nonlinear import (
    PHASES,
    ClosedLaw,
    PartingMachine,
    _law,
    backlash_at,
    parting_machine,
)
from pmor.line.hub_law import laws_at
from pmor.machine.coupled import solve_load
from pmor.machine.loader import load
from pmor.machine.run import meshes_and_trains
from pmor_online.mesh_force import mesh_force_of
from tests.support import gearboxes
from tests.support.motion import along_line_of_action, state_of

HZ = 2.0 * np.pi
HARMONICS, RATIO = 15, 0.01
HIGHEST = 9000.0
# About the mode whose flanks part: the box jumps at both folds.
LIMITS = 1845.0, 2150.0


@cache
def spur_box():
    """Machine, its receptance and its mesh."""
    with TemporaryDirectory() as folder:
        path = gearboxes.written(Path(folder), gearboxes.SMALL.replace("62.2", "60.0"))
        case = path.parent / "small.toml"
        case.write_text(case.read_text().replace("helix_angle_deg = 15.0", ""))
        file = load(path)
    pairs, trains = meshes_and_trains(file)
    solved = solve_load(file.model, file.model.sections.loads[0], pairs, 16, trains=trains)
    machine, standing = moving_machine(file.model, solved, HIGHEST), standing_meshes(solved, pairs, 6)
    tangent = standing[0].cycle().mean
    stiffness = closed(machine, tangent)
    modes = modes_of(machine, stiffness, 2.0 * HIGHEST)
    receptance = receptance_of(machine, stiffness, modes, machine.meshes, machine.meshes[:0], RATIO)
    return parting_machine(receptance, tangent, standing, [0]), receptance, standing[0]


@cache
def branches():
    machine, *_ = spur_box()
    return response(machine.oscillator, machine.law, tuple(HZ * limit for limit in LIMITS), HARMONICS)


def balance_of(machine):
    return Balance(machine.oscillator, machine.law, 1, HARMONICS)


def state_at(machine, unknowns, speed):
    return state_of(balance_of(machine), unknowns, speed)


def with_law(machine, **changes):
    return replace(machine, law=ClosedLaw(machine.law.meshes._replace(**changes)))


def test_a_table_is_the_law_of_its_line_loads(rng):
    """Beside the mean deflection to 3e-3 of the largest force, at phases between those that were solved."""
    machine, _, mesh = spur_box()
    table, centre = machine.law.meshes.tables[0], machine.law.centre
    places = centre + centre[0] * rng.uniform(-0.2, 0.2, (20, 2))
    exact, found = _law(mesh, places, 37), np.empty((20, 37, 2, 3))
    for d, place in enumerate(places):
        for a in range(37):
            assert table_forces(table, a / 37.0, *place, found[d, a])
    assert_allclose(found[..., 0], exact.force, atol=3e-3 * exact.force.max())
    assert np.median(abs(found[..., 1:] - exact.tangent)) < 3e-3 * exact.tangent.max()


def test_where_the_pinion_turns_alone_the_law_is_that_of_its_pair():
    """Also where corners meet flanks off the line of action, and their levers turn."""
    mesh, moved = spur_box()[2], 0.01 * np.array([0.3, 1.0, 4.0, 9.0])
    phase, pair = np.linspace(0.0, 1.0, 24, endpoint=False), mesh.reduced.meshed.pair
    found = laws_at(mesh.reduced.lines, pair.pitch * phase, mesh.condition, np.outer(-moved, [1.0, 0.0]))
    forces = mesh_force_of(mesh.reduced, mesh.condition.assembly)
    exact = np.array([forces(HZ * place, moved) for place in phase]).T
    assert_allclose(found.force[..., 0], exact, rtol=1e-9, atol=1e-9 * exact.max())


def test_back_flanks_push_the_other_way_and_tilt_alike(rng):
    table = spur_box()[0].law.meshes.tables[0]
    backed, ahead, behind = table._replace(backlash=0.05), np.empty((2, 3)), np.empty((2, 3))
    for cycle, x, u in rng.uniform([0.0, 0.005, 0.0], [1.0, 0.03, 0.003], (10, 3)):
        assert table_forces(backed, cycle, x, u, ahead)
        assert table_forces(backed, -cycle, -x - 0.05, u, behind)
        assert_allclose(behind, ahead * [[-1.0, 1.0, -1.0], [1.0, -1.0, 1.0]], rtol=1e-9)


def test_backlash_grows_as_hubs_part_along_the_line_of_centres_alone():
    mesh = spur_box()[2]
    sine = np.sin(mesh.reduced.meshed.pair.working_pressure_angle)
    for place, grows in ((7, 2.0 * sine), (6, 0.0), (5, 0.0), (8, 0.0)):
        moved = replace(mesh, displacement=0.01 * np.eye(12)[place])
        assert_allclose(backlash_at(moved, 0.1), 0.1 + 0.01 * grows, rtol=1e-12)


def test_stability_changes_at_folds_and_nowhere_else():
    found = branches()
    ahead = np.array([point.tangent[-1] > 0.0 for point in found.branches[0].points])
    changes, turns = (np.flatnonzero(each[:-1] != each[1:]) for each in (found.stable[0], ahead))
    assert turns.tolist() == changes.tolist()
    assert len(turns) == len(found.folds) == 2


def test_slopes_of_the_law_are_those_of_its_forces(rng):
    """With what the modes leave out inside: central differences."""
    law = spur_box()[0].law
    phase, x, step = rng.uniform(0.0, 6.0, 40), law.centre[:, None] * rng.uniform(0.8, 1.6, (2, 40)), 1e-7
    slope = law.forces(phase, x)[1]
    for place, move in enumerate(step * np.eye(2)):
        ends = [law.forces(phase, x + sign * move[:, None])[0] for sign in (1.0, -1.0)]
        assert_allclose((ends[0] - ends[1]) / (2.0 * step), slope[:, place], atol=1e-4 * abs(slope).max())


def test_the_mean_deflection_is_in_balance():
    """At rest, the forces of its table averaged over the cycle, modes do not move."""
    machine, *_ = spur_box()
    phase = HZ * np.arange(PHASES) / PHASES
    mean = machine.law.forces(phase, np.repeat(machine.law.centre[:, None], PHASES, axis=1))[0].mean(axis=1)
    left = machine.oscillator.load
    assert_allclose(left, mean @ machine.oscillator.rows, atol=2e-3 * abs(left).max())


def test_small_variation_gives_the_motion_of_hill():
    """Forces of the mesh by Hill's equations at none: what differs is the law's curvature, which goes with it.

    At a hundredth of the variation over the cycle it is up to 1.1e-3 of the largest force.
    """
    speeds = HZ * 700.0, HZ * 1500.0, HZ * 2600.0
    full, half = (_beside_hill(variation, speeds) for variation in (0.01, 0.005))
    assert abs(full).max() < 1.5e-3
    assert_allclose(2.0 * half - full, 0.0, atol=1e-4)


def _beside_hill(variation, speeds):
    """Harmonics by harmonic balance less those of Hill, over the largest, at a share of the variation."""
    machine, receptance, mesh = spur_box()
    meshes, count, angles, found = machine.law.meshes, 6, PHASES, []
    values = meshes.tables[0].values
    mean = values.mean(axis=0)
    varied = np.ascontiguousarray(mean + variation * (values - mean))
    small = with_law(machine, tables=(meshes.tables[0]._replace(values=varied),))
    law, x = small.law, np.repeat(machine.law.centre[:, None], angles, axis=1)
    # The table itself along the mean deflection, without what the modes leave out.
    bare = ClosedLaw(law.meshes._replace(tangent=np.zeros((2, 2)), residual=np.zeros((2, 2))))
    force, slope = bare.forces(HZ * np.arange(angles) / angles, x)
    closing = law.meshes.tangent
    own = mesh_cycle(force.T, slope.transpose(2, 0, 1), law.meshes.load, count)
    balance = balance_of(small)
    arms = np.array([1.0, 0.5 * mesh.reduced.meshed.pair.common_width])
    for speed in speeds:
        unknowns = solve_at(balance, speed, rest(balance))
        forces, _ = small.law.mesh_forces(balance.phase, balance.displacement(unknowns))
        here = transfer(receptance, speed * np.arange(count + FURTHER + 1)).ports[None] * np.outer(arms, arms)
        expected = mesh_forces(closing, here, hill(own, here, closing))[0, 1 : count + 1, 0]
        harmonics = np.fft.rfft(forces[0])[1 : count + 1] / len(balance.phase)
        found.append((harmonics - expected) / abs(expected).max())
    return np.array(found)


@pytest.mark.slow
def test_harmonic_balance_with_loss_of_contact_is_motion_over_time():
    """On a stable point of the upper branch, after 400 cycles from its own state: rms 1e-3, wave 1 %."""
    machine, balance, found = spur_box()[0], balance_of(spur_box()[0]), branches()
    stable = [p for p, held in zip(found.branches[0].points, found.stable[0], strict=True) if held]
    point = max((p for p in stable if p.speed > HZ * 1856.0), key=lambda p: rms(balance.by_coordinate(p.unknowns)[0]))
    force, approach = machine.law.mesh_forces(balance.phase, balance.displacement(point.unknowns))
    assert (force[0] == 0.0).mean() > 0.1
    start = state_at(machine, point.unknowns, point.speed)
    found = integrate(machine.oscillator, machine.law, start, (point.speed, point.speed), 400)
    last = slice(-SAMPLES, None)
    pushed, seen = machine.law.mesh_forces(found.phase[last], np.ascontiguousarray(found.displacement[last].T))
    assert_allclose(seen[0].std(), approach[0].std(), rtol=1e-3)
    at = np.roll(np.arange(0, PHASES, PHASES // SAMPLES), -1)
    assert_allclose(seen[0], approach[0, at], atol=1e-2 * np.ptp(approach[0]))
    assert_allclose(pushed[0].std(), force[0].std(), rtol=5e-3)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["run_up", "run_down"])
def test_slow_runs_jump_within_a_hertz_of_the_folds(kind):
    """0.2 mHz a cycle: a jump is late by what the speed gains meanwhile."""
    machine, balance, found = spur_box()[0], balance_of(spur_box()[0]), branches()
    fold = next(fold.point.speed for fold in found.folds if fold.kind == kind) / HZ
    way = 1.0 if kind == "run_up" else -1.0
    first = fold - 3.0 * way
    points = zip(found.branches[0].points, found.stable[0], strict=True)
    near = [p for p, held in points if held and abs(p.speed / HZ - first) < 15.0]
    size = {"run_up": min, "run_down": max}[kind]
    start = size(near, key=lambda p: rms(balance.by_coordinate(p.unknowns)[0]))
    state, previous = state_at(machine, start.unknowns, start.speed), None
    for speed in np.linspace(start.speed / HZ, fold + 3.0 * way, 60):
        found = integrate(machine.oscillator, machine.law, state, (HZ * speed, HZ * speed), 600)
        state, now = found.states[-1], found.displacement[-SAMPLES:, 0].std()
        if previous and abs(np.log(now / previous)) > 0.2:
            break
        previous = now
    assert abs(speed - fold) < 1.0


def test_no_disturbance_grows_by_itself_without_damping():
    """The determinant of the monodromy is that of the damping alone, whatever the mesh does."""
    machine, balance, found = spur_box()[0], balance_of(spur_box()[0]), branches()
    point = found.branches[0].points[len(found.branches[0].points) // 2]
    grown = monodromy(balance, point.unknowns, point.speed)
    damping = np.trace(machine.oscillator.damping)
    # Two matrices of step sizes are extrapolated; measured 2e-5.
    assert_allclose(np.linalg.slogdet(grown).logabsdet, -damping * HZ / point.speed, rtol=1e-4)


def test_motion_beyond_the_table_is_no_motion():
    machine, *_ = spur_box()
    start = np.zeros(2 * machine.oscillator.size)
    start[machine.oscillator.size :] = 1e3
    with pytest.raises(ConvergenceError, match="leaves the range"):
        integrate(machine.oscillator, machine.law, start, (HZ * 1000.0, HZ * 1000.0), 5)


STIFFNESS, BEND, TILTING = 2.0, 0.3, 0.5


SAMPLED, SOFT = 64, 8.0
SWING = SOFT * (1.0 + 0.25 * np.cos(HZ * np.arange(SAMPLED + 1) / SAMPLED))


class Spring:
    """A spring that cannot pull, its stiffness linear between the samples of its cycle: the law of a pair."""

    samples = SAMPLED

    def forces(self, phase, x):
        """As any law gives them."""
        slope = np.interp(phase / HZ % 1.0, np.linspace(0.0, 1.0, SAMPLED + 1), SWING) * (x > 0.0)
        return slope * x, slope


def test_one_mesh_on_rigid_shafts_moves_as_its_pair():
    """One mode, which does not move the second coordinate: folds, and rms there and at other speeds, to 1e-6."""
    mass, load, damping, one = 2.0, 1.0, 0.08, np.ones((1, 1))
    t, values = np.linspace(0.0, 1.0, 9), np.zeros((SAMPLED, 9, 3, 2, 4))
    values[:, :, :, 0, 0] = np.outer(SWING[:-1], 4.0 * t**2)[:, :, None]
    values[:, :, :, 0, 1] = np.outer(SWING[:-1], t)[:, :, None]
    values[:, :, :, 1, 0], values[:, :, :, 1, 2] = TILTING * np.linspace(-1.0, 1.0, 3), TILTING
    meshes = ClosedMeshes(
        (HubTable(0.0, 4.0, 0.0, 1.0, values, np.inf),), np.ones(1), np.zeros(1), np.diag([SOFT, TILTING]),
        np.zeros((2, 2)), np.array([load / SOFT, 0.0]), np.array([load, 0.0]),
    )  # fmt: skip
    rows = np.array([[1.0 / np.sqrt(mass)], [0.0]])
    machine = Oscillator(one, 2.0 * damping * one, SOFT / mass * one, rows, rows.T @ meshes.load)
    pair = along_line_of_action(mass, 2.0 * damping * mass, load)
    systems = (pair, Spring()), (machine, ClosedLaw(meshes, SAMPLED))
    expected, found = (response(*system, (1.6, 2.1), 4) for system in systems)
    assert len(found.folds) == len(expected.folds) > 0
    for ours, theirs in zip(found.folds, expected.folds, strict=True):
        assert_allclose(ours.point.speed, theirs.point.speed, rtol=1e-6)
        assert_allclose(rms(np.split(ours.point.unknowns, 2)[0]), rms(theirs.point.unknowns), rtol=1e-6)
    for speed in (1.0, 1.6, 2.3):
        theirs, ours = (solve_at(one, speed, rest(one)) for one in (Balance(*each, 1, 4) for each in systems))
        assert_allclose(np.split(ours, 2)[0], theirs, atol=1e-6 * rms(theirs))


def made_up():
    """Three modes and a mesh that hardens: forces that its table holds exactly, of a known energy."""
    low, span, rows, columns = 0.0, 4.0, 9, 3
    t = np.linspace(0.0, 1.0, rows)
    x, by_step = low + span * t**2, 2.0 * span * t / (rows - 1)
    values = np.zeros((4, rows, columns, 2, 4))
    values[:, :, :, 0, 0] = (STIFFNESS * x + BEND * x**1.5)[:, None]
    values[:, :, :, 0, 1] = ((STIFFNESS + 1.5 * BEND * np.sqrt(x)) * by_step)[:, None]
    values[:, :, :, 1, 0] = TILTING * np.linspace(-1.0, 1.0, columns)
    values[:, :, :, 1, 2] = TILTING * 2.0 / (columns - 1)
    table = HubTable(low, span, 0.0, 1.0, values, np.inf)
    centre, lever = np.array([1.0, 0.0]), np.array([[1.0, 0.5, -0.3], [0.2, -0.4, 0.6]])
    square = np.array([0.5, 2.0, 9.0])
    load, tangent = np.array([STIFFNESS + BEND, 0.0]), np.diag([STIFFNESS + 1.5 * BEND, TILTING])
    meshes = ClosedMeshes((table,), np.zeros(1), np.zeros(1), tangent, np.zeros((2, 2)), centre, load)
    oscillator = Oscillator(np.eye(3), np.zeros((3, 3)), np.diag(square), lever, lever.T @ load)
    return PartingMachine(oscillator, ClosedLaw(meshes, 4), np.ones(2))


@pytest.mark.slow
def test_energy_is_kept_over_a_thousand_cycles():
    """Without damping and separation: 1e-6 of the energy of the motion."""
    machine = made_up()

    def energy(state):
        x, u = machine.law.centre + machine.oscillator.rows @ state[:3]
        mesh = 0.5 * STIFFNESS * x**2 + BEND * x**2.5 / 2.5 - 0.5 * (STIFFNESS + 1.5 * BEND) * (x - 1.0) ** 2
        modes = 0.5 * state[3:] @ state[3:] + 0.5 * np.diag(machine.oscillator.stiffness) @ state[:3] ** 2
        return modes + mesh - machine.oscillator.load @ state[:3]

    start = np.array([0.0, 0.0, 0.0, 0.3, -0.2, 0.1])
    found = integrate(machine.oscillator, machine.law, start, (1.0, 1.0), 1000, steps=64)
    assert found.displacement[:, 0].min() > 0.1
    end, begun, lowest = energy(found.states[-1]), energy(start), energy(np.zeros(6))
    assert abs(end - begun) < 1e-6 * (begun - lowest)
