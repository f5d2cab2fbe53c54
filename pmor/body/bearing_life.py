"""Basic reference rating life L_10r of rolling bearings by the loads of their elements, ISO/TS 16281:2008.

A row of Z elements with the loads Q, its raceways with the capacities Q_c, which a million turns leave nine of ten:

    Q_e = (mean of Q^p)^(1/p),    L_10r = {sum over rows and raceways of (Q_e / Q_c)^w}^(-1/e),    1e6 turns

            w       e       p: ring turns against the load    p: ring stands
    balls   10/3    10/9    3                                 10/3
    rollers 9/2     9/8     4                                 9/2,  summed over laminae, q_c = Q_c / m^(7/9)

and loads of laminae times the stress riser 1 - 0.01 / ln(1.985 |2 k - m - 1| / (2 m - 2)) for edges. Q_c follows from
C, that of one row C / i^(7/10) or C / i^(7/9), so that balls without clearance under a radial load have L_10 = (C /
P)^3: 0.407 and 0.389 are J_r / J_1 and J_r / J_2 of half a circle of loads (Sjoevall 1933, Lundberg and Palmgren 1947).
C without a catalogue is that of ISO 281:2007 (formulas of its f_c: ISO/TR 1281-1).

With a duty cycle damage adds up (Palmgren and Miner). Factors of reliability, lubricant and cleanliness are left out.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from pmor.body.bearing_faults import InnerGeometry
from pmor.body.roller_bearing import SphericalRollerBearing
from pmor.body.rolling_bearing import BallBearing
from pmor.core.arrays import FloatArray

# ISO 281 has larger contact angles as thrust bearings, deg.
RADIAL_UP_TO = 45.0
# ISO 281: rating factors of today's steel.
BALL_STEEL, ROLLER_STEEL, SPHERICAL_STEEL = 1.3, 1.1, 1.15
# ISO/TR 1281-1: reduction for loads that differ from the computed ones; of balls in two rows without contact angle.
BALL_REDUCTION, BALL_REDUCTION_TWO, LINE_REDUCTION = 0.95, 0.90, 0.83
# ISO/TR 1281-1: A_1, 98.0665 N, times 0.41; and for rollers, N mm.
BALL_CAPACITY, ROLLER_CAPACITY = 0.41 * 98.0665, 207.9
# ISO 281: f_c of balls is that of these grooves, of closer ones too.
INNER_GROOVE, OUTER_GROOVE = 0.52, 0.53
# Balls above this diameter, mm, have their rating with another power of it.
LARGE_BALL = 25.4
RINGS = ("inner", "outer")


def dynamic_rating_N(bearing: InnerGeometry) -> float | None:
    """Return C: as given, or that of ISO 281:2007 by inner geometry; None of thrust bearings without one, N."""
    if bearing.dynamic_rating_N is not None or not is_radial(bearing):
        return bearing.dynamic_rating_N
    gamma, angle, (diameter, length) = bearing.ratio, math.radians(bearing.contact_angle_deg), bearing.element_mm
    rows, count, turned = len(bearing.row_places), bearing.count, (1.0 - bearing.ratio) / (1.0 + bearing.ratio)
    if isinstance(bearing, BallBearing):
        inner, outer = max(bearing.inner_osculation, INNER_GROOVE), max(bearing.outer_osculation, OUTER_GROOVE) - 0.01
        both = inner / outer * (2.0 * outer - 1.0) / (2.0 * inner - 1.0)
        reduction = BALL_REDUCTION_TWO if rows == 2 and not angle else BALL_REDUCTION
        factor = (
            BALL_CAPACITY * reduction * gamma**0.3 * (1.0 - gamma) ** 1.39 / (1.0 + gamma) ** (1.0 / 3.0)
            * (2.0 * inner / (2.0 * inner - 1.0)) ** 0.41
            * (1.0 + (1.04 * turned**1.72 * both**0.41) ** (10.0 / 3.0)) ** -0.3
        )  # fmt: skip
        size = diameter**1.8 if diameter <= LARGE_BALL else 3.647 * diameter**1.4
        return float(BALL_STEEL * factor * (rows * math.cos(angle)) ** 0.7 * count ** (2.0 / 3.0) * size)
    factor = (
        ROLLER_CAPACITY * LINE_REDUCTION * gamma ** (2.0 / 9.0) * (1.0 - gamma) ** (29.0 / 27.0)
        / (1.0 + gamma) ** 0.25 * (1.0 + (1.04 * turned ** (143.0 / 108.0)) ** 4.5) ** (-2.0 / 9.0)
    )  # fmt: skip
    steel = SPHERICAL_STEEL if isinstance(bearing, SphericalRollerBearing) else ROLLER_STEEL
    size = (rows * length * math.cos(angle)) ** (7.0 / 9.0) * count**0.75 * diameter ** (29.0 / 27.0)
    return float(steel * factor * size)


def is_radial(bearing: InnerGeometry) -> bool:
    """Return whether ISO 281 has a bearing among the radial ones."""
    return abs(bearing.contact_angle_deg) <= RADIAL_UP_TO


def raceway_ratings_N(bearing: InnerGeometry, rating_N: float) -> tuple[float, float]:
    """Return Q_ci and Q_ce of a row, N, by C of all rows."""
    rows, cosine = len(bearing.row_places), math.cos(math.radians(bearing.contact_angle_deg))
    turned = (1.0 - bearing.ratio) / (1.0 + bearing.ratio)
    if isinstance(bearing, BallBearing):
        inner, outer = bearing.inner_osculation, bearing.outer_osculation
        both = inner / outer * (2.0 * outer - 1.0) / (2.0 * inner - 1.0)
        power, share, halves, ratio = 10.0 / 3.0, 0.7, (0.407, 0.389), 1.044 * turned**1.72 * both**0.41
        one = rating_N
    else:
        power, share, halves, ratio = 4.5, 7.0 / 9.0, (0.378, 0.364), 1.038 * turned ** (143.0 / 108.0)
        one = rating_N / LINE_REDUCTION
    one /= bearing.count * (rows * cosine) ** share
    whole = [(1.0 + ratio ** (way * power)) ** (1.0 / power) for way in (1.0, -1.0)]
    return one / halves[0] * whole[0], one / halves[1] * whole[1]


def stress_riser(laminae: int) -> FloatArray:
    """Return by what loads of laminae count more towards the ends of a roller, (m,)."""
    if laminae == 1:
        return np.ones(1)
    along = np.abs(2.0 * np.arange(1, laminae + 1) - laminae - 1.0) / (2.0 * laminae - 2.0)
    with np.errstate(divide="ignore"):
        return np.asarray(1.0 - 0.01 / np.log(1.985 * along))


def reference_life(
    bearing: InnerGeometry, lamina_force: FloatArray, turns: tuple[bool, bool] = (True, False)
) -> float | None:  # fmt: skip
    """Return L_10r, 1e6 turns of one ring against the other; None of thrust bearings, infinite without load.

    Parameters
    ----------
    lamina_force : ndarray, shape (r, n, m)
        `BearingState.lamina_force`.
    turns : (bool, bool)
        Whether inner and outer ring turn against the load.
    """
    rating = dynamic_rating_N(bearing)
    if rating is None or not is_radial(bearing):
        return None
    if isinstance(bearing, BallBearing):
        powers, power, shape, load, part = (10.0 / 3.0, 3.0), 10.0 / 3.0, 10.0 / 9.0, lamina_force, 1.0
    else:
        laminae = lamina_force.shape[2]
        powers, power, shape, part = (4.5, 4.0), 4.5, 9.0 / 8.0, laminae ** (-7.0 / 9.0)
        load = lamina_force * stress_riser(laminae)
    damage = 0.0
    for capacity, turning in zip(raceway_ratings_N(bearing, rating), turns, strict=True):
        mean = powers[turning]
        equivalent = np.mean((load / (part * capacity)) ** mean, axis=1) ** (1.0 / mean)
        damage += float((equivalent**power).sum())
    return damage ** (-1.0 / shape) if damage > 0.0 else math.inf


def added_up(lives: Iterable[float], shares: Iterable[float]) -> float:
    """Return the life of loads that follow each other, by the share of each in turns or hours (Palmgren and Miner)."""
    damage = sum(share / life for life, share in zip(lives, shares, strict=True))
    return math.inf if damage == 0.0 else 1.0 / damage


def hours(life: float, speed_rpm: float) -> float:
    """Return the hours of a life in 1e6 turns at the speed of one ring against the other; infinite at rest."""
    return 1e6 * life / (60.0 * abs(speed_rpm)) if speed_rpm else math.inf
