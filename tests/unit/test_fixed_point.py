"""Fixed points by mixing the rounds before."""

import numpy as np
from numpy.testing import assert_allclose

from pmor.machine.fixed_point import Mixing


def test_the_fixed_point_of_a_linear_map_is_found_in_as_many_rounds_as_it_has_directions_that_return():
    rng = np.random.default_rng(7)
    turned, _ = np.linalg.qr(rng.normal(size=(20, 3)))
    back = turned @ np.diag([0.9, -1.2, 0.4]) @ turned.T
    shift, place, mixing = rng.normal(size=20), np.zeros(20), Mixing()
    for _ in range(5):
        place = mixing.next(place, back @ place + shift)
    assert_allclose(place, np.linalg.solve(np.eye(20) - back, shift), rtol=1e-10)
