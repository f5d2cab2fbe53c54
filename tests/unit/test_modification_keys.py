"""Modifications, conditions and tip edges in case files: read, changed, written, and what a basis makes of them."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from pmor import plan
from pmor.case import basis_key, change_case, describe, load_case, make_case, parse_case, text_of, without_models
from pmor.core.errors import CaseError, GeometryError
from pmor.gear.condition import Assembly, Misalignment
from pmor.gear.modification import UNMODIFIED, Modification
from pmor.gear.tip_edge import tip_edge
from pmor.gear.topography import Topography
from pmor.pair.conditions import assembly_of, conditions_of, listed_conditions, nominal_condition
from pmor.pair.model import gear_pair
from tests.support.gear_models import tooth
from tests.support.small_case import case_text

CASES = Path(__file__).parents[2] / "cases"
RELIEF = {"tip_relief_um": 20.0, "tip_relief_start_roll_deg": 25.0}
CROWNED = (
    case_text(offline={"centre_distance_um": [-5.0, 5.0]})
    + f"""
[pinion.modification]
helix_crowning_um = 5.0
pitch_deviations_um = {[0.5 * (-1) ** j * j for j in range(21)]}
[wheel.modification]
tip_relief_um = 20.0
tip_relief_start_roll_deg = 25.0
[misalignment]
centre_distance_um = 3.0
[[condition]]
[[condition]]
name = "low"
torque_Nm = 40.0
centre_distance_um = -2.0
[condition.wheel]
tip_relief_um = 4.0
[condition.pinion]
profile_crowning_um = 2.0
"""
)


@pytest.fixture
def crowned():
    return parse_case(CROWNED, "crowned", "case")


def test_each_gear_has_modifications_of_its_own(crowned):
    assert crowned.pinion_modification.helix_crowning_um == 5.0
    assert crowned.pinion_modification.pitch_deviations_um[:4] == (0.0, -0.5, 1.0, -1.5)
    assert crowned.wheel_modification == Modification(**RELIEF)
    assert crowned.pair.wheel == crowned.pair.pinion
    alone = parse_case(case_text() + "[pinion.modification]\nhelix_crowning_um = 5\n", "one", "case")
    assert alone.wheel_modification == UNMODIFIED


def test_conditions_are_the_case_but_for_what_they_say(crowned):
    first, low = crowned.conditions
    assert (first.name, low.name) == ("condition 1", "low")
    assert (first.torque_Nm, low.torque_Nm) == (100.0, 40.0)
    assert [c.misalignment.centre_distance_um for c in (first, low)] == [3.0, -2.0]
    assert (first.pinion, first.wheel) == (crowned.pinion_modification, crowned.wheel_modification)
    assert low.wheel == replace(crowned.wheel_modification, tip_relief_um=4.0)
    assert low.pinion == replace(crowned.pinion_modification, profile_crowning_um=2.0)


def test_conditions_of_a_case_know_its_flanks(crowned):
    assembly = Assembly(Misalignment(centre_distance_um=3.0), crowned.pinion_modification, crowned.wheel_modification)
    assert assembly_of(crowned) == assembly
    assert {c.assembly for c in conditions_of(crowned, (50.0, 100.0))} == {assembly}
    assert nominal_condition(crowned).assembly == assembly
    first, low = listed_conditions(crowned)
    assert first.assembly == assembly
    assert (low.torque, low.misalignment, low.wheel.tip_relief_um) == (4e4, Misalignment(centre_distance_um=-2.0), 4.0)


def test_the_text_of_a_modified_case_reads_back(crowned, tmp_path):
    assert text_of(crowned) == CROWNED
    changed = replace(crowned, title="other")
    assert parse_case(text_of(changed), "crowned", "case") == replace(changed, text=text_of(changed))
    (tmp_path / "flank.csv").write_text(",-10,0,10\n5,1,1,1\n35,-3,-3,-3\n")
    (tmp_path / "case.toml").write_text(CROWNED + 'topography = "flank.csv"\n')
    read = load_case(tmp_path / "case.toml")
    grid = Topography((5.0, 35.0), (-10.0, 0.0, 10.0), ((1.0, 1.0, 1.0), (-3.0, -3.0, -3.0)))
    assert read.conditions[1].pinion.topography == grid
    assert read.text.endswith('topography = "flank.csv"\n')
    again = parse_case(text_of(read), "case", "without a folder")
    assert replace(again, text=read.text) == read
    with pytest.raises(CaseError, match="no folder to look for it in"):
        parse_case(read.text, "case", "case")


def test_modifications_are_changed_by_keyword():
    case = make_case(teeth=21, bore_radius_mm=20.0, module_mm=4.0, face_width_mm=20.0, torque_Nm=100.0)
    relieved = change_case(case, wheel={"modification": RELIEF})
    assert relieved.wheel_modification == Modification(**RELIEF)
    more = change_case(relieved, wheel={"modification": {"tip_relief_um": 12.0}}, torque_Nm=90.0)
    assert more.wheel_modification == Modification(**RELIEF | {"tip_relief_um": 12.0})
    assert more.pair.wheel == case.pair.wheel
    listed = change_case(relieved, condition=[{"torque_Nm": 50.0, "wheel": {"tip_relief_um": 1.0}}])
    assert listed.conditions[0].wheel.tip_relief_um == 1.0
    grid = Topography((0.0, 40.0), (-10.0, 10.0), ((1.0, 2.0), (3.0, 4.0)))
    whole = change_case(case, pinion={"modification": {"topography": grid}}, mesh={"width": "whole"})
    assert whole.pinion_modification.topography == grid
    with pytest.raises(CaseError, match=r"write pinion=\{'modification': \{'tip_relief_um': ...\}\} or wheel="):
        change_case(case, tip_relief_um=3.0)


def test_a_plan_lists_the_modifications_that_are_there(crowned):
    settings = {key: value for key, value, _ in describe(crowned)}
    assert settings["wheel.modification.tip_relief_um"] == 20.0
    assert "pinion.modification.tip_relief_um" not in settings
    assert not any("modification" in key for key, _, _ in describe(parse_case(case_text(), "small", "case")))


def test_a_plan_lists_the_conditions_with_what_differs(crowned):
    text = plan(crowned)
    listed = text.split("Conditions beside the case's own\n")[1].split("\n\n")[0].splitlines()
    assert listed[0].split() == ["condition", "1", "100", "N", "m;", "centre_distance_um", "3"]
    assert "low" in listed[1]
    assert listed[1].endswith("centre_distance_um -2; pinion profile_crowning_um = 2.0; wheel tip_relief_um = 4.0")
    assert "Conditions" not in plan(parse_case(case_text(), "small", "case"))


def test_modifications_enter_a_basis_only_where_training_depends_on_them(crowned):
    def key(shapes="flank_lines", **changes):
        return basis_key(replace(crowned, reduction=replace(crowned.reduction, shapes=shapes), **changes))

    plain, relief = {"pinion_modification": UNMODIFIED}, Modification(**RELIEF)
    assert key(**plain) == key(pinion_modification=relief, wheel_modification=UNMODIFIED)
    assert key() != key(**plain)
    assert key() == key(pinion_modification=Modification(helix_crowning_um=5.0, **RELIEF))
    assert key("static_modes") == key("static_modes", **plain)
    assert key() == key(conditions=())


def test_conditions_that_load_the_width_as_no_training_did_are_refused():
    crowning = "[pinion.modification]\nhelix_crowning_um = 5\n"
    listed = crowning + "[[condition]]\n[condition.pinion]\nhelix_crowning_um = 8\n"
    with pytest.raises(CaseError, match=r'"condition 1": its flanks load the width otherwise .* "static_modes"'):
        parse_case(case_text() + listed, "case", "case")
    parse_case(case_text(reduction={"shapes": "static_modes"}) + listed, "case", "case")
    parse_case(case_text(online={"extrapolate": True}) + listed, "case", "case")
    parse_case(case_text() + listed.replace("helix_crowning_um = 8", "profile_crowning_um = 8"), "case", "case")


def test_the_case_with_relief_starts_it_where_one_pair_is_no_longer_alone():
    case = load_case(CASES / "paper_relief.toml")
    pair = gear_pair(case)
    alone = math.degrees(pair.active_rolls[0][0] + pair.pitch)
    assert alone < case.pinion_modification.tip_relief_start_roll_deg < alone + 1.0
    assert case.pair == load_case(CASES / "paper_spur.toml").pair


def test_edges_shorten_the_path_of_contact():
    case = without_models(load_case(CASES / "paper_spur.toml"))
    sharp, rounded = gear_pair(case), gear_pair(change_case(case, pinion={"tip_rounding_mm": 0.4}))
    lost = sharp.pinion.tip_roll_angle - tip_edge(sharp.pinion, rounding=0.4).roll_angle
    assert lost > 0.0
    both = 2.0 * lost / sharp.pitch  # the wheel is like the pinion
    assert rounded.contact_ratio == pytest.approx(sharp.contact_ratio - both, rel=1e-12)


def test_edges_shorten_the_flank():
    gear = tooth(21)
    assert tip_edge(gear).roll_angle == gear.tip_roll_angle
    chamfered = tip_edge(gear, chamfer=0.3).roll_angle
    assert gear.base_radius * math.hypot(1.0, chamfered) == pytest.approx(gear.tip_radius - 0.3, rel=1e-14)
    radius, roll = 0.4, tip_edge(gear, rounding=0.4).roll_angle
    # The centre of the arc is its radius below the flank's point and below the tip circle.
    point, normal = gear.flank_point(roll, 0.0), gear.flank_normal(roll, 0.0)
    centre = point - radius * normal
    assert math.hypot(*centre[:2]) == pytest.approx(gear.tip_radius - radius, rel=1e-14)
    assert tip_edge(gear, rounding=1e-9).roll_angle == pytest.approx(gear.tip_roll_angle, abs=1e-9)
    for edge in ({"rounding": 3.0}, {"chamfer": 1.5}, {"chamfer": 9.0}, {"rounding": 9.0}):
        with pytest.raises(GeometryError, match="tip_(rounding|chamfer)_mm = "):
            tip_edge(gear, **edge)
