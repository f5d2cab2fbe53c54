"""Broken modifications, topographies and conditions: one line that names the place and the remedy, exit code 2."""

import math

import pytest

from pmor.case import load_case, parse_case
from pmor.pair.model import gear_pair
from tests.support.refusals import refused

GOOD = """
[load]
torque_Nm = 100.0
[pair]
module_mm = 4.0
face_width_mm = 20.0
[pinion]
teeth = 21
bore_radius_mm = 20.0
[mesh]
profile_elements = 6
width_elements = 2
"""
# Its shapes are trained, and half the width stands for the whole in all states.
TRAINED = GOOD + '[contact]\nscheme = "direct"\n'
RELIEF = "[pinion.modification]\ntip_relief_um = 20.0\n"
TOPOGRAPHY = '[pinion.modification]\ntopography = "flank.csv"\n'
WAVE = "[pinion.modification]\nwaves = "
WHOLE = '[mesh]\nprofile_elements = 6\nwidth_elements = 2\nwidth = "whole"\n'
TILTED_HALVES = "[wheel.modification]\nhelix_slope_um = 4.0\n"


def pitches(count, key="pinion"):
    return f"[{key}.modification]\npitch_deviations_um = {[0.5 * j for j in range(count)]}\n"


def grid(rolls=(5, 20, 35), z=(-10, 0, 10), amounts=None):
    rows = [[roll, *(amounts or [1.0] * len(z))] for roll in rolls]
    return "\n".join([",".join(["", *map(str, z)]), *(",".join(map(str, row)) for row in rows)])


# name: (what follows the good case, what the message must hold, the CSV file)
BROKEN = {
    "misspelt key": ("[pinion.modification]\ntip_releif_um = 1", ["tip_releif_um", "did you mean tip_relief_um?"]),
    "misspelt section": ("[pinion.modifications]\ntip_relief_um = 1", ["[pinion] modifications", "modification"]),
    "section as a value": (GOOD.replace("teeth = 21", "teeth = 21\nmodification = 3"), ["write [pinion.modification]"]),
    "key in the gear's section": (
        GOOD.replace("teeth = 21", "teeth = 21\ntip_relief_um = 3"), ["belongs in [pinion.modification]"],
    ),
    "relief without a start": (RELIEF, ["tip_relief_um = 20.0", "add tip_relief_start_roll_deg"]),
    "start beyond the tip": (RELIEF + "tip_relief_start_roll_deg = 40", ["start_roll_deg = 40", "lower it"]),
    "start below the flank": (RELIEF + "tip_relief_start_roll_deg = 1.5", ["tip_relief_start_roll_deg = 1.5", "raise"]),
    "start in radians": (RELIEF + "tip_relief_start_roll_deg = 0.45", ["looks like radians", "write 25.78"]),
    "root relief without an end": ("[wheel.modification]\nroot_relief_um = 5", ["add root_relief_end_roll_deg"]),
    "root relief that never ends": (
        "[wheel.modification]\nroot_relief_um = 5\nroot_relief_end_roll_deg = 45", ["[wheel.modification]", "lower it"],
    ),
    "root relief below the active profile": (
        "[wheel.modification]\nroot_relief_um = 5\nroot_relief_end_roll_deg = 3", ["above the start", "raise it"],
    ),
    "end relief without a length": ("[pinion.modification]\nend_relief_um = 5", ["add end_relief_length_mm"]),
    "end relief beyond the middle": (
        "[pinion.modification]\nend_relief_um = 5\nend_relief_length_mm = 11", ["at most 10 mm", "lower it"],
    ),
    "too few pitch deviations": (pitches(20), ["20 numbers for 21 teeth"]),
    "too many pitch deviations": (pitches(22, "wheel"), ["[wheel.modification]", "22 numbers for 21 teeth"]),
    "uneven halves on half a mesh": (TRAINED + TILTED_HALVES, ["halves of the face differ", 'width = "whole"']),
    "crowning in plane strain": (
        GOOD.replace("width_elements = 2", 'width = "plane_strain"') + "[pinion.modification]\nhelix_crowning_um = 4",
        ["differs over the width", 'write "whole"'],
    ),
    "wave without an amplitude": (WAVE + "[{ count = 30 }]", ["amplitude_um", "is missing"]),
    "wave that never comes": (WAVE + "[{ count = 0, amplitude_um = 1.0 }]", ["count = 0", "raise it"]),
    "half a wave": (WAVE + "[{ count = 30.5, amplitude_um = 1.0 }]", ["count = 30.5", "whole number"]),
    "wave out of phase": (WAVE + "[{ count = 30, amplitude_um = 1.0, phase_deg = 400 }]", ["phase_deg", "lower it"]),
    "wave by words": (WAVE + '"ghost"', ["waves", "list of sections"]),
    "waves between the angles": (WAVE + "[{ count = 2100, amplitude_um = 1.0 }]", ["missed by", "angles_per_pitch"]),
    "topographies of too few teeth": (
        TOPOGRAPHY, ["2 grids for 21 teeth"], "tooth,roll,-10,10\n1,3,0,0\n1,36,0,0\n2,3,0,0\n2,36,0,0",
    ),
    "topography of no tooth": (
        TOPOGRAPHY, ["is no number of a tooth"], "tooth,roll,-10,10\n0,3,0,0\n0,36,0,0",
    ),
    "topographies at other angles": (
        TOPOGRAPHY, ["give all the same points"], "tooth,roll,-10,10\n1,3,0,0\n1,36,0,0\n2,4,0,0\n2,36,0,0",
    ),
    "no such topography": (TOPOGRAPHY.replace("flank.csv", "none.csv"), ["none.csv", "no such file"]),
    "topography as a number": ("[pinion.modification]\ntopography = 3", ["name of a CSV file"]),
    "topography too small": (TOPOGRAPHY, ["at least 2 x 2"], grid(rolls=(5,))),
    "topography with a hole": (TOPOGRAPHY, ["row 2, column 3", "an empty cell"], grid(amounts=(1, "", 2))),
    "topography with a word": (TOPOGRAPHY, ['"x" is not a number'], grid(amounts=(1, "x", 2))),
    "topography with NaN": (TOPOGRAPHY, ["amount nan um"], grid(amounts=(1, "nan", 2))),
    "topography in mm": (TOPOGRAPHY, ["amount 2000 um"], grid(amounts=(1, 2000, 2))),
    "topography with a short row": (TOPOGRAPHY, ["2 amounts", "3 places"], grid(amounts=(1, 2))),
    "topography upside down": (TOPOGRAPHY, ["must ascend"], grid(rolls=(35, 20, 5))),
    "topography with swapped axes": (TOPOGRAPHY, ["look swapped"], grid(rolls=(-10, 0, 10), z=(5, 20, 35))),
    "topography in radians": (TOPOGRAPHY, ["look like radians"], grid(rolls=(0.08, 0.3, 0.6))),
    "topography that ends before the tip": (TOPOGRAPHY, ["do not cover the active profile"], grid(rolls=(5, 20, 30))),
    "topography that is too narrow": (TOPOGRAPHY, ["do not cover the face"], grid(z=(-8, 0, 8))),
    "topography that is not text": (TOPOGRAPHY, ["cannot be read"], b"\xff\xfe\x00\x01"),
    "rounding and chamfer": (
        GOOD.replace("teeth = 21", "teeth = 21\ntip_rounding_mm = 0.2\ntip_chamfer_mm = 0.2"), ["leave one of the two"],
    ),
    "rounding of a mesh with sharp edges": (
        GOOD.replace("teeth = 21", "teeth = 21\ntip_rounding_mm = 0.3") + '[contact]\nscheme = "direct"\n',
        ["[pinion] tip_rounding_mm = 0.3", "known to line contact"],
    ),
    "rounding wider than the tip": (
        GOOD.replace("teeth = 21", "teeth = 21\ntip_rounding_mm = 3.0"), ["[pinion] tip_rounding_mm = 3", "tip land"],
    ),
    "chamfer of the whole flank": (
        GOOD.replace("teeth = 21", "teeth = 21\ntip_chamfer_mm = 8.0"), ["tip_chamfer_mm = 8", "leaves nothing"],
    ),
    "one condition in single brackets": ("[condition]\ntorque_Nm = 5", ["write [[condition]]"]),
    "condition of another name twice": ('[[condition]]\nname = "a"\n[[condition]]\nname = "a"', ["is there twice"]),
    "condition with an unknown key": ("[[condition]]\ntorque = 5", ["[condition] torque", "torque_Nm"]),
    "condition with a modification that does not fit": (
        '[[condition]]\nname = "low"\n[condition.wheel]\ntip_relief_um = 5\ntip_relief_start_roll_deg = 44',
        ['[condition.wheel] of "low"', "lower it"],
    ),
    "condition beyond the training": (
        TRAINED + '[[condition]]\nname = "high"\ntorque_Nm = 900', ['"high"', "900", "[offline]"],
    ),
    "condition with tilted axes on half a mesh": (
        TRAINED + "[[condition]]\nin_plane_um = 5", ['"condition 1"', "in_plane_um"],
    ),
    "a whole number of pitches": ("[online]\npitches = 1.5", ["pitches = 1.5", "whole number"]),
    "pitches in another word": ('[online]\npitches = "revolutions"', ["did you mean revolution?"]),
}  # fmt: skip


@pytest.mark.parametrize("name", BROKEN)
def test_broken_modifications_are_refused_in_one_line(name, tmp_path):
    text, words, *file = BROKEN[name]
    path = tmp_path / "case.toml"
    path.write_text(text if "[load]" in text else GOOD + text)
    if file:
        (tmp_path / "flank.csv").write_bytes(file[0] if isinstance(file[0], bytes) else file[0].encode())
    refused("plan", path, words=words)


def test_the_good_case_and_its_neighbours_are_accepted(tmp_path):
    (tmp_path / "flank.csv").write_text(grid())
    for text in (GOOD, GOOD + RELIEF + "tip_relief_start_roll_deg = 25", GOOD + pitches(21), GOOD + TOPOGRAPHY):
        path = tmp_path / "case.toml"
        path.write_text(text)
        case = load_case(path)
        start, end = gear_pair(case).active_rolls[0]
        assert 5.0 < math.degrees(start) < 25.0 < math.degrees(end) < 35.0
    assert parse_case(GOOD.split("[mesh]")[0] + WHOLE + TILTED_HALVES, "case", "case").wheel_modification.present
