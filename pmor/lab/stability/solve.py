"""Solve the positions of a variant by full FE, or by the general solver on a reduced model, and measure them.

A solved position is checked by the balance of its torque and the condition of its equations.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.linalg as la

from pmor.core.arrays import FloatArray
from pmor.core.errors import ConvergenceError
from pmor.gear.condition import Condition
from pmor.gear.meshed_pair import MeshedPair
from pmor.line.full_model import LineState, ToothCompliance, solve_angle
from pmor.line.layered_pair import LayeredPair
from pmor.pair.sweep import sweep_ste
from pmor.penalty.elasticity import Elasticity, FullElasticity
from pmor.penalty.equilibrium import Equilibrium, solve_equilibrium
from pmor.penalty.pair import as_penalty
from pmor.penalty.position import Position
from pmor.penalty.solve import solve_position


def torque_imbalance(position: Position, elasticity: Elasticity, equilibrium: Equilibrium, torque: float) -> float:
    """Return the residual of the moment of the nodal forces about the pinion's axis, over the torque (N mm).

    The solver balances the forces at contact points; here the forces have gone to the nodes, at their deformed places.
    """
    forces = equilibrium.contact.nodal_forces(equilibrium.contact.force, len(position.nodes))
    places = position.nodes + elasticity.displacement(equilibrium.coordinates)
    own = np.concatenate([np.arange(*position.window_slice(p, 0).indices(len(places)))
                          for p in range(len(position.pair_index))])  # fmt: skip
    moment = places[own, 0] @ forces[own, 1] - places[own, 1] @ forces[own, 0]
    return float(abs(moment + torque) / torque)


def line_torque_imbalance(meshed: LayeredPair, state: LineState, torque: float) -> float:
    """Return the same residual of line contact.

    Forces go to the nodes where flanks meet undeformed, and the levers of a pinion's corner turn with it.
    """
    places, forces = meshed.pinion.nodes, state.nodal_force[0]
    moment = float(np.sum(places[..., 0] * forces[..., 1] - places[..., 1] * forces[..., 0]))
    return abs(moment + float(state.force @ state.lever_change) + torque) / torque


def newton_condition(elasticity: Elasticity, equilibrium: Equilibrium) -> float:
    """Estimate the condition number (1-norm) of the matrix that a Newton step factors.

    Full FE factors the flexibility of the loaded points, ``W C W^T + K^-1``; the reduced model the stiffness of its
    amplitudes, ``I + Phi^T K Phi``.
    """
    contact = equilibrium.contact
    points = np.eye(len(contact.gap))
    columns = np.stack([elasticity.coordinates_of(contact, point) for point in points])
    if isinstance(elasticity, FullElasticity):
        used = columns.any(axis=0)
        matrix = columns[:, used] @ elasticity.compliance[np.ix_(used, used)] @ columns[:, used].T
        matrix[np.diag_indices(len(matrix))] += 1.0 / contact.stiffness
    else:
        matrix = columns.T * contact.stiffness @ columns
        matrix[np.diag_indices(len(matrix))] += 1.0
    return _condition(matrix)


def _condition(matrix: FloatArray) -> float:
    factor, info = la.lapack.dpotrf(matrix)
    if info != 0:
        return float("inf")
    reciprocal, _ = la.lapack.dpocon(factor, np.linalg.norm(matrix, 1))
    return float(1.0 / reciprocal) if reciprocal > 0.0 else float("inf")


# Load of the start of another way to the same state, over the nominal one.
OTHER_LOAD = 0.5


@dataclass(frozen=True)
class Solved:
    """Measures over the positions of a variant."""

    ste_um: FloatArray  # shape (n,): NaN where a position did not converge
    steps: int  # Largest number of Newton steps
    # Largest estimate of the condition, largest imbalance (`pmor.lab.stability.solve`); NaN without any position
    condition: float
    torque: float
    failures: tuple[str, ...]


@dataclass(frozen=True)
class _State:
    advance: float
    steps: int
    condition: float
    torque: float


def solve_variant(
    meshed: MeshedPair, elasticity_at: Any, phi: FloatArray, condition: Condition,
    start_mm: float | None = None, rising: tuple[float, ...] = (),
) -> Solved:  # fmt: skip
    """Solve all positions under one torque.

    Parameters
    ----------
    meshed, elasticity_at, phi, condition
        As in `pmor.pair.sweep.sweep_ste`.
    start_mm : float, optional
        Solve each position from an undeformed pair that is so far ahead, mm along the line of action.
    rising : tuple of float
        Loads over the torque that are solved before it; of penalty contact alone.
    """
    radius = meshed.pair.pinion.base_radius
    touch = meshed.kinematics(condition.misalignment).first_touch
    start = None if start_mm is None else touch + start_mm / radius
    loads = _under(condition, [*(load * condition.torque for load in rising), condition.torque])
    ste, states, failures = np.full(len(phi), np.nan), list[_State](), list[str]()
    for i, angle in enumerate(phi.tolist()):
        if isinstance(meshed, LayeredPair):
            state, failed = _solve_lines(meshed, elasticity_at, angle, condition, start)
        else:
            state, failed = _solve_points(meshed, elasticity_at, angle, loads, start)
        failures += failed
        if state is not None:
            ste[i] = 1e3 * radius * state.advance
            states.append(state)
    steps = max((state.steps for state in states), default=0)
    worst = np.max([(state.condition, state.torque) for state in states] or [(np.nan, np.nan)], axis=0)
    return Solved(ste, steps, float(worst[0]), float(worst[1]), tuple(failures))


def _solve_lines(
    meshed: LayeredPair, compliance: ToothCompliance, angle: float, condition: Condition, start: float | None
) -> tuple[_State | None, Sequence[str]]:
    solved = solve_angle(meshed, compliance, angle, [condition], start)
    state = solved.states[0]
    if state is None:
        return None, solved.failures
    imbalance = line_torque_imbalance(meshed, state, condition.torque)
    return _State(state.advance, state.steps, state.condition_number, imbalance), solved.failures


def _solve_points(
    meshed: MeshedPair, elasticity_at: Any, angle: float, loads: Sequence[Condition], start: float | None
) -> tuple[_State | None, Sequence[str]]:
    solved = solve_position(as_penalty(meshed), angle, loads, elasticity_at)
    state = solved.equilibria[-1]
    if state is None:
        return None, solved.failures
    elasticity = elasticity_at(solved.position)
    steps = max(equilibrium.steps for equilibrium in solved.equilibria if equilibrium is not None)
    if start is not None:
        try:
            far = elasticity.zero(), start
            state = solve_equilibrium(as_penalty(meshed), solved.position, elasticity, loads[-1], far)
        except ConvergenceError as error:
            return None, (*solved.failures, str(error))
    imbalance = torque_imbalance(solved.position, elasticity, state, loads[-1].torque)
    return _State(
        state.advance, max(steps, state.steps), newton_condition(elasticity, state), imbalance
    ), solved.failures


def _under(condition: Condition, torques: Sequence[float]) -> list[Condition]:
    return [replace(condition, torque=torque) for torque in torques]


def ste_only(
    meshed: MeshedPair, elasticity_at: Any, phi: FloatArray, condition: Condition, before: float = 0.0
) -> FloatArray:
    """Return the STE, um, solved first under that share of the torque, if any; NaN where it did not converge."""
    torques = [*([before * condition.torque] if before else []), condition.torque]
    return np.asarray(sweep_ste(meshed, elasticity_at, phi, _under(condition, torques)).ste_um[-1])
