"""The error bar of the reduced model: where it is a bound, how near it is, and what it costs nothing to get wrong."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.gear.condition import ALIGNED, Condition, at_torques
from pmor.pair.sweep import sweep_ste
from pmor.penalty.solve import solve_position
from pmor_offline.gather import make_basis
from pmor_offline.sampling import TrainingPosition, sobol_positions
from pmor_offline.snapshots import solve_snapshots
from pmor_online.errors import estimate_errors
from pmor_online.model import reduced_pair
from pmor_online.sweep import sweep_reduced_pair
from tests.support.discarded_energy import discarded_energy_slope
from tests.support.small_case import case_with, full_fe

pytestmark = pytest.mark.jit
TORQUES = 3e4, 1e5  # N mm
TILT = (-15.0, 15.0)


@cache
def setting(scheme="direct", tilted=False, shapes="flank_lines"):
    """A case and its full model, trained so poorly that errors are seen."""
    spread = {"in_plane_um": TILT, "out_of_plane_um": TILT} if tilted else {}
    case = case_with(
        mesh={"profile_elements": 8, "width_elements": 4}, contact={"scheme": scheme, "lodm_profile": 4},
        reduction={"shapes": shapes, "distribution_tolerance": 0.02},
        offline={"angles_per_pitch": 6, "torques_Nm": [20.0, 150.0], **{k: list(v) for k, v in spread.items()}},
    )  # fmt: skip
    return case, full_fe(case)


@cache
def poor_basis(scheme="direct", tilted=False, shapes="flank_lines"):
    case, model = setting(scheme, tilted, shapes)
    phi = model.mesh.meshed.pair.roll_position_range[0] + model.mesh.meshed.pair.pitch * np.arange(6) / 6
    one = (Condition(torque=1.5e5),)
    snapshots = [solve_snapshots(model, TrainingPosition(float(p), one)) for p in phi]
    if shapes == "flank_lines":
        case = replace(case, offline=replace(case.offline, sampling="sobol"))
    return make_basis(case, model, snapshots)[0]


def states(reduced, phi, misalignment=ALIGNED):
    solved = solve_position(reduced.meshed, phi, at_torques(TORQUES, misalignment), reduced.elasticity_at)
    return solved.position, reduced.elasticity_at(solved.position), solved.equilibria


@pytest.mark.parametrize("scheme", [pytest.param("direct", marks=pytest.mark.slow), "facet"])
@pytest.mark.parametrize("shapes", ["flank_lines", "positions", "pod", "global_pod", "static_modes"])
def test_the_kernel_estimates_what_its_slow_twin_does(scheme, shapes):
    reduced = reduced_pair(poor_basis(scheme, shapes=shapes))
    meshed = reduced.meshed
    phi = np.linspace(0.0, meshed.pair.pitch, 7)[:-1] + 0.003
    sweep = sweep_reduced_pair(reduced, phi, at_torques(TORQUES), tolerance=1e-10)
    for i, angle in enumerate(phi):
        position, elasticity, equilibria = states(reduced, float(angle))
        for t, state in enumerate(equilibria):
            slope = discarded_energy_slope(reduced.basis.compliance, position, elasticity, state.contact)
            # The energies that nearly cancel are those of the STE itself.
            atol = 1e-7 * abs(sweep.ste_um[t, i])
            expected = 1e3 * meshed.pair.pinion.base_radius * slope
            assert_allclose(sweep.ste_error_um[t, i], expected, rtol=1e-5, atol=atol)


@pytest.mark.parametrize(("tilted", "least_um"), [(False, 1e-4), (True, 2e-3)])
def test_estimate_is_near_the_error_at_states_that_no_training_saw(tilted, least_um):
    """40 states over angle, torque and misalignment: the size, on the safe side, and the order of the states."""
    from scipy.stats import spearmanr

    case, model = setting(tilted=tilted)
    basis = poor_basis()
    if tilted:
        case = replace(case, offline=replace(case.offline, sampling="sobol"))
        few = sobol_positions(case.offline, model.mesh.meshed.pair, 16)
        basis = make_basis(case, model, [solve_snapshots(model, p) for p in few])[0]
    base_radius = model.mesh.meshed.pair.pinion.base_radius
    unseen = sobol_positions(case.offline, model.mesh.meshed.pair, 40, seed=5)
    conditions = [p.conditions[0] for p in unseen]
    ste, estimate = estimate_errors(basis, np.array([p.phi for p in unseen]), conditions)
    true = np.empty(len(unseen))
    for i, (position, condition) in enumerate(zip(unseen, conditions, strict=True)):
        state = solve_position(model.mesh.meshed, position.phi, [condition], model.elasticity_at).equilibria[0]
        true[i] = 1e3 * base_radius * state.advance - ste[i]
    counted = np.abs(true) > least_um
    assert counted.sum() > 5
    ratio = np.abs(estimate[counted] / true[counted])
    assert np.mean((ratio > 0.24) & (ratio < 17.0)) >= 0.95
    assert spearmanr(np.abs(estimate), np.abs(true)).statistic > 0.6


def test_the_longest_bar_covers_the_largest_error_and_is_so_much_longer_at_most():
    """Here 3.8: a bar of points follows the row that comes to carry under a little more torque."""
    case, model = setting()
    meshed = model.mesh.meshed
    phi = meshed.pair.pitch * (np.arange(30) + 0.3) / 30
    sweep = sweep_reduced_pair(reduced_pair(poor_basis()), phi, at_torques(TORQUES))
    exact = sweep_ste(meshed, model.elasticity_at, phi, at_torques(TORQUES))
    error = np.abs(exact.ste_um - sweep.ste_um).max(axis=1)
    bar = np.abs(sweep.ste_error_um).max(axis=1)
    assert np.all(bar > 0.9 * error)
    assert np.all(bar < 40.0 * error)


def test_without_compliance_in_the_basis_there_is_no_error_bar():
    basis = replace(poor_basis(), compliance=None)
    sweep = sweep_reduced_pair(reduced_pair(basis), np.array([0.1]), at_torques(TORQUES))
    assert sweep.ste_error_um is None
    assert np.isfinite(sweep.ste_um).all()
