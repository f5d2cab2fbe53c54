"""The choices of reductions against full FE and against each other: which is exact, which is not, and where."""

from functools import cache, partial

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor_offline.train
from pmor.case import change_case
from pmor.gear.condition import at_torques
from pmor.pair.sweep import sweep_ste
from pmor.penalty.elasticity import shape_elasticity
from pmor.reduction.contact_shapes import contact_shapes, shapes_of
from pmor.reduction.pod import local_modes
from pmor.storage.basis_file import read_basis
from pmor.work.offline import run_offline
from pmor_online.compare import compare_models
from pmor_online.model import reduced_pair, unseen_angles
from pmor_online.sweep import sweep_reduced_pair
from tests.support.small_case import full_fe, small_case

SAME_SPAN = 1e-9  # the equilibrium is solved to a relative residual of 1e-9
# Unit forces in the transverse plane on all active nodes; only forces along the axis are left out, which a curved
# surface between unevenly displaced nodes makes. Measured on these coarse meshes: 8e-9.
EXACT = 5e-8


def unseen(model, count=12):
    meshed = model.mesh.meshed
    return unseen_angles(meshed.pair.roll_position_range[0], meshed.pair.pitch, count, 6)


def ste_of(meshed, elasticity_at, phi, torques=(60e3, 100e3)):
    sweep = sweep_ste(meshed, elasticity_at, phi, at_torques(torques))
    assert sweep.converged.all()
    return sweep.ste_um


@cache
def model_of(scheme, width):
    return full_fe(change_case(small_case(width), scheme=scheme))


def errors_of(folder, scheme="direct", width="half", **reduction):
    """Reduced against full STE at unseen positions, by the slow twin."""
    model, path = model_of(scheme, width), folder / "basis.h5"
    assert run_offline(change_case(small_case(width, **reduction), scheme=scheme), model, path).failed == ()
    reduced, phi = reduced_pair(read_basis(path)), unseen(model)
    full = ste_of(model.mesh.meshed, model.elasticity_at, phi)
    return np.abs(ste_of(reduced.meshed, reduced.elasticity_at, phi) / full - 1.0)


# --- exact -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("width", ["half", "whole"])
@pytest.mark.parametrize("scheme", ["direct", "facet"])
def test_static_modes_are_full_fe(scheme, width, tmp_path):
    assert errors_of(tmp_path, scheme, width, shapes="static_modes").max() < EXACT


def test_static_modes_need_no_full_solve(small_model, tmp_path, monkeypatch):
    def solve(*_):
        raise AssertionError("a full solve")

    monkeypatch.setattr(pmor_offline.train, "solve_snapshots", solve)
    case, path = small_case(shapes="static_modes"), tmp_path / "basis.h5"
    done = run_offline(case, small_model[1], path)
    assert (done.solved, done.resumed, done.failed) == (0, 0, ())
    basis = read_basis(path)
    assert basis.training.ste_um.size == basis.training.converged.size == len(basis.training.phi) == 0
    with h5py.File(path) as file:
        assert file["training/force"].shape[0] == 0
    comparison = compare_models(reduced_pair(basis), small_model[1])
    assert comparison.reduced.converged.all()
    assert comparison.max_relative_error < 1e-4  # the compiled sweep's last step


# --- POD against raw snapshots ---------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def training(small_model, small_basis_file):
    """Case, model, roll positions and forces of the small model's training."""
    case, model = small_model
    path = small_basis_file(shapes="positions")
    with h5py.File(path) as file:
        force = file["training/force"][()]
    reduced = reduced_pair(read_basis(path))
    return reduced, model, (model.pinion, model.wheel), reduced.basis.shapes.roll_position, force


def elasticity(shapes):
    return partial(shape_elasticity, shapes.family)


@pytest.mark.parametrize("interpolation", ["linear", "cubic"])
def test_pod_that_discards_nothing_spans_the_raw_snapshots(interpolation, training):
    reduced, _, bodies, grid, force = training
    meshed, phi = reduced.meshed, reduced.basis.training.phi
    modes = local_modes(bodies, force, 1e-15)
    assert modes.shape[1] == force.shape[1]
    shapes = shapes_of(bodies, grid, 6, modes, interpolation)
    raw = contact_shapes(*bodies, grid, 6, force)
    expected = ste_of(meshed, elasticity(raw), phi)
    assert_allclose(ste_of(meshed, elasticity(shapes), phi), expected, rtol=SAME_SPAN)
    # At the training torques both are full FE.
    trained = reduced.basis.training
    found = ste_of(meshed, elasticity(shapes), phi, trained.torque[:, 0])
    assert_allclose(found, trained.ste_um, rtol=1e-6)


def test_the_compiled_sweep_of_cubics_through_pod_modes_is_its_slow_twin(small_model, small_basis_file):
    """The other families: test_compiled_sweep."""
    reduced = reduced_pair(read_basis(small_basis_file(shapes="pod", interpolation="cubic")))
    phi = unseen(small_model[1], 5)
    fast = sweep_reduced_pair(reduced, phi, at_torques([60e3, 100e3]), tolerance=1e-9)
    assert_allclose(fast.ste_um, ste_of(reduced.meshed, reduced.elasticity_at, phi), rtol=1e-8)
