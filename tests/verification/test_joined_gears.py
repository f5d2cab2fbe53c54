"""Gears that share a shaft: stepped planets, two stages, power splits; by identities, springs, pairs by themselves."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor
from pmor.core.errors import CaseError, GeometryError
from pmor.core.threads import threads
from pmor.machine.coupled import solve_load
from pmor.machine.loader import load as load_gearbox
from pmor.machine.model import speeds_rpm
from pmor.pair.conditions import conditions_of
from pmor.pair.model import gear_pair
from pmor.pair.samples import sample_rows
from pmor.sets.draws import drawn
from pmor.sets.kinematics import Centre, Meeting, placements
from pmor.sets.loader import load
from pmor.sets.plan import planet_positions
from pmor.sets.root_stress import root_stress_of_set
from pmor.sets.run import train_of
from pmor.sets.settings import Planets
from pmor.sets.solution import solve_set
from pmor.sets.tolerances import solve_samples
from pmor_online.root_cycle import root_stress_and_cycles
from tests.support.set_gearboxes import one_stage, written_reducer
from tests.support.small_sets import NO_STRESS, SMALL_CHAIN, SMALL_SET, line_case, written_set

# Of the same equations, put together otherwise.
SAME = 1e-11
# Of root stresses: sums over the sections of as many meshes.
SAME_STRESS = 1e-9
PLANETS = SMALL_SET.replace("torques_Nm = [100.0]", "").replace("tangential_um = [10.0, 0.0, 0.0]", "")
EQUAL = PLANETS.replace("[ring]", "[second_planet]\nteeth = 18\nbore_radius_mm = 18.0\n[ring]")
# 18 x 15 + 57 x 24 = 3 x 546: teeth of three planets meet.
STEPPED = EQUAL.replace("[planet]\nteeth = 18", "[planet]\nteeth = 24").replace("teeth = 54", "teeth = 57")
STEPPED = STEPPED.replace("teeth = 18\nbore_radius_mm = 18.0\n[ring]", "teeth = 15\nbore_radius_mm = 15.0\n[ring]")
RATIO = 57 * 24 / (18 * 15)


def train(gears, meshes, teeth, more=""):
    """A train of gears by name, place and further keys, 4 mm in module; meshes by their gears, and further keys."""
    text = SMALL_CHAIN.split("[[gears]]")[0]
    for name, place, *keys in gears:
        text += "\n".join(["[[gears]]", f'name = "{name}"', f"at_mm = {[float(x) for x in place]}", *keys, ""])
    for one, other, *keys in meshes:
        text += "\n".join(["[[meshes]]", f'gears = ["{one}", "{other}"]', *keys, ""])
    for (name, *_), count in zip(gears, teeth, strict=True):
        text += f"[{name}]\nteeth = {count}\nbore_radius_mm = {float(count)}\n"
    coarse = '[mesh]\nprofile_elements = 3\nwidth_elements = 2\nelement = "hex8i"\n'
    return f"{text}[sweep]\nangles_per_pitch = 6\n{coarse}{more}"


def two_stages(*keys, teeth=(18, 24, 18, 24), more=""):
    apart = 2.0 * (teeth[0] + teeth[1]), 2.0 * (teeth[2] + teeth[3])
    return train(
        [
            ("input", (0, 0), "torque_Nm = 100.0"),
            ("wheel", (0, apart[0]), 'shaft = "middle"'),
            ("pinion", (0, apart[0]), 'shaft = "middle"', *keys),
            ("output", (apart[1], apart[0]), 'torque_Nm = "balance"'),
        ],
        [("input", "wheel"), ("pinion", "output")], teeth, more,
    )  # fmt: skip


def power_split(timing_mrad=0.0, right_deg=0.0):
    """Two equal paths from a pinion to a coaxial wheel."""
    gears, right = [("input", (0, 0), "torque_Nm = 100.0")], math.radians(right_deg)
    places = {"left": (-84, 0), "right": (84 * math.cos(right), 84 * math.sin(right))}
    for side, more in (("left", ()), ("right", (f"timing_mrad = {timing_mrad}",))):
        gears.append((f"{side}_wheel", places[side], f'shaft = "{side}"'))
        gears.append((f"{side}_pinion", places[side], f'shaft = "{side}"', *more))
    gears.append(("output", (0, 0), 'torque_Nm = "balance"'))
    meshes = [("input", "left_wheel"), ("input", "right_wheel"), ("left_pinion", "output"), ("right_pinion", "output")]
    return train(gears, meshes, (18, 24, 18, 24, 18, 24), NO_STRESS)


def solved(folder, text):
    return pmor.run(written_set(folder, text))


@pytest.fixture(scope="module")
def stepped(tmp_path_factory):
    return solved(tmp_path_factory.mktemp("stepped"), STEPPED)


def with_rigid(found, member):
    """The same set whose gears of a member do not carry from one mesh to the other through their bodies."""
    built, plan = found.solution.train, found.file.plan
    bodies = tuple(
        replace(body, far=None) if own.member == member else body
        for body, own in zip(built.bodies, plan.bodies, strict=True)
    )
    return solve_set(plan, replace(built, bodies=bodies), found.solution.torque_Nm, found.solution.angles_per_pitch)


def stressed_by(solution, gear):
    """Root stress of a set of which the meshes of a gear alone are loaded, as they are."""
    placed, force = solution.placed, solution.found.force.copy()
    for mesh in placed.placed:
        if gear not in mesh.mesh.bodies:
            force[..., mesh.part] = 0.0
    return root_stress_of_set(placed, solution.found._replace(force=force), solution.pitches)


@pytest.mark.slow
def test_two_equal_gears_of_a_planet_are_one_whose_flanks_do_not_feel_each_other(tmp_path):
    """Root stress of each is that of the one gear by the loads of that mesh: a body feels all of its meshes."""
    found, one = solved(tmp_path, EQUAL), with_rigid(solved(tmp_path, PLANETS), "planet")
    assert found.solution.pitches == 1
    assert_allclose(found.ste_um, one.ste_um, rtol=SAME)
    assert_allclose(found.solution.pin_force_N, one.pin_force_N, rtol=SAME)
    own = found.solution.root_stress
    for gear, planets in ((0, range(2, 5)), (1, range(5, 8))):  # sun and ring
        expected = stressed_by(one, gear)
        assert_allclose(own[gear].cycle.range_MPa, expected[gear].cycle.range_MPa, rtol=SAME_STRESS)
        for planet, whole in zip(planets, expected[2:5], strict=True):
            assert_allclose(own[planet].max_principal_MPa, whole.max_principal_MPa, rtol=SAME_STRESS)


def test_two_equal_gears_on_a_shaft_are_an_idler_whose_flanks_do_not_feel_each_other(tmp_path):
    """Helical gears, in a bent chain; the second pinion has the hand of the wheel beside it."""
    teeth, distance = (21, 25, 25, 19), [2.0 * (21 + 25), 2.0 * (25 + 19)]
    slanted = "[pair]\nhelix_angle_deg = 15.0"
    text = two_stages(teeth=teeth).replace("[pair]", slanted)
    chain = SMALL_CHAIN.replace("[pair]", slanted)
    for straight in distance:
        longer = repr(straight / math.cos(math.radians(15.0)))
        text, chain = text.replace(f"{straight}", longer), chain.replace(f"{straight}", longer)
    found, one = solved(tmp_path, text), with_rigid(solved(tmp_path, chain), "idler")
    assert_allclose(found.ste_um, one.ste_um, rtol=SAME)


@pytest.mark.parametrize(("on", "held", "times"), [("ring", "sun", RATIO), ("carrier", "ring", 1.0 + RATIO)])
def test_torques_on_other_members_are_that_of_the_sun_by_willis(on, held, times, tmp_path):
    said = f'torque_Nm = {-300.0 * times if on == "carrier" else 300.0 * times}\non = "{on}"\nheld = "{held}"'
    plan = load(written_set(tmp_path, STEPPED.replace("torque_Nm = 300.0", said))).plan
    assert_allclose(plan.torque_Nm, 300.0, rtol=1e-12)


def test_teeth_meet_in_all_meshes_and_repeat_when_both_cycles_do(stepped):
    """Plain flanks without load touch everywhere and have no error; 24 and 15 teeth: after 8 pitches of the sun."""
    assert stepped.solution.pitches == 8
    light = solve_set(stepped.file.plan, stepped.solution.train, np.array([1e-6]), 4, 8)
    assert_allclose(light.ste_um, 0.0, atol=1e-5)
    assert_allclose(light.planet_share, 1.0 / 3.0, rtol=1e-6)
    built, phi = stepped.solution.train, stepped.solution.placed.phi[:5]
    pitch = stepped.solution.pitch_rad
    load_on = [3e5, 0.0, 0.0, 0.0]
    first, later, between = (built.place(phi + n * pitch).solve(load_on).movement[..., 0] for n in (0, 8, 3))
    assert_allclose(later, first, rtol=1e-9)
    assert np.abs(between / first - 1.0).max() > 1e-3


@pytest.mark.parametrize("teeth", [(18, 24, 15, 57), (17, 31, 19, 67), (20, 30, 24, 74)])
def test_planets_can_be_assembled_where_their_lattice_says(teeth):
    """Every place at which some tooth of the planet meets both sun and ring, found by trying them all."""
    sun, first, second, ring = teeth
    apart = 2.0 * (sun + first)
    inner = gear_pair(line_case(sun, first))
    module = apart / (0.5 * (ring - second))
    case = line_case({"teeth": second, "bore_radius_mm": 5.0}, {
        "teeth": ring, "internal": True, "addendum": 0.8, "root_fillet_mm": 0.2, "rim_thickness_mm": 12.0})  # fmt: skip
    assert module == 4.0
    outer = gear_pair(case)

    def meet(angle):
        centres = [Centre("sun", 0.0, 0.0), Centre("ring", 0.0, 0.0)]
        meetings = []
        for number, place in enumerate((0.0, angle)):
            x, y, planet = -apart * math.sin(place), apart * math.cos(place), 2 + 2 * number
            centres += [Centre("planet", x, y, "planet"), Centre("second", x, y, "second", planet)]
            meetings += [Meeting(inner, 0, planet), Meeting(outer, planet + 1, 1)]
        try:
            return placements(centres, meetings)
        except GeometryError:
            return None

    lattice = (sun * second + ring * first) // math.gcd(first, second)
    for step in (1, 7, lattice // 3):
        assert meet(2.0 * math.pi * step / lattice) is not None
        assert meet(2.0 * math.pi * (step + 0.5) / lattice) is None
        planet_positions(Planets(count=2, positions_deg=(0.0, 360.0 * step / lattice)), (sun, ring), (first, second))
    with pytest.raises(GeometryError, match="cannot be assembled"):
        planet_positions(Planets(count=2, positions_deg=(0.0, 180.0 / lattice)), (sun, ring), (first, second))


@pytest.mark.parametrize(
    ("count", "teeth", "stepped"), [(4, (17, 49), (1, 1)), (7, (23, 57), (1, 1)), (5, (18, 54), (18, 17))]
)
def test_positions_that_a_refusal_proposes_can_be_assembled_and_are_taken_for_the_exact_ones(count, teeth, stepped):
    with pytest.raises(GeometryError, match="cannot be assembled") as refused:
        planet_positions(Planets(count=count), teeth, stepped)
    proposed = re.search(r"positions_deg = \[(.*?)\]", str(refused.value))[1]
    places = tuple(map(float, proposed.split(", ")))
    found = planet_positions(Planets(count=count, positions_deg=places), teeth, stepped)
    first, second = (one // math.gcd(*stepped) for one in stepped)
    steps = np.array(found) * (teeth[0] * second + teeth[1] * first) / (2.0 * math.pi)
    assert_allclose(steps, np.round(steps), atol=1e-9)
    assert np.diff(found).min() > 0.0


def test_equal_paths_share_evenly_and_one_ahead_takes_its_stiffness_times_that(tmp_path):
    """Parallel springs: the difference of both torques is k e, k the tangent stiffness of one path."""
    even = solved(tmp_path, power_split())
    left, right, *_ = even.solution.mesh_force_N[0].T
    assert even.solution.pitches == 4
    assert_allclose(left, right, rtol=1e-9)
    assert_allclose(even.solution.mesh_share, 0.5, rtol=1e-9)
    timing, solution = 2e-5, even.solution
    plan = load(written_set(tmp_path, power_split(1e3 * timing))).plan
    ahead = solve_set(plan, solution.train, np.array([100.0]), 6, 4).mesh_force_N[0]
    near = solve_set(even.file.plan, solution.train, np.array([99.0, 101.0]), 6, 4)
    # Of both paths, about the input; the timing of the second shaft is 24 / 18 of it there.
    stiffness = 2e3 / np.diff(near.found.movement[..., 0], axis=0)[0]
    difference = 1e-3 * (ahead[:, 1] - ahead[:, 0]) * solution.train.meshes[0].pair.base_radius
    assert_allclose(difference, 1e-3 * 0.5 * stiffness * timing * 24 / 18, rtol=0.02)


def test_a_double_helical_pair_is_a_helical_one_with_half_the_torque(tmp_path):
    """Each half is a gear; the second mesh has the helix angle of its own section, and its wheel is timed."""
    gears = [
        ("input", (0, 0), 'shaft = "first"', "torque_Nm = 200.0"),
        ("input_2", (0, 0), 'shaft = "first"'),
        ("output", (0, 96), 'shaft = "last"', 'torque_Nm = "balance"'),
        ("output_2", (0, 96), 'shaft = "last"'),
    ]
    slanted = "[pair]\nhelix_angle_deg = {}"
    meshes = [("input", "output"), ("input_2", "output_2", 'pair = "other_hand"')]
    other = slanted.format(-12.0).replace("pair", "other_hand") + "\n" + NO_STRESS
    apart = repr(2.0 * (21 + 25) / math.cos(math.radians(12.0)))
    both = train(gears, meshes, (21, 21, 25, 25), other).replace("[pair]", slanted.format(12.0)).replace("96.0", apart)
    one = train(
        [("input", (0, 0), "torque_Nm = 100.0"), ("output", (0, 96), 'torque_Nm = "balance"')], [("input", "output")],
        (21, 25), NO_STRESS,
    ).replace("[pair]", slanted.format(12.0)).replace("96.0", apart)  # fmt: skip
    found, half = solved(tmp_path, both), solved(tmp_path, one)
    assert_allclose(found.ste_um, half.ste_um, rtol=1e-9)
    thrust = found.solution.hub_wrench[0, :, :, 2]
    assert_allclose(thrust[:, 0], -thrust[:, 1], rtol=1e-9)
    assert (thrust[:, 0] != 0.0).all()


def test_three_stepped_planets_share_evenly_about_a_floating_sun_whatever_their_timing(stepped, tmp_path):
    errors = STEPPED.replace("count = 3", "count = 3\ntiming_mrad = [0.3, 0.0, 0.0]")
    held, floating = (
        solved(tmp_path, f'{errors}{NO_STRESS}[supports]\nsun_radial_N_per_mm = "{sun}"\n').k_gamma[0]
        for sun in ("rigid", "free")
    )
    assert held > 1.1
    assert_allclose(floating, 1.0, atol=0.005)


def test_a_shaft_twists_by_its_torque_over_its_stiffness(tmp_path):
    rigid = solved(tmp_path, two_stages())
    plan = load(written_set(tmp_path, two_stages("torsion_Nmm_per_rad = 1e9"))).plan
    soft = solve_set(plan, replace(rigid.solution.train, compliance=plan.compliance), np.array([100.0]), 6, 4)
    twist = 1e5 * 24 / 18 / 1e9 * 24 / 18  # about the input
    expected = rigid.ste_um + 1e3 * twist * rigid.solution.train.meshes[0].pair.base_radius
    # The wheel runs ahead by the twist: corners meet a little elsewhere.
    assert_allclose(np.median(soft.ste_um - expected), 0.0, atol=1e-6)
    assert_allclose(soft.ste_um, expected, rtol=1e-2)


@pytest.mark.slow
def test_both_stages_have_the_root_stress_of_their_pairs(tmp_path):
    """The second stage passes 3 cycles in 4 of the first; its 24 positions are 8 different ones."""
    found = solved(tmp_path, two_stages())
    assert found.solution.pitches == 4
    for number, (case, torque, angles) in enumerate((("input-wheel", 100.0, 6), ("pinion-output", 100.0 * 24 / 18, 8))):
        case, mesh = found.file.cases[case], found.solution.train.meshes[number]
        phi = mesh.start + mesh.pair.meshed.pair.pitch * np.arange(angles) / angles
        expected = root_stress_and_cycles(pmor.train(case).reduced, phi, conditions_of(case, [torque]))
        for body, cycle in zip(mesh.bodies, expected.cycle, strict=True):
            own = found.solution.root_stress[body]
            # The second stage is behind by what the first one gives way: near corners by a little.
            rtol = 1e-9 if number == 0 else 1e-3
            assert_allclose(own.cycle.range_MPa.max(axis=1), cycle.range_MPa[:, 0], rtol=rtol)


def test_a_stepped_planet_tilts_by_the_moment_of_its_second_gear_about_the_first(tmp_path):
    """On a pin that gives way to moments alone: equilibrium and rigid motion by cross products."""
    tilting = "[supports]\nplanet_tilt_Nmm_per_rad = 1e8\n"
    text = STEPPED.replace("count = 3", "count = 3\nsecond_z_mm = 35.0") + tilting
    solution = solved(tmp_path, text.replace("angles_per_pitch = 6", "angles_per_pitch = 4\npitches = 1")).solution
    wrench, moved, arm = solution.hub_wrench[0], solution.hub_displacement[0], np.array([0.0, 0.0, 35.0])
    first, second = wrench[:, 2:5], wrench[:, 5:8]
    moment = first[..., 3:] + second[..., 3:] + np.cross(arm, second[..., :3])
    assert_allclose(moved[:, 2:5, 3:5], moment[..., :2] / 1e8, rtol=1e-9)
    assert_allclose(solution.planet_wrench[0, ..., 3:], moment, rtol=1e-9, atol=1e-3)
    assert_allclose(moved[:, 2:5, :2], 0.0, atol=1e-12)
    assert_allclose(moved[:, 5:8, :2], np.cross(moved[:, 2:5, 3:], arm)[..., :2], rtol=1e-9)


def test_a_stepped_set_that_is_loaded_the_other_way_is_its_image(stepped, tmp_path):
    """The planet that is ahead stands on the y axis, which the image keeps."""
    ahead = STEPPED.replace("count = 3", "count = 3\ntiming_mrad = [0.2, 0.0, 0.0]")
    one = solve_set(load(written_set(tmp_path, ahead)).plan, stepped.solution.train, np.array([300.0]), 6, 8)
    other = solved(tmp_path, ahead.replace("torque_Nm = 300.0", "torque_Nm = -300.0"))
    assert other.file.plan.clockwise
    assert_allclose(other.ste_um, one.ste_um, rtol=1e-8)
    assert_allclose(other.planet_share[0], one.planet_share[0][:, [0, 2, 1]], rtol=1e-8)


def test_a_sample_has_the_timing_that_its_row_says(stepped, tmp_path):
    """The draws of other errors are those without."""
    sizes = "[tolerances]\npins_tangential_um = 5.0\nsamples = 8\n"
    file = load(written_set(tmp_path, f"{STEPPED}{sizes}timing_mrad = 0.2\n"))
    first, second, *_ = drawn(file.sections)
    other, *_ = drawn(load(written_set(tmp_path, STEPPED + sizes)).sections)
    assert first.planets.tangential_um == other.planets.tangential_um
    assert first.planets.timing_mrad != second.planets.timing_mrad
    drawn_about = solve_set(file.plan, stepped.solution.train, np.array([300.0]), 6, 8)
    samples = solve_samples(file, drawn_about)
    with threads(2) as executor:
        assert np.array_equal(solve_samples(file, drawn_about, executor).figures["k_gamma"], samples.figures["k_gamma"])
    row, _ = sample_rows(samples, np.array([300.0]))[:2]
    timing, pins = ([row[f"{key}_{n}"] for n in (1, 2, 3)] for key in ("timing_mrad", "tangential_um"))
    text = STEPPED.replace("count = 3", f"count = 3\ntiming_mrad = {timing}\ntangential_um = {pins}")
    alone = solve_set(load(written_set(tmp_path, text)).plan, stepped.solution.train, np.array([300.0]), 6, 8)
    assert_allclose(row["k_gamma_300_Nm"], alone.k_gamma[0], rtol=1e-8)


def test_orders_of_a_stepped_set_name_both_meshes(stepped):
    first, *_ = stepped.data["shaft_orders"]
    assert first["mesh_order"] == 15 / 24
    assert first["per_cycle"] == {"second_planet-ring": 1.0}
    beside = {row["mesh_order"]: row["combined"] for row in stepped.data["shaft_orders"]}
    assert beside[0.25] == {"sun-planet": -1, "second_planet-ring": 2}
    assert (first["per_turn"]["planet"], first["per_turn"]["ring"]) == (15.0, 57.0)
    assert [mesh["cycles_per_pitch"] for mesh in stepped.data["meshes"][:2]] == [1.0, 0.625]


def test_a_set_that_is_solved_angle_by_angle_is_the_same(stepped, monkeypatch, tmp_path):
    """Flexibilities of all angles at a time, or of each one; over two cycles, in which the sun is off elsewhere.

    Threads share the angles out, to the last digit.
    """
    plan = load(written_set(tmp_path, f"{STEPPED}[eccentricity]\nsun_um = 20.0\n")).plan
    torque = np.array([300.0])
    whole = solve_set(plan, stepped.solution.train, torque, 4, 16)
    monkeypatch.setattr("pmor.line.several.MOST_BYTES", 1)
    single = solve_set(plan, stepped.solution.train, torque, 4, 16)
    assert_allclose(single.ste_um, whole.ste_um, rtol=SAME)
    with threads(2) as executor:
        shared = solve_set(plan, stepped.solution.train, torque, 4, 16, executor)
    assert np.array_equal(shared.found.force, single.found.force)
    first, second = whole.ste_um[0].reshape(2, -1)
    assert np.abs(second / first - 1.0).max() > 1e-3


@pytest.mark.slow
def test_a_span_that_is_cut_off_says_so(stepped, tmp_path):
    part = solved(tmp_path, STEPPED.replace("[sweep]", "[sweep]\npitches = 3"))
    assert_allclose(part.ste_um, stepped.ste_um[:, : part.ste_um.shape[1]], rtol=SAME)
    assert part.data["shaft_orders"] == []
    assert part.data["ste_harmonics_um"] == [None] * len(part.data["ste_harmonics_um"])
    assert "the set repeats after 8" in str(part)
    long = two_stages(teeth=(19, 53, 19, 53)).replace("angles_per_pitch = 6", "angles_per_pitch = 500")
    with pytest.raises(CaseError, match="the set repeats after 53 pitches of the first gear"):
        load(written_set(tmp_path, long))


@pytest.mark.parametrize("torque", [pytest.param(300.0, marks=pytest.mark.slow), -300.0])
def test_stepped_planets_in_a_gearbox_are_those_of_their_own_file(torque, tmp_path):
    """On shafts that do not give way, but for a soft bearing of the sun: as on supports of that stiffness."""
    of_set = STEPPED.replace("count = 3", "count = 3\ntiming_mrad = [0.2, 0.0, 0.0]")
    model = load_gearbox(written_reducer(tmp_path, one_stage(sun=2e4, torque=torque), of_set)).model
    plan = model.sets["stage"].plan
    (tmp_path / "soft.toml").write_text(of_set + "[supports]\nsun_radial_N_per_mm = 2e4\n")
    alone = load(tmp_path / "soft.toml").plan
    built = train_of(model.sets["stage"])
    on_shafts = replace(built, compliance=plan.compliance, free=plan.free)
    (one,) = solve_load(model, model.sections.loads[0], {}, 0, trains={"stage": on_shafts}).sets
    found = one.solution
    expected = solve_set(alone, replace(built, compliance=alone.compliance), np.array([300.0]), 6, 8)
    assert found.pitches == 8
    # What one planet carries more turns with the carrier.
    assert_allclose(one.meshing.wrenches[:, 1:3], 0.0, atol=1e-12)
    assert_allclose(speeds_rpm(model, model.sections.loads[0])["carrier"], 1000.0 / (1.0 + RATIO), rtol=1e-12)
    assert_allclose(found.ste_um, expected.ste_um, rtol=1e-8)
    assert_allclose(found.planet_share, expected.planet_share, rtol=1e-8)
