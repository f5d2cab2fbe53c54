"""Sweeps over pinion angles and conditions, with any elastic model: full and reduced go the same way."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.core.threads import in_order, one_thread
from pmor.gear.condition import Condition
from pmor.gear.meshed_pair import MeshedPair
from pmor.line.full_model import solve_angle
from pmor.line.layered_pair import LayeredPair
from pmor.penalty.pair import as_penalty
from pmor.penalty.solve import solve_position
from pmor.results.sweep import SteSweep


class _State(NamedTuple):
    """A solved state; each tooth pair of `pair` carries the `torque` (N mm) beside it, and may be listed again."""

    advance: float
    steps: int
    pair: IntArray
    torque: FloatArray


@one_thread()
def sweep_ste(
    meshed: MeshedPair, elasticity_at: Any, phi: FloatArray,
    conditions: Sequence[Condition], progress: Callable[[], None] = lambda: None, executor: Executor | None = None,
) -> SteSweep:  # fmt: skip
    """Solve all angles under all conditions.

    Parameters
    ----------
    elasticity_at : callable or ToothCompliance
        Gives the elastic model of a position's windows; under line contact the compliance of the flanks.
    phi : ndarray, shape (n,)
        Pinion angles, rad.
    conditions : sequence of Condition
        Torques with the same axes and flanks.
    progress : callable
        Called after each angle, for progress.
    executor : concurrent.futures.Executor, optional
        Solves several angles at a time.

    Returns
    -------
    SteSweep
        Its seconds are those of the positions, added up: also of those that were solved at the same time.
    """
    solve = partial(_solve, meshed, elasticity_at, conditions)
    solved = list(in_order(solve, map(float, phi), executor, progress))
    loaded = [state.pair[state.torque != 0.0] for states, _ in solved for state in states if state is not None]
    pairs = np.unique(np.concatenate(loaded)) if loaded else np.empty(0, dtype=np.int64)
    grid = len(conditions), len(solved)
    advance, share, steps = np.full(grid, np.nan), np.zeros((*grid, len(pairs))), np.zeros(grid, dtype=np.int64)
    for i, (states, _) in enumerate(solved):
        for d, state in enumerate(states):
            if state is not None:
                advance[d, i], steps[d, i], carries = state.advance, state.steps, state.torque != 0.0
                column = np.searchsorted(pairs, state.pair[carries])
                np.add.at(share[d, i], column, state.torque[carries] / state.torque.sum())
    return SteSweep(
        phi_rad=np.asarray(phi, dtype=float), torque_Nm=np.array([condition.torque_Nm for condition in conditions]),
        ste_um=1e3 * meshed.pair.pinion.base_radius * advance, pair_share=share, pair_index=pairs, newton_steps=steps,
        converged=np.isfinite(advance), seconds=sum(seconds for _, seconds in solved), pitch_rad=meshed.pair.pitch,
    )  # fmt: skip


def _solve(
    meshed: MeshedPair, elasticity_at: Any, conditions: Sequence[Condition], phi: float
) -> tuple[list[_State | None], float]:
    """States at one angle, None where not converged, and the wall time."""
    if isinstance(meshed, LayeredPair):
        angle = solve_angle(meshed, elasticity_at, phi, conditions)
        return [s if s is None else _State(s.advance, s.steps, s.pair, s.torque) for s in angle.states], angle.seconds
    solved = solve_position(as_penalty(meshed), phi, conditions, elasticity_at)
    pairs = solved.position.pair_index
    states = [
        e if e is None else _State(e.advance, e.steps, pairs, e.pair_torque(len(pairs))) for e in solved.equilibria
    ]
    return states, solved.seconds
