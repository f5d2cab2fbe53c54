"""Misaligned axes: the gaps they make, in sections and in space, and the equilibria that follow."""

from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.gear.condition import ALIGNED, Assembly, Condition, Misalignment
from pmor.gear.kernels.types import Motion
from pmor.line.kernels.contact_point import closest_approach
from pmor.line.layered_pair import sections_of
from pmor.pair.model import mesh_model
from pmor.penalty.position import active_patches, relative_motion
from pmor.penalty.search import search_contact
from tests.support.small_case import case_with, full_fe
from tests.support.states import forces, states_at

TILTED = Misalignment(in_plane_um=30.0, out_of_plane_um=-20.0, centre_distance_um=40.0)
TORQUE = 1e5  # N mm


def unlike_case(scheme="line", centre_distance=None, elements=6, **contact):
    pair = {"centre_distance_mm": centre_distance} if centre_distance else {}
    return case_with(
        pair=pair, wheel={"teeth": 31, "bore_radius_mm": 25.0},
        mesh={"profile_elements": elements, "width_elements": 4, "width": "whole"},
        contact={"scheme": scheme, **contact}, offline={"torques_Nm": [40.0, 200.0]},
        results={"root_stress": False},
    )  # fmt: skip


@cache
def model(*arguments, **contact):
    """Full FE of a small pair with unlike gears, over the whole width."""
    case = unlike_case(*arguments, **contact)
    return full_fe(case)


def under_torque(misalignment):
    return [Condition(torque=TORQUE, misalignment=misalignment)]


def section_at(meshed, roll_position, advance, z):
    """Gap and the like of a section on tilted axes, at an advance beyond the first touch."""
    forward, back = Motion(np.zeros((3, 3)), np.zeros(3)), Motion(np.zeros((3, 3)), np.zeros(3))
    kinematics = meshed.kinematics(TILTED)
    advance += kinematics.first_touch
    return closest_approach(kinematics, meshed.gears, roll_position, advance, z, forward, back), forward


@pytest.mark.parametrize("z", [-10.0, 3.0, 10.0])
@pytest.mark.parametrize("fraction", [0.1, 0.5, 0.9])
def test_gap_of_a_section_is_the_least_distance_of_the_displaced_involutes(z, fraction):
    """Against points of both flanks, found by brute force: where they do not touch the least distance is the gap."""
    meshed = model().mesh.meshed
    pair = meshed.pair
    start, end = pair.roll_position_range
    advance = -2e-3  # apart in every section
    contact_point, (rotation, shift) = section_at(meshed, start + fraction * (end - start), advance, z)
    around = np.linspace(-0.02, 0.02, 1001)
    pinion = pair.pinion.flank_section(contact_point.pinion_roll + around) @ rotation[:2, :2].T + shift[:2]
    wheel = pair.wheel.flank_section(contact_point.wheel_roll + around)
    distance = np.linalg.norm(pinion[:, None] - wheel[None], axis=2)
    assert contact_point.gap > 0.0
    # The points are 0.3 um apart on either flank, which costs the square of that over the radii.
    assert_allclose(distance.min(), contact_point.gap, rtol=2e-4)
    i, j = np.unravel_index(distance.argmin(), distance.shape)
    assert abs(i - 500) < 25
    assert abs(j - 500) < 25


def test_plain_flanks_on_tilted_axes_first_touch_where_the_kinematics_say():
    meshed = model().mesh.meshed
    for roll_position in np.linspace(*meshed.pair.roll_position_range, 5)[1:-1]:
        gaps = [section_at(meshed, roll_position, 0.0, z)[0].gap for z in np.linspace(-10.0, 10.0, 11)]
        assert abs(min(gaps)) < 1e-13
        assert max(gaps) > 0.01


def test_relative_motion_is_rigid_and_puts_the_wheels_axis_where_a_condition_says():
    meshed = model().mesh.meshed
    rotation, shift = relative_motion(meshed, 0.07, 1e-3, TILTED)
    assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-14)
    # Points of the wheel's axis, seen from the pinion: at z = 0 offset, and along a direction with the slopes.
    to_pinion = lambda x: rotation.T @ (x - shift)  # noqa: E731
    angle = 0.07 + 1e-3
    turn = np.array([[np.cos(angle), -np.sin(angle), 0.0], [np.sin(angle), np.cos(angle), 0.0], [0.0, 0.0, 1.0]])
    origin, above = (turn @ to_pinion(np.array([0.0, 0.0, z])) for z in (0.0, 10.0))
    assert_allclose(origin, [0.0, meshed.pair.centre_distance + 0.04, 0.0], atol=1e-12)
    along = above - origin
    assert_allclose(along[:2] / along[2], [-20e-3 / 20.0, 30e-3 / 20.0], atol=1e-12)


def test_surfaces_in_space_and_sections_see_the_same_gaps():
    """Unloaded: the smallest gap of each column of points, against the exact section there."""
    meshed = mesh_model(unlike_case("direct", elements=16, lodm_profile=16, slave="pinion")).meshed
    exact = model().mesh.meshed
    phi, advance, touch = 0.4 * meshed.pair.pitch, 1e-3, meshed.kinematics(TILTED).first_touch
    position = active_patches(meshed, phi, 0.2, Assembly(TILTED))
    contact = search_contact(meshed, position, np.zeros((len(position.nodes), 3)), touch + advance)
    for pair, index in enumerate(position.pair_index):
        roll_position = phi + index * meshed.pair.pitch
        for column, z in enumerate(meshed.pinion.nodes[0, :, 2]):
            here = (contact.pair == pair) & (contact.place[:, 1] == column)
            gap = section_at(exact, roll_position, advance, z)[0].gap
            if gap < 0.0:
                # A surface through the nodes of 16 elements misses the involute by some hundredths of a micrometre.
                assert_allclose(contact.gap[here].min(), gap, atol=1e-4)


@pytest.mark.parametrize("scheme", ["line", "direct"])
def test_another_centre_distance_is_another_pair(scheme):
    """An offset along the centre line against the pair that has this centre distance from the start."""
    # Which gear is the slave would depend on where the path of contact is.
    near = model(scheme, slave="pinion")
    meshed, apart = near.mesh.meshed, Misalignment(centre_distance_um=100.0)
    far = model(scheme, meshed.pair.centre_distance + 0.1, slave="pinion")
    slack = meshed.kinematics(apart).first_touch
    for fraction in (0.2, 0.45, 0.7):
        phi = fraction * meshed.pair.pitch
        (here,) = states_at(near, phi, under_torque(apart))
        (there,) = states_at(far, phi + slack, under_torque(ALIGNED))
        assert_allclose(here.advance - slack, there.advance, rtol=1e-7)


@pytest.mark.parametrize("scheme", ["line", "direct"])
def test_the_mirrored_tilt_mirrors_the_load_that_carries_the_torque(scheme):
    full = model(scheme)
    tilt = Misalignment(in_plane_um=10.0, out_of_plane_um=15.0)
    back = Misalignment(in_plane_um=-10.0, out_of_plane_um=-15.0)
    states = [states_at(full, 0.05, under_torque(misalignment))[0] for misalignment in (tilt, back)]
    size = len(sections_of(full.mesh.meshed).z)
    (one, torque), (other, _) = (forces(state, size) for state in states)
    assert_allclose(torque, TORQUE, rtol=1e-8)
    assert_allclose(states[0].advance, states[1].advance, rtol=1e-8)
    assert_allclose(one, other[::-1], rtol=1e-6, atol=1e-6 * one.max())
    assert one[-1] > 2.0 * one[0]  # the side towards which the wheel's axis leans
