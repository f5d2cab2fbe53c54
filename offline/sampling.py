"""Where full FE is solved: a uniform grid of pinion angles over one pitch, commensurate with it."""

from __future__ import annotations

import math

import numpy as np

from pmor.contact.flank import MeshedPair
from pmor.contact.position import overshoot
from pmor.contact.solve import WINDOW_MARGIN
from pmor.gear.conventions import FloatArray
from pmor.gear.pair import GearPair


def training_angles(pair: GearPair, angles_per_pitch: int) -> FloatArray:
    """Return the pinion angles of the full solves, shape (angles_per_pitch,), rad.

    They begin where a pair enters the path of contact, so that its first and last positions are sampled closely.
    """
    return np.asarray(pair.roll_position_range[0] + pair.pitch * np.arange(angles_per_pitch) / angles_per_pitch)


def roll_position_grid(meshed: MeshedPair, angles_per_pitch: int, largest_torque: float) -> FloatArray:
    """Return the roll positions of one tooth pair that the training angles visit, shape (M,), rad.

    Parameters
    ----------
    meshed : MeshedPair
    angles_per_pitch : int
    largest_torque : float
        N mm: how far beyond the path of contact deflected teeth can touch.

    Returns
    -------
    ndarray
        The training angles continued on both sides until no pair can touch.
    """
    pair = meshed.pair
    step = pair.pitch / angles_per_pitch
    first, last = pair.roll_position_range
    margin = overshoot(meshed, WINDOW_MARGIN * meshed.expected_approach(largest_torque))
    before = math.ceil(margin / step) + 1
    after = math.ceil((last - first + margin) / step) + 1
    return np.asarray(first + step * np.arange(-before, after + 1))
