"""Forces that swing with the turns of a shaft: unbalances, loads that turn with it, and torques about their mean."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pmor.core.arrays import ComplexArray, FloatArray
from pmor.dynamics.whine.moving import MovingMachine
from pmor.machine.loaded import ABOUT_AXIS
from pmor.machine.model import GearboxModel
from pmor.machine.turning import ALONG_Y, turning_with_shafts, unbalance


@dataclass(frozen=True)
class Swinging:
    """Forces that swing with the turns of a shaft: on displacements of the machine, by rows, (q, n).

    Parameters
    ----------
    by_speed : ndarray of complex, shape (q,)
        At 1 rad/s of the first torque's shaft; with its square, or without where `steady`.
    """

    name: str
    rate: float
    rows: FloatArray
    by_speed: ComplexArray
    steady: bool


def unbalances(model: GearboxModel, machine: MovingMachine) -> list[Swinging]:
    """Return the forces of unbalanced masses, all of a shaft together, on y and z of their nodes."""
    found = []
    for shaft, rate in machine.rates.items():
        bodies = [one for one in model.sections.masses if one.shaft == shaft and one.unbalance_kg_mm > 0.0]
        if not bodies:
            continue
        amounts = [(body.at_mm, unbalance(body, rate), ALONG_Y) for body in bodies]
        found.append(_across(f"unbalance of {shaft}", machine, shaft, amounts, False))
    return found


def turning(machine: MovingMachine) -> list[Swinging]:
    """Return the forces and moments of the load that turn with their shafts, all of a shaft together."""
    acting = dict[str, list[tuple[float, complex, int]]]()
    for shaft, place, across, first in turning_with_shafts(machine.load):
        if machine.rates.get(shaft):
            acting.setdefault(shaft, []).append((place, across, first))
    return [_across(f"load on {shaft}", machine, shaft, amounts, True) for shaft, amounts in acting.items()]


def _across(
    name: str, machine: MovingMachine, shaft: str, amounts: Sequence[tuple[float, complex, int]], steady: bool
) -> Swinging:
    """Return what turns with a shaft: places, y + i z at the start, and the direction of y there."""
    rate = machine.rates[shaft]
    turns, rows, forces = np.sign(rate * machine.sense), list[FloatArray](), list[complex]()
    for place, amount, first in amounts:
        along_y = 0.5 * (amount if turns > 0.0 else np.conj(amount))
        rows += [machine.row(shaft, place, direction) for direction in (first, first + 1)]
        forces += [along_y, -1j * turns * along_y]
    return Swinging(name, abs(rate), np.array(rows), np.array(forces), steady)


def ripples(machine: MovingMachine) -> list[Swinging]:
    """Return the torques that swing about the mean torques of the load."""
    return [
        Swinging(
            f"torque on {torque.shaft}", abs(machine.rates.get(torque.shaft, 0.0)) * ripple.order,
            machine.row(torque.shaft, torque.at_mm, ABOUT_AXIS)[None],
            np.array([0.5e3 * ripple.amplitude_Nm * np.exp(1j * math.radians(ripple.phase_deg))]), True,
        ) for torque in machine.load.torques for ripple in torque.ripple
    ]  # fmt: skip
