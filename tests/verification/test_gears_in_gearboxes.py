"""Gears of gearboxes: with several meshes one body each; rings; holes; error bars as pairs have them."""


import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor
from pmor.machine.loader import load
from pmor.machine.run import run
from tests.support.gear_trains import BEND, BORE, DRIVE, IDLER, TEETH, box, places
from tests.support.small_sets import NO_STRESS, SMALL_SET, written_set

# Solutions by Newton's method, to its tolerance.
SOLVED = 1e-8
# A tip edge carries off the path of contact, where a turn of both gears changes the gap: and another gear is held here
# and there. Flanks whose edges stay clear have no such place.
RELIEF = "{ tip_relief_um = 40.0, tip_relief_start_percent = 70.0 }"
CLEAR = (f"modification = {RELIEF}", f"coast_modification = {RELIEF}")


@pytest.mark.parametrize("helix", [0.0, pytest.param(15.0, marks=pytest.mark.slow)])
def test_an_idler_is_one_body_and_on_rigid_supports_the_train_that_a_set_file_describes(tmp_path, helix):
    file = box(tmp_path, IDLER, DRIVE, (helix, -helix))
    text = file.read_text().replace("bore_radius_mm = 12.0 }", f"bore_radius_mm = 12.0, {', '.join(CLEAR)} }}")
    file.write_text(text.replace("bore_radius_mm = 12.0\n", "\n".join(["bore_radius_mm = 12.0", *CLEAR, ""])))
    result = run(load(file))
    axes = places(IDLER, helix, BEND)
    gears = "".join(
        f'[[gears]]\nname = "{name}"\nat_mm = [{-axes[name][1]}, {axes[name][0]}]\n'
        + {"one": "torque_Nm = 60.0\n", "two": "", "three": 'torque_Nm = "balance"\n'}[name]
        for name in TEETH
    )
    rest = "\n".join(["bore_radius_mm = 12.0", *CLEAR, ""])
    members = "".join(f"[{name}]\nteeth = {count}\n{rest}" for name, count in TEETH.items())
    of_set = tmp_path / "set.toml"
    of_set.write_text(
        f"[pair]\nmodule_mm = 2.5\nface_width_mm = 16.0\nhelix_angle_deg = {helix}\n[mesh]\nprofile_elements = 3\n"
        f'width_elements = 2\nelement = "hex8i"\nwidth = "whole"\n[sweep]\nangles_per_pitch = 6\n{gears}{members}'
        '[[meshes]]\ngears = ["one", "two"]\n[[meshes]]\ngears = ["two", "three"]\n'
    )
    found = pmor.run(of_set)
    solved = result.loads[0]
    # Rotations of both meshes add up along the lines of action: the idler's base circle is the same in both.
    total = sum(rigid.sweep.ste_um[0] for rigid in solved.rigid)
    assert_allclose(total, found.ste_um[0], rtol=SOLVED)
    stress = {gear["name"]: gear["max_principal_MPa"] for gear in found.data["root_stress"]}
    (first, idler), (again, last) = (rigid.root_stress for rigid in solved.rigid)
    assert idler == again
    assert_allclose([first, idler, last], list(stress.values()), rtol=SOLVED)
    assert not result.failures
    for entry, rigid in zip(result.data["loads"][0]["meshes"], solved.rigid, strict=True):
        assert entry["ste_mean_um"] > 2.0 * rigid.sweep.ste_um.mean()
        assert entry["force_N"] == pytest.approx(60e3 / rigid_base_radius(result), rel=1e-6)


def rigid_base_radius(result):
    return result.file.model.pairs["one-two"].pinion.base_radius


PAIR = (("one", "four"),)
HELD = (("one", 60.0), ("four", '"balance"'))
RING = "internal = true, addendum = 0.8, root_fillet_mm = 0.5, rim_thickness_mm = 8.0"
HOLED = BORE + ", blank = { rim_thickness_mm = 6.0, web_thickness_mm = 8.0, hub_radius_mm = 18.0, "
HOLED += "holes = { count = 4, radius_mm = 3.0, on_radius_mm = 24.0 } }"
# Sections are not at the pitch point, where the parts of the transmission error are told; and bodies of gears stand by.
TOLD = 0.03


@pytest.mark.parametrize("body", [RING, pytest.param(HOLED, marks=pytest.mark.slow)], ids=["a ring", "holes"])
def test_rings_and_gears_with_holes_stand_on_shafts_as_other_gears_do(tmp_path, monkeypatch, body):
    """What bearings and shafts add to the transmission error follows from the force: the rest is as on rigid ones."""
    monkeypatch.setitem(TEETH, "four", 58 if body is RING else 32)
    result = run(load(box(tmp_path, PAIR, HELD, (10.0,), body=body)))
    assert not result.failures
    (entry,), (held,) = result.data["loads"][0]["meshes"], result.data["loads"][0]["held_torques_Nm"]
    ratio = TEETH["four"] / 19.0
    assert held["torque_Nm"] == pytest.approx((-1.0 if body is RING else 1.0) * 60.0 * ratio, rel=1e-6)
    assert entry["ste_mean_um"] > 1.5 * entry["rigid_ste_mean_um"]
    assert entry["ste_of_teeth_um"] == pytest.approx(entry["rigid_ste_mean_um"], rel=TOLD)
    assert entry["pitches"] == (1 if body is RING else 8)


@pytest.mark.slow
def test_error_bars_of_a_mesh_are_those_of_its_pair_and_of_meshes_that_share_gears_too(tmp_path):
    asked = ", error_bar = true"
    path = box(tmp_path, IDLER[:1], (("one", 60.0), ("two", '"balance"')), mesh=asked)
    path.write_text(path.read_text().replace("profile_elements = 3", "profile_elements = 8"))
    file = load(path)
    (entry,) = run(file).data["loads"][0]["meshes"]
    case = file.cases["one-two"]
    alone = pmor.train(case).sweep([60.0], angles=case.online.angles_per_pitch)
    assert entry["rigid_ste_mesh_error_percent"] == pytest.approx(alone.mesh_error_percent[0], rel=1e-6)
    assert 0.0 < entry["ste_mesh_error_percent"] < entry["rigid_ste_mesh_error_percent"]


BACK = """[[loads]]
name = "back"
torques = [{ shaft = "one", at_mm = 0.0, torque_Nm = -60.0 }, { shaft = "two", at_mm = 0.0, torque_Nm = "balance" }]
"""


def loaded_both_ways(tmp_path, more=""):
    path = box(tmp_path, IDLER[:1], (("one", 60.0), ("two", '"balance"')), (10.0,))
    path.write_text(path.read_text().replace("[[loads]]", f"{more}[[loads]]", 1) + BACK)
    return path


@pytest.mark.slow
def test_the_image_in_axes_that_stay_is_the_pair_seen_from_its_other_end(tmp_path, monkeypatch):
    path = loaded_both_ways(tmp_path)
    seen = run(load(path)).data["loads"][1]
    monkeypatch.setattr("pmor.machine.model.alike_from_both_ends", lambda case: False)
    image = run(load(path)).data["loads"][1]
    assert (seen["meshes"][0].pop("flank"), image["meshes"][0].pop("flank")) == ("drive", "coast")
    for one, other in zip(seen["bearings"], image["bearings"], strict=True):
        assert_allclose(one["force_N"], other["force_N"], atol=SOLVED * 1e4)
        assert_allclose(one["displacement_um"], other["displacement_um"], atol=SOLVED * 1e2)
    (one,), (other,) = seen["meshes"], image["meshes"]
    for key in ("ste_mean_um", "ste_peak_to_peak_um", "f_beta_um", "k_h_beta", "centre_distance_um", "out_of_plane_um"):
        assert one[key] == pytest.approx(other[key], rel=1e-6), key
    assert_allclose(one["root_stress_max_MPa"], other["root_stress_max_MPa"], rtol=1e-6)


def test_a_load_that_turns_a_pair_the_other_way_is_on_its_coast_flanks(tmp_path):
    path = loaded_both_ways(tmp_path, "[meshes.pinion.coast_modification]\nhelix_slope_um = 20.0\n")
    result = run(load(path))
    drive, back = (loaded.rigid[0].sweep.ste_um[loaded.rigid[0].row] for loaded in result.loads)
    alone = pmor.train(result.file.cases["one-two"])
    assert_allclose(drive, alone.sweep([60.0], angles=6).ste_um[0], rtol=SOLVED)
    assert_allclose(back, alone.sweep([-60.0], angles=6).ste_um[0], rtol=SOLVED)
    assert np.ptp(back) > 1.3 * np.ptp(drive)


@pytest.mark.slow
def test_a_set_has_an_error_bar_of_the_size_of_those_of_its_pairs(tmp_path):
    text = SMALL_SET.replace("profile_elements = 3", "profile_elements = 8\nerror_bar = true") + NO_STRESS
    found = pmor.run(written_set(tmp_path, text))
    bar = found.data["ste_mesh_error_percent"]
    case = found.file.cases["sun-planet"]
    alone = pmor.train(case).sweep([case.torque_Nm], angles=6).mesh_error_percent[0]
    assert 0.3 * alone < bar < 3.0 * alone
