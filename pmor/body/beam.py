"""Shafts as beams: stiffness and inertia of a stepped Timoshenko beam with twelve degrees of freedom an element.

The axis is x. A node moves along x, y, z and turns about them, in this order. With the shear parameter
phi = 12 E I / (kappa G A L^2) the bending stiffness of an element is that of Przemieniecki, Theory of Matrix Structural
Analysis, 1968, eq. 5.116; without distributed loads it is exact. The shear coefficient kappa of a circular section,
solid or hollow, is that of Cowper, J. Appl. Mech. 33 (1966) 335.

Inertia is consistent with the same displacements, those of an element without loads between its nodes (Nelson, J. Mech.
Design 102 (1980) 793): of mass along and across, of the sections' own rotation, and gyroscopic where the shaft spins.

A beam on its seats, bent in one plane: how it gives way to loads, and how it follows seats that move.

Displacements are deflection and slope, loads force and moment, at places along the axis. The beam is exact
(`pmor.body.beam`); a seat holds it across and against tilting, each rigidly, by a spring, or not at all.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from pmor.core.arrays import FloatArray

NODE = 6
# Stations of a shaft that are closer than this are one, mm.
SAME_STATION_MM = 1e-6
# Deflection along y and turn about z, and along z and about y, of both nodes of an element; a positive slope of z(x) is
# a negative turn about y.
PLANES = (([1, 5, 7, 11], np.array([1.0, 1.0, 1.0, 1.0])), ([2, 4, 8, 10], np.array([1.0, -1.0, 1.0, -1.0])))
# Points of Gauss's rule along an element: exact for products of cubics.
POINTS = 4


@dataclass(frozen=True)
class ShaftMaterial:
    """Elastic constants of a shaft.

    Parameters
    ----------
    youngs_modulus : float
        MPa.
    """

    youngs_modulus: float
    poisson_ratio: float

    @property
    def shear_modulus(self) -> float:
        """MPa."""
        return self.youngs_modulus / (2.0 * (1.0 + self.poisson_ratio))


@dataclass(frozen=True)
class CircularSection:
    """Cross section of a shaft.

    Parameters
    ----------
    outer, inner : float
        Diameters, mm; inner is 0 of a solid shaft.
    """

    outer: float
    inner: float = 0.0

    @property
    def area(self) -> float:
        """mm^2."""
        return 0.25 * math.pi * (self.outer**2 - self.inner**2)

    @property
    def second_moment(self) -> float:
        """Second moment of area about a diameter, mm^4."""
        return math.pi / 64.0 * (self.outer**4 - self.inner**4)

    def shear_coefficient(self, poisson_ratio: float) -> float:
        """Return kappa (Cowper 1966, table 1)."""
        m2, nu = (self.inner / self.outer) ** 2, poisson_ratio
        squared = (1.0 + m2) ** 2
        return 6.0 * (1.0 + nu) * squared / ((7.0 + 6.0 * nu) * squared + (20.0 + 12.0 * nu) * m2)


@dataclass(frozen=True)
class Beam:
    """A shaft as a row of beam elements.

    Parameters
    ----------
    stations : ndarray, shape (n,)
        Places of the nodes along the axis, mm, ascending.
    sections : sequence of CircularSection, length n - 1
        Of the elements between them.
    """

    stations: FloatArray
    sections: Sequence[CircularSection]
    material: ShaftMaterial

    def node_at(self, place: float) -> int:
        """Return the number of the node at a place along the axis, mm; ValueError where there is none."""
        node = int(np.abs(self.stations - place).argmin())
        if abs(self.stations[node] - place) > SAME_STATION_MM:
            raise ValueError(f"no node at {place} mm")
        return node

    def stiffness(self) -> FloatArray:
        """Return the stiffness matrix, shape (6 n, 6 n), N/mm, N and N mm/rad."""
        size = NODE * len(self.stations)
        total = np.zeros((size, size))
        for first, (section, length) in enumerate(zip(self.sections, np.diff(self.stations), strict=True)):
            rows = slice(NODE * first, NODE * (first + 2))
            total[rows, rows] += element_stiffness(section, float(length), self.material)
        return total

    def inertia(self, density: float) -> ElementInertia:
        """Return mass and gyroscopic matrices, shape (6 n, 6 n) each, of a density in t/mm^3."""
        size = NODE * len(self.stations)
        mass, gyroscopic = np.zeros((size, size)), np.zeros((size, size))
        for first, (section, length) in enumerate(zip(self.sections, np.diff(self.stations), strict=True)):
            rows = slice(NODE * first, NODE * (first + 2))
            own = element_inertia(section, float(length), self.material, density)
            mass[rows, rows] += own.mass
            gyroscopic[rows, rows] += own.gyroscopic
        return ElementInertia(mass, gyroscopic)

    def dead_load(self, force_density: FloatArray) -> FloatArray:
        """Return the forces on the nodes of a load that is even over the volume, shape (6 n,).

        Those that hold the ends of an element, q L / 2 and the moments q L^2 / 12, with or without shear.

        Parameters
        ----------
        force_density : ndarray, shape (3,)
            N/mm^3.
        """
        forces = np.zeros((len(self.stations), NODE))
        for first, (section, length) in enumerate(zip(self.sections, np.diff(self.stations), strict=True)):
            q = section.area * np.asarray(force_density)
            for node, sign in ((first, 1.0), (first + 1, -1.0)):
                forces[node, :3] += 0.5 * length * q
                forces[node, 4:] += sign * length**2 / 12.0 * np.array([-q[2], q[1]])
        return forces.ravel()


def element_stiffness(section: CircularSection, length: float, material: ShaftMaterial) -> FloatArray:
    """Return the stiffness of an element between two nodes, shape (12, 12).

    Parameters
    ----------
    length : float
        mm.
    """
    modulus, area, inertia = material.youngs_modulus, section.area, section.second_moment
    shear_area = section.shear_coefficient(material.poisson_ratio) * area
    phi = 12.0 * modulus * inertia / (material.shear_modulus * shear_area * length**2)
    stiffness = np.zeros((2 * NODE, 2 * NODE))
    pair = np.array([[1.0, -1.0], [-1.0, 1.0]])
    for place, value in ((0, modulus * area), (3, 2.0 * material.shear_modulus * inertia)):
        ends = [place, place + NODE]
        stiffness[np.ix_(ends, ends)] = value / length * pair
    near, far = (4.0 + phi) * length**2, (2.0 - phi) * length**2
    arm = 6.0 * length
    bending = np.array(
        [[12.0, arm, -12.0, arm], [arm, near, -arm, far], [-12.0, -arm, 12.0, -arm], [arm, far, -arm, near]]
    ) * (modulus * inertia / (length**3 * (1.0 + phi)))
    for places, signs in PLANES:
        stiffness[np.ix_(places, places)] = bending * np.outer(signs, signs)
    return stiffness


class ElementInertia(NamedTuple):
    """Inertia of an element between two nodes.

    Attributes
    ----------
    mass : ndarray, shape (12, 12)
        t, t mm and t mm^2.
    gyroscopic : ndarray, shape (12, 12)
        Moments G v by velocities v where the shaft spins at 1 rad/s about x; antisymmetric.
    """

    mass: FloatArray
    gyroscopic: FloatArray


def element_inertia(
    section: CircularSection, length: float, material: ShaftMaterial, density: float
) -> ElementInertia:
    """Return the inertia of an element (Nelson 1980).

    Parameters
    ----------
    length : float
        mm.
    density : float
        t/mm^3.
    """
    shear_area = section.shear_coefficient(material.poisson_ratio) * section.area
    phi = 12.0 * material.youngs_modulus * section.second_moment / (material.shear_modulus * shear_area * length**2)
    mass, gyroscopic = np.zeros((2 * NODE, 2 * NODE)), np.zeros((2 * NODE, 2 * NODE))
    line = length / 6.0 * np.array([[2.0, 1.0], [1.0, 2.0]])
    for place, by_length in ((0, density * section.area), (3, 2.0 * density * section.second_moment)):
        ends = [place, place + NODE]
        mass[np.ix_(ends, ends)] = by_length * line
    points, weights = np.polynomial.legendre.leggauss(POINTS)
    x, weights = 0.5 * (1.0 + points), 0.5 * length * weights
    across = np.array([
        1.0 - 3.0 * x**2 + 2.0 * x**3 + phi * (1.0 - x),
        length * (x - 2.0 * x**2 + x**3 + 0.5 * phi * (x - x**2)),
        3.0 * x**2 - 2.0 * x**3 + phi * x,
        length * (x**3 - x**2 - 0.5 * phi * (x - x**2)),
    ]) / (1.0 + phi)  # fmt: skip
    turn = np.array([
        6.0 * (x**2 - x) / length, 1.0 - 4.0 * x + 3.0 * x**2 + phi * (1.0 - x),
        6.0 * (x - x**2) / length, 3.0 * x**2 - 2.0 * x + phi * x,
    ]) / (1.0 + phi)  # fmt: skip
    turning = density * section.second_moment * (turn * weights) @ turn.T
    bending = density * section.area * (across * weights) @ across.T + turning
    (first, ahead), (second, back) = PLANES
    for places, signs in PLANES:
        mass[np.ix_(places, places)] = bending * np.outer(signs, signs)
    # A disc of polar inertia J that spins at W: moments J W (z', -y') about y and z by turns (y, z).
    twisting = 2.0 * turning * np.outer(-back, ahead)
    gyroscopic[np.ix_(second, first)] = twisting
    gyroscopic[np.ix_(first, second)] = -twisting.T
    return ElementInertia(mass, gyroscopic)


def stations_of(borders: FloatArray, places: Sequence[float]) -> FloatArray:
    """Return the stations of a shaft in ascending order: borders of its sections and further places on it, mm."""
    ordered = np.sort(np.array([*borders, *places], dtype=float))
    return ordered[np.r_[True, np.diff(ordered) > SAME_STATION_MM]]


def refined(stations: FloatArray, longest: float) -> FloatArray:
    """Return stations with further ones in between, evenly, so that no element is longer, mm."""
    lengths = np.diff(stations)
    parts = np.ceil(lengths / longest - SAME_STATION_MM).astype(int)
    steps = np.repeat(lengths / parts, parts)
    return np.concatenate([stations[:1], stations[0] + np.cumsum(steps)[:-1], stations[-1:]])


# Deflection along y and turn about z, of the displacements of a node.
PLANE = (1, 5)


class BeamSeat(NamedTuple):
    """What holds a beam: its place along it, mm, and stiffness across and against tilting, N/mm and N mm/rad.

    A stiffness of infinity is rigid, one of 0 none.
    """

    place: float
    radial: float
    tilt: float


class SeatedBeam(NamedTuple):
    """A beam on m seats, at n places.

    Attributes
    ----------
    flexibility : ndarray, shape (2 n, 2 n)
        Deflection and slope of place by place under unit forces and moments, mm/N and so on.
    carried : ndarray, shape (2 n, 2 m)
        The same by unit displacements and tilts of the seats.
    stiffness : ndarray, shape (2 m, 2 m)
        Forces and moments that such displacements take at the seats, N/mm and so on.
    """

    flexibility: FloatArray
    carried: FloatArray
    stiffness: FloatArray


def seated_beam(beam: Beam, seats: Sequence[BeamSeat], places: Sequence[float]) -> SeatedBeam | None:
    """Return how a beam on its seats gives way at places; None where nothing holds it.

    Parameters
    ----------
    places : sequence of float, length n
        Along the beam, mm; stations of it, as those of the seats are.
    """
    if sum((seat.radial > 0.0) + (seat.tilt > 0.0) for seat in seats) < 2:
        return None
    rows = (NODE * np.arange(len(beam.stations))[:, None] + PLANE).ravel()
    stiffness = beam.stiffness()[np.ix_(rows, rows)]
    size = len(rows)
    springs = np.array([[seat.radial, seat.tilt] for seat in seats]).ravel()
    at = np.concatenate([2 * beam.node_at(seat.place) + np.arange(2) for seat in seats])
    rigid = np.isinf(springs)
    held, moves = at[rigid], np.setdiff1d(np.arange(size), at[rigid])
    yielding = np.where(rigid, 0.0, springs)
    stiffness[at, at] += yielding
    moved = np.zeros((size, 2 * len(seats)))
    moved[held, np.flatnonzero(rigid)] = 1.0
    forces = -stiffness @ moved
    forces[at, np.arange(len(at))] += yielding
    solved = np.linalg.inv(stiffness[np.ix_(moves, moves)])
    moved[moves] = solved @ forces[moves]
    apart = moved[at] - np.eye(len(at))
    own = moved.T @ (stiffness @ moved) - moved[at].T @ (yielding[:, None] * moved[at])
    own += apart.T @ (yielding[:, None] * apart)
    flexibility = np.zeros((size, size))
    flexibility[np.ix_(moves, moves)] = solved
    told = np.concatenate([2 * beam.node_at(place) + np.arange(2) for place in places])
    return SeatedBeam(flexibility[np.ix_(told, told)], moved[told], own)
