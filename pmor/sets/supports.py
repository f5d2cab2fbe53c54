"""What the members of a planetary set stand on: movements that are free, and one compliance of all hubs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pmor.case.seats import SEAT
from pmor.core.arrays import FloatArray, IntArray
from pmor.line.hubs import HUB
from pmor.line.train import IMAGE
from pmor.sets.model import SetBody
from pmor.sets.pins import PlanetOnPin, PlanetsOnPins, planet_on_pin, planet_on_springs
from pmor.sets.settings import SetSections

X, Y, TILTS, ROTATION = 0, 1, (3, 4), 5
# Members before the planets.
CENTRAL = ("sun", "ring")
# Of the pin's flexibility: what rounding leaves between deflection and tilt of a pin that is even about the middle.
EVEN = 1e-9


@dataclass(frozen=True)
class Standing:
    """What hubs stand on.

    Parameters
    ----------
    free, compliance : ndarray
        As in `pmor.line.several.GearTrain`: the rotation of the sun first.
    planets : PlanetsOnPins
        Planets, of which the compliance of their hubs is.
    """

    free: FloatArray
    compliance: FloatArray
    planets: PlanetsOnPins


def tilts_under_forces(said: SetSections, stepped: bool) -> bool:
    """Return whether forces across tilt planets, so that the halves of a spur gear's width differ.

    Both gears of a stepped planet tilt it unless nothing gives way.
    """
    carrier = said.carrier
    rigid = said.pins is None and said.supports.planet_tilt_Nmm_per_rad == carrier.tilt_Nmm_per_rad == "rigid"
    if stepped and not rigid:
        return True
    if carrier.stiffness is not None or carrier.windup_Nmm_per_rad != "rigid":
        return True
    if carrier.tilt_Nmm_per_rad != "rigid" and carrier.bearings_at_mm != 0.0:
        return True
    if said.pins is None:
        return False
    across = planet_on_pin(said.pins).compliance[np.ix_([0, 4], [0, 4])]
    return bool(abs(across[0, 1]) > EVEN * np.sqrt(across[0, 0] * across[1, 1]))


def standing(
    said: SetSections, bodies: Sequence[SetBody], clockwise: bool, carrier: FloatArray | None = None
) -> Standing:
    """Return what sun, ring and planets stand on.

    Parameters
    ----------
    bodies : sequence of SetBody
        Sun, ring and planets.
    clockwise : bool
        Whether all of this is the image.
    carrier : ndarray, shape (6 m N, 6 m N), optional
        Stiffness of the carrier at the seats of all planets that the file counts.
    """
    size, supports = HUB * len(bodies), said.supports
    compliance, first = np.zeros((size, size)), HUB * len(CENTRAL)
    moves = [_alone(ROTATION, size), *(_alone(place + ROTATION, size) for place in range(first, size, HUB))]
    kinds = (
        (supports.sun_radial_N_per_mm, supports.sun_tilt_Nmm_per_rad),
        (supports.ring_radial_N_per_mm, supports.ring_tilt_Nmm_per_rad),
    )  # fmt: skip
    for number, kind in enumerate(kinds):
        for stiffness, directions in zip(kind, ((X, Y), TILTS), strict=True):
            places = [HUB * number + direction for direction in directions]
            if stiffness == "free":
                moves += [_alone(place, size) for place in places]
            compliance[places, places] = gives(stiffness)
    if said.carrier.radial_N_per_mm == "free":
        moves += [_alone(np.arange(first + way, size, HUB), size) for way in (X, Y)]
    planets = planets_in_carrier(said, bodies[len(CENTRAL) :], clockwise, carrier)
    compliance[first:, first:] = planets.compliance
    return Standing(np.array(moves), compliance, planets)


def planets_in_carrier(
    said: SetSections, bodies: Sequence[SetBody], clockwise: bool, stiffness: FloatArray | None = None
) -> PlanetsOnPins:
    """Return planets on pins or springs, and the carrier that holds them; as in `standing`."""
    supports, carrier = said.supports, said.carrier
    if said.pins is None:
        springs = gives(supports.planet_radial_N_per_mm), gives(supports.planet_tilt_Nmm_per_rad)
        pin = planet_on_springs(*springs)
    else:
        pin = planet_on_pin(said.pins)
    places = np.array([(body.x, body.y, z) for body in bodies for z in pin.seats_mm])
    compliance = carrier_on_bearings(said, places)
    if stiffness is not None:
        compliance += _of_matrix(said, pin, stiffness, clockwise)
    turns = np.zeros((len(places), SEAT))
    if carrier.windup_Nmm_per_rad != "rigid":
        turns[:, X], turns[:, Y], turns[:, ROTATION] = -places[:, 1], places[:, 0], 1.0
        turns[places[:, 2] == (max if carrier.torque_at == "+z" else min)(pin.seats_mm)] = 0.0
    turned, windup = turns.ravel(), gives(carrier.windup_Nmm_per_rad)
    return PlanetsOnPins(pin, compliance + windup * np.outer(turned, turned), turned, windup)


def carrier_on_bearings(said: SetSections, places: FloatArray) -> FloatArray:
    """Return the compliance of places (n, 3) on a rigid carrier by its bearings, (6 n, 6 n)."""
    carrier, rows = said.carrier, []
    for x, y, z in places:
        arm = z - carrier.bearings_at_mm
        # Displacements by shifts along x and y, and turns about them.
        rows.append([[1.0, 0.0, 0.0, arm], [0.0, 1.0, -arm, 0.0], [0.0, 0.0, y, -x], [0.0, 0.0, 1.0, 0.0],
                     [0.0, 0.0, 0.0, 1.0], [0.0] * 4])  # fmt: skip
    moved = np.concatenate(rows)
    across = np.repeat([gives(carrier.radial_N_per_mm), gives(carrier.tilt_Nmm_per_rad)], 2)
    return np.asarray((moved * across) @ moved.T)


def _of_matrix(said: SetSections, pin: PlanetOnPin, stiffness: FloatArray, clockwise: bool) -> FloatArray:
    """Compliance at the seats of the planets that are there by the stiffness at those of all of them."""
    whole, rows = np.linalg.inv(stiffness), SEAT * len(pin.seats_mm)
    there = [n for n in range(said.planets.count) if n + 1 not in said.planets.missing]
    own = (rows * np.array(there)[:, None] + np.arange(rows)).ravel()
    signs = np.tile(IMAGE if clockwise else np.ones(SEAT), len(own) // SEAT)
    return np.asarray(signs[:, None] * whole[np.ix_(own, own)] * signs)


def gives(stiffness: float | str) -> float:
    """Return the compliance of a spring; none of what is rigid, or moves freely by itself."""
    return 0.0 if isinstance(stiffness, str) else 1.0 / stiffness


def _alone(place: int | IntArray, size: int) -> FloatArray:
    row = np.zeros(size)
    row[place] = 1.0
    return row
