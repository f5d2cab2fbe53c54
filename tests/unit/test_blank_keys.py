"""Keys of blanks: read, changed, mirrored, and refused in one line where their parts do not fit into each other."""

from dataclasses import replace

import pytest

from pmor.case import basis_key, change_case, describe, make_case, parse_case, text_of
from pmor.case.capability import why_not
from pmor.case.coast import other_flank
from pmor.case.models import coarser
from pmor.case.width import meshed_width
from pmor.core.errors import CaseError
from tests.support.small_case import case_with

HOLES = {"count": 6, "radius_mm": 2.0, "on_radius_mm": 27.5, "first_deg": 5.0}
WEB = {"rim_thickness_mm": 6.0, "web_thickness_mm": 5.0, "hub_radius_mm": 24.0}
CONE = {"rim_thickness_mm": 6.0, "hub_radius_mm": 24.0, "web_profile": [[24.0, -5.0, 5.0], [30.0, -2.0, 2.0]]}
SMALL = {"teeth": 21, "bore_radius_mm": 20.0, "module_mm": 4.0, "face_width_mm": 20.0, "torque_Nm": 100.0}


def case_of(blank=WEB, **changes):
    return make_case(**SMALL | {"scheme": "line", "pinion": {"blank": blank}} | changes)


def test_a_wheel_without_a_section_has_the_blank_of_the_pinion_unless_it_says_another():
    case = case_of(WEB | {"holes": HOLES})
    assert case.pair.wheel == case.pair.pinion
    assert case.pair.wheel.blank.holes.count == 6
    other = change_case(case, wheel={"blank": WEB | {"web_offset_mm": 2.0}})
    assert other.pair.wheel.teeth == 21
    assert (other.pair.wheel.blank.web_offset_mm, other.pair.wheel.blank.holes) == (2.0, None)
    alone = case_of(wheel={"teeth": 21, "bore_radius_mm": 20.0})
    assert alone.pair.pinion.blank is not None
    assert alone.pair.wheel.blank is None


def profile(*stations):
    return CONE | {"web_profile": list(stations)}


def test_a_web_keeps_its_faces_up_to_hub_and_rim_and_has_two_stations_at_a_step():
    blank = case_of(
        profile([25.0, -3.0, 5.0], [27.0, -3.0, 5.0], [27.0, -2.0, 1.0], [29.0, 0.0, 2.0])
    ).pair.pinion.blank
    expected = (24.0, -3.0, 5.0), (25.0, -3.0, 5.0), (27.0, -3.0, 5.0), (27.0, -2.0, 1.0), (29.0, 0.0, 2.0)
    assert blank.web_stations(31.0) == (*expected, (31.0, 0.0, 2.0))
    assert blank.thinnest_web_mm == 2.0


@pytest.mark.parametrize("blank", [WEB | {"holes": HOLES}, CONE])
def test_a_case_with_blanks_reads_back_also_where_its_fields_were_replaced(blank):
    case = case_of(blank)
    assert replace(parse_case(case.text, "case", "case"), text="") == replace(case, text="")
    changed = replace(case, torque_Nm=90.0, online=replace(case.online, torques_Nm=(90.0,)))
    again = parse_case(text_of(changed), "case", "case")
    assert again.pair == case.pair


def test_holes_are_read_in_line_as_well_as_in_a_section():
    inline = "holes = {count = 6, radius_mm = 2.0, on_radius_mm = 27.5, first_deg = 5.0}"
    text = case_of().text.replace("[pinion.blank]", f"[pinion.blank]\n{inline}")
    assert parse_case(text, "case", "case").pair == case_of(WEB | {"holes": HOLES}).pair


def test_blanks_are_in_the_key_of_a_basis_and_in_the_settings_that_a_plan_shows():
    assert len({basis_key(case) for case in (case_of(), case_of(WEB | {"holes": HOLES}), make_case(**SMALL))}) == 3
    assert ("pinion.blank.holes.count", 6, False) in describe(case_of(WEB | {"holes": HOLES}))


def test_stress_is_in_the_key_of_a_basis_and_left_out_of_coarser_ones():
    case = case_of(WEB | {"stress": True})
    assert case.web_stress
    assert basis_key(case) != basis_key(case_of())
    assert not coarser(case_of(WEB | {"stress": True}, profile_elements=8)).web_stress
    assert case.without_web_stress().pair == case_of().pair


def test_half_the_width_stands_for_webs_in_the_middle_alone():
    assert meshed_width(case_of()) == "half"
    assert meshed_width(case_of(WEB | {"web_offset_mm": 0.5})) == "whole"
    assert meshed_width(case_of(WEB | {"held_length_mm": 8.0})) == "half"
    assert meshed_width(case_of(CONE)) == "half"
    assert meshed_width(case_of(profile([24.0, -5.0, 5.0], [30.0, -2.0, 2.5]))) == "whole"
    assert meshed_width(case_of(WEB | {"held_length_mm": 8.0, "held_offset_mm": 0.5})) == "whole"


def test_a_blank_that_leaves_nothing_out_is_a_solid_gear():
    full = case_of(WEB | {"web_thickness_mm": 20.0})
    assert full.pair.pinion.light_blank(20.0) is None
    assert case_of(WEB | {"web_thickness_mm": 20.0, "held_length_mm": 20.0}).pair.pinion.light_blank(20.0) is None
    assert case_of(WEB | {"web_thickness_mm": 20.0, "held_length_mm": 19.0}).pair.pinion.light_blank(20.0) is not None
    assert case_of(WEB | {"web_thickness_mm": 19.9}).pair.pinion.light_blank(20.0) is not None
    assert case_of(WEB | {"web_thickness_mm": 20.0, "hub_width_mm": 22.0}).pair.pinion.light_blank(20.0) is not None


def test_holes_of_coast_flanks_are_on_the_other_side_of_the_line_of_centres():
    case = case_of(WEB | {"holes": HOLES})
    mirrored = other_flank(case)
    assert mirrored.pair.wheel.blank.holes.first_deg == -5.0
    assert other_flank(mirrored) == case


def test_capabilities_say_which_blanks_they_do_not_take():
    assert not why_not(case_of(WEB | {"holes": HOLES}), "set")
    assert not why_not(case_of(), "vtkhdf")
    assert "leave them out" in why_not(case_of(WEB | {"holes": HOLES}), "vtkhdf")
    assert not why_not(case_of(WEB | {"holes": HOLES}), "rexs")
    assert not why_not(case_of(WEB | {"holes": HOLES}), "design")


BROKEN = {
    "rim through the hub": ({"rim_thickness_mm": 13.0}, ["rim_thickness_mm = 13", "inner radius, 24 mm", "lower it"]),
    "hub within the bore": ({"hub_radius_mm": 20.0}, ["hub_radius_mm = 20", "above the bore's radius, 20 mm"]),
    "web wider than the face": ({"web_thickness_mm": 21.0}, ["web_thickness_mm = 21", "wider than the face, 20 mm"]),
    "web wider than the hub": ({"hub_width_mm": 4.0}, ["web_thickness_mm = 5", "wider than the hub, 4 mm"]),
    "web beside the face": ({"web_offset_mm": 8.0}, ["web_offset_mm = 8", "beyond the face", "within 7.5 mm"]),
    "web beside the hub": ({"web_offset_mm": 2.0, "hub_width_mm": 8.0}, ["beyond the hub", "within 1.5 mm"]),
    "two thicknesses": ({"web_profile": [[24.0, -2.0, 2.0], [30.0, -2.0, 2.0]]}, ["leave web_thickness_mm out"]),
    **{
        name: ({"web_thickness_mm": None, "web_profile": stations}, ["[pinion.blank] web_profile: ", *words])
        for name, stations, *words in (
            (
                "a profile of one station",
                [[24.0, -2.0, 2.0]],
                "two stations or more",
                "[[radius_mm, from_mm, to_mm], ...]",
            ),
            ("a profile of thicknesses", [[24.0, 4.0], [30.0, 2.0]], "[[radius_mm, from_mm, to_mm], ...]"),
            ("a profile of numbers", [24.0, 4.0, 2.0], "[[radius_mm, from_mm, to_mm], ...]"),
            (
                "a profile within the hub",
                [[23.0, -2.0, 2.0], [30.0, -2.0, 2.0]],
                "at radius 23 mm",
                "between hub, 24 mm",
            ),
            ("a profile within the rim", [[24.0, -2.0, 2.0], [31.5, -2.0, 2.0]], "at radius 31.5 mm", "and rim, 31 mm"),
            ("faces that cross", [[24.0, -2.0, 2.0], [30.0, 1.0, -1.0]], "at radius 30 mm", "from 1 to -1 mm", "raise"),
            (
                "a profile beyond the face",
                [[24.0, -2.0, 2.0], [28.0, 5.0, 10.5]],
                "10.5 mm, beyond the face, 20 mm wide",
            ),
            ("radii that fall", [[28.0, -2.0, 2.0], [24.0, -2.0, 2.0]], "must rise by 0.2 mm", "sort or merge"),
            ("stations side by side", [[28.0, -2.0, 2.0], [28.1, -1.0, 1.0]], "must rise by 0.2 mm", "equal at a step"),
            (
                "a step of three",
                [[28.0, -i, i] for i in (3.0, 2.0, 1.0)],
                "at radius 28 mm are three stations",
                "leave two",
            ),
            ("a step at the hub", [[24.0, -2.0, 2.0], [24.0, -1.0, 1.0]], "give one station there"),
            (
                "a step apart",
                [[28.0, -4.0, 0.0], [28.0, 0.1, 4.0]],
                "share less than 0.2 mm",
                "let their faces overlap",
            ),
        )
    },
    "a profile beyond the hub": (CONE | {"web_thickness_mm": None, "hub_width_mm": 8.0}, ["beyond the hub, 8 mm wide"]),
    "a profile that is moved": (CONE | {"web_thickness_mm": None, "web_offset_mm": 1.0}, ["leave web_offset_mm out"]),
    "holes in a profile": (CONE | {"web_thickness_mm": None, "holes": HOLES}, ["holes is for webs of one thickness"]),
    "stress of a profile": (
        CONE | {"web_thickness_mm": None, "stress": True},
        ["stress is for webs", "leave stress out"],
    ),
    "held beyond the hub": ({"held_length_mm": 21.0}, ["held_length_mm = 21", "longer than the hub, 20 mm"]),
    "held beside the hub": ({"held_length_mm": 12.0, "held_offset_mm": -5.0}, ["held_offset_mm = -5", "within 4 mm"]),
    "held off the middle without a length": ({"held_offset_mm": 1.0}, ["held_offset_mm = 1", "or give held_length_mm"]),
    "held nowhere": ({"held_length_mm": 0.1}, ["held_length_mm = 0.1", "at least 0.2 mm"]),
    "rim too thin": ({"rim_thickness_mm": 0.1}, ["rim_thickness_mm = 0.1", "at least 0.2 mm"]),
    "in metres": ({"rim_thickness_mm": 0.0006}, ["looks like metres"]),
    "no web": ({"web_thickness_mm": None}, ["[pinion.blank] web_thickness_mm", "is missing"]),
    "a word too many": ({"web_width_mm": 5.0}, ["[pinion.blank] web_width_mm", "did you mean hub_width_mm"]),
    "holes through the rim": ({"holes": HOLES | {"on_radius_mm": 29.0}}, ["27 to 31 mm", "they leave the web"]),
    "holes through the hub": ({"holes": HOLES | {"radius_mm": 3.4}}, ["24.1 to 30.9 mm", "lower radius_mm"]),
    "holes that meet": ({"holes": HOLES | {"count": 44}}, ["count = 44", "stay between neighbours", "fewer"]),
    "slots that meet": (
        {"holes": HOLES | {"length_deg": 52.0}},
        ["count = 6, length_deg = 52: -0.163 mm stay between neighbours", "shorter ones"],
    ),
    "slots over each other": ({"holes": HOLES | {"length_deg": 100.0}}, ["stay between neighbours", "shorter ones"]),
    "a slot that closes on itself": (
        {"holes": HOLES | {"count": 1, "length_deg": 352.0}},
        ["count = 1, length_deg = 352"],
    ),
    "hardly a slot": (
        {"holes": HOLES | {"length_deg": 0.3}},
        ["length_deg = 0.3", "0.144 mm", "leave it out for round"],
    ),
    "a slot around": ({"holes": HOLES | {"length_deg": 400.0}}, ["length_deg = 400"]),
    "stress of no web": ({"web_thickness_mm": 20.0, "stress": True}, ["stress = true", "solid", "leave it out"]),
    "stress of a short web": (
        {"web_thickness_mm": 5.0, "rim_thickness_mm": 9.0, "hub_radius_mm": 24.0, "stress": True},
        ["stress = true", "4 mm long and 5 mm thick", "lower web_thickness_mm"],
    ),
    "stress in words": ({"stress": "yes"}, ["[pinion.blank] stress"]),
    "no holes": ({"holes": HOLES | {"count": 0}}, ["count = 0"]),
    "holes in turns": ({"holes": HOLES | {"first_deg": 400.0}}, ["first_deg = 400"]),
}


@pytest.mark.parametrize("name", BROKEN)
def test_a_blank_that_cannot_be_is_refused(name):
    changes, words = BROKEN[name]
    with pytest.raises(CaseError) as refused:
        case_of({key: value for key, value in (WEB | changes).items() if value is not None})
    message = str(refused.value)
    assert "\n" not in message
    for word in words:
        assert word in message


@pytest.mark.parametrize(
    ("blank", "changes", "words"),
    [
        (WEB, {"width": "plane_strain"}, ['"plane_strain"', "leave the blank out"]),
        (WEB | {"stress": True}, {"scheme": "direct"}, ["stress = true", '"line"', "leave it out"]),
        (WEB | {"holes": HOLES}, {"scheme": "direct"}, ['scheme = "direct"', "leave the holes out"]),
        (WEB | {"held_length_mm": 8.0}, {"one_piece": True}, ["held_length_mm = 8", "one piece", "leave it out"]),
    ],
)
def test_meshes_and_contacts_without_a_place_for_a_blank_refuse_it(blank, changes, words):
    with pytest.raises(CaseError) as refused:
        case_of(blank, **changes)
    for word in words:
        assert word in str(refused.value)


def test_a_sweep_spans_by_default_as_many_pitches_as_holes_take_to_stand_as_before():
    assert case_of().pitches == 1
    assert case_of().online.angles_per_pitch == 200
    # 21 / gcd(21, 6) of either gear; 21 teeth with 4 holes need a revolution.
    case = case_of(WEB | {"holes": HOLES})
    assert (case.pitches, case.online.angles_per_pitch) == (7, 32)
    assert case_of(WEB | {"holes": HOLES | {"count": 4}}).pitches == 21
    assert change_case(case, pitches=2).pitches == 2


def test_a_sweep_spans_by_default_as_many_pitches_as_teeth_that_differ_take_to_stand_as_before():
    def deviating(*gears, online=None):
        flanks = {f"{gear}.modification": {"pitch_deviations_um": [0.0] * (n - 1) + [5.0]} for gear, n in gears}
        return case_with(wheel={"teeth": 33, "bore_radius_mm": 20.0}, online=online, **flanks)

    pinion, both = deviating(("pinion", 21)), deviating(("pinion", 21), ("wheel", 33))
    assert (pinion.pitches, pinion.online.angles_per_pitch) == (21, 32)
    assert (deviating(("wheel", 33)).pitches, both.pitches) == (33, 231)
    assert deviating(("pinion", 21), online={"pitches": 2}).pitches == 2
    # Of flanks that are given in Python, too.
    plain = deviating()
    assert (plain.pitches, replace(plain, wheel_modification=both.wheel_modification).pitches) == (1, 33)


def test_a_gear_of_one_piece_with_its_shaft_is_another_and_is_refused_where_it_has_no_place():
    case = make_case(**SMALL | {"one_piece": True})
    assert case.pair.wheel.one_piece
    assert basis_key(case) != basis_key(make_case(**SMALL))
    assert why_not(case, "rexs") == "a REXS file takes gears that are rigid at their bores: leave one_piece out"
    with pytest.raises(CaseError, match="plane_strain"):
        change_case(case, width="plane_strain")
    ring = {"teeth": 60, "internal": True, "rim_thickness_mm": 8.0, "one_piece": True}
    with pytest.raises(CaseError, match="a ring has no shaft"):
        make_case(**SMALL, wheel=ring)
