"""Where full FE is solved: pinion angles over one pitch, and the conditions at each of them.

On a grid the angles are uniform, commensurate with the pitch, and each has all conditions. Spread out, each state is
one angle with one condition: a Sobol sequence (Joe & Kuo, SIAM J. Sci. Comput. 30 (2008) 2635) fills the ranges of the
angle and of all parameters far more evenly than a grid of as many states.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from pmor.case import Case, OfflineCase
from pmor.core.arrays import FloatArray
from pmor.core.sobol import sobol_points
from pmor.gear.condition import Condition
from pmor.gear.meshed_pair import MeshedPair
from pmor.gear.pair import GearPair
from pmor.pair.conditions import condition_at, on_trained_flanks, training_values
from pmor.penalty.position import overshoot
from pmor.penalty.solve import WINDOW_MARGIN

# Of all random draws: a basis is a function of its case.
SEED = 20160919


@dataclass(frozen=True)
class TrainingPosition:
    """A pinion angle at which full FE is solved, and its conditions.

    Parameters
    ----------
    phi : float
        rad.
    """

    phi: float
    conditions: tuple[Condition, ...]


def most_positions(case: Case) -> int:
    """Return how many positions a training solves; of a greedy sampling, at most."""
    if not case.reduction.trained:
        return 0
    return case.offline.angles_per_pitch if case.offline.sampling == "grid" else case.offline.solves


def on_flanks_of(case: Case, positions: Iterable[TrainingPosition]) -> tuple[TrainingPosition, ...]:
    """Return positions with the flanks on which a case trains."""
    return tuple(replace(p, conditions=on_trained_flanks(case, p.conditions)) for p in positions)


def planned_positions(offline: OfflineCase, pair: GearPair) -> tuple[TrainingPosition, ...]:
    """Return the positions of a sampling that is known beforehand."""
    if offline.sampling == "grid":
        return grid_positions(offline, pair)
    return sobol_positions(offline, pair, offline.solves)


def grid_positions(offline: OfflineCase, pair: GearPair) -> tuple[TrainingPosition, ...]:
    """Return every training angle with every combination of torque and axes."""
    conditions = tuple(condition_at(values) for values in product(*training_values(offline)))
    return tuple(TrainingPosition(float(phi), conditions) for phi in training_angles(pair, offline.angles_per_pitch))


def sobol_positions(offline: OfflineCase, pair: GearPair, count: int, seed: int = SEED) -> tuple[TrainingPosition, ...]:
    """Return states of one condition each, spread over the pitch and over the ranges of all parameters.

    Parameters
    ----------
    offline : OfflineCase
        Its lists span the ranges; a list of one value is no dimension.
    """
    values = training_values(offline)
    low, high = np.array([v[0] for v in values]), np.array([v[-1] for v in values])
    free = np.flatnonzero(high > low)
    points = sobol_points(1 + len(free), math.ceil(math.log2(max(count, 2))), seed)[:count]
    states = np.tile(low, (count, 1))
    states[:, free] += points[:, 1:] * (high - low)[free]
    angles = pair.meshing_range[0] + pair.pitch * points[:, 0]
    return tuple(
        TrainingPosition(float(phi), (condition_at(state),)) for phi, state in zip(angles, states, strict=True)
    )


def first_positions(offline: OfflineCase, pair: GearPair) -> tuple[TrainingPosition, ...]:
    """Return the first positions of a greedy sampling: the training angles under the largest torque, mid deviations."""
    *deviations, torques = training_values(offline)
    condition = condition_at([*(0.5 * (v[0] + v[-1]) for v in deviations), torques[-1]])
    angles = training_angles(pair, offline.angles_per_pitch)
    return tuple(TrainingPosition(float(phi), (condition,)) for phi in angles)


def training_angles(pair: GearPair, angles_per_pitch: int) -> FloatArray:
    """Return the pinion angles of the full solves, shape (angles_per_pitch,), rad.

    They begin where a pair comes into mesh, so that its first and last positions are sampled closely.
    """
    return np.asarray(pair.meshing_range[0] + pair.pitch * np.arange(angles_per_pitch) / angles_per_pitch)


def roll_position_grid(meshed: MeshedPair, angles_per_pitch: int, largest_torque: float) -> FloatArray:
    """Return the roll positions of one tooth pair that the training angles visit, shape (M,), rad.

    Parameters
    ----------
    largest_torque : float
        N mm: how far beyond the path of contact deflected teeth can touch.

    Returns
    -------
    ndarray
        The training angles continued on both sides until no pair can touch.
    """
    pair = meshed.pair
    step = pair.pitch / angles_per_pitch
    first, last = pair.meshing_range
    margin = overshoot(meshed, WINDOW_MARGIN * meshed.expected_approach(largest_torque))
    before = math.ceil(margin / step) + 1
    after = math.ceil((last - first + margin) / step) + 1
    return np.asarray(first + step * np.arange(-before, after + 1))
