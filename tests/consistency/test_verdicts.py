"""What a verdict promises, its file keeps: the changes written into the file of a machine and solved anew."""

import numpy as np
import pytest

import pmor
from pmor.pair.model import gear_pair
from pmor.work.advice import higher_teeth
from tests.support.random_machines import figure_of, random_machine, solved, written_into

# Of what is promised (the issue asks for it); what is written is solved as it was tried.
KEPT, ROUND_OFF = 0.8, 1e-6
PAIR = {
    "load": {"torque_Nm": 60.0}, "pair": {"module_mm": 2.5, "face_width_mm": 16.0},
    "pinion": {"teeth": 24, "bore_radius_mm": 15.0}, "wheel": {"teeth": 31, "bore_radius_mm": 20.0},
    "mesh": {"profile_elements": 4, "width_elements": 2, "error_bar": False}, "results": {"root_stress": False},
    "online": {"angles_per_pitch": 24, "torques_Nm": [20.0, 60.0]},
}  # fmt: skip


def kept(machine):
    """Advice of a machine, and the share of what it promises that the machine with it keeps; None without advice."""
    before = solved(machine)
    advice = before["verdict"]["advice"]
    if advice is None:
        return None, None
    gained = figure_of(before, advice) - figure_of(solved(written_into(machine, advice["changes"])), advice)
    return advice, gained / (advice["before"] - advice["after"])


def test_relief_that_is_told_takes_the_transmission_error_of_a_pair_to_what_is_told():
    advice, share = kept(pmor.change(pmor.make(**PAIR), online={"torques_Nm": [60.0]}))
    assert advice["figure"] == "ste_peak_to_peak_um"
    amount, start = advice["changes"][0]["values"].values()
    assert advice["what"] == f"Tip relief of {amount:g} µm from {start:g} % of the path on both gears"
    assert advice["after"] < 0.4 * advice["before"]
    assert share == pytest.approx(1.0, abs=ROUND_OFF)


def test_relief_of_a_file_with_several_loads_lowers_the_largest_error_under_them_and_tells_each():
    case = pmor.make(**PAIR)
    before = solved(case)
    advice = before["verdict"]["advice"]
    after = solved(written_into(case, advice["changes"]))
    light, heavy = (row["ste_peak_to_peak_um"] for row in after["torques"])
    filed = before["torques"][0]["ste_peak_to_peak_um"]
    assert heavy == pytest.approx(advice["after"], rel=ROUND_OFF)
    assert max(light, heavy) < 0.5 * before["ste_peak_to_peak_um"]
    assert f"under 20 N m from {filed:.3g} to {light:.3g} µm" in " ".join(advice["beside"])


def test_higher_teeth_have_the_contact_ratio_that_is_told():
    stub = {gear: PAIR[gear] | {"addendum": 0.7} for gear in ("pinion", "wheel")}
    case = pmor.make(**PAIR | stub)
    advice = higher_teeth(case)
    changed = written_into(case, advice.data["changes"])
    assert gear_pair(changed).contact_ratio == pytest.approx(advice.after, rel=ROUND_OFF)
    assert advice.after > advice.before == pytest.approx(gear_pair(case).contact_ratio, rel=ROUND_OFF)


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "count"), [("pair", 6), ("set", 3), ("gearbox", 3)])
def test_random_machines_keep_what_is_promised(kind, count):
    shares = [kept(random_machine(np.random.default_rng([42, n, len(kind)]), kind))[1] for n in range(count)]
    assert all(share is None or share > KEPT for share in shares)
    assert any(share is not None for share in shares)
