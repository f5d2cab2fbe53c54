"""Loads that turn with a shaft: forces and moments across it that are said to, and unbalances at the speed of a load.

They have no mean over a turn. A set feels them over turns of its carrier: one that turns with the carrier stands
still seen from there, one that stands in the housing turns backwards once, and one on another shaft turns at the ratio
of the speeds, so that all stands as before after as many turns of the carrier as make all of these whole.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.machine.load_settings import LoadCase, Mass
from pmor.machine.model import GearboxModel, speeds_rpm, turning_together

# Turns of a carrier after which all stands as before, at most.
MOST_TURNS = 20
# By how much a ratio of tooth numbers times these may miss a whole number.
ROUNDED = 1e-9
# kg mm in t mm, and rad/s of a rpm.
KG, RPM = 1e-3, math.pi / 30.0
# Directions at a node.
ALONG_Y, ABOUT_Y = 1, 4


class Turning(NamedTuple):
    """What turns with a shaft.

    Attributes
    ----------
    load : ndarray, shape (2, n)
        On all displacements, at angle 0 and a quarter turn about x on.
    rates : tuple of float
        Turns of the shaft to one of the carrier, of each set; NaN where that stands.
    """

    shaft: str
    load: FloatArray
    rates: tuple[float, ...]


def turning_loads(
    model: GearboxModel, load: LoadCase, node: Callable[[str, float], int], size: int
) -> tuple[Turning, ...]:
    """Return what turns with shafts under a load and comes back with the carriers, by shaft.

    Parameters
    ----------
    node : callable
        Says where the displacements of a place begin, of so many in all: `size`.
    """
    speeds, found = speeds_rpm(model, load), dict[str, FloatArray]()

    def add(shaft: str, first: int, across: complex) -> None:
        if across:
            both = found.setdefault(shaft, np.zeros((2, size)))
            both[:, first : first + 2] += (across.real, across.imag), (-across.imag, across.real)

    if _return(model, _said(load)):
        for shaft, place, across, first in turning_with_shafts(load):
            add(shaft, node(shaft, place) + first, across)
    for body in unbalances_over_turns(model, load):
        add(body.shaft, node(body.shaft, body.at_mm) + ALONG_Y, unbalance(body, RPM * speeds[body.shaft]))
    carriers = _carriers(model)
    return tuple(
        Turning(shaft, both, tuple(_rate(model, shaft, carrier) for carrier in carriers))
        for shaft, both in found.items()
    )


def turning_with_shafts(load: LoadCase) -> list[tuple[str, float, complex, int]]:
    """Return forces and moments that are said to turn: shaft, place, y + i z at the start, direction of y."""
    return [
        *((one.shaft, one.at_mm, complex(one.y_N, one.z_N), ALONG_Y) for one in load.forces if one.turns),
        *((one.shaft, one.at_mm, 1e3 * complex(one.y_Nm, one.z_Nm), ABOUT_Y) for one in load.moments if one.turns),
    ]


def unbalance(body: Mass, rate: float) -> complex:
    """Return the force of an unbalanced body on its shaft at so many rad/s: y + i z at the start, N."""
    return KG * body.unbalance_kg_mm * rate**2 * cmath.exp(1j * math.radians(body.unbalance_deg))


def unbalances_over_turns(model: GearboxModel, load: LoadCase) -> list[Mass]:
    """Return the unbalanced masses that a load has over turns of the carriers: at its speed, back after few of them."""
    found, speeds, said = list[Mass](), speeds_rpm(model, load), _said(load)
    shafts = said if _return(model, said) else []
    for body in model.sections.masses:
        if body.unbalance_kg_mm and body.shaft in speeds and _return(model, [*shafts, body.shaft]):
            shafts.append(body.shaft)
            found.append(body)
    return found


def never_back(model: GearboxModel) -> str:
    """Return the shafts of loads that are said to turn, where no few turns of a carrier bring them back; else empty."""
    for load in model.sections.loads:
        if (shafts := _said(load)) and not _return(model, shafts):
            return " and ".join(dict.fromkeys(shafts))
    return ""


def turns_of(rates: Sequence[float]) -> int | None:
    """Return after how many turns of the carrier what turns at these rates to it is back; None: not after few."""
    for turns in range(1, MOST_TURNS + 1):
        if all(abs(turns * rate - round(turns * rate)) < ROUNDED for rate in rates if math.isfinite(rate)):
            return turns if all(map(math.isfinite, rates)) else None
    return None


def standing(load: LoadCase) -> LoadCase:
    """Return what of a load stands in the housing."""
    forces = (replace(one, y_N=0.0, z_N=0.0) if one.turns else one for one in load.forces)
    return replace(load, forces=tuple(forces), moments=tuple(one for one in load.moments if not one.turns))


def _said(load: LoadCase) -> list[str]:
    """Shafts of forces and moments that are said to turn."""
    across = [one for one in load.forces if one.y_N or one.z_N] + [one for one in load.moments if one.y_Nm or one.z_Nm]
    return [one.shaft for one in across if one.turns]


def _carriers(model: GearboxModel) -> list[str | None]:
    """Shafts of the carriers of all sets; None of those that stand."""
    places = [one.members.get("carrier") for one in model.sections.sets]
    return [None if place is None else place.shaft for place in places]


def _rate(model: GearboxModel, shaft: str, carrier: str | None) -> float:
    return turning_together(model, carrier, 1.0).get(shaft, math.nan) if carrier else math.nan


def _return(model: GearboxModel, shafts: Sequence[str]) -> bool:
    """Whether shafts are back after few turns of each carrier; not without any."""
    turning = [carrier for carrier in _carriers(model) if carrier]
    rates = [[_rate(model, shaft, carrier) for shaft in shafts] for carrier in turning]
    return bool(turning) and all(turns_of(one) for one in rates)
