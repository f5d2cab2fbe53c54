"""Primal against dual form of an equilibrium; conditions that are solved together; threads."""

from concurrent.futures import ThreadPoolExecutor
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from pmor.case import parse_case
from pmor.gear.condition import Condition, Misalignment, at_torques
from pmor.pair.model import elastic_model, mesh_model
from pmor.pair.sweep import sweep_ste
from pmor.penalty.elasticity import ReducedElasticity
from pmor.penalty.equilibrium import solve_equilibrium
from pmor.penalty.position import active_patches
from tests.support.small_case import case_text
from tests.support.states import states_at

TILTED = Misalignment(in_plane_um=30.0, out_of_plane_um=-20.0, centre_distance_um=40.0)
TORQUES = [2e4, 1e5, 3e5]  # N mm; under much less, round-off of the coordinates shows


@cache
def model(scheme):
    mesh = {"profile_elements": 6, "width_elements": 2, "width": "whole"}
    case = parse_case(case_text(mesh=mesh, contact={"scheme": scheme}), "small", "small")
    return elastic_model(case, mesh_model(case))


def test_the_primal_form_of_a_reduced_model_gives_the_same_state():
    """All displacements of the window as active shapes: stiffness of amplitudes against flexibility of points."""
    pair = model("direct")
    position = active_patches(pair.mesh.meshed, 0.1, 0.05)
    full = pair.elasticity_at(position)
    values, vectors = np.linalg.eigh(full.compliance)
    kept = values > 1e-14 * values.max()
    active_shapes = vectors[:, kept] * np.sqrt(values[kept])
    reduced = ReducedElasticity(active_shapes.reshape(len(position.nodes), 3, -1))
    condition = Condition(torque=1e5)
    found, expected = (solve_equilibrium(pair.mesh.meshed, position, e, condition) for e in (reduced, full))
    pairs = len(position.pair_index)
    assert_allclose(found.pair_torque(pairs), expected.pair_torque(pairs), rtol=1e-6, atol=1e-6)


def test_conditions_that_share_windows_share_their_axes():
    conditions = [*at_torques([1e5]), *at_torques([1e5], TILTED)]
    for scheme in ("line", "direct"):
        with pytest.raises(ValueError, match="need the same axes and flanks, not 2"):
            states_at(model(scheme), 0.1, conditions)


def test_threads_change_nothing():
    pair = model("direct")
    meshed, calls = pair.mesh.meshed, []
    phi = meshed.pair.pitch * np.linspace(0.0, 0.9, 5)
    with ThreadPoolExecutor(2) as executor:
        sweeps = [
            sweep_ste(meshed, pair.elasticity_at, phi, at_torques(TORQUES), lambda: calls.append(1), way)
            for way in (None, executor)
        ]
    assert len(calls) == 2 * len(phi)
    for name in ("ste_um", "pair_share", "newton_steps"):
        assert_array_equal(getattr(sweeps[0], name), getattr(sweeps[1], name))
