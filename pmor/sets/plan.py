"""The plan of a set: which members mesh where, what holds them, what acts on them. Nothing is solved yet.

A set whose first gear is loaded clockwise is planned as its image, x to -x: its results count there, as those of coast
flanks do (`pmor.case.coast`).
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import combinations

import numpy as np

from pmor.core.arrays import ComplexArray, FloatArray
from pmor.core.errors import CaseError, GeometryError
from pmor.gear.pair import GearPair
from pmor.line.hubs import HUB
from pmor.line.train import smooth_rows
from pmor.sets.kinematics import Meeting, Placement, mesh_rates, placements
from pmor.sets.layout import SECOND_PLANET, Layout, train_layout
from pmor.sets.model import SetBody, SetMesh
from pmor.sets.pins import PlanetsOnPins
from pmor.sets.settings import Planets, SetSections
from pmor.sets.shafts import onto_bodies
from pmor.sets.supports import ROTATION, gives, standing

# Degrees by which positions of planets may be rounded: each stands where its teeth meet those of both members.
ASSEMBLED_DEG = 4e-4
# Of the forces of meshes: loads that they do not hold.
UNBALANCED = 1e-9
# Planets from which on a housing may be stiffer one way than another, as the carrier turns.
LEAST_PLANETS = 3
# Of a space between planets: directions of planets that are as said.
EVEN = 1e-6


@dataclass(frozen=True)
class InHousing:
    """Displacement of hubs that stands still in the housing, and turns against the carrier.

    Parameters
    ----------
    displacement : ndarray of complex, shape (6 B,)
        Of all hubs, mm and rad: its real part, once it is multiplied by exp(i angle).
    housing : int
        Body that stands still with the housing: its angle against the carrier counts.
    """

    displacement: ComplexArray
    housing: int


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
    rates : tuple of Fraction
        Cycles of each mesh in one of the first mesh.
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
    clockwise: bool
    mesh_torques_Nm: Mapping[str, float] = field(default_factory=dict)
    rates: tuple[Fraction, ...] = ()
    wrench: FloatArray = field(default_factory=lambda: np.zeros(0))
    on_pins: PlanetsOnPins | None = None
    in_housing: InHousing | None = None

    @property
    def cycle(self) -> int:
        """Pitches of the first gear after which all meshes stand as before."""
        return math.lcm(*(rate.denominator for rate in self.rates))

    @property
    def directions(self) -> FloatArray:
        """Of the planets around the axis, rad."""
        return np.array([math.atan2(-self.bodies[n].x, self.bodies[n].y) for n in self.planets])

    @property
    def even(self) -> bool:
        """Whether planets are three at least, and evenly spaced."""
        return evenly_spaced(self.directions)

    def placed_pitches(self, pitches: int) -> int:
        """Return over how many of the pitches to solve a set is placed: until all meshes stand as before."""
        return pitches if pitches % self.cycle else self.cycle

    def rate_of(self, body: int) -> Fraction:
        """Pitches that a gear turns by while the first one turns by one."""
        return next(
            rate for mesh, rate in zip(self.meshes, self.rates, strict=True) if body in (mesh.pinion, mesh.wheel)
        )


def evenly_spaced(directions: FloatArray) -> bool:
    """Whether planets are three at least, and evenly spaced."""
    count = len(directions)
    if count < LEAST_PLANETS:
        return False
    steps = count * (directions - directions[0]) / (2.0 * math.pi)
    places = np.rint(steps)
    return float(abs(steps - places).max()) < EVEN and len(set(places % count)) == count


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
    places = planet_positions(said.planets, (sun, ring), (inner.wheel.teeth, outer.pinion.teeth))
    numbers = [number for number in range(said.planets.count) if number + 1 not in said.planets.missing]
    side = -1.0 if layout.clockwise else 1.0
    angles = [side * places[number] for number in numbers]
    bodies = [SetBody("sun", "sun", 0.0, 0.0), SetBody("ring", "ring", 0.0, 0.0)]
    for number, angle in zip(numbers, angles, strict=True):
        x, y = -distance * math.sin(angle), distance * math.cos(angle)
        bodies.append(SetBody(f"planet {number + 1}", "planet", x, y, direction=angle))
    _refuse_neighbours(bodies[2:], max(inner.wheel.tip_radius, outer.pinion.tip_radius))
    stands = standing(said, bodies, layout.clockwise, carrier)
    planets = tuple(range(2, len(bodies)))
    mates: Sequence[int] = planets
    if layout.shares[1].members[0] == SECOND_PLANET:
        bodies = _with_second_gears(bodies, _second_place(said.planets, inner, outer))
        mates = range(2 + len(planets), len(bodies))
    meshes = []
    for one, other in zip(planets, mates, strict=True):
        meshes += [SetMesh(layout.shares[0].name, 0, one), SetMesh(layout.shares[1].name, other, 1)]
    onto = onto_bodies(bodies)
    free, compliance = stands.free @ onto.T, onto @ stands.compliance @ onto.T
    twisting = [HUB * number + ROTATION for number, body in enumerate(bodies) if body.on is not None]
    compliance[twisting, twisting] += gives(said.supports.planet_torsion_Nmm_per_rad)
    through = sun * outer.pinion.teeth / (ring * inner.wheel.teeth)
    on_sun = {"sun": 1.0, "ring": through, "carrier": through / (1.0 + through)}[said.load.on]
    load = np.zeros(len(free))
    load[0] = 1.0
    displacement, eccentricity = planetary_errors(said, bodies, layout.clockwise)
    nominal_Nm = abs(said.load.torque_Nm)
    plan = SetPlan(
        bodies=tuple(bodies), meshes=tuple(meshes), planets=planets, free=free, compliance=compliance,
        displacement=displacement, eccentricity=eccentricity, driver=0, load=load, torque_Nm=nominal_Nm * on_sun,
        nominal_Nm=nominal_Nm, clockwise=layout.clockwise, on_pins=stands.planets,
    )  # fmt: skip
    return _under_load(plan, pairs)


def _second_place(planets: Planets, inner: GearPair, outer: GearPair) -> float:
    """Mid width of the second gears of stepped planets, from that of the first ones, mm."""
    if planets.second_z_mm is not None:
        return planets.second_z_mm
    return 0.5 * float(np.ptp(inner.faces[1]) + np.ptp(outer.faces[0]))


def _with_second_gears(bodies: Sequence[SetBody], z: float) -> list[SetBody]:
    """Sun, ring and planets, and the second gear of each planet behind them, in mesh with the ring."""
    sun, ring, *planets = bodies
    second = [
        replace(planet, name=f"second {planet.name}", member=SECOND_PLANET, z=z, on=number)
        for number, planet in enumerate(planets, start=2)
    ]
    return [sun, replace(ring, z=z), *planets, *second]


def planetary_errors(said: SetSections, bodies: Sequence[SetBody], clockwise: bool) -> tuple[FloatArray, FloatArray]:
    """Return displacements of hubs, (6 B,), and eccentricities of gears, (B, 2), mm, in the frame of the plan."""
    pins, off, side = said.planets, said.eccentricity, -1.0 if clockwise else 1.0
    numbers = [number for number in range(pins.count) if number + 1 not in pins.missing]
    displacement = np.zeros((2 + len(numbers), HUB))
    eccentric = [_eccentric(off.sun_um, side * off.sun_deg), _eccentric(off.ring_um, side * off.ring_deg)]
    for number, body, moved in zip(numbers, bodies[2:], displacement[2:], strict=False):
        outwards = np.array([body.x, body.y]) / math.hypot(body.x, body.y)
        if pins.radial_um:
            moved[:2] += 1e-3 * pins.radial_um[number] * outwards
        if pins.tangential_um:
            # The sense in which the torque turns the sun is counter-clockwise here.
            moved[:2] += 1e-3 * pins.tangential_um[number] * np.array([-outwards[1], outwards[0]])
        amount, ahead = (values[number] if values else 0.0 for values in (off.planets_um, off.planets_deg))
        eccentric.append(_eccentric(amount, math.degrees(math.atan2(-body.x, body.y)) + side * ahead))
    whole = (onto_bodies(bodies) @ displacement.ravel()).reshape(-1, HUB)
    for number, moved in zip(numbers, whole[len(displacement) :], strict=False):
        # The torque turns planets clockwise here.
        moved[ROTATION] -= 1e-3 * (pins.timing_mrad[number] if pins.timing_mrad else 0.0)
    return whole.ravel(), np.array(eccentric + [[0.0, 0.0]] * (len(bodies) - len(displacement)))


def with_errors(plan: SetPlan, said: SetSections) -> SetPlan:
    """Return a set with the errors that other sections say."""
    displacement, eccentricity = (
        train_errors(said, train_layout(said)) if said.gears
        else planetary_errors(said, plan.bodies, plan.clockwise)
    )  # fmt: skip
    return replace(plan, displacement=displacement, eccentricity=eccentricity)


def _eccentric(amount_um: float, direction_deg: float) -> list[float]:
    """Eccentricity of a gear, in a direction counter-clockwise from the y axis: x and y, mm."""
    direction = math.radians(direction_deg)
    return [-1e-3 * amount_um * math.sin(direction), 1e-3 * amount_um * math.cos(direction)]


def planet_positions(planets: Planets, teeth: tuple[int, int], stepped: tuple[int, int] = (1, 1)) -> list[float]:
    """Return angles of all planets, rad; GeometryError where they cannot be assembled.

    Parameters
    ----------
    teeth : (int, int)
        Of sun and ring.
    stepped : (int, int)
        Of the gears of a planet that mesh with them.
    """
    first, second = (count // math.gcd(*stepped) for count in stepped)
    # Places where the teeth of all meshes meet, in a turn.
    meet = teeth[0] * second + teeth[1] * first
    sums = f"teeth of sun and ring add up to {meet}"
    if first != second:
        sums = f"teeth meet at {teeth[0]} x {second} + {teeth[1]} x {first} = {meet} places of a turn"
    places = planets.positions_deg or tuple(360.0 * n / planets.count for n in range(planets.count))
    steps = [(place - places[0]) / 360.0 * meet for place in places]
    assembled = [places[0] + 360.0 * round(step) / meet for step in steps]
    for number, (place, near) in enumerate(zip(places, assembled, strict=True), start=1):
        if abs(place - near) > ASSEMBLED_DEG:
            rule = "" if planets.positions_deg else f"{sums}, which is no multiple of {planets.count} planets: "
            raise GeometryError(
                f"[planets] planet {number} at {place:.6g} deg: cannot be assembled: {rule}write positions_deg = "
                f"[{', '.join(f'{one:.6g}' for one in assembled)}], or change tooth numbers"
            )
    return [math.radians(place) for place in assembled]


def _refuse_neighbours(bodies: Sequence[SetBody], tip_radius: float) -> None:
    gap = planets_gap_mm(bodies, tip_radius)
    if gap <= 0.0:
        tips = 2.0 * tip_radius
        raise GeometryError(
            f"[planets] neighbours are {gap + tips:.6g} mm apart, and their tip circles are {tips:.6g} mm wide: take "
            "fewer planets, or fewer teeth on them"
        )


def planets_gap_mm(planets: Sequence[SetBody], tip_radius: float) -> float:
    """Return the gap between the tip circles of neighbours, mm: negative where they touch, endless of a single one."""
    apart = (math.dist((one.x, one.y), (other.x, other.y)) for one, other in combinations(planets, 2))
    return min(apart, default=math.inf) - 2.0 * tip_radius


def _trained(said: SetSections, layout: Layout, pairs: Mapping[str, GearPair]) -> SetPlan:
    side = -1.0 if layout.clockwise else 1.0
    names = [gear.name for gear in said.gears]
    places = [[names.index(member) for member in share.members] for share in layout.shares]
    meshes = [SetMesh(share.name, one, other) for share, (one, other) in zip(layout.shares, places, strict=True)]
    # On a shaft the gear that meshes first stands for all.
    stands = {said.gears[n].shaft or names[n]: n for n in reversed([n for both in places for n in both])}
    bodies, shafts = [], list[int]()
    for number, gear in enumerate(said.gears):
        first = stands.get(gear.shaft or gear.name, number)
        x, y, z = (*gear.at_mm, 0.0)[:3]
        bodies.append(SetBody(gear.name, gear.name, side * x, y, z, None if first == number else first))
        shafts.append(first)
    torques = dict.fromkeys((shafts[meshes[0].pinion], *shafts), 0.0)
    for shaft, gear in zip(shafts, said.gears, strict=True):
        torques[shaft] += side * gear.torque_Nm if isinstance(gear.torque_Nm, float) else 0.0
    for shaft, gear in zip(shafts, said.gears, strict=True):
        if gear.torque_Nm == "balance":
            del torques[shaft]
    size = HUB * len(bodies)
    free, compliance = np.zeros((len(torques), size)), np.zeros((size, size))
    for row, turning in zip(free, torques, strict=True):
        row[[HUB * number + ROTATION for number, shaft in enumerate(shafts) if shaft == turning]] = 1.0
    for number, gear in enumerate(said.gears):
        place = HUB * number + ROTATION
        compliance[place, place] = gives(gear.torsion_Nmm_per_rad)
    displacement, eccentricity = train_errors(said, layout)
    first_Nm, *_ = amounts = list(torques.values())
    plan = SetPlan(
        bodies=tuple(bodies), meshes=tuple(meshes), planets=(), free=free, compliance=compliance,
        displacement=displacement, eccentricity=eccentricity, driver=0, load=np.array(amounts) / first_Nm,
        torque_Nm=first_Nm, nominal_Nm=first_Nm, clockwise=layout.clockwise,
    )  # fmt: skip
    return _under_load(plan, pairs)


def train_errors(said: SetSections, layout: Layout) -> tuple[FloatArray, FloatArray]:
    """Return what `planetary_errors` does of a train: timing of gears on shared shafts, and eccentricities."""
    side = -1.0 if layout.clockwise else 1.0
    displacement = np.zeros((len(said.gears), HUB))
    displacement[:, ROTATION] = [1e-3 * side * layout.senses.get(one.name, 0) * one.timing_mrad for one in said.gears]
    eccentric = [_eccentric(gear.eccentricity_um, side * gear.eccentricity_deg) for gear in said.gears]
    return displacement.ravel(), np.array(eccentric)


def closing_rows(
    bodies: Sequence[SetBody], meetings: Sequence[Meeting], placed: Sequence[Placement]
) -> FloatArray:
    """Return the change of the gap of each mesh by displacements of all hubs, (M, 6 B)."""
    rows = np.zeros((len(meetings), HUB * len(bodies)))
    for row, mesh, place in zip(rows, meetings, placed, strict=True):
        wrenches = smooth_rows(mesh.pair, place.direction, place.image)
        for body, wrench in zip((mesh.pinion, mesh.wheel), wrenches, strict=True):
            row[HUB * body : HUB * (body + 1)] += wrench
    return rows


def _under_load(plan: SetPlan, pairs: Mapping[str, GearPair]) -> SetPlan:
    """Return a plan with what its meshes do under its load; CaseError where they do not hold it."""
    bodies, load, centres = plan.bodies, plan.load, [body.centre for body in plan.bodies]
    meetings = [Meeting(pairs[mesh.case], mesh.pinion, mesh.wheel) for mesh in plan.meshes]
    rows = closing_rows(bodies, meetings, placements(centres, meetings))
    closing = rows @ plan.free.T
    forces, *_ = np.linalg.lstsq(closing.T, -load, rcond=None)
    if np.abs(closing.T @ forces + load).max() > UNBALANCED * np.abs(load).max():
        raise CaseError("the meshes do not hold the torques: each gear that is no idler needs its torque_Nm")
    torques: dict[str, float] = {}
    for mesh, force in zip(plan.meshes, forces, strict=True):
        if force <= UNBALANCED * np.abs(forces).max():
            pinion, wheel = bodies[mesh.pinion].name, bodies[mesh.wheel].name
            raise CaseError(
                f"gear {pinion} does not drive gear {wheel} under these torques: correct them, or their signs"
            )
        torque = plan.torque_Nm * float(force) * pairs[mesh.case].pinion.base_radius
        torques[mesh.case] = max(torques.get(mesh.case, 0.0), torque)
    rates = mesh_rates(centres, meetings)
    return replace(plan, mesh_torques_Nm=torques, rates=rates, wrench=forces @ rows)


def turned_housing(plan: SetPlan, angle: float) -> SetPlan:
    """Return a set whose housing stands further around its carrier, counter-clockwise, rad."""
    assert plan.in_housing is not None
    ahead = plan.in_housing.displacement * np.exp(1j * angle)
    return replace(plan, in_housing=replace(plan.in_housing, displacement=ahead))


def hubs_off(plan: SetPlan, still: FloatArray, rates: FloatArray, phi: FloatArray) -> FloatArray:
    """Return hubs off their places at angles of the first gear by what stands `still` (6 B,) and turns, (A, B, 6)."""
    displacement = np.tile(still.reshape(-1, HUB), (len(phi), 1, 1))
    turn = np.exp(1j * np.outer(phi, rates))
    turned = turn * (plan.eccentricity @ [1.0, 1j])
    displacement[..., 0] += turned.real
    displacement[..., 1] += turned.imag
    if plan.in_housing is not None:
        ahead = turn[:, plan.in_housing.housing]
        displacement += np.outer(ahead, plan.in_housing.displacement).real.reshape(displacement.shape)
    return displacement
