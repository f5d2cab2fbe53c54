"""What a REXS file of a planetary stage determines: shifts of planets and ring, whose hands, whose tips."""

import math
from pathlib import Path
from xml.etree import ElementTree

import pytest
from numpy.testing import assert_allclose

from pmor.body.bearing_estimate import CatalogueBearing
from pmor.core.errors import CaseError
from pmor.rexs.drive import shaft_speeds
from pmor.rexs.files import load_set, read_set
from pmor.rexs.model import read_rexs
from pmor.rexs.shifts import Rack
from pmor.rexs.write_set import set_rexs
from pmor.sets.loader import parse_set
from tests.support.rexs_file import numbers_and_words
from tests.support.small_sets import MODIFIED_SET, SMALL_SET

DATE = "2026-01-01T00:00:00+00:00"
OUTSIDE, INSIDE = (Rack(teeth, 4.0, math.radians(20.0), 0.0) for teeth in ((18, 18), (18, -54)))
DISTANCE = OUTSIDE.distance_of(0.3)
SHIFTS = {"sun": 0.2, "planet": 0.1, "ring": INSIDE.shifts_at(DISTANCE) - 0.1}


def shifted():
    """The small set with shifts on all of its gears."""
    text = SMALL_SET.replace("tangential_um = [10.0, 0.0, 0.0]\n", "")
    for member, shift in SHIFTS.items():
        text = text.replace(f"[{member}]\n", f"[{member}]\nprofile_shift = {shift!r}\n")
    return text.replace("addendum = 0.8", "addendum = 0.7")


def model_of(text):
    return ElementTree.fromstring(set_rexs(parse_set(text, "planets", "planets"), None, DATE))


def without(model, kinds, *names):
    """Take attributes from the components of some kinds, or whose names end so."""
    for component in model.iter("component"):
        if component.get("type") in kinds or component.get("name", "").endswith(kinds):
            for attribute in [one for one in component if one.get("id") in names]:
                component.remove(attribute)


def read(tmp_path, model):
    (tmp_path / "planets.rexs").write_bytes(ElementTree.tostring(model))
    found = read_set(tmp_path / "planets.rexs")
    return found, parse_set(found.text, "planets", "back").sections.members


@pytest.mark.parametrize("by_axes", [False, True])
def test_shifts_of_planets_and_ring_follow_from_that_of_the_sun_by_distance_or_by_rounded_places(tmp_path, by_axes):
    """The planet meets twice: its shift from the mesh with the sun makes that of the ring."""
    model = model_of(shifted())
    for name in ("planet 1", "planet 2", "planet 3", "ring"):
        without(model, (f"flank of the {name}",), "addendum_modification_coefficient")
    if by_axes:
        without(model, ("cylindrical_stage",), "center_distance")
        for place in model.iterfind(".//attribute[@id='support_vector']//c"):
            place.text = f"{float(place.text):.4f}"
    found, members = read(tmp_path, model)
    for member, shift in SHIFTS.items():
        assert_allclose(members[member]["profile_shift"], shift, atol=1e-4 if by_axes else 1e-10, err_msg=member)
    assert sum("profile shift" in note and "from " in note for note in found.notes) == 2


def test_planets_that_differ_by_more_than_rounded_places_are_refused(tmp_path):
    model = model_of(shifted())
    without(model, ("flank of the planet 2",), "addendum_modification_coefficient")
    for flank in model.iterfind(".//component[@type='cylindrical_gear_flank']"):
        if flank.get("name").endswith("planet 2"):
            ElementTree.SubElement(flank, "attribute", id="addendum_modification_coefficient").text = "0.101"
    with pytest.raises(CaseError, match="only equal planets are solved"):
        read(tmp_path, model)


def test_tips_of_planets_that_are_open_clear_sun_and_ring(tmp_path):
    """Each mate is cut no deeper than for 0.88 and 0.84: the planet's tips clear both."""
    text = shifted().replace("[sun]\n", "[sun]\ndedendum = 1.0\n").replace("[planet]\n", "[planet]\naddendum = 0.8\n")
    model = model_of(text)
    without(model, ("planet 1", "planet 2", "planet 3"), "tip_diameter")
    found, members = read(tmp_path, model)
    assert 0.8 <= members["planet"]["addendum"] < 1.0
    assert any("addendum shortened to" in change for change in found.changed)


def test_a_helical_set_goes_out_with_the_signs_of_public_files():
    model = model_of(MODIFIED_SET)
    said = {gear.get("name"): float(gear.find("attribute[@id='helix_angle_reference_diameter']").text)
            for gear in model.find("components") if gear.get("type") in ("cylindrical_gear", "ring_gear")}  # fmt: skip
    assert said == {"sun": 10.0, "ring": 10.0, "planet 1": -10.0, "planet 2": -10.0, "planet 3": -10.0}


def test_a_helical_set_with_blanks_on_pins_is_the_same_in_what_is_written_again(tmp_path):
    """Written, read, written: one file; and the same members, pins, supports and loads."""
    blank = {"rim_thickness_mm": 3.0, "web_thickness_mm": 8.0, "web_offset_mm": -1.0, "hub_radius_mm": 22.0,
             "hub_width_mm": 16.0, "held_length_mm": 9.0, "held_offset_mm": -1.0}  # fmt: skip
    keys = "\n".join(f"{key} = {value}" for key, value in blank.items())
    one = parse_set(MODIFIED_SET.replace("[planet.mod", f"[planet.blank]\n{keys}\n[planet.mod"), "planets", "planets")
    first = set_rexs(one, None, DATE)
    (tmp_path / "planets.rexs").write_bytes(first)
    two = parse_set(read_set(tmp_path / "planets.rexs").text, "planets", "planets")
    assert numbers_and_words(set_rexs(two, None, DATE)) == numbers_and_words(first)
    assert two.sections.members["planet"]["blank"] == blank
    for name in ("planets", "supports", "pins", "load", "carrier"):
        assert getattr(two.sections, name) == getattr(one.sections, name), name
    assert [case.pair for case in two.cases.values()] == [case.pair for case in one.cases.values()]
    assert two.torques_Nm == one.torques_Nm


STEPPED = (Path(__file__).parents[2] / "cases" / "stepped_planets.toml").read_text()
ON_PINS = STEPPED.replace("[supports]", '''tangential_um = [5.0, 0.0, 0.0, 0.0]
[pins]
diameter_mm = 14.0
length_mm = 70.0
middle_mm = 13.0
bearings = [{ at_mm = 0.0, radial_N_per_mm = 3e5 }, { at_mm = 26.0, radial_N_per_mm = 4e5 }]
[supports]
planet_torsion_Nmm_per_rad = 5e7''').replace("[ring]", '''[second_planet.modification]
helix_slope_um = 3.0
tip_relief_um = 8.0
tip_relief_start_roll_deg = 32.0
[ring]''').replace("face_width_mm = 30.0", "face_width_mm = 30.0\nhelix_angle_deg = -15.0")  # fmt: skip


@pytest.mark.parametrize("text", [STEPPED, ON_PINS], ids=["as drawn", "on pins"])
def test_stepped_planets_are_two_gears_on_a_shaft_and_come_back_as_they_are(tmp_path, text):
    """With who is ahead, what twists and what they stand on: the second file is the first."""
    one = parse_set(text, "planets", "planets")
    first = set_rexs(one, None, DATE)
    (tmp_path / "planets.rexs").write_bytes(first)
    gearbox = read_rexs(tmp_path / "planets.rexs")
    carrier = next(relation.role("shaft") for relation in gearbox.relations if relation.kind == "planet_carrier_shaft")
    # By the relations of the file alone: Willis, with 25/49 and 21/95 teeth.
    assert shaft_speeds(gearbox, {})[carrier] == pytest.approx(12000.0 / (1.0 + 49.0 * 95.0 / (25.0 * 21.0)))
    gears = {gear.name: gear for gear in (*gearbox.of_kind("cylindrical_gear"), *gearbox.of_kind("ring_gear"))}
    turning = "planet 2", "second planet 2", "ring"
    assert [gears[name].number_of("helix_angle_reference_diameter") for name in turning] == [-15.0, -15.0, 15.0]
    two = load_set(tmp_path / "planets.rexs")
    assert numbers_and_words(set_rexs(two, None, DATE)) == numbers_and_words(first)
    assert not [note for note in two.notes if "not read" in note]
    for ours, theirs in zip(one.plan.bodies, two.plan.bodies, strict=True):
        assert (theirs.name, theirs.on, theirs.z) == (ours.name, ours.on, ours.z)
        assert_allclose([theirs.x, theirs.y], [ours.x, ours.y], atol=1e-9)
    for name in ("free", "compliance", "displacement", "load"):
        ours, theirs = getattr(one.plan, name), getattr(two.plan, name)
        assert_allclose(theirs, ours, rtol=1e-8, atol=1e-12 * abs(ours).max(initial=1e-9))
    for case, back in zip(one.cases.values(), two.cases.values(), strict=True):
        assert (back.pair, back.flank) == (case.pair, case.flank)
        assert back.torque_Nm == pytest.approx(case.torque_Nm)
        for name in ("pinion_modification", "wheel_modification"):
            ours, theirs = (vars(getattr(file, name)) for file in (case, back))
            assert {key: value for key, value in theirs.items() if value} == pytest.approx(
                {key: value for key, value in ours.items() if value}
            )


def test_a_bearing_by_its_catalogue_number_is_as_stiff_as_estimated_under_the_force_of_a_mesh(tmp_path):
    """300 N m on a sun of 18 teeth and three planets; as in a gearbox one without a type is demanded."""
    model = model_of(shifted().replace("[load]\n", "[supports]\nsun_radial_N_per_mm = 1e6\n[load]\n"))
    bearings = model.findall(".//component[@name='Sun'][@type='concept_bearing']")
    for bearing in bearings:
        bearing.set("type", "rolling_bearing_with_catalog_geometry")
        bearing.remove(bearing.find("attribute[@id='radial_stiffness']"))
    with pytest.raises(CaseError, match="neither stiffness, inner geometry nor bearing_type"):
        read(tmp_path, model)
    for bearing in bearings:
        for name, value in (("bearing_type", "radial_roller_bearing"), ("inner_diameter", "20.0")):
            ElementTree.SubElement(bearing, "attribute", id=name, unit="").text = value
    force = 300e3 / (3.0 * 36.0)
    expected = CatalogueBearing("roller", 20.0).radial_N_per_mm(force)
    found, _ = read(tmp_path, model)
    assert any(f"{expected:.3g} N/mm across under {force:.3g} N estimated" in note for note in found.notes)
    (said,) = (line for line in found.text.splitlines() if line.startswith("sun_radial_N_per_mm"))
    assert float(said.split(" = ")[1]) == pytest.approx(len(bearings) * expected, rel=0.05)


def test_a_sun_on_next_to_nothing_floats_and_the_file_says_how_soft_it_stands(tmp_path):
    """On two couplings of 1e-5 N/mm each, as programs write them so as not to divide by 0."""
    model = model_of(shifted().replace("[load]\n", "[supports]\nsun_radial_N_per_mm = 1e6\n[load]\n"))
    for bearing in model.iterfind(".//component[@name='Sun']"):
        bearing.find("attribute[@id='radial_stiffness']").text = "1e-2"
        bearing.find("attribute[@id='bending_stiffness']").text = "1e20"
    found, _ = read(tmp_path, model)
    assert 'sun_radial_N_per_mm = "free"' in found.text
    assert any("1e-05 N/mm across, and so it floats" in note for note in found.notes)
