"""Surfaces of a whole gearbox: closed, where the gears touch, moved as their nodes are, and read by VTK as written."""

import math

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor
from pmor.core.conventions import rotation_z
from pmor.machine.bodies import bodies
from pmor.machine.loaded import loaded
from pmor.machine.vtkhdf import FIELDS, FINE, write_machine
from pmor.results.load_distribution import line_states
from tests.support.gearboxes import SMALL, fva_box, written

REVERSE = SMALL.split("[[loads]]")[1].replace('name = "drive"', 'name = "coast"').replace("60.0", "-60.0")
# Half of the distance of points over the face, and along the profile, mm.
APART = math.hypot(1.0, 0.6)


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    return pmor.run(written(tmp_path_factory.mktemp("bodies"), f"{SMALL}[[loads]]{REVERSE}"))


@pytest.fixture(scope="module")
def surfaces(found):
    return {body.name: body for body in bodies(found.file.model, found.loads[0].gearbox, FINE)}


def volume(body):
    """By the theorem of Gauss: positive where faces look outwards."""
    corners = body.rings.reshape(-1, 3)[body.quads]
    halves = [corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]]
    return sum(np.linalg.det(half).sum() / 6.0 for half in halves)


def test_surfaces_are_closed_and_look_outwards(surfaces):
    prism = 0.5 * FINE.circle * math.sin(2.0 * math.pi / FINE.circle)  # over that of the square of the radius
    assert volume(surfaces["input"]) == pytest.approx(prism * 80.0 * 10.0**2, rel=1e-9)
    assert volume(surfaces["output"]) == pytest.approx(prism * 80.0 * (14.0**2 - 4.0**2), rel=1e-9)
    assert volume(surfaces["B"]) == pytest.approx(prism * 6.0 * (15.0**2 - 10.0**2), rel=1e-9)
    for name, teeth in (("mesh, pinion", 19), ("mesh, wheel", 29)):
        radii = np.array([0.5, 0.5]) * 2.5 * teeth / math.cos(math.radians(15.0)) + [-3.2, 2.6]
        bore = {"mesh, pinion": 10.0, "mesh, wheel": 14.0}[name]
        low, high = 16.0 * math.pi * (radii**2 - bore**2)
        assert low < volume(surfaces[name]) < high


@pytest.mark.parametrize("load", [0, 1])
@pytest.mark.parametrize("gear", [0, 1])
def test_gears_carry_where_the_sweep_has_their_contact(found, surfaces, load, gear):
    """At pinion angle 0, in which the gears stand; under the reverse torque seen from the other end."""
    solved = found.loads[load]
    mesh = solved.meshes[0]
    pair, frame, lines = mesh.meshing.pair, mesh.meshing.frame, line_states(mesh.sweep)
    assert mesh.sweep.phi_rad[0] == 0.0
    tooth = (pair.pinion, pair.wheel)[gear]
    body = surfaces[("mesh, pinion", "mesh, wheel")[gear]]
    carries = body.line_load(solved)
    near, count = body.rings[carries > 0.0], 0
    for number, index in enumerate(lines.pair[0]):
        load_here = lines.load_N_per_mm[0, 0, number]
        roll = lines.roll_rad[0, number, :, gear]
        points = tooth.flank_point(roll, lines.z_mm)[load_here > 0.0]
        rotation = index * pair.pitch
        if gear == 1:
            rotation = math.pi + pair.wheel_tooth_rotation(rotation)
        centre = body.centre[0]
        placed = centre + points @ rotation_z(rotation).T @ frame.axes.T
        if len(placed):
            apart = np.linalg.norm(placed[:, None] - near, axis=2).min(axis=1)
            assert apart.max() < APART
            count += len(placed)
    assert count > 3
    largest = lines.load_N_per_mm.max()
    assert 0.9 * largest < carries.max() <= largest


def test_points_move_with_the_nodes_that_carry_them(found, surfaces):
    solved = found.loads[0]
    moved, hub = solved.equilibrium.displacement, solved.meshes[0].meshing.hubs[1]
    body = surfaces["mesh, wheel"]
    arm = body.rings[5, 7] - body.centre[5]
    expected = moved[hub : hub + 3] + np.cross(moved[hub + 3 : hub + 6], arm)
    assert_allclose(body.displacement(moved)[5, 7], expected, rtol=1e-12)
    turn = moved[hub + 3 : hub + 6] * [0.0, 1.0, 1.0]
    expected = moved[hub : hub + 3] + np.cross(turn, arm)
    assert_allclose(body.displacement(moved, twist=False)[5, 7], expected, rtol=1e-12)
    bearing = surfaces["B"].displacement(moved, twist=False)
    assert not bearing[1:3].any()  # in the housing, which is rigid
    node = surfaces["B"].node[0]
    assert_allclose(bearing[[0, 3]].mean(axis=(0, 1)), moved[node : node + 3], atol=1e-15)


def test_a_bearing_between_shafts_lies_between_them_and_moves_with_both():
    box = fva_box(5e5, 5e5)
    gearbox = loaded(box.model, box.model.sections.loads[0])
    needle = next(body for body in bodies(box.model, gearbox, FINE) if body.name == "2")
    radii = np.linalg.norm(needle.rings[:, 0, 1:] - needle.centre[:, 1:], axis=1)
    assert_allclose(radii, [25.0, 29.0, 29.0, 25.0, 25.0], rtol=1e-12)
    inner, outer = needle.node[:2]
    assert gearbox.first["in"] <= inner < gearbox.first["mid"] < gearbox.first["out"] <= outer
    moved = np.arange(float(len(gearbox.load)))
    by_ring = needle.displacement(moved, twist=False)[[0, 1, 2, 3]].mean(axis=1)
    assert_allclose(by_ring[[0, 3]].mean(axis=0), moved[inner : inner + 3], rtol=1e-12)
    assert_allclose(by_ring[[1, 2]].mean(axis=0), moved[outer : outer + 3], rtol=1e-12)


@pytest.fixture(scope="module")
def target(found, tmp_path_factory):
    path = tmp_path_factory.mktemp("vtk") / "machine.vtkhdf"
    write_machine(found.file.model, found.loads, path)
    return path


def test_a_step_is_a_load(found, surfaces, target):
    with h5py.File(target) as file:
        assert list(file.attrs["loads"]) == ["drive", "coast"]
        assert list(file.attrs["bodies"])[-2:] == ["gear mesh, pinion", "gear mesh, wheel"]
        root, numbers = file["VTKHDF"], file["VTKHDF/CellData/body"][:]
        points, cells = root["Points"][:], root["Connectivity"][:].reshape(-1, 4)
        wheel = np.unique(cells[numbers == numbers.max()])
        body = surfaces["mesh, wheel"]
        assert_allclose(points[wheel], body.rings.reshape(-1, 3), rtol=1e-12)
        for step, solved in enumerate(found.loads):
            rows = root["Steps/PointDataOffsets/displacement_mm"][step] + wheel
            expected = body.displacement(solved.equilibrium.displacement).reshape(-1, 3)
            assert_allclose(root["PointData/displacement_mm"][:][rows], expected, rtol=1e-6)
            assert_allclose(root["PointData/line_load_N_per_mm"][:][rows], body.line_load(solved).ravel(), rtol=1e-6)


def test_vtk_reads_the_machine_as_it_was_written(target):
    io = pytest.importorskip("vtkmodules.vtkIOHDF", reason="vtk is not installed: pip install '.[test]'")
    from vtkmodules.util.numpy_support import vtk_to_numpy

    reader = io.vtkHDFReader()
    reader.SetFileName(str(target))
    reader.UpdateInformation()
    with h5py.File(target) as file:
        root = file["VTKHDF"]
        assert reader.GetNumberOfSteps() == 2
        count = len(root["Points"])
        for step in range(2):
            reader.SetStep(step)
            reader.Update()
            grid = reader.GetOutput()
            assert np.array_equal(vtk_to_numpy(grid.GetPoints().GetData()), root["Points"][:])
            assert {grid.GetCellType(i) for i in range(grid.GetNumberOfCells())} == {9}
            for name in FIELDS:
                found = vtk_to_numpy(grid.GetPointData().GetArray(name))
                assert np.array_equal(found, root[f"PointData/{name}"][step * count : (step + 1) * count])
            assert vtk_to_numpy(grid.GetCellData().GetArray("body")).max() == 7
