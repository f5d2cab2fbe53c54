"""What a REXS file of a stage determines is derived, what it leaves open is said: shifts, places, hands, tips."""

import base64
import json
import math
from xml.etree import ElementTree

import numpy as np
import pytest

from pmor.case import make_case
from pmor.export.rexs.model import read_rexs
from pmor.export.rexs.read import read_stage
from pmor.export.rexs.write import rexs_text
from pmor.pair.model import gear_pair

DATE = "2026-01-01T00:00:00+00:00"
RING = {"internal": True, "rim_thickness_mm": 12.0, "addendum": 0.9}


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
