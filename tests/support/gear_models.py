"""Gears and meshed pairs that several tests share, built once."""

import math
from functools import cache

from pmor.body.elastic_gear import elastic_gear
from pmor.fe.sector import build_sector
from pmor.gear.meshed_pair import Flank
from pmor.gear.pair import GearPair, zero_backlash_centre_distance
from pmor.gear.tooth import Tooth
from pmor.penalty.pair import ContactScheme, PenaltyPair

MODULE, ALPHA, WIDTH = 4.0, math.radians(20.0), 20.0
YOUNG, POISSON = 210e3, 0.3
SCHEME = {
    "surface": "hermite",
    "projection": "patch",
    "slave": "tip",
    "edge_normals": "parabolic",
    "lodm_profile": 4,
    "lodm_width": 1,
    "penalty": 1e6,
}


def tooth(teeth, shift=0.0, helix_deg=0.0, **others):
    """A tooth of the paper's module and pressure angle."""
    return Tooth(teeth, MODULE, ALPHA, helix_angle=math.radians(helix_deg), profile_shift=shift, **others)


def gear_pair(pinion, wheel, extra_distance=0.0):
    """Two gears at the zero-backlash centre distance plus `extra_distance` (mm)."""
    return GearPair(pinion, wheel, WIDTH, zero_backlash_centre_distance(pinion, wheel) + extra_distance)


def helical_pair(module, teeth, helix_deg, shift, width, distance=None):
    """Two gears of opposite hand and the same shift; without a centre distance (mm) they have no backlash."""
    gears = [Tooth(z, module, ALPHA, math.radians(hand * helix_deg), shift)
             for z, hand in zip(teeth, (1.0, -1.0), strict=True)]  # fmt: skip
    return GearPair(*gears, width, distance or zero_backlash_centre_distance(*gears))


@cache
def sector(gear, elements, across, spacing="roll_angle", order=1):
    """Sector mesh of a gear whose bore is half as large as its root circle."""
    return build_sector(gear, 0.5 * gear.root_radius, WIDTH, elements, across, spacing, order=order)


@cache
def body(gear, elements, across, element="hex8i"):
    """Elastic gear that covers all the teeth that windows grown to the whole flank can load together."""
    return elastic_gear(sector(gear, elements, across), YOUNG, POISSON, element, neighbours=2)


def meshed_pair(pair, elements, across, **scheme):
    """Contact model of a pair; keyword arguments change the scheme."""
    chosen = ContactScheme(**(SCHEME | scheme))
    flanks = []
    for gear in (pair.pinion, pair.wheel):
        mesh = sector(gear, elements, across)
        flanks.append(Flank(mesh.flank_nodes, mesh.flank_roll_angle))
    return PenaltyPair(pair, *flanks, 0.067 * YOUNG * WIDTH, scheme=chosen)
