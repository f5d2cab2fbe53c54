"""Axes and teeth out of place in motion: where axes go under a load, laws that repeat after a revolution."""

import json

import numpy as np
import pytest

import pmor
from pmor.app.cli import main
from pmor.case import change_case, parse_case
from pmor.core.errors import CaseError
from pmor.dynamics import law
from pmor.dynamics.force_law import shifted
from pmor.dynamics.force_table import table_error, tabulate
from pmor.dynamics.gear_model import gear_model
from pmor.dynamics.law import alike_cycles, force_law
from pmor.dynamics.moved_axes import assembly_under, displaced, model_error, shift_of
from pmor.dynamics.solution import reduced_of
from pmor.gear.condition import ALIGNED, Assembly, Misalignment
from pmor.gear.modification import Modification
from pmor.lab.slices.run import run_slices
from pmor.pair.model import gear_pair
from pmor_online.mesh_force import mesh_force_of
from tests.support.line_pairs import small_pair
from tests.support.small_case import case_text, case_with

STIFF = {"pinion_bearing_stiffness_N_um": [200.0, 100.0, 400.0], "wheel_bearing_stiffness_N_um": [200.0, 50.0, 400.0],
         "pinion_tilting_stiffness_kNm_rad": [100.0, 100.0]}  # fmt: skip
TORQUE = 100.0
MESH = {"profile_elements": 5, "width_elements": 2}


@pytest.fixture(scope="module")
def case():
    dynamics = {"torques_Nm": [TORQUE], "degrees_of_freedom": 12, "run_cycles": 0} | STIFF
    return case_with(mesh=MESH, contact={"scheme": "line"}, reduction=None, dynamics=dynamics)


def positions(model, **given):
    return np.array([given.get(support.name.replace(" ", "_"), 0.0) for support in model.supports])


def test_axes_count_as_they_do_when_they_are_out_of_place_without_load(case):
    pair = gear_pair(case)
    model, width = gear_model(case, pair), case.pair.face_width_mm
    radius = pair.pinion.base_radius
    apart = displaced(ALIGNED, model, pair, width, positions(model, pinion_y=-0.003, wheel_y=0.004))
    assert apart.centre_distance_um == pytest.approx(7.0)
    # The pinion turns about +x: its end with the larger z goes along -y, away from the wheel.
    tilted = displaced(ALIGNED, model, pair, width, positions(model, pinion_about_x=1e-4 * radius))
    assert tilted.in_plane_um == pytest.approx(1e3 * 1e-4 * width)
    # About +y: it goes along +x, and seen from it the wheel's goes along -x.
    turned = displaced(ALIGNED, model, pair, width, positions(model, pinion_about_y=1e-4 * radius))
    assert turned.out_of_plane_um == pytest.approx(-1e3 * 1e-4 * width)
    both = displaced(Misalignment(in_plane_um=5.0), model, pair, width, positions(model, pinion_z=0.01, wheel_x=0.01))
    assert both == Misalignment(in_plane_um=5.0), "no such motion takes the axes apart or out of parallel"


def test_a_load_pushes_the_axes_apart_by_what_the_bearings_give_way(case):
    pair = gear_pair(case)
    force = 1e3 * TORQUE / pair.pinion.base_radius * np.sin(pair.working_pressure_angle)
    found = assembly_under(case, gear_model(case, pair), pair, TORQUE).misalignment
    assert found.centre_distance_um == pytest.approx(1e3 * (force / 1e5 + force / 5e4))


@pytest.mark.slow
def test_motion_that_leaves_the_axes_where_they_are_leaves_nothing_out(case):
    reduced = small_pair()
    pair = reduced.meshed.pair
    model = gear_model(case, pair)
    still = change_case(case, dynamics={"torques_Nm": [TORQUE]})
    assembly = assembly_under(still, model, pair, TORQUE)
    table = shifted(force_law(still, reduced, assembly=assembly)[0], shift_of(still, pair, assembly.misalignment))
    force = 1e3 * TORQUE / pair.pinion.base_radius
    motion = {"mesh_cycles": np.linspace(0.0, 1.0, 16), "displacement_um": np.full(16, 12.0), "mesh_force_N": [force],
              "bearing_displacement_um": {s.name: np.full(16, -1e3 * s.lever * force / s.stiffness)
                                          for s in model.supports}}  # fmt: skip
    assert model_error(still, model, reduced, table, motion) < 1e-3
    motion["bearing_displacement_um"]["wheel y"] = motion["bearing_displacement_um"]["wheel y"] + 20.0
    assert model_error(still, model, reduced, table, motion) > 5e-3


@pytest.mark.parametrize("key", ["in_plane_um", "out_of_plane_um", "centre_distance_um"])
def test_the_shift_of_displaced_axes_is_that_of_the_mean_force_of_line_loads(key, helical):
    case, reduced = helical
    phases, x, step = 2.0 * np.pi * np.arange(12) / 12, 0.012, 1e-4

    def mean_force(x, **misalignment):
        law = mesh_force_of(reduced, Assembly(Misalignment(**misalignment)))
        return np.mean([law(phase, np.array([x]))[0] for phase in phases])

    stiffness = (mean_force(x + step) - mean_force(x - step)) / (2.0 * step)
    found = (mean_force(x, **{key: 1.0}) - mean_force(x, **{key: -1.0})) / (2.0 * stiffness)
    # The lever is that at the pitch point; load off mid width has another one.
    np.testing.assert_allclose(found, shift_of(case, reduced.meshed.pair, Misalignment(**{key: 1.0})), atol=3e-5)


@pytest.fixture(scope="module")
def helical():
    case = case_with(
        mesh={"profile_elements": 5, "width_elements": 4}, contact={"scheme": "line"}, reduction=None,
        pair={"helix_angle_deg": 20.0}, wheel={"teeth": 33, "bore_radius_mm": 20.0},
    )  # fmt: skip
    return case, reduced_of(case)


# --- a tooth out of its place ----------------------------------------------------------------------------------------

TEETH = 21
# Of the fourth tooth: it stands back, and its neighbours take over its load.
FOURTH = tuple(30.0 if tooth == 3 else 0.0 for tooth in range(TEETH))


def text():
    dynamics = {"torques_Nm": [100.0], "mesh_frequency_ratio": [0.8, 1.2], "run_cycles": 100}
    flank = {"pitch_deviations_um": list(FOURTH)}
    more = {"contact": {"scheme": "line"}, "results": {"root_stress": False}, "pinion.modification": flank}
    return case_text(mesh=MESH, reduction=None, dynamics=dynamics, **more)


@pytest.fixture(scope="module")
def model():
    return pmor.train(parse_case(text(), "small", "small"))


def test_the_law_of_a_revolution_is_solved_where_cycles_differ_and_true_everywhere(model, rng):
    reduced, assembly = model.reduced, Assembly(pinion=Modification(pitch_deviations_um=FOURTH))
    alike = alike_cycles(reduced, assembly)
    assert len(alike) == TEETH
    assert 4 <= max(alike) + 1 < 10, "a tooth is in reach in a few cycles alone"
    forces = mesh_force_of(reduced, assembly)
    table = tabulate(forces, -0.031, 0.06, tolerance=3e-3, alike=alike)
    assert table_error(table, forces, 40, rng).largest < 7e-3
    differ = [forces(2.0 * np.pi * cycle + 0.7, np.array([0.02]))[0] for cycle in range(TEETH)]
    assert np.ptp(differ) > 0.1 * max(differ)


@pytest.mark.slow
def test_motion_with_a_tooth_out_of_its_place_is_that_of_runs(tmp_path, undrawn, monkeypatch):
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
