"""Conditions that a case lists are swept: in one call what each gives alone, in every file, named where they fail."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import pmor
from pmor.app.cli import main
from pmor.case import parse_case
from pmor.report.screen import result_text
from pmor.report.summary import summary
from pmor.storage.basis_file import read_basis
from pmor_online.conditions import sweep_assemblies, sweep_listed
from pmor_online.model import reduced_pair
from pmor_online.run import OnlineResult
from tests.support.line_pairs import sections_on_columns
from tests.support.small_case import case_text
from tests.support.stored_files import rows_of, summary_of

LISTED = """
[pinion.modification]
tip_relief_um = 10.0
tip_relief_start_roll_deg = 25.0

[[condition]]
name = "more relief"
[condition.pinion]
tip_relief_um = 20.0

[[condition]]
name = "tilted"
torque_Nm = 75.0
in_plane_um = 20.0
"""
BUILT = [
    pmor.Assembly(pinion=pmor.Modification(tip_relief_um=20.0, tip_relief_start_roll_deg=25.0)),
    pmor.Assembly(misalignment=pmor.Misalignment(in_plane_um=20.0)),
    pmor.Assembly(wheel=pmor.Modification(helix_slope_um=7.0)),
]


def text(**changes):
    return case_text(
        mesh={"profile_elements": 5, "width_elements": 2, "width": "whole"}, contact={"scheme": "line"},
        reduction={"shapes": "line_loads"}, online={"angles_per_pitch": 8, "torques_Nm": [50.0, 100.0]}, **changes,
    )  # fmt: skip


@pytest.fixture(scope="module")
def model():
    return pmor.train(parse_case(text(), "small", "small"))


@pytest.fixture(scope="module")
def full_half(model):
    """Full FE of half the width, for both halves."""
    return pmor.full_model(pmor.change_case(model.case, width="half"))


@pytest.fixture(scope="module")
def half(full_half):
    return pmor.train(full_half.case, full_half)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A run of a case with conditions, by the command."""
    folder = tmp_path_factory.mktemp("conditions")
    (folder / "case.toml").write_text(text() + LISTED)
    assert main(["run", str(folder / "case.toml"), "--out", str(folder / "out")]) == 0
    return folder / "out"


def test_many_conditions_in_one_call_are_what_each_is_alone(model):
    many = model.sweep_conditions(BUILT, angles=8)
    assert many.ste_um.shape == (3, 2, 8)
    for one, found in zip(BUILT, many.results, strict=True):
        alone = model.sweep(misalignment=one.misalignment, pinion=one.pinion, wheel=one.wheel, angles=8)
        assert_array_equal(found.ste_um, alone.ste_um)
        assert_array_equal(found.pair_share.sum(axis=2), alone.pair_share.sum(axis=2))
        assert_array_equal(found.unloaded_um, alone.unloaded_um)
    assert_array_equal(many.peak_to_peak_um, np.ptp(many.ste_um, axis=2))
    assert np.ptp(many.mean_um[:, 0]) > 1.0, "the conditions differ"
    assert "3 assemblies" in repr(many)


def test_the_work_of_many_conditions_is_in_proportion_to_them(half):
    """Counted in calls: rules that walk all the others for each condition took 16 s for 4,000 of them."""

    def calls(count):
        amounts = count + np.linspace(0.1, 0.9, count)  # others in each call: nothing of an earlier one is known
        built = [pmor.Assembly(pinion=pmor.Modification(profile_crowning_um=float(a))) for a in amounts]
        made = []
        sys.setprofile(lambda frame, event, arg: made.append(frame.f_code.co_filename) if event == "call" else None)
        try:
            half.sweep_conditions(built, [50.0], angles=1)
        finally:
            sys.setprofile(None)
        return sum("pmor" in file for file in made)  # others' are the garbage collector's too

    calls(2)  # what is made once: annotations, sections that are placed
    few, more, many = map(calls, (8, 16, 32))
    # Blocks come in whole numbers: measured 0.0 %, and 13 % where each flank asked how wide the mesh is.
    assert_allclose(many - more, 2 * (more - few), rtol=0.01)


def test_conditions_are_taken_in_portions_that_memory_holds(model, monkeypatch):
    phi, done = np.linspace(0.0, 0.2, 6), []
    torques = [(50.0,), (60.0, 70.0), (80.0,)]
    whole = sweep_assemblies(model.reduced, phi, BUILT, torques, progress=done.append)
    assert sum(done) == len(phi) * len(BUILT)
    monkeypatch.setattr("pmor_online.conditions.POSITIONS_AT_A_TIME", 1)
    for sweep, again, there in zip(whole, sweep_assemblies(model.reduced, phi, BUILT, torques), torques, strict=True):
        assert_array_equal(sweep.ste_um, again.ste_um)
        assert_array_equal(sweep.torque_Nm, there)


@pytest.mark.slow
def test_each_condition_is_swept_at_the_torques_of_the_case_and_at_its_own(finished):
    rows = rows_of(finished / "conditions.csv")
    assert [(row["condition"], float(row["torque_Nm"])) for row in rows] == [
        ("more relief", 50.0), ("more relief", 100.0), ("tilted", 50.0), ("tilted", 75.0), ("tilted", 100.0),
    ]  # fmt: skip
    assert [float(row["in_plane_um"]) for row in rows] == [0.0, 0.0, 20.0, 20.0, 20.0]
    listed = summary_of(finished)["conditions"]
    for row, same in zip(rows, listed, strict=True):
        assert {key: row[key] for key in ("condition",)} == {"condition": same["condition"]}
        assert float(row["ste_mean_um"]) == same["ste_mean_um"]
    assert len(rows_of(finished / "ste.csv")) == 2 * 8, "the case's own sweep alone"


def test_a_page_and_a_picture_show_the_conditions(finished):
    page = (finished / "report.html").read_text()
    assert ">Conditions<" in page
    assert "pinion tip_relief_um = 20.0" in page
    assert ">Condition</text>" in (finished / "conditions.svg").read_text()


def test_a_saved_basis_sweeps_the_conditions_of_another_case_file(finished, tmp_path):
    other = tmp_path / "other.toml"
    quiet = {"plots": False, "report": False}
    other.write_text(text(output=quiet) + LISTED.replace('"tilted"', '"tilted more"').replace("= 20.0\n", "= 30.0\n"))
    assert main(["online", str(finished / "basis.h5"), "-o", str(tmp_path / "out"), "--case", str(other)]) == 0
    rows = rows_of(tmp_path / "out" / "conditions.csv")
    assert {row["condition"] for row in rows} == {"more relief", "tilted more"}


def test_a_condition_that_fails_is_named(finished):
    case = parse_case(text() + LISTED, "small", "small")
    reduced = reduced_pair(replace(read_basis(finished / "basis.h5"), case=case))
    conditions = sweep_listed(reduced)
    sweep = conditions[1].sweep
    ste, converged = sweep.ste_um.copy(), sweep.converged.copy()
    ste[1, 3], converged[1, 3] = np.nan, False
    failed = replace(conditions[1], sweep=replace(sweep, ste_um=ste, converged=converged))
    result = OnlineResult(reduced, conditions[0].sweep.at_torques(slice(0, 2)), None, 0.1, conditions=(failed,))
    (line,) = result.failures
    assert line.startswith("reduced model, condition tilted: phi = ")
    assert line.endswith("torque = 75 N m did not converge")
    assert f"  ! {line}" in result_text(result).splitlines()
    assert summary(result)["conditions"][1]["n_positions_failed"] == 1


def test_a_plan_counts_the_solves_of_conditions():
    lines = pmor.plan(parse_case(text() + LISTED, "c", "c")).splitlines()
    line = next(line for line in lines if "conditions, 8" in line)
    assert line.split()[:3] == ["online,", "conditions", "40"]


def test_conditions_in_python_are_refused_by_their_number_with_the_remedy(model):
    off = pmor.Assembly(pinion=pmor.Modification(tip_relief_um=20.0, tip_relief_start_roll_deg=60.0))
    with pytest.raises(pmor.CaseError, match=r"assemblies\[1\].*tip_relief_start_roll_deg = 60: must be below the tip"):
        model.sweep_conditions([BUILT[0], off])
    with pytest.raises(pmor.CaseError, match="give at least one"):
        model.sweep_conditions([])
    with pytest.raises(pmor.CaseError, match=r"says nothing of its gear: write Assembly\(pinion=m\)"):
        model.sweep_conditions(BUILT[0].pinion)
    axes = BUILT[1].misalignment
    assert model.sweep_conditions(axes, angles=2).assemblies == (BUILT[1],), "axes say all of an assembly"


def test_a_model_of_half_the_width_answers_what_differs_between_the_halves(model, full_half, half):
    """By the whole width, which is solved once, when it is first asked for."""
    with sections_on_columns():  # there are more at the ends of the whole
        even = replace(model).sweep_conditions(BUILT[:1])
    assert_allclose(half.sweep_conditions(BUILT[:1]).ste_um, even.ste_um, rtol=1e-8)
    assert "whole" not in vars(half), "symmetric flanks need no more"
    for uneven in BUILT[1:]:
        asked = {"misalignment": uneven.misalignment, "wheel": uneven.wheel, "angles": 4}
        swept, expected = half.sweep(75.0, **asked), model.sweep(75.0, **asked)
        assert_allclose(swept.ste_um, expected.ste_um, rtol=1e-12)
        assert_allclose(full_half.sweep(75.0, **asked).ste_um, expected.ste_um, rtol=1e-8)
        del asked["angles"]
        found, same = (one.root_stress([75.0], 4, **asked).max_principal_MPa for one in (half, model))
        assert_allclose(found, same, rtol=1e-9)
    assert_allclose(half.sweep_conditions(BUILT).ste_um, model.sweep_conditions(BUILT).ste_um, rtol=1e-12)
    assert half.whole is half.whole


def test_trained_shapes_sweep_conditions_within_their_training():
    listed = text().replace("line_loads", "flank_lines").replace('"line"', '"direct"')
    listed = listed.replace("[offline]", "[offline]\nin_plane_um = [-20.0, 20.0]")
    case = parse_case(listed, "small", "small")
    trained = pmor.train(case)
    many = trained.sweep_conditions(BUILT[:2], torques_Nm=[100.0])
    alone = trained.sweep(torques_Nm=[100.0], misalignment=BUILT[1].misalignment)
    assert_array_equal(many.ste_um[1], alone.ste_um)
    with pytest.raises(pmor.CaseError, match="beyond the training"):
        trained.sweep_conditions([pmor.Assembly(misalignment=pmor.Misalignment(in_plane_um=30.0))])
    with pytest.raises(pmor.CaseError, match="flanks that load the width otherwise"):
        trained.sweep_conditions(BUILT)
