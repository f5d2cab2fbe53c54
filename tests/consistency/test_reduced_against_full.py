"""The reduced model against full FE where it was not trained: convergence, fine meshes, the paper's case."""

from pathlib import Path

import numpy as np
import pytest

from pmor.case import change_case, load_case, parse_case
from pmor.gear.condition import at_torques
from pmor.pair.model import elastic_model, mesh_model
from pmor.pair.sweep import sweep_ste
from pmor.storage.basis_file import read_basis
from pmor.work.offline import run_offline
from pmor_online.compare import compare_models
from pmor_online.model import reduced_pair
from pmor_online.sweep import sweep_reduced_pair
from tests.support.small_case import case_text

CASES = Path(__file__).parents[2] / "cases"


def relative_errors(model, case, path, phi, full):
    """Reduced against full STE at pinion angles of one's choice."""
    assert run_offline(case, model, path).failed == ()
    reduced = reduced_pair(read_basis(path))
    sweep = sweep_reduced_pair(reduced, phi, at_torques(1e3 * full.torque_Nm))
    assert sweep.converged.all()
    return np.abs(sweep.ste_um / full.ste_um - 1.0)


def rms(error):
    return np.sqrt(np.mean(error**2))


def unseen_sweep(model, count=60):
    """Full FE at midpoints of parts of the pitch, which are never on a grid of training angles."""
    meshed = model.mesh.meshed
    phi = meshed.pair.roll_position_range[0] + meshed.pair.pitch * (np.arange(count) + 0.5) / count
    full = sweep_ste(meshed, model.elasticity_at, phi, at_torques([60e3, 100e3]))
    assert full.converged.all()
    return phi, full


@pytest.mark.jit
def test_error_falls_with_the_number_of_training_angles(tmp_path):
    """The median over the pitch: linear interpolation is of second order inside, where most positions are.

    Where a pair enters or leaves contact the load it carries has a kink, and the largest errors sit there: they fall
    more slowly and less evenly, so the root mean square only has to fall. Flank lines are not interpolated.
    """

    def case_with(angles, shapes):
        text = case_text(
            mesh={"profile_elements": 6, "width_elements": 2},
            contact={"lodm_profile": 4},
            reduction={"shapes": shapes},
            offline={"angles_per_pitch": angles},
        )
        return parse_case(text, "convergence", "convergence")

    model = elastic_model(case_with(8, "positions"), mesh_model(case_with(8, "positions")))
    phi, full = unseen_sweep(model)
    grids = (8, 16, 32)
    errors = [relative_errors(model, case_with(n, "positions"), tmp_path / f"{n}.h5", phi, full) for n in grids]
    orders = -np.diff(np.log2([np.median(error) for error in errors]))
    assert (orders > 1.0).all(), f"orders {orders}"
    assert (np.diff([rms(error) for error in errors]) < 0.0).all()
    lines = relative_errors(model, case_with(8, "flank_lines"), tmp_path / "lines.h5", phi, full)
    # Measured 1.7e-4 against 1.5e-3.
    assert rms(lines) < 0.2 * rms(errors[-1]), "with a quarter of the training"


@pytest.mark.jit
def test_lines_from_one_torque_and_ten_angles_are_within_a_thousandth_of_full_fe(tmp_path):
    """Measured 1.7e-4 at most, at 60 N m, for which nothing was trained. Interpolated positions: 1.3e-2."""
    text = case_text(
        mesh={"profile_elements": 10, "width_elements": 2},
        contact={"lodm_profile": 4},
        offline={"angles_per_pitch": 10, "torques_Nm": [100.0]},
    )
    case = parse_case(text, "scanty", "scanty")
    model = elastic_model(case, mesh_model(case))
    phi, full = unseen_sweep(model, 30)
    assert relative_errors(model, case, tmp_path / "basis.h5", phi, full).max() < 1e-3


@pytest.mark.jit
@pytest.mark.parametrize("width_elements", [1, 2])
def test_lines_are_far_closer_to_full_fe_than_interpolated_positions_on_fine_meshes(width_elements, tmp_path):
    """The contact passes three elements from one trained position to the next: dents at places in between.

    Measured 1.4e-4 (one element over the width, where lines have no distribution to choose) and 2.1e-3 (two) against
    7e-2.
    """
    errors = {}
    for shapes in ("flank_lines", "positions"):
        text = case_text(
            mesh={"profile_elements": 24, "width_elements": width_elements},
            contact={"lodm_profile": 1},
            reduction={"shapes": shapes},
            offline={"angles_per_pitch": 8},
        )
        case = parse_case(text, "fine", "fine")
        if not errors:
            model = elastic_model(case, mesh_model(case))
            phi, full = unseen_sweep(model, 20)
        errors[shapes] = rms(relative_errors(model, case, tmp_path / f"{shapes}.h5", phi, full))
    assert 5.0 * errors["flank_lines"] < errors["positions"]


@pytest.fixture(scope="module")
def paper():
    case = load_case(CASES / "paper_spur.toml")
    return case, elastic_model(case, mesh_model(case))


@pytest.mark.jit
def test_paper_case_reduced_against_full_at_unseen_positions(paper, tmp_path):
    case, model = paper
    assert case.compare.angles >= 40
    assert case.compare.torques_Nm == (30.0, 100.0, 160.0)
    assert run_offline(case, model, tmp_path / "basis.h5").failed == ()
    comparison = compare_models(reduced_pair(read_basis(tmp_path / "basis.h5")), model)
    assert comparison.full.converged.all()
    assert comparison.reduced.converged.all()
    assert comparison.max_relative_error <= 2e-4  # measured 6.7e-5
    assert comparison.rms_relative_error <= 5e-5  # measured 1.3e-5


@pytest.mark.jit
def test_paper_case_reduced_by_interpolated_positions(tmp_path):
    """The paper's own family of shapes, on its own contact."""
    case = change_case(load_case(CASES / "paper_hermite.toml"), reduction={"shapes": "positions"})
    model = elastic_model(case, mesh_model(case))
    assert run_offline(case, model, tmp_path / "basis.h5").failed == ()
    comparison = compare_models(reduced_pair(read_basis(tmp_path / "basis.h5")), model)
    assert comparison.max_relative_error <= 3e-3
    assert comparison.rms_relative_error <= 1e-3
