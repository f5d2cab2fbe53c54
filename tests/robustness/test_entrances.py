"""One set of checks for loads, axes and flanks: each slip is refused at each entrance that can express it."""

import math
import re
from pathlib import Path

import pytest

import pmor
from pmor.app.cli import main
from pmor.campaigns.relations import case_of
from pmor.case import changed_text

BASE = {
    "teeth": 21, "bore_radius_mm": 20.0, "module_mm": 4.0, "face_width_mm": 20.0, "torque_Nm": 100.0,
    "mesh": {"profile_elements": 4, "width_elements": 2, "width": "whole", "error_bar": False},
    "online": {"angles_per_pitch": 4},
}  # fmt: skip
RELIEF = {"tip_relief_um": 20.0, "tip_relief_start_roll_deg": 25.0}
STARTS = {"key": "tip_relief_start_roll_deg", "range": [22.0, 30.0]}
GEARBOX = Path(__file__).parents[2] / "cases" / "gearbox.rexs"
NAN = math.nan

# Keys of a modification, and words of the refusal.
FLANKS = {
    "a shape that is none": (RELIEF | {"tip_relief_shape": "cubic"}, "unknown choice"),
    "a shape in capitals": (RELIEF | {"tip_relief_shape": "Parabolic"}, "did you mean parabolic"),
    "an amount of metres": ({"profile_crowning_um": 1e6}, "between -1000 and 1000"),
    "an amount that is no number": ({"helix_crowning_um": NAN}, "finite"),
    "an amount as text": ({"helix_crowning_um": "5"}, "must be a number"),
    "a negative length": ({"end_relief_um": 5.0, "end_relief_length_mm": -5.0}, "between 0.001 and 100000"),
    "a length without relief": ({"end_relief_length_mm": -5.0}, "between 0.001 and 100000"),
    "a length over the middle": ({"end_relief_um": 5.0, "end_relief_length_mm": 15.0}, "at most 10 mm"),
    "relief without a start": ({"tip_relief_um": 20.0}, "tip_relief_start_roll_deg"),
    "relief from beyond the tip": (RELIEF | {"tip_relief_start_roll_deg": 60.0}, "below the tip circle"),
    "deviations of other teeth": ({"pitch_deviations_um": [1.0, 2.0]}, "2 numbers for 21 teeth"),
}
# Torques on the pinion, N m. A reversed one alone loads the coast flanks.
REVERSED = -5.0
LOADS = {
    "no load": (0.0, "without load"),
    "a reversed load among others": (REVERSED, "coast flanks"),
    "a reversed load beyond the law of line contact": (-1.1e4, "half-wide, more than half the depth|coast flanks"),
    "a load that is no number": (NAN, "finite"),
    "a load as text": ("125", "must be a number"),
    "a load beyond the teeth": (1e9, "teeth have room for"),
    "a load beyond the law of line contact": (1.1e4, "half-wide, more than half the depth"),
}
# Where a case asks for torques.
TORQUES = [("online", "torques_Nm"), ("compare", "torques_Nm"), ("results", "harris_torques_Nm"),
           ("dynamics", "torques_Nm")]  # fmt: skip
# Deviations of the axes, um.
AXES = {
    "axes off by metres": ({"centre_distance_um": 1e6}, "between -1000 and 1000"),
    "axes that are no number": ({"in_plane_um": NAN}, "finite"),
    "axes as text": ({"out_of_plane_um": "3"}, "must be a number"),
}


@pytest.fixture(scope="module")
def case():
    return pmor.make_case("small", **BASE)


@pytest.fixture
def of_cases(case, tmp_path):
    """Entrances that take keys of a case by section, by name; each raises what it refuses."""

    def file(sections):
        path = tmp_path / "small.toml"
        path.write_text(changed_text(case.text, sections))
        return path

    def command(sections):
        assert main(["run", str(file(sections)), "--out", str(tmp_path / "out")]) == 2
        assert not (tmp_path / "out").exists()
        raise pmor.CaseError("")

    def campaign(sections):
        keys = {f"{name}.{key}": value for name, section in sections.items() for key, value in section.items()}
        return pmor.plan(case_of(case.text, keys, "design 1"))

    return {
        "file": lambda sections: pmor.plan(pmor.load_case(file(sections))),
        "command": command,
        "make_case": lambda sections: pmor.plan(pmor.make_case("small", **(BASE | sections))),
        "change_case": lambda sections: pmor.plan(pmor.change_case(case, **sections)),
        "campaign": campaign,
    }


@pytest.fixture
def of_sweeps(full, model):
    """Entrances that take what `ReducedModel.sweep` takes, by name."""

    def conditions(torques_Nm=None, **parts):
        model.sweep_conditions([pmor.Assembly(), pmor.Assembly(**parts)], torques_Nm, angles=4)

    return {
        "full_model.sweep": lambda **asked: full.sweep(angles=2, **asked),
        "model.sweep": lambda **asked: model.sweep(angles=4, **asked),
        "model.sweep, extrapolating": lambda **asked: model.sweep(angles=4, extrapolate=True, **asked),
        "model.sweep_conditions": conditions,
        "model.root_stress": lambda **asked: model.root_stress(angles=4, **asked),
    }


def refuse(entrances, *arguments, words="", **keywords):
    """Each entrance refuses in one line that has the words."""
    passed = dict[str, str]()
    for name, enter in entrances.items():
        try:
            enter(*arguments, **keywords)
            passed[name] = "let through"
        except pmor.PmorError as error:
            if name != "command" and (re.search(words, str(error)) is None or "\n" in str(error)):
                passed[name] = str(error)
    assert passed == {}


@pytest.mark.parametrize(("keys", "words"), FLANKS.values(), ids=FLANKS)
@pytest.mark.parametrize("gear", ["pinion", "wheel"])
def test_flanks(keys, words, gear, of_cases, of_sweeps):
    refuse(of_cases, {f"{gear}.modification": keys}, words=words)
    refuse(of_sweeps, words=words, **{gear: pmor.Modification(**keys)})


@pytest.mark.parametrize(("torque", "words"), LOADS.values(), ids=LOADS)
def test_loads(torque, words, model, of_cases, of_sweeps, tmp_path):
    if torque != REVERSED:
        refuse(of_cases, {"load": {"torque_Nm": torque}}, words=words)
    for section, key in TORQUES:
        values = torque if isinstance(torque, str) else sorted([100.0, torque])
        refuse(of_cases, {section: {key: values}}, words=words)
    del of_cases["campaign"]  # its keys have one value each
    if torque != REVERSED:
        refuse(of_cases, {"condition": [{"name": "other", "torque_Nm": torque}]}, words=words)
    torques = torque if isinstance(torque, str) else [100.0, torque, 50.0]
    others = {
        "model.harris_map": model.harris_map,
        "model.dynamics": lambda torques_Nm: model.dynamics(torques_Nm=torques_Nm, run_cycles=0),
        "model.design": lambda torques_Nm: model.design(
            variables=[{"key": "tip_relief_um", "range": [0.0, 9.0]}, STARTS], load={"torques_Nm": torques_Nm}
        ),
        "model.export": lambda torques_Nm: model.export(tmp_path / "unit.fmu", "fmu", torque_Nm=torque),
    }
    refuse(of_sweeps | others, torques_Nm=torques, words=words)
    assert list(tmp_path.glob("*.fmu")) == []


@pytest.mark.parametrize(("keys", "words"), AXES.values(), ids=AXES)
def test_axes(keys, words, of_cases, of_sweeps):
    refuse(of_cases, {"misalignment": keys}, words=words)
    refuse(of_sweeps, words=words, misalignment=pmor.Misalignment(**keys))


@pytest.mark.parametrize("name", ["an amount of metres", "a negative length", "a length over the middle",
                                  "relief without a start", "relief from beyond the tip"])  # fmt: skip
def test_ranges_of_a_design(name, model):
    """Its variables are numbers of a modification: those of the slips that are numbers out of place."""
    keys, words = FLANKS[name]
    variables = [{"key": key, "range": sorted([0.5 * value, value])} for key, value in keys.items()]
    refuse({"model.design": lambda: model.design(variables=variables)}, words=words)


def test_amounts_of_a_gearbox(tmp_path):
    crowning = '<attribute id="helix_crowning_amount_datum_face" unit="mm">'
    text = GEARBOX.read_text()
    assert text.count(f"{crowning}0.004") == 1
    (tmp_path / "gears.rexs").write_text(text.replace(f"{crowning}0.004", f"{crowning}4.0"))
    refuse({"import_rexs": lambda: pmor.import_rexs(tmp_path / "gears.rexs")}, words="between -1000 and 1000")
