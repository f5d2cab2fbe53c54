"""A position of a set without a solution: the others are told, and why it is left out."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.line.kernels.several import MOST_SINGLE_STEPS
from pmor.sets.loader import load
from pmor.sets.lost import lost_positions
from pmor.sets.readings import torque_data
from pmor.sets.run import run
from tests.support.set_variants import BASE, teeth
from tests.support.small_sets import SMALL_SET, written_set

FREE = SMALL_SET.replace("torques_Nm = [100.0]", "") + '[supports]\nsun_radial_N_per_mm = "free"\n'
LOST = 2


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    return run(load(written_set(tmp_path_factory.mktemp("set"), FREE)))


def without(solution, loose=-1, steps=5):
    """The solution without one position."""
    found = solution.found._replace(**{name: values.copy() for name, values in solution.found._asdict().items()})
    found.converged[0, LOST], found.loose[0, LOST], found.steps[0, LOST] = False, loose, steps
    found.force[0, LOST], found.movement[0, LOST] = np.nan, np.nan
    return replace(solution, found=found)


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
        (across, 5, "1 of 6 positions did not converge and are left out: sun: nothing holds it across its axis"),
        (-1, MOST_SINGLE_STEPS + 20, "which sections carry was not found"), (-1, 5, "overloads a section"),
    ):  # fmt: skip
        assert words in lost_positions(without(solution, loose, steps), ["300 N m"])[0]
    assert lost_positions(solution, ["300 N m"]) == []


def test_angles_are_rounded_up_until_equal_planets_pass_the_same_positions(tmp_path):
    """17 sun teeth and three planets: those follow each other by thirds of a pitch, and share equally."""
    text = BASE.replace("angles_per_pitch = 6", "angles_per_pitch = 4")
    for old, new in teeth(17, 19, 55):
        text = text.replace(old, new)
    file = load(written_set(tmp_path, text))
    assert (file.sections.sweep.angles_per_pitch, file.angles_per_pitch) == (4, 6)
    found = run(file)
    assert_allclose(found.k_gamma, 1.0, rtol=1e-9)
    assert "[sweep] angles_per_pitch = 4: 6 are solved" in str(found)
