"""Helical pairs of either hand, faces of their own, balances, energy, and the limits spur and unloaded."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.core.conventions import rotation_z
from pmor.gear.condition import PLAIN, at_torques
from pmor.gear.kernels.types import Motion
from pmor.line.kernels.contact_point import closest_approach
from pmor.pair.limits import range_warnings
from pmor.pair.model import approach_estimate, gear_pair
from pmor.pair.sweep import sweep_ste
from pmor.penalty.solve import solve_position
from pmor_offline.train import train
from pmor_online.model import reduced_pair
from pmor_online.sweep import sweep_reduced_pair
from tests.support.small_case import case_with, full_fe

SAME = 1e-7  # relative; the same state in turned coordinates, each to Newton's tolerance and the feet's
# Of the mean, reduced against full FE at unseen angles: 2.0e-4 at 25 deg, and no more at 10 and 35.
REDUCED = 3e-4

GEARS = {
    "pinion": {"teeth": 13, "bore_radius_mm": 10.0, "profile_shift": 0.2},
    "wheel": {"teeth": 17, "bore_radius_mm": 12.0},
}
MESH = {"profile_elements": 4, "width_elements": 3, "width": "whole"}


def case_of(helix_deg, scheme="direct", **sections):
    given = {
        "pair": {"face_width_mm": 30.0, "helix_angle_deg": helix_deg},
        **GEARS,
        "mesh": MESH,
        "contact": {"scheme": scheme, "lodm_profile": 4},
    }
    return case_with(**merged(given, sections))


def merged(given, sections):
    return given | {name: given.get(name, {}) | keys for name, keys in sections.items()}


@cache
def full_model(helix_deg, scheme="direct", offset=0.0):
    faces = {name: {"face_offset_mm": offset} for name in GEARS}
    case = case_of(helix_deg, scheme, **faces)
    return case, full_fe(case)


def angles(pair, count=6):
    return pair.meshing_range[0] + pair.pitch * (np.arange(count) + 0.37) / count


def solved(model, phi, torques=(1e5,)):
    sweep = sweep_ste(model.mesh.meshed, model.elasticity_at, phi, at_torques(torques))
    assert sweep.converged.all()
    return sweep


# --- contact -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("scheme", ["direct", "paper", "facet"])
def test_the_other_hand_has_the_same_transmission_error(scheme):
    found = []
    for helix_deg in (25.0, -25.0):
        _, model = full_model(helix_deg, scheme)
        found.append(solved(model, angles(model.mesh.meshed.pair)))
    assert_allclose(found[1].ste_um, found[0].ste_um, rtol=SAME)
    assert_allclose(found[1].pair_share, found[0].pair_share, rtol=0.0, atol=1e3 * SAME)


@pytest.mark.parametrize("helix_deg", [25.0])
def test_full_and_reduced_converge_at_all_positions_and_agree(helix_deg):
    case = case_of(helix_deg, mesh={"profile_elements": 8, "width_elements": 4})
    model = full_fe(case)
    offline = replace(case.offline, angles_per_pitch=16, torques_Nm=(40.0, 100.0, 160.0))
    trained = train(replace(case, offline=offline), model)
    assert not trained.failures
    phi, conditions = angles(model.mesh.meshed.pair, 10), at_torques((6e4, 1.2e5))
    full = sweep_ste(model.mesh.meshed, model.elasticity_at, phi, conditions)
    reduced = sweep_reduced_pair(reduced_pair(trained.basis), phi, conditions)
    assert full.converged.all()
    assert reduced.converged.all()
    error = np.abs(reduced.ste_um - full.ste_um).max(axis=1) / full.ste_um.mean(axis=1)
    assert np.all(error < REDUCED)
    # At every position as many pairs share the load as the overlap says.
    sharing = (full.pair_share[1] > 0.0).sum(axis=1)
    assert sharing.mean() > model.mesh.meshed.pair.total_contact_ratio - 0.5


@pytest.mark.parametrize("helix_deg", [0.0, 25.0])
def test_faces_moved_along_the_axes_together_only_turn_a_helical_pair(helix_deg):
    offset = 6.0
    _, model = full_model(helix_deg)
    _, moved = full_model(helix_deg, offset=offset)
    pair = model.mesh.meshed.pair
    phi = angles(pair, 3)
    expected = solved(model, phi)
    found = solved(moved, phi - pair.pinion.twist_per_length * offset)
    assert_allclose(found.ste_um, expected.ste_um, rtol=SAME)


def test_contact_stays_on_the_common_face_of_unequal_gears():
    case = case_of(20.0, pinion={"face_width_mm": 36.0, "face_offset_mm": 2.0}, wheel={"face_offset_mm": -3.0})
    model = full_fe(case)
    meshed = model.mesh.meshed
    low, high = meshed.pair.common_face
    assert (low, high) == (-16.0, 12.0)
    assert [flank.nodes[0, [0, -1], 2].tolist() for flank in (meshed.pinion, meshed.wheel)] == [[-16, 20], [-18, 12]]
    for phi in angles(meshed.pair, 3):
        result = solve_position(meshed, phi, at_torques((1e5,)), model.elasticity_at)
        equilibrium = result.equilibria[0]
        contact = equilibrium.contact
        torque = equilibrium.pair_torque(len(result.position.pair_index)).sum()
        assert_allclose(torque, 1e5, rtol=1e-8)
        teeth = meshed.pair.wheel.teeth / meshed.pair.pinion.teeth
        # Up to tip corners, and the normals of patches over four elements.
        assert_allclose(abs(equilibrium.wheel_torque) / torque, teeth, rtol=1e-2)
        for flank, gear in ((meshed.pinion, 0), (meshed.wheel, 1)):
            z = flank.nodes[0, :, 2]
            step, mine = z[1] - z[0], contact.slave == gear
            place = z[0] + step * contact.place[mine, 1]
            # A point a little beyond the mate's face still has part of its area on it.
            assert (place > low - 0.5 * step - 1e-9).all()
            assert (place < high + 0.5 * step + 1e-9).all()


# --- what is said about it -----------------------------------------------------------------------------------------


def test_facets_warn_of_the_bulge_that_they_cut_off():
    """At 25 deg and layers of 1 mm the paper's gears lose about 0.3 um each."""
    equal = {"teeth": 21, "bore_radius_mm": 20.0}
    for scheme, layers, warned in (("facet", 3, True), ("facet", 60, False), ("direct", 3, False)):
        case = case_of(25.0, scheme, pinion=equal, wheel=equal, mesh={"width_elements": layers})
        pair = gear_pair(case)
        text = " ".join(range_warnings(case, pair, approach_estimate(case, pair)))
        assert ("facets between the layers of nodes cut" in text) == warned
        assert 2e-4 < pair.pinion.helix_sagitta(1.0) < 4e-4


# --- line contact ----------------------------------------------------------------------------------------------------


BALANCE = 1e-9


def model_of(helix_deg, **sections):
    given = {
        "pair": {"helix_angle_deg": helix_deg},
        "wheel": {"teeth": 31, "bore_radius_mm": 25.0},
        "mesh": {"profile_elements": 5, "width_elements": 4, "width": "whole"},
        "contact": {"scheme": "line"},
        "results": {"root_stress": False},
    }
    return full_fe(case_with(**merged(given, sections)))


@cache
def model(helix_deg):
    return model_of(helix_deg)


def in_space(meshed, roll_position, gear):
    """Rotation and shift from a tooth's frame to the frame of the pair."""
    pair = meshed.pair
    if gear == 0:
        return rotation_z(roll_position), np.zeros(3)
    return rotation_z(math.pi + pair.wheel_tooth_rotation(roll_position)), np.array([0.0, pair.centre_distance, 0.0])


def opening_in_space(meshed, roll_position, z):
    """Where pinion and wheel meet in a section, how displacements of the two points open the gap, and their normals."""
    kinematics, motions = (
        meshed.kinematics(PLAIN.misalignment),
        [Motion(np.zeros((3, 3)), np.zeros(3)) for _ in range(2)],
    )
    m = closest_approach(kinematics, meshed.gears, roll_position, 0.0, z, *motions)
    found = []
    for gear, (gear_tooth, roll, direction) in enumerate((
        (meshed.pair.pinion, m.pinion_roll, (m.pinion_x, m.pinion_y, m.pinion_z)),
        (meshed.pair.wheel, m.wheel_roll, (m.wheel_x, m.wheel_y, m.wheel_z)),
    )):  # fmt: skip
        rotation, shift = in_space(meshed, roll_position, gear)
        place, normal = gear_tooth.flank_point(roll, z), gear_tooth.flank_normal(roll, z)
        found.append((rotation @ place + shift, rotation @ np.array(direction), rotation @ normal))
    return found


@pytest.mark.parametrize("helix_deg", [20.0, -20.0])
def test_rigid_motions_of_both_gears_open_no_gap_and_displacements_along_the_flank_none(helix_deg):
    """Virtual work of all six, section by section on the line of action."""
    meshed = model(helix_deg).mesh.meshed
    start, end = meshed.pair.roll_position_range
    for share in (0.05, 0.4, 0.95):
        for z in (-9.0, 0.0, 6.0):
            roll_position = start + share * (end - start) - meshed.pair.pinion.twist_per_length * z
            (here, one, normal), (there, other, mate) = opening_in_space(meshed, roll_position, z)
            assert_allclose([np.cross(one, normal), np.cross(other, mate)], 0.0, rtol=0.0, atol=BALANCE)
            for axis in np.eye(3):
                assert abs(axis @ (one + other)) < BALANCE
                opened = np.cross(axis, here) @ one + np.cross(axis, there) @ other
                assert abs(opened) < BALANCE * meshed.pair.centre_distance
