"""Eccentric gears, pitch deviations, tolerances of sets: closed forms, pairs by themselves, sets as files say them."""

import csv
import json
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor
from pmor.gear.condition import ALIGNED, Assembly
from pmor.gear.made_flanks import MadeFlank, nominal_flanks, with_made
from pmor.gear.modification import Modification, Wave
from pmor.pair.conditions import assembly_of
from pmor.pair.samples import sample_rows
from pmor.sets.draws import drawn
from pmor.sets.loader import load
from pmor.sets.run import run
from pmor.sets.solution import solve_placed
from pmor.sets.tolerances import sampled_figures
from tests.support.matrix import SPLIT, SPLIT_GEARS
from tests.support.small_sets import NO_STRESS, SMALL_CHAIN, SMALL_SET, chain, written_set

# Solutions by Newton's method, to its tolerance.
SOLVED = 1e-8
# mm, and of the order that it makes: teeth that carry at their corners meet off the line of action.
E_UM, OFF_LINE = 20.0, 2e-3
ONE = SMALL_SET.replace("torques_Nm = [100.0]", "").replace("tangential_um = [10.0, 0.0, 0.0]", "missing = [2, 3]")
ONE += NO_STRESS
THREE = SMALL_SET.replace("torques_Nm = [100.0]", "").replace("tangential_um = [10.0, 0.0, 0.0]", "") + NO_STRESS


def solved(folder, text):
    return run(load(written_set(folder, text)))


def order(found, per_turn, teeth):
    """Amplitude of the order that a gear makes so many times a turn, um."""
    solution = found.solution
    return solution.ste_orders(0).amplitude[round(per_turn * solution.pitches / teeth) - 1]


@pytest.mark.parametrize(
    ("error", "teeth", "times"),
    [("sun_um = 20.0", 18, 1.0), ("ring_um = 20.0", 54, 1.0), ("planets_um = [20.0, 0.0, 0.0]", 18, None)],
)
def test_an_eccentric_gear_makes_the_first_order_of_its_shaft(error, teeth, times, tmp_path):
    """By one mesh the whole eccentricity, along the line of action; a planet's by both, cos(alpha) of each."""
    found = solved(tmp_path, f"{ONE}[eccentricity]\n{error}\n")
    assert found.solution.pitches == teeth
    assert found.solution.converged.all()
    times = times or 2.0 * np.cos(np.radians(20.0))
    assert_allclose(order(found, 1, teeth), times * E_UM, rtol=OFF_LINE)


def test_a_floating_sun_moves_out_of_the_way_of_its_eccentricity(tmp_path):
    """Its teeth stay where they are and its hub circles about them: loads and transmission error do not feel it."""
    text = f'{THREE}[supports]\nsun_radial_N_per_mm = "free"\n'
    plain, off = solved(tmp_path, text), solved(tmp_path, f"{text}[eccentricity]\nsun_um = 20.0\nsun_deg = 40.0\n")
    assert off.solution.pitches == 18
    assert_allclose(off.ste_um, np.tile(plain.ste_um, 18), rtol=SOLVED)
    assert_allclose(off.planet_share, np.tile(plain.planet_share, (1, 18, 1)), rtol=SOLVED)
    phi = off.solution.phi_rad + np.radians(40.0)
    moved = off.solution.hub_displacement[0, :, 0, :2] - np.tile(plain.solution.hub_displacement[0, :, 0, :2], (18, 1))
    assert_allclose(moved, 1e-3 * E_UM * np.stack([np.sin(phi), -np.cos(phi)], axis=1), rtol=0.0, atol=1e-8)


def test_three_planets_average_an_eccentric_sun_in_its_bearings(tmp_path):
    """With equal planets the first order cancels but for what stiffness over the mesh cycle leaves; shares feel it."""
    found = solved(tmp_path, f"{THREE}[eccentricity]\nsun_um = 20.0\n")
    assert order(found, 1, 18) < 0.02 * E_UM
    assert found.k_gamma[0] > 1.05


@pytest.mark.parametrize("helix", [0.0, 15.0])
def test_pitch_deviations_and_waves_are_those_of_pairs(helix, rng):
    """A train of a rigid idler: each mesh, the image too, by itself with the teeth that are in mesh there."""
    _, train = chain((21, 25, 19), helix, 0.0, width="whole")
    first, second = train.meshes
    deviations = [tuple(rng.normal(0.0, 3.0, count)) for count in (21, 25, 25, 19)]
    waves = (Wave(count=37, amplitude_um=2.0, phase_deg=50.0, helix_phase_deg=90.0),)
    flanks = [Modification(pitch_deviations_um=values, waves=waves) for values in deviations]
    meshes = tuple(
        replace(mesh, assembly=Assembly(pinion=one, wheel=other))
        for mesh, one, other in ((first, *flanks[:2]), (second, *flanks[2:]))
    )
    train = replace(train, meshes=meshes, bodies=tuple(replace(body, far=None) for body in train.bodies))
    pitch = first.pair.meshed.pair.pitch
    phi = pitch * np.arange(3) / 3
    placed = train.place(phi)
    for number in (0, 7):
        off = placed.tooth_deviation(number, [mesh.assembly for mesh in meshes])
        found = solve_placed(placed, np.array([[1e5, 0.0]]), off)
        ahead = 0.0
        for mesh, torque in zip(meshes, (1e5, 1e5 * 25 / 21), strict=True):
            # The teeth that the pair counts as 0 are others on the bodies.
            turned = [
                replace(
                    flank, pitch_deviations_um=tuple(np.roll(flank.pitch_deviations_um, -tooth)),
                    waves=(replace(waves[0], phase_deg=50.0 - 37 * 360.0 * tooth / len(flank.pitch_deviations_um)),),
                )
                for flank, tooth in zip((mesh.assembly.pinion, mesh.assembly.wheel), mesh.first_tooth, strict=True)
            ]
            alone = mesh.pair.place(mesh.start + mesh.rate * (phi + number * pitch), ALIGNED)
            one = alone.solve(np.array([torque]), deviation=alone.deviation(Assembly(ALIGNED, *turned)))
            ahead = ahead + one.advance[0] * mesh.pair.base_radius
        assert_allclose(found.movement[0, :, 0] * first.pair.base_radius, ahead, rtol=2e-3 if helix else SOLVED)


@pytest.mark.slow
def test_a_sample_is_the_set_that_a_file_with_its_errors_says(tmp_path, undrawn):
    """By the columns of the table, which are the keys of a file; in the frame of the image, too."""
    sizes = "pins_radial_um = 5.0\npins_tangential_um = 10.0\nsun_eccentricity_um = 5.0\nplanets_eccentricity_um = 3.0"
    text = f"{THREE}[tolerances]\n{sizes}\nsamples = 8\nseed = 3\n"
    text = text.replace("torque_Nm = 300.0", "torque_Nm = -300.0").replace(
        "angles_per_pitch = 6", "angles_per_pitch = 4"
    )
    text = text.replace("[sweep]", "[eccentricity]\nsun_um = 20.0\nsun_deg = 70.0\n[sweep]\npitches = 3")
    found = pmor.run(written_set(tmp_path, text))
    found.write(tmp_path / "out")
    with (tmp_path / "out" / "tolerances.csv").open() as file:
        row = list(csv.DictReader(file))[5]

    def listed(key):
        return [float(row[f"{key}_{planet}"]) for planet in (1, 2, 3)]

    alone = text[: text.index("[tolerances]")]
    for old, new in {
        "sun_um = 20.0": f"sun_um = {row['sun_um']}\nplanets_um = {listed('planets_um')}",
        "sun_deg = 70.0": f"sun_deg = {row['sun_deg']}\nplanets_deg = {listed('planets_deg')}",
        "count = 3": f"count = 3\nradial_um = {listed('radial_um')}\ntangential_um = {listed('tangential_um')}",
    }.items():
        assert old in alone
        alone = alone.replace(old, new)
    again = solved(tmp_path, alone)
    assert_allclose(float(row["k_gamma_300_Nm"]), again.k_gamma[0], rtol=SOLVED)
    assert_allclose(float(row["ste_peak_to_peak_um_300_Nm"]), np.ptp(again.ste_um[0]), rtol=SOLVED)
    assert again.k_gamma[0] > 1.01


def test_a_sample_of_a_train_is_the_train_with_the_errors_of_its_row(tmp_path):
    """Timing of gears that share a shaft and eccentricities, about those of the file; paths share alike without."""
    plain = SPLIT.replace('shaft = "left"', 'shaft = "left"\neccentricity_um = 4.0')
    sizes = "[tolerances]\ntiming_mrad = 0.1\ngears_eccentricity_um = 3.0\nsamples = 8\n"
    short = plain.replace("angles_per_pitch = 4", "angles_per_pitch = 4\npitches = 2")
    found = solved(tmp_path, short + sizes)
    row = sample_rows(found.samples, [100.0])[3]
    filed = found.data["tolerances"]["torques"][0]["share_max"]["as_filed"]
    assert row["input.timing_mrad"] == 0.0 != row["left_pinion.timing_mrad"]
    text, keys = short.replace("\neccentricity_um = 4.0", ""), ("timing_mrad", "eccentricity_um", "eccentricity_deg")
    for name in SPLIT_GEARS:
        errors = "".join(f"{key} = {row[f'{name}.{key}']}\n" for key in keys)
        text = text.replace(f'name = "{name}"\n', f'name = "{name}"\n{errors}')
    again = sampled_figures(solved(tmp_path, text).solution)
    assert set(again) == {"ste_peak_to_peak_um", "share_max", "k_h_beta", "flank_pressure_max_MPa"}
    for key, value in again.items():
        assert_allclose(row[f"{key}_100_Nm"], value[0], rtol=SOLVED)
    assert row["share_max_100_Nm"] > filed + 0.01


@pytest.mark.slow
def test_percentiles_of_one_pin_are_those_of_its_normal_distribution(tmp_path):
    """Two planets on a fixed sun, off by little: K_gamma - 1 goes with the amount of the difference of two draws."""
    text = THREE.replace("count = 3", "count = 2").replace("angles_per_pitch = 6", "angles_per_pitch = 4")
    sizes = "[tolerances]\npins_tangential_um = {}\nsamples = {}\n"
    found = solved(tmp_path, text + sizes.format(0.5, 2000))
    rows = found.data["tolerances"]["torques"][0]["k_gamma"]
    tangential = np.array([[row[f"tangential_um_{n}"] for n in (1, 2)] for row in found.samples.errors])
    assert_allclose(tangential.std(), 0.5, rtol=0.05)
    apart = np.abs(tangential[:, 0] - tangential[:, 1])
    ahead = found.samples.figures["k_gamma"][:, 0] - 1.0
    assert_allclose(ahead / apart, np.median(ahead / apart), rtol=5e-3)
    # Of |N(0, 1)|: 0.6745 and 1.9600.
    ratio = (rows["percentile_95"] - 1.0) / (rows["percentile_50"] - 1.0)
    assert_allclose(ratio, 1.95996 / 0.67449, rtol=0.05)


def test_the_same_seed_draws_the_same_sets_and_a_further_error_leaves_the_others(tmp_path):
    text = f"{THREE}[tolerances]\npins_tangential_um = 10.0\nsamples = 8\nseed = {{}}\n{{}}"
    pins = [
        [said.planets.tangential_um for said in drawn(load(written_set(tmp_path, text.format(*more))).sections)]
        for more in ((1, ""), (1, "sun_eccentricity_um = 5.0\n"), (2, ""))
    ]
    assert pins[0] == pins[1] != pins[2]


def test_pitch_deviations_by_planet_are_those_of_each_planet(tmp_path):
    """Equal lists are one list; a thick tooth of one planet loads it as that of the next one loads the next one."""
    plain = THREE.replace("angles_per_pitch = 6", "angles_per_pitch = 4\npitches = 6")
    thick, none = [-8.0] + [0.0] * 17, [0.0] * 18

    def with_lists(deviations):
        flanks = f"[planet.modification]\npitch_deviations_um = {deviations}\n"
        return load(written_set(tmp_path, f"{plain}{flanks}"))

    alike, one_list = with_lists([thick, thick, thick]), with_lists(thick)
    assert alike.pitches == one_list.pitches
    for mesh in alike.plan.meshes:
        assert mesh.assembly == assembly_of(one_list.cases[mesh.case])
    first, second = (run(with_lists(lists)).planet_share[0] for lists in ([thick, none, none], [none, thick, none]))
    assert np.ptp(first, axis=1).max() > 0.05
    # Planets are in phase: turned by a third of a turn the set is itself.
    assert_allclose(np.roll(first, 1, axis=1), second, atol=1e-6)


def test_teeth_of_flanks_that_carry_nothing_are_told(tmp_path):
    """The ring carries on its coast flanks while the torque on the sun is positive; planets carry on both."""
    wave = "waves = [{ count = 20, amplitude_um = 1.0 }]\n"
    for side, told in (("modification", 1), ("coast_modification", 0)):
        notes = load(written_set(tmp_path, f"{THREE}[ring.{side}]\n{wave}[planet.{side}]\n{wave}")).notes
        assert sum("[ring.modification] waves: of flanks that carry nothing" in note for note in notes) == told
        assert len(notes) == told


@pytest.mark.slow
def test_a_train_of_made_gears_is_the_one_whose_file_says_their_flanks(tmp_path):
    """By the rows of its table, both flanks of an idler, in the frame of the drawing; over a turn of the idler."""
    text = SMALL_CHAIN.replace("width_elements = 2", 'width_elements = 2\nwidth = "whole"') + NO_STRESS
    sizes = "[tolerances]\nflank_tolerance_class = 7\nwaves_per_pitch = [1.2]\nsamples = 8\nseed = 5\n"
    found = pmor.run(written_set(tmp_path, text + sizes))
    row, told = found.samples.errors[3], found.samples.figures["ste_peak_to_peak_um"][3]
    assert found.samples.pitches == 25
    meshes, flanks = zip(found.solution.plan.meshes, found.solution.train.meshes, strict=True), ""
    for mesh, placed in meshes:
        for body, nominal in zip(placed.bodies, nominal_flanks(placed.pair.meshed.pair), strict=True):
            gear = found.solution.plan.bodies[body].name
            pitch, profile, helix = (
                np.array([row[f"{gear} in {mesh.case}.made_{key}_{tooth}"] for tooth in range(1, nominal.teeth + 1)])
                for key in ("pitch_deviations_um", "profile_slope_um", "helix_slope_um")
            )
            wave = f"{gear} in {mesh.case}.made_wave_{round(1.2 * nominal.teeth)}"
            keys = {key: row[f"{wave}_{key}"] for key in ("amplitude_um", "phase_deg", "helix_phase_deg")}
            waves = (Wave(count=round(1.2 * nominal.teeth), **keys),)
            made = with_made(Modification(), MadeFlank(pitch, profile, helix, waves), nominal)
            side = "coast_modification" if placed.image else "modification"
            grid = ", ".join(f"{key} = {json.dumps(value)}" for key, value in vars(made.topography).items())
            wave = ", ".join(f"{key} = {value}" for key, value in vars(waves[0]).items())
            flanks += f"[{gear}.{side}]\npitch_deviations_um = {pitch.tolist()}\ntopography = {{ {grid} }}\n"
            flanks += f"waves = [{{ {wave} }}]\n"
    text = text.replace("[sweep]", "[sweep]\npitches = 25")
    other = pmor.run(written_set(tmp_path, text + flanks))
    assert_allclose(told, np.ptp(other.solution.ste_um, axis=1), rtol=SOLVED)
