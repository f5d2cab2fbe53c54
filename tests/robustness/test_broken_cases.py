"""Broken case files: one line that names the place and the remedy, exit code 2, nothing left behind."""

from pathlib import Path

import pytest

from tests.support.processes import ROOT, finish, start
from tests.support.refusals import refused

GOOD = (ROOT / "cases" / "small_spur.toml").read_text(encoding="utf-8")


def replaced(old, new):
    assert GOOD.count(old) == 1, old
    return GOOD.replace(old, new)


def without(line):
    return replaced(line + "\n", "")


PAIR = "module_mm = 4.0"
PINION = "teeth = 21"
WHEEL_WITH_LARGE_BORE = "\n[wheel]\nteeth = 21\nbore_radius_mm = 36.0\n"

IN_METRES = {"module_mm": 4.0, "bore_radius_mm": 20.0, "face_width_mm": 20.0}
# name: (text of the file, what the message must hold)
BROKEN = {
    **{
        f"{key} in metres": (
            replaced(f"{key} = {value}", f"{key} = {1e-3 * value}"),
            [f"{key} = {1e-3 * value}", "looks like metres", f"write {value}"],
        )
        for key, value in IN_METRES.items()
    },
    "a face of a metre": (
        replaced("face_width_mm = 20.0", "face_width_mm = 1000.0"),
        ["[pair] face_width_mm = 1000: must be at most 672 mm", "lower it"],
    ),
    "typo in a key": (replaced("module_mm", "modul_mm"), ["[pair] modul_mm", "did you mean module_mm?"]),
    "key in wrong case": (replaced("teeth", "TEETH"), ["[pinion] TEETH", "did you mean teeth?"]),
    "key like no other": (replaced(PAIR, PAIR + "\nqqq = 1"), ["[pair] qqq", "valid are", "face_width_mm"]),
    "key in another section": (replaced(PAIR, PAIR + "\nlodm_width = 1"), ["lodm_width", "belongs in [contact]"]),
    "key outside of the sections": ("module_mm = 4.0\n" + GOOD, ["module_mm", "outside", "belongs in [pair]"]),
    "key of both gears": (replaced(PAIR, PAIR + "\naddendum = 1"), ["addendum", "[pinion] or [wheel]"]),
    "unknown section": (replaced("[contact]", "[contacts]"), ["[contacts]", "did you mean contact?"]),
    "section as a value": ("mesh = 16\n" + without("[mesh]"), ["mesh", "write [mesh]"]),
    "section as an array": (replaced("[pinion]", "[[pinion]]"), ["pinion", "write [pinion]"]),
    "value as a section": (replaced(PAIR, "[pair.module_mm]"), ["[pair] module_mm", "must be a number"]),
    "missing key": (without(PINION), ["[pinion] teeth", "missing", "add"]),
    "duplicate key": (replaced(PAIR, PAIR + "\n" + PAIR), ["not valid TOML", "line", "correct"]),
    "nested too deeply": ("a = " + "[" * 100_000, ["not valid TOML", "correct"]),
    "names nested too deeply": ("[" + ".".join("a" * 3000) + "]\n", ["not valid TOML", "nested too deeply"]),
    "comma for a decimal point": (replaced(PAIR, "module_mm = 4,0"), ["not valid TOML", "line", "correct"]),
    "empty file": ("", ["[load] torque_Nm", "missing", "add"]),
    "radians for degrees": (
        replaced(PAIR, PAIR + "\npressure_angle_deg = 0.349"),
        ["pressure_angle_deg = 0.349", "looks like radians: 0.349 rad = 20 deg, write 20.0"],
    ),
    "MPa for GPa": (
        replaced(PINION, PINION + "\nyoungs_modulus_GPa = 210000"),
        ["youngs_modulus_GPa = 210000", "looks like MPa", "write 210.0"],
    ),
    "centre distance too small": (
        replaced(PAIR, PAIR + "\ncentre_distance_mm = 70.0"),
        ["centre_distance_mm = 70.0", "base circles", "is 84; leave the key out"],
    ),
    "nan": (replaced(PAIR, "module_mm = nan"), ["module_mm = nan", "finite", "between 0.05 and 100"]),
    "inf": (replaced("torque_Nm = 100.0", "torque_Nm = inf"), ["torque_Nm = inf", "finite"]),
    "integer beyond all bounds": (replaced(PAIR, "module_mm = 1" + "0" * 400), ["module_mm", "finite"]),
    "teeth beyond all bounds": (replaced(PINION, "teeth = 1" + "0" * 400), ["teeth", "lower it"]),
    "integer of thousands of digits": (replaced(PAIR, "module_mm = 1" + "0" * 5000), ["too many digits", "correct"]),
    "string for number": (replaced(PAIR, 'module_mm = "4.0"'), ['module_mm = "4.0"', "remove the quotes"]),
    "list for number": (replaced(PAIR, "module_mm = [4.0]"), ["module_mm = [4.0]", "remove the brackets"]),
    "bool for int": (replaced(PINION, "teeth = true"), ["teeth = true", "must be a number"]),
    "int for bool": (GOOD + "\n[output]\nplots = 1\n", ["[output] plots = 1", "true or false"]),
    "float for teeth": (replaced(PINION, "teeth = 21.0"), ["teeth = 21.0", "whole number", "write 21"]),
    "nan for teeth": (replaced(PINION, "teeth = nan"), ["teeth = nan", "whole number"]),
    "too many teeth": (replaced(PINION, "teeth = 1001"), ["teeth = 1001", "lower it"]),
    "bore larger than the root circle": (
        replaced("bore_radius_mm = 20.0", "bore_radius_mm = 38.0"),
        ["[pinion] bore_radius_mm = 38.0", "below 35 mm", "lower it"],
    ),
    "bore of the wheel": (GOOD + WHEEL_WITH_LARGE_BORE, ["[wheel] bore_radius_mm = 36.0", "lower it"]),
    "centre distance in metres": (
        replaced(PAIR, PAIR + "\ncentre_distance_mm = 0.084"),
        ["centre_distance_mm = 0.084", "looks like metres", "write 84.0"],
    ),
    "face in metres": (
        replaced(PINION, PINION + "\nface_width_mm = 0.02"),
        ["[pinion] face_width_mm = 0.02", "looks like metres"],
    ),
    "no room for a bore": (
        replaced(PINION, "teeth = 6\nprofile_shift = -1.5"),
        ["[pinion] teeth = 6", "no room", "raise teeth"],
    ),
    "scheme of an earlier version": (
        GOOD.replace('scheme = "direct"', 'scheme = "strip"'),
        ['[contact] scheme = "strip"', "was removed", 'write "line", or "direct"'],
    ),
    "helical, one section": (
        replaced(PAIR, PAIR + "\nhelix_angle_deg = 15.0").replace("[mesh]", '[mesh]\nwidth = "plane_strain"'),
        ["helix_angle_deg = 15", "one section for all of it", "whole"],
    ),
    "faces beside each other": (
        GOOD + "\n[wheel]\nteeth = 21\nbore_radius_mm = 20.0\nface_offset_mm = 21.0\n",
        ["face_offset_mm", "-10 to 10 and 11 to 31", "bring them together"],
    ),
    "poisson ratio one half": (
        replaced(PINION, PINION + "\npoisson_ratio = 0.5"),
        ["poisson_ratio = 0.5", "below 0.5"],
    ),
    "no penalty": (replaced("lodm_profile = 4", "penalty_N_mm3 = 0.0"), ["penalty_N_mm3 = 0.0", "above 0"]),
    "contact points beyond all use": (
        replaced("lodm_profile = 4", "lodm_profile = 64\nlodm_width = 64").replace(
            "width_elements = 2", "width_elements = 64"
        ),
        ["[contact] lodm_profile = 64", "1577345 contact points", "lower one of the two"],
    ),
    "unknown choice": (
        replaced('scheme = "direct"', 'scheme = "lines"'),
        ['scheme = "lines"', "did you mean line?"],
    ),
    "choice that is no text": (replaced('scheme = "direct"', "scheme = 1"), ["scheme = 1", '"line"']),
    "title that is no text": ("title = 5\n" + without('title = "Small spur pair for quick checks"'), ["quotes"]),
    "title of two lines": (replaced("Small spur pair for", "Small\\nspur"), ["title", "one line"]),
    "zero torque": (replaced("torque_Nm = 100.0", "torque_Nm = 0.0"), ["torque_Nm = 0.0", "no contact to solve"]),
    "empty torque list": (replaced("[40.0, 160.0]", "[]"), ["[offline] torques_Nm = []", "must not be empty"]),
    "text for torque list": (replaced("[40.0, 160.0]", '"160"'), ["[offline] torques_Nm", "in brackets"]),
    "bad value in a torque list": (replaced("[40.0, 160.0]", "[40.0, nan]"), ["[offline] torques_Nm", "finite"]),
    "duplicated torques": (replaced("[40.0, 160.0]", "[160, 160.0]"), ["torques_Nm", "160.0 is there twice"]),
    "online torque beyond training": (
        replaced("torques_Nm = [100.0]", "torques_Nm = [100.0, 170.0]"),
        ["[online] torques_Nm = [100.0, 170.0]", "160.0", "[offline]"],
    ),
    "default compare torque beyond training": (
        without("torques_Nm = [60.0, 100.0]").replace("160.0", "150.0"),
        ["[compare] torques_Nm", "(default)", "150.0"],
    ),
    "nominal torque beyond training": (replaced("160.0", "90.0"), ["[load] torque_Nm = 100.0", "90.0", "add"]),
    "nominal torque not among online torques": (
        replaced("torques_Nm = [100.0]", "torques_Nm = [90.0]"),
        ["[online] torques_Nm = [90.0]", "add 100.0"],
    ),
    "interpolation of an earlier version": (
        GOOD + '\n[reduction]\nshapes = "pod"\ninterpolation = "grassmann"\n',
        ['[reduction] interpolation = "grassmann"', "was removed", 'write "linear"'],
    ),
}


@pytest.mark.parametrize("name", BROKEN)
def test_broken_case_gets_one_clear_line(name, tmp_path):
    text, expected = BROKEN[name]
    path = tmp_path / "broken.toml"
    path.write_text(text, encoding="utf-8")
    refused("run", path, "--out", tmp_path / "out", words=[str(path), *expected])
    assert sorted(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("command", ["plan", "run", "compare", "offline"])
def test_all_commands_refuse_alike(command, tmp_path):
    path = tmp_path / "broken.toml"
    path.write_text(replaced(PAIR, "module_mm = nan"), encoding="utf-8")
    arguments = [command, path, *(["-o", tmp_path / "basis.h5"] if command == "offline" else [])]
    refused(*arguments, words=["module_mm = nan"])
    assert sorted(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("place", "words"),
    [
        ("here.toml", ["here.toml", "no such", "there.toml"]),
        ("no/case.toml", ["case.toml", "no such", "check the path"]),
        ("", ["is a folder", "name a case file"]),
        ("there.toml/case.toml", ["cannot be read", "name a readable"]),
        ("/dev/zero", ["/dev/zero: cannot be read (is a device, no file)", "name a readable"]),
    ],
    ids=["no file", "no folder", "folder for file", "file for folder", "a device that never ends"],
)
def test_what_is_no_file_is_refused(place, words, tmp_path):
    (tmp_path / "there.toml").touch()
    refused("run", tmp_path / place, words=[str((tmp_path / place).parent), *words])


def test_null_byte_in_path():
    refused("run", "case\0.toml", words=["cannot be read"])


@pytest.mark.parametrize("data", [GOOD.replace("Small", "Früh").encode("latin-1"), b"\x89HDF\r\n\x1a\n\0\0\xff"])
def test_not_utf8(data, tmp_path):
    path = tmp_path / "case.toml"
    path.write_bytes(data)
    refused("run", str(path), words=[str(path), "UTF-8"])


def test_unreadable_file(tmp_path, monkeypatch):
    path = tmp_path / "case.toml"
    path.write_text(GOOD, encoding="utf-8")

    def refuse(*_args, **_kwargs):  # permissions do not stop a test that runs as root
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "open", refuse)
    refused("run", str(path), words=[str(path), "may not be read", "permissions"])


def test_as_a_process(tmp_path):
    path = tmp_path / "broken.toml"
    path.write_text("\0", encoding="utf-8")
    code, text, errors = finish(start("run", path))
    assert (code, text) == (2, "")
    assert len(errors.splitlines()) == 1
    assert errors.startswith(f"pmor: error: {path}: ")
    assert sorted(tmp_path.iterdir()) == [path]
