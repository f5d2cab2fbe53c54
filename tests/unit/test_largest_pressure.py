"""The largest pressure has one meaning: that of sections that carry without a sharp edge."""

import numpy as np
from numpy.testing import assert_array_equal

from pmor.results.load_distribution import largest_pressure


def test_sections_at_a_sharp_edge_do_not_count_and_nothing_is_made_up_where_they_carry_alone():
    """Without contact it is 0, at a sharp edge alone there is none, beside others these count."""
    pressure = np.array([[0.0, 0.0], [np.nan, 0.0], [np.nan, 700.0], [900.0, 700.0]])
    assert_array_equal(largest_pressure(pressure, 1), [0.0, np.nan, 700.0, 900.0])
    assert_array_equal(largest_pressure(pressure, (0, 1)), 900.0)
    assert_array_equal(largest_pressure(largest_pressure(pressure, 1), 0), 900.0)  # of parts as of the whole
