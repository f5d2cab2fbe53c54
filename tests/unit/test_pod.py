"""POD of snapshots, their files, and measures that compare reductions."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.case import parse_case
from pmor.core.errors import CaseError, ConvergenceError, FileFormatError
from pmor.lab.comparison.curves import Curves
from pmor.lab.comparison.measure import effectivity
from pmor.lab.comparison.training import TrainingSet
from pmor.lab.comparison.variants import Grid, grid_families, table_grids, variants
from pmor.reduction.basis import Snapshots
from pmor.reduction.pod import (
    global_modes,
    local_modes,
    own_displacement,
    principal_combinations,
)
from pmor.storage.basis_file import read_basis
from pmor.storage.describe import file_text
from pmor.storage.snapshot_file import read_snapshots, write_snapshots
from pmor.work.states import SMALLEST_ERROR_UM
from tests.support.broken_files import flip_bit_of, is_empty, is_missing, is_text, is_truncated, lacks, set_attribute
from tests.support.small_case import case_text
from tests.support.stored_files import some_conditions

ROUND_OFF = 1e-11  # of numbers near 1: products of a few dozen terms, two eigenvalue decompositions
UNKNOWNS, POSITIONS, STATES = 9, 6, 4


class Body:
    """A tooth with any compliance."""

    def __init__(self, rng):
        root = rng.normal(size=(UNKNOWNS, UNKNOWNS))
        self.compliance = root @ root.T + 0.1 * np.eye(UNKNOWNS)

    def tooth_compliance(self, offset):
        assert offset == 0, "energy is that of the loaded teeth"
        return self.compliance


@pytest.fixture
def bodies(rng):
    return Body(rng), Body(rng)


@pytest.fixture
def force(rng):
    """Snapshots that turn slowly with the position; the states fall off by a factor of eight from one to the next."""
    fixed, turning = rng.normal(size=(2, STATES, 2, UNKNOWNS))
    angle = 0.3 * np.arange(POSITIONS)[:, None, None, None]
    states = np.cos(angle) * fixed + np.sin(angle) * turning
    mixing = np.tril(np.ones((STATES, STATES))) * 8.0 ** -np.arange(STATES)
    return 100.0 * np.einsum("st,ktgf->ksgf", mixing, states)


def products(bodies, one, two):
    """Energy products of force fields over both gears, by the compliance itself."""
    return sum(one[..., g, :] @ bodies[g].compliance @ np.swapaxes(two[..., g, :], -1, -2) for g in range(2))


def missed(bodies, snapshots, modes):
    """Mean share of the snapshots' energy that no combination of the modes has, by least squares."""
    roots = [np.linalg.cholesky(body.compliance) for body in bodies]

    def columns(fields):
        return np.concatenate([fields[:, g] @ roots[g] for g in range(2)], axis=1).T

    wanted = columns(snapshots)
    wanted /= np.linalg.norm(wanted, axis=0)
    coordinates, *_ = np.linalg.lstsq(columns(modes), wanted, rcond=None)
    return np.mean(np.sum((wanted - columns(modes) @ coordinates) ** 2, axis=0))


def test_displacement_is_that_of_both_loaded_teeth(bodies, force):
    moved = own_displacement(bodies, force)
    for gear in range(2):
        assert_allclose(moved[2, 1, gear], bodies[gear].compliance @ force[2, 1, gear], rtol=1e-12)


@pytest.mark.parametrize("tolerance", [0.5, 1e-2, 1e-4, 1e-6, 1e-8])
def test_no_more_energy_is_discarded_than_the_tolerance(tolerance, bodies, force):
    modes = local_modes(bodies, force, tolerance)
    shares = [missed(bodies, snapshots, m) for snapshots, m in zip(force, modes, strict=True)]
    assert max(shares) <= tolerance
    everywhere = global_modes(bodies, force, tolerance)
    assert missed(bodies, force.reshape(-1, 2, UNKNOWNS), everywhere) <= tolerance


@pytest.mark.parametrize("tolerance", [1e-3, 1e-5])
def test_one_mode_less_would_discard_more(tolerance, bodies, force):
    """At the position that needs most; what is left out by POD is the least that so many shapes can leave out."""
    size = local_modes(bodies, force, tolerance).shape[1]
    assert 1 < size < STATES
    fewer = []
    for snapshots in force:
        energy, combination = principal_combinations(products(bodies, snapshots, snapshots))
        modes = np.einsum("sm,sgf->mgf", combination[:, : size - 1], snapshots)
        fewer.append(missed(bodies, snapshots, modes))
        assert_allclose(fewer[-1], 1.0 - energy[: size - 1].sum(), rtol=1e-6)
    assert max(fewer) > tolerance


@pytest.mark.parametrize("tolerance", [1e-2, 1e-12])
def test_modes_are_orthonormal_in_energy(tolerance, bodies, force):
    modes = local_modes(bodies, force, tolerance)
    identity = np.broadcast_to(np.eye(modes.shape[1]), (POSITIONS, *2 * modes.shape[1:2]))
    assert_allclose(products(bodies, modes, modes), identity, rtol=0.0, atol=ROUND_OFF)


def test_dependent_and_idle_snapshots_give_no_modes(bodies, force):
    force = force[:, [0, 1, 0, 1, 2]]
    force[:, 1] *= 0.0
    force[2] = 0.0
    modes = local_modes(bodies, force, 1e-12)
    exist = modes.any(axis=(2, 3))
    rank = [np.linalg.matrix_rank(f.reshape(len(f), -1), tol=1e-9 * np.abs(force).max()) for f in force]
    assert exist.sum(axis=1).tolist() == rank
    assert rank[2] == 0
    assert (np.diff(exist.astype(int), axis=1) <= 0).all(), "the first ones exist"


def test_without_load_there_is_nothing_to_decompose(bodies, force):
    for modes in (local_modes, global_modes):
        with pytest.raises(ConvergenceError, match="no training state loads a flank"):
            modes(bodies, 0.0 * force, 1e-6)


def assert_positive_symmetric(matrix):
    assert_allclose(matrix, matrix.T, rtol=0.0, atol=ROUND_OFF)
    assert np.linalg.eigvalsh(0.5 * (matrix + matrix.T)).min() > -ROUND_OFF


def test_bases_of_unequal_size_and_gaps_are_aligned_too(bodies, force):
    force[0, 1:], force[1, 2:], force[3], force[5, 1:] = 0.0, 0.0, 0.0, 0.0
    modes = local_modes(bodies, force, 1e-12)
    count = modes.any(axis=(2, 3)).sum(axis=1)
    assert count.tolist() == [1, 2, 4, 0, 4, 1]
    for k, after in ((0, 1), (1, 2), (2, 4), (4, 5)):
        shared = min(count[k], count[after])
        assert_positive_symmetric(products(bodies, modes[k, :shared], modes[after, :shared]))


@pytest.fixture
def snapshots(rng):
    ste_um = np.array([2.5, np.nan])
    force = rng.normal(size=(2, 2, 2, 6))
    return Snapshots(0.25, some_conditions(rng, 2), np.array([-1, 0]), force, ste_um, np.isfinite(ste_um), 0.5)


@pytest.fixture
def path(tmp_path, snapshots):
    write_snapshots(tmp_path / "angle.h5", snapshots, "key")
    return tmp_path / "angle.h5"


def test_snapshots_come_back_bit_for_bit(path, snapshots):
    found = read_snapshots(path, "key")
    assert (found.phi, found.conditions) == (snapshots.phi, snapshots.conditions)
    for name in ("pair_index", "force", "ste_um", "converged"):
        found_array, expected = getattr(found, name), getattr(snapshots, name)
        assert found_array.dtype == expected.dtype
        np.testing.assert_array_equal(found_array, expected)


def test_snapshots_are_replaced(path, snapshots):
    write_snapshots(path, replace(snapshots, phi=0.5), "key")
    assert read_snapshots(path, "key").phi == 0.5


def test_snapshots_of_another_case_do_not_count(path):
    assert read_snapshots(path, "key of another case") is None


@pytest.mark.parametrize(
    "damage",
    [is_missing, is_truncated, is_empty, is_text, set_attribute("schema_version", np.int64(99)), lacks("phi"),
     lacks("force"), flip_bit_of("force")],
    ids=["missing", "truncated", "empty", "text", "newer", "no angle", "no dataset", "flipped"],
)  # fmt: skip
def test_missing_and_damaged_snapshots_count_as_absent(damage, path):
    damage(path)
    assert read_snapshots(path, "key") is None


def test_a_file_that_is_not_ours_is_named(path):
    with pytest.raises(FileFormatError, match="not a pmor-basis file .*pmor-snapshots"):
        read_basis(path)


def test_file_text_knows_snapshots_and_says_that_they_are_damaged(path):
    text = file_text(path)
    assert text.startswith(f"{path}: pmor-snapshots")
    assert "2 x 2 x 2 x 6" in text
    flip_bit_of("force")(path)
    with pytest.raises(FileFormatError, match="damaged"):
        file_text(path)


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
