"""What a run does first, and what a second one finds done."""

import json

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

import pmor
import pmor.body.elastic_gear
from pmor.core.threads import VARIABLES
from pmor.report.screen import asked_text, proof_text, result_text
from pmor.storage.basis_file import read_basis

PAIR = {
    "teeth": 21, "module_mm": 4.0, "bore_radius_mm": 20.0, "face_width_mm": 20.0, "torque_Nm": 100.0,
    "mesh": {"profile_elements": 8, "width_elements": 2}, "online": {"angles_per_pitch": 12},
}  # fmt: skip


@pytest.fixture(scope="module")
def first(tmp_path_factory):
    """A run, and what its folder and its summary were when it had what was asked for."""
    folder, seen = tmp_path_factory.mktemp("first"), {}

    def look(found):
        seen.update(files={path.name for path in folder.iterdir()}, text=asked_text(found.found))
        seen.update(summary=json.loads((folder / "summary.json").read_text()))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("pmor.report.page.picture_bytes", lambda figure, picture_format: b"")
        return pmor.run_case(pmor.make_case(**PAIR), folder, asked=look), seen


@pytest.mark.slow
def test_what_was_asked_for_is_written_before_the_proof_and_the_page(first):
    found, seen = first
    assert {"ste.csv", "stress.csv", "harris.csv", "results.h5", "summary.json"} <= seen["files"]
    assert not {"report.html", "ste.svg", "basis.h5"} & seen["files"]
    assert seen["summary"]["ste_mesh_error_percent"] > 0.0
    assert seen["summary"]["rom_vs_full_ste_max_rel"] is None
    after = json.loads((found.folder / "summary.json").read_text())
    assert after["rom_vs_full_ste_max_rel"] < 1e-9
    assert after["basis_mib"] > 0.0
    later = {"rom_vs_full_ste_max_rel", "rom_vs_full_ste_rms_rel", "full_ms_per_position", "basis_mib"}
    assert {key for key in after if after[key] != seen["summary"][key]} == later


def test_the_screen_tells_each_line_once(first):
    found, seen = first
    told = seen["text"].splitlines() + proof_text(found.found).splitlines()
    assert sorted(map(str.split, told)) == sorted(map(str.split, result_text(found.found).splitlines()))


@pytest.mark.parametrize("change", [pytest.param({"torque_Nm": 80.0}, marks=pytest.mark.slow), {
    "pinion.modification": {"tip_relief_um": 10.0, "tip_relief_start_roll_deg": 25.0}
}])  # fmt: skip
def test_another_torque_or_modification_takes_no_finite_elements(change, first, undrawn, monkeypatch):
    folder, page = first[0].folder, (first[0].folder / "report.html").read_text()
    assert read_basis(folder / "basis.h5").whole is not None
    monkeypatch.setattr("pmor.body.elastic_gear.elastic_gear", lambda *_a, **_k: pytest.fail("the basis has them"))
    again = pmor.run_case(pmor.change_case(first[0].case, **change), folder)
    assert again.failures == ()
    assert again.summary["ste_mean_um"] != first[0].summary["ste_mean_um"]
    assert again.comparison.max_relative_error < 1e-9
    # The live page carries the compliance of the whole width, which is that of the first run.
    bodies = [text[text.index('"bodies"') :][:2000] for text in ((folder / "report.html").read_text(), page)]
    assert bodies[0] == bodies[1]


def test_finite_elements_from_python_take_one_thread_of_linear_algebra_and_give_the_others_back(monkeypatch):
    def threads():
        return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}

    seen, condense = [], pmor.body.elastic_gear.condense_sector

    def watched(*arguments, **more):
        seen.append(threads())
        return condense(*arguments, **more)

    for name in VARIABLES:
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("pmor.body.elastic_gear.condense_sector", watched)
    with threadpool_limits(2, "blas"):
        pmor.train(pmor.make_case(**PAIR))
        assert threads() == {2}
    assert seen
    assert all(found == {1} for found in seen)
