"""The Python API gives what the commands give, refuses what they refuse, and shows itself in one line."""

from __future__ import annotations

import numpy as np
import pytest

import pmor
from pmor.core.shown import LONGEST


def stored(path):
    """Content of a file, without the second of its writing and the checksum over it."""
    skipped = ("created", "contents_sha256")
    return [line for line in pmor.info(path).splitlines()[1:] if line.split()[0] not in skipped]


@pytest.fixture(scope="module")
def case():
    return pmor.make_case(
        "small", teeth=21, bore_radius_mm=20.0, module_mm=4.0, face_width_mm=20.0, torque_Nm=100.0,
        mesh={"profile_elements": 5, "width_elements": 2},
        offline={"angles_per_pitch": 6, "torques_Nm": [40.0, 160.0]}, online={"angles_per_pitch": 8},
        compare={"angles": 3, "torques_Nm": [60.0]}, scheme="direct", element="hex8i",
    )  # fmt: skip


def test_a_saved_model_answers_as_before(tmp_path, model):
    model.save(tmp_path / "new" / "basis.h5")
    again = pmor.load_model(tmp_path / "new" / "basis.h5")
    np.testing.assert_array_equal(again.sweep().ste_um, model.sweep().ste_um)
    with pytest.raises(pmor.OutputError, match="exists already"):
        model.save(tmp_path / "new" / "basis.h5")
    again.save(tmp_path / "copy.h5")
    assert stored(tmp_path / "copy.h5") == stored(tmp_path / "new" / "basis.h5")
    with pytest.raises(pmor.OutputError, match="no forces of its training"):
        pmor.ReducedModel(model.basis).save(tmp_path / "bare.h5")


@pytest.mark.parametrize(
    "fate", ["overwritten", *(pytest.param(fate, marks=pytest.mark.slow) for fate in ("removed", "left by chdir"))]
)
def test_a_loaded_model_is_saved_and_reported_as_it_was_read_whatever_became_of_its_file(
    fate, tmp_path, model, case, full, undrawn, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    model.save("a.h5")
    before, loaded = stored(tmp_path / "a.h5"), pmor.load_model("a.h5")
    if fate == "overwritten":
        fewer = pmor.change_case(case, offline={"angles_per_pitch": 4})
        pmor.train(fewer, full).save("a.h5", overwrite=True)
        assert stored(tmp_path / "a.h5") != before
    elif fate == "removed":
        (tmp_path / "a.h5").unlink()
    else:
        (tmp_path / "elsewhere").mkdir()
        monkeypatch.chdir(tmp_path / "elsewhere")
    loaded.save("b.h5")
    assert stored("b.h5") == before
    report = loaded.report("out", compare=False)
    np.testing.assert_array_equal(report.sweep.ste_um, model.sweep().ste_um)
    assert report.summary["basis_mib"] == loaded.source_bytes / 2**20
    monkeypatch.chdir("/")
    assert report.page.exists()


def test_a_report_leaves_the_model_that_was_read_not_the_file_that_is_there_now(tmp_path, model, case, full, undrawn):
    model.save(tmp_path / "basis.h5")
    before, loaded = stored(tmp_path / "basis.h5"), pmor.load_model(tmp_path / "basis.h5")
    fewer = pmor.change_case(case, offline={"angles_per_pitch": 4})
    pmor.train(fewer, full).save(tmp_path / "basis.h5", overwrite=True)
    loaded.report(tmp_path, full=full, overwrite=True)
    assert stored(tmp_path / "basis.h5") == before


def test_progress_counts_every_solution(case, full):
    done = []
    pmor.train(case, full, progress=done.append)
    assert sum(done) == case.offline.angles_per_pitch


def test_a_sweep_is_over_the_torques_angles_and_axes_that_it_is_asked_for(model):
    phi = np.array([0.0, 0.02, 0.11])
    apart = pmor.Misalignment(centre_distance_um=10.0)
    result = model.sweep([30, 90.0], phi, misalignment=apart, extrapolate=True)
    assert result.ste_um.shape == (2, 3)
    np.testing.assert_array_equal(result.torque_Nm, [30.0, 90.0])
    np.testing.assert_array_equal(result.phi_rad, phi)
    assert np.abs(result.ste_um / model.sweep([30, 90], phi).ste_um - 1.0).min() > 1e-7  # the axes count
    for one in (30, np.array(30.0), np.float64(30.0)):
        np.testing.assert_array_equal(model.sweep(one, phi).ste_um, model.sweep([30], phi).ste_um)
    assert model.sweep(angles=5).phi_rad.shape == (5,)
    np.testing.assert_array_equal(model.sweep(angles=np.int64(5)).phi_rad, model.sweep(angles=5).phi_rad)


def test_what_a_result_says_belongs_together(model):
    result = model.sweep([50, 150])
    np.testing.assert_allclose(result.ste_urad * result.pair.pinion.base_radius, 1e3 * result.ste_um, rtol=1e-14)
    np.testing.assert_allclose(result.pair_share.sum(axis=2), 1.0, rtol=1e-12)
    np.testing.assert_allclose(result.mean_um, result.ste_um.mean(axis=1), rtol=1e-14)
    np.testing.assert_allclose(result.peak_to_peak_um, np.ptp(result.ste_um, axis=1), rtol=1e-14)
    load = 1e3 * result.torque_Nm / result.pair.pinion.base_radius / result.pair.face_width
    np.testing.assert_allclose(result.stiffness.secant * result.ste_um, np.tile(load, (8, 1)).T, rtol=1e-13)
    assert result.orders_um(3).shape == (2, 3)
    assert result.converged.all()
    assert result.newton_steps.min() >= 0


def test_pictures_are_figures_with_a_curve_for_each_torque(model, full):
    from matplotlib.figure import Figure

    result, reference = model.sweep([50, 150]), full.sweep([50], angles=3)
    for figure in (result.plot_ste(), result.plot_ste(reference), result.plot_load_sharing(), result.plot_orders()):
        assert isinstance(figure, Figure)
        assert figure.axes


def test_a_comparison_is_at_angles_that_no_training_has_seen(model, full):
    comparison = pmor.compare(model, full)
    assert comparison.full.ste_um.shape == (1, 3)
    assert 0.0 < comparison.max_relative_error < 0.01


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"torques_Nm": [200.0]}, "beyond the training: torque to 200 N m, trained to 160 N m: train over it, or pass"),
        ({"misalignment": pmor.Misalignment(in_plane_um=3.0)}, "tilted axes load the width unevenly"),
        ({"misalignment": pmor.Misalignment(in_plane_um=3.0), "extrapolate": True}, "tilted axes"),
        ({"torques_Nm": [30.0, 200.0, 50.0]}, "beyond the training: torque to 200 N m"),
        ({"torques_Nm": []}, "must not be empty"),
        ({"torques_Nm": "125"}, "must be a number, or a list"),
        ({"torques_Nm": True}, "must be a number, or a list"),
        ({"torques_Nm": [[50.0]]}, "not a list"),
        ({"torques_Nm": [True]}, "must be a number"),
        ({"torques_Nm": range(1, 10**9)}, "1000000 are enough"),
        ({"angles": 0}, "angles = 0"),
        ({"angles": 200.0}, "angles = 200.0: must be a whole number"),
        ({"angles": True}, "angles = true"),
        ({"angles": "20"}, 'angles = "20"'),
        ({"angles": 2_000_000}, r"between 1 and 1e\+06"),
        ({"angles": [0.0, float("inf")]}, "finite"),
        ({"angles": []}, "shape"),
        ({"angles": np.zeros((2, 3))}, r"of shape \(2, 3\)"),
        ({"angles": [[0.0], [0.1, 0.2]]}, "finite numbers in rad"),
        ({"angles": ["a"]}, "finite numbers in rad"),
        ({"angles": [1e300]}, "they are in rad"),
        ({"misalignment": (1.0, 0.0, 0.0)}, "must be a Misalignment"),
        ({"pinion": {"tip_relief_um": 5.0}}, "must be a Modification"),
    ],
)
def test_what_a_model_cannot_answer_is_refused(model, arguments, message):
    with pytest.raises(pmor.CaseError, match=message):
        model.sweep(**arguments)


def test_models_and_results_show_themselves_in_one_line(model, full):
    assert repr(model).startswith("<ReducedModel, ")
    assert repr(full).startswith("<FullModel of <Case 'small': 21/21 teeth")
    assert repr(model.sweep([50, 150])).startswith("<SweepResult: 8 angles x 50, 150 N m, STE peak-to-peak ")
    shown = (model, full, model.sweep(), pmor.compare(model, full), model.sweep_conditions(pmor.Assembly(), angles=2))
    assert all(
        "\n" not in repr(thing) and len(repr(thing)) <= LONGEST for thing in (*shown, model.reduced, model.basis)
    )
    assert all("<table>" in thing._repr_html_() for thing in (*shown, model.case))


def test_models_and_results_equal_themselves_alone(model, full):
    """Arrays have no single answer to ==; sets and dictionaries may hold them."""
    swept, comparison = model.sweep(), pmor.compare(model, full)
    built = model.sweep_conditions([pmor.Assembly()], angles=4)
    things = [model, model.basis, full, swept, swept.sweep, swept.stiffness, comparison, built]
    assert all(one == one and one != model.sweep() for one in things)  # noqa: PLR0124
    assert len({*things, *things}) == len(things)
