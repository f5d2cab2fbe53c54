"""Surfaces of a set in motion: closed, touching where the line loads are, and read by VTK as they were written."""

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor
from pmor.sets.output import nominal_torque
from pmor.sets.vtkhdf import FIELDS, MOST_STEPS, write_set
from tests.support.small_sets import NO_STRESS, SMALL_CHAIN, SMALL_SET, written_set

HELICAL = SMALL_SET.replace("face_width_mm = 20.0", "face_width_mm = 20.0\nhelix_angle_deg = 15.0")
REVERSE = SMALL_SET.replace("torque_Nm = 300.0", "torque_Nm = -300.0")
SETS = {"planetary": SMALL_SET, "helical": HELICAL, "reverse": REVERSE, "chain": SMALL_CHAIN}
# Half of the distance of points along the profiles of both flanks, which grows towards their tips, mm.
APART = 1.6
# Fields are stored in single precision.
SINGLE = 1e-5


@pytest.fixture(scope="module", params=SETS)
def solved(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp(request.param)
    found = pmor.run(written_set(folder, SETS[request.param] + NO_STRESS))
    target = folder / "set.vtkhdf"
    write_set(found.solution, found.file.cases, nominal_torque(found.file, found.solution), target)
    with h5py.File(target) as file:
        root, names = file["VTKHDF"], file.attrs["gears"].tolist()
        count = root["NumberOfPoints"][0]
        fields = {name: root[f"PointData/{name}"][:].reshape(-1, count, parts) for name, parts in FIELDS.items()}
        cells, gear = root["Connectivity"][:].reshape(-1, 4), root["CellData/gear"][:]
        yield found, target, names, root["Points"][:], cells, gear, fields


def test_surfaces_are_closed_and_look_outwards(solved):
    """By the theorem of Gauss: between cylinders at root and tip circle."""
    found, _, names, points, cells, gear, _ = solved
    for number, name in enumerate(names):
        corners = points[cells[gear == number]]
        volume = sum(np.linalg.det(corners[:, half]).sum() / 6.0 for half in ([0, 1, 2], [0, 2, 3]))
        mesh = next(one for one in found.solution.train.meshes if number in one.bodies)
        pair, place = mesh.pair.meshed.pair, mesh.bodies.index(number)
        tooth = (pair.pinion, pair.wheel)[place]
        body = found.solution.plan.bodies[number]
        axis = np.array([(-1.0 if found.solution.plan.clockwise else 1.0) * body.x, body.y])
        radii = np.linalg.norm(points[np.unique(cells[gear == number])][:, :2] - axis, axis=1)
        bore = radii.max() if tooth.teeth < 0 else radii.min()
        low, high = np.sort(20.0 * np.pi * np.abs(np.array([tooth.root_radius, tooth.tip_radius]) ** 2 - bore**2))
        assert low < volume < high, name


def test_gears_touch_where_they_carry(solved):
    """Loaded points of the gears of a mesh are as near to each other as points are on a flank."""
    found, _, _, points, cells, gear, fields = solved
    own = [np.unique(cells[gear == number]) for number in range(len(found.solution.plan.bodies))]
    for step in range(len(fields["motion_mm"])):
        moved, load = points + fields["motion_mm"][step], fields["line_load_N_per_mm"][step, :, 0]
        carry = [moved[points_of][load[points_of] > 0.0] for points_of in own]
        for number, of_body in enumerate(carry):
            bodies = [mesh.bodies for mesh in found.solution.train.meshes if number in mesh.bodies]
            mates = np.concatenate([carry[one + other - number] for one, other in bodies])
            if len(of_body):  # a pin that is off may unload a planet
                assert np.linalg.norm(of_body[:, None] - mates, axis=2).min(axis=1).max() < APART
    largest = max(
        found.solution.face_loads(number).load_N_per_mm.max() for number in range(len(found.file.plan.meshes))
    )
    # Linear between places over the face, and scaled to the sum of the sections, whose rule is another; measured 2e-5.
    assert 0.9 * largest < fields["line_load_N_per_mm"].max() <= largest * (1.0 + 1e-4)


def test_the_integral_of_the_line_loads_shown_is_the_force(solved):
    """Forces of each gear, all its meshes together, over the transverse sections of its surface."""
    found, _, _, points, cells, gear, fields = solved
    torque = nominal_torque(found.file, found.solution)
    for number in range(len(found.solution.plan.bodies)):
        own = np.unique(cells[gear == number])
        z, section = np.unique(np.round(points[own, 2], 9), return_inverse=True)
        width = np.gradient(z) * np.where((z == z[0]) | (z == z[-1]), 0.5, 1.0)
        shown = (fields["line_load_N_per_mm"][:, own, 0] * width[section]).sum(axis=1)
        forces = [
            found.solution.mesh_force_N[torque, :, place]
            for place, mesh in enumerate(found.solution.train.meshes) if number in mesh.bodies
        ]  # fmt: skip
        assert_allclose(shown, np.sum(forces, axis=0), rtol=SINGLE)


def test_hubs_move_as_they_give_way(solved):
    found, _, _, points, cells, gear, fields = solved
    side = -1.0 if found.solution.plan.clockwise else 1.0
    torque = nominal_torque(found.file, found.solution)
    own = np.unique(cells[gear == 0])
    turn = found.solution.hub_displacement[torque, 0, 0, 5]
    expected = side * turn * np.stack([-points[own, 1], points[own, 0], 0.0 * points[own, 0]], axis=1)
    assert_allclose(fields["displacement_mm"][0, own], expected, atol=1e-6 * np.abs(expected).max())


def test_vtk_reads_a_set_as_it_was_written(solved):
    io = pytest.importorskip("vtkmodules.vtkIOHDF", reason="vtk is not installed: pip install '.[test]'")
    from vtkmodules.util.numpy_support import vtk_to_numpy

    found, target, _, points, _, _, fields = solved
    reader = io.vtkHDFReader()
    reader.SetFileName(str(target))
    reader.UpdateInformation()
    assert reader.GetNumberOfSteps() == len(found.solution.phi_rad) <= MOST_STEPS
    reader.SetStep(2)
    reader.Update()
    grid = reader.GetOutput()
    assert_allclose(vtk_to_numpy(grid.GetPoints().GetData()), points)
    assert_allclose(vtk_to_numpy(grid.GetPointData().GetArray("motion_mm")), fields["motion_mm"][2])
