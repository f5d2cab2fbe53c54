"""Solve the positions of a variant by full FE, or by the general solver on a reduced model, and measure them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.errors import ConvergenceError
from pmor.gear.condition import Condition
from pmor.gear.meshed_pair import MeshedPair
from pmor.lab.stability.balances import line_torque_imbalance, newton_condition, torque_imbalance
from pmor.line.full_model import ToothCompliance, solve_angle
from pmor.line.layered_pair import LayeredPair
from pmor.pair.sweep import sweep_ste
from pmor.penalty.equilibrium import solve_equilibrium
from pmor.penalty.pair import as_penalty
from pmor.penalty.solve import solve_position

# Load of the start of another way to the same state, over the nominal one.
OTHER_LOAD = 0.5


@dataclass(frozen=True)
class Solved:
    """Measures over the positions of a variant."""

    ste_um: FloatArray  # shape (n,): NaN where a position did not converge
    steps: int  # Largest number of Newton steps
    # Largest estimate of the condition, largest imbalance (`pmor.lab.stability.balances`); NaN without any position
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
