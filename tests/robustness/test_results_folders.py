"""What is not ours is neither replaced nor removed, and results of one case never lie beside those of another."""

import json
import os
import subprocess
import sys

import pytest

import pmor.app.full
import pmor.lab.bench
import pmor.lab.study.run
from pmor.app.cli import main
from pmor.case import load_case
from pmor.core.errors import OutputError
from pmor.report.run_page import page_files
from pmor.report.summary import result_files
from pmor.storage.atomic import atomic_path
from pmor.storage.manifest import MANIFEST, begin_manifest, is_ours, listed
from pmor.storage.results_folder import (
    default_folder,
    remove_working_folder,
    results_folder,
    start_results,
    working_folder,
)
from tests.support.processes import complaints
from tests.support.refusals import refused
from tests.support.small_case import case_text
from tests.support.stored_files import results_in

QUIET = {"plots": False, "report": False}


@pytest.fixture
def case_file(tmp_path):
    path = tmp_path / "tiny.toml"
    path.write_text(case_text())
    return path


@pytest.fixture
def no_work(monkeypatch):
    """Whatever takes time fails: what is refused is refused before the work."""

    def never(*_arguments, **_more):
        pytest.fail("this should have been refused before the work")

    monkeypatch.setattr("pmor.work.offline.elastic_model", never)
    monkeypatch.setattr("pmor_offline.gears.solved_gear", never)
    monkeypatch.setattr(pmor.lab.study.run, "run_pieces", never)
    monkeypatch.setattr(pmor.lab.bench, "run", never)


def write(path, text):
    with atomic_path(path) as temporary:
        temporary.write_text(text)


# --- what is somebody else's -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["report.html", "ste.csv", "ste.svg", "summary.json"])
def test_run_refuses_to_replace_a_foreign_file(name, case_file, tmp_path, no_work):
    (tmp_path / name).write_text("mine")
    error = refused("run", case_file, "--out", tmp_path)
    assert f"{tmp_path / name}: is there, and not known to be written by pmor; choose another place, or add" in error
    assert (tmp_path / name).read_text() == "mine"
    assert results_in(tmp_path) == {"tiny.toml", name}


def test_what_a_case_does_not_write_is_in_nobodys_way(case_file, tmp_path):
    (tmp_path / "report.html").write_text("mine")
    case_file.write_text(case_text(output=QUIET))
    with results_folder(tmp_path, ("ste.csv",)):
        write(tmp_path / "ste.csv", "1")
    assert (tmp_path / "report.html").read_text() == "mine"


@pytest.mark.parametrize(
    ("parts", "arguments"),
    [
        ("parts", ["lab", "study", "cases/paper_study.toml", "--quick", "--out", "."]),
        ("parts", ["lab", "study", "cases/paper_study.toml", "--quick", "--out", ".", "--overwrite"]),
        ("basis.h5.parts", ["offline", "tiny.toml", "-o", "basis.h5"]),
        ("basis.h5.parts", ["offline", "tiny.toml", "-o", "basis.h5", "--resume"]),
    ],
)
def test_a_users_own_folder_is_left_alone(parts, arguments, case_file, tmp_path, no_work):
    (tmp_path / parts).mkdir()
    (tmp_path / parts / "angle_00000.h5").write_text("mine")
    places = {".": tmp_path, "tiny.toml": case_file, "basis.h5": tmp_path / "basis.h5"}
    error = refused(*(places.get(argument, argument) for argument in arguments))
    assert f"{tmp_path / parts}: is needed for unfinished work, and pmor did not make it; move it away" in error
    assert (tmp_path / parts / "angle_00000.h5").read_text() == "mine"


def test_no_output_replaces_what_it_is_made_from(case_file, tmp_path, no_work):
    before = case_file.read_text()
    for arguments in (
        ["lab", "bench", case_file, "--json", case_file],
        ["lab", "bench", case_file, "--json", case_file, "--overwrite"],
        ["offline", case_file, "-o", case_file, "--overwrite"],
    ):
        assert "is an input of the results; choose another place" in refused(*arguments)
    named = tmp_path / "summary.json"
    named.write_text(before)
    assert "is an input of the results" in refused("run", named, "--out", tmp_path, "--overwrite")
    assert case_file.read_text() == named.read_text() == before


def test_bench_replaces_neither_foreign_numbers_nor_a_foreign_table(case_file, tmp_path, no_work):
    for name in ("bench.json", "bench.md"):
        (tmp_path / name).write_text("mine")
        error = refused("lab", "bench", case_file, "--json", tmp_path / "bench.json")
        assert f"{tmp_path / name}: is there, and not known to be written by pmor" in error
        assert (tmp_path / name).read_text() == "mine"
        (tmp_path / name).unlink()
    for name in ("bench.md", ".", "..", tmp_path):
        assert "choose one that ends in .json" in refused("lab", "bench", case_file, "--json", name)


def test_a_folder_or_a_link_in_the_way_is_refused_even_to_be_overwritten(case_file, tmp_path, no_work):
    (tmp_path / "precious").write_text("mine")
    (tmp_path / "ste.csv").symlink_to(tmp_path / "precious")
    assert "ste.csv: is a link" in refused("run", case_file, "--out", tmp_path, "--overwrite")
    (tmp_path / "ste.csv").unlink()
    (tmp_path / "ste.csv").mkdir()
    assert "ste.csv: is a folder" in refused("run", case_file, "--out", tmp_path, "--overwrite")
    assert "is a folder, not a file" in refused("offline", case_file, "-o", tmp_path, "--overwrite")


def test_a_foreign_file_in_place_of_the_basis_is_kept(case_file, tmp_path, monkeypatch):
    monkeypatch.setattr("pmor.work.offline.run_offline", lambda *_a: pytest.fail("not before the work"))
    (tmp_path / "basis.h5").write_text("mine")
    assert "basis.h5: is there, and not known to be written by pmor: no basis to replace" in refused(
        "run", case_file, "--out", tmp_path
    )
    assert (tmp_path / "basis.h5").read_text() == "mine"


@pytest.mark.parametrize(
    "arguments",
    [["run", "C", "--out", ""], ["offline", "C", "-o", ""], ["online", "B", "-o", ""],
     ["lab", "bench", "C", "--json", ""], ["lab", "study", "C", "--out", ""], ["run", ""]],
)  # fmt: skip
def test_an_empty_name_is_no_folder(arguments, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    assert ended.value.code == 2
    assert "an empty name: write . for the current folder" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


# --- one case text ---------------------------------------------------------------------------------------------------


@pytest.fixture
def finished(tmp_path, undrawn, capsys):
    """A whole run; its case file and its folder."""
    path, out = tmp_path / "tiny.toml", tmp_path / "out"
    path.write_text(case_text())
    assert main(["run", str(path), "--out", str(out)]) == 0
    capsys.readouterr()
    return path, out


@pytest.mark.slow
def test_after_an_edit_nothing_of_the_old_text_lies_beside_new_results(finished, capsys):
    path, out = finished
    before, case = results_in(out), load_case(path)
    assert {"report.html", "ste.svg"} < before == {"basis.h5", *result_files(case), *page_files(case)}
    (out / "notes.txt").write_text("mine")
    (out / "report.html").write_text("with remarks of mine")
    assert main(["compare", str(path), "--out", str(out)]) == 0
    assert results_in(out) == before | {"notes.txt"}, "of the same text: all stays"
    capsys.readouterr()

    path.write_text(case_text(online={"angles_per_pitch": 5}))
    assert main(["compare", str(path), "--out", str(out)]) == 0
    assert results_in(out) == {
        "basis.h5",
        "ste.csv",
        "torques.csv",
        "stiffness.csv",
        "summary.json",
        "results.h5",
        "notes.txt",
        "report.html",
    }
    assert (out / "report.html").read_text() == "with remarks of mine"
    said = complaints(capsys.readouterr().err).splitlines()
    assert said[0].startswith(f"pmor: {out}: removed results of another text or version: error.svg, ")
    assert said[1:] == [
        f"pmor: {out / 'report.html'}: was made from another text and changed since: it stays, and is none of these "
        "results"
    ]
    assert json.loads((out / "summary.json").read_text())["n_angles"] == 5

    # Changed by hand, it is no longer ours to replace.
    assert "report.html: has been changed since pmor wrote it; choose another place, or add --overwrite" in refused(
        "run", path, "--out", out
    )


def test_results_of_another_version_go_as_those_of_another_text_do(tmp_path, monkeypatch):
    with results_folder(tmp_path / "out", ["ste.csv"]) as folder:
        start_results(folder, "text")
        write(folder / "ste.csv", "old numbers")
    start_results(folder, "text")
    assert (folder / "ste.csv").exists()
    monkeypatch.setattr(pmor.storage.manifest, "__version__", "0.5.0")
    start_results(folder, "text")
    assert not (folder / "ste.csv").exists()


def test_killed_before_or_after_a_replacement_a_file_is_known_to_be_ours(tmp_path, monkeypatch):
    with results_folder(tmp_path, ("ste.csv",)):
        write(tmp_path / "ste.csv", "first")

        class Killed(BaseException):
            pass

        def kill(*_arguments):
            raise Killed

        monkeypatch.setattr(os, "replace", kill)
        with pytest.raises(Killed):
            write(tmp_path / "ste.csv", "second")
    monkeypatch.undo()
    assert is_ours(tmp_path / "ste.csv")
    (tmp_path / "ste.csv").write_text("second")
    assert is_ours(tmp_path / "ste.csv"), "as if killed just after the rename"
    (tmp_path / "ste.csv").write_text("third")
    assert not is_ours(tmp_path / "ste.csv")
    with pytest.raises(OutputError, match="has been changed since pmor wrote it"):
        write(tmp_path / "ste.csv", "fourth")


def test_what_is_to_be_overwritten_is_replaced_and_ours_then(tmp_path):
    begin_manifest(tmp_path)
    (tmp_path / "a").write_text("mine")
    with pytest.raises(OutputError, match="not known to be written by pmor"):
        write(tmp_path / "a", "ours")
    with atomic_path(tmp_path / "a", overwrite=True) as temporary:
        temporary.write_text("ours")
    assert (tmp_path / "a").read_text() == "ours"
    assert is_ours(tmp_path / "a")


def test_half_a_line_in_the_manifest_costs_no_other_line(tmp_path):
    begin_manifest(tmp_path)
    write(tmp_path / "a", "1")
    with (tmp_path / MANIFEST).open("a") as file:
        file.write('{"file": "b", "sha')
    write(tmp_path / "c", "3")
    assert set(listed(tmp_path)) == {"a", "c"}


def test_names_in_a_manifest_point_nowhere(tmp_path):
    folder = working_folder(tmp_path / "inner")
    (tmp_path / "precious").write_text("mine")
    (tmp_path / "inner" / "own").write_text("ours")
    with (folder / MANIFEST).open("a") as file:
        for name in ("../precious", str(tmp_path / "precious"), "..", ".", "", "own\0", "own", 7, None):
            file.write(json.dumps({"file": name, "sha256": "0"}) + "\n")
        file.write("[" * 100_000 + "\n7\n")
    start_results(folder, "text")
    remove_working_folder(folder)
    assert {path.name for path in tmp_path.iterdir()} == {"precious"}


def test_a_working_folder_goes_without_what_is_not_ours(tmp_path):
    folder = working_folder(tmp_path / "parts")
    inner = working_folder(folder / "basis.h5.parts")
    for place in (folder, inner):
        write(place / "ours", "1")
    (folder / "thesis.txt").write_text("mine")
    remove_working_folder(folder)
    assert results_in(folder) == {"thesis.txt"}
    (folder / "thesis.txt").unlink()
    remove_working_folder(working_folder(folder))
    assert list(tmp_path.iterdir()) == []


# --- remains of killed runs ------------------------------------------------------------------------------------------


def test_the_next_run_clears_away_what_a_killed_one_left_and_nothing_else(tmp_path):
    code = """
import os, sys
from pathlib import Path
from pmor.storage.atomic import atomic_path
with atomic_path(Path(sys.argv[1])) as temporary:
    temporary.write_text("half")
    os.kill(os.getpid(), 9)
"""
    command = [sys.executable, "-c", code, str(tmp_path / "report.html")]
    assert subprocess.run(command, check=False).returncode == -9
    (abandoned,) = tmp_path.iterdir()
    assert abandoned.name.startswith(".report.html.")
    others = {
        f".ste.csv.pmor-{os.getppid()}-0123abcd.tmp",  # of a process that lives
        abandoned.name.replace("report.html", "basis.h5"),  # somebody has its lock
        ".basis.h5.lock",
        ".report.html.mine.tmp",
        "report.html.tmp",
    }
    for name in others:
        (tmp_path / name).touch()
    with results_folder(tmp_path, ()):
        assert results_in(tmp_path) == others | {".pmor.lock"}


# --- names are no paths ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "name",
    ["..", ".", "...", "../../..", "/etc", "a/b", "..\\x", "a\0b", "\x1b[31m", "", "x" * 300, ".pmor", "C:\\x",
     "\u202ea"],
)  # fmt: skip
def test_a_name_never_gets_out_of_the_folder_out(name):
    for ending in ("", "_study"):
        folder = default_folder(name, ending)
        assert folder.parent.as_posix() == "out"
        assert folder.name not in ("", ".", "..")
        assert not folder.name.startswith(".")
        assert len(folder.name) < 120
        assert folder.name.isprintable()
    assert default_folder("paper_spur", "_quick").as_posix() == "out/paper_spur_quick"
