"""A case that compares models: each has basis, errors and times of its own, and the case's own stays what it is."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor.pair.model
import pmor.work.offline
from pmor import plan
from pmor.app.cli import main
from pmor.body.elastic_gear import with_layer
from pmor.case import basis_key, change_case, model_names, other_models, parse_case, without_models
from pmor.core.errors import CaseError
from pmor.pair.model import mesh_model, model_of_solved
from pmor.penalty.solve import solve_position as solve
from pmor.report.run_page import page_files
from pmor.storage.basis_file import read_basis
from pmor.work.cost import stages
from tests.support.small_case import case_text, case_with, full_fe
from tests.support.stored_files import results_in, summary_of

QUIET = {"plots": False, "report": False}
LINES = {"contact": {"scheme": "line"}, "reduction": {"shapes": "line_loads"}}
TABLES = {"summary.json", "ste.csv", "torques.csv", "stiffness.csv", "harris.csv", "results.h5", "stress.csv"}
NUMBERS = {"basis.h5", "basis_paper.h5", "basis_direct.h5", *TABLES}

# One model has no error bar of its reduction, the others none of their mesh, which this case leaves out.
MAY_LACK = "ste_error_estimate_max_um", "ste_mesh_error_percent"


def text_with(*models, **changes):
    """The small case in line contact, with further models."""
    text = case_text(**{**LINES, **changes})
    return text.replace("[compare]", f"[compare]\nmodels = {json.dumps(models)}")


def with_models(*models, **changes):
    return parse_case(text_with(*models, **changes), "small", "small.toml")


def write_case(folder, *models, **changes):
    path = folder / "tiny.toml"
    path.write_text(text_with(*models, **changes))
    return str(path)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """The folder of a whole run of three models, without pictures."""
    folder = tmp_path_factory.mktemp("models")
    assert main(["run", write_case(folder, "paper", "direct", output=QUIET), "--out", str(folder / "out")]) == 0
    return folder / "out"


@pytest.fixture
def out(finished, tmp_path):
    """A copy of its bases, to run again."""
    (tmp_path / "out").mkdir()
    for name in NUMBERS - TABLES:
        shutil.copy(finished / name, tmp_path / "out")
    return tmp_path / "out"


# --- a run -----------------------------------------------------------------------------------------------------------


def test_a_run_leaves_a_basis_for_each_model(finished):
    assert results_in(finished) == NUMBERS


def test_the_summary_lists_the_models_and_keeps_its_keys_for_the_own_one(finished):
    found = summary_of(finished)
    models = {model["name"]: model for model in found["models"]}
    assert [(m["name"], m["shapes"], m["basis"]) for m in found["models"]] == [
        ("paper", "positions", "basis_paper.h5"), ("direct", "flank_lines", "basis_direct.h5"),
        ("line", "line_loads", "basis.h5"),
    ]  # fmt: skip
    assert found["scheme"] == "line"
    assert {key: value for key, value in models["line"].items() if found.get(key, value) != value} == {}
    for model in models.values():
        assert not any(value is None for key, value in model.items() if key not in MAY_LACK)
        assert model["n_positions_failed"] == 0
        assert 0.0 < model["rom_vs_full_ste_rms_rel"] <= model["rom_vs_full_ste_max_rel"] < 0.3
        assert model["online_ms_per_position"] > 0.0 < model["full_ms_per_position"]
    assert models["line"]["rom_vs_full_ste_max_rel"] < 1e-7 < models["direct"]["rom_vs_full_ste_max_rel"]


def test_each_basis_is_the_one_that_its_model_has_alone(finished, tmp_path):
    """Whoever solves the finite elements: here they are those of line contact, with the layer put back."""
    case = case_with()  # Hermite patches, flank lines
    model = full_fe(case)
    pmor.work.offline.run_offline(case, model, tmp_path / "basis.h5")
    alone, found = read_basis(tmp_path / "basis.h5"), read_basis(finished / "basis_direct.h5")
    assert basis_key(found.case) == basis_key(case)
    assert_allclose(found.training.ste_um, alone.training.ste_um, rtol=1e-9)
    for one, other in zip(found.shapes.gears, alone.shapes.gears, strict=True):
        assert_allclose(one.gram, other.gram, rtol=1e-7, atol=1e-9 * np.abs(other.gram).max())


def test_a_second_run_takes_all_bases_that_are_there(out, tmp_path, monkeypatch, finished):
    monkeypatch.setattr(pmor.work.offline, "run_offline", lambda *_a, **_m: pytest.fail("the bases were there"))
    case = write_case(tmp_path, "direct", "paper", output=QUIET)
    assert main(["compare", case, "--out", str(out)]) == 0
    assert results_in(out) == NUMBERS
    before = {model["name"]: model for model in summary_of(finished)["models"]}
    assert [model["name"] for model in summary_of(out)["models"]] == ["direct", "paper", "line"]
    for model in summary_of(out)["models"]:
        assert model["offline_s"] == before[model["name"]]["offline_s"]
        assert model["ste_mean_um"] == pytest.approx(before[model["name"]]["ste_mean_um"], rel=1e-9)


def fail_facets(monkeypatch, angles):
    """Let full FE of the scheme `paper` fail at the first so many angles that it is solved at."""
    seen = []

    def failing(meshed, *rest):
        solved = solve(meshed, *rest)
        if meshed.scheme.projection != "facet" or len(seen) == angles:
            return solved
        seen.append(solved)
        return replace(solved, equilibria=(None,) * len(solved.equilibria))

    monkeypatch.setattr("pmor_offline.snapshots.solve_position", failing)


@pytest.mark.slow
def test_a_model_that_cannot_be_trained_is_named_and_the_others_have_their_results(
    out, undrawn, tmp_path, monkeypatch, capsys
):
    """In tables, on the page with its pictures, on the screen."""
    (out / "basis_paper.h5").unlink()
    fail_facets(monkeypatch, angles=99)
    case = write_case(tmp_path, "paper", "direct", output={"plots": False})
    assert main(["run", case, "--out", str(out)]) == 3
    text, error = capsys.readouterr()
    assert "  ! paper: no full solve converged, first: phi = " in text
    assert "paper: no full solve converged" in error
    lost, *others = summary_of(out)["models"]
    assert {key for key, value in lost.items() if value is not None} == {"name", "scheme", "shapes"}
    assert [model["n_positions_failed"] for model in others] == [0, 0]
    assert summary_of(out)["n_positions_failed"] == 0
    page = (out / "report.html").read_text()
    for words in ("paper: no full solve converged", "Reduced models beside full FE", "Which model to take", "to repeat",
                  "Static transmission error of all models", "over the time for a position"):  # fmt: skip
        assert words in page
    assert {"models.svg", "error_time.svg"} <= set(page_files(with_models("paper")))


# --- the case --------------------------------------------------------------------------------------------------------


def test_each_name_has_its_shapes_and_the_own_model_is_always_among_them():
    schemes = ("paper", "direct", "facet")
    case = with_models(*schemes)
    assert model_names(case) == (*schemes, "line")
    shapes = {scheme: model.reduction.shapes for scheme, model in other_models(case)}
    assert shapes == dict(zip(schemes, ("positions", *["flank_lines"] * 2), strict=True))
    own = with_models("line", "paper", contact={"scheme": "paper"}, reduction={"shapes": "pod"})
    ((scheme, model),) = other_models(own)
    assert (model_names(own), scheme, model.reduction.shapes) == (("line", "paper"), "line", "line_loads")
    for listed in (without_models(case), with_models("line")):
        assert dict(other_models(listed)) == {}
    assert model_names(without_models(case)) == ()
    assert change_case(without_models(case), scheme="direct", shapes="flank_lines").compare.models is None


def test_models_change_no_basis_of_the_case():
    assert basis_key(with_models("paper")) == basis_key(case_with(**LINES))


@pytest.mark.parametrize(
    ("models", "changes", "words"),
    [
        (["papr"], {}, "models = .*: unknown choice: did you mean paper"),
        (["paper", "paper"], {}, "one of them is there twice"),
        ([], {}, "must not be empty"),
        ([3], {}, "must be text: write one of"),
        (["strip"], {}, r'\[compare\] models = .*strips was removed: write "line", or "direct"'),
        (["paper"], {"offline": {"sampling": "sobol"}}, 'models, "paper": .*interpolated over a grid'),
        (["direct"], {"offline": {"torques_Nm": [40.0]}}, 'models, "direct": .*beyond the largest training torque'),
        (["direct"], {"misalignment": {"centre_distance_um": 9.0}}, 'models, "direct": .*beyond the training'),
    ],
)  # fmt: skip
def test_a_model_that_the_case_does_not_fit_is_refused_by_name(models, changes, words):
    with pytest.raises(CaseError, match=words) as caught:
        with_models(*models, **changes)
    assert "\n" not in str(caught.value)


def test_a_load_beyond_a_model_is_refused_by_name_before_anything_is_solved(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(pmor.pair.model, "elastic_model", lambda *_: pytest.fail("solved"))
    light = {"load": {"torque_Nm": 1e-7}, "online": {"torques_Nm": [1e-7]}}  # on exact flanks it is above round-off
    assert main(["run", write_case(tmp_path, "direct", **light), "--out", str(tmp_path / "out")]) == 2
    assert '[compare] models, "direct": ' in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_the_plan_tells_models_stages_and_what_is_shared():
    case = with_models("paper", "direct")
    text = plan(case)
    for words in ("positions; 8 full solves", "line_loads, the case's own; nothing is trained", "training, paper",
                  "comparison, direct", "paper, direct: the same gears, whatever the contact"):  # fmt: skip
        assert words in text
    assert "finite elements, paper" not in text
    patches = with_models("line", contact={"scheme": "direct"}, reduction={"shapes": "flank_lines"})
    assert "finite elements, line" in plan(patches), "the layer below the flank is not known there"
    names = [stage.name for stage in stages(case)]
    alone = [stage.name for stage in stages(without_models(case))]
    assert [name for name in names if not name.endswith((", paper", ", direct"))] == alone


# --- the gears -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("width_elements", [1, 2])
def test_a_gear_with_its_layer_put_back_is_the_one_without_a_layer(width_elements):
    mesh = {"profile_elements": 5, "width_elements": width_elements}
    lines = case_with(mesh=mesh, **LINES)
    patches = case_with(mesh=mesh)
    solved = full_fe(lines)
    expected = full_fe(patches).pinion
    found = model_of_solved(patches, mesh_model(patches), solved)
    assert found.pinion is found.wheel
    size = np.abs(expected.compliance).max()
    assert_allclose(found.pinion.compliance, expected.compliance, rtol=0.0, atol=1e-13 * size)
    assert np.array_equal(found.pinion.compliance, found.pinion.compliance[::-1].transpose(0, 2, 1))
    assert with_layer(expected) is expected
    assert model_of_solved(lines, mesh_model(lines), found).pinion.layer_columns == solved.pinion.layer_columns
