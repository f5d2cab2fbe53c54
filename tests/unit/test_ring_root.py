"""Roots of internal gears: the envelope of a cutter that is rolled by brute force, arcs, and what cannot be cut."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.core.errors import GeometryError
from pmor.gear.involute import involute_function
from pmor.gear.pair import zero_backlash_centre_distance
from pmor.gear.ring_root import Shaper
from pmor.gear.tooth import Tooth
from tests.support.internal_pairs import ALPHA, depth_in, ring

EXACT = 1e-9
# mm: how near points of a cutter come to the fillet; chords of the outline cut off less than the other.
TOUCHES, ENTERS = 2e-4, 1e-6
CUTTERS = [
    Shaper(23), Shaper(23, tip_radius=0.8), Shaper(31, 1.3, 0.4, 0.25), Shaper(21, 1.2, 0.2, -0.1),
]  # fmt: skip


def cutter_side(shaper, module):
    """Points of one side of a cutter's tooth, complex, centred on +y: involute, rounding and half of the tip land."""
    base, tip = (0.5 * module * shaper.teeth * f for f in (math.cos(ALPHA), 1.0))
    tip += module * (shaper.addendum + shaper.profile_shift)
    half = (0.5 * math.pi + 2.0 * math.tan(ALPHA) * shaper.profile_shift) / shaper.teeth + involute_function(ALPHA)
    rho = shaper.tip_radius
    # Where the circle that rolls off the tip touches the involute: found by bisection on its distance from the tip.
    low, high = 0.0, math.sqrt((tip / base) ** 2 - 1.0)
    for _ in range(100):
        roll = 0.5 * (low + high)
        below = math.hypot(base, base * roll - rho) + rho < tip
        low, high = (roll, high) if below else (low, roll)
    rolls = np.linspace(0.02, roll, 150)
    flank = base * np.exp(1j * (0.5 * math.pi + half - rolls)) * (1.0 + 1j * rolls)
    centre = base * np.exp(1j * (0.5 * math.pi + half - roll)) * (1.0 + 1j * (roll - rho / base))
    arc = centre + rho * np.exp(1j * np.linspace(math.pi + half - roll, np.angle(centre), 80))
    land = tip * np.exp(1j * np.linspace(np.angle(centre), 0.5 * math.pi, 20))
    return np.concatenate([flank, arc, land])


@pytest.mark.parametrize("shift", [0.0, -0.3])
@pytest.mark.parametrize("shaper", CUTTERS)
def test_a_rolled_cutter_touches_the_whole_fillet_and_enters_nothing(shaper, shift):
    """The cutter's tooth is turned through the ring's space, and seen from the ring."""
    made = ring(61, 4.0, shaper=shaper, profile_shift=shift, addendum=0.8)
    drawn = Tooth(shaper.teeth, 4.0, ALPHA, profile_shift=shaper.profile_shift, dedendum=0.9, rack_tip_radius=0.0)
    distance = zero_backlash_centre_distance(drawn, ring(61, 4.0, profile_shift=shift))
    side = cutter_side(shaper, 4.0)
    turned = np.linspace(-0.45, 0.45, 2001)
    # The cutter's tooth at +y stands in the middle of a space of the ring.
    ring_turned = turned * shaper.teeth / 61.0 + math.pi / 61.0
    seen = ((side[:, None] * np.exp(1j * turned) - 1j * distance) * np.exp(-1j * ring_turned)).ravel()
    seen = seen[np.abs(seen) > -made.tip_radius]
    depth = depth_in(seen, made)
    assert depth.max() < ENTERS
    bands = np.linspace(-made.tip_radius, -made.root_radius, 13)
    for low, high in zip(bands[:-1], bands[1:], strict=True):
        assert depth[(np.abs(seen) > low) & (np.abs(seen) < high)].max() > -TOUCHES


@pytest.mark.parametrize("keys", [{"shaper": s} for s in CUTTERS] + [{"root_fillet": 0.7}])
@pytest.mark.parametrize("helix_deg", [0.0, 15.0])
def test_the_fillet_goes_on_from_the_involute_and_ends_at_the_root_circle(keys, helix_deg):
    made = ring(61, 4.0, addendum=0.8, helix_angle=math.radians(helix_deg), **keys)
    start, beside, end = made.root_section(np.array([0.0, 1e-6, 1.0]))
    roll = made.form_roll_angle
    assert_allclose(start, made.flank_section(np.array(roll)), atol=EXACT)
    assert_allclose(np.hypot(*end), -made.root_radius, rtol=EXACT)
    tangent, along = beside - start, np.diff(made.flank_section(np.array([roll, roll + 1e-6])), axis=0)[0]
    assert abs(tangent[0] * along[1] - tangent[1] * along[0]) < 1e-4 * np.linalg.norm(tangent) * np.linalg.norm(along)
    last = made.root_section(np.array([1.0 - 1e-5]))[0] - end
    assert abs(last @ end) < 1e-3 * np.linalg.norm(last) * np.linalg.norm(end)


def test_a_cutter_without_shift_leaves_its_addendum_as_dedendum():
    made = ring(61, 4.0, shaper=Shaper(23, 1.25))
    assert_allclose(made.root_radius, -(122.0 + 5.0), rtol=1e-12)
    assert_allclose(made.cut_dedendum, 1.25, rtol=1e-12)


def test_the_arc_has_the_radius_that_is_asked_for():
    x, y = ring(61, 4.0, root_fillet=0.9).root_section(np.linspace(0.0, 1.0, 50)).T
    a, b, c = np.linalg.lstsq(np.stack([2.0 * x, 2.0 * y, np.ones(50)], axis=1), x * x + y * y, rcond=None)[0]
    assert_allclose(math.sqrt(c + a * a + b * b), 0.9, rtol=1e-6)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: ring(61, 4.0, root_fillet=2.5), "root_fillet_mm = 2.5: .* has no room for it: lower it"),
        (lambda: ring(30, 4.0), "tip circle of the ring, .* inside the base circle, .*: reduce addendum"),
        (lambda: ring(61, 4.0, shaper=Shaper(12)), "inside what the shaper can cut, .* raise shaper teeth"),
        (lambda: ring(61, 4.0, shaper=Shaper(61)), "shaper teeth = 61: .* fewer teeth than its ring, 61: lower it"),
        (lambda: ring(61, 4.0, shaper=Shaper(23, tip_radius=3.0)), "tip_radius_mm = 3: .*: lower it"),
        (lambda: ring(61, 4.0, shaper=Shaper(23, 2.5)), "pointed below it: lower shaper addendum"),
        (lambda: ring(61, 4.0, shaper=Shaper(55, profile_shift=1.0)), "shaper profile_shift = 1: .* lower it"),
        (lambda: ring(61, 4.0, addendum=1.9), "lies inside the base circle"),
    ],
)
def test_rings_that_cannot_be_made_are_refused_with_the_remedy(make, message):
    with pytest.raises(GeometryError, match=message):
        make()


def test_a_ring_is_the_same_tooth_with_its_parts_replaced():
    assert replace(ring(61, 4.0), addendum=0.8) == ring(61, 4.0, addendum=0.8)
