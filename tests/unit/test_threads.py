"""Executors share out work, and one that cannot is refused in words."""

import math
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

import pmor
from pmor.core.threads import VARIABLES, in_order, one_thread, processes, threads
from pmor.work.pieces import Piece, run_pieces


class Broken(Executor):
    """A pool of processes whose first one has died."""

    def submit(self, work, *arguments):
        future = Future()
        future.set_exception(BrokenProcessPool("terminated abruptly"))
        return future


def of_pieces(executor, folder, work):
    return run_pieces([Piece("one", {}, None, work)], folder, executor=executor)


def test_work_for_threads_is_not_given_to_processes(tmp_path):
    executor = ProcessPoolExecutor(1)
    with pytest.raises(pmor.CaseError, match="pass a ThreadPoolExecutor"):
        list(in_order(lambda x: x, [1], executor))
    with pytest.raises(pmor.CaseError, match="pass a ThreadPoolExecutor"):
        of_pieces(executor, tmp_path / "parts", lambda: {})


def test_an_executor_whose_workers_ended_is_told_in_words(tmp_path):
    with pytest.raises(pmor.ExternalProgramError, match="__main__"):
        list(in_order(math.sqrt, [1.0], Broken()))
    with pytest.raises(pmor.ExternalProgramError, match="__main__"):
        of_pieces(Broken(), tmp_path / "parts", lambda: {})


@pytest.mark.parametrize("count", [0, -1, 1.5, "2"])
@pytest.mark.parametrize("executor_of", [threads, processes])
def test_a_number_of_workers_is_a_whole_number_of_at_least_one(executor_of, count):
    with pytest.raises(pmor.CaseError, match="whole number of at least 1"), executor_of(count):
        pass


def linear_algebra():
    return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}


def test_one_thread_of_linear_algebra_is_held_by_all_who_ask_and_given_back_by_the_last(monkeypatch):
    for name in VARIABLES:
        monkeypatch.delenv(name, raising=False)
    with threadpool_limits(2, "blas"):
        first, second = one_thread(), one_thread()
        with first:
            second.__enter__()
            assert linear_algebra() == {1}
        assert linear_algebra() == {1}
        second.__exit__(None, None, None)
        assert linear_algebra() == {2}
        with pytest.raises(ZeroDivisionError), one_thread():
            1 / 0  # noqa: B018
        assert linear_algebra() == {2}
        monkeypatch.setenv("OMP_NUM_THREADS", "2")
        with one_thread():
            assert linear_algebra() == {2}
