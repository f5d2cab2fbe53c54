"""The loaded pair: balances, energy, periodicity, limits, and two ways to the same answer."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.contact.elasticity import ReducedElasticity, full_elasticity
from pmor.contact.equilibrium import solve_equilibrium
from pmor.contact.position import active_patches, overshoot, pairs_in_reach
from pmor.contact.search import search_contact
from pmor.contact.solve import solve_position, surface_error, window_depth
from pmor.conventions import rotation_z
from pmor.errors import ConvergenceError
from tests.gear_models import body, gear_pair, meshed_pair, tooth

TORQUE = 1e5  # N mm, the paper pair's nominal load
NEWTON = 1e-9  # relative residual at which the solver stops
SAME_STATE = 1e-8  # relative; the same equilibrium, reached on two ways
FORCE_BALANCE = 1e-10  # of the load; both gears get the same nodal forces with opposite signs
# Of the torque; bilinear transfer puts a force where the facet under the patch is, up to a few um off its line.
MOMENT_BALANCE = 1e-4
DEPTH = 0.15  # mm, for windows with room to spare

PAIRS = {
    "paper": gear_pair(tooth(21), tooth(21)),
    "unequal": gear_pair(tooth(17, 0.4), tooth(31, 0.1)),
    "unequal, wide": gear_pair(tooth(23), tooth(17, 0.2), extra_distance=0.3),
}
SMALL = (6, 2)
every_pair = pytest.mark.parametrize("pair", PAIRS.values(), ids=PAIRS.keys())


class Model:
    """Full FE of a pair with a coarse mesh."""

    def __init__(self, pair, mesh=SMALL, **scheme):
        self.pair, self.meshed = pair, meshed_pair(pair, *mesh, **scheme)
        self.bodies = body(pair.pinion, *mesh), body(pair.wheel, *mesh)
        self.base_radius = pair.pinion.base_radius

    def elasticity(self, position):
        return full_elasticity(*self.bodies, position)

    def phi(self, share):
        """Pinion angle at a share of the pitch after a pair has come into mesh."""
        return self.pair.roll_position_range[0] + share * self.pair.pitch

    def solve(self, phi, torque=TORQUE, **options):
        position = active_patches(self.meshed, phi, DEPTH)
        elasticity = self.elasticity(position)
        return position, elasticity, solve_equilibrium(self.meshed, position, elasticity, torque, **options)

    def ste_um(self, phi, torque=TORQUE, **options):
        return self.solve(phi, torque, **options)[2].lead * self.base_radius * 1e3


def rigid_lead(meshed, phi):
    """Lead at which the undeformed flanks just touch, rad."""
    position, lead = active_patches(meshed, phi, 0.05), 0.0
    for _ in range(50):
        gap = search_contact(meshed, position, np.zeros_like(position.nodes), lead).smallest_gap
        lead += gap / meshed.pair.pinion.base_radius
        if abs(gap) < 1e-10:
            return lead
    raise AssertionError("the rigid flanks did not meet")


# --- balances ------------------------------------------------------------------------------------------------------


def global_forces(model, position, elasticity, equilibrium):
    """Nodal forces and the deformed places they act at, in the global frame, of pinion and wheel."""
    contact, pair = equilibrium.contact, model.pair
    nodal = contact.nodal_forces(contact.force, len(position.nodes))
    places = position.nodes + elasticity.displacement(equilibrium.coordinates)
    result = []
    for gear in (0, 1):
        forces, points = [], []
        for number, index in enumerate(position.pair_index):
            own = position.phi + index * pair.pitch
            angle = own + equilibrium.lead if gear == 0 else math.pi + pair.wheel_tooth_rotation(own)
            axis = np.array([0.0, pair.centre_distance * gear, 0.0])
            window = position.window_slice(number, gear)
            forces.append(nodal[window] @ rotation_z(angle).T)
            points.append(places[window] @ rotation_z(angle).T + axis)
        result.append((np.concatenate(forces), np.concatenate(points)))
    return result


@every_pair
@pytest.mark.parametrize("share", [0.1, 0.45, 0.8])
@pytest.mark.parametrize("projection", ["patch", "facet"])
def test_forces_and_moments_balance_between_the_gears(pair, share, projection):
    model = Model(pair, projection=projection)
    solved = model.solve(model.phi(share))
    (pinion_force, pinion_place), (wheel_force, wheel_place) = global_forces(model, *solved)
    load = np.linalg.norm(pinion_force.sum(axis=0))
    assert_allclose(pinion_force.sum(axis=0) + wheel_force.sum(axis=0), 0.0, atol=FORCE_BALANCE * load)
    moment = np.cross(pinion_place, pinion_force).sum(axis=0) + np.cross(wheel_place, wheel_force).sum(axis=0)
    assert_allclose(moment, 0.0, atol=MOMENT_BALANCE * TORQUE)
    # The load is what the torque asks for on the line of action, and the nodal forces carry the torque.
    assert_allclose(load, TORQUE / pair.pinion.base_radius, rtol=0.02)
    assert_allclose(np.cross(pinion_place, pinion_force)[:, 2].sum(), -TORQUE, rtol=MOMENT_BALANCE)


@every_pair
@pytest.mark.parametrize("share", [0.2, 0.9])
def test_torque_on_the_pinion_is_balanced_and_shared(pair, share):
    model = Model(pair)
    position, _, equilibrium = model.solve(model.phi(share))
    contact = equilibrium.contact
    assert_allclose(-(contact.force @ contact.lever), TORQUE, rtol=NEWTON)
    shares = equilibrium.pair_torque(len(position.pair_index))
    assert_allclose(shares.sum(), TORQUE, rtol=NEWTON)
    assert shares.min() >= 0.0
    assert max(equilibrium.history[-1]) <= NEWTON
    assert np.all(contact.gap < 0.0)
    assert np.all(contact.force > 0.0)


@every_pair
def test_torques_are_in_the_ratio_of_the_teeth(pair):
    ratio = pair.wheel.teeth / pair.pinion.teeth
    model = Model(pair)
    for share in (0.1, 0.3, 0.5, 0.7, 0.9):
        equilibrium = model.solve(model.phi(share))[2]
        assert_allclose(equilibrium.wheel_torque / TORQUE, ratio, rtol=0.03)  # a coarse mesh: STE has steep flanks


@pytest.mark.parametrize("slave", ["pinion", "wheel", "both", "tip"])
def test_wheel_torque_follows_from_the_balance_of_energy(slave):
    """T_1 (d phi + d lead) = T_2 d phi z_1 / z_2 + d (elastic and penalty energy), by finite differences."""
    model, step = Model(PAIRS["paper"], slave=slave), 2e-4
    found, expected, half_slope = [], [], []
    for share in (0.08, 0.33, 0.52, 0.83):
        lead, energy = [], []
        for phi in (model.phi(share) - step, model.phi(share) + step):
            _, elasticity, equilibrium = model.solve(phi)
            lead.append(equilibrium.lead)
            penalty_energy = -0.5 * equilibrium.contact.force @ equilibrium.contact.gap
            energy.append(0.5 * elasticity.energy_norm(equilibrium.coordinates) ** 2 + penalty_energy)
        slope = (lead[1] - lead[0]) / (2.0 * step)
        found.append(model.solve(model.phi(share))[2].wheel_torque / TORQUE - 1.0)
        expected.append(slope - (energy[1] - energy[0]) / (2.0 * step) / TORQUE)
        half_slope.append(0.5 * slope)
    scale = np.abs(found).max()
    # The bilinear transfer is not quite the derivative of the smooth gap: a few per cent remain.
    assert_allclose(found, expected, rtol=0, atol=0.1 * scale)
    # Were the contact linear, half of the work of the lead would go into each. It is not, but the signs follow.
    assert np.corrcoef(found, half_slope)[0, 1] > 0.8


# --- kinematics ----------------------------------------------------------------------------------------------------


@every_pair
def test_periodic_over_a_pitch(pair):
    model = Model(pair)
    for share in (0.15, 0.6):
        one, two = (model.ste_um(model.phi(share) + turns * pair.pitch) for turns in (0, 3))
        assert_allclose(two, one, rtol=SAME_STATE)


@every_pair
def test_pairs_in_reach_are_those_of_the_kinematics(pair):
    meshed = Model(pair).meshed
    margin = overshoot(meshed, DEPTH)
    for phi in np.linspace(-pair.pitch, pair.pitch, 9):
        position = active_patches(meshed, phi, DEPTH)
        assert position.pair_index.tolist() == pair.pairs_in_reach(phi, margin).tolist()
        assert len(position.pair_index) <= pairs_in_reach(meshed)


@every_pair
def test_windows_hold_the_contact_and_one_row_of_neighbours(pair):
    meshed = Model(pair).meshed
    for share in (0.1, 0.6):
        position = active_patches(meshed, pair.roll_position_range[0] + share * pair.pitch, 0.02)
        for number, index in enumerate(position.pair_index):
            rolls = pair.contact_roll_angles(np.array(position.phi + index * pair.pitch))
            for gear, flank in enumerate((meshed.pinion, meshed.wheel)):
                window = position.nodes[position.window_slice(number, gear)].reshape(-1, flank.columns, 3)
                offset, rows, first, elements, at_root, at_tip = position.windows[number, gear]
                low = position.first_row[number, gear]
                assert offset == position.window_slice(number, gear).start
                assert_allclose(window[first : first + elements + 1], flank.nodes[low : low + elements + 1])
                assert (first, rows - first - elements - 1) == (0 if at_root else 1, 0 if at_tip else 1)
                roll = np.clip(rolls[gear], flank.roll_angle[0], flank.roll_angle[-1])
                assert flank.roll_angle[low] <= roll <= flank.roll_angle[low + elements]


def test_rigid_pair_has_no_transmission_error():
    """64 Hermite elements in roll-angle spacing, gaps only: below 0.02 um over a pitch."""
    pair = PAIRS["paper"]
    meshed = meshed_pair(pair, 64, 1, lodm_profile=8)
    lead = [rigid_lead(meshed, pair.roll_position_range[0] + share * pair.pitch) for share in np.linspace(0, 1, 13)]
    assert np.abs(lead).max() * pair.pinion.base_radius * 1e3 < 0.02


def test_rigid_unequal_shifted_pair_has_no_transmission_error():
    pair = PAIRS["unequal, wide"]
    meshed = meshed_pair(pair, 64, 1, lodm_profile=8)
    lead = [rigid_lead(meshed, pair.roll_position_range[0] + share * pair.pitch) for share in (0.1, 0.5, 0.9)]
    assert np.abs(lead).max() * pair.pinion.base_radius * 1e3 < 0.02


def test_small_loads_lead_to_the_rigid_pair():
    model = Model(PAIRS["paper"])
    for share in (0.3, 0.9):
        phi = model.phi(share)
        rigid = rigid_lead(model.meshed, phi) * model.base_radius * 1e3
        # At such loads penetrations of 1e-6 mm drown in the round-off of coordinates of 80 mm.
        approach = [model.ste_um(phi, torque, tolerance=1e-5) - rigid for torque in (TORQUE, 1e3, 1e1)]
        assert approach[0] > approach[1] > approach[2] > 0.0
        assert approach[2] < 2e-3 * approach[0]


def test_approach_grows_with_the_torque_and_stiffens():
    model = Model(PAIRS["paper"])
    phi = model.phi(0.9)
    rigid = rigid_lead(model.meshed, phi) * model.base_radius * 1e3
    light, nominal, heavy = (model.ste_um(phi, factor * TORQUE) - rigid for factor in (0.1, 1.0, 10.0))
    assert 0.0 < light < nominal < heavy
    assert light / 0.1 > nominal > heavy / 10.0  # more teeth and wider strips touch


@pytest.mark.jit
def test_identical_gears_are_symmetric_about_the_middle_of_the_path():
    model = Model(PAIRS["paper"], (16, 2))
    middle = 0.5 * sum(model.pair.roll_position_range)
    offsets = np.linspace(0.0, 0.5, 13) * model.pair.pitch
    before, after = (np.array([model.ste_um(middle + sign * d) for d in offsets]) for sign in (-1.0, 1.0))
    span = max(before.max(), after.max()) - min(before.min(), after.min())
    assert_allclose(before, after, rtol=0, atol=0.05 * span)


@pytest.mark.jit
def test_torque_ratio_stays_close_to_that_of_the_teeth_on_a_finer_mesh():
    model = Model(PAIRS["paper"], (16, 2))
    shares = np.linspace(0.0, 1.0, 16, endpoint=False)
    ratio = [model.solve(model.phi(share))[2].wheel_torque / TORQUE for share in shares]
    # What remains is true: where a pair enters or leaves, the STE is steep and energy is stored.
    assert_allclose(ratio, 1.0, atol=8e-3)
    assert np.median(np.abs(np.array(ratio) - 1.0)) < 2e-3


# --- two ways to the same answer -----------------------------------------------------------------------------------


@pytest.mark.parametrize("share", [0.2, 0.85])
def test_identity_basis_is_the_full_model(share):
    """Shapes F = L^-T, U = C F = L for the Cholesky factor L of the compliance: primal form equals dual form."""
    model = Model(PAIRS["unequal"])
    position, full, dual = model.solve(model.phi(share))
    factor = np.linalg.cholesky(full.compliance)
    reduced = ReducedElasticity(factor.reshape(-1, 3, factor.shape[1]))
    primal = solve_equilibrium(model.meshed, position, reduced, TORQUE)
    assert_allclose(primal.lead, dual.lead, rtol=SAME_STATE)
    assert_allclose(primal.wheel_torque, dual.wheel_torque, rtol=SAME_STATE)
    displacement = full.displacement(dual.coordinates)
    scale = np.abs(displacement).max()
    assert_allclose(reduced.displacement(primal.coordinates), displacement, rtol=0, atol=1e-7 * scale)
    assert_allclose(reduced.energy_norm(primal.coordinates), full.energy_norm(dual.coordinates), rtol=SAME_STATE)


def test_compliance_of_the_windows_is_symmetric_and_couples_neighbouring_teeth():
    model = Model(PAIRS["unequal"])
    position = active_patches(model.meshed, model.phi(0.2), DEPTH)
    compliance = model.elasticity(position).compliance
    assert len(position.pair_index) == 2
    assert_allclose(compliance, compliance.T, rtol=0, atol=1e-12 * np.abs(compliance).max())
    blocks = [[position.window_slice(p, gear) for gear in (0, 1)] for p in (0, 1)]

    def block(a, b):
        return compliance[3 * a.start : 3 * a.stop, 3 * b.start : 3 * b.stop]

    for p in (0, 1):
        for q in (0, 1):
            assert np.abs(block(blocks[p][0], blocks[q][1])).max() == 0.0  # the gears do not touch elastically
    # Pinion tooth j + 1 is one tooth counter-clockwise, wheel tooth j + 1 one tooth clockwise.
    for gear, sign in ((0, 1), (1, -1)):
        dofs = [(3 * position.flank_nodes[p][gear][:, None] + np.arange(3)).ravel() for p in (0, 1)]
        expected = model.bodies[gear].tooth_compliance(sign)[np.ix_(dofs[1], dofs[0])]
        assert_allclose(block(blocks[1][gear], blocks[0][gear]), expected)


@pytest.mark.parametrize("start_mm", [1.0, -1.0])
@pytest.mark.parametrize("share", [0.3, 0.9])
def test_a_start_a_millimetre_off_converges_to_the_same_state(start_mm, share):
    model = Model(PAIRS["paper"])
    position, elasticity, expected = model.solve(model.phi(share))
    start = elasticity.zero(), start_mm / model.base_radius
    found = solve_equilibrium(model.meshed, position, elasticity, TORQUE, start)
    assert_allclose(found.lead, expected.lead, rtol=SAME_STATE)
    assert np.array_equal(found.contact.place, expected.contact.place)


def test_warm_starts_need_fewer_steps():
    model = Model(PAIRS["paper"])
    cold_steps = warm_steps = 0
    for share in (0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9):
        position, elasticity, cold = model.solve(model.phi(share))
        warm = solve_equilibrium(model.meshed, position, elasticity, 1.02 * TORQUE, cold.scaled_start(1.02))
        cold_steps, warm_steps = cold_steps + cold.steps, warm_steps + warm.steps
        again = solve_equilibrium(model.meshed, position, elasticity, TORQUE, (cold.coordinates, cold.lead))
        assert again.steps == 0
        assert again.lead == cold.lead
    assert warm_steps < cold_steps


def test_exchanging_the_slave_changes_little():
    span, mean = [], []
    for slave in ("pinion", "wheel"):
        model = Model(PAIRS["paper"], (10, 2), slave=slave)
        ste = [model.ste_um(model.phi(share)) for share in (0.2, 0.5, 0.9)]
        mean.append(np.mean(ste))
        span.append(np.ptp(ste))
    assert_allclose(mean[0], mean[1], rtol=0.05)
    assert_allclose(span[0], span[1], rtol=0.2)


@pytest.mark.parametrize(
    "scheme",
    [
        {"surface": "facet", "lodm_profile": 1},
        {"projection": "facet"},
        {"edge_normals": "average"},
        {"slave": "both"},
        {"lodm_width": 3, "lodm_profile": 2},
        {"lodm_width": 2, "projection": "facet"},
        {"penalty": 1e4},
    ],
    ids=str,
)
def test_every_scheme_converges_to_a_plausible_state(scheme):
    reference, model = Model(PAIRS["paper"]), Model(PAIRS["paper"], **scheme)
    for share in (0.15, 0.85):
        phi = model.phi(share)
        rigid = rigid_lead(model.meshed, phi) * model.base_radius * 1e3
        rigid_reference = rigid_lead(reference.meshed, phi) * model.base_radius * 1e3
        found, expected = model.ste_um(phi) - rigid, reference.ste_um(phi) - rigid_reference
        soft = scheme.get("penalty") == 1e4
        assert 0.5 * expected < found < (20.0 if soft else 2.0) * expected


@pytest.mark.parametrize(
    ("share", "torque", "scheme"),
    [
        pytest.param(1 / 24, 1e3, {}, id="1 N m"),
        pytest.param(46 / 48, TORQUE, {"penalty": 1e7}, id="stiff"),
        pytest.param(16 / 48, TORQUE, {"surface": "facet"}, id="refined facets"),
        pytest.param(0.3, 10.0 * TORQUE, {}, id="ten times nominal"),
    ],
)  # fmt: skip
def test_extreme_loads_and_schemes_converge(share, torque, scheme):
    model = Model(PAIRS["paper"], **scheme)
    solved = solve_position(model.meshed, model.phi(share), [torque], model.elasticity)
    assert solved.failures == ()


def test_stiffer_penalty_approaches_from_above():
    ste = [Model(PAIRS["paper"], penalty=p).ste_um(Model(PAIRS["paper"]).phi(0.9)) for p in (1e5, 1e6, 1e7, 1e8)]
    assert np.all(np.diff(ste) < 0.0)
    assert abs(ste[3] - ste[2]) < 0.2 * abs(ste[1] - ste[0])


@pytest.mark.parametrize(
    "scheme",
    [
        {},
        {"edge_normals": "average"},
        {"projection": "facet"},
        {"surface": "facet", "lodm_profile": 1},
        {"surface": "facet", "lodm_profile": 4},
    ],
    ids=str,
)
def test_search_that_ends_at_the_first_clear_row_misses_no_point(scheme, monkeypatch):
    model = Model(PAIRS["paper"], **scheme)
    depth = 3.0 * model.meshed.expected_approach(TORQUE) + surface_error(model.meshed)
    positions = [active_patches(model.meshed, model.phi(share), depth) for share in np.linspace(0.0, 1.0, 8)]
    leads = np.array([0.005, 0.01, 0.02]) / model.base_radius

    def points():
        contacts = [search_contact(model.meshed, p, np.zeros_like(p.nodes), lead) for p in positions for lead in leads]
        return [sorted(map(tuple, np.column_stack([c.pair, c.slave, c.place[:, :2]]))) for c in contacts]

    found = points()
    monkeypatch.setattr("pmor.contact.search.clearance", lambda scheme: 1e9)
    assert found == points()


# --- what goes wrong -----------------------------------------------------------------------------------------------


def test_too_few_steps_raise_with_the_history():
    model = Model(PAIRS["paper"])
    with pytest.raises(ConvergenceError, match="no equilibrium at phi = .*, torque = 100 N m after 1 Newton") as error:
        model.solve(model.phi(0.4), max_steps=1)
    assert len(error.value.history) == 2
    assert max(error.value.history[-1]) > NEWTON


def test_flanks_that_do_not_face_each_other_raise():
    model = Model(PAIRS["paper"])
    position = active_patches(model.meshed, model.phi(0.8), DEPTH)
    apart = position.nodes.copy()
    apart[position.window_slice(0, 1), 2] += 1000.0  # the wheel's flank slides along the axis
    displacement = apart - position.nodes
    assert len(position.pair_index) == 1

    class Apart(ReducedElasticity):
        def displacement(self, coordinates):
            return displacement

    elasticity = Apart(np.zeros((len(position.nodes), 3, 0)))
    with pytest.raises(ConvergenceError, match="no flank faces its mate"):
        solve_equilibrium(model.meshed, position, elasticity, TORQUE)


def test_without_shapes_only_the_penalty_yields():
    model = Model(PAIRS["paper"])
    position = active_patches(model.meshed, model.phi(0.8), DEPTH)
    rigid = ReducedElasticity(np.zeros((len(position.nodes), 3, 0)))
    equilibrium = solve_equilibrium(model.meshed, position, rigid, TORQUE)
    contact = equilibrium.contact
    assert_allclose(-(contact.force @ contact.lever), TORQUE, rtol=NEWTON)
    assert rigid.displacement(equilibrium.coordinates).shape == position.nodes.shape
    assert equilibrium.lead < model.solve(model.phi(0.8))[2].lead


@pytest.fixture(scope="module")
def overloaded():
    """Elements and spacing of points so small, and a torque so large, that contact leaves the smallest window."""
    model = Model(PAIRS["paper"], (16, 2), lodm_profile=8)
    return model, model.phi(0.85), 3.0 * TORQUE


def test_a_window_too_small_is_noticed(overloaded):
    model, phi, torque = overloaded
    small, large = (active_patches(model.meshed, phi, depth) for depth in (1e-5, DEPTH))
    assert small.windows[:, :, 3].max() < large.windows[:, :, 3].min()
    touching = [
        solve_equilibrium(model.meshed, position, model.elasticity(position), torque).contact.touches_border
        for position in (small, large)
    ]
    assert touching == [True, False]


def test_solve_position_grows_its_windows_until_they_hold_the_contact(overloaded, monkeypatch):
    monkeypatch.setattr("pmor.contact.solve.WINDOW_MARGIN", 1e-3)
    model, phi, torque = overloaded
    solved = solve_position(model.meshed, phi, [0.5 * torque, torque], model.elasticity)
    assert solved.failures == ()
    assert solved.position.depth > 2.9 * window_depth(model.meshed, torque), "it was too small at first"
    assert not solved.equilibria[1].contact.touches_border
    assert_allclose(
        [e.lead * model.base_radius * 1e3 for e in solved.equilibria],
        [model.ste_um(phi, load) for load in (0.5 * torque, torque)],
        rtol=1e-6,  # windows of another size: rows beyond the strip do not matter
    )


def test_solve_position_reports_what_failed_and_goes_on(monkeypatch):
    def never(meshed, position, elasticity, torque, start=None):
        if torque > TORQUE:
            raise ConvergenceError("too much", [(1.0, 1.0)])
        return solve_equilibrium(meshed, position, elasticity, torque, start)

    monkeypatch.setattr("pmor.contact.solve.solve_equilibrium", never)
    model = Model(PAIRS["paper"])
    solved = solve_position(model.meshed, model.phi(0.8), [2.0 * TORQUE, TORQUE], model.elasticity)
    assert solved.equilibria[0] is None
    assert solved.equilibria[1] is not None
    assert solved.failures == ("too much",)


def test_windows_of_facets_allow_for_their_sagitta():
    pair = PAIRS["paper"]
    faceted = meshed_pair(pair, 8, 1, surface="facet", lodm_profile=1)
    middle = 0.5 * (faceted.pinion.nodes[1:, 0] + faceted.pinion.nodes[:-1, 0])
    radius = np.linalg.norm(middle[:, :2], axis=1)
    roll = np.array([pair.pinion.roll_angle_at(r) for r in radius])
    half = np.array([pair.pinion.half_thickness_angle(u) for u in roll])
    sagitta = (half - np.arctan2(-middle[:, 0], middle[:, 1])) * radius * np.cos(np.arctan(roll))
    # A facet per gear; its sagitta by the radius of curvature in its middle, good to a few per cent.
    assert_allclose(surface_error(faceted), 2.0 * sagitta.max(), rtol=0.05)
    assert surface_error(meshed_pair(pair, 8, 1)) == 0.0
