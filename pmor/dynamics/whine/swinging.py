"""Forces that swing with the turns of a shaft: unbalances, and torques about their mean."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from pmor.core.arrays import ComplexArray, FloatArray
from pmor.dynamics.whine.discs import KG
from pmor.dynamics.whine.moving import MovingMachine
from pmor.machine.loaded import ABOUT_AXIS
from pmor.machine.model import GearboxModel


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
        rows, forces, turns = list[FloatArray](), list[complex](), np.sign(rate * machine.sense)
        for body in bodies:
            amount = 0.5 * KG * body.unbalance_kg_mm * rate**2
            along_y = amount * np.exp(1j * turns * math.radians(body.unbalance_deg))
            rows += [machine.row(shaft, body.at_mm, direction) for direction in (1, 2)]
            forces += [along_y, -1j * turns * along_y]
        found.append(Swinging(f"unbalance of {shaft}", abs(rate), np.array(rows), np.array(forces), False))
    return found


def ripples(machine: MovingMachine) -> list[Swinging]:
    """Return the torques that swing about the mean torques of the load."""
    return [
        Swinging(
            f"torque on {torque.shaft}", abs(machine.rates.get(torque.shaft, 0.0)) * ripple.order,
            machine.row(torque.shaft, torque.at_mm, ABOUT_AXIS)[None],
            np.array([0.5e3 * ripple.amplitude_Nm * np.exp(1j * math.radians(ripple.phase_deg))]), True,
        ) for torque in machine.load.torques for ripple in torque.ripple
    ]  # fmt: skip
