"""Line contact solved for its line loads: exact to full FE, on spur and helical, modified and tilted pairs."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.core.conventions import rotation_z
from pmor.gear.condition import PLAIN, Assembly, Condition, Misalignment, at_torques
from pmor.gear.kernels.types import Motion
from pmor.gear.modification import Modification
from pmor.gear.topography import Topography
from pmor.line.bonded_layer import WIDEST
from pmor.line.hertz import check_half_width, width_limit
from pmor.line.hubs import Hubs
from pmor.line.kernels.contact_point import closest_approach
from pmor.line.kernels.places import line_deviations
from pmor.line.layered_pair import place_flanks_of, place_sections, sections_of
from pmor.line.unloaded import unloaded_ste_um, with_unloaded
from pmor.pair.sweep import sweep_ste
from pmor_online.compare import failed_positions
from pmor_online.contact_pattern import contact_patterns
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.model import on_hubs
from pmor_online.variants import VariantSolver
from tests.support.line_pairs import PAIRS, TORQUE, models
from tests.support.states import states_at

# Full FE is solved to 1e-9 in its energy norm.
STE, LOADS = 1e-8, 1e-6
BALANCED = 1e-9  # of the torque: worst seen 3e-11 in 210,000 states; round-off at the lightest loads
ENVELOPE = 0.15  # um: where reliefs begin flanks have kinks, between which sections fall


def random_modification(rng):
    tip, root, profile, helix, twist = rng.uniform(0.0, 40.0, 5)
    return Modification(
        tip_relief_um=tip, tip_relief_start_roll_deg=rng.uniform(20.0, 30.0), root_relief_um=0.5 * root,
        root_relief_end_roll_deg=rng.uniform(10.0, 18.0), root_relief_shape="parabolic",
        profile_crowning_um=0.5 * profile, helix_crowning_um=0.5 * helix, helix_slope_um=rng.uniform(-40.0, 40.0),
        twist_um=twist, end_relief_um=0.2 * tip, end_relief_length_mm=rng.uniform(1.0, 6.0),
    )  # fmt: skip


def random_conditions(rng, count):
    """Angles in pitches, and conditions with torques from 0.02 to 2 of nominal, tilts and modifications up to 40 um."""
    found = []
    for _ in range(count):
        torque = TORQUE * math.exp(rng.uniform(math.log(0.02), math.log(2.0)))
        misalignment, pinion = Misalignment(*rng.uniform(-40.0, 40.0, 2)), random_modification(rng)
        condition = Condition(torque=torque, misalignment=misalignment, pinion=pinion, wheel=random_modification(rng))
        found.append((rng.uniform(0.0, 1.0), condition))
    return found


def disagreement(name, share, condition):
    """Relative difference of the STE, and of the line loads to their peak, between line loads and full FE."""
    full, reduced = models(name)
    phi = share * reduced.meshed.pair.pitch
    (state,) = states_at(full, phi, [condition])
    sweep = sweep_line_loads(reduced, np.array([phi]), [condition], recorded=True)
    assert sweep.converged.all()
    force = {}
    for pair, section, value in zip(state.pair, state.section, state.force, strict=True):
        force[int(pair), int(section)] = value
    loads = sweep.states.loads
    listed = {(int(p), int(s)): f for p, s, f in zip(loads.pair, loads.column, loads.force_N, strict=True)}
    largest = max(force.values())
    worst = max(abs(force.get(key, 0.0) - listed.get(key, 0.0)) for key in {*force, *listed})
    advance = state.advance * reduced.meshed.pair.pinion.base_radius * 1e3
    approach = reduced.meshed.expected_approach(condition.torque) * 1e3
    return abs(sweep.ste_um[0, 0] - advance) / max(abs(advance), approach), worst / largest


def test_a_section_that_is_width_limit_by_itself_is_flagged():
    """The mean load is within the range of the law, and `check_half_width` lets it pass; the edges are not."""
    torque, (full, reduced) = 6e6, models("spur")
    meshed, phi = reduced.layered, np.array([0.1])
    rolls = meshed.pinion.roll_angle, meshed.wheel.roll_angle
    check_half_width(meshed.pair, meshed.layers, rolls, torque)
    aligned, tilted = (Condition(torque=torque, misalignment=Misalignment(out_of_plane_um=um)) for um in (0.0, 900.0))
    assert sweep_line_loads(reduced, phi, [aligned]).converged.all()
    sweep = sweep_line_loads(reduced, phi, [tilted], recorded=True)
    assert not sweep.converged.any()
    assert np.isnan(sweep.ste_um).all()
    assert not sweep.pair_share.any()
    assert "overloads a section" in failed_positions(sweep, "line loads")[0]
    variant = VariantSolver(reduced, phi, [1e-3 * torque]).solve(tilted.assembly)
    assert not variant.converged.any()
    truth = sweep_ste(full.mesh.meshed, full.elasticity_at, phi, [tilted])
    assert not truth.converged.any()
    # Under less load the widest contact by Hertz is just narrower than half the depth of the layer.
    state = reduced.lines.placed(place_sections(meshed, phi, tilted.misalignment)).solve(np.array([torque]))
    lines = place_sections(meshed, phi, tilted.misalignment)
    line_load = state.force[0, 0] / np.tile(meshed.width, meshed.tooth_pair_count)
    flanks, radii = (meshed.pinion, meshed.wheel), (meshed.pair.pinion.base_radius, meshed.pair.wheel.base_radius)
    rolls = np.maximum(lines.roll[0], 1e-3)
    curvature = sum(1.0 / (radius * rolls[:, gear]) for gear, radius in enumerate(radii))
    half_width = np.sqrt(2.0 * sum(layer.compliance for layer in meshed.layers) * line_load / curvature)
    depths = [np.interp(lines.roll[0, :, gear], flank.roll_angle, meshed.layers[gear].depth)
              for gear, flank in enumerate(flanks)]  # fmt: skip
    widest = (half_width / np.sqrt(depths[0] * depths[1])).max()
    assert widest > WIDEST
    narrower = state.force * 0.97 * (WIDEST / widest) ** 2
    limit = width_limit(meshed, lines.law)
    assert limit.exceeded(state.force).all()
    assert not limit.exceeded(narrower).any()
    assert limit.exceeded(narrower * 1.06).all()


@pytest.mark.parametrize("name", [name for name in PAIRS if "holes" not in name])
def test_line_loads_are_those_of_full_fe(name):
    for share, condition in random_conditions(np.random.default_rng(15), 5):
        ste, loads = disagreement(name, share, condition)
        assert ste < STE
        assert loads < LOADS


@pytest.mark.slow
@pytest.mark.parametrize("name", PAIRS)
def test_line_loads_are_those_of_full_fe_under_three_hundred_conditions(name):
    """Slow: 300 random conditions on each pair, ``pytest -m slow tests/verification/test_line_loads.py -s``."""
    found = np.array([disagreement(name, *state) for state in random_conditions(np.random.default_rng(2016), 300)])
    print(f"\n{name}: STE within {found[:, 0].max():.2g}, line loads within {found[:, 1].max():.2g}")  # noqa: T201
    assert (found < [STE, LOADS]).all()


def test_full_fe_finds_a_pair_that_a_deviation_brings_into_contact_before_its_time():
    """Its corner meets the mate far beyond the path of contact, where windows once did not look for it."""
    first = Condition(torque=TORQUE, pinion=Modification(pitch_deviations_um=(-100.0, *[0.0] * 20)))
    for share in np.linspace(0.1, 0.9, 7):
        ste, _ = disagreement("spur", share, first)
        assert ste < STE
    grain = Topography((0.0, 25.0, 25.001, 60.0), (-20.0, 20.0), ((0.0, 0.0), (0.0, 0.0), (60.0, 60.0), (60.0, 60.0)))
    step = Condition(torque=0.2 * TORQUE, pinion=Modification(topography=grain))
    for share in np.linspace(0.05, 0.95, 7):
        ste, _ = disagreement("spur", share, step)
        assert ste < STE


# --- rigid flanks --------------------------------------------------------------------------------------------------


def removed(modification, tooth, active, face, u, z):
    """Tip relief, crownings and helix slope by the book, um."""
    start, tip = math.radians(modification.tip_relief_start_roll_deg), tooth.tip_roll_angle
    xi = (u - 0.5 * sum(active)) / (active[1] - active[0])
    zeta = (z - 0.5 * sum(face)) / (face[1] - face[0])
    relief = modification.tip_relief_um * np.maximum(u - start, 0.0) / (tip - start)
    crowned = 4.0 * (modification.profile_crowning_um * xi**2 + modification.helix_crowning_um * zeta**2)
    return relief + crowned + modification.helix_slope_um * zeta


@pytest.mark.parametrize("name", ["spur", "helical"])
def test_without_load_the_transmission_error_is_the_lower_envelope_of_the_gaps(name):
    """Against all teeth on the line of action, section by section; tip edges meet beyond it and are left out here."""
    rng, (_, reduced) = np.random.default_rng(7), models(name)
    meshed = reduced.meshed
    pair, z = meshed.pair, meshed.sections.z
    for _ in range(4):
        # So much tip relief that no edge beyond the line of action comes before the flanks on it.
        flanks = [
            Modification(tip_relief_um=rng.uniform(30.0, 40.0), tip_relief_start_roll_deg=rng.uniform(24.0, 28.0),
                         profile_crowning_um=rng.uniform(5.0, 20.0), helix_crowning_um=rng.uniform(0.0, 10.0),
                         helix_slope_um=rng.uniform(-10.0, 10.0))
            for _ in range(2)
        ]  # fmt: skip
        phi = pair.pitch * rng.uniform(0.0, 1.0, 3)
        sweep = sweep_line_loads(reduced, phi, at_torques([1e-5], pinion=flanks[0], wheel=flanks[1]))
        first, last = pair.pinion_roll_range
        expected = []
        for angle in phi:
            gaps = [np.inf]
            for j in range(-3, 4):
                rolls = pair.contact_roll_angles(angle + j * pair.pitch + pair.pinion.twist_per_length * z)
                on_path = (rolls[0] >= first) & (rolls[0] <= last)
                gap = sum(
                    removed(flank, tooth, active, face, u, z)
                    for flank, tooth, active, face, u in zip(
                        flanks, (pair.pinion, pair.wheel), pair.active_rolls, pair.faces, rolls, strict=True
                    )
                )
                gaps += list(gap[on_path])
            expected.append(min(gaps))
        # The torque of 1e-8 N m deforms by 1e-9 um.
        assert_allclose(sweep.ste_um[0], expected, rtol=0.0, atol=1e-6)


def closing_um(meshed, phi, assembly, z):
    """Transmission error of rigid flanks that touch in some sections alone: where a gap first closes, by bisection."""
    places, removed = place_flanks_of(meshed, phi, assembly.misalignment, z), None
    removed = np.zeros_like(places.gap)
    line_deviations(places, z, *meshed.deviations(assembly), removed)
    low, high = np.full(len(phi), -0.05), np.full(len(phi), 0.05)
    for _ in range(60):
        middle = 0.5 * (low + high)
        further = np.maximum(middle[:, None] - places.corner_advance, 0.0)
        gap = places.gap + removed + places.lever * middle[:, None] + 0.5 * places.lever_slope * further**2
        closed = gap.min(axis=1) < 0.0
        low, high = np.where(closed, low, middle), np.where(closed, middle, high)
    return 1e3 * meshed.pair.pinion.base_radius * low


@pytest.mark.parametrize("name", [pytest.param("helical", marks=pytest.mark.slow), "quadratic"])
def test_unloaded_flanks_of_helical_pairs_touch_on_a_smooth_envelope(name):
    """Against 4,000 sections; with those of the line loads alone a staircase, off by 1.9 um."""
    meshed = models(name)[1].meshed
    phi, z = meshed.pair.pitch * np.arange(30) / 30, np.linspace(*meshed.pair.common_face, 4001)
    for _, condition in random_conditions(np.random.default_rng(24), 4):
        assembly = condition.assembly
        (found,), truth = unloaded_ste_um(meshed, phi, [assembly]), closing_um(meshed, phi, assembly, z)
        assert_allclose(found, truth, rtol=0.0, atol=ENVELOPE)
        assert np.sqrt(np.mean((found - truth) ** 2)) < 0.4 * ENVELOPE


@pytest.mark.parametrize("name", [name for name in PAIRS if "holes" not in name])
def test_the_loaded_transmission_error_comes_down_to_the_unloaded_one(name):
    """With all that flanks can be, tilted axes, and tip edges that meet the mate beyond the line of action."""
    _, reduced = models(name)
    phi, scale = reduced.meshed.pair.pitch * np.linspace(0.0, 1.0, 12), []
    for _, condition in random_conditions(np.random.default_rng(23), 6):
        (light,) = at_torques([1e-5], condition.misalignment, condition.pinion, condition.wheel)
        sweep = with_unloaded(sweep_line_loads(reduced, phi, [light]), reduced.meshed, [light])
        sections = closing_um(reduced.meshed, phi, condition.assembly, sections_of(reduced.meshed).z)
        assert_allclose(sections, sweep.ste_um[0], rtol=0.0, atol=1e-6)
        if reduced.meshed.pair.overlap_ratio == 0.0:
            assert_allclose(sweep.unloaded_um[0], sections, rtol=0.0, atol=1e-9)
        scale.append(np.ptp(sweep.unloaded_um))
    assert min(scale) > 1.0
    plain = at_torques([1e5])
    assert with_unloaded(sweep_line_loads(reduced, phi, plain), reduced.meshed, plain).unloaded_um is None


def test_drawn_pressure_of_helical_flanks_is_that_of_hertz_and_carries_the_load_from_face_to_face():
    full, reduced = models("helical")
    pair, condition = reduced.meshed.pair, Condition(torque=TORQUE)
    phi = 0.4 * pair.pitch
    patterns = contact_patterns(reduced, phi, condition)
    assert len(patterns) > 1
    force = sum(pattern.force.sum() for pattern in patterns)
    # Normal to the flanks; a tip edge pushes a little off the line of action.
    assert_allclose(force, TORQUE / pair.pinion.base_radius / math.cos(pair.base_helix_angle), rtol=2e-3)
    (state,) = states_at(full, phi, [condition])
    peak = state.patches()[:, 2].max()
    # Cells have some width.
    assert_allclose(max(pattern.pressure.max() for pattern in patterns), peak, rtol=0.02)
    for pattern in patterns:
        assert_allclose(pattern.width[[0, -1]], [-10.0, 10.0], rtol=0.0, atol=1e-9)
        # The line of contact is nowhere cut into steps wider than it is.
        loaded = np.flatnonzero(pattern.pressure.any(axis=0))
        middle = [np.flatnonzero(column > 0.0).mean() for column in pattern.pressure[:, loaded].T]
        assert np.abs(np.diff(middle)).max() < np.count_nonzero(pattern.pressure[:, loaded[0]])


# --- helicoids -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("z", [-9.0, 0.0, 4.0])
@pytest.mark.parametrize("place", [-0.02, 0.1, 0.5, 0.9, 1.02])
def test_a_flank_that_screws_along_itself_opens_no_gap(z, place):
    """On the line of action for both gears; where a corner meets a flank, for that flank."""
    meshed = models("helical")[1].meshed
    pair = meshed.pair
    start, end = pair.roll_position_range
    at = start + place * (end - start) - pair.pinion.twist_per_length * z
    still = [Motion(np.zeros((3, 3)), np.zeros(3)) for _ in range(2)]
    m = closest_approach(meshed.kinematics(PLAIN.misalignment), meshed.gears, at, 0.0, z, *still)
    flanks = [((m.pinion_x, m.pinion_y, m.pinion_z), m.pinion_roll, pair.pinion),
              ((m.wheel_x, m.wheel_y, m.wheel_z), m.wheel_roll, pair.wheel)]  # fmt: skip
    for direction, roll, tooth in flanks[int(place > 1.0) : 1 + int(place > 0.0)]:
        x, y, _ = tooth.flank_point(roll, z)
        screw = np.array([-y * tooth.twist_per_length, x * tooth.twist_per_length, 1.0])
        # A corner's contact point is not at the roll angle's own point of the mate, but on the same normal.
        assert_allclose(np.dot(direction, screw), 0.0, atol=1e-12)
        assert_allclose(np.linalg.norm(direction), 1.0 / math.cos(pair.base_helix_angle), rtol=1e-12)


def test_nodal_forces_on_both_gears_balance_each_other():
    """Forces of all tooth pairs; the axial one is F_t tan(beta_b). Moments of sections: test_helical."""
    full, _ = models("helical")
    pair = full.mesh.meshed.pair
    phi, total = 0.1 * pair.pitch, np.zeros((2, 3))
    (state,) = states_at(full, phi, at_torques([TORQUE]))
    for p, index in enumerate(state.loaded_pairs):
        own = phi + index * pair.pitch
        for gear, angle in enumerate((own, math.pi + pair.wheel_tooth_rotation(own))):
            total[gear] += rotation_z(angle) @ state.nodal_force[gear][p].reshape(-1, 3).sum(axis=0)
    assert_allclose(total[0] + total[1], 0.0, atol=1e-9 * np.abs(total).max())
    tangential = TORQUE / pair.pinion.base_radius
    assert_allclose(abs(total[0, 2]), tangential * math.tan(pair.base_helix_angle), rtol=1e-9)
    assert_allclose(state.wheel_torque / TORQUE, pair.wheel.teeth / pair.pinion.teeth, rtol=1e-9)


# --- modifications -------------------------------------------------------------------------------------------------


def test_a_helix_slope_is_a_tilt_in_the_plane_of_action():
    """To first order: both leave mid width where it is."""
    phi, (_, reduced), slope = np.linspace(0.0, 0.29, 5), models("spur"), 4.0
    angle = reduced.meshed.pair.working_pressure_angle
    # A wheel whose axis goes away along the line of action opens the gap.
    misalignment = Misalignment(in_plane_um=slope * math.sin(angle), out_of_plane_um=-slope * math.cos(angle))
    tilted = sweep_line_loads(reduced, phi, at_torques([TORQUE], misalignment)).ste_um
    sloped = sweep_line_loads(reduced, phi, at_torques([TORQUE], wheel=Modification(helix_slope_um=slope))).ste_um
    assert_allclose(tilted, sloped, rtol=0.0, atol=5e-3)


def test_pitch_deviations_show_when_their_tooth_meshes():
    _, reduced = models("spur")
    pitch, teeth = reduced.meshed.pair.pitch, reduced.meshed.pair.pinion.teeth
    phi = pitch * np.array([0.2, 1.2, 2.2, 5.2, 5.2 + teeth])

    def ste(**deviations):
        return sweep_line_loads(reduced, phi, at_torques([TORQUE], **deviations)).ste_um[0]

    plain, uniform = ste(), ste(pinion=Modification(pitch_deviations_um=(7.0,) * teeth))
    assert_allclose(uniform, plain, rtol=1e-12)
    alone = ste(pinion=Modification(pitch_deviations_um=(0.0,) * (teeth - 1) + (20.0,)))
    # The last tooth is tooth -1, which is in mesh about angle 1 pitch.
    assert abs(alone[1] - plain[1]) > 1.0
    assert_allclose(alone[[2, 3]], plain[[2, 3]], rtol=1e-12)
    assert_allclose(alone[4], alone[3], rtol=1e-9)


@pytest.mark.parametrize("name", ["spur", "helical"])
@pytest.mark.parametrize("held", [True, False], ids=["held", "on supports"])
def test_forces_of_every_state_balance_the_torque(name, held):
    """From 1 N mm to four times nominal, aligned and tilted, relieved and crowned: the one movement of a pair."""
    rng, pair = np.random.default_rng(38), models(name)[1]
    size = np.tile([1.0, 1.0, 1.0, 0.05, 0.05, 0.05], 2)
    states = 0
    for _ in range(10):
        factor = size[:, None] * rng.standard_normal((12, 12))
        hubs = Hubs(3e-7 * factor @ factor.T, 0.01 * size * rng.standard_normal(12))
        misalignment = Misalignment(*rng.uniform(-60.0, 60.0, 2))
        phi = pair.meshed.pair.pitch * rng.uniform(-1.0, 1.0, 6)
        torques = TORQUE * np.exp(rng.uniform(math.log(1e-5), math.log(4.0), 6))
        placed = (pair if held else on_hubs(pair, hubs)).lines.place(phi, misalignment)
        flanks = random_modification(rng), random_modification(rng)
        found = placed.solve(torques, False, placed.deviation(Assembly(misalignment, *flanks)), False)
        off = np.abs(found.torque.sum(axis=2) / torques[:, None] - 1.0)[found.converged]
        assert off.max() < BALANCED
        states += len(off)
    assert states == 360


def test_a_lone_section_under_a_corner_balances_the_torque_too():
    """Its force is right from the first step on, its lever not before the advance is: 1.2e-4 of the torque was left."""
    pair, torques = models("helical")[1], np.array([6000.0, 7000.0])
    misalignment = Misalignment(-35.0, 40.7)
    parabolic = {"root_relief_shape": "parabolic", "tip_relief_start_roll_deg": 21.8, "root_relief_end_roll_deg": 16.1}
    pinion = Modification(
        tip_relief_um=1.07, root_relief_um=18.5, helix_crowning_um=6.1, helix_slope_um=-2.17, twist_um=4.76, **parabolic
    )
    wheel = Modification(
        tip_relief_um=29.5, root_relief_um=3.2, helix_crowning_um=2.94, helix_slope_um=-33.1, end_relief_um=5.91,
        end_relief_length_mm=1.99, twist_um=23.2, **parabolic | {"tip_relief_start_roll_deg": 26.8},
    )  # fmt: skip
    placed = pair.lines.place(np.array([-0.7345 * pair.meshed.pair.pitch]), misalignment)
    found = placed.solve(torques, False, placed.deviation(Assembly(misalignment, pinion, wheel)), False)
    assert ((found.force > 0.0).sum(axis=2) == 1).all()
    assert_allclose(found.torque.sum(axis=2)[:, 0], torques, rtol=BALANCED)
