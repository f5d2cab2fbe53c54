"""A tree of cells holds a force law with kinks to its tolerance, without steps, and is exact where it is a cubic."""

import numpy as np
import pytest

from pmor.core.errors import ConvergenceError
from pmor.dynamics import force_table
from pmor.dynamics.force_law import forces_at, static_displacement
from pmor.dynamics.force_table import Watched, table_error, tabulate

TURN = 2.0 * np.pi


def kinked(phase, x):
    """Two springs; the second one's gap changes over the phase."""
    gap = 0.01 * (1.0 + np.cos(phase))
    return 1e6 * np.maximum(x, 0.0) + 2e6 * np.maximum(x - gap, 0.0)


def uneven(phase, x):
    """The same over five cycles, in the third of which the second gap is wider."""
    cycle = phase / TURN % 5.0
    wider = 0.01 * np.sin(np.pi * (cycle - 2.0)) ** 2 if 2.0 < cycle < 3.0 else 0.0
    gap = 0.01 * (1.0 + np.cos(phase)) + wider
    return 1e6 * np.maximum(x, 0.0) + 2e6 * np.maximum(x - gap, 0.0)


def test_between_its_values_a_table_is_the_law_within_its_tolerance(rng):
    table = tabulate(kinked, 0.0, 0.03, tolerance=1e-4)
    assert table_error(table, kinked, 60, rng).largest < 2e-4  # a cubic across a kink swings a little more elsewhere
    assert len(table.values) < 3000  # between knots of a regular grid errors like that take some 1e6 of them


def test_the_force_has_no_steps(rng):
    """From cell to cell, and from cycle to cycle of different kinds; without `join` the largest is 2e-3."""
    table = tabulate(uneven, 0.0, 0.03, tolerance=3e-3, alike=(0, 1, 2, 3, 4))
    for _ in range(50):
        phase, x = rng.uniform(0.0, 5.0 * TURN), rng.uniform(0.0, 0.03)
        along_x = forces_at(table, np.full(20001, phase), np.linspace(0.0, 0.03, 20001))[0]
        along_phase = forces_at(table, np.linspace(-TURN, 6.0 * TURN, 140001), np.full(140001, x))[0]
        steps = [np.abs(np.diff(force)).max() / 9e4 for force in (along_x, along_phase)]
        # Both springs over a 20,000th of the range; the gap moves by 1e-2 rad of phase at most.
        assert max(steps) < 3e-4


def test_the_displacement_under_a_watched_load_is_known_far_better(rng):
    load, phase = 2.4e4, rng.uniform(0.0, TURN, 2000)
    gap = 0.01 * (1.0 + np.cos(phase))
    exact = np.where(1e6 * gap > load, load / 1e6, (load + 2e6 * gap) / 3e6)
    missed = []
    for watched in ((), (Watched(load, 1e-2),)):
        table = tabulate(kinked, 0.0, 0.03, watched, 1e-3)
        missed.append(np.abs(static_displacement(table, load, phase, (0.0, 0.03)) - exact).max())
    assert missed[1] < 3e-8  # an error of 1e-2 over a stiffness of 1e6, and a swing across a kink
    assert missed[0] > 1e-6


def test_cycles_that_are_alike_are_solved_once():
    asked = set()

    def counted(phase, x):
        asked.add(int(phase / TURN - 1e-9))
        return uneven(phase, x)

    alike = (0, 1, 2, 3, 0)  # the third one differs, and stands between the second and the fourth
    table = tabulate(counted, 0.0, 0.03, tolerance=1e-3, alike=alike)
    assert asked == {0, 1, 2, 3}
    phase, x = np.linspace(0.0, 10.0 * TURN, 3000), np.full(3000, 0.021)
    exact = np.array([uneven(p, 0.021) for p in phase])
    np.testing.assert_allclose(forces_at(table, phase, x)[0], exact, atol=3e-3 * 9e4)


def test_a_law_of_cubics_takes_no_more_cells_than_there_are_at_first(rng):
    def cubic(phase, x):
        p = phase / TURN
        return (1.0 + 0.0 * p) * (2.0 + x**2 + 5.0 * x**3)

    table = tabulate(cubic, 0.0, 1.0)
    assert len(table.values) == len(table.kind)
    assert table_error(table, cubic, 20, rng).largest < 1e-13


def test_below_its_range_there_is_no_force_and_above_it_none_that_the_table_knows():
    table = tabulate(kinked, 0.0, 0.03, tolerance=1e-2)
    assert forces_at(table, np.array([0.2]), np.array([-1e-3])) == (0.0, 0.0)
    assert np.isnan(forces_at(table, np.array([0.2]), np.array([0.0301]))[0])
    ends = forces_at(table, np.array([0.5, 1.0]) * TURN, np.array([0.03, 0.03]))[0]
    np.testing.assert_allclose(ends, [9e4, 5e4], rtol=1e-12)


def test_a_law_with_holes_or_without_end_is_refused(monkeypatch):
    with pytest.raises(ConvergenceError, match="no force at a displacement of"):
        tabulate(lambda phase, x: np.where(phase / TURN + x > 0.7, np.nan, kinked(phase, x)), 0.0, 0.03)
    monkeypatch.setattr(force_table, "MOST_CELLS", 100)
    with pytest.raises(ConvergenceError, match="more than 100 cells"):
        tabulate(kinked, 0.0, 0.03, tolerance=1e-6)
