import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor.penalty.solve
import pmor.report.run_page
from pmor.app.skipped import scene, skipped
from pmor.gear.condition import Condition
from pmor.report.page import Picture, provenance
from pmor.report.run_page import page_files, run_blocks, run_pictures, write_pages
from pmor.report.screen import result_text
from pmor.report.summary import accuracy_rows, summary, summary_rows, write_results
from pmor.report.sweep_figures import error_figure, few_torques
from pmor.results.sweep import peak_to_peak_um, ste_mean_um
from pmor.work.online import run_online
from pmor_online.compare import Comparison
from pmor_online.contact_pattern import contact_patterns
from pmor_online.model import reduced_pair, unseen_angles
from tests.support.stored_files import rows_of, summary_of

FULL_FE_KEYS = ("rom_vs_full_ste_max_rel", "rom_vs_full_ste_rms_rel", "full_ms_per_position")


@pytest.fixture(scope="module")
def compared(small_model, small_basis, small_basis_path):
    """Reduced sweep at two torques, compared with full FE."""
    case = small_model[0]
    case = replace(
        case,
        online=replace(case.online, torques_Nm=(60.0, 100.0), angles_per_pitch=8),
        compare=replace(case.compare, angles=2),
    )
    pair = reduced_pair(replace(small_basis, case=case))
    return run_online(pair, small_basis_path, small_model[1])


@pytest.fixture(scope="module")
def alone(compared):
    """The same without full FE."""
    return replace(compared, comparison=None)


def page_only(result):
    """The result of a case that asks for no files of pictures."""
    basis = result.reduced.basis
    case = replace(basis.case, output=replace(basis.case.output, plots=False))
    return replace(result, reduced=replace(result.reduced, basis=replace(basis, case=case)))


def failing(sweep, where):
    """The sweep with positions that did not converge."""
    ste, converged = sweep.ste_um.copy(), sweep.converged.copy()
    ste[where], converged[where] = np.nan, False
    return replace(sweep, ste_um=ste, converged=converged)


def with_failures(result, where):
    """The result with positions of the reduced sweep that did not converge."""
    return replace(result, sweep=failing(result.sweep, where))


def with_full_failures(result, where):
    """The result with positions of full FE that did not converge."""
    comparison = result.comparison
    return replace(result, comparison=Comparison(comparison.reduced, failing(comparison.full, where)))


# --- the sweep and its summary ---------------------------------------------------------------------------------------


def test_sweep_covers_the_angles_and_torques_of_the_case(compared):
    sweep = compared.sweep
    assert compared.failures == ()
    assert sweep.converged.all()
    assert_allclose(sweep.phi_rad, 2.0 * np.pi / 21 * np.arange(8) / 8, rtol=0.0, atol=1e-15)  # a few ulp
    assert_allclose(sweep.torque_Nm, [60.0, 100.0])
    assert_allclose(sweep.pair_share.sum(axis=2), 1.0, rtol=1e-6)  # torque residual of the solver
    assert (sweep.ste_um[1] > sweep.ste_um[0]).all(), "more torque, more deflection"
    assert compared.nominal == 1


def test_the_summary_is_that_of_sweep_and_comparison(compared, small_basis_path):
    s, sweep = summary(compared), compared.sweep
    assert (s["case"], s["n_profile"], s["lodm"], s["n_angles"], s["torque_Nm"]) == ("small", 5, 2, 8, 100.0)
    assert s["ste_mean_um"] == ste_mean_um(sweep)[1]
    assert s["ste_peak_to_peak_um"] == peak_to_peak_um(sweep)[1]
    assert s["rom_vs_full_ste_max_rel"] == np.abs(compared.comparison.relative_error).max()
    assert 0.0 < s["rom_vs_full_ste_rms_rel"] <= s["rom_vs_full_ste_max_rel"] < 0.1
    assert s["basis_mib"] == small_basis_path.stat().st_size / 2**20
    assert s["offline_s"] == compared.reduced.basis.training.seconds
    assert s["n_positions_failed"] == 0
    assert s["full_ms_per_position"] == 1e3 * compared.comparison.full.seconds / 4


def test_without_full_fe_its_keys_are_null(alone, tmp_path):
    write_results(alone, tmp_path)
    found = summary_of(tmp_path)
    assert all(found[key] is None for key in FULL_FE_KEYS)
    assert not any("full" in label for label, *_ in accuracy_rows(alone))


def test_a_figure_that_is_missing_says_what_it_takes(alone):
    case = alone.reduced.basis.case
    case = replace(case, online=replace(case.online, torques_Nm=(case.torque_Nm,)))
    reduced = replace(alone.reduced, basis=replace(alone.reduced.basis, case=case))
    one = replace(alone, reduced=reduced, sweep=few_torques(alone.sweep, 1))
    rows = {label: (value, unit, note) for label, value, unit, note in (*summary_rows(one), *accuracy_rows(one))}
    noise = "numerical noise of the curve"
    assert rows[noise] == (None, "", "needs 8 angles with one pair in contact")
    assert " um" not in next(line for line in result_text(one).splitlines() if noise in line)
    assert "torque^" in next(note for label, *_, note in summary_rows(alone) if label == "STE mean")
    assert "torque^" not in rows["STE mean"][2], "needs a second torque"


def test_each_mean_says_over_which_angles(compared):
    mean = next(note for label, _, _, note in summary_rows(compared) if label == "STE mean")
    assert f"over {len(compared.sweep.phi_rad)} angles of a pitch" in mean
    titles = {getattr(block, "title", ""): block for block in run_blocks(compared, [])}
    table = titles["Reduced against full FE at each torque"]
    assert f"over {compared.comparison.full.ste_um.shape[1]} unseen angles" in table.note


def test_table_reads_back_as_the_sweep(compared, tmp_path):
    write_results(compared, tmp_path)
    rows = rows_of(tmp_path / "ste.csv")
    sweep = compared.sweep
    assert len(rows) == sweep.ste_um.size
    assert list(rows[0])[:5] == ["phi_rad", "torque_Nm", "ste_um", "ste_error_estimate_um", "converged"]
    assert np.array_equal(np.array([float(r["ste_error_estimate_um"]) for r in rows]), sweep.ste_error_um.ravel())
    assert np.array_equal(np.array([float(r["ste_um"]) for r in rows]), sweep.ste_um.ravel())
    assert np.array_equal(np.array([float(r["phi_rad"]) for r in rows]), np.tile(sweep.phi_rad, 2))
    assert all(r["converged"] == "1" for r in rows)


def test_provenance_names_versions_and_the_case(compared):
    *_, found = provenance(compared.reduced.basis.case)
    rows = dict(found.rows)
    assert {"date", "pmor", "python", "cpu"} <= set(rows)
    assert len(rows["case file, SHA-256"]) == 64


# --- positions that failed -------------------------------------------------------------------------------------------


def test_a_failed_position_is_named_and_stays_empty(compared, tmp_path):
    failed = with_failures(compared, (1, 3))
    phi = failed.sweep.phi_rad[3]
    line = f"reduced model: phi = {phi:.6g} rad, torque = 100 N m did not converge"
    assert failed.failures == (line,)
    assert f"  ! {line}" in result_text(failed).splitlines()
    write_results(failed, tmp_path)
    rows = [r for r in rows_of(tmp_path / "ste.csv") if r["converged"] == "0"]
    assert [(r["ste_um"], float(r["phi_rad"]), float(r["torque_Nm"])) for r in rows] == [("", phi, 100.0)]
    found = summary_of(tmp_path)
    assert found["n_positions_failed"] == 1
    assert math.isfinite(found["ste_mean_um"])


def test_a_torque_at_which_nothing_converges_gives_nulls_not_numbers(compared, tmp_path):
    failed = with_failures(compared, np.s_[1, :])
    write_results(failed, tmp_path)
    found = summary_of(tmp_path)
    assert found["ste_mean_um"] is None
    assert found["ste_peak_to_peak_um"] is None
    assert found["ste_ripple_um"] is None
    write_pages(page_only(failed), None, tmp_path)
    assert "did not converge" in (tmp_path / "report.html").read_text()


@pytest.mark.slow
def test_full_fe_that_fails_leaves_gaps_in_the_comparison(compared, tmp_path):
    gap = with_full_failures(compared, (0, 1))
    error = compared.comparison.relative_error
    assert gap.comparison.max_relative_error == np.abs(np.delete(error.ravel(), 1)).max()
    write_pages(page_only(gap), None, tmp_path)


@pytest.mark.parametrize("rows", [[0], [0, 1]], ids=["one torque", "all"])
def test_full_fe_that_fails_throughout_is_reported_all_the_same(rows, compared, tmp_path, monkeypatch):
    full, result = compared.comparison.full, with_full_failures(compared, rows)
    write_results(result, tmp_path)
    found = summary_of(tmp_path)
    nothing = len(rows) == 2
    assert (found["rom_vs_full_ste_max_rel"] is None) == nothing
    assert (found["rom_vs_full_ste_rms_rel"] is None) == nothing
    assert result_text(result)
    drawn = error_figure(full.phi_rad, full.torque_Nm, result.comparison.relative_error)
    monkeypatch.setattr(pmor.report.run_page, "run_pictures", lambda *_: [Picture("error.svg", "Error.", drawn)])
    write_pages(result, None, tmp_path)
    page = (tmp_path / "report.html").read_text()
    assert "Reduced against full FE" in page
    assert "nan" not in page.split("</style>")[1].split("<h2>Provenance")[0]


# --- angles ----------------------------------------------------------------------------------------------------------


class FewDraws:
    """A generator that fails the test instead of running for ever."""

    def __init__(self, seed):
        self._rng = np.random.Generator(np.random.PCG64(seed))
        self._left = 10_000

    def random(self, *arguments):
        self._left -= 1
        assert self._left > 0, "no end in sight"
        return self._rng.random(*arguments)


@pytest.mark.parametrize(("count", "trained"), [(48, 40), (5, 8), (40, 8)])
def test_unseen_angles_spread_over_the_pitch_and_avoid_the_trained_ones(count, trained):
    pitch, start = 0.3, -0.123
    angles = unseen_angles(start, pitch, count, trained)
    assert np.array_equal(np.floor(angles / pitch * count).astype(int), np.arange(count)), "one in each part"
    steps = (angles - start) / pitch * trained
    assert np.abs(steps - np.round(steps)).min() > 0.05
    assert np.array_equal(angles, unseen_angles(start, pitch, count, trained)), "the draw is the same every time"


@pytest.mark.parametrize(("count", "trained"), [(100, 7), (40, 4), (2000, 4)])
def test_more_comparisons_than_the_training_leaves_room_for_end_all_the_same(count, trained, monkeypatch):
    """Parts of the pitch that are narrower than what is kept clear around a training angle."""
    monkeypatch.setattr(np.random, "default_rng", FewDraws)
    pitch = 0.3
    for start in (0.0, -0.123):
        angles = unseen_angles(start, pitch, count, trained)
        assert len(angles) == count
        steps = (angles - start) / pitch * trained
        assert np.abs(steps - np.round(steps)).min() > 1e-6, "never a training angle itself"
        assert ((angles >= 0.0) & (angles < pitch)).all()


# --- pictures and pages ----------------------------------------------------------------------------------------------


def file_names(result, mesh=None):
    return [picture.file_name for picture in run_pictures(result, mesh)]


def test_contact_pattern_carries_the_load_over_the_whole_face(compared):
    reduced, torque = compared.reduced, 100e3
    patterns = contact_patterns(reduced, 0.0, Condition(torque=torque))
    assert patterns
    for pattern in patterns:
        assert pattern.pressure.shape == (len(pattern.roll_angle) - 1, len(pattern.width) - 1)
        assert (pattern.pressure >= 0.0).all()
        assert_allclose(pattern.width[[0, -1]], [-10.0, 10.0], rtol=0.0, atol=1e-12)
    force = sum(pattern.force.sum() for pattern in patterns)
    # The cells hold all forces; but normals of patches through five elements are not those of involutes: 1.4 % here.
    assert_allclose(force, torque / reduced.meshed.pair.pinion.base_radius, rtol=0.02)


@pytest.mark.parametrize(("plots", "report"), [(False, False), (True, False), (False, True)])
def test_switches_leave_out_what_is_not_wanted(plots, report, alone, tmp_path, undrawn):
    basis = alone.reduced.basis
    output = replace(basis.case.output, plots=plots, report=report)
    case = replace(basis.case, output=output)
    result = replace(alone, reduced=replace(alone.reduced, basis=replace(basis, case=case)))
    write_pages(result, None, tmp_path)
    found = {path.suffix for path in tmp_path.iterdir()}
    assert found == ({".svg"} if plots else set()) | ({".html"} if report else set())
    announced = {item.what for item in skipped(scene(case))}
    assert ("all pictures" in announced) == (not found)
    assert ("picture files" in announced) == (report and not plots)
    assert ("the report page" in announced) == (plots and not report)


def test_pictures_come_in_the_formats_that_the_case_asks_for(alone, tmp_path, undrawn):
    basis = alone.reduced.basis
    case = replace(basis.case, output=replace(basis.case.output, format=("svg", "pdf")))
    write_pages(replace(alone, reduced=replace(alone.reduced, basis=replace(basis, case=case))), None, tmp_path)
    names = [name.removesuffix(".svg") for name in file_names(alone)]
    assert {path.name for path in tmp_path.iterdir()} == {"report.html"} | {
        f"{name}.{kind}" for name in names for kind in ("svg", "pdf")
    }
    assert {path.name for path in tmp_path.iterdir()} <= set(page_files(case)), "the folder knows them as its own"
    page = (tmp_path / "report.html").read_text()
    assert page.count('<div class="panels"') == len(names)
    assert "<img" not in page


def test_report_is_one_file_with_the_figures_of_the_trade(compared, small_model, tmp_path):
    write_pages(page_only(compared), small_model[1].mesh.pinion, tmp_path)
    page = (tmp_path / "report.html").read_text()
    assert page.count('<div class="panels"') == 6
    assert "ISO 6336" in page
    assert "Reduced against full FE" in page
    assert 'src="http' not in page
