"""Line contact: exact flanks, equilibria, and what it gives on coarse meshes."""

import math
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.case import changed_text, load_case, parse_case
from pmor.gear.condition import ALIGNED, at_torques
from pmor.gear.kernels.types import Motion
from pmor.line.kernels.contact_point import closest_approach, cubic_rows, involute_foot, roll_of
from pmor.pair.sweep import sweep_ste
from pmor.penalty.position import relative_motion
from pmor.results.sweep import ripple_um
from tests.support.gear_models import POISSON, YOUNG
from tests.support.small_case import case_with, full_fe
from tests.support.states import states_at
from tests.support.stored_energy import stored_in_lines

CASES = Path(__file__).parents[2] / "cases"
ROUND_OFF = 1e-12
TORQUE = 1e5  # N mm


# --- exact flanks --------------------------------------------------------------------------------------------------


ROLL = np.sqrt(np.linspace(0.2**2, 0.6**2, 8))


@pytest.mark.parametrize("u", np.linspace(0.2, 0.6, 23))
@pytest.mark.parametrize("roll", [ROLL, ROLL[::-1].copy()], ids=["rising", "falling"])
def test_cubic_along_the_profile_reproduces_quadratics_in_the_arc_length(u, roll):
    weights = np.empty(4)
    first = cubic_rows(roll, u, 0, len(roll) - 1, weights)
    rows = np.minimum(first + np.arange(4), len(roll) - 1)
    for power in range(3):
        assert_allclose(weights @ roll[rows] ** (2 * power), u ** (2 * power), rtol=1e-12)


@pytest.mark.parametrize("slave", [0, 1])
@pytest.mark.parametrize("beyond", [0.0, 0.02, 0.05])
@pytest.mark.parametrize("radius", [0.0, 0.3])
def test_a_corner_meets_the_involute_at_its_distance(slave, beyond, radius, unlike):
    """Against the least distance to points of the mate's flank, found by brute force; of an arc, from its centre."""
    meshed = unlike.mesh.meshed
    pair = meshed.pair
    own, mate = (pair.pinion, pair.wheel) if slave == 0 else (pair.wheel, pair.pinion)
    start, end = pair.roll_position_range
    roll_position = end + beyond if slave == 0 else start - beyond
    rotation, shift = relative_motion(meshed, roll_position, 3e-4)
    if slave == 1:
        rotation, shift = rotation.T, -rotation.T @ shift
    motion = Motion(np.ascontiguousarray(rotation), shift)
    contact_point = involute_foot(meshed.gears, slave, own.tip_roll_angle, radius, motion)
    centre = own.flank_point(own.tip_roll_angle, 0.0) - radius * own.flank_normal(own.tip_roll_angle, 0.0)
    corner = (rotation @ centre + shift)[:2]

    # Around the foot: the tooth's other side is near too.
    foot = roll_of(contact_point, 1 - slave)
    roll = foot + np.linspace(-0.05, 0.05, 100_001)
    distance = np.linalg.norm(mate.flank_section(roll) - corner, axis=1)
    assert_allclose(abs(contact_point.gap + radius), distance.min(), rtol=1e-6, atol=1e-9)
    assert_allclose(foot, roll[distance.argmin()], atol=2e-6)
    assert_allclose(
        abs(contact_point.mate_lever if slave == 0 else contact_point.lever), mate.base_radius, rtol=ROUND_OFF
    )


def test_levers_are_the_derivatives_of_the_gap(unlike):
    meshed = unlike.mesh.meshed
    start, end = meshed.pair.roll_position_range
    step = 1e-6
    for roll_position in (start - 0.05, start - 0.02, 0.5 * (start + end), end + 0.02, end + 0.05):
        kinematics, motions = meshed.kinematics(ALIGNED), [Motion(np.zeros((3, 3)), np.zeros(3)) for _ in range(2)]
        below, here, above = (
            closest_approach(kinematics, meshed.gears, roll_position, turn, 0.0, *motions)
            for turn in (-step, 0.0, step)
        )
        assert_allclose((above.gap - below.gap) / (2.0 * step), here.lever, rtol=1e-5)
        if here.corner_advance == 0.0:
            assert_allclose((above.lever - below.lever) / (2.0 * step), here.lever_slope, rtol=1e-5, atol=1e-6)


# --- equilibria ----------------------------------------------------------------------------------------------------


def paper_model(elements, width=4, **contact):
    """Full FE of the paper's pair on another mesh."""
    mesh = {"profile_elements": elements, "width_elements": width, "element": "hex8i"}
    changes = {"mesh": mesh, "contact": contact}
    text = load_case(CASES / "paper_spur.toml").text
    case = parse_case(changed_text(text, changes), "paper", "paper case")
    return full_fe(case)


def curve(model, angles=48, torque=TORQUE):
    phi = model.mesh.meshed.pair.pitch * np.arange(angles) / angles
    sweep = sweep_ste(model.mesh.meshed, model.elasticity_at, phi, at_torques([torque]))
    assert sweep.converged.all()
    return sweep


@pytest.fixture(scope="module")
def finest():
    return curve(paper_model(64))


# Asked for on the paper's pair, um: at most 0.08 and 0.04. Measured 0.019 and 0.008, mean 0.9 and 0.4 % low.
@pytest.mark.jit
@pytest.mark.parametrize(("elements", "bound"), [(8, 0.03), pytest.param(16, 0.012, marks=pytest.mark.slow)])
def test_coarse_meshes_have_the_transmission_error_of_fine_ones(elements, bound, finest):
    coarse = curve(paper_model(elements))
    error = coarse.ste_um[0] - finest.ste_um[0]
    assert error.std() < bound
    assert abs(error.mean()) < 0.01 * finest.ste_um.mean()
    assert ripple_um(coarse, 0) < 0.003


@pytest.mark.slow
@pytest.mark.jit
def test_depth_of_the_layer_does_not_matter():
    means = [curve(paper_model(16, layer_depth=depth), 24).ste_um.mean() for depth in (0.25, 0.4, 0.55)]
    assert np.ptp(means) < 2e-3 * means[0]


# Ten elements, of 0.14 mm each, lie within the contact.
FINE = {"scheme": "direct", "penalty_N_mm3": 1e7, "lodm_profile": 4, "slave": "pinion"}


@pytest.mark.slow
@pytest.mark.jit
def test_finely_resolved_penalty_contact_comes_to_the_same(finest):
    """Points on 64 elements, less what the penalty gives way: 1e7 N/mm^3 under 500 MPa, 0.05 um."""
    resolved = curve(paper_model(64, **{**FINE, "slave": "tip"}))
    error = resolved.ste_um[0] - 0.05 - finest.ste_um[0]
    assert abs(error.mean()) < 0.012 * finest.ste_um.mean()
    assert error.std() < 0.06


def width_of(meshed, column):
    """Share of the face width of a column of points, and of its image."""
    return 2.0 * meshed.extents[0][0, column, 2:].sum()


@pytest.mark.jit
def test_resolved_contact_has_hertz_width_and_pressure_and_so_has_line_contact_on_elements_as_large_as_it():
    """Points on 64 elements, seven of them in contact, against Johnson (1985), eq. 4.43, and against lines on 8."""
    torque, column, found = 2.5e6, 2, []
    for elements, contact in ((64, FINE), (8, {})):
        model = paper_model(elements, **contact)
        meshed = model.mesh.meshed
        pair = meshed.pair
        pitch_point = math.tan(pair.working_pressure_angle)
        (state,) = states_at(model, pair.roll_position(pitch_point), at_torques([torque]))
        if contact:
            points = state.contact
            mine = (points.place[:, 1] == column) & (points.pair == points.pair[points.force.argmax()])
            width = width_of(meshed, column)
            line_load, length = points.force[mine].sum() / width, points.stiffness[mine].sum() / (1e7 * width)
            found.append((0.5 * length, -1e7 * points.gap[mine].min()))
        else:
            half_width, _, pressure = state.patches()[state.section == column].T
            found.append((half_width[0], pressure[0]))
    radius, modulus = 0.5 * pair.pinion.base_radius * pitch_point, YOUNG / (2.0 * (1.0 - POISSON**2))
    half_width = math.sqrt(4.0 * line_load * radius / (math.pi * modulus))
    assert_allclose(found[0], [half_width, 2.0 * line_load / (math.pi * half_width)], rtol=0.02)
    assert_allclose(found[1], found[0], rtol=0.03)


@pytest.fixture(scope="module")
def unlike():
    """A pinion of 17 teeth drives a wheel of 31."""
    return unlike_model(17, 31)


@cache
def unlike_model(driver, driven):
    gears = {17: {"profile_shift": 0.3, "bore_radius_mm": 14.0}, 31: {"profile_shift": 0.1, "bore_radius_mm": 30.0}}
    pinion, wheel = ({"teeth": teeth, **gears[teeth]} for teeth in (driver, driven))
    mesh = {"profile_elements": 6, "width_elements": 2}
    return full_fe(case_with(mesh=mesh, contact=None, pinion=pinion, wheel=wheel, results={"root_stress": False}))


@pytest.mark.parametrize("share", np.linspace(0.02, 0.95, 8))
def test_exchanging_the_gears_changes_nothing(share):
    """No gear is the slave: the same pair, driven by the other gear with the torque that it had, approaches alike."""
    one, other = unlike_model(17, 31), unlike_model(31, 17)
    pair, mirrored = one.mesh.meshed.pair, other.mesh.meshed.pair
    phi = pair.roll_position_range[0] + share * pair.pitch
    roll_wheel = float(pair.contact_roll_angles(np.array(phi))[1])
    angle = mirrored.roll_position(roll_wheel)

    def solve(model, at, load):
        return states_at(model, at, at_torques([load]))[0]

    here = solve(one, phi, TORQUE)
    there = solve(other, angle, here.wheel_torque)
    corner = not np.allclose(here.lever, -pair.pinion.base_radius, rtol=1e-9)
    if corner:  # one holds the wheel, the other the pinion: a corner is in the same place when that one has turned back
        for _ in range(3):
            there = solve(other, angle - there.advance, here.wheel_torque)
    # The compliance is taken where the flanks meet kinematically, which is not quite there then.
    tolerance = 3e-4 if corner else 1e-9
    assert_allclose(there.advance * mirrored.pinion.base_radius, here.advance * pair.pinion.base_radius, rtol=tolerance)
    assert_allclose(there.wheel_torque, TORQUE, rtol=tolerance)


# Place beside the end of the path of contact at which a pair enters (0) or leaves (1), rad.
@pytest.mark.parametrize(
    ("end", "beside", "corner"),
    [
        (0, -0.0125, -3.7e-3),
        (0, -0.008, -4.7e-3),
        (0, 0.0, 0),
        (0, 0.01, 0),
        (1, -0.01, 0),
        (1, 0.0, 2e-4),
        (1, 0.005, 3.5e-3),
        (1, 0.01, 4.9e-3),
    ],
)
def test_wheel_torque_follows_from_the_balance_of_energy(end, beside, corner, unlike):
    """T_1 (d phi + d advance) = T_2 d phi z_1 / z_2 + d (elastic energy and that of the layers), by finite differences.

    On the line of action the levers are the base radii and the torques in the ratio of the teeth, whatever is solved;
    that the slope of the STE then is the energy that the teeth store is not. A corner off the line has other levers.
    """
    meshed, step = unlike.mesh.meshed, 1e-4

    def state(phi):
        (found,) = states_at(unlike, phi, at_torques([TORQUE]))
        return found, stored_in_lines(meshed, found)

    phi = meshed.pair.roll_position_range[end] + beside
    (before, energy_before), (here, _), (after, energy_after) = (state(phi + s * step) for s in (-1.0, 0.0, 1.0))
    expected = (after.advance - before.advance - (energy_after - energy_before) / TORQUE) / (2.0 * step)
    ratio = here.wheel_torque / TORQUE * 17 / 31 - 1.0
    assert_allclose(ratio, corner, rtol=0.0, atol=1e-4)
    # Measured 1.1e-3 at the very end of the path, where the middle of the pressure is farthest from the corner that the
    # force is taken to act at; elsewhere up to 2e-4.
    assert_allclose(expected, ratio, rtol=0.0, atol=4e-4 if beside != 0.0 else 1.5e-3)


@pytest.mark.jit
def test_slope_over_the_angle_is_continuous_between_entry_and_exit():
    model = paper_model(16)
    meshed = model.mesh.meshed
    pitch, (start, end) = meshed.pair.pitch, meshed.pair.roll_position_range
    # A twentieth of a pitch away from where a pair enters or leaves.
    phi = np.concatenate([np.linspace(a + 0.05 * pitch, b - 0.05 * pitch, 12)
                          for a, b in ((start, end - pitch), (end - pitch, start + pitch))])  # fmt: skip
    slopes = []
    for step in (1e-3, 5e-4, 2.5e-4):
        places = (phi + side * step * pitch for side in (-1.0, 1.0))
        ends = [sweep_ste(meshed, model.elasticity_at, place, at_torques([TORQUE])).ste_um[0] for place in places]
        slopes.append((ends[1] - ends[0]) / (2.0 * step))  # um per pitch
    assert np.abs(slopes[0] - slopes[1]).max() < 0.02
    assert np.abs(slopes[1] - slopes[2]).max() < 0.02
