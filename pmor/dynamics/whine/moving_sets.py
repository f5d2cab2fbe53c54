"""Planetary sets in a machine in small motion: on the shafts of a gearbox, or a set file's on its own supports.

Gears have mass and inertias as drawn; planets stand in the carrier as they do at rest (`pmor.sets.supports`). A carrier
has the mass of its shaft, in a set file that of `[[masses]]`, and that of the pins. In a set file the sun turns freely,
or the ring where the sun is held, and members that have inertia there; the others turn evenly.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag

from pmor.body.beam import NODE
from pmor.core.arrays import FloatArray
from pmor.core.errors import CaseError
from pmor.dynamics.whine.blades import Blades
from pmor.dynamics.whine.moving import MovingMachine
from pmor.dynamics.whine.planets import (
    CENTRAL,
    HUBS,
    Further,
    MovingSet,
    PlanetCoordinates,
    hub_rows,
    planet_matrices,
    uneven,
)
from pmor.gear.inertia import Inertia, disc
from pmor.line.hub_law import train_coordinates
from pmor.line.several import GearTrain
from pmor.machine.coupled_sets import SolvedSet
from pmor.machine.load_settings import LoadCase
from pmor.machine.loaded import ABOUT_AXIS, LoadedGearbox
from pmor.machine.model import GearboxModel
from pmor.machine.set_frame import MEMBERS, set_frame
from pmor.machine.weights import inertias_of_set
from pmor.sets.kinematics import member_speeds, torque_ratios
from pmor.sets.loader import SetFile, with_sections
from pmor.sets.supports import ROTATION, X, Y, carrier_on_bearings

# Members that sun and ring are, which come first among bodies.
CENTRAL_MEMBERS = MEMBERS.index("sun"), MEMBERS.index("ring")
# Of the stiffness of supports in the carrier: what may differ as it turns.
ALIKE = 1e-6


class _Hubs(NamedTuple):
    """Where a set stands.

    Attributes
    ----------
    places : tuple of int or None
        First displacements of the nodes of sun, carrier and ring; None of the housing.
    turn, carried : ndarray
        As in `pmor.machine.set_frame.SetFrame`.
    filled_mm : float
        Radius of the sun's shaft.
    loose : tuple of int
        Members that nothing holds about the axis, of those without a shaft.
    masses : tuple of (int, Inertia)
        What moves with members beside the gears.
    alike : bool
        Whether all that they stand on is alike all around.
    """

    places: tuple[int | None, ...]
    turn: FloatArray
    carried: FloatArray
    filled_mm: float = 0.0
    loose: tuple[int, ...] = ()
    masses: tuple[tuple[int, Inertia], ...] = ()
    alike: bool = False


def with_sets(machine: MovingMachine, model: GearboxModel, sets: Sequence[SolvedSet]) -> MovingMachine:
    """Return a machine with the planets of its sets, their meshes behind its own.

    Raises
    ------
    CaseError
        Where planets stand unlike in a carrier that turns.
    """
    for meshing, one in zip(machine.gearbox.sets, sets, strict=True):  # its shafts have further nodes
        sun = meshing.settings.members.get("sun")
        filled = 0.0 if sun is None else 0.5 * model.shafts[sun.shaft].section_at(sun.at_mm).outer_mm
        frame, members = meshing.frame, meshing.settings.members
        about = frame.turn[ABOUT_AXIS, ROTATION]
        speeds: dict[str, float] = {
            name: about * machine.rates.get(place.shaft, 0.0) for name, place in members.items()
        }
        hubs = _Hubs(meshing.hubs, frame.turn, frame.carried, filled)
        machine = _joined(machine, meshing.settings.name, meshing.file, one.solution.train, hubs, speeds)
    return machine


def machine_of_set(file: SetFile, train: GearTrain) -> MovingMachine:
    """Return the machine that a set file describes, alone on its supports; its speed is that of the loaded member.

    Raises
    ------
    CaseError
    """
    assert file.sections.load is not None, "of a planetary set"
    none, load = np.zeros((0, 0)), file.sections.load
    alone = LoadedGearbox({}, {}, (), (), (), (), np.zeros(0), np.zeros(0), none)
    machine = MovingMachine(alone, LoadCase(name=file.name, torques=()), none, none, none, none, {}, 1.0, none)
    ratios = torque_ratios(file.teeth)
    driven = math.copysign(1.0, ratios[load.on] / ratios["sun"])
    speeds = member_speeds(file.teeth, load.on, load.held, driven)
    frame = set_frame(file.plan, 1.0, (0.0, 0.0, 0.0))
    masses = tuple((MEMBERS.index(one.on), one.inertia) for one in file.sections.masses)
    turning = {MEMBERS.index("ring" if load.held == "sun" else "sun")}
    turning |= {member for member, inertia in masses if inertia.polar_kg_m2}
    loose = tuple(turning - {MEMBERS.index(load.held)})
    hubs = _Hubs((None,) * len(MEMBERS), np.eye(NODE), frame.carried, loose=loose, masses=masses, alike=True)
    return _joined(machine, file.name, file, train, hubs, speeds)


def _joined(
    machine: MovingMachine, name: str, file: SetFile, train: GearTrain, hubs: _Hubs, speeds: Mapping[str, float]
) -> MovingMachine:
    """A machine with one more set; speeds are those of its members in the plan, over the machine's."""
    plan, carrier = file.plan, speeds.get("carrier", 0.0)
    own_way = not plan.even or bool(plan.displacement.any()) or file.sections.carrier.stiffness is not None
    blades = Blades(plan.directions, carried=bool(hubs.alike and carrier and own_way))
    own = [member for member, place in enumerate(hubs.places) if place is None]
    carried = hubs.carried.copy()
    for body, member in enumerate(CENTRAL_MEMBERS):
        if member in own:
            carried[NODE * body : NODE * (body + 1)] = np.eye(HUBS)[NODE * member :][:NODE]
    coordinates = PlanetCoordinates(blades, carried)
    against = train.rates / train.rates[0] * (speeds.get("sun", 0.0) - carrier)
    spins = [speeds.get("sun", 0.0), speeds.get("ring", 0.0), *(carrier + against[CENTRAL:])]
    compliance, free = _supports(file, own, hubs.loose)
    inertias = inertias_of_set(file, hubs.filled_mm)
    turn = [speeds.get(member, 0.0) for member in MEMBERS]
    further = [Further(hub_rows(coordinates, member), inertia, 0.0, turn[member]) for member, inertia in hubs.masses]
    further += _pins(file, coordinates, carrier)
    matrices = planet_matrices(coordinates, inertias, compliance, free, carrier, spins, own, further)
    if carrier and uneven(matrices.stiffness, coordinates.turning, coordinates.turning) > ALIKE:
        raise CaseError(
            f'set "{name}": [carrier] stiffness: planets stand unlike on a carrier that turns: no constant stiffness, '
            "motion is not found: give all seats of the matrix their mean"
        )
    by = _by(len(machine.mass), hubs, own, coordinates.size)
    further = by.shape[1] - len(machine.mass)
    grown = [
        np.pad(whole, (0, further)) + by.T @ local @ by
        for whole, local in ((machine.mass, matrices.mass), (machine.stiffness, matrices.stiffness),
                             (machine.gyroscopic, matrices.gyroscopic))
    ]  # fmt: skip
    ports = coordinates.ports(train_coordinates(train))
    meshes = np.concatenate([np.pad(machine.meshes, ((0, 0), (0, further))), ports @ by])
    teeth = train.bodies[0].teeth
    rate = float(against[0]) * teeth
    housed = tuple(member for member, place in enumerate(hubs.places) if place is None)
    joined = MovingSet(
        name, coordinates, matrices, by, further, len(machine.meshes), len(ports), carrier, rate, teeth, housed
    )
    mass, stiffness, gyroscopic = grown
    return replace(
        machine, mass=mass, stiffness=stiffness, gyroscopic=gyroscopic, meshes=meshes, sets=(*machine.sets, joined)
    )


def _supports(file: SetFile, own: Sequence[int], loose: Sequence[int]) -> tuple[FloatArray, FloatArray]:
    """Compliance and free movements of all hubs, that of the carrier last, which planets stand on where it moves."""
    plan, said, carrier = file.plan, file.sections, MEMBERS.index("carrier")
    seat = carrier_on_bearings(said, np.zeros((1, 3)))
    if carrier in own:
        rigid = replace(said.carrier, radial_N_per_mm="rigid", tilt_Nmm_per_rad="rigid", bearings_at_mm=0.0)
        plan = with_sections(file, replace(said, carrier=rigid)).plan
    free, size = np.pad(plan.free[1:], ((0, 0), (0, NODE))), len(plan.compliance)  # without the sun against the carrier
    bodies = dict(zip((*CENTRAL_MEMBERS, carrier), (0, 1, len(plan.bodies)), strict=True))
    ways = [NODE * bodies[member] + ROTATION for member in loose]
    if said.carrier.radial_N_per_mm == "free":
        ways += [size + way for way in (X, Y)]
    return block_diag(plan.compliance, seat), np.concatenate([free, np.eye(size + NODE)[ways]])


def _pins(file: SetFile, coordinates: PlanetCoordinates, carrier: float) -> list[Further]:
    """Pins, which move with the carrier."""
    pins, found = file.sections.pins, list[Further]()
    if pins is None:
        return found
    density = next(iter(file.cases.values())).dynamics.density_kg_m3
    inertia = disc(0.5 * pins.diameter_mm, 0.5 * pins.inner_mm, pins.length_mm, density)
    for body in file.plan.planets:
        rows = np.zeros((NODE, coordinates.size))
        rows[:, :HUBS] = coordinates.carried[NODE * body : NODE * (body + 1)]
        found.append(Further(rows, inertia, pins.middle_mm, carrier))
    return found


def _by(before: int, hubs: _Hubs, own: Sequence[int], size: int) -> FloatArray:
    """Coordinates of a set by the displacements of the machine, its own ones behind those before, (L, n)."""
    by = np.zeros((size, before + NODE * len(own) + size - HUBS))
    for member, hub in enumerate(hubs.places):
        if hub is not None:
            by[NODE * member : NODE * (member + 1), hub : hub + NODE] = hubs.turn.T
    for number, member in enumerate(own):
        column = before + NODE * number
        by[NODE * member :, column : column + NODE][:NODE] = np.eye(NODE)
    by[HUBS:, before + NODE * len(own) :] = np.eye(size - HUBS)
    return by
