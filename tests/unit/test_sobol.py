"""Sobol's points are those of scipy to the last bit, scrambled and not, also beyond the table."""

import pytest
from numpy.testing import assert_array_equal

from pmor.core.sobol import DIRECTIONS, sobol_points


@pytest.mark.parametrize("seed", [None, 19, 20160919])
@pytest.mark.parametrize("dimensions", [1, 2, 5, len(DIRECTIONS) + 1, len(DIRECTIONS) + 2])
def test_points_are_those_of_scipy(dimensions, seed):
    from scipy.stats import qmc

    expected = qmc.Sobol(dimensions, scramble=seed is not None, seed=seed).random_base2(7)
    assert_array_equal(sobol_points(dimensions, 7, seed), expected)
    assert_array_equal(sobol_points(dimensions, 0, seed), expected[:1])
