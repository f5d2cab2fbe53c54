"""Sweeps beyond the training: refused unless asked for, said to be so, and with an error bar that tells their error."""

from functools import cache

import numpy as np
import pytest

from pmor.app.cli import main
from pmor.case import basis_key, beyond_training, parse_case
from pmor.core.errors import CaseError
from pmor.gear.condition import Condition
from pmor.pair.sweep import sweep_ste
from pmor.storage.basis_file import read_basis
from pmor.work.offline import run_offline
from pmor_online.model import reduced_pair
from pmor_online.sweep import sweep_reduced_pair
from tests.support.small_case import case_text, full_fe
from tests.support.stored_files import summary_of

TILT = {"in_plane_um": [-10.0, 0.0, 10.0]}
MESH = {"profile_elements": 8, "width_elements": 4}


def text_of(tilted=False, reduction=None, **changes):
    """Trained to 100 N m and, where tilted, to 10 um."""
    sections = {
        "mesh": MESH, "reduction": reduction or {}, "compare": {"torques_Nm": [60.0]},
        "offline": {"angles_per_pitch": 10, "torques_Nm": [20.0, 100.0], **(TILT if tilted else {})},
    }  # fmt: skip
    return case_text(**{k: sections.get(k, {}) | changes.get(k, {}) for k in {**sections, **changes}})


def case_of(*arguments, **changes):
    return parse_case(text_of(*arguments, **changes), "small", "small case")


EXTRAPOLATE = {"online": {"extrapolate": True, "torques_Nm": [100.0, 200.0]}}


# --- the rule --------------------------------------------------------------------------------------------------------


ASKED = {"online": {"extrapolate": True}}
TILTED = {"misalignment": {"in_plane_um": 20.0, "centre_distance_um": -5.0}}
APART = {"misalignment": {"centre_distance_um": 5.0}}


@pytest.mark.parametrize(
    ("tilted", "changes", "words"),
    [
        (False, {"online": {"torques_Nm": [200.0]}}, "200.0 N m is beyond .*training torque, 100.0 N m: .*extrapolate"),
        (True, TILTED, "in_plane_um = 20.0: is beyond the training, -10 to 10 um: .*extrapolate"),
        (False, EXTRAPOLATE | {"compare": {"torques_Nm": [200.0]}}, r"\[compare\] torques_Nm = .*lower it, or add"),
        (False, EXTRAPOLATE | {"load": {"torque_Nm": 200.0}}, r"\[load\] torque_Nm = 200.0: is beyond the largest"),
        (False, EXTRAPOLATE | {"reduction": {"error_estimate": False}}, "extrapolate = true: .*= false: write true"),
    ],
)
def test_sweeps_beyond_the_training_are_refused_unless_asked_for_with_an_error_bar(tilted, changes, words):
    with pytest.raises(CaseError, match=words):
        case_of(tilted, **changes)


@pytest.mark.parametrize(
    ("tilted", "changes", "beyond"),
    [
        (False, EXTRAPOLATE, ("torque to 200 N m, trained to 100 N m",)),
        (False, ASKED, ()),
        (True, ASKED | TILTED, ("in_plane_um = 20, trained -10 to 10 um", "centre_distance_um = -5, trained at 0 um")),
        (False, ASKED | APART | {"mesh": {"width": "plane_strain"}}, ("centre_distance_um = 5, trained at 0 um",)),
        (False, EXTRAPOLATE | {"reduction": {"shapes": "static_modes"}}, ()),  # they have no training to leave
    ],
)
def test_what_is_beyond_the_training_is_named(tilted, changes, beyond):
    assert beyond_training(case_of(tilted, **changes)) == beyond


@pytest.mark.parametrize(
    ("width", "words"),
    [("half", "has half the width, .*give .offline. in_plane_um a range"), ("plane_strain", "has one section .*whole")],
)
@pytest.mark.parametrize("asked", [{}, ASKED])
def test_tilt_stays_refused_where_the_basis_has_not_the_whole_width(width, words, asked):
    with pytest.raises(CaseError, match=f"in_plane_um = 5.0: tilted axes load the width unevenly, .*{words}"):
        case_of(misalignment={"in_plane_um": 5.0}, mesh={"width": width}, **asked)


def test_a_basis_does_not_depend_on_it():
    assert basis_key(case_of(**EXTRAPOLATE)) == basis_key(case_of())


# --- the error bar ---------------------------------------------------------------------------------------------------


@cache
def model_of(tilted):
    case = case_of(tilted)
    return full_fe(case)


def error_and_bar(basis, model, condition):
    """Largest error and largest error bar over a pitch, um."""
    meshed, reduced = model.mesh.meshed, reduced_pair(basis)
    phi = meshed.pair.pitch * (np.arange(24) + 0.37) / 24
    full = sweep_ste(meshed, model.elasticity_at, phi, [condition])
    fast = sweep_reduced_pair(reduced, phi, [condition], tolerance=1e-9)
    assert full.converged.all()
    assert fast.converged.all()
    return np.abs(full.ste_um - fast.ste_um).max(), np.abs(fast.ste_error_um).max()


@pytest.mark.jit
@pytest.mark.parametrize(
    "shapes", ["flank_lines", *(pytest.param(one, marks=pytest.mark.slow) for one in ("positions", "pod"))]
)
def test_the_error_bar_at_twice_the_trained_torque_tells_the_error(shapes, tmp_path):
    """Measured: 1 to 6 times as long as the error. The roll positions of a grid end where the trained torques end.

    Nothing is felt of it, for the grid has the windows' margin, three times the approach of the flanks.
    """
    model = model_of(False)
    run_offline(case_of(reduction={"shapes": shapes}), model, tmp_path / "b.h5")
    basis = read_basis(tmp_path / "b.h5")
    _, inside = error_and_bar(basis, model, Condition(torque=1e5))
    for torque in (1.5e5, 2e5):
        error, bar = error_and_bar(basis, model, Condition(torque=torque))
        assert bar > inside
        assert error / 5.0 < bar < 20.0 * error


# --- the command -----------------------------------------------------------------------------------------------------


def online(path, folder, text):
    (folder / "small.toml").write_text(text)
    return main(["online", str(path), "-o", str(folder / "out"), "--case", str(folder / "small.toml")])


@pytest.fixture(scope="module")
def basis_path(tmp_path_factory):
    path = tmp_path_factory.mktemp("basis") / "b.h5"
    run_offline(case_of(), model_of(False), path)
    return path


QUICK = {"angles_per_pitch": 8}


def test_a_sweep_beyond_the_training_says_so(basis_path, tmp_path, capsys):
    assert online(basis_path, tmp_path, text_of(online=EXTRAPOLATE["online"] | QUICK)) == 0
    what = "torque to 200 N m, trained to 100 N m"
    out = capsys.readouterr().out
    assert f"! extrapolated: {what}; see the error bar" in out
    assert "STE error bar, max" in out
    summary = summary_of(tmp_path / "out")
    assert summary["extrapolated"] == [what]
    assert summary["ste_error_estimate_max_um"] > 0.0
    assert f"extrapolated: {what}" in (tmp_path / "out" / "report.html").read_text()


def test_loads_beyond_the_model_stay_refused(basis_path, tmp_path, capsys):
    sweep = QUICK | {"extrapolate": True, "torques_Nm": [100.0, 1e6]}
    assert online(basis_path, tmp_path, text_of(online=sweep)) == 2
    assert "flanks would approach" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
