"""VTKHDF: what VTK reads is what was computed, and it is a body in equilibrium."""

from dataclasses import replace
from itertools import product

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor
from pmor.body.elastic_gear import elastic_gear
from pmor.body.volume import nodal_stress, principal_and_von_mises, sector_displacement
from pmor.case import parse_case
from pmor.export import vtkhdf
from pmor.export.vtkhdf import FIELDS, export, flank_forces, step_angles
from pmor.fe.element import QUADRATIC_NODES, node_places
from pmor.fe.hexahedron import shape_functions, shape_gradient
from pmor.fe.sector import build_sector
from pmor.pair.model import mesh_model
from pmor.storage.basis_file import read_basis
from pmor_online.model import reduced_pair
from tests.support.gear_models import POISSON, YOUNG, tooth
from tests.support.small_case import case_text

STEPS = 4  # to a pitch
# Areas are those of flat faces between corners; quadratic ones are arcs, longer by (length / radius)^2 / 24.
CURVED_FACE = 2e-3


def line_case(order):
    element, across = {1: ("hex8i", 1), 2: ("hex20", 1)}[order]
    text = case_text(
        reduction={"shapes": "line_loads"}, contact={"scheme": "line"}, results={"root_stress": False},
        mesh={"element": element, "profile_elements": 4, "width_elements": across, "width": "plane_strain"},
    ).replace("lodm_profile = 2\n", "")  # fmt: skip
    return parse_case(text, "volume", "volume")


@pytest.fixture(scope="module", params=[1, 2])
def basis(request, tmp_path_factory):
    path = tmp_path_factory.mktemp("volume") / "basis.h5"
    pmor.train(line_case(request.param)).save(path)
    return path


@pytest.fixture(scope="module")
def written(basis, tmp_path_factory):
    target = tmp_path_factory.mktemp("vtk") / "pair.vtkhdf"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(vtkhdf, "STEPS_PER_PITCH", STEPS)
        export(reduced_pair(read_basis(basis)), target)
    return target


def step_of(file, name, step):
    root = file["VTKHDF"]
    first, count = root[f"Steps/PointDataOffsets/{name}"][step], root["NumberOfPoints"][0]
    return root[f"PointData/{name}"][first : first + count]


@pytest.fixture
def reader(written):
    found = pytest.importorskip("vtkmodules.vtkIOHDF", reason="vtk is not installed: pip install '.[test]'")
    reader = found.vtkHDFReader()
    reader.SetFileName(str(written))
    reader.UpdateInformation()
    return reader


def test_vtk_reads_every_step_as_it_was_written(reader, written):
    from vtkmodules.util.numpy_support import vtk_to_numpy

    with h5py.File(written) as file:
        values = file["VTKHDF/Steps/Values"][:]
        assert reader.GetNumberOfSteps() == len(values)
        for step, value in enumerate(values):
            reader.SetStep(step)
            reader.Update()
            grid = reader.GetOutput()
            assert reader.GetTimeValue() == value
            assert np.array_equal(vtk_to_numpy(grid.GetPoints().GetData()), file["VTKHDF/Points"][:])
            assert grid.GetNumberOfCells() == len(file["VTKHDF/Types"])
            assert grid.GetCellType(0) == file["VTKHDF/Types"][0]
            for name in FIELDS:
                found = vtk_to_numpy(grid.GetPointData().GetArray(name))
                assert np.array_equal(found, step_of(file, name, step))
            assert set(vtk_to_numpy(grid.GetCellData().GetArray("gear"))) == {0, 1}


def test_vtk_numbers_the_nodes_of_an_element_as_we_do(reader):
    """At a place without any symmetry its shape functions give what ours do."""
    from vtkmodules.vtkCommonCore import reference

    reader.Update()
    cell, place = reader.GetOutput().GetCell(3), (0.3, 0.6, 0.8)
    count = cell.GetNumberOfPoints()
    nodes, found = np.array([cell.GetPoints().GetPoint(i) for i in range(count)]), [0.0] * 3
    cell.EvaluateLocation(reference(0), place, found, [0.0] * count)
    expected = shape_functions(2.0 * np.array(place) - 1.0, 1 if count == 8 else 2) @ nodes
    assert_allclose(found, expected, rtol=1e-12)


def test_coast_flanks_of_equal_teeth_are_the_mirror_image_of_the_drive_flanks(basis, written, tmp_path, monkeypatch):
    """Points and displacements to the other side of the plane of the axes, elements still the right way round."""
    monkeypatch.setattr(vtkhdf, "STEPS_PER_PITCH", STEPS)
    reduced = reduced_pair(read_basis(basis))
    coast = replace(reduced, basis=replace(reduced.basis, case=replace(reduced.basis.case, flank="coast")))
    export(coast, tmp_path / "coast.vtkhdf")
    with h5py.File(written) as drive, h5py.File(tmp_path / "coast.vtkhdf") as other:
        reflected = np.array([-1.0, 1.0, 1.0])
        assert_allclose(other["VTKHDF/Points"][:], drive["VTKHDF/Points"][:] * reflected, atol=1e-12)
        moved = step_of(other, "displacement_mm", 3)
        assert_allclose(moved, step_of(drive, "displacement_mm", 3) * reflected, atol=1e-9)
        points, corners = other["VTKHDF/Points"][:], other["VTKHDF/Connectivity"][:8]
        edges = points[corners[[1, 3, 4]]] - points[corners[0]]
        assert np.linalg.det(edges) > 0.0


def test_the_integral_of_the_pressure_shown_is_the_force_on_the_tooth(basis, written):
    """Over the faces of tooth 0, by the shape functions of the cells: what a viewer adds up."""
    model = pmor.load_model(basis)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(vtkhdf, "STEPS_PER_PITCH", STEPS)
        phi = step_angles(model.reduced)
    forces, pairs = flank_forces(model.reduced, phi)
    on_tooth = forces[:, int(np.flatnonzero(pairs == 0)[0])].reshape(2, -1, 3, len(phi))
    acting = np.linalg.norm(on_tooth.sum(axis=1), axis=1)
    mesh = mesh_model(model.case)
    first = 0
    with h5py.File(written) as file:
        for gear, sector in enumerate((mesh.pinion, mesh.wheel)):
            own = np.unique(sector.elements[:, :QUADRATIC_NODES])
            for step in range(len(phi)):
                pressure = np.zeros(len(sector.nodes))
                pressure[own] = step_of(file, "flank_pressure_MPa", step)[first : first + len(own)]
                assert pressure.min() >= 0.0, "flanks do not pull"
                shown = integral_over_flank(sector, pressure) * (2.0 if sector.mirrored else 1.0)
                assert_allclose(shown, acting[gear, step], rtol=CURVED_FACE, atol=1e-9 * acting.max())
            first += len(own)


def integral_over_flank(sector, values):
    """By Gauss points on the faces of the cells that lie on the loaded flank."""
    points, weights = np.polynomial.legendre.leggauss(3)
    order, found = sector.order, 0.0
    places = 2.0 * node_places(order)[: 8 if order == 1 else QUADRATIC_NODES] / order - 1.0
    on_face = places[:, 2] == -1.0
    rows, columns = ((places[on_face][:, i] + 1.0) * order / 2.0 for i in range(2))
    for row in range(0, len(sector.flank) - 1, order):
        for column in range(0, len(sector.z) - 1, order):
            nodes = sector.flank[row + rows.astype(int), column + columns.astype(int)]
            for (s, one), (t, two) in product(zip(points, weights, strict=True), repeat=2):
                at = np.array([s, t, -1.0])
                along, across = (sector.nodes[nodes].T @ shape_gradient(at, order)[on_face, i] for i in range(2))
                area = np.linalg.norm(np.cross(along, across))
                found += one * two * area * (shape_functions(at, order)[on_face] @ values[nodes])
    return found


def test_pinion_and_wheel_press_on_each_other_where_they_touch(written):
    """The mesh stands in the middle of the steps: there the loaded rows of both flanks are as near as nodes are."""
    with h5py.File(written) as file:
        middle = len(file["VTKHDF/Steps/Values"]) // 2
        points, pressure = file["VTKHDF/Points"][:], step_of(file, "flank_pressure_MPa", middle)
        gear = np.zeros(len(points), dtype=int)
        nodes = len(file["VTKHDF/Connectivity"]) // len(file["VTKHDF/Types"])
        gear[file["VTKHDF/Connectivity"][:]] = np.repeat(file["VTKHDF/CellData/gear"][:], nodes)
    loaded = pressure > 0.5 * pressure.max()
    pinion, wheel = (points[loaded & (gear == g)] for g in range(2))
    apart = np.linalg.norm(pinion[:, None] - wheel, axis=2)
    assert min(len(pinion), len(wheel)) >= 2, "a row of nodes over the width"
    assert apart.min(axis=0).max() < 2.5  # mm: rows of nodes are 1 to 2 mm apart


@pytest.mark.parametrize("order", [1, 2])
def test_stress_of_an_even_strain_is_exact(order, rng):
    mesh = build_sector(tooth(21), 20.0, 10.0, 4, 2, order=order)
    slope = rng.normal(size=(3, 3))
    found = nodal_stress(mesh, (mesh.nodes @ slope.T)[..., None], YOUNG, POISSON)[..., 0]
    strain, shear = 0.5 * (slope + slope.T), 0.5 * YOUNG / (1.0 + POISSON)
    lame = 2.0 * shear * POISSON / (1.0 - 2.0 * POISSON)
    stress = 2.0 * shear * strain + lame * np.trace(strain) * np.eye(3)
    expected = stress[[0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2]]
    own = np.unique(mesh.elements[:, :QUADRATIC_NODES])
    assert_allclose(found[own], np.broadcast_to(expected, (len(own), 6)), rtol=0.0, atol=1e-10 * np.abs(expected).max())
    principal, von_mises = principal_and_von_mises(expected[None, :, None])
    assert_allclose(principal[0, 0], np.linalg.eigvalsh(stress)[-1], rtol=1e-12)
    deviator = stress - np.trace(stress) / 3.0 * np.eye(3)
    assert_allclose(von_mises[0, 0], np.sqrt(1.5 * (deviator**2).sum()), rtol=1e-12)


def test_a_gear_without_its_surface_layer_has_no_volume():
    mesh = build_sector(tooth(12, 0.2), 8.0, 10.0, 3, 1)
    gear = elastic_gear(mesh, YOUNG, POISSON, "hex8i", 1, True, 1)
    with pytest.raises(ValueError, match="layer_columns=0"):
        sector_displacement(gear, 0, np.array([0]), np.zeros((1, gear.compliance.shape[1], 1)))
