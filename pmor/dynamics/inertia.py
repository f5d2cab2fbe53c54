"""Inertias of gears as solid discs, and their equivalent mass on the line of action."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Inertia:
    """Of a gear with all parts that move with it.

    Parameters
    ----------
    polar_kg_m2 : float
        About its axis.
    tilting_kg_m2 : float
        About an axis across it, through mid width.
    """

    mass_kg: float
    polar_kg_m2: float
    tilting_kg_m2: float


def disc(radius_mm: float, bore_radius_mm: float, width_mm: float, density_kg_m3: float) -> Inertia:
    """Return the inertias of a ring; bore 0 for a gear in one piece with its shaft.

    Parameters
    ----------
    radius_mm : float
        Of the cylinder that stands for the teeth: the reference cylinder.
    """
    outer, inner, width = 1e-3 * radius_mm, 1e-3 * bore_radius_mm, 1e-3 * width_mm
    mass = float(np.pi * (outer**2 - inner**2) * width * density_kg_m3)
    square = outer**2 + inner**2
    return Inertia(mass, 0.5 * mass * square, mass * (3.0 * square + width**2) / 12.0)


def equivalent_mass(pinion: Inertia, wheel: Inertia, base_radii_mm: tuple[float, float]) -> float:
    """Return the mass in t that moves along the line of action when both gears turn against each other.

    m = I1 I2 / (I1 rb2^2 + I2 rb1^2).
    """
    first, second = (1e-3 * radius for radius in base_radii_mm)
    one, two = pinion.polar_kg_m2, wheel.polar_kg_m2
    return 1e-3 * one * two / (one * second**2 + two * first**2)
