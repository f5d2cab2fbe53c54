"""The commands as an engineer types them, on a case of seconds."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import h5py
import pytest

import pmor.pair.model
import pmor.work.offline
from pmor.app.cli import main
from pmor.core.errors import MeshError
from pmor.storage.basis_file import read_basis
from pmor.storage.hdf5 import attribute, set_attributes
from pmor.storage.seal import checksums
from tests.support.broken_files import flip_bit_of, is_truncated, set_attribute
from tests.support.processes import complaints
from tests.support.small_case import case_text, fail_where, write_case
from tests.support.stored_files import results_in, summary_of

ROOT = Path(__file__).parents[2]
QUIET = {"plots": False, "report": False}
PICTURES = {"ste.svg", "load_sharing.svg", "stiffness.svg", "spectrum.svg", "error.svg", "mesh.svg"}
TABLES = {"summary.json", "ste.csv", "torques.csv", "stiffness.csv", "results.h5"}
# DESIGN.md, section 5: scripts rely on these.
SUMMARY_KEYS = {
    "case", "n_profile", "lodm", "n_angles", "torque_Nm", "ste_mean_um", "ste_peak_to_peak_um", "ste_ripple_um",
    "rom_size", "rom_vs_full_ste_max_rel", "rom_vs_full_ste_rms_rel", "online_ms_per_position",
    "full_ms_per_position", "offline_s", "basis_mib",
}  # fmt: skip


def python(folder, *arguments):
    """A process in a folder where an engineer has modules called offline and online, as folders of ours are."""
    for name in ("offline", "online"):
        (folder / f"{name}.py").write_text('whose = "my own"\n')
    path = os.pathsep.join(str(ROOT / name) for name in (".", "offline", "online"))
    return subprocess.run(
        [sys.executable, *arguments], cwd=folder, env=os.environ | {"PYTHONPATH": path}, capture_output=True, text=True,
        timeout=600, check=False,
    )  # fmt: skip


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """The folder of one whole run, pictures and all, beside an engineer's own modules; what it printed."""
    folder = tmp_path_factory.mktemp("finished")
    done = python(folder, "-m", "pmor", "run", write_case(folder), "--out", str(folder / "out"))
    assert (done.returncode, complaints(done.stderr)) == (0, "")
    return folder / "out", done.stdout


@pytest.fixture
def out(finished, tmp_path):
    """A copy of the basis of the finished run, to run again."""
    (tmp_path / "out").mkdir()
    shutil.copy(finished[0] / "basis.h5", tmp_path / "out")
    return tmp_path / "out"


def forbid_offline(monkeypatch):
    def never(*_arguments, **_more):
        pytest.fail("the basis was there: no full solve is needed")

    monkeypatch.setattr(pmor.work.offline, "run_offline", never)


def count_offline(monkeypatch):
    calls, run_offline = [], pmor.work.offline.run_offline

    def counted(*arguments, **more):
        calls.append(arguments)
        return run_offline(*arguments, **more)

    monkeypatch.setattr(pmor.work.offline, "run_offline", counted)
    return calls


# --- run -------------------------------------------------------------------------------------------------------------


def test_run_leaves_tables_pictures_page_and_basis(finished):
    folder, _ = finished
    assert results_in(folder) == PICTURES | TABLES | {"report.html", "basis.h5"}


def test_run_writes_the_promised_summary(finished):
    found = summary_of(finished[0])
    assert set(found) >= SUMMARY_KEYS
    assert (found["case"], found["n_profile"], found["lodm"], found["n_angles"]) == ("tiny", 6, 2, 4)
    assert found["n_positions_failed"] == 0
    # Too few angles for a ripple; everything else is there.
    assert [key for key in sorted(SUMMARY_KEYS) if found[key] is None] == ["ste_ripple_um"]
    assert 0.0 < found["rom_vs_full_ste_rms_rel"] <= found["rom_vs_full_ste_max_rel"] < 0.2


def test_modules_of_an_engineer_are_found_beside_the_package(tmp_path):
    words = ("from importlib.util import find_spec as found; import offline, online; "
             "assert found('pmor_offline.train') and found('pmor_online.run'); "
             "print(offline.whose, online.whose, sep=', ')")  # fmt: skip
    assert python(tmp_path, "-c", words).stdout == "my own, my own\n"


def test_another_sweep_takes_the_basis_that_is_there(out, tmp_path, monkeypatch):
    forbid_offline(monkeypatch)
    changed = write_case(
        tmp_path,
        load={"torque_Nm": 80.0},
        online={"angles_per_pitch": 5, "torques_Nm": [80.0]},
        compare={"angles": 1, "torques_Nm": [70.0]},
        output=QUIET,
    )
    assert main(["run", str(changed), "--out", str(out)]) == 0
    found = summary_of(out)
    assert (found["n_angles"], found["torque_Nm"]) == (5, 80.0)
    assert results_in(out) == {"basis.h5"} | TABLES, "no pictures, no page"


@pytest.mark.parametrize(
    "change",
    [
        {"offline": {"torques_Nm": [50.0, 160.0]}},
        {"pair": {"face_width_mm": 19.0}},
        {"contact": {"penalty_N_mm3": 5e5}},
        {"reduction": {"shapes": "positions"}},
    ],
    ids=["training", "gear", "contact", "family"],
)
def test_a_change_of_what_the_basis_rests_on_makes_a_new_one(change, out, tmp_path, monkeypatch):
    calls = count_offline(monkeypatch)
    assert main(["run", str(write_case(tmp_path, output=QUIET, **change)), "--out", str(out)]) == 0
    assert len(calls) == 1
    assert read_basis(out / "basis.h5").case.text == case_text(output=QUIET, **change)


def test_overwrite_makes_a_new_basis(out, tmp_path, monkeypatch):
    calls = count_offline(monkeypatch)
    assert main(["run", str(write_case(tmp_path, output=QUIET)), "--out", str(out), "--overwrite", "--jobs", "2"]) == 0
    assert len(calls) == 1


def outdate(path):
    """As if the case file had once had a key that it has no longer."""
    with h5py.File(path, "r+") as file:
        set_attributes(file, case_text=attribute(file, "case_text") + "\n[friction]\ncoefficient = 0.1\n")
        set_attributes(file, **checksums(file))


@pytest.mark.parametrize(
    ("damage", "more"),
    [(is_truncated, ["--overwrite"]), (set_attribute("schema_version", 1), []),
     (flip_bit_of("shapes/wheel/gram"), []), (outdate, [])],
    ids=["truncated", "of an older version", "flipped", "of an older schema"],
)  # fmt: skip
def test_a_damaged_basis_is_made_anew_by_run_and_refused_by_online(damage, more, out, tmp_path, monkeypatch, capsys):
    """Half a file could be anybody's: to replace that, the word is needed."""
    damage(out / "basis.h5")
    assert main(["online", str(out / "basis.h5"), "-o", str(tmp_path / "results")]) == 2
    message = capsys.readouterr().err
    assert str(out / "basis.h5") in message
    assert len(message.splitlines()) == 1
    assert not (tmp_path / "results").exists()

    calls = count_offline(monkeypatch)
    arguments = ["run", str(write_case(tmp_path, output=QUIET)), "--out", str(out)]
    if more:
        assert main(arguments) == 2
        assert "basis.h5: is there, and not known to be written by pmor" in capsys.readouterr().err
    assert main([*arguments, *more]) == 0
    assert len(calls) == 1
    read_basis(out / "basis.h5")


# --- what did not converge -------------------------------------------------------------------------------------------


def test_a_failed_position_ends_with_3_and_is_named(out, tmp_path, monkeypatch, capsys, undrawn):
    seen = []

    def first_angle(phi, torque):
        seen.append(phi)
        return phi == seen[0] and torque == 60e3

    fail_where(first_angle, monkeypatch)
    assert main(["run", str(write_case(tmp_path)), "--out", str(out)]) == 3
    text, error = capsys.readouterr()
    message = f"full FE: phi = {seen[0]:.6g} rad, torque = 60 N m did not converge"
    assert f"  ! {message}" in text.splitlines()
    assert complaints(error) == f"pmor: error: 1 positions failed, first: {message}\n"
    assert summary_of(out)["n_positions_failed"] == 1
    assert message in (out / "report.html").read_text()


def test_a_reduced_model_that_differs_from_full_fe_by_more_than_the_bound_ends_with_3(out, tmp_path, capsys, undrawn):
    bound = 1e-6
    arguments = ["run", str(write_case(tmp_path, compare={"largest_error_percent": bound})), "--out", str(out)]
    assert main(arguments) == 3
    found, error = summary_of(out), capsys.readouterr().err
    percent = 100.0 * found["rom_vs_full_ste_max_rel"]
    assert f"the STE is {percent:.3g} % from that of full FE" in error
    assert f"more than [compare] largest_error_percent = {bound:g}" in error
    assert found["n_positions_failed"] == 0


def test_training_that_fails_is_not_passed_over_in_silence(tmp_path, monkeypatch, capsys):
    """A basis with a hole answers everywhere, but worse: whoever runs the case must be told, also the next time."""
    trained = []

    def first_trained(phi, torque):
        trained.append(phi)
        return phi == trained[0] and torque == 40e3

    fail_where(first_trained, monkeypatch)
    arguments = ["run", str(write_case(tmp_path, output=QUIET)), "--out", str(tmp_path / "out")]
    assert main(arguments) == 3
    text, error = capsys.readouterr()
    assert f"phi = {trained[0]:.6g} rad, torque = 40 N m" in text + error
    monkeypatch.undo()
    assert main(arguments) in (0, 3)
    if not read_basis(tmp_path / "out" / "basis.h5").training.converged.all():
        assert f"phi = {trained[0]:.6g} rad, torque = 40 N m" in "".join(capsys.readouterr())


# --- offline, online, compare ----------------------------------------------------------------------------------------


def test_offline_then_online(tmp_path, monkeypatch, capsys, undrawn):
    monkeypatch.chdir(tmp_path)
    basis = tmp_path / "new" / "basis.h5"
    assert main(["offline", str(write_case(tmp_path)), "-o", str(basis)]) == 0
    assert f"{basis}: 4 angles solved, 0 taken over" in capsys.readouterr().out
    assert results_in(basis.parent) == {"basis.h5"}
    assert main(["online", str(basis)]) == 0
    results = tmp_path / "out" / "tiny"  # the default
    pictures = PICTURES - {"error.svg", "mesh.svg"}  # no full FE, no mesh
    assert results_in(results) == pictures | TABLES | {"report.html"}
    assert set(summary_of(results)) >= SUMMARY_KEYS


def test_offline_refuses_an_existing_file_before_any_work(tmp_path, monkeypatch, capsys):
    basis = tmp_path / "basis.h5"
    basis.write_text("precious")
    monkeypatch.setattr("pmor.pair.model.mesh_model", lambda *_a: pytest.fail("nothing may be meshed"))
    case = str(write_case(tmp_path))
    assert main(["offline", case, "-o", str(basis)]) == 2
    assert "exists already; choose another name or add --overwrite" in capsys.readouterr().err
    assert basis.read_text() == "precious"
    assert results_in(tmp_path) == {"basis.h5", "tiny.toml"}


def test_compare_leaves_numbers_only(out, tmp_path, monkeypatch, capsys):
    forbid_offline(monkeypatch)
    assert main(["compare", str(write_case(tmp_path)), "--out", str(out)]) == 0
    assert results_in(out) == {"basis.h5"} | TABLES
    assert summary_of(out)["full_ms_per_position"] > 0.0
    assert "reduced vs full, max" in capsys.readouterr().out


# --- gears that cannot be ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"pinion": {"addendum": 1.9}}, "pointed"),
        ({"pinion": {"addendum": 0.4}}, "contact ratio"),
        ({"pair": {"centre_distance_mm": 83.0}}, "jam"),
        ({"pinion": {"rack_tip_radius": 0.9}}, "rack_tip_radius"),
    ],
    ids=["pointed tooth", "contact ratio", "jammed", "rack tip too round"],
)
@pytest.mark.parametrize("command", ["run", "compare", "offline"])
def test_gears_that_cannot_be_made_leave_nothing_behind(command, change, words, tmp_path, capsys):
    case = str(write_case(tmp_path, **change))
    target = ["-o", str(tmp_path / "out" / "basis.h5")] if command == "offline" else ["--out", str(tmp_path / "out")]
    assert main([command, case, *target]) == 2
    text, error = capsys.readouterr()
    assert text == ""
    assert words in error
    assert len(error.splitlines()) == 1
    assert results_in(tmp_path) == {"tiny.toml"}


def test_a_mesh_that_cannot_be_used_names_the_gear(tmp_path, monkeypatch, capsys):
    def refuse(*_arguments):
        raise MeshError("an element is inside out")

    monkeypatch.setattr(pmor.pair.model, "build_sector", refuse)
    assert main(["run", str(write_case(tmp_path)), "--out", str(tmp_path / "out")]) == 2
    assert capsys.readouterr().err == "pmor: error: gear with 21 teeth: an element is inside out\n"
    assert results_in(tmp_path) == {"tiny.toml"}


def test_an_output_folder_that_cannot_be_made(tmp_path, capsys):
    (tmp_path / "file").touch()
    assert main(["run", str(write_case(tmp_path)), "--out", str(tmp_path / "file" / "out")]) == 2
    assert "is a file, not a folder" in capsys.readouterr().err
