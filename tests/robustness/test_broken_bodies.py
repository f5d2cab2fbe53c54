"""Meshes that are no body of a gear are refused in one line, with their place, by the case that names them."""

import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from pmor.case import load_case, make_case, parse_case, text_of
from pmor.case.body_matrix import body_stiffness
from pmor.case.body_mesh import BodyVolume, body_volume
from pmor.case.capability import why_not
from pmor.core.errors import CaseError, MeshError
from pmor.fe.body_condensation import condensed_nodes
from pmor.pair.drawn import gear_inertias
from pmor.pair.model import gear_pair
from tests.support.body_meshes import body_mesh, condensed_body, write_mesh

pytest.importorskip("meshio")

RADII, Z, AROUND = (8.0, 9.5, 11.0), (-6.0, 0.0, 6.0), 16
GEAR = {
    "teeth": 13, "bore_radius_mm": 8.0, "module_mm": 2.5, "face_width_mm": 12.0, "torque_Nm": 50.0, "scheme": "line",
}  # fmt: skip


def whole(r, z, theta):
    return np.ones_like(r, dtype=bool)


def ring(kind="tetra10", solid=whole, radii=RADII, closed=True):
    points, elements = body_mesh(radii, Z, AROUND, solid, kind, closed)
    return points, elements, kind


def inverted():
    points, elements, kind = ring()
    elements[5, [0, 1]] = elements[5, [1, 0]]
    return points, elements, kind


def flat():
    points, elements, kind = ring("tetra")
    elements[5, 3] = elements[5, 2]
    return points, elements, kind


def moved(by=(0.0, 0.0, 0.0), times=1.0, axes=(0, 1, 2)):
    points, elements, kind = ring()
    return (points * times + by)[:, axes], elements, kind


def two_bodies():
    points, elements, kind = ring(solid=lambda r, z, theta: z < 0.0)
    return np.concatenate([points, points + [0.0, 0.0, 6.5]]), np.concatenate([elements, elements + len(points)]), kind


def slit():
    """Both sides of a cut have nodes of their own."""
    return ring(closed=False)


def solid_disc():
    points, elements, kind = ring("tetra", radii=(5e-3, 5.0, 11.0))
    return points, elements, kind


def doubled():
    points, elements, kind = ring()
    return points, np.concatenate([elements, elements[:1], elements[:1]]), kind


def without_a_number():
    points, elements, kind = ring()
    points[7, 1] = np.nan
    return points, elements, kind


def wedges():
    points, elements, _ = ring("hexahedron")
    return points, elements[:, [0, 1, 2, 4, 5, 6]], "wedge"


def surface():
    points, elements, _ = ring("tetra")
    return points, elements[:, :3], "triangle"


BROKEN = {
    "elements inside out": (inverted, {}, ["1 of 384 elements", "turned inside out", "mm"]),
    "flat elements": (flat, {}, ["1 of 384 elements are flat"]),
    "in metres": (lambda: moved(times=1e-3), {}, ["radius 0.011 mm", 'unit = "m"']),
    "in inches": (lambda: moved(times=1 / 25.4), {}, ["radius 0.433071 mm", 'unit = "in"']),
    "said to be in metres": (ring, {"unit": "m"}, ["radius 11000 mm", 'unit = "mm"']),
    "no bore": (solid_disc, {}, ["has no bore", "solid down to its axis"]),
    "a square hole": (
        lambda: ring(solid=lambda r, z, theta: (r > 9.5) | (theta > 4.0)), {}, ["has no bore", "no cylinder"],
    ),
    "another bore": (lambda: ring(radii=(8.5, 11.0)), {}, ["bore has the radius 8.5 mm", "bore_radius_mm is 8"]),
    "an open interface": (
        lambda: ring(solid=lambda r, z, theta: (r < 9.5) | (theta > 1.0)), {}, ["open cylinder", "miss", "close it"],
    ),
    "teeth": (
        lambda: ring(radii=(8.0, 11.0, 13.5), solid=lambda r, z, theta: (r < 11.0) | (np.sin(8 * theta) > 0.0)),
        {}, ["open cylinder", "without teeth"],
    ),
    "through the root": (lambda: ring(radii=(8.0, 12.5)), {}, ["radius 12.5 mm", "at most", "mesh no teeth"]),
    "two bodies": (two_bodies, {}, ["2 bodies", "do not hang together"]),
    "a slit": (slit, {}, ["25 pairs of nodes at one place", "merge them"]),
    "off the axis": (lambda: moved(by=(0.5, 0.0, 0.0)), {}, ["cylinder", "z axis"]),
    "about x": (lambda: moved(axes=(2, 0, 1)), {}, ["cylinder", "z axis"]),
    "narrower than the face": (
        lambda: ring(solid=lambda r, z, theta: z < 0.0), {}, ["width 6 mm", "face_width_mm is 12"],
    ),
    "an element twice": (doubled, {}, ["more than two elements share"]),
    "not a number": (without_a_number, {}, ["no numbers"]),
    "wedges": (wedges, {}, ["elements of the kind wedge"]),
    "a surface": (surface, {}, ["no tetrahedra and no hexahedra"]),
    "an unknown unit": (ring, {"unit": "cm"}, ["unit", "unknown choice"]),
    "a web beside the mesh": (ring, {"web_thickness_mm": 4.0}, ["web_thickness_mm", "unknown key"]),
    "holes beside the mesh": (
        ring, {"holes": {"count": 4, "radius_mm": 1.0, "on_radius_mm": 9.5}}, ["leave holes out"],
    ),
    "a section alone": (ring, {"width": "plane_strain"}, ['"plane_strain"']),
}  # fmt: skip


def case_of(folder, given, suffix=".inp", key="mesh"):
    blank = {key: value for key, value in given.items() if key not in ("width", "scheme")}
    solid = make_case(**GEAR | {key: value for key, value in given.items() if key not in blank})
    lines = [f'{key} = "body{suffix}"']
    for key, value in blank.items():
        words = ", ".join(f"{k} = {v}" for k, v in value.items()) if isinstance(value, dict) else ""
        lines.append(f"{key} = {{{words}}}" if words else f"{key} = {value!r}".replace("'", '"'))
    path = folder / "case.toml"
    path.write_text(solid.text + "\n[pinion.blank]\n" + "\n".join(lines) + "\n")
    return load_case(path)


def refusal(folder, given, **how):
    with pytest.raises(CaseError) as refused:
        case_of(folder, given, **how)
    message = str(refused.value)
    assert "\n" not in message
    assert "[pinion.blank]" in message
    return message


@pytest.mark.parametrize("name", BROKEN)
def test_a_mesh_that_is_no_body_of_the_gear_is_refused(name, tmp_path):
    made, given, words = BROKEN[name]
    write_mesh(tmp_path / "body.inp", *made())
    message = refusal(tmp_path, given)
    for word in words:
        assert word in message


@pytest.mark.parametrize(
    ("suffix", "content", "words"),
    [
        (".inp", None, ["there is no such mesh"]),
        (".inp", "*NODE\n1, 0.0, zero\n*ELEMENT, TYPE=C3D10\n1, 1\n", ["is no mesh that meshio reads as abaqus"]),
        (".inp", "", ["no tetrahedra"]),
        (".msh", "$MeshFormat\n4.1 0 8\n", ["is no mesh that meshio reads as gmsh"]),
        (".step", "ISO-10303-21;", [".step is no format of a mesh"]),
    ],
)
def test_a_file_that_is_no_mesh_is_refused(suffix, content, words, tmp_path):
    if content is not None:
        (tmp_path / f"body{suffix}").write_text(content)
    message = refusal(tmp_path, {}, suffix=suffix)
    for word in words:
        assert word in message


def test_without_meshio_a_mesh_is_refused_with_the_way_to_get_it(tmp_path, monkeypatch):
    write_mesh(tmp_path / "body.inp", *ring())
    monkeypatch.setitem(sys.modules, "meshio.abaqus", None)
    assert "pip install 'pmor-gear[mesh]'" in refusal(tmp_path, {})


def test_a_text_without_a_folder_names_no_mesh():
    text = make_case(**GEAR).text + '\n[pinion.blank]\nmesh = "body.inp"\n'
    with pytest.raises(CaseError, match="no folder to look for it in"):
        parse_case(text, "case", "case")


@pytest.mark.parametrize("suffix", [".inp", ".msh", ".vtk", ".vtu", ".bdf"])
@pytest.mark.parametrize("kind", ["tetra", "tetra10", "hexahedron", "hexahedron20"])
def test_a_ring_is_the_same_body_in_all_formats(suffix, kind, tmp_path):
    write_mesh(tmp_path / f"body{suffix}", *ring(kind))
    mesh = case_of(tmp_path, {}, suffix=suffix).pair.pinion.body.mesh
    assert (mesh.bore_radius_mm, mesh.interface_radius_mm) == pytest.approx((8.0, 11.0), rel=1e-6)
    assert (mesh.width_mm, mesh.repeats) == (pytest.approx(12.0), 0)


def test_a_case_keeps_what_was_found_and_needs_the_file_where_it_is_solved_alone(tmp_path):
    write_mesh(tmp_path / "body.inp", *ring())
    case = case_of(tmp_path, {})
    again = parse_case(text_of(case), "case", "case")
    assert again.pair == case.pair
    body = again.pair.pinion.body
    assert len(body_volume(body).interface) > 0
    assert not why_not(case, "vtkhdf")
    assert not why_not(case, "fmu")
    write_mesh(tmp_path / "body.inp", *ring("tetra"))
    with pytest.raises(CaseError, match="not the one that the case was read with"):
        body_volume(body)
    Path(body.mesh.file).unlink()
    with pytest.raises(CaseError, match="there is no such mesh"):
        body_volume(body)


def test_a_body_that_changes_around_its_axis_repeats_as_it_does(tmp_path):
    def slots(r, z, theta):
        return (r < 9.5) | (z > 0.0) | (np.cos(4 * theta) < 0.0) | (r > 10.2)

    write_mesh(tmp_path / "body.inp", *ring(solid=slots, radii=(8.0, 9.5, 10.2, 11.0)))
    case = case_of(tmp_path, {})
    assert case.pair.pinion.body.mesh.repeats == 4
    assert "leave them out" in why_not(case, "fmu")
    with pytest.raises(CaseError, match='scheme = "direct"'):
        case_of(tmp_path, {"scheme": "direct"})


def test_more_nodes_on_the_interface_than_are_condensed_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr("pmor.fe.body_condensation.MOST_NODES", 10)
    write_mesh(tmp_path / "body.inp", *ring())
    with pytest.raises(MeshError, match="more than the 10 that are condensed: take larger elements"):
        condensed_nodes(body_volume(case_of(tmp_path, {}).pair.pinion.body), 210e3, 0.3)


# --- as matrices ----------------------------------------------------------------------------------------------------

MASS = {"mass_kg": 0.1, "polar_inertia_kg_m2": 1e-5, "tilting_inertia_kg_m2": 1e-5}


@cache
def condensed(held=True, widest=6.0):
    points, elements = body_mesh(RADII, (-6.0, 0.0, widest), AROUND, whole, "hexahedron")
    radius = np.hypot(points[:, 0], points[:, 1])
    bore = np.flatnonzero(np.abs(radius - 8.0) < 1e-6) if held else np.empty(0, dtype=int)
    volume = BodyVolume(
        points, {"hexahedron": elements}, np.flatnonzero(np.abs(radius - 11.0) < 1e-6), bore, -6.0, widest, 4.0
    )
    return condensed_body(volume, 210e3, 0.3)


def changed(nodes=lambda nodes: nodes, stiffness=lambda stiffness: stiffness, **how):
    return lambda: (nodes(condensed(**how)[0].copy()), stiffness(condensed(**how)[1].copy()))


def entry(array, place, value):
    array[place] = value
    return array


BROKEN_MATRICES = {
    "not symmetric": (changed(stiffness=lambda k: entry(k, (3, 9), 1e5)), {}, ["symmetric", "row 4 has 100000 in"]),
    "half of it": (changed(stiffness=np.triu), {}, ["must be symmetric", "write both halves"]),
    "not square": (changed(stiffness=lambda k: k[:, :-3]), {}, ["144 x 141", "48 nodes take 144 x 144"]),
    "other nodes": (changed(lambda nodes: nodes[:-1]), {}, ["144 x 144", "47 nodes take 141 x 141"]),
    "two coordinates": (changed(lambda nodes: nodes[:, :2]), {}, ["(48, 2)", "x, y and z"]),
    "not a number": (changed(stiffness=lambda k: entry(k, (3, 3), np.nan)), {}, ["no numbers"]),
    "not held": (changed(held=False), {}, ["not held", "costs no force", "hold its bore"]),
    "held but for its turn": (changed(stiffness=lambda k: turning(k)), {}, ["not held", "about z"]),
    "not positive definite": (changed(stiffness=lambda k: entry(k, (3, 3), -k[3, 3])), {}, ["not positive definite"]),
    "its inverse": (changed(stiffness=lambda k: symmetric(np.linalg.inv(k))), {}, ["not its inverse"]),
    "in N/m beside mm": (changed(stiffness=lambda k: 1e3 * k), {}, ["times as stiff", 'unit = "mm"']),
    "a node off the cylinder": (changed(lambda nodes: off(nodes)), {}, ["no cylinder"]),
    "off the axis": (changed(lambda nodes: nodes + [0.5, 0.0, 0.0]), {}, ["no cylinder", "z is its axis"]),
    "about x": (changed(lambda nodes: nodes[:, [2, 0, 1]]), {}, ["no cylinder about the z axis, but about x"]),
    "nodes of one half": (
        lambda: (condensed()[0][half()], condensed()[1][np.ix_(*2 * [np.repeat(half(), 3)])]), {},
        ["leave a part of their cylinder out"],
    ),
    "a node twice": (changed(lambda nodes: entry(nodes, 1, nodes[0])), {}, ["1 pairs of nodes at one place"]),
    "in metres": (changed(lambda nodes: 1e-3 * nodes), {}, ["radius 0.011 mm", 'unit = "m"']),
    "said to be in metres": (changed(), {"unit": "m"}, ["radius 11000 mm", 'unit = "mm"']),
    "through the root": (changed(lambda nodes: nodes * [1.15, 1.15, 1.0]), {}, ["radius 12.65 mm", "at most"]),
    "narrower than the face": (changed(widest=4.0), {}, ["width 10 mm", "face_width_mm is 12"]),
    "thinner than a disc": (changed(), {"tilting_inertia_kg_m2": 4e-6}, ["polar_inertia_kg_m2 = 1e-05", "twice"]),
    "no mass": (changed(), {"mass_kg": 0.0}, ["mass_kg", "above 0"]),
    "holes beside it": (
        changed(), {"holes": {"count": 4, "radius_mm": 1.0, "on_radius_mm": 9.5}}, ["leave holes out"],
    ),
}  # fmt: skip


def symmetric(matrix):
    return 0.5 * (matrix + matrix.T)


def off(nodes):
    nodes[5, :2] *= 1.02
    return nodes


def half():
    return condensed()[0][:, 0] > 0.0


def turning(stiffness):
    """Stiffness matrix of a body that turns about its axis without force."""
    x, y, _ = condensed()[0].T
    turn = np.stack([-y, x, np.zeros_like(x)], axis=1).ravel()
    force = stiffness @ turn
    return symmetric(stiffness - np.outer(force, force) / (turn @ force))


@pytest.mark.parametrize("name", BROKEN_MATRICES)
def test_a_matrix_that_is_no_body_of_the_gear_is_refused(name, tmp_path):
    made, given, words = BROKEN_MATRICES[name]
    nodes, stiffness = made()
    np.savez(tmp_path / "body.npz", nodes=nodes, stiffness=stiffness)
    message = refusal(tmp_path, MASS | given, suffix=".npz", key="matrix")
    for word in words:
        assert word in message


@pytest.mark.parametrize(
    ("suffix", "content", "words"),
    [
        (".npz", None, ["body.npz: there is no such file"]),
        (".npz", b"", ["cannot be read", "nodes and stiffness"]),
        (".npz", b"PK\x03\x04 cut", ["cannot be read"]),
        (".mtx", b"%%MatrixMarket matrix array real general\n1 1\n1.0\n", ["body.csv: there is no such file"]),
        (".mat", b"MATLAB", [".mat is no format of a matrix"]),
    ],
)
def test_a_file_that_is_no_matrix_is_refused(suffix, content, words, tmp_path):
    if suffix == ".mat":
        (tmp_path / "body.csv").write_text("1,2,3")
    if content is not None:
        (tmp_path / f"body{suffix}").write_bytes(content)
    message = refusal(tmp_path, MASS, suffix=suffix, key="matrix")
    for word in words:
        assert word in message


def test_a_matrix_is_refused_without_its_arrays_its_mass_or_its_file(tmp_path):
    np.savez(tmp_path / "body.npz", stiffness=condensed()[1])
    assert "nodes" in refusal(tmp_path, MASS, suffix=".npz", key="matrix")
    np.savez(tmp_path / "body.npz", nodes=condensed()[0], stiffness=condensed()[1])
    assert "mass_kg" in refusal(tmp_path, {}, suffix=".npz", key="matrix")
    case = case_of(tmp_path, MASS, suffix=".npz", key="matrix")
    again = parse_case(text_of(case), "case", "case")
    assert again.pair == case.pair
    assert case.pair.pinion.body.matrix.repeats == 0
    np.savez(tmp_path / "body.npz", nodes=condensed()[0], stiffness=2.0 * condensed()[1])
    with pytest.raises(CaseError, match="not the one that the case was read with"):
        body_stiffness(again.pair.pinion.body)


def test_mass_and_inertia_of_a_ring_as_a_mesh_are_those_of_the_solid_gear(tmp_path):
    write_mesh(tmp_path / "body.inp", *ring("hexahedron20"))
    case, solid = case_of(tmp_path, {}), make_case(**GEAR)
    found, expected = (gear_inertias(one, gear_pair(one))[0] for one in (case, solid))
    # A polygon of 16 sides stands for the cylinders.
    np.testing.assert_allclose(list(vars(found).values()), list(vars(expected).values()), rtol=0.02)
