"""The compiled sweep over the reduced pair against its slow twin, from wherever it starts; forces and amplitudes."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import cache, partial

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor.penalty.equilibrium
import pmor.penalty.pair
import pmor.penalty.solve
from pmor.gear.condition import ALIGNED, PLAIN, Condition, Misalignment, at_torques
from pmor.pair.sweep import sweep_ste
from pmor.penalty.kernels.shapes import shape_slots
from pmor.penalty.kernels.sweep import Neighbour, carry_along, place_position
from pmor.penalty.solve import solve_position
from pmor_offline.gather import make_basis
from pmor_offline.sampling import TrainingPosition
from pmor_offline.snapshots import solve_snapshots
from pmor_online.model import reduced_pair
from pmor_online.sweep import sweep_reduced_pair
from tests.support.small_case import case_with, full_fe

NEWTON = 1e-8  # the equilibrium is solved to a relative residual of 1e-9; a different path may leave some of it
# The compiled sweep takes a last step from a relative residual of 1e-4, and its feet may be a hundredth of an element
# off when the first guess is that good. Measured 2.8e-5 on these coarse meshes, 2e-6 and less on fine ones.
LAST_STEP = 5e-5
# Both twins solved as far as doubles go, um: gaps are differences of coordinates of the size of the centre distance,
# so that two ways of adding them up differ by some units in the last place of these. Measured: six.
LAST_PLACES = 30.0 * 84e3 * np.finfo(float).eps


def tight_advances_um(reduced, phi, torques):
    """STE by the slow twin, shape (torques, angles): solved to the last digit, and a last step like the sweep's."""
    ste = np.full((len(torques), len(phi)), np.nan)
    for i, angle in enumerate(phi):
        solved = solve_position(reduced.meshed, float(angle), at_torques(torques), reduced.elasticity_at)
        elasticity = reduced.elasticity_at(solved.position)
        for t, e in enumerate(solved.equilibria):
            if e is None:
                continue
            elastic = e.contact.gap_change(elasticity.displacement(e.coordinates))
            _, rotation = elasticity.newton_step(e.contact, e.contact.gap - elastic, torques[t])
            ste[t, i] = (e.advance + rotation) * reduced.meshed.pair.pinion.base_radius * 1e3
    return ste


@pytest.mark.slow
@pytest.mark.jit
@pytest.mark.parametrize("slave", ["tip", "both"])
def test_compiled_sweep_is_its_slow_twin_to_the_last_places(slave, reduced, monkeypatch):
    # The twin looks for each foot anew: its normals are as good as its last step, which the sweep repeats instead.
    monkeypatch.setattr(pmor.penalty.pair, "FOOT_STEP", 1e-10)
    monkeypatch.setattr(pmor.penalty.equilibrium, "ROUND_OFF_FACTOR", 20.0)
    monkeypatch.setattr(pmor.penalty.equilibrium, "LINEAR", 0.0)
    solve = partial(pmor.penalty.solve.solve_equilibrium, tolerance=1e-10)
    monkeypatch.setattr(pmor.penalty.solve, "solve_equilibrium", solve)
    reduced = with_slave(reduced, slave)
    phi = reduced.meshed.pair.pitch * np.arange(40) / 40
    fast = sweep_reduced_pair(reduced, phi, at_torques([60e3, 100e3]), tolerance=1e-10)
    slow = tight_advances_um(reduced, phi, [60e3, 100e3])
    both = fast.converged & np.isfinite(slow)
    assert both.mean() > 0.9, "round-off seldom stops Newton above 1e-10"
    difference = np.abs(fast.ste_um - slow)[both]
    assert np.median(difference) < 0.1 * LAST_PLACES
    assert np.quantile(difference, 0.95) < LAST_PLACES
    # A foot within 1e-5 of the edge between two patches stays with the one that it was on before: a kink apart.
    assert_allclose(fast.ste_um[both], slow[both], rtol=NEWTON)


@pytest.mark.parametrize("torque", [1e-6, 1e-9])
def test_what_converged_is_a_number(torque, reduced):
    """Under loads that round-off hides, N mm, a tolerance that follows it lets everything pass."""
    sweep = sweep_reduced_pair(reduced, reduced.meshed.pair.pitch * np.arange(8) / 8, at_torques([torque]))
    assert np.isfinite(sweep.ste_um[sweep.converged]).all()


def with_slave(reduced, slave):
    """The same shapes with another gear as the slave: their contact is another, their elasticity the same."""
    scheme = replace(reduced.meshed.scheme, slave=slave)
    return replace(reduced, meshed=replace(reduced.meshed, scheme=scheme))


def test_compiled_sweep_is_its_slow_twin(reduced):
    phi = reduced.meshed.pair.pitch * np.arange(5) / 5
    torques = [60e3, 100e3]
    slow = sweep_ste(reduced.meshed, reduced.elasticity_at, phi, at_torques(torques))
    fast = sweep_reduced_pair(reduced, phi, at_torques(torques))
    assert slow.converged.all()
    assert fast.converged.all()
    assert_allclose(fast.ste_um, slow.ste_um, rtol=LAST_STEP)
    assert_allclose(fast.torque_Nm, [60.0, 100.0])
    # Fractions of the torque, pair by pair; the twins may list idle pairs differently.
    for index in set(fast.pair_index) | set(slow.pair_index):
        shares = [s.pair_share[..., s.pair_index == index].sum(axis=2) for s in (fast, slow)]
        assert_allclose(*shares, rtol=0.0, atol=1e-5)


def cold_sweeps(reduced, phi, torques, **options):
    """Each angle on its own."""
    return [sweep_reduced_pair(reduced, phi[i : i + 1], at_torques(torques), **options) for i in range(len(phi))]


@pytest.mark.jit
def test_where_a_sweep_starts_does_not_change_it(reduced):
    """Each angle from the amplitudes of the one before, carried along with the contact, or from nothing."""
    phi, torques = reduced.meshed.pair.pitch * np.arange(7) / 7, [60e3, 100e3]
    cold = np.concatenate([sweep.ste_um for sweep in cold_sweeps(reduced, phi, torques, tolerance=1e-9)], axis=1)
    forth, back = (sweep_reduced_pair(reduced, p, at_torques(torques), tolerance=1e-9).ste_um for p in (phi, phi[::-1]))
    assert_allclose(forth, cold, rtol=NEWTON)
    assert_allclose(back[:, ::-1], cold, rtol=NEWTON)


def placed(reduced, tooth_pairs, centre, slots):
    """A position with given active shapes; only which and where they are matters."""
    meshed, pairs = reduced.meshed, len(tooth_pairs)
    position = place_position(
        0.1, 0.01, meshed.for_kernels(PLAIN), reduced.family, meshed.tooth_pair_count, meshed.scheme.clearance
    )
    patches = position.patches._replace(pairs=pairs, tooth_pair=tooth_pairs, centre=centre)
    return position._replace(
        patches=patches, active_shapes=position.active_shapes._replace(size=len(slots), slot=slots)
    )


def test_amplitudes_of_lines_are_carried_along_with_the_contact(reduced_by):
    """From the position before: of the same pair, as far back along the flank as the contact has moved on it."""
    family = reduced_by("lines").family
    starts = [lines.start for lines in family.lines]
    first_lines = [(gear, line) for gear in range(2) for line in range(len(starts[gear]) - 1)]
    slot = {(gear, line): starts[gear][line] + gear * starts[0][-1] for gear, line in first_lines}

    def amplitude_of(pair, gear, line):  # a cubic, which the interpolation between lines does exactly
        return (1.0 + pair) * (2.0 - gear) * (line - 1.5) ** 3 + line

    slots = shape_slots(family)
    assert slots == starts[0][-1] + starts[1][-1]
    before = np.zeros((3, slots))
    for pair in range(3):
        for gear, line in first_lines:
            before[pair, slot[gear, line]] = amplitude_of(pair, gear, line)
    # Pair 5 + p was number p then; now 6, 7 and one that was not there can touch.
    indices, moved = np.array([6, 7, 8]), np.array([[0.4, -0.3], [0.2, -0.6], [0.1, -0.1]])
    then = np.array([[1.0, 4.0], [2.0, 3.0], [3.0, 2.0]])
    now = np.vstack([then[1:], then[:1]]) + moved
    kept = np.array([p * slots + slot[gear, line] for p in range(3) for gear, line in first_lines])
    coordinates = np.full(len(kept), np.nan)
    neighbour = Neighbour(np.ones(1, dtype=bool), np.zeros(1), before[None], np.arange(5, 8), then)
    carry_along(0, family, placed(reduced_by("lines"), indices, now, kept), neighbour, coordinates)
    found = coordinates.reshape(3, len(first_lines))
    assert not found[2].any(), "a pair that has just come into contact"
    last = len(starts[0]) - 2
    for p, pair in ((0, 1), (1, 2)):
        for value, (gear, line) in zip(found[p], first_lines, strict=True):
            if 2 <= line <= last - 2:  # four lines to go by
                assert_allclose(value, amplitude_of(pair, gear, line - moved[p, gear]), rtol=1e-12)


# --- contact forces and amplitudes -----------------------------------------------------------------------------------

TORQUES = 4e4, 1e5  # N mm
TIGHT = {"tolerance": 1e-9}
SAME_STATE = 1e-8  # of two ways to solve for a state to a residual of 1e-9
TILTED = Misalignment(in_plane_um=10.0, out_of_plane_um=-6.0)


@cache
def reduced_with(scheme):
    case = case_with(
        contact={"scheme": scheme}, mesh={"profile_elements": 6, "width_elements": 2, "width": "whole"},
        offline={"angles_per_pitch": 6},
    )  # fmt: skip
    model = full_fe(case)
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


@pytest.mark.jit
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


@pytest.mark.jit
def test_threads_do_not_change_what_is_recorded():
    reduced = reduced_with("direct")
    phi = angles(reduced, 60)  # three blocks
    one = sweep_reduced_pair(reduced, phi, at_torques(TORQUES), recorded=True)
    with ThreadPoolExecutor(2) as executor:
        two = sweep_reduced_pair(reduced, phi, at_torques(TORQUES), executor, recorded=True)
    for name, values in vars(one.states.loads).items():
        assert np.array_equal(values, getattr(two.states.loads, name)), name
    assert np.array_equal(one.states.amplitude, two.states.amplitude)
