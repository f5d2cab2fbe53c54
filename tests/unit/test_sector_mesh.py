"""The mesh of a tooth sector: sound elements, conforming sides, nodes on the true profile, the right volume."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.core.conventions import rotation_z
from pmor.core.errors import MeshError
from pmor.fe.element import mesh_quality, node_places
from pmor.fe.hexahedron import shape_gradient
from pmor.fe.outline import tooth_outline
from pmor.fe.sector import build_sector
from pmor.gear.tooth import Tooth
from tests.support.gear_models import tooth

EXACT = 1e-12  # relative; the same formula, or a sum of a few terms
PLACE = 1e-10  # mm at radii up to 600 mm: round-off
SAMPLED = 2e-5  # mm; the outline of the fillet is sampled at 2001 points, the nodes lie on the chords between them
# Elements this far from a brick still have well-conditioned stiffness; Knupp (2003) asks for 0.2 of ordinary meshes,
# the worst here stand at pointed tips and in the corner between an undercut fillet and the ring.
SOUND = 0.1

BORE_SHARE = 0.6


def mesh_of(gear, n=8, m=2, spacing="roll_angle", width=10.0, bore_share=BORE_SHARE):
    return build_sector(gear, bore_share * gear.root_radius, width, n, m, spacing)


# --- quality -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("teeth", [8, 10, 14, 17, 21, 33, 60, 120, 200])
@pytest.mark.parametrize("shift", [-0.4, 0.0, 0.3])
@pytest.mark.parametrize("helix_deg", [0.0, 25.0])
def test_elements_of_any_gear_are_sound(teeth, shift, helix_deg):
    gear = tooth(teeth, shift, helix_deg)
    for n, spacing, bore_share in (
        (2, "roll_angle", 0.9),
        (3, "arc_length", 0.4),
        (8, "roll_angle", 0.4),
        (8, "arc_length", 0.9),
        *[(64, "roll_angle", BORE_SHARE)] * (teeth in (8, 21, 60) and shift == helix_deg == 0.0),
    ):
        mesh = mesh_of(gear, n, 1, spacing, bore_share=bore_share)
        assert mesh_quality(mesh.nodes, mesh.elements).min_scaled_jacobian > SOUND


def brick(lengths=(1.0, 1.0, 1.0)):
    return node_places(1) * np.array(lengths), np.arange(8)[None]


def test_a_sheared_brick_is_as_good_as_the_sine_of_its_angle():
    nodes, elements = brick()
    nodes[:, 0] += nodes[:, 1] / math.tan(math.radians(40.0))
    assert_allclose(mesh_quality(nodes, elements).min_scaled_jacobian, math.sin(math.radians(40.0)), rtol=EXACT)


def test_an_inverted_element_is_named():
    nodes, _ = brick()
    nodes = np.concatenate([nodes + [7.0, 0.0, 0.0], nodes])
    elements = np.array([np.arange(8, 16), [4, 5, 6, 7, 0, 1, 2, 3]])
    with pytest.raises(MeshError, match=r"element 1 near \(7.5, 0.5, 0.5\) mm is turned inside out"):
        mesh_quality(nodes, elements)


@pytest.mark.parametrize("bore_radius", [37.0, 40.0])
def test_a_bore_as_large_as_the_root_circle_is_refused(bore_radius):
    with pytest.raises(MeshError, match="leaves no rim"):
        build_sector(tooth(21), bore_radius, 10.0, 4, 1)


def test_a_corner_in_place_of_a_fillet_is_refused():
    corner = Tooth(10, 1.0, math.radians(10.0), profile_shift=1.0, addendum=0.75, dedendum=1.0, rack_tip_radius=0.0)
    with pytest.raises(MeshError, match="rack_tip_radius = 0: leaves a corner .*; raise it"):
        tooth_outline(corner, 4, "arc_length")


# --- topology ------------------------------------------------------------------------------------------------------

GEARS = {"spur": tooth(21), "undercut": tooth(9), "shifted": tooth(17, 0.4), "helical": tooth(21, 0.1, 15.0)}
every_gear = pytest.mark.parametrize("gear", GEARS.values(), ids=GEARS.keys())


@every_gear
def test_left_face_is_the_right_face_turned_by_one_pitch(gear):
    mesh = mesh_of(gear)
    turn = rotation_z(gear.angular_pitch)
    assert_allclose(mesh.nodes[mesh.left], mesh.nodes[mesh.right] @ turn.T, atol=PLACE, rtol=0)
    layers = len(mesh.z)
    assert_allclose(mesh.nodes[mesh.bore[:layers]], mesh.nodes[mesh.bore[-layers:]] @ turn.T, atol=PLACE, rtol=0)


@every_gear
def test_every_free_face_lies_on_the_boundary(gear):
    """Faces that belong to one element only make a closed surface: outline, bore, two sides, two ends, no cracks."""
    mesh = mesh_of(gear, 4, 2)
    faces = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])
    faces = mesh.elements[:, faces].reshape(-1, 4)
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    assert count.max() == 2
    free = faces[first[count == 1]]
    corners = mesh.nodes[free]
    area = 0.5 * np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]).sum(axis=0)
    assert_allclose(area, 0.0, atol=PLACE)
    at_end = np.isin(np.round(corners[:, :, 2], 9), np.round(mesh.z[[0, -1]], 9)).all(axis=1)
    sides = [set(mesh.left) | set(mesh.bore), set(mesh.right) | set(mesh.bore), set(mesh.bore)]
    on_side = np.array([any(set(face) <= side for side in sides) for face in free.tolist()])
    on_flank = np.isin(free, mesh.flank).all(axis=1)
    assert on_flank.sum() == 4 * 2
    rest = free[~at_end & ~on_side & ~on_flank]  # other flank, tip land, fillets, root land
    assert np.linalg.norm(mesh.nodes[rest], axis=-1).min() > 0.999 * gear.root_radius


# --- geometry ------------------------------------------------------------------------------------------------------


@every_gear
@pytest.mark.parametrize("spacing", ["roll_angle", "arc_length"])
def test_flank_nodes_lie_on_the_involute(gear, spacing):
    mesh = mesh_of(gear, 6, 3, spacing)
    assert mesh.flank_nodes.shape == (7, 4, 3)
    expected = gear.flank_point(mesh.flank_roll_angle[:, None], mesh.z[None])
    assert_allclose(mesh.flank_nodes, expected, atol=PLACE, rtol=0)
    ends = mesh.flank_roll_angle[[0, -1]]
    assert_allclose(ends, [gear.form_roll_angle, gear.tip_roll_angle], rtol=EXACT)
    assert_allclose(mesh.z, np.linspace(-5.0, 5.0, 4), rtol=EXACT)


@every_gear
def test_spacing_is_uniform_in_what_it_says(gear):
    by_roll = np.diff(mesh_of(gear, 6, 1, "roll_angle").flank_roll_angle)
    assert_allclose(by_roll, by_roll[0], rtol=1e-9)
    by_length = np.diff(mesh_of(gear, 6, 1, "arc_length").flank_roll_angle ** 2)
    assert_allclose(by_length, by_length[0], rtol=1e-9)
    assert np.ptp(np.diff(mesh_of(gear, 6, 1, "arc_length").flank_roll_angle)) > 1e-3


@every_gear
def test_fillet_nodes_lie_on_the_trochoid(gear):
    outline = tooth_outline(gear, 8, "roll_angle")
    fine = gear.root_section(np.linspace(0.0, 1.0, 40001))
    nodes = np.concatenate([outline.upper_fillet, outline.lower_fillet])
    for node in nodes:
        to_fillet = np.linalg.norm(fine - node, axis=1).min()
        to_root_circle = abs(np.linalg.norm(node) - gear.root_radius)
        assert min(to_fillet, to_root_circle) < 1e-4 + SAMPLED  # 1e-4: half the distance of the fine points
    assert_allclose(outline.upper_fillet[-1], outline.flank[0], atol=PLACE)
    assert_allclose(outline.upper_fillet[0], outline.lower_fillet[-1], atol=PLACE)
    middle = outline.lower_fillet[0]
    assert_allclose(math.atan2(-middle[0], middle[1]), math.pi / gear.teeth, rtol=1e-9)


def volume(nodes, elements):
    total = 0.0
    for point in (2.0 * node_places(1) - 1.0) / math.sqrt(3.0):
        total += np.linalg.det(np.einsum("ni,enj->eij", shape_gradient(point, 1), nodes[elements])).sum()
    return total


def test_volume_of_all_sectors_converges_to_that_of_the_gear():
    gear = tooth(21)
    roll = np.linspace(gear.form_roll_angle, gear.tip_roll_angle, 20001)
    loaded = np.concatenate([gear.root_section(np.linspace(1.0, 0.0, 20001)), gear.flank_section(roll)])
    root_land = math.pi / 21 - math.atan2(-loaded[0, 0], loaded[0, 1])
    tip_land = 2.0 * math.atan2(-loaded[-1, 0], loaded[-1, 1])
    x, y = loaded.T
    swept = float(np.sum(y[1:] * x[:-1] - x[1:] * y[:-1]))  # both outlines, seen from the axis
    area = abs(swept) + gear.root_radius**2 * root_land + 0.5 * gear.tip_radius**2 * tip_land
    area -= (BORE_SHARE * gear.root_radius) ** 2 * math.pi / 21
    errors = []
    for n in (32, 64, 128):  # the fillet of coarser flanks is no coarser
        mesh = mesh_of(gear, n, 1)
        errors.append(abs(volume(mesh.nodes, mesh.elements) / 10.0 / area - 1.0))
    # Chords of the outline: second order, spoilt a little by the changing split of the fillet.
    assert errors[2] < 0.5 * errors[1] < 0.25 * errors[0] < 0.25e-4


def test_helical_mesh_is_the_spur_section_twisted():
    gear = GEARS["helical"]
    mesh = mesh_of(gear, 4, 2)
    layers = len(mesh.z)
    for layer, z in enumerate(mesh.z):
        turned = mesh.nodes[1::layers] @ rotation_z((z - mesh.z[1]) * gear.twist_per_length).T
        assert_allclose(mesh.nodes[layer::layers, :2], turned[:, :2], atol=PLACE, rtol=0)
