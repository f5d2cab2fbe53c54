"""The plan of a set: which members mesh where, what holds them, what acts on them. Nothing is solved yet.

A set whose first gear is loaded clockwise is planned as its image, x to -x: its results count there, as those of coast
flanks do (`pmor.case.coast`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from pmor.core.arrays import ComplexArray, FloatArray
from pmor.core.errors import CaseError, GeometryError
from pmor.gear.pair import GearPair
from pmor.line.hubs import HUB
from pmor.line.several import smooth_rows
from pmor.sets.kinematics import Centre, Meeting, Placement, placements
from pmor.sets.model import SetBody, SetMesh
from pmor.sets.pins import PlanetsOnPins
from pmor.sets.settings import Planets, SetSections
from pmor.sets.supports import ROTATION, standing, tilts_under_forces

# Of a whole number: positions of planets that can be assembled.
ASSEMBLED = 1e-6
# Of the forces of meshes: loads that they do not hold.
UNBALANCED = 1e-9


@dataclass(frozen=True)
class Share:
    """A mesh as a case: what equal meshes share.

    Parameters
    ----------
    members : (str, str)
        That drives, and that is driven.
    sense, hand : int
        Of the driving one as it is drawn: 1 if the torque turns it counter-clockwise; 1 if it has the hand of the first
        gear.
    distance_mm : float or None
        Of the axes; None is that of the file, or without backlash.
    """

    members: tuple[str, str]
    sense: int
    hand: int
    distance_mm: float | None = None
    whole_width: bool = False

    @property
    def name(self) -> str:
        """Of the case."""
        return "-".join(self.members)


@dataclass(frozen=True)
class Layout:
    """Members of a set and the meshes that differ, before any geometry.

    Parameters
    ----------
    clockwise : bool
        Whether the first gear is loaded clockwise.
    """

    shares: tuple[Share, ...]
    clockwise: bool


@dataclass(frozen=True)
class InHousing:
    """Displacement of hubs that stands still in the housing, and turns against the carrier.

    Parameters
    ----------
    displacement : ndarray of complex, shape (6 B,)
        Of all hubs, mm and rad: its real part, once it is multiplied by exp(i angle).
    housing : int or None
        Body that stands still with the housing: its angle against the carrier counts. None of a carrier that does.
    """

    displacement: ComplexArray
    housing: int | None


@dataclass(frozen=True)
class SetPlan:
    """What is solved, in the frame of the image where the first gear is loaded clockwise.

    Parameters
    ----------
    bodies, meshes : tuple
        As `pmor.sets.model.build_train` takes them.
    planets : tuple of int
        Numbers of the bodies that are planets.
    free, compliance : ndarray
        As in `pmor.line.several.GearTrain`.
    displacement : ndarray, shape (6 B,)
        Of the hubs, by errors of pins, mm.
    eccentricity : ndarray, shape (B, 2)
        Of all gears, off the axes that they turn about, at angle 0, mm.
    driver : int
        Movement that is the rotation of the first gear, on which the transmission error counts.
    load : ndarray, shape (K,)
        On the movements, N mm, under 1 N mm on the first gear.
    torque_Nm : float
        On the first gear, N m: the amount.
    nominal_Nm : float
        Amount of the torque as the file says it, on the member that it names.
    mesh_torques_Nm : mapping of str to float
        On the pinion of each mesh, by the names of the cases, N m.
    clockwise : bool
        Whether all of this is the image.
    on_pins : PlanetsOnPins or None
        Of a planetary set: its planets on their pins, of which their part of the compliance is.
    wrench : ndarray, shape (6 B,)
        Of the meshes on all hubs under 1 N mm on the first gear: of smooth flanks, at their pitch points, N and N mm.
    in_housing : InHousing or None
        Of a set on shafts that other loads bend.
    """

    bodies: tuple[SetBody, ...]
    meshes: tuple[SetMesh, ...]
    planets: tuple[int, ...]
    free: FloatArray
    compliance: FloatArray
    displacement: FloatArray
    eccentricity: FloatArray
    driver: int
    load: FloatArray
    torque_Nm: float
    nominal_Nm: float
    mesh_torques_Nm: Mapping[str, float]
    clockwise: bool
    wrench: FloatArray
    on_pins: PlanetsOnPins | None = None
    in_housing: InHousing | None = None


def planetary_layout(said: SetSections, whole_width: bool = False) -> Layout:
    """Return the layout of a planetary set, seen from its carrier.

    Parameters
    ----------
    whole_width : bool
        Whether members may tilt, whatever the file says of what they stand on.
    """
    assert said.load is not None
    clockwise = said.load.torque_Nm * (-1.0 if said.load.on == "carrier" else 1.0) < 0.0
    sense = -1 if clockwise else 1
    whole = whole_width or tilts_under_forces(said)
    return Layout(
        (Share(("sun", "planet"), sense, 1, None, whole), Share(("planet", "ring"), -sense, -1, None, whole)), clockwise
    )


def train_layout(said: SetSections) -> Layout:
    """Return the layout of gears on fixed axes."""
    gears = {gear.name: gear for gear in said.gears}
    first = said.meshes[0].gears[0]
    clockwise = float(gears[first].torque_Nm or 0.0) < 0.0  # type: ignore[arg-type]
    sense, shares = {first: -1 if clockwise else 1}, []
    for mesh in said.meshes:
        one, other = mesh.gears
        if one not in sense:
            raise CaseError(
                f'[[meshes]] gears = ["{one}", "{other}"]: nothing drives "{one}" yet: list it further down'
            )
        internal = bool(said.members.get(other, {}).get("internal", False))
        turned = sense[one] if internal else -sense[one]
        if sense.setdefault(other, turned) != turned:
            raise CaseError(f'[[meshes]] gears = ["{one}", "{other}"]: "{other}" is driven the other way already')
        distance = math.dist(gears[one].at_mm, gears[other].at_mm)
        hand = sense[one] * sense[first]
        shares.append(Share((one, other), sense[one], hand, distance))
    return Layout(tuple(shares), clockwise)


def set_plan(
    said: SetSections, layout: Layout, pairs: Mapping[str, GearPair], carrier: FloatArray | None = None
) -> SetPlan:
    """Return the plan of a set.

    Parameters
    ----------
    pairs : mapping of str to GearPair
        Of the layout's meshes, by name.
    carrier : ndarray, optional
        Stiffness of the carrier at the seats of its pins, as in `pmor.sets.supports.standing`.

    Raises
    ------
    CaseError, GeometryError
        Where planets cannot be assembled or touch each other, or nothing holds a torque.
    """
    return _trained(said, layout, pairs) if said.gears else _planetary(said, layout, pairs, carrier)


def _planetary(said: SetSections, layout: Layout, pairs: Mapping[str, GearPair], carrier: FloatArray | None) -> SetPlan:
    assert said.load is not None
    inner, outer = (pairs[share.name] for share in layout.shares)
    sun, ring, distance = inner.pinion.teeth, -outer.wheel.teeth, inner.centre_distance
    places = planet_positions(said.planets, sun + ring)
    numbers = [number for number in range(said.planets.count) if number + 1 not in said.planets.missing]
    _refuse_neighbours([places[number] for number in numbers], inner)
    side = -1.0 if layout.clockwise else 1.0
    bodies, meshes = [SetBody("sun", "sun", 0.0, 0.0), SetBody("ring", "ring", 0.0, 0.0)], []
    for number in numbers:
        angle, body = side * places[number], len(bodies)
        outwards = np.array([-math.sin(angle), math.cos(angle)])
        bodies.append(SetBody(f"planet {number + 1}", "planet", *(distance * outwards).tolist()))
        meshes += [SetMesh(layout.shares[0].name, 0, body), SetMesh(layout.shares[1].name, body, 1)]
    stands = standing(said, bodies, layout.clockwise, carrier)
    amount = abs(said.load.torque_Nm) * {"sun": 1.0, "ring": sun / ring, "carrier": sun / (sun + ring)}[said.load.on]
    load = np.zeros(len(stands.free))
    load[0] = 1.0
    plan = _planned(
        bodies, meshes, tuple(range(2, len(bodies))), pairs, stands.free, stands.compliance,
        *planetary_errors(said, bodies, layout.clockwise), load, amount, abs(said.load.torque_Nm), layout.clockwise,
    )  # fmt: skip
    return replace(plan, on_pins=stands.planets)


def planetary_errors(said: SetSections, bodies: Sequence[SetBody], clockwise: bool) -> tuple[FloatArray, FloatArray]:
    """Return displacements of hubs, (6 B,), and eccentricities of gears, (B, 2), mm, in the frame of the plan."""
    pins, off, side = said.planets, said.eccentricity, -1.0 if clockwise else 1.0
    numbers = [number for number in range(pins.count) if number + 1 not in pins.missing]
    displacement = np.zeros((len(bodies), HUB))
    eccentric = [_eccentric(off.sun_um, side * off.sun_deg), _eccentric(off.ring_um, side * off.ring_deg)]
    for number, body, moved in zip(numbers, bodies[2:], displacement[2:], strict=True):
        outwards = np.array([body.x, body.y]) / math.hypot(body.x, body.y)
        if pins.radial_um:
            moved[:2] += 1e-3 * pins.radial_um[number] * outwards
        if pins.tangential_um:
            # The sense in which the torque turns the sun is counter-clockwise here.
            moved[:2] += 1e-3 * pins.tangential_um[number] * np.array([-outwards[1], outwards[0]])
        amount, ahead = (values[number] if values else 0.0 for values in (off.planets_um, off.planets_deg))
        eccentric.append(_eccentric(amount, math.degrees(math.atan2(-body.x, body.y)) + side * ahead))
    return displacement.ravel(), np.array(eccentric)


def _eccentric(amount_um: float, direction_deg: float) -> list[float]:
    """Eccentricity of a gear, in a direction counter-clockwise from the y axis: x and y, mm."""
    direction = math.radians(direction_deg)
    return [-1e-3 * amount_um * math.sin(direction), 1e-3 * amount_um * math.cos(direction)]


def planet_positions(planets: Planets, teeth: int) -> list[float]:
    """Return angles of all planets, rad, by the sum of teeth of sun and ring; GeometryError without assembly."""
    places = planets.positions_deg or tuple(360.0 * n / planets.count for n in range(planets.count))
    for number, place in enumerate(places, start=1):
        step = (place - places[0]) / 360.0 * teeth
        if abs(step - round(step)) > ASSEMBLED * teeth:
            near = [places[0] + 360.0 * whole / teeth for whole in (math.floor(step), math.ceil(step))]
            sums = f"teeth of sun and ring add up to {teeth}, which is no multiple of {planets.count} planets: "
            raise GeometryError(
                f"[planets] planet {number} at {place:.6g} deg: cannot be assembled: "
                f"{'' if planets.positions_deg else sums}write positions_deg, next to {near[0]:.6g} or {near[1]:.6g} "
                "deg, or change tooth numbers"
            )
    return [math.radians(place) for place in places]


def _refuse_neighbours(places: Sequence[float], inner: GearPair) -> None:
    ordered = sorted(place % (2.0 * math.pi) for place in places)
    if len(ordered) < 2:
        return
    nearest = min(b - a for a, b in pairwise([*ordered, ordered[0] + 2.0 * math.pi]))
    apart, tips = 2.0 * inner.centre_distance * math.sin(0.5 * min(nearest, math.pi)), 2.0 * inner.wheel.tip_radius
    if apart <= tips:
        raise GeometryError(
            f"[planets] neighbours are {apart:.6g} mm apart, and their tip circles are {tips:.6g} mm wide: take fewer "
            "planets, or fewer teeth on them"
        )


def _trained(said: SetSections, layout: Layout, pairs: Mapping[str, GearPair]) -> SetPlan:
    side = -1.0 if layout.clockwise else 1.0
    names = [gear.name for gear in said.gears]
    bodies = [SetBody(gear.name, gear.name, side * gear.at_mm[0], gear.at_mm[1]) for gear in said.gears]
    places = [[names.index(member) for member in share.members] for share in layout.shares]
    meshes = [SetMesh(share.name, one, other) for share, (one, other) in zip(layout.shares, places, strict=True)]
    first = meshes[0].pinion
    turning = [first] + [n for n, gear in enumerate(said.gears) if gear.torque_Nm != "balance" and n != first]
    free = np.zeros((len(turning), HUB * len(bodies)))
    free[np.arange(len(turning)), HUB * np.array(turning) + ROTATION] = 1.0
    torques = [side * float(said.gears[number].torque_Nm or 0.0) for number in turning]  # type: ignore[arg-type]
    eccentric = [_eccentric(gear.eccentricity_um, side * gear.eccentricity_deg) for gear in said.gears]
    load, size = np.array(torques) / torques[0], HUB * len(bodies)
    return _planned(
        bodies, meshes, (), pairs, free, np.zeros((size, size)), np.zeros(size), np.array(eccentric), load, torques[0],
        torques[0], layout.clockwise,
    )  # fmt: skip


def _planned(
    bodies: Sequence[SetBody], meshes: Sequence[SetMesh], planets: tuple[int, ...], pairs: Mapping[str, GearPair],
    free: FloatArray, compliance: FloatArray, displacement: FloatArray, eccentricity: FloatArray, load: FloatArray,
    torque_Nm: float, nominal_Nm: float, clockwise: bool,
) -> SetPlan:  # fmt: skip
    """Put a plan together; CaseError where meshes do not hold the load."""
    placed = placements(
        [Centre(body.name, body.x, body.y) for body in bodies],
        [Meeting(pairs[mesh.case], mesh.pinion, mesh.wheel) for mesh in meshes],
    )
    rows = _closing(bodies, meshes, placed, pairs)
    closing = rows @ free.T
    forces, *_ = np.linalg.lstsq(closing.T, -load, rcond=None)
    if np.abs(closing.T @ forces + load).max() > UNBALANCED * np.abs(load).max():
        raise CaseError("the meshes do not hold the torques: each gear that is no idler needs its torque_Nm")
    for mesh, force in zip(meshes, forces, strict=True):
        if force <= UNBALANCED * np.abs(forces).max():
            pinion, wheel = bodies[mesh.pinion].name, bodies[mesh.wheel].name
            raise CaseError(
                f"gear {pinion} does not drive gear {wheel} under these torques: correct them, or their signs"
            )
    torques: dict[str, float] = {}
    for mesh, force in zip(meshes, forces, strict=True):
        torque = torque_Nm * float(force) * pairs[mesh.case].pinion.base_radius
        torques[mesh.case] = max(torques.get(mesh.case, 0.0), torque)
    return SetPlan(
        tuple(bodies), tuple(meshes), planets, free, compliance, displacement, eccentricity, 0, load, torque_Nm,
        nominal_Nm, torques, clockwise, forces @ rows,
    )  # fmt: skip


def _closing(
    bodies: Sequence[SetBody], meshes: Sequence[SetMesh], placed: Sequence[Placement], pairs: Mapping[str, GearPair]
) -> FloatArray:
    """Change of the gap of each mesh by displacements of all hubs, (M, 6 B)."""
    rows = np.zeros((len(meshes), HUB * len(bodies)))
    for row, mesh, place in zip(rows, meshes, placed, strict=True):
        wrenches = smooth_rows(pairs[mesh.case], place.direction, place.image)
        for body, wrench in zip((mesh.pinion, mesh.wheel), wrenches, strict=True):
            row[HUB * body : HUB * (body + 1)] += wrench
    return rows
