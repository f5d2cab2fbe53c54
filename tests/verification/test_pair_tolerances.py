"""Pairs within tolerances, alone and on the shafts of a gearbox: samples are pairs with the errors that they tell."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor
from pmor.case import change_case, parse_case
from pmor.gear.made_flanks import MadeFlank, nominal_flanks, with_made
from pmor.gear.modification import Modification, Wave
from pmor.machine.loader import load
from pmor.machine.run import run
from pmor.pair.conditions import conditions_of_assembly
from pmor.pair.samples import sample_rows
from pmor_online.model import on_hubs
from pmor_online.samples import PITCH, drawn, sampled_figures, solve_samples
from pmor_online.sweep import sweep_reduced_pair
from tests.support.gearboxes import SMALL, SMALL_CASE
from tests.support.matrix import PLANE, ROWS, WIDE

# Solutions by Newton's method, to its tolerance.
SOLVED = 1e-8
ALL = {"profile_slope_um": 4.0, "pitch_deviations_um": 3.0, "centre_distance_um": 10.0, "samples": 8, "seed": 2}


def small(**changes):
    return change_case(parse_case(ROWS["coast flanks"], "small", "small"), **changes)


def test_a_sample_is_the_pair_with_the_errors_of_its_row():
    """Coast flanks, in the frame of the drawing: amounts of both gears, axes, and each tooth over a turn."""
    case = small(mesh=WIDE, tolerances=ALL | {"flank_tolerance_class": 6, "waves_per_pitch": [1.3]})
    reduced = pmor.train(case).reduced
    samples = solve_samples(reduced, case.online.torques_Nm, 4)
    assert (samples.pitches, len(samples.errors)) == (21, 8)
    row = sample_rows(samples, case.online.torques_Nm)[5]
    flanks = {}
    for gear, nominal in zip(("pinion", "wheel"), nominal_flanks(reduced.meshed.pair), strict=True):
        pitch, made, profile, helix = (
            np.array([row[f"{gear}.{key}_{tooth}"] for tooth in range(1, 22)])
            for key in (PITCH, f"made_{PITCH}", "made_profile_slope_um", "made_helix_slope_um")
        )
        wave = {key: row[f"{gear}.made_wave_27_{key}"] for key in ("amplitude_um", "phase_deg", "helix_phase_deg")}
        made_flank = MadeFlank(pitch + made, profile, helix, (Wave(count=27, **wave),))
        own = with_made(Modification(profile_slope_um=row[f"{gear}.profile_slope_um"]), made_flank, nominal)
        keys = "profile_slope_um", "pitch_deviations_um", "topography", "waves"
        flanks[f"{gear}.coast_modification"] = {key: getattr(own, key) for key in keys}
    axes = {"centre_distance_um": row["centre_distance_um"]}
    other = change_case(case, misalignment=axes, online={"pitches": 21}, tolerances={"samples": 8}, **flanks)
    swept = pmor.train(other).sweep([-50.0, -100.0])
    assert_allclose(row["ste_peak_to_peak_um_100_Nm"], np.ptp(swept.ste_um[1]), rtol=SOLVED)
    assert_allclose(row["k_h_beta_50_Nm"], swept.k_h_beta[0], rtol=SOLVED)


def test_draws_of_an_error_do_not_depend_on_the_others_and_have_their_size():
    wide = small(mesh=WIDE, tolerances={"helix_slope_um": 5.0, "in_plane_um": 3.0, "samples": 2000})
    slopes = np.array([assembly.pinion.helix_slope_um for _, assembly in drawn(wide)])
    assert_allclose([slopes.mean(), slopes.std()], [0.0, 5.0], atol=0.3)
    more = change_case(wide, tolerances={"pitch_deviations_um": 2.0, "in_plane_um": 9.0})
    (errors, _), *_ = drawn(more)
    assert errors["pinion.helix_slope_um"] == slopes[0]
    other = change_case(wide, tolerances={"seed": 1})
    assert next(drawn(other))[0]["pinion.helix_slope_um"] != slopes[0]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"tolerances": {"samples": 8}}, "scatters nothing"),
        ({"mesh": PLANE, "tolerances": {"helix_slope_um": 5.0}}, "helix_slope_um: varies over the width"),
        ({"mesh": PLANE, "tolerances": {"flank_tolerance_class": 6}}, "flank_tolerance_class: varies over the width"),
        ({"tolerances": ALL | {"waves_per_pitch": [2.0]}}, "waves_per_pitch: is the form of gears made to a class"),
        ({"tolerances": {"flank_tolerance_class": 6, "waves_per_pitch": [40.0]}}, "angles_per_pitch to 81 at least"),
        ({"contact": {"scheme": "direct"}, "tolerances": ALL}, r"\[tolerances\]: a run with tolerances takes line"),
    ],
)
def test_tolerances_that_say_nothing_or_find_no_place_are_refused(changes, words):
    plain = "\n".join(line for line in ROWS["spur"].split("[tolerances]")[0].splitlines())
    with pytest.raises(pmor.PmorError, match=words):
        change_case(parse_case(plain, "small", "small"), **changes)


def test_pairs_of_a_gearbox_are_drawn_on_their_shafts_under_each_load(tmp_path):
    (tmp_path / "small.toml").write_text(f"{SMALL_CASE}[tolerances]\nhelix_slope_um = 8.0\nsamples = 8\n")
    path = tmp_path / "box.toml"
    path.write_text(SMALL)
    found = run(load(path))
    (mesh,), name = found.loads[0].meshes, found.loads[0].meshes[0].meshing.key
    tolerances = found.data["loads"][0]["meshes"][0]["tolerances"]["torques"][0]
    assert tolerances["k_h_beta"]["as_filed"] == found.data["loads"][0]["meshes"][0]["k_h_beta"]
    pair = on_hubs(found.pairs[name], mesh.hubs)
    _, assembly = list(drawn(pair.basis.case))[4]
    conditions = conditions_of_assembly(assembly, [1e-3 * mesh.torque])
    alone = sampled_figures(pair, sweep_reduced_pair(pair, mesh.sweep.phi_rad, conditions, recorded=True))
    for key, values in alone.items():
        assert_allclose(mesh.samples.figures[key][4], values, rtol=SOLVED)
    assert np.ptp(mesh.samples.figures["k_h_beta"]) > 0.1
