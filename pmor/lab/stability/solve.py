"""Solve the positions of a variant by full FE and take what there is to measure."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.errors import ConvergenceError
from pmor.gear.condition import Condition
from pmor.gear.meshed_pair import MeshedPair
from pmor.lab.stability.balances import (
    energy_imbalance,
    line_torque_imbalance,
    missing_work,
    newton_condition,
    stored_in_lines,
    torque_imbalance,
)
from pmor.line.full_model import ToothCompliance, solve_angle
from pmor.line.layered_pair import LayeredPair
from pmor.penalty.equilibrium import Equilibrium, round_off_residual, solve_equilibrium
from pmor.penalty.pair import as_penalty
from pmor.penalty.solve import SolvedPosition, solve_position

# The torque that the balance of energy adds, relative.
LITTLE_MORE = 1e-2
# Round-off of a state over the change that the balance looks at, above which the balance says nothing.
LEAST_DIGITS = 1e-3
# Half-width of contact over the radius of curvature: three times that up to which the law of lines is straight.
LEAST_HALF_WIDTH = 1.4e-4
# The load from which another way to the same state starts, over the nominal one.
OTHER_LOAD = 0.5


@dataclass(frozen=True)
class Solved:
    """Measures over the positions of a variant.

    Parameters
    ----------
    ste_um : ndarray, shape (n,)
        NaN where a position did not converge.
    steps : int
        Largest number of Newton steps.
    condition, energy, torque : float
        Largest estimate of the condition, largest imbalances (`pmor.lab.stability.balances`); NaN without any position,
        and for the energy under a load too small to tell.
    failures : tuple of str
    twin_steps : int
        Of a reduced model, those of its slow twin; else 0.
    """

    ste_um: FloatArray
    steps: int
    condition: float
    energy: float
    torque: float
    failures: tuple[str, ...]
    twin_steps: int = 0


def solve_variant(
    meshed: MeshedPair, elasticity_at: Callable[..., Any], phi: FloatArray, condition: Condition,
    start_mm: float | None = None, rising: tuple[float, ...] = (),
) -> Solved:  # fmt: skip
    """Solve all positions under one torque.

    Parameters
    ----------
    meshed : MeshedPair
    elasticity_at : callable
    phi : ndarray, shape (n,)
        rad.
    condition : Condition
    start_mm : float, optional
        Solve each position from an undeformed pair that is so far ahead, mm along the line of action.
    rising : tuple of float
        Loads over the torque that are solved before it.
    """
    torque = condition.given_torque
    if isinstance(meshed, LayeredPair):
        return _solve_lines(meshed, elasticity_at, phi, condition, start_mm)
    balanced = _has_known_energy(round_off_residual(as_penalty(meshed), torque))
    torques = [*(load * torque for load in rising), torque, (1.0 + LITTLE_MORE) * torque]
    ste, measures, steps = np.full(len(phi), np.nan), [], [0]
    failures: list[str] = []
    for i, angle in enumerate(phi):
        solved = solve_position(as_penalty(meshed), float(angle), _under(condition, torques), elasticity_at)
        failures += solved.failures
        first, second = solved.equilibria[-2:]
        if first is None or second is None:
            continue
        elasticity = elasticity_at(solved.position)
        if start_mm is not None:
            try:
                first = _from_afar(meshed, solved, elasticity_at, condition, start_mm)
            except ConvergenceError as error:
                failures.append(str(error))
                continue
        ste[i] = first.advance * meshed.pair.pinion.base_radius * 1e3
        steps += [first.steps, *(state.steps for state in solved.equilibria if state is not None)]
        measures.append((
            newton_condition(elasticity, first),
            energy_imbalance(meshed, solved.position, elasticity, (first, second), (torques[-2], torques[-1]))
            if balanced else np.nan,
            torque_imbalance(meshed, solved.position, elasticity, first, torque),
        ))  # fmt: skip
    worst, energy, balance = np.max(measures, axis=0) if measures else (np.nan,) * 3
    return Solved(ste, max(steps), float(worst), float(energy), float(balance), tuple(failures))


def _solve_lines(
    meshed: LayeredPair, compliance: ToothCompliance, phi: FloatArray, condition: Condition, start_mm: float | None
) -> Solved:
    """As `solve_variant`, of line contact, whose states start cold."""
    torque, radius = condition.given_torque, meshed.pair.pinion.base_radius
    torques = torque, (1.0 + LITTLE_MORE) * torque
    balanced = _has_known_energy(meshed.round_off(torque)) and _beyond_straight_law(meshed, torque)
    start = None if start_mm is None else start_mm / radius
    ste, measures, steps, failures = np.full(len(phi), np.nan), [], [0], list[str]()
    for i, angle in enumerate(phi):
        solved = solve_angle(meshed, compliance, float(angle), _under(condition, list(torques)), start)
        failures += solved.failures
        first, second = solved.states
        if first is None or second is None:
            continue
        ste[i] = 1e3 * radius * first.advance
        steps += [first.steps, second.steps]
        stored = stored_in_lines(meshed, first), stored_in_lines(meshed, second)
        energy = missing_work(stored, second.advance - first.advance, torques) if balanced else np.nan
        measures.append((first.condition_number, energy, line_torque_imbalance(meshed, first, torque)))
    worst, energy, balance = np.max(measures, axis=0) if measures else (np.nan,) * 3
    return Solved(ste, max(steps), float(worst), float(energy), float(balance), tuple(failures))


def _has_known_energy(round_off: float) -> bool:
    """Whether energies differ by more than their round-off."""
    return round_off < LEAST_DIGITS * LITTLE_MORE


def _beyond_straight_law(meshed: LayeredPair, torque: float) -> bool:
    """Whether lines carry more than their law is straight for."""
    pair = meshed.pair
    line_load = torque / (pair.pinion.base_radius * pair.common_width)
    squared = 2.0 * sum(layer.compliance for layer in meshed.layers) * line_load * pair.pitch_point_radius
    return math.sqrt(squared) > LEAST_HALF_WIDTH * pair.pitch_point_radius


def _under(condition: Condition, torques: list[float]) -> list[Condition]:
    return [replace(condition, torque=torque) for torque in torques]


def ste_from_other_load(
    meshed: MeshedPair, elasticity_at: Callable[..., Any], phi: FloatArray, condition: Condition
) -> FloatArray:
    """Return the STE, um, when each position is first solved under half the torque; NaN where that fails."""
    torque = condition.given_torque
    return _last(meshed, elasticity_at, phi, _under(condition, [OTHER_LOAD * torque, torque]))


def ste_only(meshed: MeshedPair, elasticity_at: Callable[..., Any], phi: FloatArray, condition: Condition) -> FloatArray:
    """Return the STE, um; NaN where a position did not converge."""
    return _last(meshed, elasticity_at, phi, [condition])


def _last(
    meshed: MeshedPair, elasticity_at: Callable[..., Any], phi: FloatArray, conditions: Sequence[Condition]
) -> FloatArray:
    if isinstance(meshed, LayeredPair):
        found = [solve_angle(meshed, elasticity_at, float(angle), conditions).states[-1] for angle in phi]
        return 1e3 * meshed.pair.pinion.base_radius * np.array([np.nan if s is None else s.advance for s in found])
    states = [solve_position(as_penalty(meshed), float(angle), conditions, elasticity_at).equilibria[-1] for angle in phi]
    advances = [np.nan if state is None else state.advance for state in states]
    return np.array(advances) * meshed.pair.pinion.base_radius * 1e3


def _from_afar(
    meshed: MeshedPair, solved: SolvedPosition, elasticity_at: Callable[..., Any], condition: Condition, start_mm: float
) -> Equilibrium:
    elasticity = elasticity_at(solved.position)
    start = elasticity.zero(), start_mm / meshed.pair.pinion.base_radius
    return solve_equilibrium(as_penalty(meshed), solved.position, elasticity, condition, start)
