"""The offline stage: interrupted, resumed, with solves that fail, the same to the last bit whoever does the work."""

import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import pmor_offline.adaptive
import pmor_offline.train
from pmor.case import basis_key
from pmor.core.errors import ConvergenceError
from pmor.gear.condition import Condition
from pmor.storage.basis_file import read_basis
from pmor.storage.results_folder import working_folder
from pmor.storage.snapshot_file import read_snapshots, write_snapshots
from pmor.work.offline import run_offline
from pmor_offline.sampling import TrainingPosition
from pmor_offline.train import train
from pmor_online.compare import compare_models
from pmor_online.errors import estimate_errors
from pmor_online.model import reduced_pair
from tests.support.small_case import case_with, fail_where, full_fe
from tests.support.stored_files import assert_same_basis, results_in

SAME = 1e-12  # the same arithmetic in another order of the angles: equal but for threads of the linear algebra library


@pytest.fixture(scope="module")
def tiny():
    """Four angles and one element over the width: the job is what is tested."""

    case = case_with()
    return case, full_fe(case)


@pytest.fixture(scope="module")
def whole(tiny, tmp_path_factory):
    path = tmp_path_factory.mktemp("whole") / "basis.h5"
    done = run_offline(*tiny, path)
    assert (done.solved, done.resumed, done.failed) == (4, 0, ())
    return path


class Interruption(Exception):
    pass


def interrupt_after(count, monkeypatch, parts=None, module=pmor_offline.train):
    """Let the solve after `count` others fail, once `count` files are in the folder `parts`."""
    solve, calls = module.solve_snapshots, []

    def interrupted(*arguments):
        if len(calls) < count:
            calls.append(arguments)
            return solve(*arguments)
        # Solves run in another thread than the writing: an interruption that comes first would take results along.
        for _ in range(6000):
            if parts is None or len(list(parts.glob("angle*.h5"))) >= count:
                break
            time.sleep(0.01)
        raise Interruption

    monkeypatch.setattr(module, "solve_snapshots", interrupted)
    return calls


def test_an_interrupted_run_keeps_its_angles_and_writes_no_basis(tiny, whole, tmp_path, monkeypatch):
    case, model = tiny
    path, parts = tmp_path / "basis.h5", tmp_path / "basis.h5.parts"
    interrupt_after(3, monkeypatch, parts)
    with pytest.raises(Interruption):
        run_offline(case, model, path)
    assert not path.exists()
    assert len(results_in(parts)) == 3
    assert all(read_snapshots(part, basis_key(case)) is not None for part in parts.glob("angle*"))

    # Without the first angle, what is taken over and what is solved now come in another order than the angles.
    (parts / "angle_00000.h5").unlink()
    monkeypatch.undo()
    calls = interrupt_after(2, monkeypatch)  # two are left; a third would raise
    done = run_offline(case, model, path, resume=True)
    assert (done.solved, done.resumed) == (2, 2)
    assert len(calls) == 2
    assert_same_basis(path, whole)
    assert results_in(tmp_path) == {"basis.h5"}, "the parts are gone when the basis is there"


def test_without_resume_old_parts_are_discarded(tiny, tmp_path, monkeypatch):
    path = tmp_path / "basis.h5"
    interrupt_after(1, monkeypatch, tmp_path / "basis.h5.parts")
    with pytest.raises(Interruption):
        run_offline(*tiny, path)
    monkeypatch.undo()
    done = run_offline(*tiny, path)
    assert (done.solved, done.resumed) == (4, 0)


def test_parts_of_another_case_and_damaged_parts_are_solved_again(tiny, whole, tmp_path):
    case, model = tiny
    path = tmp_path / "basis.h5"
    parts = tmp_path / "basis.h5.parts"
    working_folder(parts)
    conditions = Condition(torque=1e3), Condition(torque=2e3)
    other = pmor_offline.train.solve_snapshots(model, TrainingPosition(0.0, conditions))
    write_snapshots(parts / "angle_00000.h5", other, "key of another case")
    write_snapshots(parts / "angle_00001.h5", other, basis_key(case))
    (parts / "angle_00001.h5").write_bytes(b"half a file")
    done = run_offline(case, model, path, resume=True)
    assert (done.solved, done.resumed) == (4, 0)
    assert_same_basis(path, whole)


def test_a_solve_that_fails_is_flagged_and_named(tiny, whole, tmp_path, monkeypatch):
    complete = read_basis(whole).training
    phi = complete.phi[1]
    fail_where(lambda p, torque: p == phi and torque == 160e3, monkeypatch)
    done = run_offline(*tiny, tmp_path / "basis.h5")
    assert done.failed == (f"phi = {phi:.6g} rad, torque = 160 N m",)
    training = read_basis(tmp_path / "basis.h5").training
    expected = np.ones((2, 4), dtype=bool)
    expected[1, 1] = False
    assert np.array_equal(training.converged, expected)
    assert np.isnan(training.ste_um[1, 1])
    # Where one torque fails, all are solved in larger windows: sums of other lengths.
    assert_allclose(training.ste_um[expected], complete.ste_um[expected], rtol=10.0 * SAME)


def test_nothing_converges(tiny, tmp_path, monkeypatch):
    fail_where(lambda p, torque: True, monkeypatch)
    with pytest.raises(ConvergenceError, match=r"no full solve converged, first: phi = .* rad, torque = 40 N m"):
        run_offline(*tiny, tmp_path / "basis.h5")
    assert not (tmp_path / "basis.h5").exists()


def test_a_failed_solve_is_tried_again_on_resume(tiny, whole, tmp_path, monkeypatch):
    """The parts of a run in which nothing converged must not stop a later one that could."""
    fail_where(lambda p, torque: True, monkeypatch)
    with pytest.raises(ConvergenceError):
        run_offline(*tiny, tmp_path / "basis.h5")
    monkeypatch.undo()
    assert run_offline(*tiny, tmp_path / "basis.h5", resume=True).failed == ()
    assert_same_basis(tmp_path / "basis.h5", whole)


# --- greedy ----------------------------------------------------------------------------------------------------------

STATES = 8  # four to begin with, four where the error estimate is largest
GREEDY = {"sampling": "greedy", "solves": STATES, "tolerance_percent": 1e-9}  # no tolerance ends it before the budget


@pytest.fixture(scope="module")
def greedy(tiny, few_candidates):
    """The same pair, whose training goes by the error estimate."""
    return case_with(offline=GREEDY), tiny[1]


@pytest.fixture(scope="module")
def greedy_whole(greedy, tmp_path_factory):
    path = tmp_path_factory.mktemp("greedy") / "basis.h5"
    assert run_offline(*greedy, path).solved == STATES
    return path


@pytest.mark.jit
@pytest.mark.parametrize("solved", [*(pytest.param(solved, marks=pytest.mark.slow) for solved in (2, 6)), 4])
def test_an_interrupted_greedy_run_goes_on_to_the_same_basis(solved, greedy, greedy_whole, tmp_path, monkeypatch):
    """Interrupted among the angles that it begins with, between them and the search, and within the search."""
    path, parts = tmp_path / "basis.h5", tmp_path / "basis.h5.parts"
    interrupt_after(solved, monkeypatch, module=pmor_offline.adaptive)
    with pytest.raises(Interruption):
        run_offline(*greedy, path)
    assert not path.exists()
    assert results_in(parts) == {f"angle_{i:05d}.h5" for i in range(solved)}

    monkeypatch.undo()
    calls = interrupt_after(STATES - solved, monkeypatch, module=pmor_offline.adaptive)  # one more would raise
    done = run_offline(*greedy, path, resume=True)
    assert (done.solved, done.resumed) == (STATES - solved, solved)
    assert len(calls) == STATES - solved
    assert_same_basis(path, greedy_whole)
    assert results_in(tmp_path) == {"basis.h5"}


# --- in memory -------------------------------------------------------------------------------------------------------


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
@pytest.mark.usefixtures("few_candidates")
@pytest.mark.parametrize(
    "offline",
    [{}, pytest.param({"sampling": "sobol", "solves": 6}, marks=pytest.mark.slow), GREEDY],
    ids=["grid", "sobol", "greedy"],
)
def test_threads_train_the_same_basis_to_the_last_bit(offline, tiny, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    model, calls, kept, shared = tiny[1], [], {}, {}
    case = case_with(offline=offline)
    alone = train(case, model, estimate_errors, None, lambda: calls.append(1), keep=kept.__setitem__)
    with ThreadPoolExecutor(2) as executor:
        together = train(case, model, estimate_errors, executor, keep=shared.__setitem__)
    assert_same(together.basis, alone.basis)
    assert_array_equal(together.force, alone.force)
    assert alone.failures == together.failures == ()
    positions = len(alone.basis.training.phi)
    assert sorted(kept) == sorted(shared) == list(range(positions))
    assert len(calls) == positions
    solved = {}
    resumed = train(case, model, estimate_errors, known={0: kept[0]}, keep=solved.__setitem__)
    assert sorted(solved) == list(range(1, positions)), "what is known is not solved again"
    assert_same(resumed.basis, alone.basis)
    assert list(tmp_path.iterdir()) == []
    assert capfd.readouterr() == ("", "")


@pytest.mark.jit
def test_threads_compare_and_estimate_the_same_to_the_last_bit(tiny):
    model = tiny[1]
    basis = train(tiny[0], model).basis
    reduced = reduced_pair(basis)
    conditions = [there[0] for there in basis.training.conditions]
    with ThreadPoolExecutor(2) as executor:
        full = [compare_models(reduced, model, executor=way).full for way in (None, executor)]
        errors = [estimate_errors(basis, basis.training.phi, conditions, executor=way) for way in (None, executor)]
    assert_array_equal(full[0].ste_um, full[1].ste_um)
    assert_array_equal(full[0].pair_share, full[1].pair_share)
    assert_array_equal(errors[0], errors[1])
    assert np.isfinite(errors[0]).all()


def test_a_greedy_training_says_what_it_needs(tiny):
    with pytest.raises(TypeError, match="estimates errors"):
        train(case_with(offline=GREEDY), tiny[1])
