"""A position of a set without a solution: the others are told, and why it is left out."""

from dataclasses import replace
from types import SimpleNamespace

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.app.machines import run_set as run
from pmor.design import fine
from pmor.design.elements import Elements
from pmor.design.judge import Judge
from pmor.design.loader import load as load_design
from pmor.line.kernels.loads import MOST_SINGLE_STEPS
from pmor.machine.loader import load as load_gearbox
from pmor.machine.output import gearbox_data
from pmor.machine.run import lost_of_load
from pmor.pair.samples import lost_samples, sample_rows
from pmor.rexs.write_set import set_rexs
from pmor.sets.loader import load
from pmor.sets.lost import lost_positions
from pmor.sets.output import set_report
from pmor.sets.readings import set_data, torque_data
from pmor.sets.results_data import set_results
from pmor.sets.solution import solve_on
from pmor.sets.tolerances import solve_samples
from pmor.storage.results_file import write_results_file
from pmor_online.root_cycle import Extremes
from tests.support.set_gearboxes import one_stage, written_reducer
from tests.support.set_variants import BASE, teeth
from tests.support.small_sets import SMALL_DESIGN, SMALL_SET, written_design, written_set

FREE = SMALL_SET.replace("torques_Nm = [100.0]", "") + '[supports]\nsun_radial_N_per_mm = "free"\n'
LOST = 2


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    return run(load(written_set(tmp_path_factory.mktemp("set"), FREE)))


def without(solution, loose=-1, steps=5, lost=LOST, torque=0):
    """The solution without one position, or several, under a torque by its number."""
    found = solution.found._replace(**{name: values.copy() for name, values in solution.found._asdict().items()})
    found.converged[torque, lost], found.loose[torque, lost], found.steps[torque, lost] = False, loose, steps
    found.force[torque, lost], found.movement[torque, lost] = np.nan, np.nan
    return replace(solution, found=found)


def replace_all(sweep):
    """A sweep all of whose positions converged."""
    return SimpleNamespace(converged=sweep.converged | True, overloaded=sweep.overloaded & False)


def test_figures_are_those_of_the_positions_that_are_left(result):
    assert not result.failures
    there = np.delete(np.arange(6), LOST)
    whole, data = result.solution, torque_data(result.file, without(result.solution), 0)
    ste = whole.ste_um[0, there]
    assert_allclose([data["ste_mean_um"], data["ste_peak_to_peak_um"]], [ste.mean(), np.ptp(ste)], rtol=1e-12)
    assert_allclose(data["k_gamma"], 3.0 * whole.planet_share[0, there].mean(axis=0).max(), rtol=1e-12)
    assert_allclose(data["meshes"][0]["force_mean_N"], whole.mesh_force_N[0, there, 0].mean(), rtol=1e-12)
    assert data["planets"][0]["pin_force_max_N"] == whole.pin_force_N[0, there, 0].max()
    assert data["meshes"][0]["k_h_beta"] > 0.99
    assert data["ste_um"][LOST] is None


def test_why_a_position_is_left_out_is_said(result):
    solution = result.solution
    across = int(np.flatnonzero(solution.plan.free[:, 0])[0])
    for loose, steps, words in (
        (across, 5, "1 of 6 positions did not converge and are left out"),
        (across, 5, ": sun: nothing holds it across its axis"),
        (-1, MOST_SINGLE_STEPS + 20, "which sections carry was not found"), (-1, 5, "overloads a section"),
    ):  # fmt: skip
        assert words in lost_positions(without(solution, loose, steps), ["300 N m"])[0]
    assert lost_positions(solution, ["300 N m"]) == []


def test_a_set_as_filed_stays_in_a_design_with_the_positions_that_converged(result, tmp_path, monkeypatch):
    """The sun hangs loose at two positions of eight under the second torque, and at none under the first."""
    text = SMALL_DESIGN.replace("torques_Nm = [300.0]", "torques_Nm = [400.0, 300.0]")
    design = load_design(written_design(tmp_path, text, FREE))
    judge = Judge(Elements(design, train=result.solution.train))
    whole, genuine = judge.verdict(None), Judge.solve
    across = int(np.flatnonzero(result.solution.plan.free[:, 0])[0])

    def loses(judge, built, differentiated=False):
        (state,) = genuine(judge, built)
        return (replace(state, solution=without(state.solution, across, lost=[0, LOST], torque=1)),)

    monkeypatch.setattr(Judge, "solve", loses)
    monkeypatch.setattr(fine, "FEWEST", 8)
    left, said = fine.judged_on_what_is_left(judge, None)
    assert np.isnan(judge.verdict(None).results[1]).all()
    assert_allclose(left.results[0], whole.results[0], rtol=1e-12)
    keys = design.design.results
    known = [keys.index(key) for key in ("peak_to_peak_um", "pressure_MPa", "k_h_beta", "k_gamma")]
    assert_allclose(left.results[1, known], whole.results[1, known], rtol=0.3)
    assert left.results[1, 0] <= whole.results[1, 0]
    (sentence,) = said
    assert sentence.startswith("300 N m: 2 of 8 positions did not converge and are left out")
    assert "sun: nothing holds it across its axis: check [planets]" in sentence


def test_angles_are_rounded_up_until_equal_planets_pass_the_same_positions(tmp_path):
    """17 sun teeth and three planets: those follow each other by thirds of a pitch, and share equally."""
    text = BASE.replace("angles_per_pitch = 6", "angles_per_pitch = 4")
    for old, new in teeth(17, 19, 55):
        text = text.replace(old, new)
    file = load(written_set(tmp_path, text))
    assert (file.sections.sweep.angles_per_pitch, file.angles_per_pitch) == (4, 6)
    found = run(file)
    assert_allclose(found.k_gamma, 1.0, rtol=1e-9)
    (rounded,) = file.rounded
    assert "[sweep] angles_per_pitch = 4: 6 are solved" in rounded
    assert rounded in str(found)
    box = load_gearbox(written_reducer(tmp_path, one_stage(), text))
    assert f"set stage: {rounded}" in gearbox_data(box, (), ())["bounds"]


def test_stress_and_deflection_are_those_of_the_positions_that_are_left(result):
    """A position without a solution is not one without load: of a tooth at its peak the range stays above it."""
    whole, one = result.solution, without(result.solution)
    there = np.delete(np.arange(6), LOST)
    for before, after in zip(whole.root_stress, one.root_stress, strict=True):
        assert_allclose(after.max_principal_MPa[0, there], before.max_principal_MPa[0, there], rtol=1e-12)
        assert (after.cycle.range_MPa[0] <= before.cycle.range_MPa[0] * (1.0 + 1e-12)).all()
        assert (after.cycle.range_MPa[0] > 0.5 * before.cycle.range_MPa[0]).all()
    stress = torque_data(result.file, one, 0)["root_stress"][0]
    assert stress["max_principal_MPa"] == np.nanmax(one.root_stress[0].max_principal_MPa[0])
    assert_allclose(one.ring_deflection.displacement_um, whole.ring_deflection.displacement_um, rtol=1e-12)
    assert 0.0 < one.ring_deflection.most_um[0] <= whole.ring_deflection.most_um[0]


def test_extremes_leave_out_what_is_not_known():
    """Where stresses never fall to 0, a position without a solution must not count as 0."""
    found = Extremes(1)
    for block in ([3.0, np.nan], [np.nan, np.nan], [5.0, 4.0]):
        found.add(np.array(block).reshape(1, 2, 1))
    assert (found.most.item(), found.least.item()) == (5.0, 3.0)


def test_samples_keep_the_positions_that_converged_and_say_so(result, tmp_path, monkeypatch):
    """The second of eight sets lacks a position, the third all of them."""
    sizes = "[tolerances]\npins_tangential_um = 5.0\nsamples = 8\n"
    file, solved = load(written_set(tmp_path, FREE + sizes)), []

    def solve(*its, **more):
        solved.append(solve_on(*its, **more))
        return without(solved[-1], lost={2: [LOST], 3: slice(None)}.get(len(solved), []))

    monkeypatch.setattr("pmor.sets.tolerances.solve_on", solve)
    samples = solve_samples(file, result.solution)
    assert samples.lost[:, 0].tolist() == [0, 1, solved[2].converged.shape[1], *5 * [0]]
    there = np.delete(solved[1].ste_um[0], LOST)
    assert_allclose(samples.figures["ste_peak_to_peak_um"][1, 0], np.ptp(there), rtol=1e-12)
    assert_allclose(samples.figures["k_gamma"][1], without(solved[1]).k_gamma, rtol=1e-12)
    assert np.isnan([samples.figures["ste_peak_to_peak_um"][2, 0], samples.figures["k_gamma"][2, 0]]).all()
    assert (samples.incomplete, samples.missing) == (1, 1)
    some, none = lost_samples(samples, [300.0])
    assert some.startswith("300 N m: 1 of 8 sets within tolerances have positions that did not converge")
    assert none == "300 N m: 1 of 8 sets within tolerances did not converge: left out"
    rows = sample_rows(samples, np.array([300.0]))
    assert [row["lost_positions_300_Nm"] for row in rows] == samples.lost[:, 0].tolist()


@pytest.mark.parametrize(("wide", "why"), [(True, "overloads a section"), (False, "carry was not found")])
def test_a_mesh_of_a_gearbox_says_which_positions_it_lacks_and_why(wide, why):
    converged = np.array([[True, False, True, True]])
    sweep = SimpleNamespace(converged=converged, overloaded=wide & ~converged)
    meshes = [SimpleNamespace(meshing=SimpleNamespace(settings=SimpleNamespace(name=name)), sweep=one)
              for name, one in (("first", replace_all(sweep)), ("second", sweep))]  # fmt: skip
    (said,) = lost_of_load(SimpleNamespace(load=SimpleNamespace(name="drive"), meshes=meshes, sets=()))
    assert said.startswith("load drive, mesh second: 1 of 4 positions did not converge and are left out")
    assert why in said


@pytest.mark.parametrize("lost", [[0], list(range(6))], ids=["the first", "all"])
def test_all_that_is_told_leaves_out_the_positions_that_are_lost(result, tmp_path, lost):
    """Angle 0 alone has the deflection of the ring; a torque without any position has nulls throughout."""
    file, solution, known = result.file, without(result.solution, lost=lost), len(lost) < 6
    failures = tuple(lost_positions(solution, ["300 N m"]))
    page = set_report(file, solution, None, set_data(file, solution, None, failures))
    assert f"{len(lost)} of 6 positions did not converge and are left out, and orders with them" in str(
        replace(result, solution=solution, failures=failures)
    )
    assert set(page.data["ste_harmonics_um"]) == {None}
    assert all((entry["range_MPa"] is not None) == known for entry in page.data["root_stress"])
    assert page.data["ring"]["radial_um"][0] is None
    assert "ring.svg is left out: angle 0 did not converge." in page.blocks
    write_results_file(tmp_path / "results.h5", set_results(file, solution, solution.torque_Nm, page.data))
    with h5py.File(tmp_path / "results.h5") as results:
        assert np.isnan(results["orders/amplitude"][0]).all()
    assert (b"transmission_error_peak_to_peak" in set_rexs(file, solution, "today")) == known


@pytest.mark.slow
def test_all_files_are_written_without_a_position_that_is_lost(result, tmp_path):
    solution = without(result.solution)
    replace(result, solution=solution, failures=tuple(lost_positions(solution, ["300 N m"]))).write(tmp_path / "out")
    assert {"set.rexs", "ring.svg", "set.vtkhdf"} <= {path.name for path in (tmp_path / "out").iterdir()}
