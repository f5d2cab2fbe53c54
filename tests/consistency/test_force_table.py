"""The force law of a pair in a table, the pair's motion on it, and axes and teeth out of place in motion."""

import json
from functools import cache

import numpy as np
import pytest

import pmor
from pmor.app.cli import main
from pmor.case import change_case, parse_case
from pmor.core.errors import CaseError
from pmor.dynamics import law
from pmor.dynamics.force_law import load_limit, mean_stiffness, shifted, static_displacement
from pmor.dynamics.force_table import Watched, table_error, tabulate
from pmor.dynamics.gear_model import gear_model
from pmor.dynamics.harmonic_balance import Balance, rest, rms, solve_at
from pmor.dynamics.integration import integrate
from pmor.dynamics.law import alike_cycles, force_law
from pmor.dynamics.moved_axes import assembly_under, displaced, model_error, shift_of
from pmor.dynamics.solution import reduced_of
from pmor.gear.condition import ALIGNED, PLAIN, Assembly, Misalignment, at_torques
from pmor.gear.modification import Modification
from pmor.lab.slices.run import run_slices
from pmor.pair.model import gear_pair
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.mesh_force import LineLoadLaw, mesh_force_of, overload_of, place_phases
from tests.support.line_pairs import models, small_pair
from tests.support.motion import along_line_of_action
from tests.support.small_case import case_text, case_with


@cache
def small_table():
    return tabulate(mesh_force_of(small_pair(), PLAIN), -0.001, 0.05)


def test_a_table_is_its_force_law_within_the_error_that_it_states(rng):
    found = table_error(small_table(), mesh_force_of(small_pair(), PLAIN), 25, rng)
    assert found.rms < 2e-5
    assert found.largest < 1e-4  # asked for; 5e-5 at the places between values that the table was made by


def test_the_force_law_at_the_advance_under_a_torque_is_that_torque():
    reduced, torque = small_pair(), 1e5
    phi = np.array([0.0, 0.1, 0.25])
    sweep = sweep_line_loads(reduced, phi, at_torques([torque]))
    pair, force = reduced.meshed.pair, mesh_force_of(reduced)
    for angle, ste_um in zip(phi, sweep.ste_um[0], strict=True):
        found = force(2.0 * np.pi * angle / pair.pitch, 1e-3 * ste_um * np.ones(1))
        np.testing.assert_allclose(pair.pinion.base_radius * found, torque, rtol=1e-8)


@pytest.mark.slow
def test_slow_motion_of_a_pair_is_its_static_transmission_error():
    """Moved so slowly, the pair is at rest under its torque at each phase, where the torque-driven solution has it."""
    reduced, torque = small_pair(), 1e5
    radius, pitch = reduced.meshed.pair.pinion.base_radius, reduced.meshed.pair.pitch
    load, mass = torque / radius, 1e-3
    watched = Watched(load, 3e-5 * 3e-3 * 1e5)  # 3e-5 of a transmission error of 3 um, over a stiffness of 1e5 N/mm
    table = tabulate(mesh_force_of(reduced), -0.001, 0.05, [watched], 1e-3)
    critical = 2.0 * np.sqrt(mean_stiffness(table, load, (-0.001, 0.05)) * mass)
    oscillator, speed = along_line_of_action(mass, 0.5 * critical, load), 1e-6 * critical / mass
    start = np.array([static_displacement(table, load, np.zeros(1), (-0.001, 0.05))[0], 0.0])
    moving = integrate(oscillator, table, start, (speed, speed), 1)
    static = 1e-3 * sweep_line_loads(reduced, moving.phase / (2.0 * np.pi) * pitch, at_torques([torque])).ste_um[0]
    np.testing.assert_allclose(moving.displacement, static, atol=1e-4 * np.ptp(static))


def test_flanks_that_just_touch_carry_nothing_to_the_last_digit():
    """A gap of round-off has no sign: sections do not begin and let go over it without end."""
    pair = models("helical")[1].lines
    assembly = Assembly(Misalignment(out_of_plane_um=900.0))
    placed = place_phases(pair, np.linspace(0.0, 2.0 * np.pi, 512, endpoint=False), assembly)
    touch = (placed.lines.gap / -placed.lines.lever).min(axis=1)
    for places in range(-1, 3):
        found = placed.solve((touch + places * np.spacing(touch))[None], True, placed.deviation(assembly))
        assert found.converged.all()
        assert found.force.max() < 1e-10


def test_the_law_without_a_table_is_that_of_the_sweep_whatever_it_starts_from(rng):
    reduced = small_pair()
    law, sweep = LineLoadLaw(reduced, PLAIN, -0.001, 0.05), mesh_force_of(reduced)
    phase = rng.uniform(-20.0, 20.0, 40)
    for _ in range(3):  # the second and third time from the forces of the time before
        x = rng.uniform(-0.005, 0.05, 40)
        force, slope = law.forces(phase, x)
        exact = np.array([sweep(p, np.array([d]))[0] for p, d in zip(phase, x, strict=True)])
        np.testing.assert_allclose(force, exact, rtol=1e-9, atol=1e-9)  # Newton ends at 3e-6, and is quadratic
        ahead, behind = (law.forces(phase, x + step)[0] for step in (1e-8, -1e-8))
        np.testing.assert_allclose(slope, (ahead - behind) / 2e-8, rtol=1e-3, atol=1.0)  # a section may begin between
    assert np.isnan(law.forces(phase, np.full(40, 0.051))[0]).all()
    backed = LineLoadLaw(reduced, PLAIN, -0.001, 0.05, backlash=0.1)
    np.testing.assert_allclose(backed.forces(-phase, -0.1 - x)[0], -force, rtol=1e-9, atol=1e-9)


def test_the_limit_of_a_law_is_where_line_loads_overload_a_section(rng):
    """Coast flanks mirror the drive flanks; under small displacements no section is overloaded at all."""
    reduced, backlash = small_pair(), 0.3
    table = small_table()._replace(high=1.5, backlash=backlash)
    limit, overloaded = load_limit(reduced, PLAIN, table), overload_of(reduced)
    phases = 2.0 * np.pi * (rng.integers(0, 64, 20) / 64.0 + rng.integers(-3, 3, 20))
    for phase in phases:
        edge = float(limit.displacement[round(phase * 64 / (2.0 * np.pi)) % 64])
        assert 0.7 < edge < 1.0
        around = edge + np.array([-2e-3, 2e-3])
        assert overloaded(phase, around).tolist() == [False, True]
        assert limit.exceeded(np.full(2, phase), around).tolist() == [False, True]
        assert limit.exceeded(np.full(2, -phase), -around - backlash).tolist() == [False, True]
    assert np.isinf(load_limit(reduced, PLAIN, small_table()).displacement).all()
    moved = limit.shifted(0.01)
    assert moved.exceeded(np.zeros(1), np.array([limit.displacement[0] + 0.009])).tolist() == [False]


def test_harmonic_balance_on_line_loads_is_that_on_their_table():
    reduced, table = small_pair(), small_table()
    law = LineLoadLaw(reduced, PLAIN, table.low, table.high)
    load, mass = 1e5 / reduced.meshed.pair.pinion.base_radius, 1e-3
    stiffness = mean_stiffness(table, load, (table.low, table.high))
    oscillator = along_line_of_action(mass, 0.1 * np.sqrt(stiffness * mass), load)
    for ratio in (0.5, 0.8, 1.2):
        one, two = (Balance(oscillator, which, cycles=1, harmonics=20) for which in (table, law))
        found = [solve_at(b, ratio * np.sqrt(stiffness / mass), rest(b)) for b in (one, two)]
        # The table: 5e-5 of a force four times the load.
        np.testing.assert_allclose(rms(found[0]), rms(found[1]), rtol=2e-4)


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
    assert not (out / "contact.svg").exists(), "of branches alone"
    assert response["lost"] == []
    sizes = [point["dte_rms_um"] for point in response["run_up"]]
    assert np.isfinite(sizes).all()
    assert max(sizes) > 2.0 * min(sizes), "once a revolution a tooth stands back"


def test_deviations_of_which_no_law_is_made_are_refused(model):
    with pytest.raises(CaseError, match="coast flanks.*leave one out"):
        model.dynamics(backlash_um=100.0)
    with pytest.raises(CaseError, match="no branches to compare: leave out"):
        run_slices(model.case, reduced=model.reduced)
