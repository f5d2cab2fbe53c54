"""Roots and minima against scipy.optimize, which the program does not load."""

import numpy as np
import pytest
import scipy.optimize
from numpy.testing import assert_allclose, assert_array_equal

from pmor.core.roots_and_minima import least_between, least_by_simplexes, root


@pytest.mark.parametrize(
    ("function", "low", "high"),
    [
        (lambda x: x**3 - 2.0 * x - 5.0, 2.0, 3.0), (lambda x: np.exp(x) - 1e5, 50.0, 0.0),
        (lambda x: x, 0.0, 1.0), (lambda x: x - 1.0, 0.0, 1.0), (lambda x: 1.0 if x > 0.123 else -1.0, 0.0, 1.0),
    ],
)  # fmt: skip
def test_a_root_is_where_the_sign_changes(function, low, high):
    assert_allclose(root(function, low, high), scipy.optimize.brentq(function, low, high), rtol=1e-14, atol=4e-12)


def test_a_function_of_one_sign_has_no_root():
    with pytest.raises(ValueError, match="no change of sign"):
        root(lambda x: 1.0 + x**2, -1.0, 1.0)


def test_simplexes_go_the_way_that_scipy_takes():
    rng = np.random.default_rng(1)
    for n in (1, 2, 3, 2, 2):
        matrix, least, evaluations = rng.normal(size=(n, n)), rng.normal(size=n), int(rng.integers(n + 2, 120))
        simplex, bounds = rng.uniform(-1.0, 1.0, (n + 1, n)), [(-1.0, 1.0)] * n

        def function(x, matrix=matrix, least=least):
            return float(np.abs(matrix @ (x - least)).sum() + (np.sin(5.0 * x) ** 2).sum())

        options = {"initial_simplex": simplex, "xatol": 1e-3, "fatol": 1e-5, "maxfev": evaluations}
        found = scipy.optimize.minimize(function, simplex[0], method="Nelder-Mead", bounds=bounds, options=options)
        low, high = np.array(bounds).T
        assert_array_equal(least_by_simplexes(function, simplex, low, high, evaluations, (1e-3, 1e-5)), found.x)


def test_golden_section_finds_a_minimum_and_an_end():
    assert_allclose(least_between(lambda x: abs(x - 0.3), 0.0, 1.0, 1e-6), 0.3, atol=1e-6)
    assert_allclose(least_between(lambda x: x, 0.0, 1.0, 1e-6), 0.0, atol=1e-6)
