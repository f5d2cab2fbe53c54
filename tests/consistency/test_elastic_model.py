"""Mesh, compliance and the layer that it is without belong together, or are refused; a basis keeps all three."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import pmor.pair.model
from pmor.pair.conditions import nominal_condition
from pmor.pair.model import ElasticModel, elastic_model, mesh_model
from pmor.storage.basis_file import read_basis
from pmor.work.offline import run_offline
from pmor_online.model import reduced_pair
from pmor_online.sweep import sweep_reduced_pair
from tests.support.small_case import case_with, small_case

ANGLES = np.array([0.02, 0.17])
MESH = {"profile_elements": 5, "width_elements": 2}


@pytest.fixture(scope="module")
def basis_of_lines(tmp_path_factory):
    case, path = case_with(mesh=MESH, contact={"scheme": "line"}), tmp_path_factory.mktemp("lines") / "basis.h5"
    mesh = mesh_model(case)
    run_offline(case, elastic_model(case, mesh), path)
    return path, mesh.meshed.layers


def test_the_layer_comes_back_from_the_file(basis_of_lines):
    path, layers = basis_of_lines
    found = reduced_pair(read_basis(path)).meshed.layers
    assert len(found) == len(layers) == 2
    for layer, expected in zip(found, layers, strict=True):
        assert_array_equal(layer.depth, expected.depth)
        assert_array_equal(layer.constant, expected.constant)
        assert (layer.compliance, layer.columns) == (expected.compliance, expected.columns)


def test_another_grading_of_the_mesh_does_not_move_what_a_basis_says(basis_of_lines, monkeypatch):
    """On the way of 0.4.0, which took the layer from a mesh made anew, the STE moved by parts in a thousand."""
    path, layers = basis_of_lines

    def ste_um(layers_now=None):
        reduced = reduced_pair(read_basis(path))
        if layers_now:
            reduced = replace(reduced, meshed=replace(reduced.meshed, layers=layers_now))
        return sweep_reduced_pair(reduced, ANGLES, [nominal_condition(reduced.basis.case)]).ste_um

    before, grading = ste_um(), pmor.pair.model.surface_layer

    def deeper(*arguments):
        columns, depth = grading(*arguments)
        return columns, 1.1 * depth

    monkeypatch.setattr(pmor.pair.model, "surface_layer", deeper)
    assert_array_equal(ste_um(), before)
    case = read_basis(path).case
    otherwise = ste_um(pmor.pair.model.surface_layers(case, pmor.pair.model.gear_pair(case)))
    assert np.abs(otherwise / before - 1.0).min() > 1e-3, "the test would see it"


# --- a compliance and its mesh ---------------------------------------------------------------------------------------


def test_a_compliance_that_belongs_to_the_mesh_is_taken(small_model):
    """Also where the mesh was made anew: contact may differ, flanks and bodies are the same."""
    case, model = small_model
    again = mesh_model(case)
    assert again.pinion is not model.mesh.pinion
    ElasticModel(again, model.pinion, model.wheel)


@pytest.mark.parametrize("width", ["whole", "plane_strain"])
def test_a_compliance_of_another_width_is_refused(width, small_model):
    """Half of a width and the whole of it have the same rows; whichever came first would stand for both."""
    with pytest.raises(ValueError, match="pinion: the compliance is that of another mesh"):
        ElasticModel(mesh_model(small_case(width)), small_model[1].pinion, small_model[1].wheel)


def test_a_compliance_of_another_spacing_is_refused(small_model):
    """As many flank nodes, in other places: nothing would fail, and every number be wrong."""
    other = mesh_model(case_with(mesh=MESH | {"spacing": "roll_angle"}))
    assert other.pinion.flank_nodes.shape == small_model[1].pinion.mesh.flank_nodes.shape
    with pytest.raises(ValueError, match="pinion: the compliance is that of another mesh"):
        ElasticModel(other, small_model[1].pinion, small_model[1].wheel)


def test_line_contact_refuses_a_compliance_with_the_layer_still_in_it(small_model):
    lines = mesh_model(case_with(mesh=MESH, contact={"scheme": "line"}))
    with pytest.raises(ValueError, match="pinion: contact takes . columns .* the compliance is without 0"):
        ElasticModel(lines, small_model[1].pinion, small_model[1].wheel)
