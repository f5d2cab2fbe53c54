"""What must hold for a helical pair whatever its numbers are: balances, energy, and its limits spur and unloaded."""

import math
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.case import parse_case
from pmor.core.conventions import rotation_z
from pmor.gear.condition import PLAIN, at_torques
from pmor.gear.kernels.types import Motion
from pmor.gear.modification import UNMODIFIED, Modification
from pmor.line.kernels.contact_point import closest_approach
from pmor.pair.model import elastic_model, mesh_model
from pmor_offline.train import train
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.model import reduced_pair
from tests.support.small_case import case_text
from tests.support.states import states_at

TORQUE = 1e5  # N mm
BALANCE = 1e-9
RELIEVED = Modification(tip_relief_um=20.0, tip_relief_start_roll_deg=25.0)


def model_of(helix_deg, **sections):
    given = {
        "pair": {"helix_angle_deg": helix_deg},
        "wheel": {"teeth": 31, "bore_radius_mm": 25.0},
        "mesh": {"profile_elements": 5, "width_elements": 4, "width": "whole"},
        "contact": {"scheme": "line"},
    }
    for name, keys in sections.items():
        given[name] = given.get(name, {}) | keys
    text = case_text(**given)
    case = parse_case(text, "small", "small case")
    return elastic_model(case, mesh_model(case))


@cache
def model(helix_deg):
    return model_of(helix_deg)


@cache
def narrow_model(helix_deg):
    """Layers of 1.25 mm, on as little a face as shows it."""
    return model_of(helix_deg, pair={"face_width_mm": 10.0}, wheel={"teeth": 21, "bore_radius_mm": 20.0},
                    mesh={"profile_elements": 4, "width_elements": 8})  # fmt: skip


def in_space(meshed, roll_position, gear):
    """Rotation and shift from a tooth's frame to the frame of the pair."""
    pair = meshed.pair
    if gear == 0:
        return rotation_z(roll_position), np.zeros(3)
    return rotation_z(math.pi + pair.wheel_tooth_rotation(roll_position)), np.array([0.0, pair.centre_distance, 0.0])


def opening_in_space(meshed, roll_position, z):
    """Where pinion and wheel meet in a section, and how displacements of the two points open the gap."""
    kinematics, motions = (
        meshed.kinematics(PLAIN.misalignment),
        [Motion(np.zeros((3, 3)), np.zeros(3)) for _ in range(2)],
    )
    m = closest_approach(kinematics, meshed.gears, roll_position, 0.0, z, *motions)
    found = []
    for gear, (tooth, roll, direction) in enumerate((
        (meshed.pair.pinion, m.pinion_roll, (m.pinion_x, m.pinion_y, m.pinion_z)),
        (meshed.pair.wheel, m.wheel_roll, (m.wheel_x, m.wheel_y, m.wheel_z)),
    )):  # fmt: skip
        rotation, shift = in_space(meshed, roll_position, gear)
        found.append((rotation @ tooth.flank_point(roll, z) + shift, rotation @ np.array(direction)))
    return found


# --- balances ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("helix_deg", [20.0, -20.0])
def test_rigid_motions_of_both_gears_open_no_gap(helix_deg):
    """Virtual work of all six, section by section on the line of action."""
    meshed = model(helix_deg).mesh.meshed
    start, end = meshed.pair.roll_position_range
    for share in (0.05, 0.4, 0.95):
        for z in (-9.0, 0.0, 6.0):
            roll_position = start + share * (end - start) - meshed.pair.pinion.twist_per_length * z
            (here, one), (there, other) = opening_in_space(meshed, roll_position, z)
            for axis in np.eye(3):
                assert abs(axis @ (one + other)) < BALANCE
                opened = np.cross(axis, here) @ one + np.cross(axis, there) @ other
                assert abs(opened) < BALANCE * meshed.pair.centre_distance


@pytest.mark.parametrize("helix_deg", [20.0, -20.0])
def test_forces_and_moments_on_the_bearings_are_those_of_the_plane_of_action(helix_deg):
    """In closed form: along the line of action F_t, along the axis F_t tan(beta_b), at the points of that plane."""
    full = model(helix_deg)
    meshed, pair = full.mesh.meshed, full.mesh.meshed.pair
    phi = 0.35 * pair.pitch
    (state,) = states_at(full, phi, at_torques([TORQUE]))
    action = np.array([-math.cos(pair.working_pressure_angle), math.sin(pair.working_pressure_angle), 0.0])
    foot = pair.pinion.base_radius * np.array([action[1], -action[0], 0.0])
    angle, total, expected = pair.base_helix_angle, np.zeros((2, 6)), np.zeros((2, 6))
    for index, section, force in zip(state.pair, state.section, state.force, strict=True):
        z = meshed.sections.z[section]
        roll_position = phi + index * pair.pitch
        roll = roll_position + pair.pinion.twist_per_length * z
        assert pair.roll_position_range[0] < roll < pair.roll_position_range[1]
        place = foot + pair.pinion.base_radius * float(pair.contact_roll_angles(np.array(roll))[0]) * action
        place[2] = z
        along = force * (action - math.tan(angle) * np.array([0.0, 0.0, 1.0]))
        for gear, (point, opening) in enumerate(opening_in_space(meshed, roll_position, z)):
            # What closes the gap is pushed back.
            total[gear] += force * np.concatenate([opening, np.cross(point, opening)])
            pushed = along if gear == 1 else -along
            expected[gear] += np.concatenate([pushed, np.cross(place, pushed)])
    tangential = TORQUE / pair.pinion.base_radius
    assert_allclose(total[:, :3], expected[:, :3], rtol=0.0, atol=BALANCE * tangential)
    assert_allclose(total[:, 3:], expected[:, 3:], rtol=0.0, atol=BALANCE * tangential * pair.centre_distance)
    helix = pair.pinion.helix_angle
    at_pitch_circle = tangential * math.cos(pair.pinion.transverse_pressure_angle)
    assert_allclose(abs(total[:, 2]), at_pitch_circle * abs(math.tan(helix)), rtol=BALANCE)
    assert_allclose(abs(total[0, 5]), TORQUE, rtol=BALANCE)
    about_wheel = total[1, 5] - np.cross([0.0, pair.centre_distance, 0.0], total[1, :3])[2]
    assert_allclose(abs(about_wheel) / TORQUE, pair.wheel.teeth / pair.pinion.teeth, rtol=BALANCE)


# --- limits --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("flank", [UNMODIFIED, RELIEVED], ids=["plain", "relieved"])
def test_a_helix_of_a_tenth_of_a_degree_is_as_good_as_none(flank):
    """Spur sections are the columns of nodes, helical ones lie between them: on layers this thin both are enough."""
    found = []
    for helix_deg in (0.0, 0.1):
        full = narrow_model(helix_deg)
        meshed = full.mesh.meshed
        advances, pressures = [], []
        for share in np.arange(4) / 4.0:
            (state,) = states_at(full, share * meshed.pair.pitch, at_torques([TORQUE], pinion=flank, wheel=flank))
            advances.append(state.advance * meshed.pair.pinion.base_radius)
            on_flank = np.abs(state.lever + meshed.pair.pinion.base_radius) < 1e-9
            pressures.append(state.patches()[on_flank, 2].max())
        found.append((np.mean(advances), max(pressures)))
    assert_allclose(found[1][0], found[0][0], rtol=5e-3)
    assert_allclose(found[1][1], found[0][1], rtol=2e-2)


def test_peak_to_peak_without_load_is_half_of_a_relief_from_the_highest_point_of_single_contact():
    """On both gears of a 50/50 pair: where two pairs are in reach, one's relief falls as the other's grows."""
    relief = 10.0
    text = case_text(
        pair={"module_mm": 3.0, "centre_distance_mm": 150.0}, pinion={"teeth": 50, "bore_radius_mm": 60.0},
        mesh={"profile_elements": 4, "width_elements": 2}, contact={"scheme": "line"},
        reduction={"shapes": "line_loads"},
    )  # fmt: skip
    case = parse_case(text, "osu", "osu")
    reduced = reduced_pair(train(case, elastic_model(case, mesh_model(case))).basis)
    pair = reduced.meshed.pair
    highest = math.degrees(pair.active_rolls[0][0] + pair.pitch)
    flank = Modification(tip_relief_um=relief, tip_relief_start_roll_deg=highest)
    phi = np.linspace(0.0, pair.pitch, 400, endpoint=False)
    sweep = sweep_line_loads(reduced, phi, at_torques([1e-5], pinion=flank, wheel=flank))
    assert_allclose(np.ptp(sweep.ste_um[0]), 0.5 * relief, rtol=1e-2)
