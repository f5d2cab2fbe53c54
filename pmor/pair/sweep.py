"""Sweeps over pinion angles and conditions, with any elastic model: full and reduced go the same way."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from functools import partial
from typing import Any

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.core.threads import in_order
from pmor.gear.condition import Condition
from pmor.gear.meshed_pair import MeshedPair
from pmor.line.full_model import sweep_full
from pmor.line.layered_pair import LayeredPair
from pmor.penalty.pair import as_penalty
from pmor.penalty.solve import ElasticityAt, SolvedPosition, solve_position
from pmor.results.sweep import SteSweep


def sweep_ste(
    meshed: MeshedPair, elasticity_at: Callable[..., Any], phi: FloatArray,
    conditions: Sequence[Condition], progress: Callable[[], None] = lambda: None, executor: Executor | None = None,
) -> SteSweep:  # fmt: skip
    """Solve all angles under all conditions.

    Parameters
    ----------
    meshed : MeshedPair
    elasticity_at : callable
        Gives the elastic model of a position's windows; under line contact the compliance of teeth.
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
    if isinstance(meshed, LayeredPair):
        return sweep_full(meshed, elasticity_at, phi, conditions, progress, executor)
    solved = solve_positions(meshed, elasticity_at, phi, conditions, progress, executor)
    return collect_sweep(meshed, solved, phi, conditions, sum(position.seconds for position in solved))


def solve_positions(
    meshed: MeshedPair, elasticity_at: ElasticityAt, phi: FloatArray, conditions: Sequence[Condition],
    progress: Callable[[], None] = lambda: None, executor: Executor | None = None,
) -> list[SolvedPosition]:  # fmt: skip
    """Solve all angles, each by itself under all conditions; arguments as in `sweep_ste`."""
    solve = partial(solve_position, as_penalty(meshed), conditions=conditions, elasticity_at=elasticity_at)
    return list(in_order(solve, map(float, phi), executor, progress))


def collect_sweep(
    meshed: MeshedPair, solved: Sequence[SolvedPosition], phi: FloatArray, conditions: Sequence[Condition],
    seconds: float,
) -> SteSweep:  # fmt: skip
    """Collect solved positions into a sweep; arguments as in `sweep_ste`, `seconds` is its wall time."""
    torque, steps, pairs = _torques(solved, len(conditions))
    converged = np.asarray(np.isfinite(torque).all(axis=2))
    share = np.zeros(torque.shape)
    share[converged] = torque[converged] / torque[converged].sum(axis=1, keepdims=True)
    advances = [[np.nan if e is None else e.advance for e in position.equilibria] for position in solved]
    used = np.flatnonzero(share.any(axis=(0, 1)))
    return SteSweep(
        phi_rad=np.asarray(phi, dtype=float), torque_Nm=np.array([condition.torque_Nm for condition in conditions]),
        ste_um=np.array(advances).T * meshed.pair.pinion.base_radius * 1e3, pair_share=share[..., used],
        pair_index=pairs[used], newton_steps=steps, converged=converged, seconds=seconds, pitch_rad=meshed.pair.pitch,
    )  # fmt: skip


def _torques(solved: Sequence[SolvedPosition], count: int) -> tuple[FloatArray, IntArray, IntArray]:
    """Torque of each tooth pair, (count, angles, pairs), N mm, NaN where not converged; steps; and the pairs."""
    pairs = np.unique(np.concatenate([s.position.pair_index for s in solved]))
    torque, steps = np.zeros((count, len(solved), len(pairs))), np.zeros((count, len(solved)), dtype=np.int64)
    for i, position in enumerate(solved):
        columns = np.searchsorted(pairs, position.position.pair_index)
        for t, equilibrium in enumerate(position.equilibria):
            if equilibrium is None:
                torque[t, i] = np.nan
                continue
            torque[t, i, columns], steps[t, i] = equilibrium.pair_torque(len(columns)), equilibrium.steps
    return torque, steps, pairs
