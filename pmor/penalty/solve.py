"""States of one pinion angle under several conditions, with windows that grow when contact reaches their border."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.errors import ConvergenceError
from pmor.gear.condition import Condition, common_build
from pmor.penalty.elasticity import Elasticity
from pmor.penalty.equilibrium import Equilibrium, expected_penetration, solve_equilibrium
from pmor.penalty.pair import PenaltyPair
from pmor.penalty.position import Position, active_patches

ElasticityAt = Callable[[Position], Elasticity]

# The approach of the flanks at which the windows are cut, over the expected one: the tooth pairs share the load
# unevenly and tip corners dig in. Too small costs a repetition, never accuracy.
WINDOW_MARGIN = 3.0
# Deviations that bring a tooth pair into contact before its time do so at its corner, whose gap grows a third as fast
# beyond the path of contact as that of flanks: a pair that cannot touch is missed, however windows grow.
CORNER_MARGIN = 4.0
# Largest ratio of the torques of two conditions at which the second starts from the solution of the first.
FAR = 100.0


@dataclass(frozen=True)
class SolvedPosition:
    """Equilibria at one pinion angle.

    Parameters
    ----------
    equilibria : tuple of Equilibrium or None
        One for each condition; None where Newton did not converge.
    failures : tuple of str
        Messages of the conditions that failed.
    seconds : float
        Wall time.
    """

    position: Position
    equilibria: tuple[Equilibrium | None, ...]
    failures: tuple[str, ...]
    seconds: float = 0.0


def solve_position(
    meshed: PenaltyPair, phi: float, conditions: Sequence[Condition], elasticity_at: ElasticityAt
) -> SolvedPosition:
    """Solve for the equilibria at one pinion angle.

    Parameters
    ----------
    phi : float
        Pinion angle, rad.
    conditions : sequence of Condition
        With the same axes and flanks: they share windows, and each solution starts from the one before.
    elasticity_at : callable
        Gives the elastic model of a position's windows.
    """
    start, assembly = time.perf_counter(), common_build(conditions)
    depth = max(window_depth(meshed, condition) for condition in conditions)
    while True:
        position = active_patches(meshed, phi, depth, assembly)
        solved = _solve_within(position, meshed, conditions, elasticity_at)
        # Contact that comes and goes at a window's border has no equilibrium there.
        failed = bool(solved.failures) and not position.whole
        if not failed and not any(e is not None and e.contact.touches_border for e in solved.equilibria):
            return replace(solved, seconds=time.perf_counter() - start)
        depth *= 3.0  # ends at the latest when the windows hold the whole flanks, which have no inner border


def _solve_within(
    position: Position, meshed: PenaltyPair, conditions: Sequence[Condition], elasticity_at: ElasticityAt
) -> SolvedPosition:
    elasticity, touch = elasticity_at(position), position.kernel_pair.kinematics.first_touch
    equilibria: list[Equilibrium | None] = []
    failures: list[str] = []
    previous: tuple[Equilibrium, Condition] | None = None
    for condition in conditions:
        ratio = condition.torque / previous[1].torque if previous else 0.0
        start = previous[0].scaled_start(ratio, touch) if previous and 1.0 / FAR <= ratio <= FAR else None
        try:
            solve = partial(solve_equilibrium, meshed, position, elasticity, condition)
            equilibrium = _solve_persistently(solve, start)
            previous = equilibrium, condition
            equilibria.append(equilibrium)
        except ConvergenceError as error:
            equilibria.append(None)
            failures.append(str(error))
    return SolvedPosition(position, tuple(equilibria), tuple(failures))


def _solve_persistently(solve: Callable[..., Equilibrium], start: tuple[FloatArray, float] | None) -> Equilibrium:
    """Solve from a neighbour's state; else from nothing, so that no neighbour can spoil it; else with a memory."""
    if start is not None:
        with suppress(ConvergenceError):
            return solve(start)
    try:
        return solve()
    except ConvergenceError:
        return solve(remember=True)


def window_depth(meshed: PenaltyPair, condition: Condition) -> float:
    """Return the approach of the flanks for which windows are first cut, mm."""
    return WINDOW_MARGIN * meshed.expected_approach(condition.torque) + standing_depth(meshed, condition)


def standing_depth(meshed: PenaltyPair, condition: Condition) -> float:
    """Return the depth that windows must hold beside the elastic approach, mm.

    Surface error, changes of the gap by misalignment and deviations of the flanks, and penetration of a soft penalty,
    unless it is less than the elastic approach: the margin of the windows covers it then.
    """
    torque = condition.torque
    excess = expected_penetration(meshed, torque) - meshed.expected_approach(torque)
    spread = condition.assembly.misalignment.spread + CORNER_MARGIN * condition.assembly.flank_spread
    return surface_error(meshed) + spread + WINDOW_MARGIN * max(excess, 0.0)


def surface_error(meshed: PenaltyPair) -> float:
    """Return the sagitta of the largest bilinear facets, by which an unrefined flank misses the helicoid, mm.

    Over the profile of flanks that are facets themselves, and over the width of whatever is projected on facets.
    """
    scheme, error = meshed.scheme, 0.0
    if scheme.smooth and scheme.direct:
        return 0.0
    for flank, tooth in ((meshed.pinion, meshed.pair.pinion), (meshed.wheel, meshed.pair.wheel)):
        spacing = float(np.diff(flank.nodes[0, :, 2]).max())
        error += tooth.helix_sagitta(spacing / scheme.lodm_width if scheme.smooth else spacing)
        if not scheme.smooth:
            roll = flank.roll_angle
            chord = 0.5 * tooth.base_radius * np.diff(roll**2)
            radius = 0.5 * tooth.base_radius * (roll[1:] + roll[:-1])
            error += float(np.max(chord**2 / (8.0 * radius)))
    return error
