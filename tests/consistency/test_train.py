"""Training in memory: no file, no screen, and the same basis to the last bit whoever does the work."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from pmor.case import parse_case
from pmor.pair.model import elastic_model, mesh_model
from pmor_offline.train import train
from pmor_online.compare import compare_models
from pmor_online.errors import estimate_errors
from pmor_online.model import reduced_pair
from tests.support.small_case import case_text

pytestmark = pytest.mark.usefixtures("few_candidates")
GREEDY = {"sampling": "greedy", "solves": 7, "tolerance_percent": 1e-9}  # four to begin with, three that are chosen


@pytest.fixture(scope="module")
def model():
    case = case_of()
    return elastic_model(case, mesh_model(case))


def case_of(**offline):
    return parse_case(case_text(offline=offline), "small", "small")


def assert_same(one, other):
    """Everything that is a number of two bases, but how long they took."""
    for field in fields(one.training):
        if field.name not in ("seconds", "conditions"):
            assert_array_equal(getattr(one.training, field.name), getattr(other.training, field.name), field.name)
    assert one.training.conditions == other.training.conditions
    for lines, expected in zip(one.shapes.gears, other.shapes.gears, strict=True):
        for field in fields(lines):
            assert_array_equal(getattr(lines, field.name), getattr(expected, field.name), field.name)


@pytest.mark.jit
@pytest.mark.parametrize("offline", [{}, {"sampling": "sobol", "solves": 6}, GREEDY], ids=["grid", "sobol", "greedy"])
def test_threads_train_the_same_basis_to_the_last_bit(offline, model, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    case, calls, kept = case_of(**offline), [], {}
    alone = train(case, model, estimate_errors, None, lambda: calls.append(1), keep=kept.__setitem__)
    with ThreadPoolExecutor(2) as executor:
        together = train(case, model, estimate_errors, executor)
    assert_same(together.basis, alone.basis)
    assert_array_equal(together.force, alone.force)
    assert alone.failures == together.failures == ()
    positions = len(alone.basis.training.phi)
    assert sorted(kept) == list(range(positions))
    assert len(calls) == positions
    solved = {}
    resumed = train(case, model, estimate_errors, known={0: kept[0]}, keep=solved.__setitem__)
    assert sorted(solved) == list(range(1, positions)), "what is known is not solved again"
    assert_same(resumed.basis, alone.basis)
    assert list(tmp_path.iterdir()) == []
    assert capfd.readouterr() == ("", "")


@pytest.mark.jit
def test_threads_compare_and_estimate_the_same_to_the_last_bit(model):
    basis = train(case_of(), model).basis
    reduced = reduced_pair(basis)
    conditions = [there[0] for there in basis.training.conditions]
    with ThreadPoolExecutor(2) as executor:
        full = [compare_models(reduced, model, executor=way).full for way in (None, executor)]
        errors = [estimate_errors(basis, basis.training.phi, conditions, executor=way) for way in (None, executor)]
    assert_array_equal(full[0].ste_um, full[1].ste_um)
    assert_array_equal(full[0].pair_share, full[1].pair_share)
    assert_array_equal(errors[0], errors[1])
    assert np.isfinite(errors[0]).all()


def test_a_greedy_training_says_what_it_needs(model):
    with pytest.raises(TypeError, match="estimates errors"):
        train(case_of(**GREEDY), model)
