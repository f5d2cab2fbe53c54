"""Bounds of meshes whose axes are moved: by closed forms of the geometry."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.line.train import smooth_rows
from pmor.pair.bounds import coast_gap_um
from tests.support.gear_models import gear_pair, tooth
from tests.support.internal_pairs import internal_pair, ring

# A step of the axes, mm, and what is of its second order in gaps.
STEP, SECOND = 1e-3, 2e-4
PAIRS = {
    "external": gear_pair(tooth(17, 0.4), tooth(31, 0.1), extra_distance=0.3),
    "helical": gear_pair(tooth(21, 0.0, 15.0), tooth(31, 0.2, -15.0), extra_distance=0.1),
    "internal": internal_pair(tooth(20), ring(60, module=4.0, addendum=0.8), closer=0.1),
}
every_pair = pytest.mark.parametrize("pair", PAIRS.values(), ids=PAIRS.keys())


@every_pair
@pytest.mark.parametrize("place", [(0, 0), (0, 1), (1, 1), (0, 5), (1, 5)])
def test_gaps_of_both_flanks_together_change_as_the_backlash_of_the_moved_pair(place, pair):
    """Backlash depends on the centre distance alone: other movements open one side and close the other."""
    gear, direction = place
    moved = np.zeros((2, 6))
    moved[gear, direction] = STEP if direction < 3 else STEP / pair.pinion.base_radius
    apart = (moved[1, 1] - moved[0, 1]) if direction == 1 else 0.0
    both = 1e-3 * float(coast_gap_um(pair, moved)) + float((moved * smooth_rows(pair)).sum())
    opened = replace(pair, centre_distance=pair.centre_distance + apart).backlash
    assert_allclose(both, opened, atol=SECOND * STEP)


@every_pair
def test_a_pinion_that_runs_ahead_opens_its_coast_side(pair):
    moved = np.zeros((2, 6))
    moved[0, 5] = STEP / pair.pinion.base_radius
    assert_allclose(coast_gap_um(pair, moved), 1e3 * (pair.backlash + STEP), rtol=1e-12)
