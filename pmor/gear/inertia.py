"""Mass and moments of inertia of bodies of revolution that gears are put together from."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Inertia:
    """Inertia of a gear with all parts that move with it; those of parts about common axes add."""

    mass_kg: float
    polar_kg_m2: float  # About its axis
    tilting_kg_m2: float  # About an axis across it, through mid width

    def __add__(self, other: Inertia) -> Inertia:
        """Return that of two parts."""
        return Inertia(
            self.mass_kg + other.mass_kg, self.polar_kg_m2 + other.polar_kg_m2, self.tilting_kg_m2 + other.tilting_kg_m2
        )

    def times(self, factor: float) -> Inertia:
        """Return that of a multiple of the mass: of -1 what is cut out."""
        return Inertia(factor * self.mass_kg, factor * self.polar_kg_m2, factor * self.tilting_kg_m2)


def disc(
    radius_mm: float, bore_radius_mm: float, width_mm: float, density_kg_m3: float, offset_mm: float = 0.0
) -> Inertia:
    """Return the inertias of a ring from its bore to a radius, its middle offset along the axis."""
    outer, inner, width, offset = (1e-3 * length for length in (radius_mm, bore_radius_mm, width_mm, offset_mm))
    mass = math.pi * (outer**2 - inner**2) * width * density_kg_m3
    square = outer**2 + inner**2
    return Inertia(mass, 0.5 * mass * square, mass * ((3.0 * square + width**2) / 12.0 + offset**2))


def tapered_disc(stations_mm: Sequence[tuple[float, float, float]], density_kg_m3: float) -> Inertia:
    """Return the inertias of a ring whose faces are straight between stations: radius and z of both faces, rising.

    Exact: the integrals over the radius are of polynomials of degree 4, which Gauss's rule of three points does.
    """
    total = Inertia(0.0, 0.0, 0.0)
    at, weights = np.polynomial.legendre.leggauss(3)
    stations = 1e-3 * np.asarray(stations_mm)
    for inner, outer in zip(stations[:-1], stations[1:], strict=True):
        radius, low, high = 0.5 * (inner + outer)[:, None] + 0.5 * (outer - inner)[:, None] * at
        ring = math.pi * (outer[0] - inner[0]) * weights * radius * density_kg_m3
        polar = float(ring @ (radius**2 * (high - low)))
        along = float(ring @ (high**3 - low**3)) / 3.0
        total += Inertia(float(ring @ (high - low)), polar, 0.5 * polar + along)
    return total


def about_the_axis(part: Inertia, radius_mm: float) -> Inertia:
    """Return the inertias of a part that stands at a radius, of evenly spaced ones on average (Steiner)."""
    moved = part.mass_kg * (1e-3 * radius_mm) ** 2
    return Inertia(part.mass_kg, part.polar_kg_m2 + moved, part.tilting_kg_m2 + 0.5 * moved)
