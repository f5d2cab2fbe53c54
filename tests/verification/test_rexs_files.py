"""Public gearboxes become the pairs of their drawings, and what goes out is what the standard's schema allows.

Both lie beside the project, `../shared/rexs`, with the standard's own files (Apache-2.0); nothing of them is copied.
"""

import math
import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import pmor
from pmor.case import make_case
from pmor.core.errors import CaseError, ConvergenceError
from pmor.gear.modification import Modification
from pmor.pair.model import gear_pair
from pmor.rexs import results as rexs_results
from pmor.rexs.files import load_gearbox as load
from pmor.rexs.read import read_stage
from pmor.rexs.results import stage_results
from pmor.rexs.write import rexs_text
from pmor.rexs.write_gearbox import gearbox_rexs
from pmor.rexs.write_set import set_rexs
from pmor.sets.loader import parse_set
from pmor.sets.run import solved
from pmor.storage.gear_store import not_kept
from tests.support.gearboxes import SMALL, written
from tests.support.small_case import case_with
from tests.support.small_sets import MODIFIED_SET

SHARED = Path(__file__).parents[2].parent / "shared" / "rexs"
FVA, SEW = SHARED / "FVA-Industriegetriebe_2stufig_1-4.rexs", SHARED / "SEW_3-stage_cylindrical_gearbox_1.0.rexs"
DATE = "2026-01-01T00:00:00+00:00"
EVERY_LOAD = """name = "drive"
speed_rpm = 1000.0
hours = 250.0
moments = [{ shaft = "output", at_mm = 80.0, y_Nm = 2.0, z_Nm = -3.0 }]
forces = [{ shaft = "output", at_mm = 80.0, x_N = 10.0, y_N = 200.0, z_N = -100.0 }]"""
beside = pytest.mark.skipif(not SHARED.is_dir(), reason="no public gearboxes in ../shared/rexs")


@beside
@pytest.mark.parametrize(
    ("path", "stage", "teeth", "module", "helix", "shifts", "widths", "distance", "torque", "ratios"),
    [
        (FVA, 19, (27, 51), 4.5, 21.0, (0.231415, 0.231415), (50, 50), 190.0, 789.0, (1.4705, 1.2675)),
        (FVA, 20, (23, 34), 6.5, -10.0, (0.15074, 0.15074), (74, 74), 190.0, 789.0 * 51 / 27, (1.5376, 0.6293)),
        (SEW, 6, (23, 67), 1.0, 30.0, (0.581, 0.5131), (16, 11), 53.0, 4.724562306, None),
        (SEW, 37, (13, 76), 1.25, -10.0, (0.521, -0.094), (23, 15), 57.0, 4.724562306 * 67 / 23, None),
        (SEW, 55, (14, 87), 1.5, 10.0, (0.536, -0.4815), (41, 36), 77.0, 4.724562306 * 67 / 23 * 76 / 13, None),
    ],
)  # fmt: skip
def test_each_stage_of_a_public_gearbox_is_the_pair_of_its_drawing(
    path, stage, teeth, module, helix, shifts, widths, distance, torque, ratios
):
    found = read_stage(path, stage)
    case, pair = found.case, gear_pair(found.case)
    gears = case.pair.pinion, case.pair.wheel
    assert tuple(gear.teeth for gear in gears) == teeth
    assert (case.pair.module_mm, case.pair.helix_angle_deg, case.pair.pressure_angle_deg) == (module, helix, 20.0)
    np.testing.assert_allclose([gear.profile_shift for gear in gears], shifts, rtol=1e-9)
    np.testing.assert_allclose([high - low for low, high in pair.faces], widths, rtol=1e-9)
    np.testing.assert_allclose(pair.centre_distance, distance, rtol=1e-9)
    np.testing.assert_allclose(case.torque_Nm, torque, rtol=1e-9)
    if ratios:  # given to four digits
        np.testing.assert_allclose((pair.contact_ratio, pair.overlap_ratio), ratios, atol=6e-5)
    assert all(note in case.text for note in found.notes)


@beside
def test_one_of_several_stages_has_to_be_chosen():
    with pytest.raises(CaseError, match=r"several stages: pass stage=N: 6 \(23/67 teeth\), 37"):
        read_stage(SEW)


def modified_case():
    return make_case(
        "out", module_mm=4.0, face_width_mm=20.0, torque_Nm=100.0, helix_angle_deg=12.0, mesh={"width": "whole"},
        pinion={"teeth": 21, "bore_radius_mm": 20.0, "tip_rounding_mm": 0.1},
        wheel={"teeth": 33, "bore_radius_mm": 30.0, "tip_chamfer_mm": 0.2},
        **{"pinion.modification": all_of_it(), "wheel.modification": {"topography": {
            "roll_deg": [4.0, 40.0], "z_mm": [-10.0, 10.0], "amount_um": [[0.0, 1.0], [2.0, 3.0]]}}},
    )  # fmt: skip


def all_of_it():
    keys = vars(Modification(
        tip_relief_um=20.0, tip_relief_start_roll_deg=25.0, root_relief_um=8.0, root_relief_end_roll_deg=18.0,
        profile_crowning_um=3.0, profile_slope_um=-2.0, helix_crowning_um=5.0, helix_slope_um=1.0, end_relief_um=4.0,
        end_relief_length_mm=3.0, twist_um=2.0, pitch_deviations_um=(1.0,) * 21,
    ))  # fmt: skip
    return {key: value for key, value in keys.items() if value is not None}


@cache
def small_results():
    case = case_with(
        mesh={"profile_elements": 5, "width_elements": 2}, contact={"scheme": "line"},
        reduction={"shapes": "line_loads"}, online={"angles_per_pitch": 16},
    )  # fmt: skip
    reduced = pmor.train(case).reduced
    return reduced, stage_results(reduced)


@cache
def solved_box(folder):
    """The small gearbox on a housing of its own, with all kinds of bearings and loads, solved."""
    (folder / "seats.csv").write_text("\n".join(",".join(map(str, row)) for row in (1e7 * np.eye(24)).tolist()))
    text = SMALL.replace('name = "drive"', EVERY_LOAD)
    found = pmor.run(written(folder, f'{text}[housing]\nstiffness = "seats.csv"\n'))
    return found, gearbox_rexs(found.file, found.loads, found.data["loads"], DATE)


@pytest.fixture(scope="module")
def box(tmp_path_factory):
    return solved_box(tmp_path_factory.mktemp("box"))


@pytest.fixture(scope="module")
def planets():
    """A helical set on pins, with modified flanks of both sides and pins off their places, solved; and its text."""
    found = solved(parse_set(MODIFIED_SET, "planets", "planets"), not_kept)
    return found, set_rexs(found.file, found.solution, DATE)


def documents():
    case = modified_case()
    yield rexs_text(case, gear_pair(case), None, DATE)
    reduced, results = small_results()
    yield rexs_text(reduced.basis.case, reduced.meshed.pair, results, DATE)


@beside
def test_what_goes_out_has_the_form_of_a_rexs_file(box, planets):
    xmlschema = pytest.importorskip("xmlschema", reason="the form of REXS files is checked by xmlschema")
    schema = xmlschema.XMLSchema(str(SHARED / "rexs-file.xsd"))
    for text in (*documents(), box[1], planets[1]):
        schema.validate(ElementTree.fromstring(text))


@beside
def test_what_goes_out_says_only_what_the_schema_knows_in_its_units(box, planets):
    root = ElementTree.parse(SHARED / "rexs_schema_2.0.0.xml").getroot()
    units = {unit.get("id"): unit.get("name") for unit in root.find("units")}
    attributes = {a.get("numericId"): a for a in root.find("attributes")}
    known = {
        (m.get("componentId"), m.get("attributeId")): units[attributes[m.get("attributeNumericId")].get("unit")]
        for m in root.find("componentAttributeMappings")
    }
    words = {a.get("attributeId"): {v.get("value") for v in a.find("enumValues")} for a in attributes.values()}
    combinations = {
        (relation.get("relationId"), frozenset((role.get("roleId"), role.get("componentId")) for role in one))
        for relation in root.find("relations") for one in relation.find("allowedCombinations")
    }  # fmt: skip
    for text in (*documents(), box[1], planets[1]):
        model = ElementTree.fromstring(text)
        assert model.get("version") == root.get("version")
        kinds = {c.get("id"): c.get("type") for c in model.find("components")}
        for component in model.iter("component"):
            assert component.get("type") == kinds[component.get("id")]
            for attribute in component:
                name = attribute.get("id")
                if not name.startswith("custom_"):
                    assert attribute.get("unit") == known[component.get("type"), name], (component.get("type"), name)
                    assert not words[name] or attribute.text in words[name], (name, attribute.text)
        for relation in model.find("relations"):
            said = frozenset((ref.get("role"), kinds[ref.get("id")]) for ref in relation)
            assert (relation.get("type"), said) in combinations, (relation.get("type"), said)


def test_results_in_a_rexs_file_are_those_of_the_sweep():
    reduced, results = small_results()
    pair = reduced.meshed.pair
    force = 1e3 * results.torque_Nm / pair.pinion.base_radius
    # Under a held torque the line loads carry the force at every angle, and so does their mean. Where a tip corner
    # carries, its lever is a little shorter than the base radius: by 3e-4 here, over the cycle.
    mean = results.load_N_per_mm.max() / results.face_load_factor
    np.testing.assert_allclose(mean * pair.common_width, force, rtol=5e-4)
    np.testing.assert_allclose(results.z_mm[[0, -1]], [0.0, pair.common_width], atol=1e-12)
    np.testing.assert_allclose(results.stiffness_N_per_mm * 1e-3 * results.ste_um, force, rtol=1e-12)
    assert 1.0 <= results.face_load_factor < 1.2
    # Hertz, by the half-width: w = pi b p / 2, b = 2 w / (pi p), b^2 = 4 w rho (1/E1' + 1/E2') / pi.
    radii = results.roll_rad * pair.pinion.base_radius
    rho = 1.0 / (1.0 / radii[:, 0] + 1.0 / radii[:, 1])
    half = np.sqrt(4.0 * results.point_load_N_per_mm * rho * 2.0 * (1.0 - 0.3**2) / 210e3 / math.pi)
    np.testing.assert_allclose(results.pressure_MPa, 2.0 * results.point_load_N_per_mm / (math.pi * half), rtol=1e-12)


def test_a_position_without_equilibrium_leaves_no_results(monkeypatch):
    reduced, _ = small_results()
    swept = rexs_results.sweep_reduced_pair

    def failed(*args, **keywords):
        sweep = swept(*args, **keywords)
        sweep.converged[0, 3] = False
        return sweep

    monkeypatch.setattr(rexs_results, "sweep_reduced_pair", failed)
    with pytest.raises(ConvergenceError, match="1 of 16 positions under 100 N m have no equilibrium"):
        stage_results(reduced)


def attributes(text, kind, name="", case=None):
    """Attributes of components of a kind and name, by name of the attribute: text, or numbers."""
    model = ElementTree.fromstring(text)
    numbers = {c.get("id"): c.get("name", "") for c in model.find("components") if c.get("type") == kind}
    place = model.find("components") if case is None else model.findall("load_spectrum/load_case")[case]
    (found,) = [c for c in place if c.get("type") == kind and numbers[c.get("id")] == name]
    cells = {a.get("id"): [cell.text for cell in a.iter("c")] or a.text for a in found}
    return {key: np.array(v, dtype=float) if isinstance(v, list) else v for key, v in cells.items()}


def test_a_gearbox_in_rexs_reads_back_as_itself(box, tmp_path):
    """Shafts, bearings by stiffness and inner geometry, housing, lubricant, loads and the pair, with their names."""
    found, text = box
    (tmp_path / "box.rexs").write_bytes(text)
    back = load(tmp_path / "box.rexs")
    said, read = found.file.model.sections, back.model.sections
    # Its axes leave 0.06 mm of backlash, which is said.
    known = "units of reduced_static_stiffness_matrix", "0.0591 mm of it"
    assert [note for note in back.notes if not any(words in note for words in known)] == []
    assert (read.shafts, read.lubricant, read.loads[0].name) == (said.shafts, said.lubricant, said.loads[0].name)
    by_name = {bearing.name.split(" [")[0]: bearing for bearing in read.bearings}
    for bearing in said.bearings:
        other = by_name[bearing.name]
        assert replace(other, name=bearing.name, shaft=bearing.shaft, to=bearing.to) == bearing
    order = [6 * [b.name for b in said.bearings].index(name) + i for name in by_name for i in range(6)]
    np.testing.assert_allclose(back.model.housing, found.file.model.housing[np.ix_(order, order)])
    (one,), (other,) = said.loads, read.loads
    assert (other.speed_rpm, other.hours) == (one.speed_rpm, one.hours)
    for kind in ("torques", "forces", "moments"):
        for a, b in zip(getattr(one, kind), getattr(other, kind), strict=True):
            assert replace(b, shaft=a.shaft) == a
    (case,) = back.cases.values()
    assert case.pair == found.file.cases["mesh"].pair


def test_results_of_a_gearbox_in_rexs_are_those_of_gearbox_json(box):
    found, text = box
    entry = found.data["loads"][0]
    mesh, shaft, bearing = entry["meshes"][0], entry["shafts"][1], entry["bearings"][2]
    on_shaft = attributes(text, "shaft", "output", 0)
    np.testing.assert_allclose(on_shaft["u_coordinates_of_beam_nodes"], shaft["at_mm"])
    np.testing.assert_allclose(on_shaft["displacement_v_of_nodes"], np.array(shaft["displacement_um"])[:, 1])
    on_bearing = attributes(text, "rolling_bearing_with_detailed_geometry", "C", 0)
    force = [float(on_bearing[f"force_acting_on_inner_component_{way}"]) for way in "uvw"]
    np.testing.assert_allclose(force, -np.array(bearing["force_N"]))
    assert float(on_bearing["radial_deflection_in_v"]) == bearing["displacement_um"][1]
    inner, outer = (float(on_bearing[f"displacement_{side}_side_v"]) for side in ("inner", "outer"))
    np.testing.assert_allclose(inner - outer, bearing["displacement_um"][1], rtol=1e-9)
    at = shaft["at_mm"].index(10.0)
    np.testing.assert_allclose(inner, shaft["displacement_um"][at][1])
    assert float(on_bearing["maximum_hertzian_pressure"]) == bearing["contact_pressure_max_MPa"]
    # On the housing of 1e7 N/mm.
    np.testing.assert_allclose(outer, 1e3 * bearing["force_N"][1] / 1e7, rtol=1e-6)
    stage = attributes(text, "cylindrical_stage", "mesh", 0)
    assert float(stage["face_load_factor_contact_stress"]) == mesh["k_h_beta"]
    assert float(stage["custom_pmor_f_beta"]) == mesh["f_beta_um"]
    place, load_there = stage["load_distribution_node_positions"], stage["load_distribution_along_face_width"]
    assert (np.diff(place) > 0.0).all()
    np.testing.assert_allclose(place[0] + place[-1], 16.0, atol=1e-9)
    # The largest over the mean of the line load; tip corners carry a little at shorter levers.
    np.testing.assert_allclose(load_there.max() * 16.0 / mesh["force_N"], mesh["k_h_beta"], rtol=2e-3)
    gear = attributes(text, "cylindrical_gear", "mesh, pinion", 0)
    tangential = 60e3 / found.file.model.pairs["mesh"].pinion.base_radius
    across = np.hypot(float(gear["force_acting_on_shaft_v"]), float(gear["force_acting_on_shaft_w"]))
    np.testing.assert_allclose(across, tangential, rtol=1e-3)
    np.testing.assert_allclose(float(gear["torque_acting_on_shaft_u"]), -60.0, rtol=1e-3)


def test_results_of_a_set_in_rexs_are_those_of_the_set(planets):
    found, text = planets
    stage = attributes(text, "planetary_stage", "small set", 1)
    np.testing.assert_allclose(stage["custom_pmor_transmission_error"], found.ste_um[1], rtol=1e-14)
    mesh = attributes(text, "cylindrical_stage", "planet 2 - ring", 1)
    entry = found.data["meshes"][3]
    assert entry["name"] == "planet 2 - ring"
    assert float(mesh["face_load_factor_contact_stress"]) == entry["k_h_beta"]
    place, load_there = mesh["load_distribution_node_positions"], mesh["load_distribution_along_face_width"]
    assert (np.diff(place) > 0.0).all()
    np.testing.assert_allclose(place[0] + place[-1], 20.0, atol=1e-9)
    # By few sections over the face.
    np.testing.assert_allclose(load_there.mean() * 20.0, entry["force_mean_N"], rtol=0.1)
    # Axial forces of all gears are in balance, and the sun's torque is that of the load.
    gears = [attributes(text, kind, name, 1) for kind, name in (
        ("cylindrical_gear", "sun"), ("ring_gear", "ring"), *(("cylindrical_gear", f"planet {n}") for n in (1, 2, 3))
    )]  # fmt: skip
    axial = [float(gear["force_acting_on_shaft_u"]) for gear in gears]
    assert abs(sum(axial)) < 1e-9 * abs(axial[0])
    assert float(gears[0]["torque_acting_on_shaft_u"]) == pytest.approx(-300.0, rel=1e-6)
    torques = [attributes(text, "external_load", "Torque", case)["torque_around_u_axis"] for case in (0, 1)]
    assert list(map(float, torques)) == [100.0, 300.0]
