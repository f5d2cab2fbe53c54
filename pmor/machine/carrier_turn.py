"""A planetary set over a turn of its carrier, on bearings with their clearances and under loads that stand still.

Gravity, moments on the rotor and forces of other meshes stand in the housing and turn against the carrier, and so does
the loaded zone of the bearings. Positions are solved in their order, a mesh pitch after the other: the contact of all
meshes exactly on the machine linearised about its bearings' state (`pmor.machine.seated`), and this state by Newton's
method, since both laws are monotone: one convex problem.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from pmor.body.rolling_bearing import BearingState
from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.line.hubs import HUB
from pmor.line.kernels.flexibility import Flexibility
from pmor.line.kernels.types import LineResults
from pmor.line.several import GearTrain, PlacedTrain
from pmor.machine.loaded import BEARING_ROWS, LoadedGearbox, SetMeshing, row_of
from pmor.machine.seated import Linearised, SeatedMachine, seated
from pmor.machine.set_frame import ABOUT, MEMBERS, turned
from pmor.machine.system import UNITS, Equilibrium
from pmor.sets.plan import SetPlan
from pmor.sets.solution import errors_of, solve_placed

MOST_STEPS = 60
# Stiffness that holds rings that lie loose where they are for a step, N/mm.
LEAST = 1.0
# Shares of what other loads do to the hubs, one after the other at the first position: a sun that floats may sag by
# millimetres where its meshes do not hold it.
RAMP = (0.0, 0.01, 0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 0.85, 1.0)
# Forces of the bearings that are left, over the largest one.
SETTLED = 1e-9


@dataclass(frozen=True, eq=False)
class CarrierTurn:
    """A set over a turn of its carrier against the housing, P positions.

    Parameters
    ----------
    angle_deg : ndarray, shape (P,)
        Of the carrier.
    hub_wrench : ndarray, shape (P, B, 6)
        Of the meshes on all bodies of the set, in axes of the plan that turn with the carrier, N and N mm.
    hanging : ndarray, shape (P, B, 6)
        Weights of the bodies that no shaft carries, in the same axes.
    member_wrench : ndarray, shape (P, 3, 6)
        Of the meshes on sun, carrier and ring, in axes of the machine.
    hub_displacement : ndarray, shape (P, 3, 6)
        Of sun, carrier and ring in the housing, in axes of the machine, mm and rad.
    bearing_force : ndarray, shape (P, s, 6)
        What shafts press on all supports of the machine, in axes of the machine, N and N mm.
    converged : ndarray of bool, shape (P,)
    """

    angle_deg: FloatArray
    hub_wrench: FloatArray
    hanging: FloatArray
    member_wrench: FloatArray
    hub_displacement: FloatArray
    bearing_force: FloatArray
    converged: BoolArray


@dataclass(frozen=True)
class _Turning:
    """What does not change from position to position.

    Parameters
    ----------
    there : ndarray of int
        Displacements of the members that stand on shafts, of all 18.
    placed : list of PlacedTrain
        At one angle each, over a cycle of all meshes.
    rows : list of ndarray, shape (N, 18)
        Wrenches on the members by unit forces in the sections.
    load : ndarray, shape (1, K)
        On the free movements.
    weights : ndarray, shape (6 B,)
        Of the bodies that no shaft carries, in axes of the plan at rest.
    """

    one: SetMeshing
    plan: SetPlan
    machine: SeatedMachine
    there: IntArray
    turn: FloatArray
    placed: list[PlacedTrain]
    rows: list[FloatArray]
    workspaces: list[Flexibility]
    load: FloatArray
    weights: FloatArray
    before: list[LineResults | None]

    def solve(self, number: int, cycle: int, angle: float, machine: Linearised) -> tuple[FloatArray, FloatArray, bool]:
        """Return the forces in all sections, and the wrench on the members in axes of the machine."""
        placed, rows = self.placed[number], self.rows[number]
        compliance, offset = np.zeros((18, 18)), np.zeros(18)
        compliance[np.ix_(self.there, self.there)], offset[self.there] = machine.compliance, machine.offset
        in_plan = turned(turned(self.turn.T @ compliance @ self.turn, angle).T, angle)
        moved = turned(offset @ self.turn, angle)
        weights = turned(self.weights, angle)
        moved[ABOUT] = 0.0
        workspace = self.workspaces[number]._replace(further=(rows @ in_plan @ rows.T)[None])
        train, shares = placed.train, (1.0,) if self.before[number] is not None else RAMP
        for share in shares:
            off = share * (self.one.frame.carried @ moved + train.compliance @ weights)
            load = self.load + share * (train.free @ weights)[None]
            plan = replace(self.plan, displacement=self.plan.displacement + off)
            found = solve_placed(placed, load, errors_of(plan, placed, cycle), cycle, workspace, self.before[number])
            if found.converged.all():
                self.before[number] = found
        wrench = turned(found.force[0, 0] @ rows, -angle)
        return found.force[0, 0], (self.turn @ wrench)[self.there], bool(found.converged[0, 0])


def carrier_turn(
    gearbox: LoadedGearbox, equilibrium: Equilibrium, number: int, train: GearTrain, torque: float,
    positions: int = 1,
) -> CarrierTurn:  # fmt: skip
    """Solve a set over a turn of its carrier.

    Parameters
    ----------
    gearbox, equilibrium
        Under its load, with the mean forces of all other meshes.
    number : int
        Of the set.
    train : GearTrain
        On its own supports, all members held.
    torque : float
        On the sun, N mm.
    positions : int
        To each pitch of the first mesh.
    """
    one_set = gearbox.sets[number]
    turning = _turning(gearbox, equilibrium, number, train, torque, positions)
    machine, rate = turning.machine, train.rates[one_set.housing]
    pitch = train.meshes[0].pair.meshed.pair.pitch
    phi = pitch / positions * np.arange(round(2.0 * np.pi / abs(rate * pitch)) * positions)
    place = np.concatenate([seat.rows @ equilibrium.displacement for seat in gearbox.system.seats] or [np.zeros(0)])
    seats = [n for n, one in enumerate(gearbox.bearings) if one.law is not None]
    forces, hanging, members, hubs, loads, settled = [], [], [], [], [], []
    for step, angle in enumerate(rate * phi):
        number, cycle = step % len(turning.placed), step // len(turning.placed) * turning.plan.cycle
        found = _settled(turning, number, cycle, angle, place)
        place = found.place if found.converged else place
        settled.append(found.converged)
        one = turning.placed[number]
        wrench = np.zeros((len(train.bodies), HUB))
        for mesh in one.placed:
            for gear, body in enumerate(mesh.mesh.bodies):
                wrench[body] += found.force[mesh.part] @ mesh.rows[0, :, gear]
        forces.append(wrench)
        hanging.append(turned(turning.weights, angle).reshape(-1, HUB))
        members.append(one_set.frame.in_machine(turned(found.force @ turning.rows[number], -angle)))
        moved = np.zeros(18)
        moved[turning.there] = (machine.at_rest + machine.flexibility @ found.forces)[machine.seats :]
        hubs.append(moved.reshape(3, HUB))
        load = machine.carried @ found.forces + machine.carried_at_rest
        for seat, state in zip(seats, found.states, strict=True):
            load[seat, list(BEARING_ROWS)] += state.force
        loads.append(load)
    return CarrierTurn(
        np.degrees(np.abs(rate) * phi), *map(np.array, (forces, hanging, members, hubs, loads, settled))
    )


class _Settled(NamedTuple):
    """A position: displacements of inner rings, states of bearings, forces in sections, and those on all places."""

    place: FloatArray
    states: list[BearingState]
    force: FloatArray
    forces: FloatArray
    converged: bool


def _settled(turning: _Turning, number: int, cycle: int, angle: float, place: FloatArray) -> _Settled:
    machine = turning.machine
    states, added, left, units = machine.states(place), LEAST, math.inf, np.tile(UNITS, len(machine.bearings))
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
                return _Settled(place, states, force, machine.forces_at(place, states, wrench), True)
        else:
            added *= 10.0
    return _Settled(place, states, force * np.nan, machine.forces_at(place, states, wrench) * np.nan, False)


def _turning(
    gearbox: LoadedGearbox, equilibrium: Equilibrium, number: int, train: GearTrain, torque: float,
    positions: int,
) -> _Turning:  # fmt: skip
    one = gearbox.sets[number]
    plan = one.file.plan
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
    pitch = train.meshes[0].pair.meshed.pair.pitch
    phi = np.array([pitch * n / positions for n in range(plan.cycle * positions)])
    placed = [train.place(phi[n : n + 1], plan.displacement) for n in range(len(phi))]
    carried = one.frame.carried
    rows = [np.concatenate([at.on_bodies(mesh, carried.T) for mesh in at.placed], axis=1)[0] for at in placed]
    return _Turning(
        one, plan, seated(gearbox, equilibrium, hubs, still), there,
        np.asarray(np.kron(np.eye(len(MEMBERS)), one.frame.turn), dtype=np.float64), placed, rows,
        [at.workspace() for at in placed], (torque * plan.load)[None], one.hanging_in_plan, [None] * len(placed),
    )  # fmt: skip
