"""A set or a gearbox that is trained once is swept as a pair is: as its file under other loads, and no gear again."""

import tomllib

import numpy as np
import pytest

import pmor
from pmor_offline import gears
from tests.support.gearboxes import INLINE
from tests.support.small_sets import NO_STRESS, SMALL_CHAIN

RELIEF = {"modification": {"tip_relief_um": 10.0, "tip_relief_start_percent": 60.0}}
# Newton's method ends so close, from whichever start.
SOLVED = 1e-8
MACHINES = {
    "chain": (SMALL_CHAIN + NO_STRESS, {"input": RELIEF}),
    "box": (INLINE, {"meshes": {"mesh": {"pinion": RELIEF}}}),
}


@pytest.fixture(scope="module", params=["chain", pytest.param("box", marks=pytest.mark.slow)])
def machine(request):
    """A machine, its model, and a change of its flanks."""
    text, relief = MACHINES[request.param]
    file = pmor.make(request.param, **tomllib.loads(text))
    return file, pmor.train(file), relief


def test_a_sweep_is_the_file_under_other_torques_and_solves_no_gear(machine, monkeypatch):
    file, model, _ = machine
    with monkeypatch.context() as patched:
        patched.setattr(gears, "solved_gear", None)
        half, both = model.sweep(50.0), model.sweep([50.0, 80.0], angles=6)
    other = model.sweep(-50.0)
    if "gears" in tomllib.loads(file.text):
        asked = pmor.change(file, gears={"input": {"torque_Nm": 50.0}})
        back = pmor.change(file, gears={"input": {"torque_Nm": -50.0}})
    else:
        asked, back = (pmor.change(file, loads=[{"name": f"{torque:g} N m", "torques": [
            {"shaft": "input", "at_mm": 0.0, "torque_Nm": torque},
            {"shaft": "output", "at_mm": 80.0, "torque_Nm": "balance"}]}]) for torque in (50.0, -50.0))  # fmt: skip
    for found, same in ((half, asked), (other, back)):
        np.testing.assert_allclose(found.columns()["ste_um"], pmor.run(same).columns()["ste_um"], rtol=SOLVED)
    assert len(both.columns()["ste_um"]) == 2 * 6
    assert len(both.figures()["ste_mean_um"]) == 2
    assert len(both.plot().lines) == 2
    assert both._repr_html_().count("<tr>") == 1 + 2


def test_variants_by_names_are_told_apart_in_tables_and_pictures(machine):
    _, model, relief = machine
    steps = []
    found = model.sweep_conditions({"plain": {}, "relief": relief}, 50.0, 6, progress=steps.append)
    columns = found.columns()
    assert list(columns["variant"]) == ["plain", "relief"]
    key = next(key for key in columns if key.endswith("tip_relief_um"))
    assert columns[key] == [None, 10.0]
    assert columns["ste_peak_to_peak_um"][1] == pytest.approx(found.results[1].figures()["ste_peak_to_peak_um"][0])
    assert [line.get_label().split(", 50 N m")[0].split(", ")[-1] for line in found.plot().lines] == ["plain", "relief"]
    assert ">relief<" in found._repr_html_()
    assert (len(steps), found.failures) == (2, ())


def test_what_is_no_torque_angle_or_change_is_refused_by_name(machine):
    file, model, _ = machine
    for torques, words in (([1.0, -1.0], "one sign"), ("x", 'torques_Nm = "x"'), (0.0, "torques_Nm = 0")):
        with pytest.raises(pmor.CaseError, match=rf"{file.name}: .*{words}"):
            model.sweep(torques)
    with pytest.raises(pmor.CaseError, match="angles"):
        model.sweep(50.0, [0.1, 0.2])
    with pytest.raises(pmor.CaseError, match=r"variant wrong: .*\[snu\]"):
        model.sweep_conditions({"wrong": {"snu": {}}})
    with pytest.raises(pmor.CaseError, match="by names"):
        model.sweep_conditions([{}])
    with pytest.raises(pmor.CaseError, match="of pairs"):
        pmor.train(file, file="basis.h5")
