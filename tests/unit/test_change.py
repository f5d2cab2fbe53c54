"""Cases made and changed in Python say what they are, pass the checks of a file, and read back."""

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import pmor.app.plan
from pmor.case import Case, change_case, describe, load_case, make_case, parse_case, text_of
from pmor.case.change import changed_text
from pmor.core.errors import CaseError

CASES = Path(__file__).parents[2] / "cases"
FILES = sorted(path for path in CASES.glob("*.toml") if "[pinion]" in path.read_text())  # the others start from a case

SMALL = {"teeth": 21, "bore_radius_mm": 20.0, "module_mm": 4.0, "face_width_mm": 20.0, "torque_Nm": 100.0}


def test_a_case_made_by_keywords_is_the_one_of_a_file():
    path = CASES / "paper_spur.toml"
    read = load_case(path)
    made = make_case("paper_spur", title=read.title, **SMALL, online={"torques_Nm": np.array(read.online.torques_Nm)})
    assert replace(made, text=read.text, compare=read.compare, offline=read.offline) == read


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_shipped_cases_say_what_they_are_for_and_read_back_when_changed(path):
    case = load_case(path)
    assert case.name == path.stem
    assert case.text.startswith("# ")
    assert text_of(case) == case.text
    other = replace(case, mesh=replace(case.mesh, profile_elements=9), title='"quoted" Ω')
    text = text_of(other)
    assert text != case.text
    assert parse_case(text, case.name, case.name) == replace(other, text=text)


def test_a_key_of_the_gears_changes_both_and_a_section_one():
    case = make_case(**SMALL)
    alike = change_case(case, teeth=30)
    assert (alike.pair.pinion.teeth, alike.pair.wheel.teeth) == (30, 30)
    unlike = change_case(case, wheel={"teeth": 34, "bore_radius_mm": 30.0})
    assert (unlike.pair.pinion.teeth, unlike.pair.wheel.teeth) == (21, 34)
    assert change_case(unlike, profile_shift=0.1).pair.wheel.profile_shift == 0.1


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"torques_Nm": [1.0]}, r"more than one section has it: write offline=\{'torques_Nm': ...\} or online="),
        ({"profile_element": 8}, "no section has such a key: did you mean profile_elements"),
        ({"mesh": 8}, r"is a section: write mesh=\{"),
        ({"profile_elements": 0}, "must be between 2 and 512"),
        ({"torque_Nm": float("nan")}, "torque_Nm"),
    ],
)
def test_what_cannot_be_changed_is_named(settings, message):
    with pytest.raises(CaseError, match=message):
        change_case(make_case(**SMALL), **settings)


def test_a_case_shows_itself_in_one_line():
    case = make_case("mine", **SMALL)
    assert isinstance(case, Case)
    expected = "<Case 'mine': 21/21 teeth, module 4 mm, face width 20 mm, 100 N m, line, 8 x 4 elements>"
    assert repr(case) == expected


def test_keys_that_are_not_set_are_left_out_of_inline_tables_too():
    text = changed_text("[pinion]", {"pinion": {"blank": {"rim_thickness_mm": 4.0, "web_offset_mm": None}}})
    assert tomllib.loads(text) == {"pinion": {"blank": {"rim_thickness_mm": 4.0}}}


def test_the_plan_shows_keys_that_are_not_set_also_without_words_of_their_own(monkeypatch):
    case = make_case(**SMALL)
    unset = [key.rpartition(".")[2] for key, value, _ in describe(case) if value is None]
    assert "centre_distance_mm" in unset
    monkeypatch.setattr(pmor.app.plan, "NOT_WRITTEN", {})
    lines = [line.split() for line in pmor.app.plan.plan_case(case).splitlines()]
    assert [words[0] for words in lines if words[1:] == ["none", "*"]] == unset
