"""Gearboxes in REXS as other programs write them: joints, axes, bearings and torques say another way what ours say."""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.app.export import export_file
from pmor.body.bearing_estimate import CatalogueBearing
from pmor.body.roller_bearing import RollerBearing
from pmor.body.rolling_bearing import BallBearing
from pmor.core.errors import CaseError, OutputError
from pmor.machine.load_settings import Gravity
from pmor.machine.loaded import loaded
from pmor.machine.model import pinion_torques, speeds_rpm
from pmor.machine.readings import carried
from pmor.rexs.files import load_gearbox as load
from pmor.rexs.write_gearbox import gearbox_rexs
from pmor.rexs.write_set import set_rexs
from pmor.sets.loader import parse_set
from tests.support.gearboxes import SMALL, SMALL_CASE, written
from tests.support.rexs_file import RexsFile, numbers_and_words
from tests.support.set_gearboxes import EVEN_SET, TWO_STAGES, one_stage, written_reducer

GEARBOX = Path(__file__).parents[2] / "cases" / "gearbox.rexs"
DATE = "2026-01-01T00:00:00+00:00"
CONCEPT, DETAILED, CATALOGUE = (
    "concept_bearing", "rolling_bearing_with_detailed_geometry", "rolling_bearing_with_catalog_geometry",
)  # fmt: skip


@pytest.fixture(scope="module")
def text(tmp_path_factory):
    """The small box as a file, its input at 1,200 rpm."""
    said = SMALL.replace('name = "drive"', 'name = "drive"\nspeed_rpm = 1200.0')
    return gearbox_rexs(load(written(tmp_path_factory.mktemp("box"), said)), (), (), DATE)


@pytest.fixture
def box(text):
    return RexsFile(text)


def read(box, tmp_path):
    return load(box.write(tmp_path / "box.rexs"))


def forces(file):
    """Forces of all bearings under the first load, N, by name."""
    gearbox = loaded(file.model, file.model.sections.loads[0])
    return {one["name"]: np.array(one["force_N"]) for one in carried(gearbox, gearbox.solve())}


def in_load_case(box, kind):
    """Components of a kind in the load case."""
    return [one for one in box.root.find("load_spectrum/load_case") if one.get("type") == kind]


@pytest.mark.parametrize(("said", "name"), [
    ("mesh", "mesh"), ("Cylindrical stage [{}]", "stage_{}"), ("", "stage_{}"), ("1/2", "stage_{}"), (".x", "stage_{}"),
])  # fmt: skip
def test_a_mesh_is_called_as_its_stage_where_files_may_have_the_name(box, tmp_path, said, name):
    (stage,) = box.of_kind("cylindrical_stage")
    stage.set("name", said.format(stage.get("id")))
    assert list(read(box, tmp_path).cases) == [name.format(stage.get("id"))]


@pytest.mark.parametrize("fit", ["cylindrical_interference_fit", "feather_key_connection"])
def test_a_gear_by_a_fit_stands_where_it_stood(box, tmp_path, fit):
    before = forces(read(box, tmp_path))
    for gear in box.ids("cylindrical_gear"):
        (roles,) = box.part_from("assembly", gear)
        box.relate("side", assembly=box.add(fit), inner_part=roles["assembly"], outer_part=gear)
    after = forces(read(box, tmp_path))
    for name, force in before.items():
        assert_allclose(after[name], force, rtol=1e-9, atol=1e-9 * np.abs(force).max())


def test_power_is_the_torque_that_it_makes_at_the_speed_of_the_shaft(box, tmp_path):
    (torque,) = (one for one in in_load_case(box, "external_load") if len(one))
    box.say(torque, torque_around_u_axis=None, power=60.0 * 2.0 * math.pi * 20.0 / 1e3)
    file = read(box, tmp_path)
    assert file.model.sections.loads[0].torques[0].torque_Nm == pytest.approx(60.0)
    assert any("60 N m of 7.53982 kW at 1200 rpm" in note for note in file.notes)


def test_a_coupling_carries_the_torque_of_a_motor_shaft(box, tmp_path):
    motor = box.add("shaft", support_vector=[-40.0, 0.0, 0.0])
    section = box.add("shaft_section", u_coordinate_on_shaft=0.0, length=40.0, outer_diameter_begin=20.0,
                      outer_diameter_end=20.0)  # fmt: skip
    box.relate("assembly", assembly=motor, part=section)
    entering = box.of_kind("external_load")[0]
    box.part_from("assembly", int(entering.get("id")))
    box.relate("assembly", assembly=motor, part=entering.get("id"))
    joint = box.add("coupling", u_coordinate_on_shaft_inner_side=40.0, radial_stiffness=1e20, axial_stiffness=1e20,
                    bending_stiffness=1e20, rotational_stiffness=1e20)  # fmt: skip
    box.relate("side", assembly=joint, inner_part=motor, outer_part=box.ids("shaft")[0])
    file = read(box, tmp_path)
    (load_case,) = file.model.sections.loads
    assert pinion_torques(file.model, load_case)["mesh"] == pytest.approx(60.0)
    assert len(speeds_rpm(file.model, load_case)) == 3
    (coupled,) = (one for one in file.model.sections.bearings if one.couples)
    assert (coupled.to, coupled.torsion_Nmm_per_rad, coupled.radial_N_per_mm) == ("input", "rigid", "rigid")
    gearbox = loaded(file.model, load_case)
    (moved,) = (one for one in carried(gearbox, gearbox.solve()) if "torque_Nm" in one)
    assert abs(moved["torque_Nm"]) == pytest.approx(60.0, rel=1e-6)


@pytest.mark.parametrize(("result", "differs"), [(-91.6, False), (-180.0, True)])
def test_a_torque_that_is_a_result_is_compared_and_not_applied(box, tmp_path, result, differs):
    """60 N m x 29 / 19 = 91.58 N m hold the output."""
    held = box.of_kind("external_load")[1]
    box.say(held, defines_torque=None)
    case = in_load_case(box, "gear_unit")[0]
    parent = box.root.find("load_spectrum/load_case")
    said = case.makeelement("component", {"id": held.get("id"), "type": "external_load"})
    parent.append(said)
    box.say(said, torque_around_u_axis=-result)
    file = read(box, tmp_path)
    assert [torque.torque_Nm for torque in file.model.sections.loads[0].torques] == [60.0, "balance"]
    assert any("N m on output as a result: 91.5789 N m hold it here" in note for note in file.notes) == differs


@pytest.mark.parametrize("axes", [
    [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], [[0.6, 0.8, 0.0], [-0.8, 0.6, 0.0], [0.0, 0.0, 1.0]],
], ids=["along y", "askew"])  # fmt: skip
def test_shafts_that_lie_along_another_axis_are_the_same_machine(box, tmp_path, axes):
    before = forces(read(box, tmp_path))
    for component in box.components:
        for name in ("support_vector", "u_axis_vector", "w_axis_vector"):
            if (found := component.find(f"attribute[@id='{name}']")) is not None:
                box.say(component, **{name: (np.array(axes) @ [float(c.text) for c in found.iter("c")]).tolist()})
    file = read(box, tmp_path)
    assert any("x is there in what follows" in note for note in file.notes)
    after = forces(file)
    for name, force in before.items():
        # Across the axis the machine is turned as a whole.
        assert_allclose([after[name][0], np.hypot(*after[name][1:])], [force[0], np.hypot(*force[1:])], rtol=1e-6,
                        atol=1e-6 * np.abs(force).max())  # fmt: skip


def test_axes_that_cross_are_refused_with_the_stage_between_them(box, tmp_path):
    box.say(box.of_kind("shaft")[1], u_axis_vector=[0.0, 0.0, 1.0])
    box.add("bevel_stage")
    with pytest.raises(CaseError, match=r"not parallel to that of the first shaft.*bevel_stage \d+: bevel, hypoid"):
        read(box, tmp_path)


@pytest.mark.parametrize("kind", [
    "radial_self_aligning_roller_bearing", "four_point_contact_ball_bearing", "radial_spherical_roller_bearing",
    "axial_tapered_roller_bearing",
])  # fmt: skip
def test_bearings_of_kinds_that_are_not_solved_are_taken_by_their_stiffness_and_said(box, tmp_path, kind):
    one = box.of_kind(DETAILED)[0]
    box.say(one, bearing_type=kind, radial_stiffness=3e8)
    file = read(box, tmp_path)
    found = next(bearing for bearing in file.model.sections.bearings if bearing.name == "C")
    assert (found.ball, found.roller, found.radial_N_per_mm) == (None, None, 3e5)
    assert any(f"bearing_type {kind}: its inner geometry is not solved: by its stiffness" in n for n in file.notes)


@pytest.mark.parametrize(("kind", "rolling"), [
    ("radial_grooved_ball_bearing", "ball"), ("radial_tapered_roller_bearing", "roller"),
    ("radial_needle_roller_bearing", "needle"), ("radial_self_aligning_roller_bearing", "roller"),
])  # fmt: skip
def test_a_bearing_by_its_catalogue_number_has_the_stiffness_of_its_type_bore_and_load(box, tmp_path, kind, rolling):
    """Its bore is the diameter of its shaft; its load that of the equilibrium with this stiffness."""
    for one in box.of_kind(CONCEPT)[:2]:
        one.set("type", CATALOGUE)
        box.say(one, bearing_type=kind, radial_stiffness=None, bending_stiffness=None)
    file = read(box, tmp_path)
    by_name = {bearing.name: bearing for bearing in file.model.sections.bearings}
    for name in ("A", "B"):
        force = np.hypot(*forces(file)[name][1:])
        expected = CatalogueBearing(rolling, 20.0).radial_N_per_mm(force)
        assert by_name[name].radial_N_per_mm == pytest.approx(expected, rel=0.01)
        assert any(note.startswith(f"{name}: neither stiffness nor inner geometry") for note in file.notes)


@pytest.mark.parametrize("kind", [CATALOGUE, DETAILED])
def test_inner_geometry_goes_before_the_stiffness_that_follows_from_it_at_one_load(box, tmp_path, kind):
    before = read(box, tmp_path).model.sections.bearings
    for one in box.of_kind(DETAILED):
        one.set("type", kind)
        box.say(one, radial_stiffness=3e8)
    file = read(box, tmp_path)
    by_name = {bearing.name: bearing for bearing in file.model.sections.bearings}
    assert [by_name[bearing.name] for bearing in before] == list(before)
    assert sum("radial_stiffness is not taken" in note for note in file.notes) == 2


def test_a_bearing_of_which_nothing_is_known_is_demanded(box, tmp_path):
    one = box.of_kind(CONCEPT)[0]
    one.set("type", CATALOGUE)
    box.say(one, radial_stiffness=None)
    with pytest.raises(CaseError, match=r"catalog_geometry \d+ \(A\): neither .* nor bearing_type: write radial_stiff"):
        read(box, tmp_path)


def test_estimates_are_those_of_their_sources():
    """6210, 33016 without its taper and K50x58x25 by inner geometry, rollers without profile; rows share the load."""
    rollers = {"clearance_mm": 0.0, "logarithmic_profile": False}
    bearings = (
        (BallBearing(balls=10, ball_diameter_mm=12.7, pitch_diameter_mm=70.0), ("ball", 50.0, 90.0), 0.6, 1.3),
        (RollerBearing(rollers=24, roller_diameter_mm=11.586, effective_length_mm=26.7, pitch_diameter_mm=102.5,
                       **rollers), ("roller", 80.0, 125.0, 1, 0.0, 36.0), 0.85, 1.15),
        (RollerBearing(rollers=27, roller_diameter_mm=4.0, effective_length_mm=18.28, pitch_diameter_mm=54.0,
                       **rollers), ("needle", 50.0, 58.0, 1, 0.0, 25.0), 0.85, 1.15),
    )  # fmt: skip
    for inner, catalogue, low, high in bearings:
        moved = 0.02
        for _ in range(30):
            state = inner.state(np.array([0.0, moved, 0.0, 0.0, 0.0]))
            moved -= (state.force[1] - 9906.0) / state.stiffness[1, 1]
        assert low < CatalogueBearing(*catalogue).radial_N_per_mm(9906.0) / (9906.0 / moved) < high
    for kind in ("ball", "roller", "needle"):
        one, two = (CatalogueBearing(kind, 50.0, 90.0, rows).radial_N_per_mm(rows * 4e3) for rows in (1, 2))
        assert two == pytest.approx(2.0 * one, rel=1e-2)


def test_weights_are_those_of_the_file_in_the_axes_of_the_gear_unit(box, tmp_path):
    """Where it accounts for them: v is w x u. Densities are those of the materials."""
    unit, light = box.of_kind("gear_unit")[0], read(box, tmp_path)
    assert light.model.sections.gravity == Gravity()
    down = dict(zip((f"direction_vector_gravity_{way}" for way in "uvw"), (0.0, 2.0, 0.0), strict=True))
    box.say(unit, account_for_gravity=True, w_axis_vector=[0.0, 1.0, 0.0], **down)
    for material in box.of_kind("material"):
        box.say(material, density=7.2)
    file = read(box, tmp_path)
    assert file.model.sections.gravity == Gravity(z_m_s2=-9.80665)
    assert any("no gravitational_acceleration: 9.80665 m/s2 assumed" in note for note in file.notes)
    assert {shaft.density_kg_m3 for shaft in file.model.sections.shafts} == {7200.0}
    assert next(iter(file.cases.values())).dynamics.density_kg_m3 == 7200.0
    box.say(unit, gravitational_acceleration=9.81)
    for material in box.of_kind("material"):
        box.say(material, density=None)
    file = read(box, tmp_path)
    assert file.model.sections.gravity == Gravity(z_m_s2=-9.81)
    assert sum("no density of its material: 7810 kg/m3 assumed" in note for note in file.notes) == 2


def test_preload_places_off_the_axis_and_weights_without_a_direction_are_said(box, tmp_path):
    box.say(box.of_kind(DETAILED)[0], preload_distance=12.0, misalignment_in_v_direction=5.0)
    box.say(box.of_kind("gear_unit")[0], account_for_gravity=True)
    file = read(box, tmp_path)
    notes = file.notes
    assert any("no direction of it is said: weights are left out" in note for note in notes)
    assert any("(C): preload_distance = 0.012, misalignment_in_v_direction = 0.005: left out" in note for note in notes)


def test_a_row_by_the_older_name_of_its_diameter_is_read(box, tmp_path):
    before = read(box, tmp_path).model.sections.bearings
    for row in box.of_kind("rolling_bearing_row"):
        diameter = row.findtext("attribute[@id='reference_diameter_rolling_bearing']")
        box.say(row, reference_diameter_rolling_bearing=None, reference_diameter=diameter)
    assert read(box, tmp_path).model.sections.bearings == before


@pytest.mark.parametrize(("values", "words"), [
    ({"length": None}, "length or outer_diameter_begin is missing"),
    ({"outer_diameter_begin": None, "outer_diameter_end": None}, "length or outer_diameter_begin is missing"),
    ({"u_coordinate_on_shaft": -30.0}, "begins at -30 mm, where the one before it ends at 0 mm"),
], ids=["length", "diameter", "overlap"])  # fmt: skip
def test_sections_that_lack_a_size_are_refused(box, tmp_path, values, words):
    box.say(box.of_kind("shaft_section")[0], **values)
    with pytest.raises(CaseError, match=rf"shaft_section \d+: {words}"):
        read(box, tmp_path)


def test_a_carrier_on_two_shafts_turns_with_both_and_is_held_by_the_bearings_of_both(tmp_path):
    """The second shaft leads its torque on: the sun's 300 N m times 1 + ring / sun."""
    box = RexsFile(set_rexs(parse_set(EVEN_SET, "small", "small"), None, DATE))
    casing, (stage,) = box.ids("gear_casing")[0], box.ids("planetary_stage")
    plates = box.of_kind("side_plate")
    x = [float(next(one.find("attribute[@id='support_vector']").iter("c")).text) for one in plates]
    shafts = {one.get("name"): int(one.get("id")) for one in box.of_kind("shaft")}
    carrier, sun = shafts["Shaft of carrier"], shafts["Shaft of sun"]
    box.part_from("planet_carrier_shaft", carrier)
    box.components.remove(next(one for one in box.of_kind("shaft") if int(one.get("id")) == carrier))
    made = []
    for number, (plate, begins) in enumerate(zip(plates, (x[0] - 100.0, x[1]), strict=True)):
        shaft = box.add("shaft", support_vector=[begins, 0.0, 0.0])
        section = box.add("shaft_section", u_coordinate_on_shaft=0.0, length=100.0, outer_diameter_begin=50.0,
                          outer_diameter_end=50.0, inner_diameter_begin=40.0, inner_diameter_end=40.0)  # fmt: skip
        box.relate("assembly", assembly=shaft, part=section)
        box.relate("planet_carrier_shaft", planetary_stage=stage, shaft=shaft)
        joint = box.add("coupling", support_vector=[x[number], 0.0, 0.0], radial_stiffness=1e20, bending_stiffness=1e20)
        box.relate("side", assembly=joint, inner_part=shaft, outer_part=int(plate.get("id")))
        for place in (20.0, 80.0):
            seat = box.add("concept_bearing", u_coordinate_on_shaft_inner_side=place, radial_stiffness=1e9,
                           support_vector=[begins + place, 0.0, 0.0],
                           axial_force_absorption="both_directions", axial_stiffness=1e9)  # fmt: skip
            box.relate("side", assembly=seat, inner_part=shaft, outer_part=casing)
        made.append(shaft)
    seat = box.add("concept_bearing", u_coordinate_on_shaft_inner_side=1.0, radial_stiffness=1e9,
                   bending_stiffness=1e12, support_vector=[0.0, 0.0, 0.0],
                   axial_force_absorption="both_directions", axial_stiffness=1e9)  # fmt: skip
    box.relate("side", assembly=seat, inner_part=sun, outer_part=casing)
    out = box.add("external_load", u_coordinate_on_shaft=100.0, transmits_torque=True, defines_torque=False)
    box.relate("assembly", assembly=made[1], part=out)
    file = read(box, tmp_path)
    said = file.model.sections
    (bridge,) = (one for one in said.bearings if one.couples)
    assert bridge.name.endswith("carrier")
    assert {bridge.shaft, bridge.to} == {str(number) for number in made}
    gearbox = loaded(file.model, said.loads[0])
    found = gearbox.solve()
    places = {one.name: gearbox.first[one.name] for one in said.shafts}
    turned = [found.displacement[places[str(number)] + 3 :: 6][:3] for number in made]
    carried_on = [entry["torque_Nm"] for entry in carried(gearbox, found) if "torque_Nm" in entry]
    (one,) = file.model.sets.values()
    teeth = one.teeth
    assert abs(carried_on[0]) in (pytest.approx(0.0, abs=1e-6), pytest.approx(300.0 * (1.0 + teeth[1] / teeth[0])))
    assert all(np.isfinite(one).all() for one in turned)
    assert any("the carrier between them is rigid" in note for note in file.notes)


def test_a_gearbox_as_toml_reads_back_as_the_same_machine(text, tmp_path):
    """Shafts, bearings, loads, lubricant; the pair with the bearings that are then there to be softened."""
    source = RexsFile(text).write(tmp_path / "box.rexs")
    made = export_file(source, "gearbox", tmp_path / "made" / "again.toml")
    one, other = load(source), load(made)
    assert replace(other.model.sections, meshes=()) == replace(one.model.sections, meshes=())
    assert other.model.pairs == one.model.pairs
    assert [case.text for case in other.cases.values()] == [case.text for case in one.cases.values()]
    assert made.read_text().startswith("title") or made.read_text().startswith("#")
    with pytest.raises(OutputError, match="again.toml"):
        export_file(source, "gearbox", made)
    with pytest.raises(CaseError, match="--to gearbox takes a gearbox in REXS"):
        export_file(made, "gearbox", tmp_path / "no.toml")


def test_the_example_gearbox_is_a_gearbox():
    file = load(GEARBOX)
    assert [len(part) for part in (file.model.sections.shafts, file.model.sections.bearings, file.cases)] == [2, 4, 1]
    assert [load_case.torques[0].torque_Nm for load_case in file.model.sections.loads] == [80.0, 120.0]
    assert {name: round(abs(force[0])) for name, force in forces(file).items()} == dict.fromkeys(forces(file), 0)


@pytest.mark.parametrize("flank", ["drive", "coast"])
def test_what_is_written_again_is_the_same(tmp_path, flank):
    """Cones and balls that look both ways, a web, lubricant, weights, flanks: the second file is the first."""
    cone = "roller = { rollers = 18, roller_diameter_mm = 7.0, effective_length_mm = 11.0, pitch_diameter_mm = 50.0, "
    ball = "ball = { balls = 9, ball_diameter_mm = 9.0, pitch_diameter_mm = 44.0, "
    kinds = {
        "A": f"{cone}contact_angle_deg = 15.0, dynamic_rating_N = 4e4 }}",
        "B": f"{cone}contact_angle_deg = -12.0, clearance_mm = -0.01 }}",
        "C": f"{ball}contact_angle_deg = 25.0, dynamic_rating_N = 21500.0 }}",
        "D": f"{ball}contact_angle_deg = -25.0 }}",
    }  # fmt: skip
    text = SMALL.replace('name = "input"', 'name = "input"\ndensity_kg_m3 = 7850.0')
    for name, inner in kinds.items():
        text = re.sub(rf'(name = "{name}"\nshaft = .*\nat_mm = .*\n)[^\[]*', rf"\1{inner}\n", text)
    more = "[lubricant]\nviscosity_mPas = 35.0\nroughness_um = 0.6\nlubricant_factor = 0.8\n"
    path = written(tmp_path, f"{text}{more}[gravity]\nx_m_s2 = 2.0\nz_m_s2 = -9.81\n")
    blank = "blank = { rim_thickness_mm = 4.0, web_thickness_mm = 6.0, web_offset_mm = -1.0, hub_radius_mm = 20.0 }"
    (tmp_path / "small.toml").write_text(
        SMALL_CASE.replace("torque_Nm = ", "torque_Nm = -" if flank == "coast" else "torque_Nm = ")
        .replace("bore_radius_mm = 14.0", f"bore_radius_mm = 14.0\n{blank}")
        + "[dynamics]\ndensity_kg_m3 = 7200.0\n[misalignment]\nout_of_plane_um = 15.0\n"
        "[pinion.modification]\nhelix_crowning_um = 5.0\n[pinion.coast_modification]\nhelix_crowning_um = 9.0\n"
    )
    one = load(path)
    first = gearbox_rexs(one, (), (), DATE)
    (tmp_path / "box.rexs").write_bytes(first)
    two = load(tmp_path / "box.rexs")
    ours, theirs = one.model.sections, two.model.sections
    for name in ("lubricant", "gravity", "shafts"):
        assert getattr(theirs, name) == getattr(ours, name), name
    assert {bearing.name: bearing.inner for bearing in theirs.bearings} == {
        bearing.name: bearing.inner for bearing in ours.bearings
    }
    assert all(bearing.inner is not None for bearing in ours.bearings)
    assert two.model.masses_kg["mesh"] == pytest.approx(one.model.masses_kg["mesh"], rel=1e-12)
    (a,), (b,) = one.cases.values(), two.cases.values()
    assert (a.flank, b.pair, b.misalignment) == (flank, a.pair, a.misalignment)
    assert (b.flank, b.pinion_modification, b.other_flanks) == (flank, a.pinion_modification, a.other_flanks)
    assert {a.pinion_modification.helix_crowning_um, a.other_flanks[0].helix_crowning_um} == {5.0, 9.0}
    assert numbers_and_words(gearbox_rexs(two, (), (), DATE)) == numbers_and_words(first)


OFF_PLACE = EVEN_SET.replace("count = 3", "count = 3\ntangential_um = [10.0, 3.0, -1.0]").replace(
    "[mesh]", "[pins]\ndiameter_mm = 30.0\nlength_mm = 36.0\nbearings = [{at_mm = 2.0, tilt_Nmm_per_rad = 1e9}]\n[mesh]"
)  # fmt: skip
STEPPED = EVEN_SET.replace("[planet]\nteeth = 18", "[planet]\nteeth = 24").replace("teeth = 54", "teeth = 57").replace(
    "[ring]", "[second_planet]\nteeth = 15\nbore_radius_mm = 15.0\n[ring]"
).replace("count = 3", "count = 3\ntiming_mrad = [0.1, 0.0, 0.0]")
STAR = one_stage(torque=-300.0).replace("carrier = {", 'carrier = "housing"\nring = {')


@pytest.mark.parametrize(("text", "of_set"), [
    pytest.param(TWO_STAGES, EVEN_SET, marks=pytest.mark.slow), (one_stage(torque=-300.0), OFF_PLACE),
    pytest.param(STAR, OFF_PLACE.replace("[load]", '[load]\nheld = "carrier"'), marks=pytest.mark.slow),
    (one_stage(torque=-300.0), STEPPED),
], ids=["with a pair", "from the other end", "star", "stepped"])  # fmt: skip
def test_sets_on_shafts_go_out_and_come_back_as_they_are(text, of_set, tmp_path):
    """Members on their shafts, planets on their pins, errors of these: the second file is the first."""
    one = load(written_reducer(tmp_path, text, of_set))
    first = gearbox_rexs(one, (), (), DATE)
    (tmp_path / one.name).with_suffix(".rexs").write_bytes(first)
    two = load((tmp_path / one.name).with_suffix(".rexs"))
    assert two.model.sets["stage"].sections.load.held == one.model.sets["stage"].sections.load.held
    assert [planetary.members for planetary in two.model.sections.sets] == [
        planetary.members for planetary in one.model.sections.sets
    ]
    for name in ("free", "compliance", "displacement", "load"):
        ours, theirs = (getattr(box.model.sets["stage"].plan, name) for box in (one, two))
        assert_allclose(theirs, ours, rtol=1e-8, atol=1e-12 * np.abs(ours).max())
    assert numbers_and_words(gearbox_rexs(two, (), (), DATE)) == numbers_and_words(first)


def test_the_viscosity_of_the_oil_follows_from_its_grade_and_temperature(box, tmp_path):
    """ISO VG 100, 100 and 11.1 mm^2/s: some 27 mm^2/s at 70 deg C, 0.845 kg/dm^3."""
    (oil,) = box.of_kind("lubricant")
    box.say(oil, **dict.fromkeys([a.get("id") for a in oil]), viscosity_at_40_degree_celsius=100.0,
            viscosity_at_100_degree_celsius=11.1, density_at_15_degree_celsius=0.88)  # fmt: skip
    box.say(box.of_kind("cylindrical_stage")[0], temperature_lubricant=70.0)
    file = read(box, tmp_path)
    assert file.model.sections.lubricant.viscosity_mPas == pytest.approx(27.0 * 0.844, rel=0.02)
    assert any("by ASTM D341" in note for note in file.notes)
