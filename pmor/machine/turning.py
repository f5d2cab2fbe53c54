"""Loads that turn with a shaft: forces and moments across it that are said to, and unbalances at the speed of a load.

They have no mean over a turn. A set feels them over turns of its carrier: one that turns with the carrier stands
still seen from there, one that stands in the housing turns backwards once, and one on another shaft turns at the ratio
of the speeds, so that all stands as before after as many turns of the carrier as make all of these whole.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from pmor.body.beam import NODE
from pmor.core.arrays import FloatArray
from pmor.machine.load_settings import LoadCase, Mass
from pmor.machine.model import GearboxModel, speeds_rpm, turning_together

# Turns of a carrier after which all stands as before, at most.
MOST_TURNS = 20
# By how much a ratio of tooth numbers times these may miss a whole number.
ROUNDED = 1e-9
# kg mm in t mm, and rad/s of a rpm.
KG, RPM = 1e-3, math.pi / 30.0


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

    def add(shaft: str, first: int, y: float, z: float) -> None:
        if y or z:
            both = found.setdefault(shaft, np.zeros((2, size)))
            both[:, first : first + 2] += (y, z), (-z, y)

    back = _return(model, _said(load))
    for force in load.forces:
        if force.turns and back:
            add(force.shaft, node(force.shaft, force.at_mm) + 1, force.y_N, force.z_N)
    for moment in load.moments:
        if moment.turns and back:
            add(moment.shaft, node(moment.shaft, moment.at_mm) + NODE - 2, 1e3 * moment.y_Nm, 1e3 * moment.z_Nm)
    for body in unbalances_over_turns(model, load):
        amount = KG * body.unbalance_kg_mm * (RPM * speeds[body.shaft]) ** 2
        angle = math.radians(body.unbalance_deg)
        add(body.shaft, node(body.shaft, body.at_mm) + 1, amount * math.cos(angle), amount * math.sin(angle))
    carriers = _carriers(model)
    return tuple(
        Turning(shaft, both, tuple(_rate(model, shaft, carrier) for carrier in carriers))
        for shaft, both in found.items()
    )


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
