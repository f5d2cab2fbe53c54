"""Planets on bearings on pins, and the carrier that holds the pins.

A planet of rigid body stands on bearings; at each the ring that turns with it has the displacement q of the planet
there, R u. With B the flexibility of the pin at its bearings and of these, T the displacements there by those of the
seats s, f the forces on the bearings and w the load on the planet's hub,

    B f + T s = R u,    R^T f = w,                                                                              (1)

so that u = P w + K s and f = L w + N s: in both planes through the axis alike, deflection and slope together. The seats
carry K^T w - Y s, with Y what a pin withstands when its ends move against each other. With C the compliance of the
carrier at its seats, the hubs of all planets have

    u = (P + K C (1 + Y C)^-1 K^T) w,                                                                           (2)

symmetric and not negative. Gaps e in the bearings, B f + T s + e = R u, such as those by which a bearing differs from
its spring, give u + L^T e, f - X e, and N^T e more on the seats: all follow from one potential. Along the axis a
planet goes with the mean of its seats, and turns freely about it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from pmor.body.beam import Beam, BeamSeat, CircularSection, SeatedBeam, ShaftMaterial, seated_beam, stations_of
from pmor.body.bearing_faults import InnerGeometry
from pmor.core.arrays import FloatArray
from pmor.line.hubs import HUB
from pmor.sets.settings import PinBearing, Pins

# Displacement and slope along the axis in both planes through it, by the displacements of a hub.
PLANES = np.zeros((2, 2, HUB))
PLANES[0, [0, 1], [0, 4]] = 1.0
PLANES[1, [0, 1], [1, 3]] = 1.0, -1.0


@dataclass(frozen=True)
class PlanetOnPin:
    """A planet on its pin: equation (1).

    Parameters
    ----------
    bearings_mm : tuple of float
        Places of the bearings along the axis.
    seats_mm : tuple of float, length m
        Places of the seats.
    compliance : ndarray, shape (6, 6)
        P.
    carried : ndarray, shape (6, 6 m)
        K.
    stiffness : ndarray, shape (6 m, 6 m)
        Y.
    loads, loads_by_seats : ndarray, shape (b, 4, 6) and (b, 4, 6 m)
        L and N: force on each bearing along x and y, N, and moment in the planes of x and y, N mm.
    loads_by_gaps : ndarray, shape (b, 4, b, 4)
        -X.
    springs : ndarray, shape (b, 4)
        Of the bearings in the same directions, N/mm and N mm/rad; 0 of what is free or rigid.
    """

    bearings_mm: tuple[float, ...]
    seats_mm: tuple[float, ...]
    compliance: FloatArray
    carried: FloatArray
    stiffness: FloatArray
    loads: FloatArray
    loads_by_seats: FloatArray
    loads_by_gaps: FloatArray
    springs: FloatArray


@dataclass(frozen=True)
class PlanetsOnPins:
    """All planets in their carrier.

    Parameters
    ----------
    pin : PlanetOnPin
        Of each.
    carrier : ndarray, shape (6 m N, 6 m N)
        C, of the seats of planet by planet.
    turned : ndarray, shape (6 m N,)
        Displacement of the seats by a unit turn of one cheek against the other; zero where they are one.
    windup : float
        Compliance of this turn, rad/(N mm).
    rolling : tuple of InnerGeometry or None
        Of the bearings of each planet; None of those by their stiffness; empty where all are.
    """

    pin: PlanetOnPin
    carrier: FloatArray
    turned: FloatArray
    windup: float
    rolling: tuple[InnerGeometry | None, ...] = ()

    @property
    def count(self) -> int:
        """Number of planets."""
        return len(self.turned) // self.pin.carried.shape[1]

    @cached_property
    def compliance(self) -> FloatArray:
        """Compliance of the hubs of all planets, equation (2), (6 N, 6 N)."""
        each = np.eye(self.count)
        carried = np.kron(each, self.pin.carried)
        return np.asarray(np.kron(each, self.pin.compliance) + carried @ self._seats_give @ carried.T)

    @cached_property
    def _seats_give(self) -> FloatArray:
        """Displacement of all seats by forces on them, pins in place: C (1 + Y C)^-1, (6 m N, 6 m N)."""
        held = np.kron(np.eye(self.count), self.pin.stiffness) @ self.carrier
        found = np.linalg.solve((np.eye(len(held)) + held).T, self.carrier)
        return np.asarray(0.5 * (found + found.T))

    def seats(self, wrench: FloatArray, gaps: FloatArray | None = None) -> FloatArray:
        """Return the displacements of the seats of all pins, (..., N, 6 m), by loads on the hubs (..., N, 6)."""
        carried = wrench @ self.pin.carried
        if gaps is not None:
            carried = carried + np.einsum("bkr,...nbk->...nr", self.pin.loads_by_seats, gaps)
        return np.asarray((carried.reshape(*carried.shape[:-2], -1) @ self._seats_give).reshape(carried.shape))

    def on_bearings(self, wrench: FloatArray, gaps: FloatArray | None = None) -> FloatArray:
        """Return the loads of all bearings, (..., N, b, 4) as in `PlanetOnPin`, by those on the hubs (..., N, 6).

        Parameters
        ----------
        gaps : ndarray, shape (..., N, b, 4), optional
            In the bearings, mm and rad.
        """
        found = np.einsum("bkr,...nr->...nbk", self.pin.loads, wrench)
        found += np.einsum("bkr,...nr->...nbk", self.pin.loads_by_seats, self.seats(wrench, gaps))
        return found if gaps is None else found + np.einsum("bkcl,...ncl->...nbk", self.pin.loads_by_gaps, gaps)

    def moved(self, wrench: FloatArray, gaps: FloatArray) -> FloatArray:
        """Return the displacements of all hubs, (..., N, 6), by loads on them and gaps in the bearings."""
        found = wrench @ self.pin.compliance + np.einsum("bkr,...nbk->...nr", self.pin.loads, gaps)
        return np.asarray(found + self.seats(wrench, gaps) @ self.pin.carried.T)

    def windup_angle(self, wrench: FloatArray) -> FloatArray:
        """Return by how much one cheek turns against the other, rad, by loads on the hubs (..., N, 6)."""
        carried = wrench @ self.pin.carried - self.seats(wrench) @ self.pin.stiffness
        return np.asarray(self.windup * (carried.reshape(*carried.shape[:-2], -1) @ self.turned))


def planet_on_pin(said: Pins) -> PlanetOnPin:
    """Return what a planet stands on by the settings of a set."""
    bent = _bent(said, [bearing.at_mm for bearing in said.bearings])
    return planet_on_bearings(said.bearings, bent, [seat.place for seat in _seats(said)])


def planet_on_springs(radial: float, tilt: float) -> PlanetOnPin:
    """Return a planet in the middle of a rigid pin, on springs by their compliance, mm/N and rad/(N mm)."""
    compliance = np.diag([radial, radial, 0.0, tilt, tilt, 0.0])
    carried = np.diag([1.0] * 5 + [0.0])
    none = np.zeros((0, 4, HUB))
    return PlanetOnPin(
        (), (0.0,), compliance, carried, np.zeros((HUB, HUB)), none, none, np.zeros((0, 4, 0, 4)), np.zeros((0, 4))
    )


def planet_on_bearings(
    bearings: Sequence[PinBearing], bent: SeatedBeam, seats_mm: Sequence[float]
) -> PlanetOnPin:  # fmt: skip
    """Return a planet on bearings on a pin that was bent at their places: equation (1)."""
    one = _in_plane(bearings, bent)
    of_seats = np.stack([np.kron(np.eye(len(seats_mm)), plane) for plane in PLANES])
    follows = _in_both(PLANES, one.carried, of_seats)
    follows[2, 2::HUB] = 1.0 / len(seats_mm)
    by_hub, by_seats = (
        np.einsum("bwi,pir->bwpr", loads, planes).reshape(len(bearings), 4, -1)
        for loads, planes in ((one.loads[..., :2], PLANES), (one.loads[..., 2:], of_seats))
    )
    by_gaps = np.einsum("bwcv,pq->bwpcvq", one.gaps, np.eye(2)).reshape(len(bearings), 4, len(bearings), 4)
    ways = [(bearing.radial_N_per_mm,) * 2 + (bearing.tilt_Nmm_per_rad,) * 2 for bearing in bearings]
    springs = [[value if isinstance(value, float) else 0.0 for value in way] for way in ways]
    return PlanetOnPin(
        tuple(bearing.at_mm for bearing in bearings), tuple(seats_mm), _in_both(PLANES, one.compliance, PLANES),
        follows, _in_both(of_seats, one.stiffness, of_seats), by_hub, by_seats, by_gaps, np.array(springs),
    )  # fmt: skip


class _InPlane(NamedTuple):
    """P, K and Y in one plane, over deflection and slope; L and N, loads of the bearings, (b, 2, 2 + 2 m); and -X."""

    compliance: FloatArray
    carried: FloatArray
    stiffness: FloatArray
    loads: FloatArray
    gaps: FloatArray


def _in_plane(bearings: Sequence[PinBearing], bent: SeatedBeam) -> _InPlane:
    rows, told, springs = list[list[float]](), list[int](), list[float]()
    for number, bearing in enumerate(bearings):
        held = [1.0, bearing.at_mm], [0.0, 1.0]
        for way, value in enumerate((bearing.radial_N_per_mm, bearing.tilt_Nmm_per_rad)):
            if value != "free":
                rows.append(held[way])
                told.append(2 * number + way)
                springs.append(1.0 / value if isinstance(value, float) else 0.0)
    moved, count = np.array(rows), len(rows)
    flexibility = bent.flexibility[np.ix_(told, told)] + np.diag(springs)
    # Forces are of another size than displacements.
    unit = float(np.abs(flexibility).max()) or 1.0
    whole = np.block([[flexibility / unit, -moved], [moved.T, np.zeros((2, 2))]])
    by_load = np.linalg.solve(whole, np.vstack([np.zeros((count, 2)), np.eye(2)]))
    by_seats = np.linalg.solve(whole, np.vstack([-bent.carried[told], np.zeros((2, bent.carried.shape[1]))]))
    loads = np.zeros((2 * len(bearings), 2 + by_seats.shape[1]))
    loads[told] = np.hstack([by_load[:count], by_seats[:count] / unit])
    by_gaps = np.linalg.solve(whole, np.vstack([-np.eye(count), np.zeros((2, count))]))[:count]
    gaps = np.zeros((2 * len(bearings), 2 * len(bearings)))
    gaps[np.ix_(told, told)] = by_gaps / unit
    stiffness = bent.stiffness - bent.carried[told].T @ loads[told, 2:]
    return _InPlane(
        unit * by_load[count:], by_seats[count:], stiffness, loads.reshape(len(bearings), 2, -1),
        gaps.reshape(len(bearings), 2, len(bearings), 2),
    )  # fmt: skip


def _in_both(rows: FloatArray, matrix: FloatArray, columns: FloatArray) -> FloatArray:
    """Matrix of one plane in both, over displacements of hubs or seats."""
    return np.asarray(np.einsum("pir,ij,pjs->rs", rows, matrix, columns))


def pin_shapes(said: Pins, planets: PlanetsOnPins, wrench: FloatArray, places: FloatArray) -> FloatArray:
    """Return the deflections of all pins along x and y at places (Z,) along them, (N, 2, Z), mm.

    Parameters
    ----------
    wrench : ndarray, shape (N, 6)
        On the hubs.
    """
    bent, count = _bent(said, [*planets.pin.bearings_mm, *places.tolist()]), 2 * len(planets.pin.bearings_mm)
    seats = planets.seats(wrench).reshape(planets.count, -1, HUB)
    in_planes = np.einsum("pir,nmr->npmi", PLANES, seats).reshape(planets.count, 2, -1)
    loads = planets.on_bearings(wrench).reshape(planets.count, -1, 2, 2).transpose(0, 3, 1, 2)
    by_loads = loads.reshape(planets.count, 2, -1) @ bent.flexibility[count:, :count].T
    return np.asarray((by_loads + in_planes @ bent.carried[count:].T)[..., ::2])


def _seats(said: Pins) -> list[BeamSeat]:
    """What the cheeks do to a pin, -z first."""
    tilt = math.inf if said.ends == "clamped" else 0.0
    ends = {"both": said.ends_mm, "-z": said.ends_mm[:1], "+z": said.ends_mm[1:]}[said.cheeks]
    return [BeamSeat(end, math.inf, tilt) for end in ends]


def _bent(said: Pins, places: Sequence[float]) -> SeatedBeam:
    stations = stations_of(np.array(said.ends_mm), places)
    section = CircularSection(said.diameter_mm, said.inner_mm)
    material = ShaftMaterial(1e3 * said.youngs_modulus_GPa, said.poisson_ratio)
    found = seated_beam(Beam(stations, [section] * (len(stations) - 1), material), _seats(said), places)
    assert found is not None, "cheeks hold a pin"
    return found
