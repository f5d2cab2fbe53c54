"""What a reduced sweep gives beside STE: contact forces and amplitudes."""

from concurrent.futures import ThreadPoolExecutor
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.case import parse_case
from pmor.gear.condition import ALIGNED, Condition, Misalignment, at_torques
from pmor.pair.model import elastic_model, mesh_model
from pmor.penalty.solve import solve_position
from pmor_offline.gather import make_basis
from pmor_offline.sampling import TrainingPosition
from pmor_offline.snapshots import solve_snapshots
from pmor_online.model import reduced_pair
from pmor_online.sweep import sweep_reduced_pair
from tests.support.small_case import case_text

pytestmark = pytest.mark.jit
TORQUES = 4e4, 1e5  # N mm
TIGHT = {"tolerance": 1e-9}
SAME_STATE = 1e-8  # of two ways to solve for a state to a residual of 1e-9
TILTED = Misalignment(in_plane_um=10.0, out_of_plane_um=-6.0)


@cache
def reduced_with(scheme):
    text = case_text(
        contact={"scheme": scheme}, mesh={"profile_elements": 6, "width_elements": 2, "width": "whole"},
        offline={"angles_per_pitch": 6},
    )  # fmt: skip
    case = parse_case(text, "small", "small case")
    model = elastic_model(case, mesh_model(case))
    pair = model.mesh.meshed.pair
    phi = pair.roll_position_range[0] + pair.pitch * np.arange(6) / 6
    snapshots = [solve_snapshots(model, TrainingPosition(float(p), (Condition(torque=1.5e5),))) for p in phi]
    return reduced_pair(make_basis(case, model, snapshots)[0])


def angles(reduced, count=5):
    return reduced.meshed.pair.pitch * (np.arange(count) + 0.3) / count


def points_of(loads, torque, angle):
    """The points of one state."""
    first = loads.first[torque, angle]
    return slice(first, first + loads.count[torque, angle])


@pytest.mark.parametrize("misalignment", [ALIGNED, TILTED], ids=["aligned", "tilted"])
@pytest.mark.parametrize("scheme", ["facet", "direct"])
def test_contact_forces_of_a_sweep_carry_the_torque_pair_by_pair(scheme, misalignment):
    reduced = reduced_with(scheme)
    sweep = sweep_reduced_pair(reduced, angles(reduced), at_torques(TORQUES, misalignment), recorded=True, **TIGHT)
    loads = sweep.states.loads
    assert sweep.converged.all()
    assert loads.count.min() > 0
    assert loads.count.sum() == len(loads.force_N)
    assert np.all(loads.force_N > 0.0)
    for t, torque in enumerate(TORQUES):
        for i in range(len(sweep.phi_rad)):
            state = points_of(loads, t, i)
            parts = -loads.force_N[state] * loads.lever_mm[state]
            found = [parts[loads.pair[state] == index].sum() / torque for index in sweep.pair_index]
            assert_allclose(found, sweep.pair_share[t, i], rtol=0.0, atol=SAME_STATE)
            assert_allclose(parts.sum(), torque, rtol=SAME_STATE)


def test_contact_forces_act_where_the_slow_twin_has_them():
    """Each at its place on both flanks: on the line of action of the pair, to the width of the contact."""
    reduced = reduced_with("direct")
    pair, phi = reduced.meshed.pair, angles(reduced)
    sweep = sweep_reduced_pair(reduced, phi, at_torques(TORQUES), recorded=True, **TIGHT)
    loads = sweep.states.loads
    for i, angle in enumerate(phi):
        solved = solve_position(reduced.meshed, angle, at_torques(TORQUES), reduced.elasticity_at)
        for t, equilibrium in enumerate(solved.equilibria):
            state, contact = points_of(loads, t, i), equilibrium.contact
            for index in solved.position.pair_index:
                mine = loads.pair[state] == index
                force = loads.force_N[state][mine]
                if force.sum() > 0.2 * contact.force.sum():
                    rolls = pair.contact_roll_angles(np.array(angle + index * pair.pitch))
                    inside = [np.clip(r, f.roll_angle[0], f.roll_angle[-1]) for r, f in
                              zip(rolls, (reduced.meshed.pinion, reduced.meshed.wheel), strict=True)]  # fmt: skip
                    assert_allclose(np.average(loads.roll_rad[state][mine], axis=0, weights=force), inside, atol=0.05)


def test_a_plain_sweep_is_the_same_sweep_and_keeps_nothing():
    reduced = reduced_with("direct")
    phi = angles(reduced, 30)
    plain, recorded = (sweep_reduced_pair(reduced, phi, at_torques(TORQUES), recorded=r) for r in (False, True))
    assert plain.states is None
    assert np.array_equal(plain.ste_um, recorded.ste_um)
    assert_allclose(
        1e3 * recorded.states.advance_rad * reduced.meshed.pair.pinion.base_radius, plain.ste_um, rtol=1e-15
    )


def test_threads_do_not_change_what_is_recorded():
    reduced = reduced_with("direct")
    phi = angles(reduced, 60)  # three blocks
    one = sweep_reduced_pair(reduced, phi, at_torques(TORQUES), recorded=True)
    with ThreadPoolExecutor(2) as executor:
        two = sweep_reduced_pair(reduced, phi, at_torques(TORQUES), executor, recorded=True)
    for name, values in vars(one.states.loads).items():
        assert np.array_equal(values, getattr(two.states.loads, name)), name
    assert np.array_equal(one.states.amplitude, two.states.amplitude)
