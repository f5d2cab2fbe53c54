"""An internal pair by the signs of ISO 21771: teeth, radii and centre distance of the ring are negative.

Kernels and meshes take it as it is; its fillet is made up here, and checks of its geometry are left out.
"""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.core.conventions import rotation_z
from pmor.fe.element import mesh_quality
from pmor.fe.sector import build_sector
from pmor.fe.whole_gear import whole_gear_mesh
from pmor.gear.condition import ALIGNED, Assembly, Misalignment
from pmor.gear.kernels.deviation import flank_deviation
from pmor.gear.kernels.types import Motion
from pmor.gear.meshed_pair import Flank, MeshedPair
from pmor.gear.modification import Modification
from pmor.gear.pair import GearPair, zero_backlash_centre_distance
from pmor.gear.tooth import Tooth
from pmor.line.kernels.contact_point import closest_approach

WIDTH, ALPHA, ROUND_OFF = 20.0, math.radians(20.0), 1e-12
OFF_AXIS = Misalignment(in_plane_um=30.0, out_of_plane_um=-20.0, centre_distance_um=40.0)
on_both_axes = pytest.mark.parametrize("misalignment", [ALIGNED, OFF_AXIS], ids=["aligned", "off axis"])


class Ring(Tooth):
    form_roll_angle = property(lambda self: self.roll_angle_at(self.root_radius + 0.3))

    def __post_init__(self):
        pass

    def root_section(self, parameter):
        turned = 0.5 * math.pi * parameter
        radius = self.root_radius + 0.3 * (1.0 - np.sin(turned))
        angle = self.half_thickness_angle(self.form_roll_angle) - 5e-3 * (1.0 - np.cos(turned))
        return radius[:, None] * np.stack([-np.sin(angle), np.cos(angle)], axis=-1)


@pytest.fixture(scope="module")
def meshed():
    gears = Tooth(20, 2.0, ALPHA), Ring(-60, 2.0, ALPHA, addendum=0.8)
    rolls = [np.linspace(gear.form_roll_angle, gear.tip_roll_angle, 9) for gear in gears]
    flanks = [Flank(gear.flank_point(u[:, None], np.zeros((1, 2))), u) for gear, u in zip(gears, rolls, strict=True)]
    return MeshedPair(GearPair(*gears, WIDTH, zero_backlash_centre_distance(*gears)), *flanks, stiffness_estimate=1e5)


def contact_at(meshed, misalignment, roll_position, advance, z=0.0):
    motions = [Motion(np.zeros((3, 3)), np.zeros(3)) for _ in range(2)]
    return closest_approach(meshed.kinematics(misalignment), meshed.gears, roll_position, advance, z, *motions)


@on_both_axes
@pytest.mark.parametrize("fraction", np.linspace(0.05, 0.95, 7))
def test_flanks_meet_where_the_kinematics_say(fraction, misalignment, meshed):
    """Both gears are turned about their axes until the gap is 0, the ring's axis where the misalignment puts it."""
    pair, z, share = meshed.pair, 8.0, 8.0 / WIDTH
    roll_position = (1.0 - fraction) * pair.roll_position_range[0] + fraction * pair.roll_position_range[1]
    advance = contact_at(meshed, misalignment, roll_position, 0.0, z).gap / pair.pinion.base_radius
    point = contact_at(meshed, misalignment, roll_position, advance, z)
    farther_um = misalignment.centre_distance_um + share * misalignment.in_plane_um
    axis = np.array([1e-3 * share * misalignment.out_of_plane_um, pair.centre_distance - 1e-3 * farther_um])
    pinion = rotation_z(roll_position + advance)[:2, :2] @ pair.pinion.flank_section(point.pinion_roll)
    ring = rotation_z(math.pi + pair.wheel_tooth_rotation(roll_position))[:2, :2]
    assert abs(point.gap) < ROUND_OFF
    assert_allclose(pinion, ring @ pair.wheel.flank_section(point.wheel_roll) + axis, rtol=0.0, atol=60.0 * ROUND_OFF)


@on_both_axes
def test_beyond_the_path_a_tip_meets_the_mate_and_levers_are_derivatives_of_the_gap(misalignment, meshed):
    (start, end), step = meshed.pair.roll_position_range, 1e-6
    for roll_position, gear in ((start - 0.03, 1), (end + 0.03, 0)):
        below, here, above = (contact_at(meshed, misalignment, roll_position, turn) for turn in (-step, 0.0, step))
        assert (here.pinion_roll, here.wheel_roll)[gear] == meshed.gears[gear].tip_roll
        assert abs(here.gap) < 0.1
        assert_allclose((above.gap - below.gap) / (2.0 * step), here.lever, rtol=1e-5)
        assert_allclose((above.lever - below.lever) / (2.0 * step), here.lever_slope, rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize(("key", "extent"), [("tip_relief_um", "tip_relief_start_roll_deg"),
                                             ("root_relief_um", "root_relief_end_roll_deg")])  # fmt: skip
def test_relief_is_at_its_own_end_of_the_flank(key, extent, meshed):
    start, tip = meshed.pair.active_rolls[1][0], meshed.pair.wheel.tip_roll_angle
    relieved = Assembly(wheel=Modification(**{key: 10.0, extent: math.degrees(0.5 * (start + tip))}))
    found = [flank_deviation(meshed.deviations(relieved)[1], roll, 0.0, 0) for roll in (start, tip)]
    assert_allclose(found, [0.01, 0.0] if key == "root_relief_um" else [0.0, 0.01], atol=1e-15)


@pytest.mark.parametrize("order", [1, 2])
def test_sectors_join_to_a_sound_ring(order, meshed):
    mesh = build_sector(meshed.pair.wheel, -70.0, WIDTH, 6, 2, order=order)
    assert_allclose(mesh.nodes[mesh.right] @ rotation_z(mesh.angular_pitch).T, mesh.nodes[mesh.left], atol=1e-10)
    nodes, elements, _ = whole_gear_mesh(mesh)
    assert mesh_quality(nodes, elements).min_scaled_jacobian > 0.2
    radius = np.linalg.norm(nodes[:, :2], axis=1)
    assert_allclose([radius.min(), radius.max()], [-meshed.pair.wheel.tip_radius, 70.0], rtol=1e-9)
