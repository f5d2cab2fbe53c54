"""A tree of cells holds a force law with kinks to its tolerance, and is exact where the law is a cubic."""

import numpy as np
import pytest

from pmor.errors import ConvergenceError, OutputError
from pmor.results import force_table
from pmor.results.force_table import CELL, COLUMNS, ROWS, tabulate


def kinked(phase, x):
    """Two springs; the second one's gap changes over the phase."""
    p, d = np.meshgrid(phase, x, indexing="ij")
    gap = 0.01 * (1.0 + np.cos(2.0 * np.pi * p))
    return 1e6 * np.maximum(d, 0.0) + 2e6 * np.maximum(d - gap, 0.0)


def test_between_its_values_a_table_is_the_law_within_its_tolerance(rng):
    table = tabulate(kinked, 0.0, 0.03, 1e-4)
    phase, x = rng.uniform(-2.0, 2.0, 4000), rng.uniform(0.0, 0.03, 4000)
    exact = np.array([kinked([p], [d])[0, 0] for p, d in zip(phase, x, strict=True)])
    error = np.abs(table.force(phase, x) - exact) / 9e4
    # The tolerance holds at points between the values; elsewhere a cubic across a kink swings a little more.
    assert error.max() < 2e-4
    assert len(table.values) < 3000  # between knots of a regular grid errors like that take some 1e6 of them


def test_a_law_of_cubics_takes_no_more_cells_than_there_are_at_first(rng):
    def cubic(phase, x):
        p, d = np.meshgrid(phase, x, indexing="ij")
        return (1.0 + p - 2.0 * p**3) * (2.0 + d**2 + 5.0 * d**3)

    table = tabulate(cubic, 0.0, 1.0)
    assert len(table.values) == len(table.kind) == COLUMNS * ROWS
    phase, x = rng.uniform(0.0, 1.0, 100), rng.uniform(0.0, 1.0, 100)
    exact = (1.0 + phase - 2.0 * phase**3) * (2.0 + x**2 + 5.0 * x**3)
    np.testing.assert_allclose(table.force(phase, x), exact, rtol=1e-6)  # kept in single precision


def test_below_its_range_there_is_no_force_and_above_it_none_that_the_table_knows():
    table = tabulate(kinked, 0.0, 0.03, 1e-2)
    assert table.force(np.array([0.2]), np.array([-1e-3])) == 0.0
    assert np.isnan(table.force(np.array([0.2]), np.array([0.0301])))
    np.testing.assert_allclose(table.force(np.array([0.5, 1.0]), np.array([0.03, 0.03])), [9e4, 5e4], rtol=1e-6)
    assert (table.kind[: COLUMNS * ROWS] != CELL).any()


def test_a_law_with_holes_or_without_end_is_refused(monkeypatch):
    with pytest.raises(ConvergenceError, match="no force between displacements of"):
        tabulate(lambda phase, x: np.where(np.add.outer(phase, x) > 0.7, np.nan, kinked(phase, x)), 0.0, 0.03)
    monkeypatch.setattr(force_table, "MOST_CELLS", 100)
    with pytest.raises(OutputError, match="more than 100 cells"):
        tabulate(kinked, 0.0, 0.03, 1e-6)
