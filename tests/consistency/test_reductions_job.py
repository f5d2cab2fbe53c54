"""`pmor lab reductions` from end to end on a tiny case, and what must be equal in it."""

import contextlib
import io
import json
from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor.lab.comparison.run
from pmor.app.cli import main
from pmor.case import load_case, parse_case
from pmor.lab.comparison.result import FILES
from pmor.lab.comparison.variants import variants
from pmor.storage.basis_file import read_basis
from pmor.work.offline import run_offline
from pmor.work.states import unseen_states
from pmor_online.errors import estimate_errors
from tests.support.small_case import case_text, fail_where, full_fe
from tests.support.stored_files import results_in

pytestmark = [pytest.mark.jit, pytest.mark.slow, pytest.mark.usefixtures("few_candidates")]

genuine_run = pmor.lab.comparison.run.run
FEW = {"states": 6, "repeats": 2, "most_solves": 32}
FEWEST = {"states": 3, "repeats": 1, "most_solves": 16}


def text_of(solves):
    return case_text(
        mesh={"profile_elements": 6, "width_elements": 2},
        offline={"sampling": "greedy", "out_of_plane_um": [-10.0, 10.0], "solves": solves, "tolerance_percent": 0.3},
        reduction={"distribution_tolerance": 0.01},
    )


TEXT = text_of(24)


@pytest.fixture(scope="module")
def case():
    return parse_case(TEXT, "tiny", "tiny case")


@pytest.fixture(scope="module")
def model(case):
    return full_fe(case)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """What the command left and said, and the comparison that it made."""
    folder, kept, said = tmp_path_factory.mktemp("reductions"), [], io.StringIO()
    (folder / "tiny.toml").write_text(TEXT)

    def comparing(*arguments, **more):
        kept.append(genuine_run(*arguments, **FEW, **more))
        return kept[0]

    with pytest.MonkeyPatch.context() as patch, contextlib.redirect_stdout(said):
        patch.setattr(pmor.lab.comparison.run, "run", comparing)
        patch.setattr("pmor.report.page.picture_bytes", lambda figure, picture_format: b"")
        assert main(["lab", "reductions", str(folder / "tiny.toml"), "--out", str(folder / "out")]) == 0
    return folder / "out", said.getvalue(), kept[0]


@pytest.fixture(scope="module")
def compared(finished):
    return finished[2]


@pytest.fixture
def case_path(tmp_path, monkeypatch):
    """A case with the fewest solves, of which no picture is drawn."""
    monkeypatch.setattr(pmor.lab.comparison.run, "run", partial(genuine_run, **FEWEST))
    path = tmp_path / "tiny.toml"
    path.write_text(text_of(16))
    return path


def test_the_command_leaves_numbers_page_and_pictures(finished):
    out, text, _ = finished
    pictures = {"error_run_time.png", "decay.png", "estimate.png"}
    assert results_in(out) == {"reductions.json", "reductions.md", "reductions.html", *pictures} == set(FILES)
    found = json.loads((out / "reductions.json").read_text())
    assert text.count("\n  flank_lines ") == sum(entry["shapes"] == "flank_lines" for entry in found["entries"])
    assert (out / "reductions.html").read_text().count("data:image/png;base64,") == len(pictures)
    for entry in found["entries"]:
        assert 0.0 < entry["online_without_ms"] < 100.0
        assert entry["basis_mib"] > entry["basis_without_mib"] > 0.0
        assert len(entry["ste_error_um"]) == FEW["states"]
        assert entry["solves"] <= 24


def test_the_json_holds_what_was_measured(finished, compared):
    found = json.loads((finished[0] / "reductions.json").read_text())
    assert compared.failures == ()
    assert found["seconds"] == compared.seconds
    for read, entry in zip(found["entries"], compared.entries, strict=True):
        assert read == entry
        full = np.array([state["ste_um"] for state in found["states"]])
        percent = 100.0 * np.abs(np.array(read["ste_error_um"]) / full)
        assert_allclose(read["ste_error_max_percent"], percent.max())
        assert_allclose(read["ste_error_rms_percent"], np.sqrt(np.mean(percent**2)))
        where = found["states"][int(np.argmax(percent))]
        assert read["worst_ste_at"] == {name: where[name] for name in read["worst_ste_at"]}


def test_static_modes_have_the_least_error(compared):
    *trained, static = compared.entries
    assert (static["shapes"], static["solves"]) == ("static_modes", 0)
    # They are complete: the error is that of the sweep's own tolerance.
    assert static["ste_error_max_percent"] < 1e-4
    assert static["ste_error_max_percent"] < min(entry["ste_error_max_percent"] for entry in trained)


def test_line_contact_has_no_shapes_to_compare(tmp_path, capsys):
    path = tmp_path / "line.toml"
    path.write_text(case_text(contact={"scheme": "line"}))
    assert main(["lab", "reductions", str(path), "--out", str(tmp_path / "out")]) == 2
    assert "no trained shapes to compare" in capsys.readouterr().err


def test_counted_solves_are_those_of_the_offline_stage(case, model, compared, tmp_path):
    by_label = {entry["label"]: entry for entry in compared.entries}
    greedy = compared.entries[0]["solves"]
    assert 4 < greedy < len(compared.curves.estimate) + 4  # it ended by its tolerance, and was followed further
    checked = {f"flank_lines, greedy {greedy}", "flank_lines, sobol 24", "pod, linear, grid 4 x 3 x 2", "static_modes"}
    for i, variant in enumerate(v for v in variants(case, greedy) if v.label in checked):
        checked.remove(variant.label)
        path = tmp_path / f"{i}.h5"
        done = run_offline(variant.case, model, path)
        basis = read_basis(path)
        assert done.solved == len(basis.training.phi)
        assert by_label[variant.label]["solves"] == basis.training.converged.size
        ste, _ = estimate_errors(basis, compared.truth.states.phi, compared.truth.states.conditions)
        assert_allclose(compared.truth.ste_um - ste, by_label[variant.label]["ste_error_um"], atol=1e-9)
    assert not checked


def test_states_that_do_not_converge_are_named_and_end_with_exit_code_3(case_path, capsys, monkeypatch, model, undrawn):
    few = load_case(case_path)
    states = unseen_states(few.offline, model.mesh.meshed.pair, FEWEST["states"])
    out, bad = case_path.parent / "out", float(states.phi[2])
    fail_where(lambda phi, torque: phi == bad, monkeypatch)
    assert main(["lab", "reductions", str(case_path), "--out", str(out)]) == 3
    captured = capsys.readouterr()
    assert "states did not converge, first: full FE at " in captured.err
    found = json.loads((out / "reductions.json").read_text())
    assert found["states"][2]["ste_um"] is None
    assert all(entry["ste_error_um"][2] is None for entry in found["entries"])
    assert any(failure.startswith("full FE at ") for failure in found["failures"])
    assert '<p class="warning">' in (out / "reductions.html").read_text()
