"""A planetary set over a turn of its carrier, on bearings with their clearances and under loads that stand still.

Gravity, moments on the rotor and forces of other meshes stand in the housing and turn against the carrier, and so does
the loaded zone of the bearings. Positions are solved in their order, a mesh pitch after the other: the contact of all
meshes exactly on the machine linearised about its bearings' state (`pmor.machine.seated`), and this state by Newton's
method, since both laws are monotone: one convex problem.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from itertools import product
from typing import NamedTuple

import numpy as np

from pmor.body.rolling_bearing import DOF, BearingState
from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.line.hubs import HUB
from pmor.line.kernels.flexibility import Flexibility
from pmor.line.kernels.types import LineResults
from pmor.line.several import GearTrain, PlacedTrain
from pmor.machine.loaded import BEARING_ROWS, LoadedGearbox, SetMeshing, row_of
from pmor.machine.seated import Linearised, SeatedMachine, seated
from pmor.machine.seated_pins import SeatedPins, seated_pins
from pmor.machine.set_frame import ABOUT, MEMBERS, turned
from pmor.machine.system import UNITS, Equilibrium
from pmor.machine.turning import turns_of
from pmor.sets.solution import errors_of, on_planets, solve_placed

MOST_STEPS = 60
# Stiffness that holds rings that lie loose where they are for a step, at least and at most, N/mm.
LEAST, MOST = 1.0, 1e12
# Positions at which the mean of a turn is found, about so many, and by how many angles of the mesh each goes on.
MEAN_PLACES, LATTICE = 24, 7
# Orders of the carrier and of loads that turn, and of both together, that have no share in this mean.
LOW = 2
# Forces of the bearings that are left, over the largest one.
SETTLED = 1e-10


@dataclass(frozen=True, eq=False)
class CarrierTurn:
    """A set over a turn of its carrier against the housing, P positions.

    Parameters
    ----------
    angle_deg : ndarray, shape (P,)
        Of the carrier.
    hub_wrench : ndarray, shape (P, B, 6)
        Of the meshes on all bodies of the set, in axes of the plan that turn with the carrier, N and N mm.
    tilt : ndarray, shape (P, B, 2)
        Of all bodies from the drawing, about both axes across in the same axes, rad.
    hanging : ndarray, shape (P, B, 6)
        Weights of the bodies that no shaft carries, in the same axes.
    member_wrench : ndarray, shape (P, 3, 6)
        Of the meshes on sun, carrier and ring, in axes of the machine.
    hub_displacement : ndarray, shape (P, 3, 6)
        Of sun, carrier and ring in the housing, in axes of the machine, mm and rad.
    bearing_force : ndarray, shape (P, s, 6)
        What shafts press on all supports of the machine, in axes of the machine, N and N mm.
    rings : ndarray, shape (P, r, 5)
        Displacements of the inner rings of the rolling bearings on shafts, then of those on pins, mm and rad.
    pin_load : ndarray, shape (P, N, b, 4)
        On the bearings of all planets, as in `pmor.sets.pins.PlanetOnPin`.
    converged : ndarray of bool, shape (P,)
    pins : SeatedPins or None
        Rolling bearings on pins.
    turns : int
        Of the carrier, until all loads stand as before.
    rates : ndarray, shape (R,)
        Turns of the loads that turn with shafts, to one of the carrier.
    """

    angle_deg: FloatArray
    hub_wrench: FloatArray
    tilt: FloatArray
    hanging: FloatArray
    member_wrench: FloatArray
    hub_displacement: FloatArray
    bearing_force: FloatArray
    rings: FloatArray
    pin_load: FloatArray
    converged: BoolArray
    pins: SeatedPins | None
    turns: int
    rates: FloatArray


@dataclass(frozen=True, eq=False)
class SetPositions:
    """A set placed at angles over a cycle of its meshes, with what is kept of them from one solution to the next.

    Parameters
    ----------
    train : GearTrain
        On its own supports, all members held.
    phi : ndarray, shape (A,)
        Angles of the train, a number of them to each pitch of the first mesh.
    placed : list of PlacedTrain, length A
    rows : list of ndarray, shape (N, 18 + 6 p)
        Wrenches on the members by unit forces in the sections, and on planets whose bearings have a law.
    carried : ndarray, shape (6 B, 18 + 6 p)
        Displacements of all bodies by those of the same.
    pins : SeatedPins or None
    workspaces : list of Flexibility
    before : list of LineResults or None
        Solved last at each angle.
    """

    train: GearTrain
    phi: FloatArray
    placed: list[PlacedTrain]
    rows: list[FloatArray]
    carried: FloatArray
    pins: SeatedPins | None
    workspaces: list[Flexibility]
    before: list[LineResults | None]


def set_positions(one: SetMeshing, train: GearTrain, angles: int) -> SetPositions:
    """Place a set at so many angles of each pitch, over a cycle of all meshes."""
    plan = one.file.plan
    phi = train.meshes[0].pair.meshed.pair.pitch * np.arange(plan.cycle * angles) / angles
    placed = [train.place(phi[n : n + 1], plan.displacement) for n in range(len(phi))]
    pins, carried = seated_pins(one), one.frame.carried
    if pins is not None:
        carried = np.hstack([carried, pins.carried])
    rows = [np.concatenate([at.on_bodies(mesh, carried.T) for mesh in at.placed], axis=1)[0] for at in placed]
    workspaces = [at.workspace() for at in placed]
    size = len(rows[0])
    workspaces = [one._replace(further=np.empty((1, size, size))) for one in workspaces]
    return SetPositions(train, phi, placed, rows, carried, pins, workspaces, [None] * len(placed))


@dataclass(frozen=True)
class _Turning:
    """What does not change from position to position.

    Parameters
    ----------
    there : ndarray of int
        Displacements of the members that stand on shafts, of all 18.
    turn : ndarray, shape (18, 18)
        Axes of the plan in the machine, of all members.
    load : ndarray, shape (1, K)
        On the free movements.
    weights : ndarray, shape (6 B,)
        Of the bodies that no shaft carries, in axes of the plan at rest.
    about : float
        Sense about x in which the carrier turns by an angle of the housing against it.
    turns : int
        Of the carrier, until all loads stand as before.
    """

    one: SetMeshing
    at: SetPositions
    machine: SeatedMachine
    there: IntArray
    turn: FloatArray
    load: FloatArray
    weights: FloatArray
    about: float
    turns: int

    def solve(self, number: int, cycle: int, angle: float, machine: Linearised) -> tuple[FloatArray, FloatArray, bool]:
        """Return the forces in all sections, and the wrench on members, in axes of the machine, and on planets."""
        at, plan, hubs = self.at, self.one.file.plan, len(self.there)
        placed, rows, workspace = at.placed[number], at.rows[number], at.workspaces[number]
        compliance, offset, in_plan = np.zeros((18, 18)), np.zeros(18), np.zeros((rows.shape[1],) * 2)
        compliance[np.ix_(self.there, self.there)] = machine.compliance[:hubs, :hubs]
        offset[self.there] = machine.offset[:hubs]
        in_plan[:18, :18] = turned(turned(self.turn.T @ compliance @ self.turn, angle).T, angle)
        moved, weights = np.zeros(len(in_plan)), turned(self.weights, angle)
        moved[:18] = turned(offset @ self.turn, angle)
        moved[ABOUT] = 0.0
        hanging = weights @ at.carried[:, 18:]
        if at.pins is not None:  # the train has its planets on springs
            in_plan[18:, 18:] = machine.compliance[hubs:, hubs:] - at.pins.on_pins.compliance
            moved[18:] = machine.offset[hubs:] + in_plan[18:, 18:] @ hanging
        gives = np.flatnonzero(in_plan.any(axis=0))
        np.matmul(rows[:, gives] @ in_plan[np.ix_(gives, gives)], rows[:, gives].T, out=workspace.further[0])
        off = at.carried @ moved + at.train.compliance @ weights
        plan = replace(plan, displacement=plan.displacement + off)
        load, errors = self.load + (at.train.free @ weights)[None], errors_of(plan, placed, cycle)
        found = solve_placed(placed, load, errors, cycle, workspace, at.before[number])
        if found.converged.all():
            at.before[number] = found
        total = found.force[0, 0] @ rows
        wrench = np.concatenate([(self.turn @ turned(total[:18], -angle))[self.there], total[18:] + hanging])
        return found.force[0, 0], wrench, bool(found.converged[0, 0])


def carrier_turn(
    gearbox: LoadedGearbox, equilibrium: Equilibrium, number: int, torque: float, at: SetPositions
) -> CarrierTurn:
    """Solve a set over turns of its carrier until loads stand as before, at the start of each pitch of its first mesh.

    Parameters
    ----------
    gearbox, equilibrium
        Under its load, with the mean forces of all other meshes.
    number : int
        Of the set.
    torque : float
        On the sun, N mm.
    at : SetPositions
        Of this set.
    """
    train, rate = at.train, at.train.rates[gearbox.sets[number].housing]
    pitch, cycle = train.meshes[0].pair.meshed.pair.pitch, gearbox.sets[number].file.plan.cycle
    turning = _turning(gearbox, equilibrium, number, torque, at)
    pitches = np.arange(turning.turns * round(2.0 * np.pi / abs(rate * pitch)))
    each = len(at.phi) // cycle
    return _turned(
        turning, pitches % cycle * each, pitches // cycle * cycle,
        np.asarray(rate * pitch * pitches, dtype=np.float64), ahead=True,
    )  # fmt: skip


def mean_turn(
    gearbox: LoadedGearbox, equilibrium: Equilibrium, number: int, torque: float, at: SetPositions
) -> CarrierTurn:
    """Solve a set at few positions with the mean of a turn: places of the carrier and of the meshes by a lattice rule.

    Parameters are those of `carrier_turn`. Meshes stand at all angles at which the set is placed, as often each
    (Korobov 1959): orders of the turn and of the mesh below the number of positions have no share in the mean, nor have
    low orders of loads that turn.
    """
    angles, turning = len(at.phi), _turning(gearbox, equilibrium, number, torque, at)
    count = angles * max(1, math.ceil(MEAN_PLACES / angles))
    while _seen_as_mean(count, turning.turns, turning.machine.rates):
        count += angles
    positions = np.arange(count)
    rate = float(at.train.rates[gearbox.sets[number].housing])
    angle = np.asarray(math.copysign(2.0 * np.pi * turning.turns / count, rate) * positions, dtype=np.float64)
    return _turned(turning, positions * LATTICE % angles, 0 * positions, angle)


def _seen_as_mean(count: int, turns: int, rates: FloatArray) -> bool:
    """Whether so many positions over turns see low orders of the carrier and of loads that turn as a mean."""
    basis = np.array([turns, *np.rint(turns * rates).astype(int)])
    orders = np.array(list(product(range(-LOW, LOW + 1), repeat=len(basis)))) @ basis
    return bool(((orders % count == 0) & (orders != 0)).any())


def _turned(
    turning: _Turning, numbers: IntArray, cycles: IntArray, angles: FloatArray, ahead: bool = False
) -> CarrierTurn:
    """Solve positions one after the other: numbers of placed angles, pitches later, angles of the carrier, (P,).

    Parameters
    ----------
    ahead : bool
        Whether the meshes stand alike at all, so that three positions lead on to the next one.
    """
    one, at = turning.one, turning.at
    place, states = turning.machine.start, turning.machine.states(turning.machine.start)
    forces, tilts, hanging, members, hubs, loads, apart = [], [], [], [], [], [], []
    settled, rings = list[bool](), list[FloatArray]()
    seats, there, of_shafts = turning.machine.seats, len(turning.there), DOF * len(turning.machine.numbers)
    for number, cycle, angle in zip(numbers.tolist(), cycles.tolist(), angles.tolist(), strict=True):
        found, machine = None, turning.machine.at(turning.about * angle)
        if ahead and settled[-3:] == [True] * 3:
            guess = (3.0 * (rings[-1] - rings[-2]) + rings[-3]).ravel()
            found = _settled(turning, machine, number, cycle, angle, guess, machine.states(guess))
        if found is None or not found.converged:
            found = _settled(turning, machine, number, cycle, angle, place, states)
        place, states = (found.place, found.states) if found.converged else (place, states)
        settled.append(found.converged)
        wrench = np.zeros((len(at.train.bodies), HUB))
        for mesh in at.placed[number].placed:
            for gear, body in enumerate(mesh.mesh.bodies):
                wrench[body] += found.force[mesh.part] @ mesh.rows[0, :, gear]
        forces.append(wrench)
        weights = turned(turning.weights, angle)
        hanging.append(weights.reshape(-1, HUB))
        members.append(one.frame.in_machine(turned((found.force @ at.rows[number])[:18], -angle)))
        displaced, moved = machine.at_rest + machine.flexibility @ found.forces, np.zeros(18)
        moved[turning.there] = displaced[seats : seats + there]
        hubs.append(moved.reshape(3, HUB))
        by = np.zeros(at.carried.shape[1])
        by[:18] = turned(moved @ turning.turn, angle)
        if at.pins is not None:  # the train has its planets on springs
            by[18:] = displaced[seats + there :] - at.pins.on_pins.compliance @ found.forces[seats + there :]
        drawn = one.file.plan.displacement + at.carried @ by + at.train.compliance @ (wrench.ravel() + weights)
        tilts.append(drawn.reshape(-1, HUB)[:, 3:5])
        load = machine.carried @ found.forces + machine.carried_at_rest
        for seat, pressed in zip(machine.numbers, found.pressed.reshape(-1, DOF), strict=False):
            load[seat, list(BEARING_ROWS)] += pressed
        loads.append(load)
        rings.append(found.place.reshape(-1, DOF))
        apart.append(found.forces[of_shafts:seats])
    wrenches, weighed = np.array(forces), np.array(hanging)
    gaps = None if at.pins is None else at.pins.gaps(np.array(apart))
    on_pins, on = one.file.plan.on_pins, on_planets(one.file.plan, wrenches + weighed)
    assert on_pins is not None, "of a planetary set"
    return CarrierTurn(
        np.degrees(np.abs(angles)), wrenches, np.array(tilts), weighed, np.array(members), np.array(hubs),
        np.array(loads), np.array(rings), on_pins.on_bearings(on, gaps), np.array(settled), at.pins,
        turning.turns, turning.machine.rates,
    )  # fmt: skip


class _Settled(NamedTuple):
    """A position: displacements of inner rings, states of bearings, forces in sections, and those on all places.

    Forces of bearings `pressed` are those of the last linearised state, which balance all others to the last digit, and
    none of bearings that lie loose; states have the same to what is settled.
    """

    place: FloatArray
    states: list[BearingState]
    pressed: FloatArray
    force: FloatArray
    forces: FloatArray
    converged: bool


def _settled(
    turning: _Turning, machine: SeatedMachine, number: int, cycle: int, angle: float, place: FloatArray,
    states: list[BearingState],
) -> _Settled:  # fmt: skip
    added, left, units = LEAST, math.inf, np.tile(UNITS, len(machine.bearings))
    for _ in range(MOST_STEPS):
        linear = machine.linearised(place, states, added)
        force, wrench, converged = turning.solve(number, cycle, angle, linear)
        tried = linear.seat_offset + linear.seat_compliance @ wrench
        after = machine.states(tried)
        told = machine.forces_told(place, states, added, tried)
        got = machine.forces_of(after)
        size = max(float(np.abs(units * got).max(initial=0.0)), 1.0)
        error = float(np.abs(units * (got - told)).max(initial=0.0)) / size
        if converged and (error < left or error < SETTLED):
            place, states, left, added = tried, after, error, max(0.1 * added, LEAST)
            if error < SETTLED:
                carrying = np.where(got == 0.0, 0.0, told)
                return _Settled(place, states, carrying, force, machine.forces_at(place, told, wrench), True)
        elif added > MOST:
            break
        else:
            added *= 10.0
    lost = machine.forces_at(place, told, wrench) * np.nan
    return _Settled(place, states, told * np.nan, force * np.nan, lost, False)


def _turning(
    gearbox: LoadedGearbox, equilibrium: Equilibrium, number: int, torque: float, at: SetPositions
) -> _Turning:
    one = gearbox.sets[number]
    still = gearbox.load + gearbox.weight
    for force, mesh in zip(equilibrium.reactions[gearbox.reactions["meshes"]], gearbox.meshes, strict=True):
        still = still + force * row_of(mesh.hubs, mesh.wrenches, len(still))
    for other, (amount, meshing) in enumerate(
        zip(equilibrium.reactions[gearbox.reactions["sets"]], gearbox.sets, strict=True)
    ):
        if other != number:
            still = still + amount * row_of(meshing.hubs, meshing.wrenches, len(still))
    hubs = [hub for hub in one.hubs if hub is not None]
    there = np.concatenate([HUB * n + np.arange(HUB) for n, hub in enumerate(one.hubs) if hub is not None])
    turn = np.asarray(np.kron(np.eye(len(MEMBERS)), one.frame.turn), dtype=np.float64)
    load = (torque * one.file.plan.load)[None]
    quarter = one.frame.turn[:3, :3] @ np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    about = -float(np.sign((quarter @ one.frame.turn[:3, :3].T)[2, 1]))
    rates = [load_.rates[number] for load_ in gearbox.turning]
    turns = turns_of(rates)
    assert turns is not None, "loads that do not come back are refused"
    machine = seated(gearbox, equilibrium, hubs, still, rates)
    if at.pins is not None:
        machine = at.pins.beside(machine, torque * one.file.plan.wrench)
    return _Turning(one, at, machine, there, turn, load, one.hanging_in_plan, about, turns)
