"""Where over the pitch a variant is solved."""

from __future__ import annotations

import math

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.gear.meshed_pair import MeshedPair
from pmor.gear.pair import GearPair

# Distance of the neighbours that a special position is held against, in pitches.
NEIGHBOUR = 1e-4


def pinion_angles(meshed: MeshedPair, places: str) -> FloatArray:
    """Return the pinion angles of a variant, rad.

    ``usual``: eight positions from entry to entry, with exact entry and exit, in between with one pair more and one
    less; ``borders``: a pair's contact exactly on rows of nodes of either flank; ``ends``: exact entry and exit alone;
    ``hunting``: eight positions over the period after which the same teeth meet again.
    """
    pair = meshed.pair
    if places == "borders":
        return _borders(meshed)
    more, inside = pair.total_contact_ratio % 1.0, np.array([0.25, 0.5, 0.75])
    shares = {
        "usual": np.concatenate([[0.0], more * inside, [more], more + (1.0 - more) * inside]),
        "ends": np.array([0.0, more]),
        "hunting": math.lcm(pair.pinion.teeth, pair.wheel.teeth) * (np.arange(8) + 0.3) / 8.0,
    }
    return np.asarray(pair.meshing_range[0] + shares[places] * pair.pitch)


def mirrored_angles(pair: GearPair, phi: FloatArray, exchanged: GearPair) -> FloatArray:
    """Return the angles at which a pair with its gears exchanged stands as this one at `phi`, seen in the mirror.

    The contact then is as far from the end of the path as it was from the beginning.
    """
    share = (phi - pair.meshing_range[0]) / pair.pitch
    return np.asarray(exchanged.meshing_range[0] + (pair.total_contact_ratio - share) * exchanged.pitch)


def _borders(meshed: MeshedPair) -> FloatArray:
    pair = meshed.pair
    first, last = pair.meshing_range
    found = []
    for gear, flank in enumerate((meshed.pinion, meshed.wheel)):
        roll = flank.roll_angle
        if gear == 1:  # along the line of action, seen from the pinion
            roll = (pair.action_length - roll * pair.wheel.base_radius) / pair.pinion.base_radius
        angles = np.array([pair.roll_position(float(u)) for u in roll])
        angles = angles[(angles > first) & (angles < last)]
        found.append(angles[:: max(1, math.ceil(len(angles) / 4))])
    return np.concatenate(found)
