"""Sweep over pinion angles and conditions, with any elastic model: full and reduced go the same way."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np

from pmor.arrays import FloatArray
from pmor.contact.condition import Condition
from pmor.contact.flank import MeshedPair
from pmor.contact.solve import ElasticityAt, SolvedPosition, solve_position
from pmor.results.sweep import SteSweep


def sweep_ste(
    meshed: MeshedPair,
    elasticity_at: ElasticityAt,
    phi: FloatArray,
    conditions: Sequence[Condition],
    advance: Callable[[], None] = lambda: None,
) -> SteSweep:
    """Solve all angles under all conditions.

    Parameters
    ----------
    meshed : MeshedPair
    elasticity_at : callable
        Gives the elastic model of a position's windows.
    phi : ndarray, shape (n,)
        Pinion angles, rad.
    conditions : sequence of Condition
        Torques with the same axes.
    advance : callable
        Called after each angle, for progress.

    Returns
    -------
    SteSweep
    """
    start = time.perf_counter()
    solved = []
    for angle in phi:
        solved.append(solve_position(meshed, float(angle), conditions, elasticity_at))
        advance()
    return collect_sweep(meshed, solved, phi, conditions, time.perf_counter() - start)


def collect_sweep(
    meshed: MeshedPair, solved: Sequence[SolvedPosition], phi: FloatArray, conditions: Sequence[Condition],
    seconds: float,
) -> SteSweep:  # fmt: skip
    """Collect solved positions into a sweep; arguments as in `sweep_ste`, `seconds` is its wall time."""
    pairs = np.unique(np.concatenate([s.position.pair_index for s in solved]))
    grid = (len(conditions), len(phi))
    ste, steps = np.full(grid, np.nan), np.zeros(grid, dtype=np.int64)
    converged, share = np.zeros(grid, dtype=bool), np.zeros((*grid, len(pairs)))
    for i, position in enumerate(solved):
        columns = np.searchsorted(pairs, position.position.pair_index)
        for t, equilibrium in enumerate(position.equilibria):
            if equilibrium is None:
                continue
            ste[t, i] = equilibrium.lead * meshed.pair.pinion.base_radius * 1e3
            steps[t, i], converged[t, i] = equilibrium.steps, True
            torque = equilibrium.pair_torque(len(columns))
            share[t, i, columns] = torque / torque.sum()
    used = np.flatnonzero(share.any(axis=(0, 1)))
    return SteSweep(
        phi_rad=np.asarray(phi, dtype=float),
        torque_Nm=np.array([condition.given_torque for condition in conditions]) * 1e-3,
        ste_um=ste,
        pair_share=share[..., used],
        pair_index=pairs[used],
        newton_steps=steps,
        converged=converged,
        seconds=seconds,
        pitch_rad=meshed.pair.pitch,
    )
