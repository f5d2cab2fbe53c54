"""Planetary sets on the shafts that carry their members.

A set is solved as `pmor run` solves it, seen from its carrier, with the compliance of shafts, bearings and housing
condensed to the hubs of sun, carrier and ring in place of its own supports. Planets move with the carrier's hub as with
a rigid body. The compliance is that of the loaded machine; where the carrier turns, its mean around the axis, as it
turns against the carrier otherwise. What all other loads do to the hubs stands still in the housing: seen from the
carrier it turns, and the set is solved over the mesh cycles until the housing stands as before. The mean wrench of the
set over a turn of the carrier goes back into the machine.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from pmor.core.arrays import ComplexArray, FloatArray
from pmor.core.errors import ConvergenceError
from pmor.line.hubs import HUB
from pmor.line.several import GearTrain, Workspaces
from pmor.machine.carrier_turn import CarrierTurn, SetPositions, carrier_turn, mean_turn, set_positions
from pmor.machine.groups import GroupKey
from pmor.machine.hub_compliance import compliance_below
from pmor.machine.loaded import LoadedGearbox, SetMeshing
from pmor.machine.set_frame import ABOUT, ACROSS, MEMBERS, turned
from pmor.machine.system import ARM, Equilibrium
from pmor.pair.samples import Samples
from pmor.sets.kinematics import torque_ratios
from pmor.sets.plan import InHousing, SetPlan, turned_housing
from pmor.sets.solution import SetSolution, solve_on, solve_set, with_mesh_error
from pmor.sets.tolerances import solve_samples

# Angles of a pitch over which the mean wrench of a set is found.
MEAN_ANGLES = 16
# The same where the carrier turns on rolling bearings.
MEAN_PHASES = 4
# Places of the housing around the carrier over which that is found: orders of its turn below them have no share in it.
MEAN_PLACES = 12
# Displacements of hubs by other loads that are round-off, mm.
STILL = 1e-12
# Compliances of orders up to two around the axis have the mean of these angles, rad.
QUARTERS = 0.5 * np.pi * np.arange(4)


class SolvedSet(NamedTuple):
    """A planetary set on its supports under one load case.

    Attributes
    ----------
    meshing : SetMeshing
        Its frame, and the mean wrench on the hubs of its members.
    torque : float
        Amount on the sun, N mm.
    solution : SetSolution
        On its supports.
    uneven : float
        By how much the compliance of sun and ring against the carrier differs around the axis, over its mean.
    rigid : SetSolution or None
        On rigid supports under all loads; None before it is compared.
    row : int
        Of this load there.
    turn : CarrierTurn or None
        Over a turn of its carrier, where anything stands against that: weights, loads across, bearings with a law.
    samples : Samples or None
        Sets within the tolerances of its file, on the same supports.
    """

    meshing: SetMeshing
    torque: float
    solution: SetSolution
    uneven: float
    rigid: SetSolution | None = None
    row: int = 0
    samples: Samples | None = None
    turn: CarrierTurn | None = None


class _Supported(NamedTuple):
    """A set on what its hubs stand on: its plan and train there, and mesh cycles until it stands as before."""

    plan: SetPlan
    train: GearTrain
    pitches: int
    uneven: float


def set_torque(gearbox: LoadedGearbox, equilibrium: Equilibrium, number: int) -> float:
    """Return the amount of the torque on the sun of a set, N mm."""
    return float(equilibrium.reactions[gearbox.reactions["sets"]][number])


def placed_sets(gearbox: LoadedGearbox, trains: Mapping[Any, GearTrain]) -> dict[int, SetPositions]:
    """Place the sets that are solved over a turn of their carrier, by number: on rolling bearings, or loads turn.

    The same serves all solutions of a load.
    """
    turning = [n for n, one in enumerate(gearbox.sets if trains and gearbox.over_turns else ()) if one.turns]
    return {n: set_positions(gearbox.sets[n], trains[gearbox.sets[n].settings.name], MEAN_PHASES) for n in turning}


def mean_wrenches(
    gearbox: LoadedGearbox, equilibrium: Equilibrium, number: int, train: GearTrain,
    positions: SetPositions | None = None, executor: Executor | None = None,
) -> FloatArray:  # fmt: skip
    """Return the mean wrenches of a set on its hubs by a unit torque on the sun, in axes of the machine, (3, 6).

    An executor of threads shares out angles.

    Raises
    ------
    ConvergenceError
    """
    one, torque = gearbox.sets[number], set_torque(gearbox, equilibrium, number)
    if positions is not None:
        turn = mean_turn(gearbox, equilibrium, number, torque, positions)
        if not turn.converged.all():
            count = f"{np.count_nonzero(~turn.converged)} of {len(turn.converged)} positions of its carrier"
            rule = "lower what bends its shafts, or the clearance of their bearings"
            raise ConvergenceError(f"{_where(one, torque)}: no equilibrium at {count}: {rule}", [])
        mean = one.frame.in_plan(turn.member_wrench.mean(axis=0)) / torque
    else:
        found = _supported(gearbox, equilibrium, one, torque, train)
        mean = _over_a_turn(one, found, torque, executor) / torque
    # Over whole mesh cycles torques are in the ratio of the tooth numbers, but for round-off and few angles.
    ratios = torque_ratios(one.file.teeth)
    mean[ABOUT] = [-ratios[member] / ratios["sun"] for member in MEMBERS]
    return one.frame.in_machine(mean)


def _over_a_turn(
    one: SetMeshing, found: _Supported, torque: float, executor: Executor | None
) -> FloatArray:
    """Mean wrench on the hubs of the members over a turn of the carrier, in axes of the plan, in the housing, (18,)."""
    plan, train, torques = found.plan, found.train, np.array([1e-3 * torque])
    # Gears that differ, an eccentric ring among them, may press on the housing in one direction.
    unlike = one.file.pitches > plan.cycle
    if unlike and one.turns:
        solved, places = [solve_set(plan, train, torques, MEAN_ANGLES, one.file.housed_pitches, executor)], [0.0]
    elif plan.in_housing is None:
        solved, places = [solve_set(plan, train, torques, MEAN_ANGLES, one.file.pitches, executor)], [0.0]
    else:
        # Mesh cycles differ by where the housing stands alone: a few places of it have the same mean.
        phi = train.meshes[0].pair.meshed.pair.pitch * np.arange(plan.cycle * MEAN_ANGLES) / MEAN_ANGLES
        placed = train.place(phi, plan.displacement)
        places = (2.0 * np.pi / MEAN_PLACES * np.arange(MEAN_PLACES)).tolist()
        workspaces = Workspaces(placed.blocks)
        solved = [
            solve_on(turned_housing(plan, angle), placed, torques, plan.cycle, executor, workspaces) for angle in places
        ]
    means, rate = [], train.rates[one.housing] if one.turns else 0.0
    for part, place in zip(solved, places, strict=True):
        if not part.converged.all():
            rule = "where other loads push a sun that floats, stiffen the bearing in place of its spline"
            raise ConvergenceError(f"{_where(one, torque)}: contact was not found: {rule}", [])
        wrench = part.hub_wrench[0].reshape(len(part.phi_rad), -1) @ one.frame.carried
        means.append(turned(wrench, -place - rate * part.phi_rad).mean(axis=0))
    mean = np.asarray(np.mean(means, axis=0))
    if one.turns and not unlike and plan.in_housing is None:  # what there is turns with the carrier
        mean[ACROSS] = 0.0
    return mean


def _where(one: SetMeshing, torque: float) -> str:
    return f"set {one.settings.name}: {1e-3 * torque:.6g} N m"


def solved_sets(
    gearbox: LoadedGearbox, equilibrium: Equilibrium, trains: Mapping[Any, GearTrain],
    positions: Mapping[int, SetPositions], executor: Executor | None = None,
) -> tuple[SolvedSet, ...]:  # fmt: skip
    """Solve all sets over their mesh cycles on what their hubs stand on; an executor of threads shares out angles.

    Sets on rolling bearings, or under loads that turn, stand at the mean of a turn there, and are solved over it.
    """
    found = []
    for number, one in enumerate(gearbox.sets if trains else ()):
        torque = set_torque(gearbox, equilibrium, number)
        on = _supported(gearbox, equilibrium, one, torque, trains[one.settings.name])
        if number in positions:
            on = on._replace(plan=replace(on.plan, in_housing=None), pitches=one.file.pitches)
        angles = one.file.angles_per_pitch
        solution = solve_set(on.plan, on.train, np.array([1e-3 * torque]), angles, on.pitches, executor)
        if (coarse := trains.get(GroupKey(one.settings.name, ()).on_half)) is not None:
            half = _supported(gearbox, equilibrium, one, torque, coarse)
            solution = with_mesh_error(solution, one.file.cases.values(), half.train)
        cycles = on.pitches if on.plan.in_housing is not None else 1
        samples = solve_samples(one.file, solution, executor, cycles)
        turn = None
        at = positions.get(number)
        if at is None and one.turns and on.plan.in_housing is not None:
            at = set_positions(one, trains[one.settings.name], 1)
        if at is not None:
            turn = carrier_turn(gearbox, equilibrium, number, torque, at)
        found.append(SolvedSet(one, torque, solution, on.uneven, samples=samples, turn=turn))
    return tuple(found)


def sets_on_rigid_supports(
    sets: Sequence[SolvedSet], train: GearTrain, executor: Executor | None = None
) -> tuple[SolvedSet, ...]:
    """Return a set under all its loads, compared with the same one on rigid supports."""
    file = sets[0].meshing.file
    torques = np.array([1e-3 * one.torque for one in sets])
    rigid = solve_set(file.plan, train, torques, file.angles_per_pitch, file.pitches, executor)
    return tuple(one._replace(rigid=rigid, row=row) for row, one in enumerate(sets))


def _supported(
    gearbox: LoadedGearbox, equilibrium: Equilibrium, one: SetMeshing, torque: float, train: GearTrain
) -> _Supported:
    """Return a set on the compliance below its hubs, which other loads displace."""
    hubs = [hub for hub in one.hubs if hub is not None]
    there = np.concatenate([HUB * n + np.arange(HUB) for n, hub in enumerate(one.hubs) if hub is not None])
    turn = np.kron(np.eye(len(MEMBERS)), one.frame.turn)[there]
    compliance = turn.T @ compliance_below(gearbox, equilibrium, hubs) @ turn
    uneven = _uneven(compliance)
    if one.turns:
        compliance = np.mean([turned(turned(compliance, angle).T, angle) for angle in QUARTERS], axis=0)
    moved = np.zeros((len(MEMBERS), HUB))
    for member, hub in enumerate(one.hubs):
        if hub is not None:
            moved[member] = equilibrium.displacement[hub : hub + HUB]
    offset = one.frame.in_plan(moved)
    offset[ABOUT] = 0.0
    offset -= compliance @ (torque * one.frame.in_plan(one.wrenches))
    carried, file = one.frame.carried, one.file
    train = replace(train, compliance=train.compliance + carried @ compliance @ carried.T)
    plan, pitches = file.plan, file.pitches
    if one.turns:
        amplitude: ComplexArray = np.zeros(len(offset), dtype=complex)
        across = offset[ACROSS].reshape(-1, 2) @ [1.0, 1j]
        amplitude[ACROSS] = np.stack([across, -1j * across], axis=1).ravel()
        arms = np.tile([STILL, STILL / ARM], len(MEMBERS))
        if (np.abs(across) > arms).any() or one.hanging.any():
            hanging = one.hanging_in_plan.reshape(-1, 2, 3).copy()
            hanging[..., 2] = 0.0
            weights = hanging.ravel() - 1j * turned(hanging.ravel(), 0.5 * np.pi)
            in_housing = InHousing(np.asarray(carried @ amplitude + file.plan.compliance @ weights), one.housing)
            plan, pitches = replace(plan, in_housing=in_housing), file.housed_pitches
        offset[ACROSS] = 0.0
    return _Supported(replace(plan, displacement=plan.displacement + carried @ offset), train, pitches, uneven)


def _uneven(compliance: FloatArray) -> float:
    """By how much the compliance of sun and ring against the carrier, across the axis, differs over its mean."""
    found = [0.0]
    for member in (0, 2):
        against = np.zeros((2, len(compliance)))
        against[:, HUB * member : HUB * member + 2], against[:, HUB : HUB + 2] = np.eye(2), -np.eye(2)
        low, high = np.linalg.eigvalsh(against @ compliance @ against.T)
        found.append((high - low) / (high + low) if high + low > 0.0 else 0.0)
    return max(found)
