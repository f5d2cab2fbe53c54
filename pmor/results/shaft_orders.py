"""Orders of the transmission error over the pitches of a sweep, named by what makes them: mesh, holes, sidebands.

Where the teeth of a gear differ, by holes in its web or by pitch deviations, the error repeats after several pitches
only. With N_1 and N_2 holes on z_1 and z_2 teeth its orders, in periods to a pitch, are

    k = m + n_1 N_1 / z_1 + n_2 N_2 / z_2,

m, n_1 and n_2 whole numbers: orders m of the mesh with sidebands n holes apart, and those of the holes alone, m = 0.
"""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from math import gcd

import numpy as np

from pmor.core.shown import in_notebooks
from pmor.results.sweep import SteSweep, orders_of

# Orders that are listed: the largest ones, but for those below a share of the largest.
MOST_LISTED, LEAST_SHARE = 24, 1e-4
GEARS = "pinion", "wheel"


@in_notebooks
@dataclass(frozen=True)
class ShaftOrder:
    """One order of the transmission error.

    Parameters
    ----------
    name : str
        What makes it, such as "mesh 1 - 1 x 8 holes of the wheel".
    mesh_order, pinion_order, wheel_order : float
        Periods to a pitch, and to a turn of each gear.
    amplitude_um : float
        From zero to peak.
    """

    name: str
    mesh_order: float
    pinion_order: float
    wheel_order: float
    amplitude_um: float

    @property
    def of_mesh(self) -> bool:
        """Whether it is a whole order of the mesh."""
        return self.mesh_order == round(self.mesh_order)


def shaft_orders(
    sweep: SteSweep, torque_index: int, teeth: tuple[int, int], holes: tuple[int, int] = (0, 0),
    count: int = MOST_LISTED,
) -> list[ShaftOrder]:  # fmt: skip
    """Return the largest orders of a sweep at one torque, the largest first; none where a position is missing.

    Parameters
    ----------
    teeth, holes : (int, int)
        Numbers of pinion and wheel.
    count : int
        Most orders.

    Raises
    ------
    ValueError
        When the angles do not divide the pitches uniformly.
    """
    amplitude = orders_of(sweep, torque_index).amplitude
    if not np.isfinite(amplitude).all() or not len(amplitude):
        return []
    least = LEAST_SHARE * float(amplitude.max())
    largest = np.argsort(-amplitude, kind="stable")[:count]
    listed = []
    for place in largest[amplitude[largest] > least].tolist():
        order = Fraction(place + 1, sweep.pitches)
        by_pinion, by_wheel = (float(order * number) for number in teeth)
        name = order_name(order, teeth, holes)
        listed.append(ShaftOrder(name, float(order), by_pinion, by_wheel, float(amplitude[place])))
    return listed


def order_name(order: Fraction, teeth: tuple[int, int], holes: tuple[int, int]) -> str:
    """Return what makes an order, in periods to a pitch, with as few holes as possible.

    That of neither mesh nor holes, as pitch deviations make it, is named by the gear of which it is a whole order.
    """
    spans = [_multiples(number, count) for number, count in zip(teeth, holes, strict=True)]
    steps = sorted(((n, m) for n in spans[0] for m in spans[1]), key=lambda s: (abs(s[0]) + abs(s[1]), -s[0], -s[1]))
    for step in steps:
        rest = order - sum(Fraction(n * count, z) for n, count, z in zip(step, holes, teeth, strict=True))
        if rest.denominator == 1 and rest >= 0:
            return _said(int(rest), step, holes)
    for gear, number in zip(GEARS, teeth, strict=True):
        if (order * number).denominator == 1:
            return f"order {order * number} of the {gear}"
    return "pinion and wheel together"


def _multiples(teeth: int, holes: int) -> range:
    """Multiples of holes that make different orders."""
    if not holes:
        return range(1)
    half = teeth // gcd(teeth, holes) // 2
    return range(-half, half + 1)


def _said(mesh: int, step: tuple[int, int], holes: tuple[int, int]) -> str:
    words = f"mesh {mesh}" if mesh else ""
    for n, count, gear in zip(step, holes, GEARS, strict=True):
        if n:
            sign = " - " if n < 0 else " + " if words else ""
            words += f"{sign}{abs(n)} x {count} holes of the {gear}"
    return words
