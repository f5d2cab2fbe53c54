"""Involute, trochoid and circles of a generated tooth, against identities and against a rack moved by brute force."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.core.errors import GeometryError
from pmor.gear.involute import inverse_involute, involute_function
from pmor.gear.pair import GearPair, zero_backlash_centre_distance
from pmor.gear.tip_edge import tip_edge
from pmor.gear.tooth import Tooth

MODULE, ALPHA = 4.0, math.radians(20.0)
EXACT = 1e-12  # relative; closed forms differ by round-off only
DIFFERENCES = 1e-7  # central differences with a step of 1e-5 lose half of the digits
# The rack moves in steps of 5 um: its rounding of radius 1.5 mm leaves scallops of (5 um)^2 / (8 x 1.5 mm) = 2e-6 mm.
ENVELOPE = 3e-6  # mm

GEARS = {
    "paper": Tooth(21, MODULE, ALPHA),
    "shifted": Tooth(17, MODULE, ALPHA, profile_shift=0.4),
    "negative shift": Tooth(31, MODULE, ALPHA, profile_shift=-0.3),
    "large": Tooth(120, MODULE, ALPHA),
    "helical": Tooth(21, MODULE, ALPHA, helix_angle=math.radians(15.0)),
    "helical shifted": Tooth(17, MODULE, ALPHA, helix_angle=math.radians(-25.0), profile_shift=0.2),
    "undercut 10": Tooth(10, MODULE, ALPHA),
    "undercut 8": Tooth(8, MODULE, ALPHA),
    "undercut 8 helical": Tooth(8, MODULE, ALPHA, helix_angle=math.radians(15.0)),
}
every_gear = pytest.mark.parametrize("tooth", GEARS.values(), ids=GEARS.keys())


def rolls(tooth, count=9):
    return np.linspace(tooth.form_roll_angle, tooth.tip_roll_angle, count)


def half_angle(points):
    """Angle of points of the loaded flank from the tooth's centre line."""
    return np.arctan2(-points[..., 0], points[..., 1])


# --- circles and involute ------------------------------------------------------------------------------------------


@every_gear
def test_roll_angle_is_unwound_length_over_base_radius(tooth):
    u = rolls(tooth)
    points = tooth.flank_section(u)
    radius = np.linalg.norm(points, axis=1)
    assert_allclose(np.sqrt(radius**2 - tooth.base_radius**2), tooth.base_radius * u, rtol=EXACT)
    assert_allclose([tooth.roll_angle_at(r) for r in radius], u, rtol=EXACT)
    assert_allclose(half_angle(points), [tooth.half_thickness_angle(x) for x in u], rtol=EXACT)
    assert_allclose(radius[-1], tooth.tip_radius, rtol=EXACT)


@every_gear
def test_flank_normal_equals_the_numerical_one_and_points_out_of_the_tooth(tooth):
    u, z = np.meshgrid(rolls(tooth, 5)[1:], np.linspace(-8.0, 8.0, 3))
    step = 1e-5
    along_u = tooth.flank_point(u + step, z) - tooth.flank_point(u - step, z)
    along_z = tooth.flank_point(u, z + step) - tooth.flank_point(u, z - step)
    numerical = np.cross(along_z, along_u)
    numerical /= np.linalg.norm(numerical, axis=-1, keepdims=True)
    normals = tooth.flank_normal(u, z)
    assert_allclose(normals, numerical, atol=DIFFERENCES, rtol=0)
    outside = half_angle(tooth.flank_point(u, 0 * z) + 1e-3 * tooth.flank_normal(u, 0 * z))
    assert np.all(outside > half_angle(tooth.flank_point(u, 0 * z)))


# --- root fillet ---------------------------------------------------------------------------------------------------


@every_gear
def test_fillet_falls_steadily_from_the_involute_to_the_root_circle_amid_the_gap(tooth):
    fillet = tooth.root_section(np.linspace(0.0, 1.0, 200))
    radius = np.linalg.norm(fillet, axis=1)
    assert_allclose(fillet[0], tooth.flank_section(tooth.form_roll_angle), rtol=1e-9)
    assert_allclose(radius[-1], tooth.root_radius, rtol=EXACT)
    assert np.all(np.diff(radius) < 0.0)
    assert half_angle(fillet).max() <= math.pi / tooth.teeth + 1e-12


def rack_cuts(tooth, radius, angle):
    """Whether the rolling rack removes points (radius, angle from the tooth's centre), by trying all its positions."""
    beta, rho = tooth.helix_angle, tooth.rack_tip_radius * MODULE
    bottom = (tooth.profile_shift - tooth.dedendum) * MODULE + rho  # centre line of the tip rounding
    half = 0.25 * math.pi * MODULE + (rho - tooth.dedendum * MODULE) * math.tan(ALPHA) - rho / math.cos(ALPHA)
    shift = np.linspace(-25.0, 25.0, 10001)
    polar = np.asarray(angle)[..., None] + shift / tooth.reference_radius
    along = np.asarray(radius)[..., None] * np.sin(polar) - shift  # the gear turns clockwise, the rack moves along
    # Distance from the middle of a rack tooth in the normal section, height above the centre line of its rounding.
    s = np.abs(along * math.cos(beta) % (math.pi * MODULE) - 0.5 * math.pi * MODULE)
    h = np.asarray(radius)[..., None] * np.cos(polar) - tooth.reference_radius - bottom
    # Distance to the rack tooth less its rounding, a trapezium: its bottom, its corner, its flank.
    flank = (s - half) * math.cos(ALPHA) - h * math.sin(ALPHA)
    foot = (s - half) * math.sin(ALPHA) + h * math.cos(ALPHA)
    distance = np.where(foot > 0.0, flank, np.where(s < half, -h, np.hypot(s - half, h)))
    inside = (h > 0.0) & (flank <= 0.0)
    return np.any(inside | (distance < rho), axis=-1)


def generated_half_angle(tooth, radius):
    """Largest angle from the tooth's centre that the rack leaves standing, by bisection."""
    low, high = np.zeros_like(radius), np.full_like(radius, math.pi / tooth.teeth)
    for _ in range(30):
        middle = 0.5 * (low + high)
        cut = rack_cuts(tooth, radius, middle)
        low, high = np.where(cut, low, middle), np.where(cut, middle, high)
    return low


@every_gear
def test_profile_is_the_envelope_of_the_rolling_rack(tooth):
    form = np.linalg.norm(tooth.flank_section(tooth.form_roll_angle))
    on_flank = np.linspace(form + 0.02, tooth.tip_radius, 6)
    involute = [tooth.half_thickness_angle(tooth.roll_angle_at(r)) for r in on_flank]
    assert_allclose(generated_half_angle(tooth, on_flank) * on_flank, involute * on_flank, atol=ENVELOPE, rtol=0)
    fillet = tooth.root_section(np.linspace(0.02, 0.9, 6))
    radius = np.linalg.norm(fillet, axis=1)
    assert_allclose(generated_half_angle(tooth, radius) * radius, half_angle(fillet) * radius, atol=ENVELOPE, rtol=0)


def test_undercut_is_solved_once_per_tooth(monkeypatch):
    tooth, sound = Tooth(10, MODULE, ALPHA), GEARS["paper"]
    pair = GearPair(tooth, sound, 20.0, zero_backlash_centre_distance(tooth, sound))
    expected = tooth.form_roll_angle, pair.contact_ratio

    def again(self, tau):
        raise AssertionError("the fillet is intersected with the flank again")

    monkeypatch.setattr(Tooth, "_trochoid", again)
    assert (tooth.form_roll_angle, pair.contact_ratio) == expected


@pytest.mark.parametrize(
    ("teeth", "shift", "helix_deg"),
    [*((z, 0.0, 0.0) for z in (8, 10, 14, 17, 18, 21, 40, 400)), (10, 0.3, 0.0), (10, 0.5, 0.0), (12, 0.0, 25.0),
     (13, 0.0, 25.0), (14, 0.0, 25.0), (300, 0.0, 25.0)],
)  # fmt: skip
def test_undercut_follows_the_textbook_limit(teeth, shift, helix_deg):
    # Without rounding the rack's last straight point is at addendum height 1.25 - 0.38 (1 - sin alpha): z_min from it.
    gear = Tooth(teeth, MODULE, ALPHA, helix_angle=math.radians(helix_deg), profile_shift=shift)
    height = 1.25 - 0.38 * (1.0 - math.sin(ALPHA)) - shift
    limit = 2.0 * height * math.cos(gear.helix_angle) / math.sin(gear.transverse_pressure_angle) ** 2
    assert gear.is_undercut == (teeth < limit)


# --- what cannot be made -------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"teeth": 8, "profile_shift": 0.8}, "pointed"),
        ({"teeth": 21, "addendum": 2.2}, "pointed"),
        ({"teeth": 21, "rack_tip_radius": 0.6}, "too large for the rack tooth"),
        ({"teeth": 5, "addendum": 0.4, "profile_shift": -0.4}, "undercut leaves"),
        ({"teeth": 2, "pressure_angle": 0.17, "profile_shift": -3.0, "dedendum": 2.0}, "leaves no involute"),
    ],
)
def test_impossible_teeth_are_refused(arguments, message):
    with pytest.raises(GeometryError, match=message):
        Tooth(**{"module": MODULE, "pressure_angle": ALPHA} | arguments)


def test_largest_rack_rounding_is_the_full_fillet():
    full = (0.25 * math.pi - 1.25 * math.tan(ALPHA)) * math.cos(ALPHA) / (1.0 - math.sin(ALPHA))
    Tooth(21, MODULE, ALPHA, rack_tip_radius=full - 1e-6)
    with pytest.raises(GeometryError, match="too large"):
        Tooth(21, MODULE, ALPHA, rack_tip_radius=full + 1e-6)


@pytest.mark.parametrize("degrees", [0.01, 1.0, 14.5, 20.0, 45.0, 70.0, 85.0])
def test_inverse_involute_undoes_the_involute(degrees):
    angle = math.radians(degrees)
    # tan(a) - a loses the leading digits of small angles.
    assert_allclose(inverse_involute(involute_function(angle)), angle, rtol=1e-12 + 1e-16 / angle**3)


@every_gear
def test_the_sagitta_of_the_helix_is_where_a_chord_between_two_sections_runs_below_the_tip(tooth):
    """Along the normal in the middle of both; the next term of the helix is (twist times spacing)^2 / 48 of it."""
    spacing = 0.5
    low, middle, high = tooth.flank_point(tooth.tip_roll_angle, spacing * np.array([-0.5, 0.0, 0.5]))
    normal = tooth.flank_normal(tooth.tip_roll_angle, 0.0)
    assert_allclose(tooth.helix_sagitta(spacing), (middle - 0.5 * (low + high)) @ normal, rtol=1e-4, atol=1e-15)


def largest_edge(tooth, kind):
    """Largest rounding or chamfer that a tip has room for, mm, by bisection."""
    low, high = 0.0, MODULE
    for _ in range(50):
        middle = 0.5 * (low + high)
        try:
            tip_edge(tooth, **{kind: middle})
        except GeometryError as error:
            assert "half of the tip land" in str(error)  # noqa: PT017
            high = middle
        else:
            low = middle
    return low


@pytest.mark.parametrize("name", ["paper", "shifted", "helical"])
def test_edges_take_half_of_the_tip_land_at_most(name):
    tooth = GEARS[name]
    tip = tooth.flank_section(np.array([tooth.tip_roll_angle]))[0]
    half_land = tooth.tip_radius * abs(math.atan2(tip[0], tip[1]))
    assert_allclose(largest_edge(tooth, "chamfer"), half_land, rtol=1e-9)
    # The centre of the largest rounding is in the middle of the tooth: below the flank by its radius.
    radius = largest_edge(tooth, "rounding")
    roll = tip_edge(tooth, rounding=radius).roll_angle
    (x, y), normal = tooth.flank_section(np.array([roll]))[0], tooth.flank_normal(roll, 0.0)[:2]
    centre = np.array([x, y]) - radius * normal / np.linalg.norm(normal)
    assert_allclose(centre, [0.0, tooth.tip_radius - radius], rtol=0.0, atol=1e-9)
