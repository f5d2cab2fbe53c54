"""Keys of rings in a case: what is mixed up or missing is refused in one line with the remedy."""

import pytest

from pmor.case import change_case, make_case, text_of
from pmor.case.capability import why_not
from pmor.core.errors import CaseError
from pmor.pair.model import gear_pair

RING = {"teeth": 60, "internal": True, "addendum": 0.8, "rim_thickness_mm": 6.0}
PINION = {"teeth": 20, "bore_radius_mm": 10.0}
LUGS = {"lugs": 8, "lug_deg": 10.0}
SHAPER = {"teeth": 20, "addendum": 1.25, "tip_radius_mm": 0.3}


def case_of(wheel=RING, pinion=PINION, **more):
    pair = {"module_mm": 2.0, "face_width_mm": 20.0, "torque_Nm": 100.0}
    return make_case("ring", pinion=pinion, wheel=wheel, **(pair | more))


@pytest.mark.parametrize(
    ("wheel", "message"),
    [
        ({"bore_radius_mm": 30.0}, r"\[wheel\] bore_radius_mm = 30.0: a ring has no bore: write rim_thickness_mm"),
        ({"rim_thickness_mm": None}, r"\[wheel\] rim_thickness_mm: is missing: add"),
        ({"rim_thickness_mm": 0.5}, "rim_thickness_mm = 0.5: must be at least 1 mm, half a module: raise it"),
        ({"teeth": 20}, r"\[wheel\] teeth = 20: a ring needs more teeth than its pinion, 20: raise it"),
        ({"shaper": SHAPER, "root_fillet_mm": 0.5}, "root_fillet_mm = 0.5: the shaper makes the fillet: leave one"),
        (
            {"shaper": SHAPER, "rack_tip_radius": 0.3},
            "rack_tip_radius = 0.3: the shaper makes the .*leave it",
        ),
        ({"shaper": SHAPER | {"teeth": 60}}, "shaper teeth = 60: must be fewer than the 60 of the ring: lower it"),
        ({"shaper": {"addendum": 1.25}}, r"\[wheel.shaper\] teeth: is missing"),
        ({"held": "inside"}, r'\[wheel\] held = "inside": unknown choice: did you mean outside'),
        ({"held": {"lugs": 8}}, r"\[wheel.held\] lug_deg: is missing"),
        ({"held": LUGS | {"lugs": 36}}, "held lug_deg = 10: 36 lugs of it take all of the outside: lower it, or"),
        ({"held": LUGS | {"at_deg": [0.0]}}, "held: write either lugs, their number, or at_deg, their places"),
        ({"held": {"at_deg": [0.0, 40.0, 355.0], "lug_deg": 6.0}}, "held lug_deg = 6: two are 5 deg apart: lower it"),
        ({"seat_tangential_N_per_mm": "free"}, "nothing would hold the torque: write a number"),
        (
            {"internal": False, "rim_thickness_mm": None, "bore_radius_mm": 5.0, "seat_radial_N_per_mm": 1e6},
            "seat_radial_N_per_mm = 1000000.0: is of a ring: leave it out",
        ),
        ({"internal": False, "rim_thickness_mm": None, "held": LUGS}, "held: lugs are of a ring: leave it out"),
        ({"shaper": SHAPER, "dedendum": 1.4}, "dedendum = 1.4: the shaper cuts 1.25 modules deep: leave it out"),
        (
            {"internal": False},
            r"\[wheel\] rim_thickness_mm = 6.0: is of a ring: leave it out, or write internal",
        ),
        ({"blank": {"rim_thickness_mm": 3.0, "web_thickness_mm": 3.0, "hub_radius_mm": 30.0}}, "a ring has no web"),
    ],
)
def test_keys_that_do_not_go_together_are_refused(wheel, message):
    keys = {key: value for key, value in (RING | wheel).items() if value is not None}
    with pytest.raises(CaseError, match=message):
        case_of(keys)


def test_the_ring_of_a_pair_is_its_wheel():
    with pytest.raises(CaseError, match=r"\[pinion\] internal = true: the ring .* is the wheel"):
        case_of(PINION, RING)


def test_an_external_gear_needs_its_bore():
    with pytest.raises(CaseError, match=r"\[pinion\] bore_radius_mm: is missing: add 'bore_radius_mm = ...' be"):
        case_of(pinion={"teeth": 20})


@pytest.mark.parametrize(("distance", "message"), [(0.04, "looks like metres"), (30.0, "must be above 37.5"),
                                                   (41.0, "jam above 40 mm .*; lower it")])  # fmt: skip
def test_centre_distances_are_positive_and_bounded_the_other_way_round(distance, message):
    with pytest.raises(Exception, match=message):
        gear_pair(case_of(centre_distance_mm=distance))
    assert gear_pair(case_of(centre_distance_mm=39.98)).backlash > 0.0


def test_penalty_contact_and_what_takes_external_gears_say_so():
    with pytest.raises(CaseError, match='penalty contact takes external gears.*write scheme = "line"'):
        case_of(scheme="direct")
    assert "takes external gears, and the wheel is a ring" in why_not(case_of(), "stability")


def test_a_ring_reads_back_as_it_was_written():
    case = case_of(RING | {"shaper": SHAPER})
    assert change_case(case, torque_Nm=100.0).pair == case.pair
    assert "shaper = {" in text_of(case)


def test_lugs_read_back_and_stand_on_the_other_side_of_the_line_of_centres_for_coast_flanks():
    case = case_of(RING | {"held": LUGS | {"first_deg": 5.0}})
    coast = change_case(case, torque_Nm=-100.0)
    assert coast.pair.wheel.lugs.first_deg == -5.0
    assert change_case(coast, torque_Nm=100.0).pair == case.pair
    assert "held = {lugs = 8, lug_deg = 10.0, first_deg = 5.0}" in text_of(coast)
    case = case_of(RING | {"held": {"at_deg": [0.0, 50.0, 200.0], "lug_deg": 10.0}})
    coast = change_case(case, torque_Nm=-100.0)
    assert coast.pair.wheel.lugs.at_deg == (0.0, -50.0, -200.0)
    assert change_case(coast, torque_Nm=100.0).pair == case.pair


def test_what_takes_no_lugs_says_so():
    with pytest.raises(CaseError, match=r'\[wheel\] held: \[mesh\] width = "plane_strain" takes rings that are rigid'):
        case_of(RING | {"held": LUGS}, mesh={"width": "plane_strain"})
    with pytest.raises(CaseError, match=r'seat_radial_N_per_mm: \[mesh\] width = "plane_strain" takes rings'):
        case_of(RING | {"seat_tangential_N_per_mm": 1e6}, mesh={"width": "plane_strain"})
    for capability in ("exudyn", "fmu", "rexs", "vtkhdf"):
        for gives in ({"held": LUGS}, {"seat_radial_N_per_mm": 1e6}):
            assert "takes rings that are rigid all over their outside" in why_not(case_of(RING | gives), capability)
