"""Hubs that give way under line contact, equation (A): against moved axes, rigid hubs, and the whole machine."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.case import change_case, parse_case
from pmor.core.errors import ConvergenceError
from pmor.gear.condition import ALIGNED, Assembly, Misalignment, at_torques
from pmor.gear.modification import Modification
from pmor.line.hubs import Hubs, hub_rows
from pmor.machine.coupled import solve_load
from pmor.machine.fit import fit_meshes
from pmor.machine.run import with_rigid_supports
from pmor.pair.model import elastic_model, mesh_model
from pmor.results.load_distribution import face_load_factor, line_states
from pmor_offline.train import train
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.model import keeping_sections, on_hubs, reduced_pair, with_flanks
from pmor_online.root_stress import root_stress
from tests.support.gearboxes import FVA_CASE, drive, fva_box

TORQUE = 1e5
# Axes move by hundredths of a nanometre a millimetre: what is left is of the second order.
MOVED_UM, SECOND_ORDER = 0.01, 1e-6
SOLVED = 1e-9
# Of differences over a tenth of a nanometre.
DERIVATIVE = 1e-6


@cache
def pair(helix, width=50.0):
    text = FVA_CASE.format(module=4.5, helix=helix, width=width, teeth=(27, 51), shift=0.0)
    case = parse_case(text.replace("centre_distance_mm = 190.0\n", ""), "pair", "pair")
    return reduced_pair(train(case, elastic_model(case, mesh_model(case))).basis)


def angles(reduced, count=20):
    return np.linspace(0.0, reduced.meshed.pair.pitch, count, endpoint=False)


@pytest.mark.parametrize("helix", [*(pytest.param(helix, marks=pytest.mark.slow) for helix in (0.0, -12.0)), 21.0])
@pytest.mark.parametrize(
    ("misalignment", "wheel"),
    [
        (Misalignment(in_plane_um=MOVED_UM), (0.0, 0.0, 0.0, -1e-3 * MOVED_UM / 50.0, 0.0, 0.0)),
        (Misalignment(out_of_plane_um=MOVED_UM), (0.0, 0.0, 0.0, 0.0, 1e-3 * MOVED_UM / 50.0, 0.0)),
        (Misalignment(centre_distance_um=MOVED_UM), (0.0, 1e-3 * MOVED_UM, 0.0, 0.0, 0.0, 0.0)),
    ],
)
def test_moved_hubs_change_the_gaps_as_moved_axes_do(helix, misalignment, wheel):
    reduced = pair(helix)
    placed, moved = (reduced.lines.place(angles(reduced), where).lines for where in (ALIGNED, misalignment))
    rows = hub_rows(reduced.meshed.pair, placed, reduced.layered.sections.z)
    near = placed.gap < 0.02
    change = moved.gap[near] - placed.gap[near]
    by_rows = (rows @ np.r_[np.zeros(6), wheel])[near]
    on_flanks = (np.abs(np.abs(placed.lever) - reduced.meshed.pair.pinion.base_radius) < 1e-9)[near]
    on_flanks &= (np.abs(np.abs(placed.mate_lever) - reduced.meshed.pair.wheel.base_radius) < 1e-9)[near]
    assert on_flanks.sum() > 100
    size = np.abs(change).max()
    assert_allclose(by_rows[on_flanks], change[on_flanks], rtol=0.0, atol=SECOND_ORDER * size + 1e-12)
    # The point of a tip corner moves along the corner itself where axes tilt.
    assert_allclose(by_rows, change, rtol=0.0, atol=0.02 * size)


def rows_by_arrays(pair, lines, z):
    """The slow, obvious twin of the kernel."""
    levers = np.stack([-lines.lever, lines.mate_lever])
    base = np.array([pair.pinion.base_radius, pair.wheel.base_radius])
    cosine = np.clip(levers.sum(axis=0) / pair.centre_distance, -1.0, 1.0)
    sine = np.sqrt(1.0 - cosine**2)
    smooth_wheel = np.abs(levers[0] - base[0]) > np.abs(levers[1] - base[1])
    along = np.where(
        smooth_wheel, pair.centre_distance * sine - base[1] * lines.roll[..., 1], base[0] * lines.roll[..., 0]
    )
    x, y = levers[0] * sine - along * cosine, levers[0] * cosine + along * sine
    axial = -np.tan(pair.base_helix_angle) * np.ones_like(x)
    on_wheel = np.stack([-cosine, sine, axial], axis=-1)
    place = np.stack([x, y, np.broadcast_to(np.tile(z, x.shape[1] // len(z)), x.shape)], axis=-1)
    from_wheel = place - np.array([0.0, pair.centre_distance, 0.0])
    rows = [-on_wheel, np.cross(place, -on_wheel), on_wheel, np.cross(from_wheel, on_wheel)]
    return np.where(np.isfinite(lines.gap)[..., None], np.concatenate(rows, axis=-1), 0.0)


@pytest.mark.parametrize("helix", [0.0, 21.0])
def test_rows_of_the_kernel_are_those_of_arrays(helix):
    reduced = pair(helix)
    lines, z = reduced.lines.place(angles(reduced), ALIGNED).lines, reduced.layered.sections.z
    expected = rows_by_arrays(reduced.meshed.pair, lines, z)
    assert_allclose(hub_rows(reduced.meshed.pair, lines, z), expected, rtol=0.0, atol=1e-13 * np.abs(expected).max())


@pytest.mark.parametrize("helix", [0.0, 21.0])
def test_rows_hold_the_levers_of_both_gears_and_balance(helix):
    reduced = pair(helix)
    lines = reduced.lines.place(angles(reduced), ALIGNED).lines
    rows, there = hub_rows(reduced.meshed.pair, lines, reduced.layered.sections.z), np.isfinite(lines.gap)
    assert_allclose(rows[..., 5][there], lines.lever[there], atol=1e-9)
    assert_allclose(np.abs(rows[..., 11][there]), np.abs(lines.mate_lever[there]), atol=1e-9)
    assert_allclose(rows[..., :3], -rows[..., 6:9], atol=1e-15)
    about_pinion = rows[..., 9:] + np.cross([0.0, reduced.meshed.pair.centre_distance, 0.0], rows[..., 6:9])
    assert_allclose(rows[..., 3:6], -about_pinion, atol=1e-9)


def test_a_helical_wheel_that_screws_moves_the_transmission_error_alone():
    """Along its axis by u: the same state, ahead by u tan(base helix angle)."""
    reduced, along = pair(21.0), 0.01
    screwed = on_hubs(reduced, Hubs(np.zeros((12, 12)), np.r_[np.zeros(8), along, np.zeros(3)]))
    found, expected = (
        sweep_line_loads(one, angles(reduced), at_torques([TORQUE]), recorded=True) for one in (screwed, reduced)
    )
    ahead = -1e3 * along * np.tan(reduced.meshed.pair.base_helix_angle)
    assert_allclose(found.ste_um - expected.ste_um, ahead, rtol=0.0, atol=1e-3 * abs(ahead))
    load, expected_load = (sweep.states.lines.load_N_per_mm for sweep in (found, expected))
    assert_allclose(load, expected_load, rtol=0.0, atol=0.02 * expected_load.max())


def test_root_stress_on_moved_hubs_is_that_on_moved_axes():
    """Out of plane by 20 um over the face: the same line loads but for the second order, and so the same stress."""
    reduced, by = pair(21.0), 20.0
    moved = Hubs(np.zeros((12, 12)), np.r_[np.zeros(10), 1e-3 * by / 50.0, 0.0])
    phi, aligned = angles(reduced), at_torques([TORQUE])
    tilted = [replace(one, misalignment=Misalignment(out_of_plane_um=by)) for one in aligned]
    found, expected, level = (
        root_stress(one, phi, conditions).max_principal_MPa
        for one, conditions in ((on_hubs(reduced, moved), aligned), (reduced, tilted), (reduced, aligned))
    )
    there = np.isfinite(found) & np.isfinite(expected)
    assert_allclose(found[there], expected[there], rtol=0.0, atol=2e-3 * expected[there].max())
    assert np.nanmax(expected) > 1.05 * np.nanmax(level)


def test_half_of_the_width_is_refused():
    with pytest.raises(ValueError, match="takes? the whole width"):
        replace(pair(0.0).layered, mirrored=True, hubs=Hubs(np.zeros((12, 12)), np.zeros(12)))


# --- with shafts and bearings ---------------------------------------------------------------------------------------


@cache
def pairs():
    """Those of the box, whatever it stands on."""
    return {
        name: reduced_pair(train(case, elastic_model(case, mesh_model(case))).basis)
        for name, case in fva_box().cases.items()
    }


@cache
def solved(radial=2e5, torque_Nm=500.0):
    box = fva_box(radial, radial)
    return box.model, pairs(), solve_load(box.model, drive("load", torque_Nm), pairs(), 12)


@pytest.mark.slow
def test_mesh_and_machine_agree_on_where_the_hubs_stand():
    """The displacements that line loads find on S are those of all shafts under the forces of these line loads."""
    model, _, found = solved()
    for mesh in found.meshes:
        axes = mesh.meshing.frame.axes
        for hub, displacement in zip(mesh.meshing.hubs, mesh.displacement, strict=True):
            moved = found.equilibrium.displacement[hub : hub + 6].reshape(2, 3) @ axes
            moved[1, 2] = 0.0
            assert_allclose(displacement, moved.ravel(), rtol=0.0, atol=SOLVED)
    assert_allclose([mesh.torque for mesh in found.meshes], [5e5, 5e5 * 51 / 27], rtol=1e-4)


@pytest.mark.slow
def test_line_loads_and_hubs_together_are_a_fixed_point_by_hand():
    """Hubs are displaced by the mean forces, without S in the equations: iterated until they no longer move."""
    model, pairs, found = solved()
    mesh = found.meshes[0]
    reduced, hubs = pairs["high speed"], mesh.hubs
    phi = angles(reduced, 1)
    expected = sweep_line_loads(on_hubs(reduced, hubs), phi, at_torques([mesh.torque])).ste_um
    moved = hubs.offset
    for _ in range(400):
        held = on_hubs(reduced, Hubs(np.zeros((12, 12)), moved))
        placed = held.lines.place(phi, ALIGNED)
        force = placed.solve(np.array([mesh.torque])).force[0]
        rows = hub_rows(reduced.meshed.pair, placed.lines, reduced.layered.sections.z)
        target = hubs.offset + hubs.compliance @ np.einsum("an,anr->r", force, rows)
        if np.abs(target - moved).max() < 1e-13:
            break
        moved = moved + 0.5 * (target - moved)
    by_hand = sweep_line_loads(on_hubs(reduced, Hubs(np.zeros((12, 12)), moved)), phi, at_torques([mesh.torque])).ste_um
    assert_allclose(by_hand, expected, rtol=SOLVED)


def test_sections_that_stay_placed_change_nothing():
    """Other loads, on hubs that give way by more and with other flanks, and back: as solved each by itself."""
    (model, pairs, _), few = solved(), 4
    kept = {name: keeping_sections(reduced) for name, reduced in pairs.items()}
    softer = fva_box(5e4, 5e4).model
    crowned = Assembly(pinion=Modification(helix_crowning_um=8.0))
    for machine, torque, flank in ((softer, 300.0, crowned), (model, 500.0, None)):
        others = [
            both if flank is None else {name: with_flanks(reduced, flank) for name, reduced in both.items()}
            for both in (pairs, kept)
        ]
        one, other = (solve_load(machine, drive("load", torque), both, few) for both in others)
        again = solve_load(machine, drive("load", torque), others[1], few, other.gearbox)  # from a start
        for a, b, c in zip(one.meshes, other.meshes, again.meshes, strict=True):
            assert_allclose(b.sweep.ste_um, a.sweep.ste_um, rtol=SOLVED)
            assert_allclose(c.sweep.ste_um, a.sweep.ste_um, rtol=SOLVED)
            load, same = (sweep.states.lines.load_N_per_mm for sweep in (a.sweep, b.sweep))
            assert_allclose(same, load, rtol=0.0, atol=1e-8 * load.max())


def test_stiff_shafts_and_bearings_are_rigid_supports():
    box = fva_box()
    stiff = replace(
        box.model,
        sections=replace(
            box.model.sections,
            shafts=tuple(replace(shaft, youngs_modulus_GPa=1e12) for shaft in box.model.sections.shafts),
        ),
    )
    _, pairs, _ = solved()
    (found,) = with_rigid_supports([solve_load(stiff, drive("load", 500.0), pairs, 12)], pairs, {}, 12)
    for mesh, rigid in zip(found.meshes, found.rigid, strict=True):
        assert_allclose(mesh.sweep.ste_um, rigid.sweep.ste_um, rtol=1e-6)
        assert_allclose(mesh.root_stress, rigid.root_stress, rtol=1e-6)


def test_a_reversed_torque_runs_the_same_pair_from_its_other_end():
    """A box that is its own mirror image at mid width: spur gears, on bearings at equal distances."""
    model, pairs, found = solved(2e5, -500.0)
    for mesh in found.meshes:
        assert mesh.force > 0.0
        assert mesh.sweep.converged.all()
    forward = solved()[2]
    senses = [mesh.meshing.frame.along for one in (forward, found) for mesh in one.meshes]
    assert senses == [1.0, -1.0, -1.0, 1.0]


@pytest.mark.parametrize("helix", [0.0, 21.0])
def test_derivatives_of_the_transmission_error_go_through_the_supports(helix):
    """By deviations of all sections at once, against differences; Maxwell's theorem holds with S as without."""
    reduced, rng = pair(helix), np.random.default_rng(28)
    factor = np.diag([1.0, 1.0, 1.0, 0.02, 0.02, 0.0] * 2) @ rng.standard_normal((12, 12))
    held = on_hubs(reduced, Hubs(1e-7 * factor @ factor.T, np.zeros(12)))
    placed, torque, step = held.lines.place(angles(held, 8), ALIGNED), np.array([TORQUE]), 1e-7
    direction = rng.standard_normal(placed.lines.gap.shape)
    rate = placed.solve(torque, False, 0.0 * direction, True).sensitivity[0]
    ahead, behind = (placed.solve(torque, False, sign * step * direction).advance[0] for sign in (1.0, -1.0))
    expected = (ahead - behind) / (2.0 * step)
    found = (rate * direction).sum(axis=1)
    assert_allclose(found, expected, rtol=1e-5, atol=DERIVATIVE * np.abs(expected).max())
    rigid = reduced.lines.place(angles(reduced, 8), ALIGNED).solve(torque, False, 0.0 * direction, True).sensitivity[0]
    assert np.abs(rigid - rate).max() > 1e-2 * np.abs(rate).max()


def test_a_flank_with_which_the_machine_has_no_equilibrium_is_no_better_than_that_of_the_case(monkeypatch):
    """All loads are solved: parallel meshes may leave one without contact where its flank alone is changed."""
    model, pairs, found = solved()

    def fails(*arguments):
        raise ConvergenceError("no contact", [])

    monkeypatch.setattr("pmor.machine.fit.solved_anew", fails)
    for fit in fit_meshes(model, [found], pairs):
        assert (fit.helix_slope_um, fit.helix_crowning_um) == (0.0, 0.0)
        assert fit.after == fit.before


@pytest.mark.slow
def test_the_flank_that_fits_levels_the_load_of_the_machine_solved_anew():
    model, pairs, found = solved()
    for fit, mesh in zip(fit_meshes(model, [found], pairs), found.meshes, strict=True):
        assert fit.before == face_load_factor(line_states(mesh.sweep))[0]
        assert fit.after < 1.0 + 0.62 * (fit.before - 1.0)
        assert fit.helix_crowning_um >= 0.0
        reduced = pairs[fit.mesh]
        worse = []
        for slope in (-2.0, 2.0):
            flank = {"helix_slope_um": fit.helix_slope_um + slope, "helix_crowning_um": fit.helix_crowning_um}
            case = change_case(reduced.basis.case, **{"pinion.modification": flank})
            turned = {**pairs, fit.mesh: replace(reduced, basis=replace(reduced.basis, case=case))}
            again = solve_load(model, found.load, turned, 16)
            number = [one.meshing.settings.name for one in again.meshes].index(fit.mesh)
            worse.append(face_load_factor(line_states(again.meshes[number].sweep))[0])
        assert min(worse) > fit.after
