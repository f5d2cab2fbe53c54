"""Trains of gears on fixed axes go out as REXS and come back as they are."""

import math
from pathlib import Path

import pytest
from numpy.testing import assert_allclose

from pmor.core.errors import CaseError
from pmor.pair.model import gear_pair
from pmor.rexs.files import load_gearbox, load_set
from pmor.rexs.write_set import set_rexs
from pmor.sets.loader import parse_set
from tests.support.rexs_file import RexsFile, numbers_and_words

CASES = Path(__file__).parents[2] / "cases"
DATE = "2026-01-01T00:00:00+00:00"
CHAIN, SPLIT = ((CASES / f"{name}.toml").read_text() for name in ("idler_chain", "power_split"))
# Helical, the first gear loaded clockwise, faces that are not centred, flanks of both sides, further torques.
HELICAL = (
    CHAIN.replace("torque_Nm = 100.0", "torque_Nm = -100.0")
    .replace("[0.0, 92.0]", "[0.0, 94.06]")
    .replace("[88.0, 92.0]", "[89.97, 94.06]")
    .replace("face_width_mm = 20.0", "face_width_mm = 20.0\nhelix_angle_deg = 12.0")
    .replace("[idler]\n", "[idler]\nface_width_mm = 18.0\nface_offset_mm = 1.5\n")
    + "[idler.modification]\nhelix_slope_um = 4.0\ntip_relief_um = 10.0\ntip_relief_start_roll_deg = 27.0\n"
    "[idler.coast_modification]\nhelix_slope_um = -3.0\n[sweep]\ntorques_Nm = [40.0]\n"
)
TWISTED = SPLIT.replace("timing_mrad = 0.05", "timing_mrad = 0.05\ntorsion_Nmm_per_rad = 2e8")
RING = f"""
title = "Into a ring"
[pair]
module_mm = 4.0
face_width_mm = 20.0
helix_angle_deg = -10.0
[[gears]]
name = "sun"
at_mm = [0.0, 0.0]
torque_Nm = 100.0
[[gears]]
name = "idler"
at_mm = [{72.0 / math.cos(math.radians(10.0))!r}, 0.0]
[[gears]]
name = "ring"
at_mm = [0.0, 0.0]
torque_Nm = "balance"
[[meshes]]
gears = ["sun", "idler"]
[[meshes]]
gears = ["idler", "ring"]
[sun]
teeth = 18
bore_radius_mm = 15.0
[idler]
teeth = 18
bore_radius_mm = 15.0
[ring]
teeth = 54
internal = true
addendum = 0.8
root_fillet_mm = 0.6
rim_thickness_mm = 12.0
"""


@pytest.mark.parametrize("text", [CHAIN, HELICAL, TWISTED, RING], ids=["idler", "helical", "split", "ring"])
def test_a_train_goes_out_and_comes_back_as_it_is(tmp_path, text):
    """Each gear once, whatever it meshes with; torques, shafts, who is ahead: the second file is the first."""
    one = parse_set(text, "train", "train")
    first = set_rexs(one, None, DATE)
    path = tmp_path / "train.rexs"
    path.write_bytes(first)
    file = RexsFile(first)
    assert len(file.of_kind("cylindrical_gear") + file.of_kind("ring_gear")) == len(one.plan.bodies)
    two = load_set(path)
    assert not two.changed
    assert all("check the sign" in note for note in two.notes)
    assert numbers_and_words(set_rexs(two, None, DATE)) == numbers_and_words(first)
    assert (two.plan.clockwise, two.torques_Nm) == (one.plan.clockwise, one.torques_Nm)
    assert two.plan.bodies == one.plan.bodies
    for name in ("free", "compliance", "displacement", "load"):
        assert_allclose(getattr(two.plan, name), getattr(one.plan, name), rtol=1e-9, atol=1e-15)
    for case, back in zip(one.cases.values(), two.cases.values(), strict=True):
        assert back.flank == case.flank
        assert back.torque_Nm == pytest.approx(case.torque_Nm)
        ours, theirs = gear_pair(case), gear_pair(back)
        assert (theirs.pinion, theirs.wheel, theirs.centre_distance) == (
            ours.pinion, ours.wheel, pytest.approx(ours.centre_distance)
        )
        for name in ("pinion_modification", "wheel_modification", "other_flanks"):
            assert repr(getattr(back, name)) == repr(getattr(case, name)), name


def test_a_chain_of_gears_is_a_gearbox_where_one_is_asked_for(tmp_path):
    """The idler is one gear of two meshes; shafts as thick as the bores, on rigid bearings."""
    path = tmp_path / "chain.rexs"
    path.write_bytes(set_rexs(parse_set(CHAIN, "chain", "chain"), None, DATE))
    box = load_gearbox(path)
    assert [len(group.gears) for group in box.model.groups] == [3]
    assert [torque.torque_Nm for torque in box.model.sections.loads[0].torques] == [100.0, "balance"]


def test_load_cases_that_are_no_multiples_of_each_other_are_refused(tmp_path):
    text = CHAIN.replace("[[meshes]]", "[sweep]\ntorques_Nm = [40.0]\n[[meshes]]", 1).replace(
        "at_mm = [0.0, 92.0]", "at_mm = [0.0, 92.0]\ntorque_Nm = 10.0"
    )
    file = RexsFile(set_rexs(parse_set(text, "chain", "chain"), None, DATE))
    weak = file.root.find("load_spectrum/load_case")
    file.say(next(one for one in weak if one.get("type") == "external_load"), torque_around_u_axis=30.0)
    with pytest.raises(CaseError, match=r"external_load \d+ \(Torque\): load cases differ by more than a factor"):
        load_set(file.write(tmp_path / "chain.rexs"))
