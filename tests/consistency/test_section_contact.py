"""Contact in sections on exact flanks, in the full and in the reduced model: line and strip."""

import pytest
from numpy.testing import assert_allclose

from pmor.case import parse_case
from pmor.gear.condition import Condition, at_torques
from pmor.jobs.offline import run_offline
from pmor.pair.model import elastic_model, mesh_model
from pmor.pair.sweep import sweep_ste
from pmor.storage.basis_file import read_basis
from pmor_online.contact_pattern import contact_patterns
from pmor_online.model import reduced_pair, unseen_angles
from pmor_online.sweep import sweep_reduced_pair
from tests.support.small_case import case_text

TORQUES = [60e3, 100e3]
# The sweep stops at a relative residual of 1e-4 and takes one step more, on a law that is nearly linear.
LAST_STEP = 5e-5
SAME_ANSWER = 1e-9  # half the width is the whole, by symmetry
# One distribution per line of 5 x 2 elements; measured 4e-4 (line) and 6e-4 (strip), 5e-5 on the paper's mesh.
REDUCED = 2e-3
# All cells together are all forces. Deformed strips do not push quite along the line of action: measured 1.2e-4.
CARRIED = 5e-4


def section_case(scheme, width):
    mesh, offline = {"profile_elements": 5, "width_elements": 2, "width": width}, {"angles_per_pitch": 8}
    contact = None if scheme == "line" else {"scheme": scheme, "lodm_profile": 1}
    text = case_text(mesh=mesh, offline=offline, contact=contact)
    return parse_case(text, scheme, f"{scheme} case")


@pytest.fixture(scope="module", params=["line"])
def pair(request, tmp_path_factory):
    """Full model, and reduced models, of half and of the whole width, and in plane strain."""
    models, reduced = [], []
    for width in ("half", "whole", "plane_strain"):
        case = section_case(request.param, width)
        models.append(elastic_model(case, mesh_model(case)))
        path = tmp_path_factory.mktemp("basis") / "basis.h5"
        assert run_offline(case, models[-1], path).failed == ()
        reduced.append(reduced_pair(read_basis(path)))
    return models, reduced


@pytest.fixture(scope="module")
def phi(pair):
    gears = pair[0][0].mesh.meshed.pair
    return unseen_angles(gears.roll_position_range[0], gears.pitch, 6, 8)


@pytest.mark.jit
def test_compiled_sweep_is_its_slow_twin(pair, phi):
    reduced = pair[1][0]
    fast = sweep_reduced_pair(reduced, phi, at_torques(TORQUES))
    slow = sweep_ste(reduced.meshed, reduced.elasticity_at, phi, at_torques(TORQUES))
    assert fast.converged.all()
    assert_allclose(fast.ste_um, slow.ste_um, rtol=LAST_STEP)
    tight = sweep_reduced_pair(reduced, phi, at_torques(TORQUES), tolerance=1e-10)
    assert_allclose(tight.ste_um, slow.ste_um, rtol=1e-8)


def test_reduced_model_agrees_with_full_fe(pair, phi):
    for model, reduced in zip(*pair, strict=True):
        full = sweep_ste(model.mesh.meshed, model.elasticity_at, phi, at_torques(TORQUES))
        fast = sweep_reduced_pair(reduced, phi, at_torques(TORQUES))
        assert_allclose(fast.ste_um, full.ste_um, rtol=REDUCED)


def test_half_the_width_is_the_whole(pair, phi):
    half, whole = (sweep_reduced_pair(reduced, phi, at_torques(TORQUES), tolerance=1e-10) for reduced in pair[1][:2])
    assert_allclose(half.ste_um, whole.ste_um, rtol=SAME_ANSWER)


def test_drawn_pressure_carries_the_load_over_the_whole_face(pair):
    for reduced in pair[1]:
        patterns = contact_patterns(reduced, 0.1, Condition(torque=100e3))
        for pattern in patterns:
            assert (pattern.pressure >= 0.0).all()
            assert_allclose(pattern.width[[0, -1]], [-10.0, 10.0], rtol=0.0, atol=1e-12)
        force = sum(pattern.force.sum() for pattern in patterns)
        assert_allclose(force, 100e3 / reduced.meshed.pair.pinion.base_radius, rtol=CARRIED)
        assert_allclose(sum(pattern.share for pattern in patterns), 1.0, rtol=1e-12)
