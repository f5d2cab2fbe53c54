"""Root stress of a sweep with line loads: forces, symmetry, tables, files."""

import math
from dataclasses import replace

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.interpolate import CubicSpline

import pmor
from pmor.app.cli import main
from pmor.body.elastic_gear import elastic_gear
from pmor.body.fillet_stress import sector_stress
from pmor.body.volume import sector_displacement
from pmor.case import basis_key, parse_case
from pmor.core.errors import FileFormatError
from pmor.fe.fillet import build_fillet
from pmor.pair.conditions import conditions_of
from pmor.pair.model import mesh_model
from pmor.report.data_files import write_stress_csv
from pmor.results.root_stress import GEARS, SIDES, FilletEnvelope
from pmor.storage.basis_file import read_basis
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.root_stress import (
    NEAR_CONTACT,
    _peaks,
    _spline,
    _stress,
    amplitudes_of_patterns,
    nodal_forces,
    root_stress,
    root_stress_of,
    under_contact,
)
from tests.support.small_case import case_text
from tests.support.stored_files import rows_of, summary_of

TORQUES = [50.0, 100.0]


def line_case(**changes):
    sections = {
        "mesh": {"element": "hex20", "profile_elements": 8, "width_elements": 1, "width": "plane_strain"},
        "contact": {"scheme": "line"},
        "online": {"angles_per_pitch": 40, "torques_Nm": TORQUES},
        "output": {"plots": False, "report": False},
    } | changes
    text = case_text(reduction={"shapes": "line_loads"}, **sections).replace("lodm_profile = 2\n", "")
    return parse_case(text, "root", "root")


@pytest.fixture(scope="module")
def model():
    return pmor.train(line_case())


@pytest.fixture(scope="module")
def stress(model):
    return model.root_stress()


def test_nodal_forces_make_the_torque_and_push_along_the_line_of_action(model):
    reduced, phi = model.reduced, np.array([0.02, 0.1, 0.25])
    conditions = conditions_of(model.case, TORQUES)
    loads = sweep_line_loads(reduced, phi, conditions, recorded=True).states.loads
    pairs = np.arange(loads.pair.min(), loads.pair.max() + 1)
    pinion, wheel = nodal_forces(reduced.lines, phi, conditions[0].misalignment, loads, slice(0, 3), pairs)
    radius = reduced.meshed.pair.pinion.base_radius
    for gear, forces in enumerate((pinion, wheel)):
        whole = forces.reshape(*forces.shape[:3], -1, reduced.components)
        places = reduced.basis.flank_nodes[gear].reshape(-1, 3)
        moment = (places[:, 0] * whole[..., 1] - places[:, 1] * whole[..., 0]).sum(axis=(2, 3))
        # Forces act where flanks meet, a foot of a four-point interpolation away from the nodes.
        assert_allclose(np.abs(moment), np.broadcast_to(1e3 * np.array(TORQUES)[:, None], moment.shape), rtol=1e-5)
        size = np.linalg.norm(whole.sum(axis=3), axis=-1).sum(axis=2)
        assert_allclose(size, np.broadcast_to(1e3 * np.array(TORQUES)[:, None] / radius, size.shape), rtol=1e-6)


def test_stress_at_some_angles_of_a_sweep_is_that_of_these_angles(model):
    conditions, phi = conditions_of(model.case, TORQUES), np.linspace(0.0, 0.28, 8)
    loads = sweep_line_loads(model.reduced, phi, conditions, recorded=True).states.loads
    some = slice(1, None, 3)
    found = root_stress_of(model.reduced, phi[some], conditions, loads.at_angles(some))
    expected = root_stress(model.reduced, phi[some], conditions)
    assert_allclose(found.max_principal_MPa, expected.max_principal_MPa, rtol=1e-9)


@pytest.mark.parametrize("gear", [0, 1])
def test_stress_under_two_loaded_teeth_is_that_of_the_deformed_sector(gear, model):
    """Patterns and neighbours against displacements of whole sectors; the wheel's teeth count the other way round."""
    reduced, phi = model.reduced, np.array([0.05])
    conditions = conditions_of(model.case, [100.0])
    loads = sweep_line_loads(reduced, phi, conditions, recorded=True).states.loads
    pairs = np.unique(loads.pair)
    assert len(pairs) == 2
    forces = nodal_forces(reduced.lines, phi, conditions[0].misalignment, loads, slice(0, 1), pairs)[gear]
    shapes = reduced.basis.root_stress[gear]
    teeth = pairs if gear == 0 else -pairs
    found = _stress(shapes, amplitudes_of_patterns(shapes, forces, teeth, teeth, 21)[0, 0])
    mesh, blank = mesh_model(model.case).pinion, model.case.pair.pinion
    elastic = 1e3 * blank.youngs_modulus_GPa, blank.poisson_ratio
    body = elastic_gear(mesh, *elastic, "hex20", 1, True)
    _, both = sector_stress(build_fillet(reduced.meshed.pair.pinion, mesh), mesh, *elastic)
    functions = np.concatenate([side.over(np.arange(3 * len(mesh.nodes))) for side in both])
    in_space = np.zeros((2, mesh.flank.size, 3))
    in_space[:, :, :2] = forces[0, 0].reshape(2, -1, 2)
    for pair, tooth in enumerate(teeth):
        moved = sector_displacement(body, int(tooth), teeth, in_space.reshape(2, -1, 1))
        expected = (functions @ moved.ravel()).reshape(found[pair].shape)
        # Patterns are cut off at 1e-4; a neighbour on the wrong side is 3 %.
        assert_allclose(found[pair], expected, rtol=0.0, atol=2e-3 * np.abs(expected).max())


def test_the_largest_stress_is_near_the_nominal_one_and_where_one_tooth_carries_alone(stress, model):
    """15 % is what FE and ISO 6336-3 may differ by; here -4 %."""
    found = stress.largest(1, 0)
    assert_allclose(found.max_principal_MPa, 89.1, rtol=0.15)
    assert found.side == "tension"
    # The largest lies between points: a parabola's, measured 0.2 % above theirs.
    assert_allclose(found.max_principal_MPa, stress.envelope[0].max_principal_MPa[1].max(), rtol=4e-3)
    share = model.sweep().pair_share[1, int(np.argmin(np.abs(stress.phi_rad - found.phi_rad)))]
    assert share.max() > 0.99


def test_points_near_a_line_of_contact_do_not_count(model):
    """Where contact begins at the foot of the pinion, the fillet below it feels the load itself."""
    reduced, pair = model.reduced, model.reduced.meshed.pair
    phi, conditions = np.array([pair.roll_position_range[0]]), conditions_of(model.case, [100.0])
    loads = sweep_line_loads(reduced, phi, conditions, recorded=True).states.loads
    pairs = np.unique(loads.pair)
    shapes, reach = reduced.basis.root_stress[0], NEAR_CONTACT * model.case.pair.module_mm
    hidden = under_contact(reduced.lines, shapes, loads, slice(0, 1), pairs, 0)[0, 0, :, :, 0]
    for number, index in enumerate(pairs):
        place = pair.pinion.flank_section(loads.roll_rad[loads.pair == index][0, 0])
        away = np.linalg.norm(shapes.section - place, axis=1)
        # Distances along the outline, not across.
        assert hidden[number][away < 0.9 * reach].all()
        assert not hidden[number][away > reach].any()
    assert hidden.any()
    assert not hidden.all(axis=1).any()
    whole = model.root_stress([100.0], phi)
    assert whole.radius_mm[0, 0, 0, list(pairs).index(0), 0] < np.linalg.norm(shapes.section[hidden.any(axis=0)][-1])


def test_points_that_do_not_count_never_raise_the_largest_stress(stress, model, monkeypatch):
    """A parabola through a point that was left out overshot by up to 10 %: teeth of a saw over the cycle."""
    monkeypatch.setattr(
        "pmor_online.root_stress.under_contact", lambda *given: np.zeros_like(under_contact(*given), dtype=bool)
    )
    whole = model.root_stress()
    counted = np.isfinite(stress.max_principal_MPa)
    assert (whole.max_principal_MPa[counted] > stress.max_principal_MPa[counted]).any(), "some points are left out"
    assert (stress.max_principal_MPa[counted] <= (1.0 + 1e-12) * whole.max_principal_MPa[counted]).all()


def test_the_largest_stress_is_found_between_columns_wherever_it_is(model):
    """A hill as wide as a line of contact makes it moves over the face; columns alone see it rise and fall by 5 %."""
    shapes = replace(model.basis.root_stress[0], z=np.linspace(-15.0, 15.0, 9))
    arc = FilletEnvelope(shapes.section, shapes.z, *2 * (np.zeros(0),)).arc_mm
    middle = np.linspace(-9.0, 9.0, 50)
    over = np.exp(-(((shapes.z - middle[:, None]) / 8.0) ** 2))
    along = 1.0 - ((arc - arc.mean()) / np.ptp(arc)) ** 2
    values = np.repeat((100.0 * over[:, None] * along[:, None])[:, None], 2, axis=1)
    weights, place, z = _peaks(shapes, values)
    peak = (weights * values).sum(axis=(2, 3))
    assert_allclose(peak, 100.0, rtol=0.01)
    assert_allclose(z, middle[:, None] * [1.0, 1.0], atol=0.4)
    assert_allclose(place, arc.mean(), rtol=1e-9)
    assert np.ptp(values.max(axis=(2, 3))) > 4.0
    assert_allclose((weights * shapes.z).sum(axis=(2, 3)), z, rtol=1e-9, atol=1e-9)


def test_the_table_has_a_line_for_each_side_of_each_loaded_tooth(stress, tmp_path):
    write_stress_csv(tmp_path / "stress.csv", stress)
    rows = rows_of(tmp_path / "stress.csv")
    assert " ".join(rows[0]) == ("phi_rad torque_Nm gear tooth side max_principal_MPa von_mises_MPa radius_mm z_mm")
    assert len(rows) == np.isfinite(stress.max_principal_MPa).sum()
    assert {row["gear"] for row in rows} == set(GEARS)
    assert {row["side"] for row in rows} == set(SIDES)
    largest = max((row for row in rows if row["torque_Nm"] == "100.0"), key=lambda row: float(row["max_principal_MPa"]))
    found = max((stress.largest(1, gear) for gear in range(2)), key=lambda one: one.max_principal_MPa)
    assert float(largest["max_principal_MPa"]) == found.max_principal_MPa
    assert float(largest["radius_mm"]) == found.radius_mm


def test_a_saved_basis_gives_the_same_stress(stress, model, tmp_path):
    model.save(tmp_path / "basis.h5")
    again = pmor.load_model(tmp_path / "basis.h5").root_stress()
    assert np.array_equal(again.max_principal_MPa, stress.max_principal_MPa, equal_nan=True)


@pytest.mark.parametrize(
    ("name", "words"),
    [("section", "along its fillet"), ("z", "along its face"), ("pattern", "apart from each other")],
)
def test_a_basis_with_a_changed_root_stress_is_refused(name, words, model, tmp_path, monkeypatch):
    shapes = model.basis.root_stress[0]
    changed = replace(shapes, **{name: getattr(shapes, name) + np.linspace(0.0, 1.0, len(getattr(shapes, name)))[
        (slice(None),) + (None,) * (getattr(shapes, name).ndim - 1)]})  # fmt: skip
    other = replace(model, basis=replace(model.basis, root_stress=(changed, changed)))
    other.save(tmp_path / "basis.h5")
    with pytest.raises(FileFormatError, match=words):
        read_basis(tmp_path / "basis.h5")


def test_a_case_that_wants_none_has_none(tmp_path):
    case = line_case(results={"root_stress": False})
    assert basis_key(case) != basis_key(line_case())
    model = pmor.train(case)
    assert model.basis.root_stress is None
    model.save(tmp_path / "basis.h5")
    with h5py.File(tmp_path / "basis.h5") as file:
        assert "root_stress" not in file
    with pytest.raises(pmor.CaseError, match="root_stress=True"):
        pmor.load_model(tmp_path / "basis.h5").root_stress()


def test_online_writes_table_summary_and_pictures(model, tmp_path, undrawn, capsys):
    model.save(tmp_path / "basis.h5")
    case = tmp_path / "root.toml"
    case.write_text(line_case(output={"plots": True, "report": True}).text)
    assert main(["online", str(tmp_path / "basis.h5"), "--case", str(case), "-o", str(tmp_path / "out")]) == 0
    out = tmp_path / "out"
    assert all((out / name).exists() for name in ("stress.csv", "root_stress.svg", "root_stress_cycle.svg"))
    found = summary_of(out)
    assert len(found["root_stress_max_MPa"]) == 2
    assert_allclose(found["root_stress_iso6336_MPa"], 89.09, atol=0.01)
    assert math.isclose(found["root_stress_radius_mm"][0], 37.6, abs_tol=0.1)
    assert "root stress, pinion" in capsys.readouterr().out


@pytest.mark.parametrize("count", [2, 3, 4, 5, 9, 33])
def test_the_spline_between_columns_is_scipys(count):
    x, places = np.linspace(-10.0, 30.0, count), np.linspace(-10.0, 30.0, 97)
    expected = CubicSpline(x, np.eye(count))(places)
    assert_allclose(_spline(x, places), expected, rtol=0, atol=1e-10)  # round-off of 33 truncated powers
