"""A pair with a tooth out of its place in motion: a law that repeats after a revolution, and runs on it."""

import json

import numpy as np
import pytest

import pmor
from pmor.app.cli import main
from pmor.case import parse_case
from pmor.core.errors import CaseError
from pmor.dynamics import law
from pmor.dynamics.force_table import table_error, tabulate
from pmor.dynamics.law import alike_cycles
from pmor.gear.condition import Assembly
from pmor.gear.modification import Modification
from pmor.lab.slices.run import run_slices
from pmor_online.mesh_force import mesh_force_of
from tests.support.small_case import case_text

MESH = {"profile_elements": 5, "width_elements": 2}
TEETH = 21
# Of the fourth tooth: it stands back, and its neighbours take over its load.
FOURTH = tuple(30.0 if tooth == 3 else 0.0 for tooth in range(TEETH))


def text(wheel=None, **dynamics):
    asked = {"torques_Nm": [100.0], "mesh_frequency_ratio": [0.8, 1.2], "run_cycles": 100} | dynamics
    case = case_text(mesh=MESH, contact={"scheme": "line"}, reduction=None, dynamics=asked)
    flanks = f"\n[pinion.modification]\npitch_deviations_um = {list(FOURTH)}\n"
    return case + flanks + (f"\n[wheel.modification]\npitch_deviations_um = {list(wheel)}\n" if wheel else "")


@pytest.fixture(scope="module")
def model():
    return pmor.train(parse_case(text(), "small", "small"))


def test_the_law_of_a_revolution_is_solved_where_cycles_differ_and_true_everywhere(model, rng):
    reduced, assembly = model.reduced, Assembly(pinion=Modification(pitch_deviations_um=FOURTH))
    alike = alike_cycles(reduced.meshed, assembly)
    assert len(alike) == TEETH
    assert 4 <= max(alike) + 1 < 10, "a tooth is in reach in a few cycles alone"
    forces = mesh_force_of(reduced, assembly)
    table = tabulate(forces, -0.031, 0.06, tolerance=3e-3, alike=alike)
    assert table_error(table, forces, 40, rng).largest < 7e-3
    differ = [forces(2.0 * np.pi * cycle + 0.7, np.array([0.02]))[0] for cycle in range(TEETH)]
    assert np.ptp(differ) > 0.1 * max(differ)


def test_motion_with_a_tooth_out_of_its_place_is_that_of_runs(tmp_path, monkeypatch):
    monkeypatch.setattr(law, "TOLERANCE", 2e-3)
    monkeypatch.setattr(law, "STATIC_TOLERANCE", 1e-2)
    monkeypatch.setattr(law, "CHECKED", 10)
    path, out = tmp_path / "small.toml", tmp_path / "out"
    path.write_text(text())
    assert main(["dynamics", str(path), "--out", str(out)]) == 0
    data = json.loads((out / "dynamics.json").read_text())
    assert f"the mesh repeats after {TEETH} cycles" in (out / "report.html").read_text()
    assert data["repeats_after_mesh_cycles"] == TEETH
    response = data["responses"][0]
    assert response["branches"] == []
    assert not (out / "contact.png").exists(), "of branches alone"
    assert response["lost"] == []
    sizes = [point["dte_rms_um"] for point in response["run_up"]]
    assert np.isfinite(sizes).all()
    assert max(sizes) > 2.0 * min(sizes), "once a revolution a tooth stands back"


def test_deviations_of_which_no_law_is_made_are_refused(model):
    with pytest.raises(CaseError, match="backs of teeth.*leave one out"):
        model.dynamics(backlash_um=100.0)
    with pytest.raises(CaseError, match="no branches to compare: leave them out"):
        run_slices(model.case, reduced=model.reduced)
