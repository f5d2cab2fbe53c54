"""What a REXS file of a stage determines is derived, what it leaves open is said: shifts, places, hands, tips."""

import base64
import json
import math
from xml.etree import ElementTree

import numpy as np
import pytest

from pmor.case import change_case, make_case
from pmor.core.errors import CaseError, GeometryError
from pmor.pair.model import gear_pair
from pmor.rexs.model import Component, Gearbox, Relation, read_rexs
from pmor.rexs.read import read_stage
from pmor.rexs.shifts import profile_shifts
from pmor.rexs.tips import STEP
from pmor.rexs.write import rexs_text

DATE = "2026-01-01T00:00:00+00:00"
RING = {"internal": True, "rim_thickness_mm": 12.0, "addendum": 0.85}


def file_of(tmp_path, *, without=(), version="2.0.0", said=(), name="stage.rexs", **settings):
    """Write a pair as REXS `without` (component, attribute), and with others `said`, (..., unit, value)."""
    pinion = {"teeth": 21, "bore_radius_mm": 20.0}
    keys = {"module_mm": 4.0, "face_width_mm": 20.0, "torque_Nm": 100.0, "pinion": pinion}
    case = make_case("stage", **(keys | settings))
    model = ElementTree.fromstring(rexs_text(case, gear_pair(case), None, DATE))
    model.set("version", version)
    for component in model.iter("component"):
        for attribute in list(component):
            if any(matches(component, place) and attribute.get("id") == key for place, key in without):
                component.remove(attribute)
        for place, key, unit, value in said:
            if matches(component, place):
                for old in [one for one in component if one.get("id") == key]:
                    component.remove(old)
                added = ElementTree.SubElement(component, "attribute", id=key, unit=unit)
                if isinstance(value, list):
                    array = ElementTree.SubElement(added, "array")
                    for number in value:
                        ElementTree.SubElement(array, "c").text = repr(number)
                else:
                    added.text = str(value)
    (tmp_path / name).write_bytes(ElementTree.tostring(model))
    return tmp_path / name


def matches(component, place):
    """Whether a component has a name, or is of a kind."""
    return place in (component.get("name"), component.get("type"))


def test_arrays_are_read_by_any_spelling_of_their_code(tmp_path):
    numbers = base64.b64encode(np.array([1.5, -2.0], dtype="<f8").tobytes()).decode()
    value = {"code": "FLOAT_64", "value": numbers}
    attribute = {"id": "support_vector", "unit": "mm", "floating_point_array_coded": value}
    component = {"id": 1, "type": "shaft", "attributes": [attribute]}
    (tmp_path / "a.rexsj").write_text(json.dumps({"model": {"version": "1.4", "components": [component]}}))
    assert read_rexs(tmp_path / "a.rexsj").components[1].numbers_of("support_vector") == [1.5, -2.0]


@pytest.mark.parametrize(("version", "places"), [("1.0", (30.0, 36.0)), ("1.1", (40.0, 40.0)), ("2.0.0", (40.0, 40.0))])
def test_a_gear_stands_on_its_shaft_by_its_middle_and_in_the_first_version_by_its_beginning(tmp_path, version, places):
    """Faces of 20 and 8 mm about a middle 40 mm along shafts that begin alike."""
    said = [(name, "u_coordinate_on_shaft", "mm", places[name == "wheel"]) for name in ("pinion", "wheel")]
    wheel = {"teeth": 33, "face_width_mm": 8.0, "bore_radius_mm": 9.0}
    path = file_of(tmp_path, version=version, said=said, wheel=wheel)
    pair = gear_pair(read_stage(path).case)
    assert pair.faces == ((-10.0, 10.0), (-4.0, 4.0))


def test_a_gear_that_stands_in_space_is_there_whatever_its_coordinate_means(tmp_path):
    said = [(name, "support_vector", "mm", [x, 0.0, 0.0]) for name, x in (("pinion", 3.0), ("wheel", 5.0))]
    pair = gear_pair(read_stage(file_of(tmp_path, said=said, without=[("shaft", "support_vector")])).case)
    np.testing.assert_allclose(pair.faces, ((-11.0, 9.0), (-9.0, 11.0)))


def test_the_middle_of_a_gear_goes_out(tmp_path):
    path = file_of(tmp_path, wheel={"teeth": 33, "face_width_mm": 8.0, "face_offset_mm": 2.0, "bore_radius_mm": 9.0})
    gears = read_rexs(path).of_kind("cylindrical_gear")
    # Both shafts begin where the first face does, at z = -10.
    assert [gear.number_of("u_coordinate_on_shaft") for gear in gears] == [10.0, 12.0]


def test_a_bore_is_that_of_the_shaft_below_the_middle_of_the_gear(tmp_path):
    """A shaft of 30 mm up to 5 mm, from there conical from 32 to 40 mm over 20 mm; the gear's middle at 10 mm."""
    path = file_of(tmp_path, without=[("pinion", "inner_diameter")])
    model = ElementTree.parse(path)
    shaft = next(c.get("id") for c in model.iter("component") if c.get("name") == "Shaft of the pinion")
    for number, (start, length, begin, end) in enumerate(((0.0, 5.0, 30.0, 30.0), (5.0, 20.0, 32.0, 40.0)), start=90):
        part = ElementTree.SubElement(model.find("components"), "component", id=str(number), type="shaft_section")
        for key, value in (("u_coordinate_on_shaft", start), ("length", length), ("outer_diameter_begin", begin),
                           ("outer_diameter_end", end)):  # fmt: skip
            ElementTree.SubElement(part, "attribute", id=key, unit="mm").text = str(value)
        relation = ElementTree.SubElement(model.find("relations"), "relation", type="assembly")
        for role, of in (("assembly", shaft), ("part", str(number))):
            ElementTree.SubElement(relation, "ref", role=role, id=of)
    model.write(path)
    assert read_stage(path).case.pair.pinion.bore_radius_mm == 17.0


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("helix", [18.0, -18.0])
def test_a_helical_ring_is_read_with_either_sign_of_its_hand(tmp_path, helix, sign):
    """A ring has the hand of its pinion: files give it that sign, or that of a gear outside in its place."""
    path = file_of(tmp_path, helix_angle_deg=helix, wheel={"teeth": 70, **RING},
                   said=[("wheel", "helix_angle_reference_diameter", "deg", sign * helix)])  # fmt: skip
    case = read_stage(path).case
    assert case.pair.helix_angle_deg == helix
    pair = gear_pair(case)
    assert math.isclose(pair.pinion.twist_per_length * pair.pinion.base_radius, math.tan(pair.base_helix_angle))


def test_a_helical_ring_goes_out_with_the_sign_opposite_to_that_of_its_pinion(tmp_path):
    gearbox = read_rexs(file_of(tmp_path, helix_angle_deg=18.0, wheel={"teeth": 70, **RING}))
    said = [gear.number_of("helix_angle_reference_diameter") for kind in ("cylindrical_gear", "ring_gear")
            for gear in gearbox.of_kind(kind)]  # fmt: skip
    assert said == [18.0, -18.0]


SHIFT, TIP = "addendum_modification_coefficient", "tip_diameter"
OPEN_WHEEL = [("left flank of the wheel", SHIFT), ("right flank of the wheel", SHIFT)]
OPEN_PINION = [("left flank of the pinion", SHIFT), ("right flank of the pinion", SHIFT)]
TIPS = [("pinion", TIP), ("wheel", TIP)]
# 27/51, m 4.5, 21 deg, 190 mm: the shift of the wheel as another program found it from that of the pinion.
HELICAL = {"module_mm": 4.5, "helix_angle_deg": 21.0, "centre_distance_mm": 190.0,
           "pinion": {"teeth": 27, "bore_radius_mm": 25.0, "profile_shift": 0.3}}  # fmt: skip
OTHER_PROGRAM = 0.1628301985916763
WHEEL = {"teeth": 51, "bore_radius_mm": 40.0, "profile_shift": OTHER_PROGRAM}


@pytest.mark.parametrize("asked", [60.0, -190.0])
def test_a_shift_follows_from_the_axes_where_no_teeth_reach_over_the_centre_distance(tmp_path, asked):
    said = [("cylindrical_stage", "center_distance", "mm", asked)]
    found = read_stage(file_of(tmp_path, **HELICAL, wheel=WHEEL, said=said, without=[*OPEN_WHEEL, *TIPS]))
    assert found.case.pair.wheel.profile_shift == pytest.approx(OTHER_PROGRAM, abs=1e-9)
    assert any("from axes 190 mm apart" in note for note in found.notes)
    assert gear_pair(found.case).centre_distance == pytest.approx(190.0, abs=1e-9)


@pytest.mark.parametrize("by_axes", [False, True])
def test_a_shift_that_is_not_said_follows_from_the_centre_distance(tmp_path, by_axes):
    """The other program has the same shifts, but for the tip circle: addendum 1 on both gears."""
    without = [*OPEN_WHEEL, *TIPS, *([("cylindrical_stage", "center_distance")] if by_axes else [])]
    found = read_stage(file_of(tmp_path, **HELICAL, wheel=WHEEL, without=without))
    pair = gear_pair(found.case)
    assert math.isclose(pair.wheel.profile_shift, OTHER_PROGRAM, abs_tol=1e-11)
    assert math.isclose(pair.contact_ratio, 1.46436, abs_tol=5e-6)  # of six digits
    assert math.isclose(2.0 * pair.wheel.tip_radius, 256.293, abs_tol=5e-4)
    assert pair.backlash < 1e-9
    by = "axes 190 mm apart" if by_axes else "center_distance = 190 mm"
    (note,) = [note for note in found.notes if "profile shift" in note]
    assert f"profile shift 0.16283, from {by} and 0.3 of cylindrical_gear" in note


@pytest.mark.parametrize(
    ("rule", "first", "name"),
    [
        ("", 0.19897, "DIN 3992"),  # 20/50 without any in all: half of lg 2.5
        ("equal_addendum_modification_coefficients", 0.0, "x1 = x2"),
        ("equal_specific_root_sliding", 0.19897, "DIN 3992, where the file asks for equal_specific_root_sliding"),
    ],
)
@pytest.mark.parametrize("by_sum", [False, True])
def test_shifts_that_are_both_open_are_split_by_a_rule_that_is_said(tmp_path, rule, first, name, by_sum):
    said = [("cylindrical_stage", "flag_designation_addendum_modification", "none", rule)]
    if by_sum:
        said.append(("cylindrical_stage", "sum_of_addendum_modification_coefficients", "none", 0.0))
    found = read_stage(file_of(
        tmp_path, pinion={"teeth": 20, "bore_radius_mm": 15.0}, wheel={"teeth": 50, "bore_radius_mm": 30.0}, said=said,
        without=[*OPEN_PINION, *OPEN_WHEEL, *TIPS, *([("cylindrical_stage", "center_distance")] if by_sum else [])],
    ))  # fmt: skip
    gears = found.case.pair.pinion, found.case.pair.wheel
    np.testing.assert_allclose([gear.profile_shift for gear in gears], [first, -first], atol=1e-6)
    assert sum(f"split by a rule: {name}" in note for note in found.notes) == 2
    assert gear_pair(found.case).backlash < 1e-9


def test_a_shift_of_which_nothing_is_said_is_none_and_said_so(tmp_path):
    places = [("cylindrical_stage", "center_distance"), ("shaft", "support_vector")]
    path = file_of(tmp_path, without=[*OPEN_WHEEL, *places])
    found = read_stage(path)
    assert found.case.pair.wheel.profile_shift == 0.0
    assert any("neither its profile shift nor the distance" in note for note in found.notes)


def planets(**on_planet):
    """Sun, planet and ring of a wind turbine, 19/35/89, m 18, 7.35 deg, 500 mm; of shifts the sun's is said alone."""

    def part(number, kind, **values):
        return Component(number, kind, "", {k: (v, "") for k, v in values.items()}, "made")

    kinds = ("cylindrical_gear", 19.0, 7.35), ("cylindrical_gear", 35.0, -7.35), ("ring_gear", 89.0, 7.35)
    parts, relations = [], []
    for number, (kind, teeth, helix) in enumerate(kinds, start=1):
        basic = {"number_of_teeth": teeth, "normal_module": 18.0, "helix_angle_reference_diameter": helix}
        more = {1: {SHIFT: 0.35}, 2: on_planet}.get(number, {})
        parts.append(part(number, kind, **basic, **{key: value for key, value in more.items() if key == TIP}))
        flank = {"normal_pressure_angle": 20.0} | {key: value for key, value in more.items() if key == SHIFT}
        parts.append(part(10 + number, "cylindrical_gear_flank", **flank))
        relations.append(Relation("flank", (("gear", number), ("left", 10 + number))))
    for number, pair in ((20, (2, 3)), (21, (1, 2))):
        parts.append(part(number, "cylindrical_stage", center_distance=500.0))
        relations.append(Relation("stage", (("stage", number), ("gear_1", pair[0]), ("gear_2", pair[1]))))
    return Gearbox("1.5", "", {one.number: one for one in parts}, tuple(relations), ())


def test_the_shift_of_a_planet_goes_on_from_its_mesh_with_the_sun_to_that_with_the_ring():
    """As another program found them: 0.24329683455342277 and -0.8365936691068455."""
    found = profile_shifts(planets())
    np.testing.assert_allclose(found[2].coefficient, 0.24329683455342277, atol=1e-12)
    np.testing.assert_allclose(found[3].coefficient, -0.8365936691068455, atol=1e-12)
    assert (found[1].how, "of cylindrical_gear 1" in found[2].how) == ("", True)


@pytest.mark.parametrize(("tip", "shift"), [(679.978, 0.24329683455342277), (671.22, 0.0), (None, 0.0)])
def test_a_shift_is_outvoted_by_distance_and_tip_circle_together_alone(tip, shift):
    """A 0 for a shift that was never given: tips of addendum 1 have the shift that 500 mm asks for."""
    found = profile_shifts(planets(**{SHIFT: 0.0}, **({} if tip is None else {TIP: tip})))
    np.testing.assert_allclose(found[2].coefficient, shift, atol=1e-12)
    assert ("tip_diameter = 679.978 mm: 0 fits neither" in found[2].how) == (shift > 0.0)


def test_a_shift_that_contradicts_the_centre_distance_is_taken_and_said_with_both_values(tmp_path):
    """Today's reading of the first test's file: 0.577 mm of backlash."""
    found = read_stage(file_of(tmp_path, **HELICAL, wheel=WHEEL | {"profile_shift": 0.0}, without=TIPS))
    pair = gear_pair(found.case)
    assert (pair.wheel.profile_shift, pair.centre_distance) == (0.0, 190.0)
    (note,) = [note for note in found.notes if "backlash" in note]
    assert note == (
        "center_distance = 190 mm leaves the profile shifts 0.3 and 0, without backlash at 189.306 mm, "
        f"{pair.backlash:.3g} mm of it: taken as they are said"
    )
    assert found.changed == ()


@pytest.mark.parametrize(
    ("wheel", "too"), [({"teeth": 51, "bore_radius_mm": 40.0}, "small"), ({"teeth": 70, **RING}, "large")]
)
def test_a_centre_distance_at_which_teeth_jam_is_replaced_and_said_with_both_values(tmp_path, wheel, too):
    drawn = gear_pair(read_stage(file_of(tmp_path, wheel=wheel)).case).centre_distance
    asked = abs(drawn) + (-0.5 if too == "small" else 0.5)
    found = read_stage(file_of(tmp_path, wheel=wheel, said=[("cylindrical_stage", "center_distance", "mm", asked)]))
    assert gear_pair(found.case).centre_distance == drawn
    (note,) = found.changed
    assert note in found.notes
    assert note.startswith(f"center_distance = {asked:g} mm: too {too} for the profile shifts 0 and 0")
    assert f"{abs(drawn):.6g} mm" in note


def test_a_shift_that_no_gear_has_is_refused_with_what_asks_for_it(tmp_path):
    said = [("cylindrical_stage", "center_distance", "mm", 200.0)]
    path = file_of(tmp_path, wheel={"teeth": 51, "bore_radius_mm": 40.0}, said=said, without=OPEN_WHEEL)
    with pytest.raises(CaseError, match=r"cylindrical_gear 12 \(wheel\): profile shift 24.*center_distance = 200 mm"):
        read_stage(path)


def test_a_pair_that_cannot_run_is_refused_with_the_contradiction_in_its_file(tmp_path):
    said = [("cylindrical_stage", "center_distance", "mm", 151.0)]
    path = file_of(tmp_path, wheel={"teeth": 51, "bore_radius_mm": 40.0}, said=said)
    with pytest.raises(GeometryError, match="center_distance = 151 mm leaves .*, and so contact ratio 0.* is below 1"):
        read_stage(path)


@pytest.mark.parametrize("attribute", ["normal_module", "normal_pressure_angle", "helix_angle_reference_diameter"])
def test_what_one_gear_does_not_say_is_that_of_its_mate(tmp_path, attribute):
    parts = OPEN_WHEEL if attribute == "normal_pressure_angle" else [("wheel", "")]
    whole = read_stage(file_of(tmp_path, **HELICAL, wheel=WHEEL))
    found = read_stage(file_of(tmp_path, **HELICAL, wheel=WHEEL, without=[(part, attribute) for part, _ in parts]))
    assert found.case.pair == whole.case.pair
    assert [note for note in found.notes if note not in whole.notes] == [
        f"cylindrical_gear {found.notes[0].split()[1]} (wheel): no {attribute}: that of its mate"
    ]


def test_a_pair_without_helix_angles_is_a_spur_pair_and_said_so(tmp_path):
    path = file_of(tmp_path, without=[("cylindrical_gear", "helix_angle_reference_diameter")])
    assert "no helix_angle_reference_diameter of either gear: spur gears assumed" in read_stage(path).notes


# Teeth that are cut no deeper than a tip of addendum 1 reaches.
SHALLOW = {"pinion": {"teeth": 28, "bore_radius_mm": 20.0, "addendum": 0.8},
           "wheel": {"teeth": 24, "bore_radius_mm": 20.0, "dedendum": 1.02}}  # fmt: skip


def test_tips_that_a_file_does_not_say_are_shortened_until_they_clear_the_mate(tmp_path):
    """One step less than what is taken cuts into the mate's fillet too."""
    found = read_stage(file_of(tmp_path, **SHALLOW, without=TIPS[:1]))
    addendum = found.case.pair.pinion.addendum
    assert 0.8 < addendum < 1.0
    (note,) = found.changed
    assert f"(pinion): addendum shortened to {addendum:.2f}, k = {addendum - 1.0:.2f}: with 1, which a file" in note
    assert "its tip cuts" in note
    with pytest.raises(GeometryError, match="the pinion's tip cuts"):
        gear_pair(change_case(found.case, pinion={"addendum": addendum + STEP}))


def test_tips_that_a_file_says_are_not_shortened(tmp_path):
    said = [("pinion", TIP, "mm", 120.0)]  # 1.0 modules
    with pytest.raises(GeometryError, match="the pinion's tip cuts"):
        read_stage(file_of(tmp_path, **SHALLOW, said=said))


def test_the_addendum_of_the_rack_is_that_of_a_gear_without_a_tip_circle(tmp_path):
    flanks = "left flank of the pinion", "right flank of the pinion"
    said = [(flank, "addendum_coefficient_basic_profile", "none", 0.9) for flank in flanks]
    found = read_stage(file_of(tmp_path, said=said, without=TIPS))
    assert (found.case.pair.pinion.addendum, found.case.pair.wheel.addendum) == (0.9, 1.0)
    assert [note for note in found.notes if "assumed" in note and "pinion" in note] == []


def test_a_crowning_whose_other_end_is_not_said_is_as_large_there_and_said_so(tmp_path):
    crowned = {"pinion.modification": {"helix_crowning_um": 6.0, "profile_crowning_um": 4.0}}
    without = [("helix_crowning", "helix_crowning_amount_non_datum_face")]
    without.append(("profile_crowning", "profile_crowning_at_root"))
    found = read_stage(file_of(tmp_path, **crowned, without=without))
    flank = found.case.pinion_modification
    assert (flank.helix_crowning_um, flank.profile_crowning_um) == (6.0, 4.0)
    assert (flank.helix_slope_um, flank.profile_slope_um) == (0.0, 0.0)
    assert sum("as much as at the other end" in note for note in found.notes) == 2


@pytest.mark.parametrize(("places", "origin"), [((-10.0, 10.0), "middle"), ((0.0, 20.0), "datum face")])
def test_coordinates_over_the_width_count_from_the_middle_of_the_face_or_are_said_not_to(tmp_path, places, origin):
    """A crowning between both ends has no slope: as all public files write it, and as some programs may."""
    crowned = {"pinion.modification": {"helix_crowning_um": 6.0}}
    names = (f"coordinate_where_helix_crowning_is_specified_{face}_face" for face in ("datum", "non_datum"))
    said = [("helix_crowning", name, "mm", place) for name, place in zip(names, places, strict=True)]
    found = read_stage(file_of(tmp_path, **crowned, said=said))
    flank = found.case.pinion_modification
    assert (flank.helix_crowning_um, flank.helix_slope_um) == (pytest.approx(6.0), pytest.approx(0.0, abs=1e-9))
    assert any("taken from the datum face on" in note for note in found.notes) == (origin == "datum face")


def test_what_a_file_does_not_say_of_a_cutter_is_assumed_and_said(tmp_path):
    wheel = {"teeth": 70, **RING, "shaper": {"teeth": 24, "addendum": 1.25}}
    without = [("Tool of the wheel", f"{name}_reference_profile") for name in (
        "tip_corner_radius_factor", "addendum_coefficient")] + [("Tool of the wheel", SHIFT)]  # fmt: skip
    found = read_stage(file_of(tmp_path, wheel=wheel, without=without))
    assert (found.case.pair.wheel.shaper.addendum, found.case.pair.wheel.shaper.tip_radius_mm) == (1.25, 0.0)
    assert any("addendum 1.25, sharp corners, profile shift 0 assumed" in note for note in found.notes)


def test_a_generated_shift_is_not_read_and_named(tmp_path):
    said = [("cylindrical_gear_manufacturing_settings", "generated_addendum_modification_coefficient", "none", -0.02)]
    notes = read_stage(file_of(tmp_path, said=said)).notes
    assert sum("not read: generated_addendum_modification_coefficient" in note for note in notes) == 2
