"""Cases of files and of Python: defaults, checks, keys, keywords, changes."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping
from dataclasses import is_dataclass, replace
from inspect import signature
from pathlib import Path
from types import NoneType, SimpleNamespace, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin, get_type_hints

import numpy as np
import pytest

import pmor
import pmor.app.plan
from pmor.app.cases import Settings
from pmor.case import Case, GearCase, basis_key, change_case, describe, load_case, make_case, parse_case, text_of
from pmor.case.change import changed_text
from pmor.case.document import CONDITION, LOADS
from pmor.case.reader import keys_of
from pmor.case.schema import SECTIONS
from pmor.core.errors import CaseError, FileFormatError
from pmor.pair.conditions import conditions_of
from pmor.storage.basis_file import require_made_from

CASES = Path(__file__).parents[2] / "cases"
MINIMAL = """
[load]
torque_Nm = 50
[pair]
module_mm = 2
face_width_mm = 10.0
[pinion]
teeth = 30
bore_radius_mm = 10.0
"""
TRAINED = '[contact]\nscheme = "direct"\n[mesh]\nwidth = "whole"\n'


def parse(text):
    return parse_case(text, name="demo", where="demo.toml")


def test_defaults_follow_from_the_load_and_the_scheme():
    case = parse(MINIMAL)
    assert (case.name, case.title, case.torque_Nm) == ("demo", "demo", 50.0)
    assert (case.contact.scheme, case.reduction.shapes) == ("line", "line_loads")
    assert case.offline.torques_Nm == (10.0, 35.0, 90.0)
    assert case.online.torques_Nm == (50.0,)
    assert case.compare.torques_Nm == (15.0, 50.0)
    assert case.text == MINIMAL


def test_whole_numbers_become_floats_where_floats_are_meant():
    case = parse(MINIMAL)
    assert isinstance(case.pair.module_mm, float)
    assert isinstance(case.torque_Nm, float)
    assert isinstance(case.pair.pinion.teeth, int)


def test_wheel_is_the_pinion_unless_the_file_has_one():
    assert parse(MINIMAL).pair.wheel == parse(MINIMAL).pair.pinion
    other = parse(MINIMAL + "[wheel]\nteeth = 40\nbore_radius_mm = 12.0\n")
    assert (other.pair.pinion.teeth, other.pair.wheel.teeth) == (30, 40)


@pytest.mark.parametrize(
    ("text", "chosen"), [('"svg"', ("svg",)), ('["png"]', ("png",)), ('["pdf", "png"]', ("pdf", "png"))]
)
def test_one_choice_or_a_list_of_them(text, chosen):
    assert parse(MINIMAL + f"[output]\nformat = {text}\n").output.format == chosen


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ('"jpg"', r'\[output\] format = "jpg": unknown choice: .*png'),
        ("[]", "must not be empty: write one or more of"),
        ('["svg", "svg"]', "is there twice"),
        ("3", "must be text: write one of"),
        ('[["svg"]]', "must be text"),
    ],
)
def test_other_picture_formats_are_refused(text, rule):
    with pytest.raises(CaseError, match=rule):
        parse(MINIMAL + f"[output]\nformat = {text}\n")


def test_torques_are_rid_of_the_last_digits_of_evenly_spaced_lists():
    spaced = (50.0 + np.arange(0.1, 20.0, 0.1)).tolist()  # 60.10000000000001 and the like
    case = parse(MINIMAL + f"[online]\ntorques_Nm = {[50.0, *spaced]}\n[offline]\ntorques_Nm = [80]")
    assert len(max(map(repr, spaced), key=len)) > 15
    assert len(max(map(repr, case.online.torques_Nm), key=len)) == len("50.1")
    assert [c.torque_Nm for c in conditions_of(case, case.online.torques_Nm)] == list(case.online.torques_Nm)


def test_torques_are_sorted():
    case = parse(MINIMAL + "[online]\ntorques_Nm = [80.0, 20, 50.0]\n")
    assert case.online.torques_Nm == (20.0, 50.0, 80.0)


def test_byte_order_mark_and_windows_line_ends_are_read(tmp_path):
    path = tmp_path / "win.toml"
    path.write_bytes(b"\xef\xbb\xbf" + MINIMAL.replace("\n", "\r\n").encode())
    assert load_case(path).name == "win"


def test_paper_case_holds_the_papers_values_and_our_assumptions():
    case = load_case(CASES / "paper_spur.toml")
    gear = GearCase(teeth=21, bore_radius_mm=20.0)
    assert (case.pair.pinion, case.pair.wheel) == (gear, gear)
    assert (case.pair.module_mm, case.pair.face_width_mm, case.torque_Nm) == (4.0, 20.0, 100.0)
    assert case.offline.torques_Nm == (20.0, 70.0, 180.0)
    assert case.compare.angles >= 40


def test_describe_lists_every_setting_once_and_marks_defaults():
    case = parse(MINIMAL)
    settings = {key: (value, is_default) for key, value, is_default in describe(case)}
    assert len(settings) == len(describe(case))
    assert settings["pair.module_mm"] == (2.0, False)
    assert settings["pair.pressure_angle_deg"] == (20.0, True)
    assert settings["wheel.teeth"] == (30, True)
    assert settings["offline.torques_Nm"] == ((10.0, 35.0, 90.0), True)
    for section, values in tomllib.loads(MINIMAL).items():
        for key in values:
            assert not settings[f"{section}.{key}"][1]


@pytest.mark.parametrize(
    ("own", "asked", "words"),
    [
        ("[pinion.modification]\nhelix_slope_um = 5.0\n", "", "the meshed part of the width is whole in it, half in"),
        ("", "[pinion.modification]\nhelix_slope_um = 5.0\n", "the meshed part of the width is half in it, whole in"),
        ("", "[[condition]]\nin_plane_um = 10.0\n", "the meshed part of the width is half in it, whole in"),
        ("", "[results]\nroot_stress = false\n", "[results] root_stress is True in it, False in the case"),
        (TRAINED, f"{TRAINED}[wheel.modification]\nhelix_crowning_um = 4.0\n",
         "[wheel.modification] helix_crowning_um is 0.0 in it, 4.0 in the case"),
        (TRAINED, f"{TRAINED}[offline]\nangles_per_pitch = 41\n", "[offline] angles_per_pitch is 40 in it, 41 in the"),
    ],
)  # fmt: skip
def test_the_basis_of_another_case_is_refused_with_the_first_setting_that_differs(own, asked, words):
    basis = SimpleNamespace(case=parse(MINIMAL + own))
    with pytest.raises(FileFormatError, match=re.escape(f"basis.h5: is the basis of another case: {words}")):
        require_made_from(Path("basis.h5"), basis, parse(MINIMAL + asked))
    require_made_from(Path("basis.h5"), basis, parse(MINIMAL + own + "# a comment\n"))


def test_basis_key_changes_with_what_determines_a_basis_only():
    key = basis_key(parse(MINIMAL))
    assert len(key) == 64
    unchanged = [
        MINIMAL + "# a comment\n",
        'title = "another"\n' + MINIMAL,
        MINIMAL + "[online]\nangles_per_pitch = 77\n",
        MINIMAL + "[compare]\nangles = 7\n[output]\nplots = false\n",
        MINIMAL.replace("module_mm = 2", "module_mm = 2.0\nhelix_angle_deg = -0.0"),
        MINIMAL + "[offline]\nangles_per_pitch = 41\n",  # line loads are not trained
    ]
    changed = [
        MINIMAL.replace("teeth = 30", "teeth = 31"),
        MINIMAL + "[wheel]\nteeth = 31\nbore_radius_mm = 10.0\n",
        MINIMAL + "[mesh]\nwidth_elements = 9\n",
        MINIMAL + "[contact]\nlodm_profile = 2\n",
        MINIMAL + '[contact]\nscheme = "direct"\n[reduction]\nshapes = "positions"\n',
        MINIMAL + '[mesh]\nwidth = "whole"\n',
        MINIMAL + '[mesh]\nwidth = "plane_strain"\n',
        MINIMAL + "[reduction]\npod_tolerance = 1e-5\n",
        MINIMAL + '[contact]\nscheme = "direct"\n',
        MINIMAL + '[contact]\nscheme = "direct"\n[offline]\nangles_per_pitch = 41\n',
    ]
    assert {basis_key(parse(text)) for text in unchanged} == {key}
    assert len({basis_key(parse(text)) for text in changed} | {key}) == len(changed) + 1


def test_error_names_file_section_key_value_rule_and_remedy():
    with pytest.raises(CaseError) as caught:
        parse(MINIMAL.replace("module_mm = 2", "module_mm = -4.0"))
    assert str(caught.value) == ("demo.toml: [pair] module_mm = -4.0: must be between 0.05 and 100 (mm): raise it")


SINGLE = ("title", CONDITION, LOADS, *(name for name in SECTIONS if "." not in name))


def single_keys():
    """Keys that need no section, with their annotations in the schema."""
    found = {}
    for kind in SECTIONS.values():
        for key, hint in keys_of(kind).items():
            try:
                pmor.make_case(**{key: object()})
            except CaseError as error:
                if "more than one section" not in str(error):
                    found[key] = hint
    return found


def taken(hint):
    """What a key takes in Python, of its annotation in the schema."""
    if get_origin(hint) in (UnionType, Union):
        return Union[tuple(taken(one) for one in get_args(hint) if one is not NoneType)]  # noqa: UP007
    if get_origin(hint) is Annotated:
        return taken(get_args(hint)[0])
    if get_origin(hint) is tuple:
        from collections.abc import Sequence

        return taken(get_args(hint)[0]) | Sequence[taken(get_args(hint)[0])]
    return Mapping[str, Any] if is_dataclass(hint) else hint


def test_the_keywords_are_the_keys_of_the_schema_with_their_types():
    typed = get_type_hints(Settings)
    assert {key: hint for key, hint in typed.items() if key not in SINGLE} == {
        key: taken(hint) for key, hint in single_keys().items()
    }
    assert set(SINGLE) <= typed.keys()


@pytest.mark.parametrize(("function", "first"), [(pmor.make_case, "name"), (pmor.change_case, "case")])
def test_a_notebook_finds_them_in_the_signature(function, first):
    assert list(signature(function).parameters) == [first, *Settings.__annotations__]
    element = signature(function).parameters["element"]
    assert element.kind is element.KEYWORD_ONLY
    assert get_args(eval(element.annotation, {"Literal": Literal})) == ("hex20", "hex8i", "hex8")


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
    assert case.text.partition("\n")[2].startswith("# ")  # after its schema
    assert text_of(case) == case.text
    other = replace(case, mesh=replace(case.mesh, profile_elements=9), title='"quoted" Ω')
    text = text_of(other)
    assert text != case.text
    assert parse_case(text, case.name, case.name) == replace(other, text=text)


def test_loads_of_a_duty_cycle_are_swept_and_read_back():
    loads = [{"name": "often", "torque_Nm": 60.0, "hours": 9.0}, {"name": "rare", "torque_Nm": 130.0, "hours": 1.0}]
    for sign in (1.0, -1.0):
        case = make_case(**SMALL | {"torque_Nm": 100.0 * sign}, loads=loads)
        assert case.online.torques_Nm == (60.0, 100.0, 130.0)
        other = replace(case, title="another")
        assert replace(parse_case(text_of(other), case.name, case.name), text=case.text) == other
    with pytest.raises(CaseError, match="adds up to 0.5"):
        change_case(case, loads=[{"name": "half", "torque_Nm": 60.0, "fraction": 0.5}])
    with pytest.raises(CaseError, match=r"\[\[loads\]\]: a duty cycle takes line loads"):
        change_case(case, scheme="direct")


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
    lines = [line.split() for line in pmor.plan(case).splitlines()]
    assert [words[0] for words in lines if words[1:] == ["none", "*"]] == unset
