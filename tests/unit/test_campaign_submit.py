"""Handing out work: how much at a time, what becomes of work that fails, and of executors that do."""

from concurrent.futures import Executor, Future, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool

import pytest

from pmor.campaigns.submit import submit_all
from pmor.core.errors import CaseError, ExternalProgramError
from tests.programs.scale import simulate


class Late(Executor):
    """Answers the oldest piece of work when it is full, and the rest at the end."""

    def __init__(self, workspace):
        self.waiting, self.workspace, self.most = [], workspace, 0

    def submit(self, fn, /, *args, **kwargs):
        future = Future()
        self.waiting.append((future, fn, args))
        self.most = max(self.most, len(self.waiting))
        if len(self.waiting) >= self.workspace:
            while self.waiting:
                ended, work, given = self.waiting.pop(0)
                try:
                    ended.set_result(work(*given))
                except Exception as error:
                    ended.set_exception(error)
        return future


def run(executor, work, count, in_flight=4):
    kept = {}

    def keep(item, answer):
        assert item not in kept, "none twice"
        kept[item] = answer

    submit_all(executor, work, iter(range(1, count + 1)), keep, lambda item, reason: reason, in_flight)
    return kept


def test_each_item_is_answered_once_and_never_more_than_allowed_are_handed_out():
    executor = Late(4)
    assert run(executor, lambda item: 2 * item, 24) == {i: 2 * i for i in range(1, 25)}
    assert executor.most == 4


def test_work_that_fails_is_done_again_once_and_then_says_why():
    tries = {}

    def work(item):
        tries[item] = tries.get(item, 0) + 1
        if item == 3 and tries[item] == 1:
            raise OSError("lost")
        if item == 5:
            raise MemoryError
        return item

    with ThreadPoolExecutor(2) as executor:
        kept = run(executor, work, 8)
    assert (tries[3], tries[5]) == (2, 2)
    assert kept == {i: i for i in range(1, 9)} | {5: "its worker failed, MemoryError, 2 times"}


def test_what_no_other_piece_would_fare_better_with_ends_it_at_once():
    def refuse(item):
        raise CaseError("another version")

    with ThreadPoolExecutor(1) as executor, pytest.raises(CaseError, match="another version"):
        run(executor, refuse, 3)


@pytest.mark.parametrize("how", ["broken", "cancelled", "closed"])
def test_an_executor_that_does_no_more_work_is_told_of_in_one_line(how):
    class Lost(Executor):
        def submit(self, fn, /, *args, **kwargs):
            future = Future()
            if how == "closed":
                raise RuntimeError("cannot schedule new futures after shutdown")
            if how == "cancelled":
                future.cancel()
            else:
                future.set_exception(BrokenProcessPool("a process died"))
            return future

    with pytest.raises(ExternalProgramError, match="does no more work .* the same command goes on") as caught:
        run(Lost(), lambda item: item, 3)
    assert "\n" not in str(caught.value)


def test_what_is_still_handed_out_is_called_back_when_the_rest_fails():
    given = []

    class Waiting(Executor):
        def submit(self, fn, /, *args, **kwargs):
            given.append(Future())
            if len(given) == 3:
                given[-1].set_exception(BrokenProcessPool("a process died"))
            return given[-1]

    with pytest.raises(ExternalProgramError):
        run(Waiting(), lambda item: item, 9)
    assert [future.cancelled() for future in given] == [True, True, False, True]


def test_many_short_tasks_take_no_memory_of_their_own():
    found = simulate(20_000)
    assert found["kept"] == 20_000
    # A future with its callback is about 2 kB: all of them together would be 40 MB.
    assert found["growth_bytes"] < 12e6
