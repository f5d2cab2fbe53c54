import re
import tomllib
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from pmor.case import GearCase, basis_key, describe, load_case, parse_case
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
