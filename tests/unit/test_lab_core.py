"""What the laboratories share: models that are not mixed up, pieces that are kept, times in turn, tables."""

import json
import math
import re
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from pmor.case import change_case, parse_case
from pmor.core.errors import ConvergenceError
from pmor.lab.core.measures import merged, times_in_turn
from pmor.report.table import percent, table, text_lines
from pmor.work.pace import Pace
from pmor.work.pieces import Piece, run_pieces
from tests.support.small_case import case_text


def piece(name, run, settings="same"):
    return Piece(name, {}, settings, run)


@pytest.mark.parametrize("error", [ConvergenceError("made to fail", []), np.linalg.LinAlgError("made to fail")])
def test_finished_pieces_are_taken_over_and_a_failed_one_is_done_again(tmp_path, error):
    done = []

    def work(name, fail=False):
        done.append(name)
        if fail:
            raise error
        return {"name": name}

    def run(fail):
        pieces = [piece("a", lambda: work("a")), piece("b", lambda: work("b", fail)), piece("c", lambda: work("c"))]
        return run_pieces(pieces, tmp_path / "parts")

    results, failures = run(fail=True)
    assert results == {"a": {"name": "a"}, "c": {"name": "c"}}
    assert len(failures) == 1
    assert re.match(r"b: .*made to fail", failures[0])
    results, failures = run(fail=False)
    assert done == ["a", "b", "c", "b"]
    assert failures == ()
    assert set(results) == {"a", "b", "c"}


def test_a_piece_of_other_settings_a_damaged_one_and_half_a_one_are_done_again(tmp_path):
    def run(*pieces):
        return run_pieces(pieces, tmp_path)[0]

    run(*(piece(name, lambda: {"n": 1}) for name in "abc"))
    (tmp_path / "b.json").write_text("{")
    found = run(
        piece("a", lambda: {"n": 2}, "other"), piece("b", lambda: {"n": 2}),
        Piece("c", {}, "same", lambda: {"n": 2}, is_whole=lambda result: False),
    )  # fmt: skip
    assert [found[name]["n"] for name in "abc"] == [2, 2, 2]
    assert json.loads((tmp_path / "a.json").read_text())["result"] == {"n": 2}


def test_what_stops_one_piece_stops_the_rest_and_keeps_what_is_finished(tmp_path):
    started, steps = [], []

    def work(name, stop=False):
        started.append(name)
        if stop:
            raise KeyboardInterrupt
        return {}

    def pieces(stop):
        return [piece(name, partial(work, name, stop and name == "b")) for name in "abc"]

    with pytest.raises(KeyboardInterrupt):
        run_pieces(pieces(True), tmp_path)
    assert started == ["a", "b"]
    started.clear()
    with ThreadPoolExecutor(max_workers=2) as pool:
        run_pieces(pieces(False), tmp_path, executor=pool, progress=steps.append)
    assert sorted(started) == ["b", "c"]
    assert steps == [1, 1, 1]


def test_a_key_is_of_what_a_case_says_and_not_of_how_it_is_written():
    case = parse_case(case_text(), "small", "small case")
    commented = parse_case("# a comment\n" + case_text(), "small", "small case")
    plain = Piece("a", {"case": case}, None, dict)
    assert replace(plain, cases={"case": commented}).key == plain.key
    harder = {"case": change_case(case, penalty_N_mm3=1e5)}
    others = [replace(plain, name="b"), replace(plain, settings=1), replace(plain, settings=math.nan),
              replace(plain, cases=harder)]  # fmt: skip
    assert plain.key not in [other.key for other in others]


def test_the_log_tells_pieces_taken_over_and_the_rate_of_the_others(caplog):
    caplog.set_level("INFO", "pmor")
    pace = Pace("pieces", 3, 1, every_s=0.0)
    pace.tell("b")
    pace.step()
    pace.tell("c")
    assert caplog.messages[:2] == ["pieces: 1 of 3 are finished and taken over", "pieces: 1 of 3 done; now b"]
    assert re.fullmatch(r"pieces: 2 of 3 done, \S+ a second, .+ left; now c", caplog.messages[2])


def test_the_log_is_not_told_more_often_than_asked_for(caplog):
    caplog.set_level("INFO", "pmor")
    pace = Pace("pieces", 3, every_s=60.0)
    pace.tell("a")
    pace.tell("b")
    assert caplog.messages == ["pieces: 0 of 3 done; now a"]


def test_work_is_timed_in_turn_after_a_warm_up_and_what_takes_long_less_often():
    done = []

    def work(name, seconds):
        done.append(name)
        return seconds

    times = times_in_turn({"slow": lambda: work("slow", 3.0), "fast": lambda: work("fast", 1.0)}, 3, longest=2.0)
    assert times == {"slow": [3.0], "fast": [1.0, 1.0, 1.0]}
    assert done == ["slow", "fast"] * 2 + ["fast"] * 2


def test_the_last_change_of_a_key_counts():
    assert merged({"a": {"x": 1, "y": 1}}, {"b": {"z": 1}}, {"a": {"x": 2}}) == {"a": {"x": 2, "y": 1}, "b": {"z": 1}}


def test_a_table_takes_keys_and_what_is_made_of_a_row():
    rows = [{"n": 8, "e": 0.5}, {"n": 16, "e": None}]
    shown = table("", {"n": "n", "twice": lambda row: 2 * row["n"], "e, %": percent("e")}, rows)
    assert text_lines(shown) == [" n  twice  e, %", " 8     16    50", "16     32     –"]
