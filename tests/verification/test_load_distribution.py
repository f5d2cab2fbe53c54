"""Load over flank and face: independent slices in closed form, Hertz's integral, and forces in balance."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.gear.condition import ALIGNED, Assembly
from pmor.gear.modification import UNMODIFIED, Modification
from pmor.pair.conditions import conditions_of_assembly
from pmor.results.flank_maps import flank_map
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.model import online_angles
from pmor_online.readings import forces_on_gears
from tests.support.line_pairs import models, on_columns

# --- on real pairs ---------------------------------------------------------------------------------------------------

FLANK = Modification(tip_relief_um=8.0, tip_relief_start_roll_deg=26.0, helix_crowning_um=6.0)


def recorded(name, width="whole", misalignment=ALIGNED, flank=FLANK, torques=(30.0, 100.0), angles=24, hand=1.0,
             columns=False):  # fmt: skip
    _, reduced = models(name, hand, width)
    reduced = on_columns(reduced) if columns else reduced
    phi = online_angles(reduced.meshed.pair.pitch, angles)
    return reduced, sweep_line_loads(
        reduced, phi, conditions_of_assembly(Assembly(misalignment, flank), torques), recorded=True
    )


@pytest.mark.parametrize("name", ["spur", "edges", "helical"])
def test_the_integral_of_the_pressure_is_the_load(name):
    """pi/2 p_max b of a line, and over all lines, normal to the flanks, the torque's force."""
    reduced, sweep = recorded(name)
    lines, pair = sweep.states.lines, reduced.meshed.pair
    smooth = np.isfinite(lines.pressure_MPa) & (lines.offset_mm == 0.0) & (lines.load_N_per_mm > 0.0)
    carried = 0.5 * math.pi * lines.pressure_MPa * lines.half_width_mm
    assert smooth.mean() > 0.1
    assert_allclose(carried[smooth], lines.load_N_per_mm[smooth], rtol=1e-12)
    # Where no edge carries, forces act along the line of action.
    whole = (smooth | (lines.load_N_per_mm == 0.0)).all(axis=(2, 3))
    assert whole.any()
    # The inclined line is longer than the face by the cosine by which its normal force is larger.
    normal = (carried * lines.width_mm).sum(axis=(2, 3)) / math.cos(pair.base_helix_angle)
    expected = 1e3 * sweep.torque_Nm[:, None] / pair.pinion.base_radius / math.cos(pair.base_helix_angle)
    assert_allclose(normal[whole], np.broadcast_to(expected, whole.shape)[whole], rtol=1e-9)


def test_flank_map_keeps_the_load_of_the_cycle():
    """Over roll positions and face, of all pairs at a time, a map holds what the torque asks for on average."""
    reduced = models("helical")[1]
    pair = reduced.meshed.pair
    # So much relief that no tip edge carries, where one roll angle would see many positions.
    reliefs = [
        Modification(tip_relief_um=60.0, tip_relief_start_roll_deg=math.degrees(0.5 * sum(rolls)))
        for rolls in pair.active_rolls
    ]
    phi = online_angles(pair.pitch, 100)
    sweep = sweep_line_loads(
        reduced, phi, conditions_of_assembly(Assembly(ALIGNED, *reliefs), [30.0, 100.0]), recorded=True
    )
    lines = sweep.states.lines
    found = flank_map(sweep, 1, 0, pair.active_rolls[0], points=3201)
    assert found.torque_Nm == 100.0
    step = found.roll_rad[1] - found.roll_rad[0]
    # Each section rolls over the profile once in a cycle, a pair behind the other.
    mean = (found.load_N_per_mm * lines.width_mm).sum() * step / pair.pitch
    # Measured 5e-4: each cell keeps its largest.
    assert_allclose(mean, 1e5 / pair.pinion.base_radius, rtol=1e-3)
    assert_allclose(found.load_N_per_mm.max(), lines.load_N_per_mm[1].max(), rtol=1e-3)


@pytest.mark.parametrize("hand", [1.0, -1.0])
def test_mesh_forces_balance_and_are_those_of_statics(hand):
    reduced, sweep = recorded("helical", hand=hand, flank=UNMODIFIED)
    pair, found = reduced.meshed.pair, forces_on_gears(reduced.meshed, sweep)
    force, moment = found.force_N, found.moment_Nm
    assert_allclose(force.sum(axis=2), 0.0, atol=1e-9)
    about_pinion = moment[:, :, 1] + 1e-3 * np.cross([0.0, pair.centre_distance, 0.0], force[:, :, 1])
    assert_allclose(moment[:, :, 0] + about_pinion, 0.0, atol=1e-9)
    assert_allclose(moment[:, :, 0, 2], -np.broadcast_to(sweep.torque_Nm[:, None], sweep.ste_um.shape), rtol=1e-9)
    load = 1e3 * sweep.torque_Nm[:, None] / pair.pinion.base_radius
    along = load * math.cos(pair.working_pressure_angle)
    # Where a tip corner carries forces are a little off the line of action.
    assert_allclose(force[:, :, 0, 0], np.broadcast_to(along, sweep.ste_um.shape), rtol=5e-3)
    assert_allclose(force[:, :, 1, 1], load * math.sin(pair.working_pressure_angle) + 0.0 * sweep.ste_um, rtol=2e-2)
    # The right-handed pinion that drives counter-clockwise is pushed along +z.
    axial = math.copysign(math.tan(pair.base_helix_angle), hand) * load
    assert_allclose(force[:, :, 0, 2], np.broadcast_to(axial, sweep.ste_um.shape), rtol=1e-9)


def test_the_axial_force_moves_the_transverse_one_along_the_face():
    """Against the sum over points that are set up by hand from roll angle and place."""
    reduced, sweep = recorded("helical", flank=FLANK)
    pair, lines = reduced.meshed.pair, sweep.states.lines
    expected = np.zeros((*sweep.ste_um.shape, 3))
    alpha = pair.working_pressure_angle
    for d, a, p, s in np.argwhere(lines.load_N_per_mm > 0.0):
        push = np.array([math.cos(alpha), -math.sin(alpha), math.tan(pair.base_helix_angle)])
        push *= lines.force_N[d, a, p, s]
        along = pair.pinion.base_radius * lines.roll_rad[a, p, s, 0]
        point = pair.pinion.base_radius * np.array([math.sin(alpha), math.cos(alpha), 0.0])
        point += along * np.array([-math.cos(alpha), math.sin(alpha), 0.0])
        point[2] = lines.z_mm[s]
        expected[d, a] += 1e-3 * np.cross(point, push)
    found = forces_on_gears(reduced.meshed, sweep).moment_Nm[:, :, 0]
    # But for tip corners, whose forces are a little off the line of action.
    assert_allclose(found, expected, atol=5e-3 * np.abs(expected).max())
