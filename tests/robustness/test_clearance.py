"""Pairs that are accepted run: held against the outlines of all teeth in mesh, vertex by vertex, over a full pitch."""

import math
import re
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.case import make_case
from pmor.core.errors import GeometryError
from pmor.gear.clearance import (
    ROUNDED,
    below_form_circle,
    clearance_warnings,
    least_gap,
    refuse_interference,
    tip_clearance,
    tip_land,
)
from pmor.gear.pair import GearPair, zero_backlash_centre_distance
from pmor.gear.tip_edge import tip_edge
from pmor.gear.tooth import Tooth
from pmor.pair.model import gear_pair as pair_of_case
from tests.support.gear_models import gear_pair, tooth
from tests.support.remedies import followed

OVERLAP = ROUNDED + 1e-6  # mm; cuts of rounded dimensions are let pass
# Points on fillet and on flank, of which every so many are held against the mate: chords of its fillet cut 1e-8 mm off.
POINTS, EVERY, POSITIONS, TEETH = 4001, 10, 48, 3
REASONS = {
    "tip clearance": "tip circle reaches .* mm below .* root circle.* must not be below 0: (reduce|raise)",
    "fillet": "tip cuts .* mm into .* fillet, more than 0: (reduce|raise)",
    "contact ratio": r"contact ratio \S+ is below 1: .*raise .pinion. addendum",
    "pointed": "pointed below its tip circle .* reduce",
    "undercut": "undercut leaves .*; raise",
    "rack": "too large for the rack tooth .*: (write at most|reduce)",
    "shifts": "profile shifts add up to .* raise",
}


def outline(tooth):
    """Radius and half angle of a tooth, from the root circle over fillet and flank to the tip's middle."""
    flank = tooth.flank_section(np.linspace(tooth.form_roll_angle, tooth.tip_roll_angle, POINTS))
    points = np.concatenate([tooth.root_section(np.linspace(1.0, 0.0, POINTS)), flank])
    radius, half = np.hypot(*points.T), np.arctan2(-points[:, 0], points[:, 1])
    tip = np.linspace(half[-1], 0.0, 20)[1:]
    return np.append(radius, np.full(len(tip), radius[-1])), np.append(half, tip)


def depths(points, radius, half, pitch):
    """How deep points (complex, in the frame of a tooth) are in a gear with that outline, normal to it, mm."""
    distance = np.abs(points)
    angle = np.abs((np.angle(points / 1j) + 0.5 * pitch) % pitch - 0.5 * pitch)
    rising = slice(0, 2 * POINTS)
    r, h = radius[rising], half[rising]
    at = np.clip(np.searchsorted(r, distance) - 1, 0, len(r) - 2)
    run = np.maximum(r[at + 1] - r[at], 1e-300)
    slope = (h[at + 1] - h[at]) / run
    arc = (h[at] + slope * (distance - r[at]) - angle) * distance
    depth = np.minimum(arc / np.hypot(1.0, slope * distance), r[-1] - distance)
    return np.where(distance >= r[-1], -np.inf, np.where(distance <= r[0], r[0] - distance, depth))


def deepest_overlap(pair):
    """Deepest vertex of either gear's outline in the other, over a pitch with the working flanks in contact, mm."""
    outlines = [outline(gear) for gear in (pair.pinion, pair.wheel)]
    sides = [r * np.exp(1j * (0.5 * np.pi + h)) for r, h in outlines]
    both = [np.concatenate([side[::EVERY], -side[::EVERY].conj(), side[2 * POINTS - 1 :]]) for side in sides]
    deepest = -math.inf
    for roll in np.arange(POSITIONS) / POSITIONS * pair.pitch:
        turns = [np.exp(1j * roll), np.exp(1j * (math.pi + pair.wheel_tooth_rotation(roll)))]
        centres = [0.0, 1j * pair.centre_distance]
        for own, mate in ((0, 1), (1, 0)):
            gears = pair.pinion, pair.wheel
            steps = np.exp(1j * gears[own].angular_pitch * np.arange(-TEETH, TEETH + 1))
            placed = np.outer(steps, both[own]) * turns[own] + centres[own]
            seen = (placed.ravel() - centres[mate]) / turns[mate]
            near = seen[np.abs(seen) < gears[mate].tip_radius]
            if len(near):
                deepest = max(deepest, float(depths(near, *outlines[mate], gears[mate].angular_pitch).max()))
    return deepest


def random_pair(rng):
    """A pair about the limits of clearance, undercut, pointed tips and contact ratio 1; GeometryError where none is."""
    module, alpha = rng.uniform(1.0, 5.0), math.radians(rng.choice([20.0, rng.uniform(14.5, 28.0)]))

    def gear(most):
        return Tooth(
            int(rng.integers(8, most)), module, alpha, profile_shift=rng.choice([0.0, rng.uniform(-0.6, 1.0)]),
            addendum=rng.uniform(0.7, 1.35), dedendum=rng.uniform(0.95, 1.45), rack_tip_radius=rng.uniform(0.0, 0.38),
        )  # fmt: skip

    pinion, wheel = gear(60), gear(150)
    distance = zero_backlash_centre_distance(pinion, wheel) + module * rng.choice([0.0, rng.uniform(0.0, 0.3)])
    return GearPair(pinion, wheel, 10.0, distance)


def check_pairs(count, seed):
    """Hold random pairs against their outlines; return how many were accepted, and refused for which reason."""
    rng, tally, worst = np.random.default_rng(seed), Counter(), -math.inf
    for number in range(count):
        pair, refusal = None, ""
        try:
            pair = random_pair(rng)
            refuse_interference(pair)
        except GeometryError as error:
            refusal = str(error)
        if refusal:
            (reason,) = (name for name, words in REASONS.items() if re.search(words, refusal))
            tally[reason] += 1
            assert pair is None or deepest_overlap(pair) > 0.0, f"pair {number} has room, yet: {refusal}"
            tally["remedies"] += len(followed(pair, refusal)) if pair else 0
            continue
        overlap = deepest_overlap(pair)
        assert overlap < OVERLAP, f"pair {number} overlaps by {overlap} mm: {pair}"
        worst = max(worst, overlap)
        tally["accepted"] += 1
    return tally, worst


def test_random_pairs_run_without_overlap_or_are_refused_with_the_reason():
    tally, _ = check_pairs(30, 1)
    assert tally["remedies"] > 5
    assert tally["accepted"] > 5
    assert tally["fillet"] > 1


def both(distance=0.0, **keys):
    return gear_pair(tooth(21, **keys), tooth(21, **keys), distance)


@pytest.mark.parametrize(
    ("pair", "message"),
    [
        (lambda: both(addendum=1.3), "pinion's tip circle reaches 0.2 mm below the wheel's root circle"),
        (lambda: both(dedendum=0.9), "tip circle reaches 0.4 mm below"),
        (lambda: gear_pair(tooth(60, addendum=1.2), tooth(15, addendum=1.2)), "pinion's tip cuts 0.118 mm into the wh"),
        (lambda: both(shift=1.0), "tip circle reaches 0.5225 mm below"),
        (lambda: gear_pair(tooth(15, addendum=1.2), tooth(60, addendum=1.2)), "wheel's tip cuts 0.118 mm into the pin"),
    ],
)
def test_gears_that_cannot_run_are_refused_with_number_limit_and_remedy(pair, message):
    with pytest.raises(GeometryError, match=message + ".*(0|than 0): reduce .*addendum"):
        refuse_interference(pair())


def test_a_rack_without_room_for_the_usual_tip_radius_gets_the_largest_and_no_larger_one_is_taken():
    settings = {"teeth": 21, "bore_radius_mm": 20.0, "module_mm": 4.0, "face_width_mm": 20.0, "torque_Nm": 100.0}
    case = make_case(**settings, pressure_angle_deg=25.0)
    radius = case.pair.pinion.rack_tip_radius
    # The rounding touches both flanks of the rack tooth and its tip: all of it lies on a circle in the middle.
    sine, cosine = math.sin(math.radians(25.0)), math.cos(math.radians(25.0))
    half_space = 0.25 * math.pi - (1.25 - radius * (1.0 - sine)) * sine / cosine
    assert_allclose(half_space, radius * cosine, atol=1e-4)
    pair_of_case(case)
    assert make_case(**settings).pair.pinion.rack_tip_radius == 0.38
    with pytest.raises(GeometryError, match=f"rack_tip_radius = 0.32: .* write at most {radius}"):
        pair_of_case(make_case(**settings, pressure_angle_deg=25.0, rack_tip_radius=0.32))


def test_a_case_of_gears_that_cannot_run_is_refused():
    case = make_case(teeth=21, addendum=1.3, bore_radius_mm=20.0, module_mm=4.0, face_width_mm=20.0, torque_Nm=100.0)
    with pytest.raises(GeometryError, match="tip circle reaches"):
        pair_of_case(case)


def test_clearance_land_and_overreach_are_those_of_the_textbook():
    pair = gear_pair(tooth(17, 0.3), tooth(31), 0.2)
    for gear, (own, mate) in enumerate(((pair.pinion, pair.wheel), (pair.wheel, pair.pinion))):
        assert_allclose(tip_clearance(pair, gear), pair.centre_distance - own.tip_radius - mate.root_radius)
    alpha_tip = math.acos(pair.pinion.base_radius / pair.pinion.tip_radius)
    thickness = 0.5 * math.pi / 17 + 2 * 0.3 * math.tan(math.radians(20)) / 17 + math.tan(math.radians(20))
    half = thickness - math.radians(20) - math.tan(alpha_tip) + alpha_tip
    assert_allclose(tip_land(pair.pinion), 2.0 * pair.pinion.tip_radius * half, rtol=1e-12)
    undercut = gear_pair(tooth(10), tooth(30))
    lost = (
        undercut.pinion.form_roll_angle
        - (undercut.action_length - undercut.wheel.tip_roll_angle * undercut.wheel.base_radius)
        / undercut.pinion.base_radius
    )
    assert_allclose(below_form_circle(undercut, 0), lost * undercut.pinion.base_radius, rtol=1e-12)
    assert below_form_circle(undercut, 1) == 0.0


def test_the_tip_corner_just_touches_the_flank_at_the_end_of_the_path_and_no_more():
    for gear in (0, 1):
        assert 0.0 <= least_gap(both(), gear)[0] < 1e-7


def test_an_ordinary_pair_is_not_worth_a_word_and_unusual_ones_are_named_with_the_number():
    assert clearance_warnings(both()) == ()
    tight = clearance_warnings(both(addendum=1.1, dedendum=1.17, rack_tip_radius=0.2))
    assert len(tight) == 2
    assert "tip clearance of the pinion is 0.28 mm, 0.07 modules, below the 0.1" in tight[0]
    narrow = clearance_warnings(gear_pair(tooth(12, 0.7), tooth(40, addendum=0.8)))
    assert re.match(r"tip land of the pinion is \S+ mm, 0.11 modules, below the 0.2", narrow[0])
    short = clearance_warnings(gear_pair(tooth(10), tooth(30)))
    assert re.match(r"the wheel's tip reaches 4.95 mm .* beyond the pinion's form circle.* contact ratio of", short[0])


PLANET = {"module_mm": 4.0, "face_width_mm": 20.0, "torque_Nm": 100.0,
          "pinion": {"teeth": 22, "bore_radius_mm": 15.0, "rack_tip_radius": 0.25}}  # fmt: skip
RING = {"teeth": 61, "internal": True, "rim_thickness_mm": 20.0}


def test_a_tip_that_is_chamfered_or_rounded_clears_what_its_sharp_corner_would_cut():
    """A planet's fillet, of the rack 1.25 and 0.25, under tips of addendum 1: 12.5 um of the sharp ones."""
    with pytest.raises(GeometryError, match="the wheel's tip cuts 0.0125 mm into the pinion's fillet"):
        pair_of_case(make_case("sharp", **PLANET, wheel=RING))
    shorter = pair_of_case(make_case("short", **PLANET, wheel=RING | {"addendum": 0.9}))
    bare = replace(shorter, wheel=replace(shorter.wheel, addendum=1.0), wheel_edge=None)
    sharp = least_gap(bare, 1)[0]
    for edge in ("rounding", "chamfer"):
        gaps = [least_gap(replace(bare, wheel_edge=tip_edge(bare.wheel, **{edge: size})), 1)[0]
                for size in (1e-7, 0.01, 0.02, 0.5)]  # fmt: skip
        assert_allclose(gaps[0], sharp, atol=1e-6)  # that of the sharp corner as it vanishes
        assert sharp < gaps[1] < gaps[2] < 0.0 <= gaps[3] < 1e-7, edge  # at the end of the path
        pair_of_case(make_case(edge, **PLANET, wheel=RING | {f"tip_{edge}_mm": 0.5}, contact={"scheme": "line"}))
