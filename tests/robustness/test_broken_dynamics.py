"""Broken sections `[dynamics]`: one line that names the place, the value and the remedy, exit code 2."""

import pytest

from pmor.case import change_case, parse_case, text_of
from tests.support.refusals import refused
from tests.support.small_case import case_text

LINES = {"contact": {"scheme": "line"}, "reduction": None}
ON_BEARINGS = {"degrees_of_freedom": 6, "pinion_bearing_stiffness_N_um": [300.0, 300.0]}

# name: (the section, what the message must hold)
BROKEN = {
    "damping in per cent": ({"damping_ratio": 5.0}, ["damping_ratio = 5.0", "at most 2"]),
    "damping twice": ({"damping_ratio": 0.05, "mesh_damping_N_s_mm": 1.0}, ["mesh_damping_N_s_mm = 1.0", "leave one"]),
    "three degrees of freedom": ({"degrees_of_freedom": 3}, ["degrees_of_freedom = 3", "1, 6 or 12"]),
    "one frequency": ({"mesh_frequency_ratio": [1.0]}, ["mesh_frequency_ratio = [1.0]", "lowest and the highest"]),
    "frequencies twice": (
        {"mesh_frequency_ratio": [0.5, 1.0], "mesh_frequency_Hz": [500.0, 900.0]}, ["mesh_frequency_Hz", "leave one"],
    ),
    "speeds and frequencies": (
        {"speed_range_rpm": [500.0, 900.0], "mesh_frequency_Hz": [500.0, 900.0]},
        ["speed_range_rpm = [500.0, 900.0]", "mesh_frequency_Hz sets it too", "leave one"],
    ),
    "one speed": ({"speed_range_rpm": [3000.0]}, ["speed_range_rpm = [3000.0]", "lowest and the highest"]),
    "speed of nothing": ({"mesh_frequency_Hz": [0.0, 900.0]}, ["mesh_frequency_Hz = [0.0, 900.0]", "between 0.001"]),
    "the same frequency": ({"mesh_frequency_Hz": [900.0, 900.0]}, ["900.0 is there twice"]),
    "density in g/cm3": ({"density_kg_m3": 7.81}, ["density_kg_m3 = 7.81", "looks like g/cm3", "write 7810.0"]),
    "bearings of rigid axes": ({"wheel_bearing_stiffness_N_um": [300.0, 300.0]}, ["degrees_of_freedom = 1", "write 6"]),
    "an axial bearing too many": (
        ON_BEARINGS | {"pinion_bearing_stiffness_N_um": [3.0, 3.0, 3.0]}, ["must be 2 values", "x, y"],
    ),
    "an axial bearing too few": (ON_BEARINGS | {"degrees_of_freedom": 12}, ["must be 3 values", "x, y, z"]),
    "tilting in the plane": (
        ON_BEARINGS | {"pinion_tilting_stiffness_kNm_rad": [1.0, 1.0]}, ["gears do not tilt", "write 12"],
    ),
    "damped rigid bearings": (
        ON_BEARINGS | {"wheel_bearing_damping_N_s_mm": [1.0, 1.0]}, ["without wheel_bearing_stiffness_N_um"],
    ),
    "loose bearings": (ON_BEARINGS | {"pinion_bearing_stiffness_N_um": [0.0, 3.0]}, ["above 0"]),
    "slices": ({"thin_slices": True}, ["thin_slices: unknown key", "run 'pmor lab slices CASE'"]),
}  # fmt: skip


@pytest.mark.parametrize("name", BROKEN)
def test_broken_sections_are_refused_in_one_line(name, tmp_path):
    section, words = BROKEN[name]
    path = tmp_path / "small.toml"
    path.write_text(case_text(**LINES, dynamics=section))
    refused("plan", path, words=[f"{path}: [dynamics] ", *words])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"contact": {"scheme": "direct"}, "reduction": {"shapes": "flank_lines"}}, "takes line loads, not"),
        (
            LINES
            | {"pinion.modification": {"pitch_deviations_um": [0.0] * 20 + [8.0]}, "dynamics": {"backlash_um": 50.0}},
            "say nothing of the coast flanks",
        ),
    ],
)
def test_a_pair_without_a_force_law_for_its_motion_is_refused_by_the_command(change, words, tmp_path):
    path = tmp_path / "small.toml"
    path.write_text(case_text(**change))
    refused("dynamics", path, "--out", tmp_path / "out", words=[words])
    assert not (tmp_path / "out").exists()


def test_a_section_that_is_changed_in_python_reads_back():
    case = parse_case(case_text(**LINES), "small", "small.toml")
    asked = change_case(case, dynamics=ON_BEARINGS | {"mesh_frequency_Hz": [100.0, 900.0], "mesh_damping_N_s_mm": 2.0})
    assert parse_case(text_of(asked), "small", "small.toml").dynamics == asked.dynamics
    assert asked.dynamics.mesh_frequency_Hz == (100.0, 900.0)
