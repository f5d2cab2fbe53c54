"""Mesh, compliance and layer belong together, or are refused; laboratories share models and never mix them up."""

import threading
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import pmor.pair.model
from pmor.case import change_case, parse_case
from pmor.gear.condition import at_torques
from pmor.lab.core import models
from pmor.lab.core.models import ModelStore
from pmor.pair.conditions import nominal_condition
from pmor.pair.model import ElasticModel, elastic_model, mesh_model
from pmor.penalty.solve import solve_position
from pmor.storage.basis_file import read_basis
from pmor.work.offline import run_offline
from pmor_online.model import reduced_pair
from pmor_online.sweep import sweep_reduced_pair
from tests.support.small_case import case_text, case_with, small_case

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


SAME_MODEL = 1e-12


@pytest.mark.parametrize("first", ["aligned", "tilted"])
def test_axes_that_may_tilt_and_axes_that_do_not_have_models_of_their_own(first):
    """Half of the width is meshed for one, all of it for the other, with the same keys in [mesh]."""
    aligned = small_case()
    cases = {"aligned": aligned, "tilted": change_case(aligned, offline={"in_plane_um": [-10.0, 10.0]})}
    store = ModelStore()
    for name in sorted(cases, key=lambda name: name != first):
        model, _ = store.model(cases[name])
        alone = elastic_model(cases[name], mesh_model(cases[name]))
        phi = model.mesh.meshed.pair.roll_position_range[0]
        advances = [
            solve_position(m.mesh.meshed, phi, at_torques([1e5]), m.elasticity_at).equilibria[0].advance
            for m in (model, alone)
        ]
        assert_allclose(*advances, rtol=SAME_MODEL)


def test_cases_that_differ_in_the_contact_alone_share_a_model_but_line_contact_has_its_own():
    store, case = ModelStore(), parse_case(case_text(), "small", "small case")
    model, seconds = store.model(case)
    other, same_seconds = store.model(change_case(case, penalty_N_mm3=1e5))
    assert other.pinion is model.pinion
    assert other.mesh.meshed.scheme.penalty != model.mesh.meshed.scheme.penalty
    assert same_seconds == seconds
    assert store.model(change_case(case, scheme="line"))[0].pinion is not model.pinion


def test_threads_that_ask_for_one_model_solve_it_once(monkeypatch):
    case, started, go_on = small_case(), [], threading.Event()

    def slow(*arguments):
        started.append(1)
        go_on.wait(10.0)
        return elastic_model(*arguments)

    monkeypatch.setattr(models, "elastic_model", slow)
    store = ModelStore()
    with ThreadPoolExecutor(2) as executor:
        asked = [executor.submit(store.model, case) for _ in range(2)]
        go_on.set()
        one, other = (future.result()[0] for future in asked)
    assert started == [1]
    assert one.pinion is other.pinion


def test_a_model_that_fails_is_tried_again(monkeypatch):
    store, case = ModelStore(), small_case()
    monkeypatch.setattr(models, "elastic_model", lambda *arguments: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        store.model(case)
    monkeypatch.undo()
    assert store.model(case)[1] > 0.0


def test_models_beyond_the_limit_go_those_unused_for_longest_first(monkeypatch):
    cases = [change_case(small_case(), profile_elements=n) for n in (5, 6, 7)]
    solved = []

    def counted(case, mesh):
        solved.append(case.mesh.profile_elements)
        return elastic_model(case, mesh)

    monkeypatch.setattr(models, "elastic_model", counted)
    store = ModelStore()
    sizes = [models._bytes(store.model(case)[0]) for case in cases]
    store, solved[:] = ModelStore(sum(sizes) - 1), []
    for case in (*cases[:2], cases[0], cases[2], cases[0], cases[1]):
        store.model(case)
    assert solved == [5, 6, 7, 6], "6 went for 7, 5 was used after it"
