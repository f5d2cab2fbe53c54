"""The measures of the comparison of reductions, on numbers that can be worked out by hand."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.case import parse_case
from pmor.core.errors import CaseError
from pmor.lab.comparison.curves import Curves
from pmor.lab.comparison.measure import effectivity
from pmor.lab.comparison.training import TrainingSet
from pmor.lab.comparison.variants import Grid, grid_families, table_grids, variants
from pmor.work.states import SMALLEST_ERROR_UM
from tests.support.small_case import case_text


def offline_case(solves=150, **ranges):
    keys = {"torques_Nm": [10.0, 200.0], "in_plane_um": [-20.0, 20.0], "out_of_plane_um": [-8.0, 8.0], **ranges}
    text = case_text(
        mesh={"width_elements": 2}, offline={"angles_per_pitch": 8, "sampling": "greedy", "solves": solves, **keys}
    )
    return parse_case(text, "small", "small case")


def test_the_accuracy_is_reached_with_the_least_number_of_solves_whatever_the_order():
    def reached(**errors):
        points = [{"solves": int(n[1:]), "max_percent": error} for n, error in errors.items()]
        return Curves({"sobol": points}, [], 0.05).reached("sobol")

    assert reached(n64=0.01, n8=2.0, n32=0.05, n16=0.06) == 32
    assert reached(n8=2.0, n16=0.06) is None
    assert reached(n8=None, n16=0.05) == 16
    assert reached() is None


def test_effectivity_counts_errors_that_matter_and_takes_magnitudes():
    error = np.array([0.01, -0.02, 0.04, 0.1, 0.5 * SMALLEST_ERROR_UM, math.nan])
    estimate = np.array([0.01, 0.04, -0.004, 0.2, 10.0, 1.0])
    found = effectivity(error, estimate)
    assert found.states == 4
    assert_allclose((found.low, found.median, found.high), np.quantile([1.0, 2.0, 0.1, 2.0], (0.025, 0.5, 0.975)))
    assert found.wanted_share == 0.75
    # Ranks of the magnitudes: errors 2 3 4 5 1, estimates 2 3 1 4 5; 1 - 6 sum d^2 / (n (n^2 - 1)).
    assert_allclose(found.rank_correlation, 1.0 - 6.0 * (9.0 + 1.0 + 16.0) / (5.0 * 24.0))


def test_grids_take_in_the_middle_of_one_range_after_the_other():
    families = grid_families(offline_case().offline)
    assert [Grid(1, values).solves for values in families] == [8, 12, 18, 27]
    assert families[1] == {
        "out_of_plane_um": [-8.0, 0.0, 8.0], "in_plane_um": [-20.0, 20.0], "torques_Nm": [10.0, 200.0]
    }  # fmt: skip


def test_the_grids_of_the_table_are_the_largest_within_the_budget():
    labels = [[grid.label for grid in table_grids(offline_case(solves).offline)] for solves in (150, 75, 47)]
    assert labels == [
        ["12 x 3 x 2 x 2", "5 x 3 x 3 x 3"], ["6 x 3 x 2 x 2", "4 x 3 x 3 x 2"], ["5 x 2 x 2 x 2", "5 x 2 x 2 x 2"]
    ]  # fmt: skip
    with pytest.raises(CaseError, match=r"solves = 31: the smallest grid over the ranges has 32: raise it"):
        table_grids(offline_case(31).offline)


def test_every_variant_is_a_case_of_its_own_with_the_budget_kept():
    listed = variants(offline_case(150), 40)
    assert len({variant.label for variant in listed}) == len(listed)
    for variant in listed:
        offline = variant.case.offline
        assert offline.torques_Nm[-1] == 200.0
        assert variant.sampling in (offline.sampling, "none")
    assert {variant.case.reduction.shapes for variant in listed} == {
        "flank_lines", "positions", "pod", "global_pod", "static_modes"
    }  # fmt: skip


def test_a_part_of_a_training_has_the_time_of_that_part():
    class Solve:
        converged = np.array([True, True])

    whole = TrainingSet(tuple(Solve() for _ in range(4)), (1.0, 2.0, 3.0, 4.0, 4.5))
    assert (whole.solves, whole.first(2).solves) == (8, 4)
    assert whole.first(2).seconds[-1] == 2.0
    assert whole.first(9).seconds[-1] == 4.5
