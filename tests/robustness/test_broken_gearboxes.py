"""Gearboxes that cannot be: one line with place, value and remedy, exit code 2, and nothing written."""

import numpy as np
import pytest

from pmor.app.cli import main
from tests.support.gearboxes import SMALL, written

BEARINGS = '[[bearings]]\nname = "A"'
TORQUES = """torques = [
    { shaft = "input", at_mm = 0.0, torque_Nm = 6.0 }, { shaft = "output", at_mm = 80.0, torque_Nm = "balance" },
]
"""
BROKEN = {
    "no shaft of this name": ('shaft = "output"\nat_mm = 10.0', 'shaft = "outpt"\nat_mm = 10.0', "did you mean output"),
    "bearing beyond the shaft": ("at_mm = 70.0\nradial", "at_mm = 90.0\nradial", "goes from 0 to 80 mm"),
    "gear beyond the shaft": ('{ shaft = "input", at_mm = 35.0 }', '{ shaft = "input", at_mm = -1.0 }', "from 0 to 80"),
    "gears apart": ('{ shaft = "input", at_mm = 35.0 }', '{ shaft = "input", at_mm = 36.0 }', "do not face each other"),
    "one shaft": ('{ shaft = "output", at_mm = 35.0 }', '{ shaft = "input", at_mm = 35.0 }', "are on one shaft"),
    "loose along its axis": ("axial_N_per_mm = 1e5\n", "", "along x: nothing holds it"),
    "no bearings": ('name = "B"\nshaft = "input"', 'name = "B"\nshaft = "output"', "nothing holds it"),
    "overlap": ("at_mm = [62.2, 0.0]", "at_mm = [20.0, 0.0]", "overlap at x = 0 to 80 mm"),
    "bore too wide": ("inner_mm = 8.0", "inner_mm = 30.0", "must be below outer_mm = 28"),
    "one coordinate": ("at_mm = [62.2, 0.0]", "at_mm = [62.2]", "must be y and z of the axis"),
    "two kinds": ("ball = {", "radial_N_per_mm = 1e5\nball = {", "has one kind"),
    "rows that overlap": ('name = "D"\nshaft = "output"\nat_mm = 70.0', 'name = "D"\nshaft = "output"\nat_mm = 17.0',
                          "their elements overlap"),
    "names twice": ('name = "B"', 'name = "A"', "is there twice"),
    "the housing's name": ('name = "output"\nat', 'name = "housing"\nat', "another name"),
    "to nowhere": ('name = "A"\n', 'name = "A"\nto = "frame"\n', 'must be a shaft or "housing"'),
    "to another axis": ('name = "A"\n', 'name = "A"\nto = "output"\n', "has another axis"),
    "no balance": ('torque_Nm = "balance"', "torque_Nm = -90.0", 'write torque_Nm = "balance"'),
    "two balances": ("torque_Nm = 60.0", 'torque_Nm = "balance"', "2 torques"),
    "no torque": ("torque_Nm = 60.0", "torque_Nm = 0.0", "no torque to carry"),
    "a word for a torque": ("torque_Nm = 60.0", 'torque_Nm = "much"', "unknown choice"),
    "a word for a stiffness": ("axial_N_per_mm = 1e5", 'axial_N_per_mm = "stiff"', "rigid"),
    "negative stiffness": ("axial_N_per_mm = 1e5", "axial_N_per_mm = -1e5", "axial_N_per_mm"),
    "unknown key": ("at_mm = [62.2, 0.0]", "at_mm = [62.2, 0.0]\ndiameter_mm = 20.0", "unknown key"),
    "unknown section": ("[[meshes]]", "[[mesh]]", "did you mean meshes"),
    "a section for a list": (BEARINGS, BEARINGS.replace("[[", "[").replace("]]", "]"), "not valid TOML"),
    "no section of a shaft": ("sections = [{ length_mm = 80.0, outer_mm = 20.0 }]", "sections = []", "sections"),
    "jammed": ("at_mm = [62.2, 0.0]", "at_mm = [62.0, 0.0]", "the teeth jam"),
    "out of mesh": ("at_mm = [62.2, 0.0]", "at_mm = [69.0, 0.0]", "tip circles touch"),
    "no case": ('case = "small.toml"', 'case = "smal.toml"', "there is no such case file"),
    "a case that is none": ('case = "small.toml"', 'case = "box.toml"', "unknown section"),
    "a change that is none": ('case = "small.toml"', 'case = "small.toml"\npair = { modul_mm = 2.0 }', "module_mm"),
    "penalty contact": (
        'case = "small.toml"',
        'case = "small.toml"\ncontact = { scheme = "direct" }',
        "a gearbox takes",
    ),
    "gears that overlap": (
        "[[bearings]]",
        """[[shafts]]
name = "idle"
at_mm = [-62.2, 0.0]
sections = [{ length_mm = 80.0, outer_mm = 28.0 }]
[[meshes]]
name = "other"
case = "small.toml"
pinion = { shaft = "input", at_mm = 36.0 }
wheel = { shaft = "idle", at_mm = 36.0 }
[[bearings]]""",
        '"other" and "mesh": shaft "input": gears at 36 and 35 mm overlap',
    ),
    "too few balls": ("balls = 9", "balls = 2", "balls = 2"),
    "flat grooves": ("balls = 9", "balls = 9, inner_osculation = 0.500001", "inner_osculation = 0.500001"),
    "balls that overlap": ("balls = 9", "balls = 20", "overlap: so many have room on that circle up to"),
    "a ball as large as its circle": ("ball_diameter_mm = 9.0", "ball_diameter_mm = 45.0", "the balls overlap"),
    "rollers that overlap": ("rollers = 12", "rollers = 19", "the rollers overlap"),
    "a roller of 100 m": ("effective_length_mm = 9.0", "effective_length_mm = 1e5", "must be at most 12 times"),
    "rollers through the axis": (
        "effective_length_mm = 9.0",
        "effective_length_mm = 60.0, contact_angle_deg = 45.0",
        "rollers reach the axis",
    ),
    "to its own shaft": ('name = "A"\n', 'name = "A"\nto = "input"\n', "is the shaft that it carries"),
    "no load": (SMALL, f"loads = []\n{SMALL.partition('[[loads]]')[0]}", "loads = []: must have at least one"),
    "a name that is a path": ('name = "mesh"', 'name = "../mesh"', "names a file"),
    "shares beside none": ('name = "drive"', 'name = "drive"\nfraction = 0.5', "adds up to 0.5, and must to 1"),
    "a share too large": ('name = "drive"', 'name = "drive"\nfraction = 30.0', "fraction = 30"),
    "share and hours": ('name = "drive"', 'name = "drive"\nfraction = 1.0\nhours = 10.0', "say the same"),
    "hours of one alone": (
        "[[loads]]\n",
        f"[[loads]]\nname = 'other'\nhours = 5.0\n{TORQUES}[[loads]]\n",
        "has no hours, and others",
    ),
    "a moment beyond the shaft": (
        'name = "drive"',
        'name = "drive"\nmoments = [{ shaft = "input", at_mm = 81.0, y_Nm = 1.0 }]',
        "from 0 to 80",
    ),
    "a moment about the axis": (
        'name = "drive"',
        'name = "drive"\nmoments = [{ shaft = "input", at_mm = 8.0, x_Nm = 1.0 }]',
        "unknown key",
    ),
    "neither case nor sections": ('case = "small.toml"\n', "", "teeth: is missing"),
    "a gear's key that is none": (
        '{ shaft = "input", at_mm = 35.0 }',
        '{ shaft = "input", at_mm = 35.0, tooth = 19 }',
        "did you mean teeth",
    ),
    "a section of a case that is none": ('case = "small.toml"', 'case = "small.toml"\npear = { teeth = 3 }', "pair"),
    "infinite force": ("torque_Nm = 60.0", "torque_Nm = inf", "torque_Nm = inf"),
}


HOUSINGS = {
    "too small": ("1.0,0.0\n0.0,1.0\n", "is 2 x 2, and must be 24 x 24"),
    "words": ("stiff\n", "must hold numbers"),
    "ragged": ("1.0\n1.0,2.0\n", "must hold numbers"),
    "half of one in mm and rad": ("half", "must be symmetric, and row 1 has 1000 in column 2, row 2 has 0 in column 1"),
    "singular": ("singular", "must be positive definite"),
    "not there": ("", "there is no such CSV file"),
}


@pytest.mark.parametrize("name", HOUSINGS)
def test_a_housing_that_cannot_be_is_refused_in_one_line(name, tmp_path, capsys):
    text, words = HOUSINGS[name]
    # Of rotations entries are a million times as large, so that half of the others is nothing beside them.
    units = np.tile(np.repeat([1.0, 1e6], 3), 4)
    half = np.outer(units, units) * np.triu(1e3 * (np.ones((24, 24)) + 24.0 * np.eye(24)))
    matrix = {"half": half, "singular": np.ones((24, 24))}.get(text)
    if matrix is not None:
        text = "\n".join(",".join(map(str, row)) for row in matrix.tolist())
    if text:
        (tmp_path / "seats.csv").write_text(text)
    path = written(tmp_path, f'{SMALL}[housing]\nstiffness = "seats.csv"\n')
    assert main(["run", str(path), "--out", str(tmp_path / "out")]) == 2
    (line,) = [line for line in capsys.readouterr().err.splitlines() if line.startswith("pmor: error")]
    assert words in line


@pytest.mark.parametrize("name", BROKEN)
def test_a_gearbox_that_cannot_be_is_refused_in_one_line(name, tmp_path, capsys):
    old, new, words = BROKEN[name]
    assert old in SMALL
    path = written(tmp_path, SMALL.replace(old, new, 1))
    assert main(["run", str(path), "--out", str(tmp_path / "out")]) == 2
    (line,) = [line for line in capsys.readouterr().err.splitlines() if line.startswith("pmor: error")]
    assert words in line
    assert not (tmp_path / "out" / "gearbox.json").exists()
