"""Internal pairs for tests, and the oracle that rolls pinion and ring."""

import math
from functools import lru_cache

import numpy as np

from pmor.gear.pair import GearPair, zero_backlash_centre_distance
from pmor.gear.ring_root import Shaper
from pmor.gear.tooth import Tooth

ALPHA = math.radians(20.0)
# Points on fillet and on flank, of which every so many are held against the mate; pinion angles of a pitch.
POINTS, EVERY, POSITIONS = 2001, 25, 24


def ring(teeth=60, module=2.0, **keys):
    """A ring; its teeth are written positive."""
    root = {} if "shaper" in keys or "root_fillet" in keys else {"root_fillet": 0.25 * module}
    return Tooth(-teeth, module, keys.pop("alpha", ALPHA), **root, **keys)


def internal_pair(pinion, wheel, width=20.0, closer=0.0):
    """A pair without backlash, or with the axes `closer` (mm)."""
    return GearPair(pinion, wheel, width, zero_backlash_centre_distance(pinion, wheel) + closer)


@lru_cache(maxsize=8)
def half_outline(tooth):
    """Radius (positive) and half angle of a tooth from its root to its tip."""
    flank = tooth.flank_section(np.linspace(tooth.form_roll_angle, tooth.tip_roll_angle, POINTS))
    points = np.concatenate([tooth.root_section(np.linspace(1.0, 0.0, POINTS)), flank[1:]])
    side = math.copysign(1.0, tooth.base_radius)
    return np.hypot(*points.T), np.abs(np.arctan2(-points[:, 0], side * points[:, 1]))


def whole_outline(tooth):
    """Vertices of all teeth about the gear's own axis, complex: both flanks with fillets, and the tip land."""
    radius, half = (np.append(values[:-1:EVERY], values[-1]) for values in half_outline(tooth))
    land = np.linspace(-half[-1], half[-1], 9)[1:-1]
    angle = np.concatenate([half, -half, land])
    one = np.concatenate([radius, radius, np.full(len(land), radius[-1])]) * np.exp(1j * (0.5 * np.pi + angle))
    return np.outer(np.exp(2j * np.pi * np.arange(abs(tooth.teeth)) / abs(tooth.teeth)), one).ravel()


def depth_in(points, tooth):
    """How deep points about the gear's own axis are in its material, normal to its outline, mm; negative outside."""
    radius, half = half_outline(tooth)
    outwards = np.argsort(radius)
    radius, half = radius[outwards], half[outwards]
    pitch, distance = 2.0 * np.pi / abs(tooth.teeth), np.abs(points)
    angle = np.abs((np.angle(points / 1j) + 0.5 * pitch) % pitch - 0.5 * pitch)
    at = np.clip(np.searchsorted(radius, distance) - 1, 0, len(radius) - 2)
    slope = (half[at + 1] - half[at]) / np.maximum(radius[at + 1] - radius[at], 1e-300)
    arc = (half[at] + slope * (distance - radius[at]) - angle) * distance / np.hypot(1.0, slope * distance)
    below_tip = distance - radius[0] if tooth.internal else radius[-1] - distance
    below_root = distance - radius[-1] if tooth.internal else radius[0] - distance
    return np.where(below_root > 0.0, below_root, np.minimum(arc, below_tip))


def deepest_overlap(pair, positions=POSITIONS):
    """Deepest vertex of either gear in the other while the pinion turns by a pitch, working flanks in contact, mm."""
    pinion, wheel = whole_outline(pair.pinion), whole_outline(pair.wheel)
    deepest = -math.inf
    for roll in np.arange(positions) / positions * pair.pitch:
        turn, back = np.exp(1j * roll), np.exp(1j * pair.wheel_tooth_rotation(roll))
        seen = (pinion * turn - 1j * pair.centre_distance) / back
        near = seen[np.abs(seen) > np.abs(pair.wheel.tip_radius)]
        of_wheel = (wheel * back + 1j * pair.centre_distance) / turn
        inside = of_wheel[np.abs(of_wheel) < pair.pinion.tip_radius]
        for points, gear in ((near, pair.wheel), (inside, pair.pinion)):
            if len(points):
                deepest = max(deepest, float(depth_in(points, gear).max()))
    return deepest


def random_internal_pair(rng):
    """An internal pair about the limits of interference; GeometryError where there is none."""
    module, alpha = rng.uniform(1.0, 5.0), math.radians(rng.choice([20.0, rng.uniform(17.5, 28.0)]))
    teeth = int(rng.integers(14, 60))
    wheel_teeth = teeth + int(rng.integers(4, rng.choice([16, 70])))
    pinion = Tooth(
        teeth, module, alpha, profile_shift=rng.choice([0.0, rng.uniform(-0.2, 0.6)]),
        addendum=rng.uniform(0.6, 1.15), dedendum=rng.uniform(1.1, 1.4), rack_tip_radius=rng.uniform(0.0, 0.3),
    )  # fmt: skip
    shift, addendum = rng.choice([0.0, rng.uniform(-0.5, 0.4)]), rng.uniform(0.5, 1.1)
    if rng.random() < 0.5:
        cutter = Shaper(int(rng.integers(12, wheel_teeth)), rng.uniform(1.1, 1.35), module * rng.uniform(0.0, 0.2))
        wheel = ring(wheel_teeth, module, alpha=alpha, profile_shift=shift, addendum=addendum, shaper=cutter)
    else:
        keys = {"dedendum": rng.uniform(1.1, 1.4), "root_fillet": module * rng.uniform(0.05, 0.35)}
        wheel = ring(wheel_teeth, module, alpha=alpha, profile_shift=shift, addendum=addendum, **keys)
    return internal_pair(pinion, wheel, 10.0, closer=module * rng.choice([0.0, rng.uniform(0.0, 0.2)]))
