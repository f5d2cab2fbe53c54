"""Equations of meshes that repeat after several pitches, made-up ones, against a dense solution of all lines.

Those of gears with deviations are in `test_small_motion.py`.
"""

from dataclasses import replace

import numpy as np
from numpy.testing import assert_allclose

from pmor.dynamics.whine.hill import FURTHER, MeshCycle, hill, mesh_cycle
from pmor.dynamics.whine.pitches import over_pitches, time_invariant

# Of conjugate residuals, 1e-11 of the right-hand side, near resonances.
SOLVED = 1e-9
HARMONICS, PITCHES = 3, 5
STIFFNESS = np.array([[3e5, 2e4], [2e4, 4e7]])


def made_up(rng, pitches, unlike):
    """A mesh whose tangent has steps, with pitches that differ by a share of it, and its forces."""
    samples = 16 * pitches * (HARMONICS + 1)
    phase = pitches * np.arange(samples) / samples
    share = 1.0 + 0.3 * (phase % 1.0 < 0.4) + unlike * np.repeat(rng.standard_normal(pitches), samples // pitches)
    force = 100.0 * (phase % 1.0 < 0.4) + 900.0 * unlike * np.interp(phase, np.arange(pitches), rng.random(pitches))
    both = np.stack([force, 3.0 * np.roll(force, samples // 3)], axis=1)
    return mesh_cycle(both, share[:, None, None] * STIFFNESS, both.mean(axis=0), HARMONICS, pitches)


def receptance(cycle, speeds=(0.4, 0.9, 1.3), damping=0.02):
    """Two modes between free and closed ends, met by some line at each speed: mm/N."""
    count, closed = len(cycle.force), cycle.mean
    masses, frequency = np.diag([1.0, 130.0]), np.arange(count) / cycle.pitches * np.array(speeds)[:, None] * 300.0
    dynamic = closed * (1.0 + 2j * damping * np.sign(frequency))[..., None, None]
    return np.linalg.inv(dynamic - frequency[..., None, None] ** 2 * masses)


def test_pitches_that_differ_are_solved_as_a_dense_system_of_all_lines(rng):
    """Differences of a tenth of the stiffness, lines at resonance: each line to nine digits of the largest."""
    cycle = made_up(rng, PITCHES, 0.1)
    moving = receptance(cycle)
    dense = hill(replace(cycle, pitches=1), moving)
    assert_allclose(over_pitches(cycle, moving), dense, atol=SOLVED * abs(dense).max())


def test_pitches_that_are_alike_are_one_pitch(rng):
    """Its harmonics at every fifth line, nothing at the others."""
    one = made_up(rng, 1, 0.0)
    force, tangent = (
        np.zeros((PITCHES * (len(values) - 1) + 1, *values.shape[1:]), dtype=complex)
        for values in (one.force, one.tangent)
    )
    force[::PITCHES], tangent[::PITCHES] = one.force, one.tangent
    several = MeshCycle(force, tangent, pitches=PITCHES)
    found, expected = over_pitches(several, receptance(several)), hill(one, receptance(one))
    assert_allclose(found[:, ::PITCHES], expected, atol=SOLVED * abs(expected).max())
    found[:, ::PITCHES] = 0.0
    assert not found.any()


def test_a_slow_mesh_moves_as_its_transmission_error_with_the_orders_of_shafts_in_it():
    """k (x - e) = 0: tangents of few lines, as those that are left out do not converge else."""
    lines = PITCHES * (HARMONICS + FURTHER)
    samples = 16 * lines
    turn = 2.0 * np.pi * np.arange(samples) / samples
    error = 1e-3 * (2.0 * np.cos(turn) + np.cos(7.0 * turn + 1.0) + np.cos(2.0 * PITCHES * turn))
    tangent = (1.0 + 0.05 * np.cos(PITCHES * turn) + 0.02 * np.cos(3.0 * turn))[:, None, None] * STIFFNESS
    parted = np.stack([error, 0.0 * error], axis=1)
    cycle = mesh_cycle(np.einsum("lab,lb->la", tangent, parted), tangent, np.zeros(2), HARMONICS, PITCHES)
    moved = np.linalg.solve(cycle.mean, time_invariant(cycle)[..., None])[..., 0]
    expected = np.fft.rfft(error)[: lines + 1] / samples
    assert_allclose(moved[:, 0], expected, atol=1e-6 * abs(expected).max())
