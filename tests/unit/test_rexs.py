"""REXS files of all forms become cases; what is not understood is said; a case survives the way out and in."""

import base64
import json
import math
import zipfile
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from pmor.case import make_case
from pmor.core.errors import CaseError, FileFormatError
from pmor.gear.modification import Modification
from pmor.gear.topography import Topography
from pmor.pair.model import gear_pair
from pmor.rexs.document import Document
from pmor.rexs.housing import read_housing_matrix
from pmor.rexs.model import read_rexs
from pmor.rexs.read import read_stage
from pmor.rexs.stage import find_stage
from pmor.rexs.units import UNITS, factor_of
from pmor.rexs.write import rexs_text
from tests.support.rexs_file import made, numbers_and_words, part

GEARBOX = Path(__file__).parents[2] / "cases" / "gearbox.rexs"
DATE = "2026-01-01T00:00:00+00:00"


def changed(tmp_path, *replacements, name="gearbox.rexs"):
    """Write the example gearbox with some of its text replaced."""
    text = GEARBOX.read_text()
    for old, new in replacements:
        assert old in text
        text = text.replace(old, new)
    (tmp_path / name).write_text(text)
    return tmp_path / name


def test_the_example_gearbox_is_the_pair_that_it_describes():
    found = read_stage(GEARBOX)
    case, pair = found.case, gear_pair(found.case)
    assert case.torque_Nm == 120.0
    assert case.online.torques_Nm == (80.0, 120.0)
    assert (case.pair.pinion.teeth, case.pair.wheel.teeth) == (23, 37)
    # Diameters of the file.
    np.testing.assert_allclose(2.0 * pair.pinion.tip_radius, 77.4, rtol=1e-12)
    np.testing.assert_allclose(2.0 * pair.wheel.tip_radius, 118.8, rtol=1e-12)
    assert case.pair.pinion.rack_tip_radius == 0.3  # 0.9 mm
    assert (case.pair.pinion.bore_radius_mm, case.pair.wheel.bore_radius_mm) == (15.0, 22.5)
    assert case.pair.pinion.youngs_modulus_GPa == 206.0
    # 39 to 63 mm and 41 to 61 mm along the axis.
    assert pair.faces == ((-12.0, 12.0), (-10.0, 10.0))
    relief = case.pinion_modification
    assert (relief.tip_relief_um, relief.helix_crowning_um) == (15.0, 4.0)
    np.testing.assert_allclose(  # it begins at a diameter of 75 mm
        np.radians(relief.tip_relief_start_roll_deg), pair.pinion.roll_angle_at(37.5), rtol=1e-11
    )
    on_wheel = case.wheel_modification
    np.testing.assert_allclose(  # it ends 3 mm below the tip, along the line of action
        pair.wheel.base_radius * (pair.wheel.tip_roll_angle - np.radians(on_wheel.tip_relief_start_roll_deg)), 3.0,
        rtol=1e-9,
    )  # fmt: skip
    assert on_wheel.tip_relief_shape == "parabolic"


def test_what_is_not_understood_is_listed_and_stands_in_the_text_of_the_case():
    found = read_stage(GEARBOX)
    backlash, *others = found.notes  # 0.0204 modules
    assert backlash.startswith("center_distance = 91.5 mm leaves the profile shifts 0.3 and 0.2")
    assert others == ["triangular_tip_relief 19: a case has no such modification: left out"]
    assert all(f"# {note}\n" in found.case.text for note in found.notes)


@pytest.mark.parametrize(
    ("old", "new", "note"),
    [
        ('<attribute id="inner_diameter" unit="mm">30.0', '<attribute id="inner_diameter" unit="mm">60.0', "no rim"),
        ('unit="mm">77.4', 'unit="mm">1.0', "tip_diameter = 1 mm is below its teeth"),
        ('<attribute id="torque_around_u_axis"', '<attribute id="custom_torque"', "its own into [load] torque_Nm"),
        ('id="shape_of_relief" unit="none">linear', 'id="shape_of_relief" unit="none">logarithmic',
         "its shape is neither linear nor parabolic"),
        ('<attribute id="tip_relief_datum_diameter" unit="mm">75.0</attribute>', "", "its start is missing"),
        ('id="center_distance" unit="mm">91.5', 'id="center_distance" unit="mm">90.5', "too small for the profile"),
        ('<attribute id="addendum_coefficient_reference_profile" unit="none">1.25</attribute>', "",
         "no tool says dedendum"),
    ],
)  # fmt: skip
def test_what_is_missing_or_odd_is_assumed_and_said(tmp_path, old, new, note):
    notes = read_stage(changed(tmp_path, (old, new))).notes
    assert any(note in line for line in notes), notes


def test_a_bore_is_that_of_the_shaft_and_is_assumed_where_nothing_says_it(tmp_path):
    bore = ('<attribute id="inner_diameter" unit="mm">30.0</attribute>', "")
    section = ('outer_diameter_begin" unit="mm">30.0', 'outer_diameter_begin" unit="mm">28.0')
    assert read_stage(changed(tmp_path, bore, section)).case.pair.pinion.bore_radius_mm < 15.0
    notes = read_stage(changed(tmp_path, bore, ('type="shaft_section"', 'type="part"'))).notes
    assert any("nothing says its bore" in note for note in notes)


def test_gears_of_no_said_modulus_are_of_the_steel_of_a_case(tmp_path):
    found = read_stage(changed(tmp_path, ('<attribute id="elastic_modulus"', '<attribute id="custom_modulus"')))
    assert found.notes == read_stage(GEARBOX).notes
    assert {gear.youngs_modulus_GPa for gear in (found.case.pair.pinion, found.case.pair.wheel)} == {210.0}


# Of the faces of both gears along their shafts, which say their middles since the second version.
FACE = 'face_width" unit="mm">{}</attribute>\n      <attribute id="u_coordinate_on_shaft" unit="mm">{}'
BEGINNINGS = [(FACE.format(width, 51.0), FACE.format(width, low)) for width, low in ((24.0, 39.0), (20.0, 41.0))]


def test_units_and_names_of_the_first_version_are_understood(tmp_path):
    path = changed(
        tmp_path, ('unit="deg"', 'unit="°"'), ('unit="MPa">206000.0', 'unit="N / mm^2">206000.0'),
        ("cylindrical_gear_flank", "flank_geometry"), ("cylindrical_stage_gear_data", "stage_gear_data"),
        ("tip_corner_radius_reference_profile", "tip_radius"), ('version="2.0.0"', 'version="1.0"'), *BEGINNINGS,
    )  # fmt: skip
    old, new = read_stage(path).case, read_stage(GEARBOX).case
    assert (old.pair, old.pinion_modification, old.wheel_modification) == (
        new.pair, new.pinion_modification, new.wheel_modification,
    )  # fmt: skip


def test_lengths_in_micrometres_and_angles_in_radians_are_the_same_gearbox(tmp_path):
    path = changed(
        tmp_path, ('unit="mm">0.015', 'unit="mum">15.0'), ('unit="deg">20.0', f'unit="rad">{math.radians(20.0)!r}')
    )
    case = read_stage(path).case
    np.testing.assert_allclose(case.pinion_modification.tip_relief_um, 15.0, rtol=1e-12)
    np.testing.assert_allclose(case.pair.pressure_angle_deg, 20.0, rtol=1e-12)


def test_an_archive_and_json_hold_the_same_gearbox(tmp_path):
    with zipfile.ZipFile(tmp_path / "box.rexsz", "w") as archive:
        archive.write(GEARBOX, "inside.rexs")
    (tmp_path / "box.rexsj").write_text(json.dumps(as_json()))
    expected = read_stage(GEARBOX).case
    for name in ("box.rexsz", "box.rexsj"):
        case = read_stage(tmp_path / name).case
        assert (case.pair, case.pinion_modification) == (expected.pair, expected.pinion_modification), name
        assert case.online.torques_Nm == expected.online.torques_Nm


def as_json():
    root = ElementTree.parse(GEARBOX).getroot()

    def components(items):
        return [{"id": int(c.get("id")), "type": c.get("type"), "attributes": [attribute(a) for a in c]} for c in items]

    def attribute(item):
        cells = [float(c.text) for c in item.iter("c")]
        found = {"id": item.get("id"), "unit": item.get("unit")}
        if cells:
            code = base64.b64encode(np.array(cells, dtype="<f8").tobytes()).decode()
            return found | {"floating_point_array_coded": {"code": "float64", "value": code}}
        if item.text in ("true", "false"):
            return found | {"boolean": item.text == "true"}
        try:
            return found | {"floating_point": float(item.text)}
        except ValueError:
            return found | {"enum": item.text}

    relations = [
        {"type": r.get("type"), "refs": [{"id": int(x.get("id")), "role": x.get("role")} for x in r]}
        for r in root.find("relations")
    ]
    cases = [{"id": int(c.get("id")), "components": components(c)} for c in root.find("load_spectrum")]
    return {"model": {
        "version": "2.0.0", "relations": relations, "components": components(root.find("components")),
        "load_spectrum": {"id": 1, "load_cases": cases},
    }}  # fmt: skip


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<model", "cannot be read as REXS"),
        ("<page/>", "is XML, but no REXS model"),
        ('<!DOCTYPE x [<!ENTITY a "b">]><model version="1.0"/>', "declares a document type"),
        ('<model version="1.0"><components><component id="x" type="a"/></components></model>', "no whole number"),
        ('<model version="1.0"/>', "no stage of two cylindrical gears"),
    ],
)
def test_what_is_no_gearbox_is_refused_in_one_line(tmp_path, text, message):
    (tmp_path / "a.rexs").write_text(text)
    with pytest.raises((FileFormatError, CaseError), match=message) as caught:
        read_stage(tmp_path / "a.rexs")
    assert "\n" not in str(caught.value)
    with pytest.raises(FileFormatError, match="no such file"):
        read_stage(tmp_path / "b.rexs")


def test_every_attribute_has_its_own_unit():
    """Here are millimetres and degrees: where the standard has others, they are converted."""
    converted = {"mum": 1e-3, "N / m": 1e-3, "kN": 1e3, "rad": 180.0 / math.pi}
    for attribute, unit in UNITS.items():
        assert factor_of(attribute, unit) == converted.get(unit, 1.0), attribute
    assert factor_of("custom_pmor_losses", "kW") == 1e3


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ('unit="MPa">206000.0', 'unit="GPa">206'), ('unit="MPa">206000.0', 'unit="kN / mm^2">206'),
        ('unit="N m">120.0', 'unit="N mm">120000'), ('unit="N m">120.0', 'unit="kNm">0.12'),
        ('unit="mm">3.0', 'unit="cm">0.3'), ('unit="mm">3.0', f'unit="inch">{3.0 / 25.4!r}'),
        ('unit="mm">77.4', 'unit="m">0.0774'), ('unit="mm">0.015', 'unit="\u00b5m">15'),
        ('unit="deg">20.0', f'unit="mrad">{1e3 * math.radians(20.0)!r}'), ('unit="mm">3.0', 'unit="">3.0'),
    ],
)  # fmt: skip
def test_units_of_other_programs_are_converted(tmp_path, old, new):
    found, expected = (as_plain(read_stage(path).case) for path in (changed(tmp_path, (old, new)), GEARBOX))
    assert found == pytest.approx(expected, rel=1e-11, abs=1e-11)


def as_plain(case):
    """Numbers of the gears, the load and the modifications, by their keys."""
    parts = {"pinion": case.pair.pinion, "wheel": case.pair.wheel, "on_pinion": case.pinion_modification}
    numbers = {f"{name}.{k}": v for name, part in parts.items() for k, v in vars(part).items() if isinstance(v, float)}
    pair = {k: v for k, v in vars(case.pair).items() if isinstance(v, float)}
    return numbers | pair | {"torque": case.torque_Nm, "teeth": case.pair.pinion.teeth}


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('unit="MPa">206000.0', 'unit="psi">206000.0', "elastic_modulus: unit = 'psi': must be one of MPa"),
        ('unit="MPa">206000.0', 'unit="mPa">206000.0', "elastic_modulus: unit = 'mPa'"),
        ('unit="N m">120.0', 'unit="lbf ft">120.0', "torque_around_u_axis: unit = 'lbf ft': must be one of Nm"),
        ('unit="mm">3.0', 'unit="deg">3.0', "normal_module: unit = 'deg': must be one of mm"),
        ('unit="deg">20.0', 'unit="gon">20.0', "normal_pressure_angle: unit = 'gon'"),
        ('unit="none">23<', 'unit="none">23.4<', "number_of_teeth = 23.4: must be a whole number"),
        ('unit="none">23<', 'unit="none">many<', "number_of_teeth = 'many': must be a number"),
        ('unit="mm">77.4', 'unit="mm">77,4', "tip_diameter = '77,4': must be a number"),
    ],
)  # fmt: skip
def test_what_cannot_be_converted_is_refused_with_its_place(tmp_path, old, new, said):
    with pytest.raises(FileFormatError) as caught:
        read_stage(changed(tmp_path, (old, new)))
    assert said in str(caught.value)
    assert str(caught.value).startswith(str(tmp_path / "gearbox.rexs"))
    assert "\n" not in str(caught.value)


BOMB = '<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;">]><model version="1.0">&b;</model>'


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "latin-1"])
def test_declarations_of_entities_are_refused_in_any_encoding(tmp_path, encoding):
    head = f'<?xml version="1.0" encoding="{encoding}"?>'
    (tmp_path / "a.rexs").write_bytes(f"{head}{BOMB}".encode(encoding))
    with pytest.raises(FileFormatError, match="declares a document type"):
        read_stage(tmp_path / "a.rexs")


def archive_with(path, method, change):
    with zipfile.ZipFile(path, "w", method) as archive:
        archive.write(GEARBOX, "inside.rexs")
    data = bytearray(path.read_bytes())
    change(data)
    path.write_bytes(data)


def flags(data, value):
    """Set the general flags in both headers of the only file."""
    for place in (6, data.rindex(b"PK\x01\x02") + 8):
        data[place] = value


def method(data, value):
    for place in (8, data.rindex(b"PK\x01\x02") + 10):
        data[place] = value


def scramble(data):
    data[200:400] = b"\xff" * 200


@pytest.mark.parametrize(
    ("packing", "change"),
    [
        (zipfile.ZIP_DEFLATED, scramble), (zipfile.ZIP_STORED, scramble), (zipfile.ZIP_LZMA, scramble),
        (zipfile.ZIP_BZIP2, scramble), (zipfile.ZIP_DEFLATED, lambda data: flags(data, 1)),
        (zipfile.ZIP_DEFLATED, lambda data: method(data, 97)),
    ],
    ids=["deflated", "stored", "lzma", "bzip2", "encrypted", "unknown method"],
)  # fmt: skip
def test_archives_that_cannot_be_unpacked_are_refused_in_one_line(tmp_path, packing, change):
    archive_with(tmp_path / "box.rexsz", packing, change)
    refused_as_no_rexs(tmp_path / "box.rexsz")


def refused_as_no_rexs(path):
    with pytest.raises(FileFormatError, match="cannot be read as REXS") as caught:
        read_stage(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", ["unheard-of", "utf-7", "idna", "base64", "undefined"])
def test_encodings_that_expat_does_not_know_are_refused_in_one_line(tmp_path, name):
    text = GEARBOX.read_text()
    (tmp_path / "a.rexs").write_text(f'<?xml version="1.0" encoding="{name}"?>{text[text.index("<model") :]}')
    refused_as_no_rexs(tmp_path / "a.rexs")


@pytest.mark.parametrize(
    "change",
    [
        lambda model: model["components"][0].update(id=math.inf), lambda model: model["components"][0].update(id=1.5),
        lambda model: model["components"][0].update(id=True), lambda model: model["components"][0].update(type=True),
        lambda model: model["components"][1]["attributes"][0].update(id=7), lambda model: model.update(components=3),
        lambda model: model["components"][1]["attributes"][0].update(unit=["mm"]), lambda model: model.clear(),
        lambda model: model["relations"][0]["refs"][0].update(id=math.nan), lambda model: model.update(relations="abc"),
        lambda model: model["relations"][0]["refs"][0].update(role=None),
        lambda model: model["load_spectrum"].update(load_cases=[None]),
    ],
)  # fmt: skip
def test_json_with_values_of_other_types_is_refused_in_one_line(tmp_path, change):
    document = as_json()
    change(document["model"])
    (tmp_path / "box.rexsj").write_text(json.dumps(document))
    refused_as_no_rexs(tmp_path / "box.rexsj")


def planetary(planets, load=900.0, **data):
    """A sun on a shaft with its planets, each on one of its own: teeth of planets by their numbers from 11 on."""

    gears = [part(1, "cylindrical_gear", number_of_teeth=20.0)]
    gears += [part(11 + i, "cylindrical_gear", number_of_teeth=float(z)) for i, z in enumerate(planets)]
    parts = [*gears, part(5, "external_load", torque_around_u_axis=load)]
    relations = [("assembly", {"assembly": 101, "part": 5})]
    for gear in gears:
        parts.append(part(100 + gear.number, "shaft"))
        relations.append(("assembly", {"assembly": 100 + gear.number, "part": gear.number}))
    for i in range(len(planets)):
        parts.append(part(51 + i, "cylindrical_stage"))
        relations.append(("stage", {"stage": 51 + i, "gear_1": 1, "gear_2": 11 + i}))
    if data:
        parts.append(part(90, "cylindrical_stage_gear_data", **data))
        relations.append(("stage_gear_data", {"stage": 51, "gear": 1, "stage_gear_data": 90}))
    return made(parts, *relations)


def test_meshes_of_one_shaft_share_its_torque_and_the_case_says_so():
    for planets in ([31], [31, 31, 31]):
        found = find_stage(planetary(planets), 51, "made")
        assert found.torques_Nm == (900.0 / len(planets),)
        assert bool(found.notes) == (len(planets) > 1)
    assert "shaft 101 drives 3 meshes: each takes 1/3 of its torque" in found.notes


def test_torque_that_divides_between_unlike_meshes_is_unknown():
    found = find_stage(planetary([31, 40]), 51, "made")
    assert found.torques_Nm == ()
    assert found.notes == (
        "shaft 101 drives 2 meshes: how its torque divides is not said: write that of this stage into [load] torque_Nm",
    )


def test_torque_of_a_gear_in_its_stage_goes_before_that_of_its_shaft():
    assert find_stage(planetary([31, 31], torque=450.5), 51, "made").torques_Nm == (450.5,)


@pytest.mark.parametrize("attribute", ["normal_module", "normal_pressure_angle", "helix_angle_reference_diameter"])
def test_gears_that_are_no_pair_are_refused(tmp_path, attribute):
    text = GEARBOX.read_text()
    of_wheel = text.index('<component id="11"' if "normal_pressure" in attribute else '<component id="6"')
    place = text.index(">", text.index(attribute, of_wheel)) + 1
    (tmp_path / "a.rexs").write_text(f"{text[:place]}7.5{text[text.index('<', place) :]}")
    with pytest.raises(CaseError, match=f"{attribute}: 7.5 of .* where its mate asks for .*: no pair"):
        read_stage(tmp_path / "a.rexs")


def test_what_no_part_of_a_case_stands_for_is_named(tmp_path):
    more = '<attribute id="grinding_allowance" unit="mm">0.1</attribute>\n      <attribute id="normal_pressure_angle"'
    notes = read_stage(changed(tmp_path, ('<attribute id="normal_pressure_angle"', more))).notes
    assert "cylindrical_gear_flank 9 (left): not read: grinding_allowance" in notes


def test_a_stage_that_is_not_there_is_refused_with_those_that_are():
    with pytest.raises(CaseError, match=r"stage 7: there is no such stage .* choose from 4 \(23/37 teeth\)"):
        read_stage(GEARBOX, 7)


def test_a_slope_of_the_helix_turns_with_the_datum_face_and_the_flank_that_carries(tmp_path):
    slope = '<component id="17" type="helix_slope" name="">\n<attribute id="helix_slope" unit="mm">0.01</attribute>'
    text = GEARBOX.read_text()
    start = text.index('<component id="17"')
    crowning = text[start : text.index("</component>", start)]
    found = []
    for flank, face in (("left", "positive"), ("left", "negative"), ("right", "positive")):
        path = changed(
            tmp_path, (crowning, slope), ('unit="none">left', f'unit="none">{flank}'), ("positive", face),
            *([('role="left" hint', 'role="x" hint'), ('role="right" hint', 'role="left" hint'),
               ('role="x" hint', 'role="right" hint')] if flank == "right" else []),
        )  # fmt: skip
        found.append(read_stage(path).case.pinion_modification.helix_slope_um)
    # Removed at the non-datum face. The carrying flank is the left one seen from the larger z: the datum face is there
    # where the file calls it the left one, wherever it looks.
    assert found == [-10.0, -10.0, 10.0]


CASES = [
    {},
    {"helix_angle_deg": 12.0, "wheel": {"teeth": 33, "bore_radius_mm": 25.0, "profile_shift": -0.1, "addendum": 0.9,
     "dedendum": 1.3, "rack_tip_radius": 0.25, "face_width_mm": 18.0, "face_offset_mm": 2.0,
     "youngs_modulus_GPa": 110.0, "poisson_ratio": 0.28, "tip_chamfer_mm": 0.2}},
    {"centre_distance_mm": 84.1, "pinion": {"teeth": 21, "bore_radius_mm": 20.0, "tip_rounding_mm": 0.3,
     "tooth_thickness_allowance_um": [-110.0, -70.0]}, "wheel": {"teeth": 21, "bore_radius_mm": 20.0}},
    {"pinion.modification": Modification(
        tip_relief_um=20.0, tip_relief_start_roll_deg=25.0, root_relief_um=8.0, root_relief_end_roll_deg=15.0,
        root_relief_shape="parabolic", profile_crowning_um=3.0, profile_slope_um=-2.0, helix_crowning_um=5.0,
        end_relief_um=4.0, end_relief_length_mm=3.0),
     "wheel.modification": Modification(helix_slope_um=6.0, twist_um=-3.0,
                                        pitch_deviations_um=tuple(float(i % 3) for i in range(21))), "whole": True},
    {"wheel.modification": Modification(topography=Topography(
        (4.0, 20.0, 37.0), (-10.0, 0.0, 10.0), ((0.0, 1.0, 2.0), (3.0, 0.5, 1.0), (9.0, 8.0, 7.0)))), "whole": True},
    {"scheme": "line", "pinion": {"teeth": 21, "bore_radius_mm": 20.0, "blank": {
        "rim_thickness_mm": 6.0, "web_thickness_mm": 5.0, "web_offset_mm": -2.0, "hub_radius_mm": 24.0,
        "holes": {"count": 6, "radius_mm": 2.0, "on_radius_mm": 27.5, "length_deg": 20.0, "first_deg": 5.0}}},
     "wheel": {"teeth": 31, "bore_radius_mm": 20.0, "blank": {
         "rim_thickness_mm": 7.0, "web_thickness_mm": 4.0, "hub_radius_mm": 25.0, "hub_width_mm": 18.0,
         "held_length_mm": 9.0, "held_offset_mm": -1.5}}},
    {"scheme": "line", "pinion": {"teeth": 21, "bore_radius_mm": 20.0, "blank": {
        "rim_thickness_mm": 6.0, "hub_radius_mm": 24.0,
        "web_profile": [[24.0, -5.0, 4.0], [27.0, -5.0, 4.0], [27.0, -3.0, 3.5], [30.0, -1.0, 2.0]]}}},
    {"load": {"speed_rpm": 1500.0}, "online": {"torques_Nm": [40.0, 100.0]}, "whole": True,
     "misalignment": {"in_plane_um": 5.0, "out_of_plane_um": -12.0, "centre_distance_um": 30.0},
     "pinion.modification": Modification(tip_relief_um=20.0, tip_relief_start_roll_deg=25.0, helix_crowning_um=4.0),
     "pinion.coast_modification": {"tip_relief_um": 0.0, "helix_crowning_um": 9.0},
     "wheel.coast_modification": {"helix_slope_um": 6.0}},
    {"load": {"torque_Nm": -100.0, "speed_rpm": 1500.0}, "online": {"torques_Nm": [-100.0, -40.0]}, "whole": True,
     "scheme": "line", "helix_angle_deg": 12.0, "misalignment": {"in_plane_um": 5.0, "out_of_plane_um": -12.0},
     "pinion": {"teeth": 21, "bore_radius_mm": 20.0, "face_offset_mm": 2.0, "blank": {
         "rim_thickness_mm": 6.0, "web_thickness_mm": 5.0, "web_offset_mm": -2.0, "hub_radius_mm": 24.0,
         "holes": {"count": 6, "radius_mm": 2.0, "on_radius_mm": 27.5, "first_deg": 5.0}}},
     "pinion.modification": Modification(tip_relief_um=20.0, tip_relief_start_roll_deg=25.0),
     "pinion.coast_modification": {"tip_relief_um": 0.0, "helix_slope_um": 9.0,
                                   "pitch_deviations_um": [float(i % 4) for i in range(21)]}},
]  # fmt: skip


@pytest.mark.parametrize(
    "settings", CASES,
    ids=["plain", "helical", "distance", "modified", "topography", "blanks", "profile", "both flanks", "coast"],
)  # fmt: skip
def test_a_case_that_goes_out_and_comes_in_is_the_same(tmp_path, settings):
    settings = dict(settings)
    if settings.pop("whole", False):
        settings["mesh"] = {"width": "whole"}
    for gear in ("pinion", "wheel"):
        if (one := settings.get(f"{gear}.modification")) is not None:
            plain = vars(Modification())
            settings[f"{gear}.modification"] = {k: v for k, v in vars(one).items() if v != plain[k]}
    settings.setdefault("pinion", {"teeth": 21, "bore_radius_mm": 20.0})
    settings.setdefault("load", {}).setdefault("torque_Nm", 100.0)
    case = make_case("out", module_mm=4.0, face_width_mm=20.0, **settings)
    first = rexs_text(case, gear_pair(case), None, DATE)
    (tmp_path / "out.rexs").write_bytes(first)
    again = read_stage(tmp_path / "out.rexs").case
    assert again.flank == case.flank == ("coast" if settings["load"]["torque_Nm"] < 0.0 else "drive")
    second = rexs_text(replace(again, title=case.title), gear_pair(again), None, DATE)
    assert numbers_and_words(second) == numbers_and_words(first)
    assert (again.torque_Nm, again.speed_rpm, again.misalignment) == (case.torque_Nm, case.speed_rpm, case.misalignment)
    assert again.online.torques_Nm == case.online.torques_Nm
    for one, other in zip(again.other_flanks, case.other_flanks, strict=True):
        assert as_numbers(one) == pytest.approx(as_numbers(other), abs=1e-9)
    one, other = gear_pair(again), gear_pair(case)
    assert (one.pinion, one.wheel) == (other.pinion, other.wheel)
    np.testing.assert_allclose(one.centre_distance, other.centre_distance, rtol=1e-12)
    assert again.pair.pinion.tip_rounding_mm == case.pair.pinion.tip_rounding_mm
    assert again.pair.pinion.tooth_thickness_allowance_um == case.pair.pinion.tooth_thickness_allowance_um
    assert again.pair.wheel.tip_chamfer_mm == case.pair.wheel.tip_chamfer_mm
    # The middle of the common face is z = 0 of what comes in.
    shift = np.mean(other.common_face)
    np.testing.assert_allclose(np.array(one.faces) + shift, other.faces, atol=1e-9)
    for gear in ("pinion", "wheel"):
        told, meant = getattr(again, f"{gear}_modification"), getattr(case, f"{gear}_modification")
        assert as_numbers(told) == pytest.approx(as_numbers(meant), abs=1e-9)
        assert told.root_relief_shape == meant.root_relief_shape
    for gear in ("pinion", "wheel"):
        for key in ("bore_radius_mm", "youngs_modulus_GPa", "poisson_ratio", "blank"):
            assert getattr(getattr(again.pair, gear), key) == getattr(getattr(case.pair, gear), key)


def as_numbers(modification):
    """All numbers of a modification, one after the other."""
    numbers = [v for v in vars(modification).values() if isinstance(v, float)] + list(modification.pitch_deviations_um)
    if modification.topography is not None:
        grid = modification.topography
        numbers += [*grid.roll_deg, *grid.z_mm, *(a for row in grid.amount_um for a in row)]
    return numbers


def housing_file(tmp_path, matrix, points=(10.0, 70.0)):
    """A casing with a matrix of its reduction points at some places along x, and two bearings."""
    document = Document()
    casing = document.add("gear_casing")
    group = document.refer(casing, "assembly_group", reduced_static_stiffness_matrix=matrix)
    for x in points:
        document.add_to(group, "reduction_point", "", "ordered_assembly", support_vector=[x, 0.0, 0.0])
    for x in (10.0, 70.0):
        document.add("concept_bearing", support_vector=[x, 0.0, 0.0])
    root = ElementTree.fromstring(document.text(DATE))
    relations = root.find("relations")
    relations[:] = reversed(relations)  # their order counts, not their places
    (tmp_path / "housing.rexs").write_bytes(ElementTree.tostring(root))
    gearbox = read_rexs(tmp_path / "housing.rexs")
    notes = []
    return read_housing_matrix(gearbox, gearbox.of_kind("concept_bearing"), notes.append), notes


def stiff(points, seed=0):
    random = np.random.default_rng(seed).normal(size=(6 * points, 6 * points))
    return 1e5 * (random @ random.T + np.eye(6 * points))


def test_a_housing_is_read_in_the_order_of_its_bearings(tmp_path):
    matrix = stiff(2)
    found, notes = housing_file(tmp_path, matrix)
    np.testing.assert_allclose(found, matrix)
    assert ["units of reduced_static_stiffness_matrix are not said" in note for note in notes] == [True]
    turned, _ = housing_file(tmp_path, matrix, points=(70.0, 10.0))
    order = [*range(6, 12), *range(6)]
    np.testing.assert_allclose(turned, matrix[np.ix_(order, order)])


def test_points_of_a_housing_without_a_bearing_are_free(tmp_path):
    """As many degrees of freedom: the compliance between the seats is that of the whole."""
    matrix = stiff(3)
    found, notes = housing_file(tmp_path, matrix, points=(10.0, 500.0, 70.0))
    seats = [*range(6), *range(12, 18)]
    np.testing.assert_allclose(np.linalg.inv(found), np.linalg.inv(matrix)[np.ix_(seats, seats)], rtol=1e-9)
    assert "1 reduction points without a bearing" in notes[1]


def test_a_housing_without_all_seats_is_rigid_and_said_so(tmp_path):
    found, notes = housing_file(tmp_path, stiff(1), points=(10.0,))
    assert found is None
    assert "no reduction_point for concept_bearing 5: left out, the housing is rigid" in notes[1]


@pytest.mark.parametrize(
    ("matrix", "words"),
    [
        (np.eye(11), "has 121 numbers, and must have 12 x 12"),
        (np.triu(np.ones((12, 12))), "must be symmetric"),
        (np.ones((12, 12)), "must be positive definite"),
    ],
)
def test_a_housing_that_cannot_be_is_refused(matrix, words, tmp_path):
    with pytest.raises(CaseError, match=words):
        housing_file(tmp_path, matrix)


def test_a_housing_that_moves_away_at_its_feet_is_refused(tmp_path):
    matrix = stiff(3)
    matrix[:, 6:12] = matrix[6:12] = 0.0
    with pytest.raises(CaseError, match="hold the housing at its feet"):
        housing_file(tmp_path, matrix, points=(10.0, 500.0, 70.0))
