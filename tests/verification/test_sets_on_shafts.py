"""Planetary sets as a part of a gearbox: on shafts that do not give way a set is that of its own file, on soft ones it
stands on the condensed compliance, and torques, speeds, forces and losses go through the stages."""

import math
from dataclasses import replace
from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.app.cli import main
from pmor.core.errors import CaseError
from pmor.gear.pair import GearPair
from pmor.gear.tooth import Tooth
from pmor.machine.coupled import solve_load
from pmor.machine.coupled_sets import MEAN_ANGLES
from pmor.machine.loader import load
from pmor.machine.model import pinion_torques, set_torques, speeds_rpm
from pmor.machine.run import run
from pmor.results.load_distribution import loss_factor
from pmor.rexs.write_gearbox import gearbox_rexs
from pmor.sets.loader import load as load_set
from pmor.sets.run import train_of
from pmor.sets.solution import solve_set
from pmor.sets.tolerances import solve_samples
from tests.support.set_gearboxes import EVEN_SET, TWO_STAGES, bearing, one_stage, two_sets, written_reducer
from tests.support.small_sets import SMALL_CHAIN

# Half the width is meshed of a set that cannot tilt, the whole of one on shafts: round-off of the finite elements.
ROUND_OFF = 1e-9
# Rounds of shafts and sets stop where forces across move by 1e-6 of those of the torque, 0.004 N here on 1e4 N/mm.
SETTLES = 1e-3
# Where tip corners carry, the rows of a pair's hubs have the levers of its flanks: of the second stage.
CORNERS = 3e-4
# Bearings of 1e12 N/mm give way by about 1e-5 of what the teeth do.
NEARLY_RIGID, GIVES_WAY = 1e12, 3e-5
# The carrier of a star is in the housing: its shaft carries the ring.
CARRIER_HELD = 'carrier = "housing"\nring = {'


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("sets_on_shafts")


@pytest.fixture(scope="module")
def trains(folder):
    """Finite elements of the small set, once for all gearboxes of it."""
    return {"stage": train_of(load(written_reducer(folder, one_stage())).model.sets["stage"])}


def on_shafts(folder, trains, text, of_set=EVEN_SET):
    """The set of a gearbox under its first load, and that load."""
    file = load(written_reducer(folder, text, of_set))
    plan = file.model.sets["stage"].plan
    # Planes, errors and supports of the set are as this file has them.
    train = replace(trains["stage"], compliance=plan.compliance, free=plan.free)
    solved = solve_load(file.model, file.model.sections.loads[0], {}, 0, trains={"stage": train})
    return solved.sets[0], solved


def alone(folder, trains, changes=""):
    """The set of its own file, with further sections."""
    path = folder / "alone.toml"
    path.write_text(EVEN_SET + changes)
    plan = load_set(path).plan
    train = replace(trains["stage"], compliance=plan.compliance, free=plan.free)
    file = load_set(path)
    return solve_set(plan, train, np.array([plan.torque_Nm]), file.sections.sweep.angles_per_pitch, file.pitches)


def whole_set(folder, of_set=EVEN_SET):
    """A set of its own file, on all of the width as on shafts, which tilt."""
    path = folder / "whole.toml"
    path.write_text(of_set.replace("[mesh]", '[mesh]\nwidth = "whole"'))
    return load_set(path)


def same(found, expected, rtol):
    assert found.converged.all()
    assert_allclose(found.ste_um[0], expected.ste_um[0], rtol=rtol)
    assert_allclose(found.planet_share[0], expected.planet_share[0], atol=rtol)
    for mesh in range(len(found.train.meshes)):
        assert_allclose(found.k_h_beta(mesh), expected.k_h_beta(mesh), rtol=rtol)


def test_on_shafts_that_do_not_give_way_a_set_is_that_of_its_own_file_and_so_are_its_tolerances(folder):
    of_set = f"{EVEN_SET}[tolerances]\npins_tangential_um = 5.0\nsun_eccentricity_um = 4.0\nsamples = 8\n"
    result = run(load(written_reducer(folder, one_stage(), of_set)))
    (found,) = result.loads[0].sets
    plain = whole_set(folder, of_set)
    expected = solve_set(plain.plan, train_of(plain), np.array([300.0]), 6)
    same(found.solution, expected, ROUND_OFF)
    same(found.rigid, expected, ROUND_OFF)
    drawn = solve_samples(plain, expected)
    assert_allclose(found.samples.figures["k_gamma"], drawn.figures["k_gamma"], rtol=ROUND_OFF)
    assert_allclose(found.samples.figures["ste_peak_to_peak_um"], drawn.figures["ste_peak_to_peak_um"], rtol=ROUND_OFF)
    (row,) = result.data["loads"][0]["sets"][0]["tolerances"]["torques"]
    assert row["k_gamma"]["mean"] == pytest.approx(drawn.figures["k_gamma"].mean())
    # In REXS the torque of its meshes on the sun holds that of the load, about x.
    root = ElementTree.fromstring(gearbox_rexs(result.file, result.loads, result.data["loads"], "today"))
    sun = root.find("components/component[@name='sun'][@type='cylindrical_gear']").get("id")
    torque = root.find(f"load_spectrum/load_case/component[@id='{sun}']/attribute[@id='torque_acting_on_shaft_u']")
    assert float(torque.text) == pytest.approx(-300.0, rel=1e-6)


@pytest.mark.parametrize("torque", [300.0, -300.0])
def test_a_sun_on_a_soft_bearing_is_one_on_supports_of_the_same_stiffness(folder, trains, torque):
    of_set = EVEN_SET + "[planets]\ncount = 3\ntangential_um = [10.0, 0.0, 0.0]\n"
    of_set = of_set.replace("[planets]\ncount = 3\n[load]", "[load]")
    found, _ = on_shafts(folder, trains, one_stage(sun=2e4, torque=torque), of_set)
    path = folder / "soft.toml"
    path.write_text(of_set + "[supports]\nsun_radial_N_per_mm = 2e4\n")
    plan = load_set(path).plan
    train = replace(trains["stage"], compliance=plan.compliance)
    same(found.solution, solve_set(plan, train, np.array([300.0]), 6), ROUND_OFF)
    assert np.abs(found.solution.hub_displacement[0, :, 0, :2]).max() > 1e-3


def test_hubs_that_other_loads_move_in_the_housing_are_a_ring_that_is_eccentric_there(folder, trains):
    moved = "forces = [\n" + "".join(
        f'{{ shaft = "{shaft}", at_mm = {at}, y_N = {-1e-2 * NEARLY_RIGID}, z_N = {2e-2 * NEARLY_RIGID} }},\n'
        for shaft, at in (("sun", 50.0), ("carrier", 10.0))
    ) + "]\n"  # fmt: skip
    text = one_stage(sun=NEARLY_RIGID, extra=moved)
    text = text.replace(bearing("B", "carrier", 10.0), bearing("B", "carrier", 10.0, NEARLY_RIGID))
    found, _ = on_shafts(folder, trains, text)
    # Seen along x, with y upwards, z points to the left: counter-clockwise from y.
    eccentric = f"[eccentricity]\nring_um = {1e3 * math.hypot(1e-2, 2e-2)}\n"
    eccentric += f"ring_deg = {math.degrees(math.atan2(-2.0, 1.0))}\n"
    expected = alone(folder, trains, eccentric)
    assert found.solution.pitches == expected.pitches == 54
    assert np.ptp(expected.planet_share[0]) > 0.1
    same(found.solution, expected, GIVES_WAY)


@pytest.mark.slow
def test_an_eccentric_ring_presses_on_the_bearings_of_the_sun_in_one_direction_of_the_housing(folder, trains):
    of_set = EVEN_SET + "[eccentricity]\nring_um = 30.0\nring_deg = 180.0\n"
    found, solved = on_shafts(folder, trains, one_stage(sun=2e4), of_set)
    assert found.solution.pitches == 54
    force = found.torque * found.meshing.wrenches[0, :3]
    # The ring, 30 um below, pushes planets down where they go down, these the sun upwards, both at 20 degrees to that.
    assert force[1] > 100.0
    assert_allclose(force[2] / force[1], -math.tan(math.radians(40.0)), rtol=0.01)
    moved = solved.equilibrium.displacement[found.meshing.hubs[0] + 1]
    assert_allclose(2e4 * moved, force[1], rtol=1e-9)


def test_shafts_and_set_agree_about_how_hubs_move_and_what_forces_act(folder, trains):
    push = 'forces = [{ shaft = "sun", at_mm = 0.0, y_N = 300.0, z_N = -100.0 }]\n'
    # As many angles of a mesh cycle as give the mean that goes to the shafts.
    of_set = EVEN_SET.replace("angles_per_pitch = 6", f"angles_per_pitch = {MEAN_ANGLES}")
    found, solved = on_shafts(folder, trains, one_stage(sun=1e4, extra=push), of_set)
    one, hub = found.meshing, found.meshing.hubs[0]
    solution, plan = found.solution, found.solution.plan
    angle = solution.train.rates[plan.in_housing.housing] * solution.phi_rad
    own = solution.hub_displacement[0, :, 0]
    # What the set does to the sun, seen in the housing, beside what all other loads do to it.
    turned = ((own[:, 0] + 1j * own[:, 1]) * np.exp(-1j * angle)).mean() + plan.in_housing.displacement[0]
    moved = one.frame.turn.T @ solved.equilibrium.displacement[hub : hub + 6]
    assert_allclose([turned.real, turned.imag], moved[:2], rtol=SETTLES)
    spring = 1e4 * solved.equilibrium.displacement[hub : hub + 3]
    meshes = found.torque * one.wrenches[0]
    assert_allclose(spring[1:], [300.0 + meshes[1], -100.0 + meshes[2]], rtol=1e-9)
    # The meshes of the set take most of it.
    assert np.hypot(*spring[1:]) < 0.1 * math.hypot(300.0, 100.0)


@pytest.mark.slow
def test_a_planetary_stage_and_a_pair_hand_on_torques_speeds_and_losses(folder):
    file = load(written_reducer(folder, TWO_STAGES))
    target = folder / "out"
    found = run(file, folder=target)
    found.write(target)
    entry, (one,) = found.data["loads"][0], found.data["loads"][0]["sets"]
    (load_case,) = file.model.sections.loads
    assert_allclose(set_torques(file.model, load_case)["stage"], -60.0, rtol=ROUND_OFF)
    speeds = {"carrier": 100.0, "sun": 400.0, "out": -400.0 * 19 / 29}
    assert_allclose([speeds_rpm(file.model, load_case)[name] for name in speeds], [*speeds.values()], rtol=ROUND_OFF)
    assert_allclose([*one["torques_Nm"].values()], [-60.0, 240.0, -180.0], rtol=ROUND_OFF)
    assert_allclose(pinion_torques(file.model, load_case)["pair"], 60.0, rtol=ROUND_OFF)
    assert_allclose(entry["meshes"][0]["torque_Nm"], 60.0, rtol=CORNERS)
    assert_allclose(entry["held_torques_Nm"][0]["torque_Nm"], 60.0 * 29 / 19, rtol=CORNERS)
    assert_allclose(entry["power_W"], 240.0 * 100.0 * math.pi / 30.0, rtol=ROUND_OFF)
    losses = [mesh["losses_W"] for mesh in (*entry["meshes"], *one["meshes"])]
    assert len(losses) == 7
    assert_allclose(entry["losses_W"], sum(losses), rtol=ROUND_OFF)
    # Beside the pair's force the sun stands off its axis: planets share as the carrier turns.
    assert one["pitches"] == 54
    assert one["rigid_k_gamma"] < 1.0 + 1e-6 < 1.05 < one["k_gamma"]
    assert {path.name for path in target.iterdir()} >= {"set_stage_gears.svg", "set_stage_gears.vtkhdf", "ste.svg"}


@pytest.mark.slow
def test_two_sets_that_push_each_other_on_one_shaft_settle_and_hand_on_the_torque(folder, trains):
    file = load(written_reducer(folder, two_sets(push_N=200.0)))
    both = dict.fromkeys(("first", "second"), trains["stage"])
    solved = solve_load(file.model, file.model.sections.loads[0], {}, 0, trains=both)
    assert_allclose([one.torque for one in solved.sets], [240e3, 60e3], rtol=ROUND_OFF)
    speeds = speeds_rpm(file.model, solved.load)
    assert_allclose([speeds[name] for name in ("rotor", "middle", "sun")], [1000.0, 4000.0, 16000.0], rtol=ROUND_OFF)
    # The push on the last shaft moves the load of the planets of both.
    assert all(one.solution.k_gamma[0] > 1.001 for one in solved.sets)


def test_a_star_stands_still_so_that_what_other_loads_do_to_its_sun_is_an_error_of_its_place(folder, trains):
    of_set = EVEN_SET.replace("[load]", '[load]\nheld = "carrier"')
    push = 'forces = [{ shaft = "sun", at_mm = 50.0, y_N = 300.0, z_N = -100.0 }]\n'
    text = one_stage(sun=2e4, extra=push).replace("carrier = {", CARRIER_HELD)
    found, _ = on_shafts(folder, trains, text, of_set)
    path = folder / "star.toml"
    path.write_text(of_set + "[supports]\nsun_radial_N_per_mm = 2e4\n")
    plan = load_set(path).plan
    # x of a set whose z is x of the machine, and whose y is y, is -z.
    displacement = plan.displacement.copy()
    displacement[:2] = [100.0 / 2e4, 300.0 / 2e4]
    train = replace(trains["stage"], compliance=plan.compliance)
    same(found.solution, solve_set(replace(plan, displacement=displacement), train, np.array([300.0]), 6), ROUND_OFF)
    assert found.solution.pitches == 1
    # The force across goes to the shafts as it is.
    assert np.hypot(*found.meshing.wrenches[0, 1:3]) * found.torque > 100.0
    assert_allclose(found.meshing.wrenches[:, 3], [-1.0, 4.0, -3.0], rtol=ROUND_OFF)


def test_stepped_planets_hand_on_the_torque_that_their_meshes_make(folder):
    of_set = EVEN_SET.replace("[planet]\nteeth = 18", "[planet]\nteeth = 24").replace("teeth = 54", "teeth = 57")
    of_set += "[second_planet]\nteeth = 15\nbore_radius_mm = 15.0\n"
    file = load(written_reducer(folder, one_stage(), of_set))
    train = train_of(file.model.sets["stage"])
    solved = solve_load(file.model, file.model.sections.loads[0], {}, 0, trains={"stage": train})
    (one,) = solved.sets
    plain = whole_set(folder, of_set)
    expected = solve_set(plain.plan, train_of(plain), np.array([300.0]), 6, plain.pitches)
    assert one.solution.pitches == expected.pitches
    same(one.solution, expected, ROUND_OFF)
    ratio = 57.0 * 24.0 / 15.0 / 18.0
    assert_allclose(one.meshing.wrenches[:, 3], [-1.0, 1.0 + ratio, -ratio], rtol=ROUND_OFF)
    # As the forces of the meshes have it, about the hubs of sun, carrier and ring.
    total = one.solution.hub_wrench[0].mean(axis=0).ravel() @ one.meshing.frame.carried
    assert_allclose(total[5::6], one.torque * one.meshing.wrenches[:, 3], rtol=CORNERS)


def test_the_flanks_of_a_ring_slide_as_ohlendorf_has_it_with_the_signs_of_a_ring():
    planet, ring = Tooth(22, 4.0, math.radians(20.0)), Tooth(-61, 4.0, math.radians(20.0), addendum=0.92)
    pair = GearPair(planet, ring, 20.0, -78.0)
    (start, end), _ = pair.active_rolls
    pairs, angles = np.arange(math.ceil(pair.contact_ratio)), (np.arange(20000) + 0.5) / 20000 * pair.pitch
    on_planet = start + angles[:, None] + pair.pitch * pairs
    on_ring = (pair.action_length - planet.base_radius * on_planet) / ring.base_radius
    carries = on_planet < end
    load = carries / carries.sum(axis=1, keepdims=True)
    rolls = np.stack([on_planet, on_ring], axis=-1)[:, :, None]
    lines = SimpleNamespace(load_N_per_mm=load[None, :, :, None], width_mm=np.ones(1), roll_rad=rolls)
    found = loss_factor(pair, lines)
    ratio, pitch = -61.0 / 22.0, 2.0 * math.pi * planet.base_radius / 22.0
    middle = planet.base_radius * math.tan(pair.working_pressure_angle)
    before, after = (abs(planet.base_radius * roll - middle) / pitch for roll in (start, end))
    expected = math.pi * (ratio + 1.0) / (22.0 * ratio) * (1.0 - before - after + before**2 + after**2)
    assert_allclose(found, expected, rtol=1e-4)  # of 20000 angles


def test_a_gearbox_with_a_set_that_rexs_has_no_words_for_is_refused_by_name(tmp_path, capsys):
    path = written_reducer(tmp_path, one_stage(), EVEN_SET.replace("torque_Nm = 300.0", "torque_Nm = -300.0"))
    assert main(["export", str(path), "--to", "rexs", "-o", str(tmp_path / "box.rexs")]) == 2
    refused = "stage: a REXS file takes planetary sets whose torque turns the sun counter-clockwise"
    assert refused in capsys.readouterr().err
    assert not (tmp_path / "box.rexs").exists()


BROKEN = {
    "two members in the housing": (
        'sun = { shaft = "sun", at_mm = 50.0 }', 'sun = "housing"', "sun and ring in the housing"
    ),
    "no member in the housing": (
        "carrier = {", 'ring = { shaft = "sun", at_mm = 1.0 }\ncarrier = {', "no member in the housing"
    ),
    "one shaft": ('carrier = { shaft = "carrier"', 'carrier = { shaft = "sun"', "they turn together"),
    "another axis": ("start_mm = 70.0\n", "start_mm = 70.0\nat_mm = [90.0, 0.0]\n", "have different axes"),
    "beyond the shaft": ("at_mm = 50.0 }", "at_mm = 61.0 }", "goes from 0 to 60 mm"),
    "no file": ('set = "small.toml"', 'set = "smal.toml"', "no such set file"),
    "another member held": ("[load]", '[load]\nheld = "carrier"\non = "sun"', 'has held = "carrier"'),
    "a train": (EVEN_SET, None, "is of gears on fixed axes"),
    "neither": ("[[sets]]", "[[set]]", "did you mean sets"),
    "no torque": ("torque_Nm = 300.0 },", "torque_Nm = 0.0 },", "no torque to carry"),
}  # fmt: skip


@pytest.mark.parametrize("name", BROKEN)
def test_a_set_that_does_not_fit_its_gearbox_is_refused_with_the_remedy(name, tmp_path):
    old, new, words = BROKEN[name]
    text, of_set = one_stage(), SMALL_CHAIN if new is None else EVEN_SET
    assert new is None or old in text or old in of_set
    if new is not None:
        text, of_set = text.replace(old, new, 1), of_set.replace(old, new, 1)
    with pytest.raises(CaseError, match=words):
        load(written_reducer(tmp_path, text, of_set))
