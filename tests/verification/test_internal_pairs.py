"""Internal pairs: published geometry, conjugate flanks, torques, and one body against a whole ring in one matrix."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.body.elastic_gear import elastic_gear
from pmor.case import change_case, load_case, make_case
from pmor.core.errors import GeometryError
from pmor.fe.assembly import degrees_of_freedom
from pmor.fe.sector import build_sector
from pmor.gear.condition import Assembly, Condition, Misalignment
from pmor.gear.pair import GearPair, zero_backlash_centre_distance
from pmor.gear.ring_root import Shaper
from pmor.gear.tip_edge import tip_edge
from pmor.gear.tooth import Tooth
from pmor.line.hertz import width_limit
from pmor.line.hubs import hub_rows
from pmor.line.layered_pair import as_layered, place_sections
from pmor.line.unloaded import unloaded_ste_um
from pmor.pair.model import elastic_model, gear_pair, mesh_model
from pmor.rexs.read import read_stage
from pmor.rexs.write import rexs_text
from tests.support.internal_pairs import ALPHA, internal_pair, ring
from tests.support.small_case import full_fe
from tests.support.states import states_at
from tests.support.whole_gear import whole_gear_displacement

SHIPPED = "cases/internal_spur.toml"
# FIELD, computed by others: planetary stage of FVA.
RING_CONTACT_RATIO, SUN_CONTACT_RATIO, ISO_RING, ISO_SUN = 1.9572, 1.5477, 24.677, 16.159
PRINTED = 5e-5
TOUCHING = 1e-12  # mm
DIFFERENCES = 1e-5  # of gaps over 0.1 um
LIGHT = {"profile_elements": 6, "width_elements": 2, "error_bar": False}


def case_of(helix_deg=0.0, **keys):
    wheel = {"teeth": 60, "internal": True, "addendum": 0.8, "rim_thickness_mm": 5.0, "root_fillet_mm": 0.6}
    sections = {"mesh": LIGHT, "results": {"root_stress": False}} | keys
    return make_case(
        "internal", module_mm=2.0, face_width_mm=12.0, torque_Nm=40.0, helix_angle_deg=helix_deg,
        pinion={"teeth": 20, "bore_radius_mm": 10.0}, wheel=wheel, **sections,
    )  # fmt: skip


@pytest.fixture(scope="module", params=[0.0, 15.0], ids=["spur", "helical"])
def model(request):
    return full_fe(case_of(request.param))


def test_contact_ratios_of_the_fva_planetary_stage_are_the_published_ones():
    """They count between the tip circles: roots that are cut sharply leave all of the flanks."""
    planet, sun = (Tooth(teeth, 4.0, ALPHA, rack_tip_radius=0.0) for teeth in (22, 17))
    inner = internal_pair(planet, ring(61, 4.0, shaper=Shaper(23)))
    assert_allclose(inner.centre_distance, -78.0, rtol=1e-12)
    assert_allclose(inner.contact_ratio, RING_CONTACT_RATIO, atol=PRINTED)
    outer = GearPair(sun, planet, 50.0, zero_backlash_centre_distance(sun, planet))
    tips = sun.base_radius * sun.tip_roll_angle + planet.base_radius * planet.tip_roll_angle - outer.action_length
    assert_allclose(tips / sun.base_pitch, SUN_CONTACT_RATIO, atol=PRINTED)


@pytest.mark.parametrize(("teeth", "module", "shifts", "distance"), [
    ((17, 56), 45.0, (0.802, -0.501), 863.0), ((36, 93), 21.0, (0.504, 0.117), 584.0),
])  # fmt: skip
def test_profile_shifts_of_published_rings_count_towards_the_tip(teeth, module, shifts, distance):
    """NREL's 5 MW gearbox: planet and ring have the centre distance of the sun mesh, but for printed digits."""
    planet = Tooth(teeth[0], module, ALPHA, profile_shift=shifts[0], rack_tip_radius=0.2)
    wheel = ring(teeth[1], module, profile_shift=shifts[1], addendum=0.6)
    found = zero_backlash_centre_distance(planet, wheel)
    assert_allclose(found, -distance, atol=1e-3 * module)


def test_conjugate_flanks_have_no_error_without_load(model):
    meshed = model.mesh.meshed
    phi = np.linspace(-0.4, 0.4, 25)
    closer = Assembly(misalignment=Misalignment(centre_distance_um=-30.0))
    for assembly in (Assembly(), closer):
        assert np.ptp(unloaded_ste_um(meshed, phi, [assembly])) < 1e-9


def test_torques_have_the_ratio_of_the_tooth_numbers_at_every_angle(model):
    pair = model.mesh.meshed.pair
    for phi in np.linspace(0.0, pair.pitch, 7):
        lines = place_sections(model.mesh.meshed, np.array([phi]))
        on_path = np.abs(lines.gap[0]) < TOUCHING
        assert on_path.sum() > 2
        assert_allclose(lines.mate_lever[0][on_path], -3.0 * pair.pinion.base_radius, rtol=1e-12)
        assert_allclose(lines.lever[0][on_path], -pair.pinion.base_radius, rtol=1e-12)


@pytest.mark.slow
def test_a_sector_of_a_ring_gives_what_the_whole_ring_gives_in_one_matrix():
    mesh = build_sector(ring(24, 2.0, addendum=0.4, root_fillet=0.5), -34.0, 4.0, 4, 1, order=2)
    body = elastic_gear(mesh, 210_000.0, 0.3, "hex20", 2, False)
    unknowns = degrees_of_freedom(mesh.flank.ravel())
    loads = np.eye(len(unknowns))[:, ::9]
    whole = whole_gear_displacement(mesh, 210_000.0, 0.3, "hex20", loads)
    for tooth in range(-2, 3):
        expected = whole[tooth % 24][unknowns]
        assert_allclose(body.tooth_compliance(tooth)[:, ::9], expected, atol=1e-10 * np.abs(whole[0]).max())


def test_mesh_stiffness_of_the_planetary_stage_is_about_that_of_iso_6336():
    """Bodies bored to half of their reference radius; how they are held changes it by a fifth to either side."""
    mesh = {"profile_elements": 8, "width": "plane_strain", "error_bar": False}
    shipped = change_case(
        load_case(SHIPPED), mesh=mesh, results={"root_stress": False}, pinion={"bore_radius_mm": 22.0}
    )
    sun = make_case(
        "sun", module_mm=4.0, face_width_mm=50.0, torque_Nm=530.0, mesh=mesh, results={"root_stress": False},
        pinion={"teeth": 17, "rack_tip_radius": 0.25, "bore_radius_mm": 17.0},
        wheel={"teeth": 22, "rack_tip_radius": 0.25, "bore_radius_mm": 22.0}, youngs_modulus_GPa=206.0,
    )  # fmt: skip
    for case, standard in ((shipped, ISO_RING), (sun, ISO_SUN)):
        made = elastic_model(case, mesh_model(case))
        pair, load = made.mesh.meshed.pair, Condition(torque=1e3 * case.torque_Nm)
        phi = np.arange(20) / 20.0 * pair.pitch
        found = np.array([states_at(made, float(angle), [load])[0].advance for angle in phi]) * pair.pinion.base_radius
        stiffness = (1e-3 * load.torque / pair.pinion.base_radius / 50.0 / found).mean()
        print(stiffness, standard, pair.contact_ratio)  # noqa: T201
        assert_allclose(stiffness, standard, rtol=0.15)


@pytest.mark.parametrize("keys", [{"shaper": {"teeth": 23, "tip_radius_mm": 0.4}}, {"root_fillet_mm": 1.1}])
def test_a_ring_comes_back_from_a_rexs_file_as_it_was_written(keys, tmp_path):
    wheel = {"teeth": 61, "internal": True, "profile_shift": -0.1, "addendum": 0.85, "rim_thickness_mm": 13.0} | keys
    case = make_case(
        "ring", module_mm=4.0, face_width_mm=30.0, torque_Nm=100.0, helix_angle_deg=12.0, wheel=wheel,
        pinion={"teeth": 22, "profile_shift": 0.1, "bore_radius_mm": 20.0},
        **{"wheel.modification": {"tip_relief_um": 8.0, "tip_relief_start_roll_deg": 17.0}},
    )  # fmt: skip
    path = tmp_path / "ring.rexs"
    path.write_bytes(rexs_text(case, gear_pair(case), None, "today"))
    found = read_stage(path)
    assert [note for note in found.notes if "towards the tip" not in note] == []
    assert_allclose(found.case.wheel_modification.tip_relief_start_roll_deg, 17.0, rtol=1e-9)
    assert found.case.pair == case.pair


@pytest.mark.parametrize("helix_deg", [0.0, 15.0])
def test_moved_hubs_open_the_gaps_of_a_ring_as_moved_axes_do(helix_deg):
    """On the path of contact: apart, tilted in the plane of the axes, and out of it."""
    meshed = mesh_model(case_of(helix_deg, mesh=LIGHT | {"width": "whole"})).meshed
    width, phi, step = meshed.pair.face_width, np.linspace(0.0, meshed.pair.pitch, 5), 0.05
    lines = place_sections(meshed, phi)
    rows, on_path = hub_rows(meshed.pair, lines, meshed.sections.z), np.abs(lines.gap) < TOUCHING
    # The wheel's axis is at -y: apart moves it on.
    for key, place, moved in (("centre_distance_um", 7, -1.0), ("in_plane_um", 9, 1.0 / width),
                              ("out_of_plane_um", 10, 1.0 / width)):  # fmt: skip
        there, back = (place_sections(meshed, phi, Misalignment(**{key: sign * step})).gap for sign in (1.0, -1.0))
        slope = (there[on_path] - back[on_path]) / (2e-3 * step)
        assert_allclose(rows[on_path, place] * moved, slope, rtol=0.0, atol=DIFFERENCES * np.abs(slope).max())


def test_a_tip_past_the_path_of_a_ring_that_is_more_curved_there_has_a_law():
    """17/54 at a working angle of 6.6 deg: the ring's curvature at the planet's tip rises above the tip's own."""
    case = case_of()
    ring_of = {"teeth": 54, "profile_shift": 0.7316, "root_fillet_mm": 0.3}
    planet = {"teeth": 17, "bore_radius_mm": 8.0}
    case = change_case(case, pair={"centre_distance_mm": 35.0}, pinion=planet, wheel=ring_of)
    meshed = as_layered(mesh_model(case).meshed)
    pair = meshed.pair
    assert_allclose(math.degrees(pair.working_pressure_angle), 6.6, atol=0.05)
    lines = place_sections(meshed, pair.pitch * np.arange(40) / 40)
    placed = np.isfinite(lines.gap)
    radii = np.array([pair.pinion.base_radius, pair.wheel.base_radius]) * lines.roll
    assert (placed & ((1.0 / np.where(placed[..., None], radii, 1.0)).sum(axis=2) < -0.01)).any()
    limit = width_limit(meshed, lines.law)
    assert (limit.approach[placed] > 0.0).all()
    assert not limit.exceeded(np.zeros((1, *lines.gap.shape))).any()
    # The wedge between tip and ring carries as the flanks beside the pitch point do.
    assert limit.approach[placed].min() > 0.05 * np.median(limit.approach[placed])


def test_a_rounded_tip_of_a_ring_touches_flank_and_tip_circle():
    made, radius = ring(60), 0.3
    edge = tip_edge(made, radius)
    u, angle = edge.roll_angle, 0.5 * math.pi + made.base_half_angle - edge.roll_angle
    normal = np.array([-math.sin(angle), math.cos(angle)])
    centre = made.flank_section(np.array(u)) - radius * normal
    assert_allclose(np.hypot(*centre) - radius, -made.tip_radius, rtol=1e-12)
    assert made.tip_roll_angle < u < made.form_roll_angle
    assert_allclose(tip_edge(made, 0.0, 0.2).roll_angle, made.roll_angle_at(made.tip_radius - 0.2), rtol=1e-12)
    with pytest.raises(GeometryError, match="takes more than half of the tip land"):
        tip_edge(made, 1.5)
