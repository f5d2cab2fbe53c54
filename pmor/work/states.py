"""States unseen by any training, and the STE of full FE there."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from pmor.case import OfflineCase
from pmor.core.arrays import FloatArray
from pmor.core.threads import in_order
from pmor.gear.condition import Condition
from pmor.gear.meshed_pair import MeshedPair
from pmor.gear.pair import GearPair
from pmor.pair.sweep import sweep_ste
from pmor_offline.sampling import SEED, sobol_positions

# The training draws from SEED, the greedy candidates from the one after it.
UNSEEN_SEED = SEED + 2
# True errors below this, um, are not compared with an estimate: no measurement of a gear resolves them.
SMALLEST_ERROR_UM = 0.002


@dataclass(frozen=True)
class States:
    """Scattered states.

    Parameters
    ----------
    phi : ndarray, shape (n,)
        Pinion angles, rad.
    conditions : tuple of n Condition
    """

    phi: FloatArray
    conditions: tuple[Condition, ...]

    def where(self, i: int) -> dict[str, float]:
        """Return where a state is, in the units of a case."""
        condition = self.conditions[i]
        return {
            "phi_deg": float(np.degrees(self.phi[i])),
            "torque_Nm": condition.torque_Nm,
            **asdict(condition.misalignment),
        }


def unseen_states(offline: OfflineCase, pair: GearPair, count: int) -> States:
    """Return states spread over the ranges of a training, none of them in it."""
    positions = sobol_positions(offline, pair, count, UNSEEN_SEED)
    return States(np.array([p.phi for p in positions]), tuple(p.conditions[0] for p in positions))


def solve_states(
    meshed: MeshedPair, elasticity_at: Any, states: States, executor: Executor | None = None,
    progress: Callable[[], None] = lambda: None,
) -> FloatArray:  # fmt: skip
    """Solve all states with full FE.

    Parameters
    ----------
    elasticity_at : callable
    executor : Executor, optional
        Solves several states at a time.
    progress : callable
        Called after each state, for progress.

    Returns
    -------
    ndarray, shape (n,)
        STE in um; NaN where not converged.
    """

    def solve(i: int) -> float:
        return float(sweep_ste(meshed, elasticity_at, states.phi[i : i + 1], [states.conditions[i]]).ste_um[0, 0])

    return np.array(list(in_order(solve, range(len(states.phi)), executor, progress)))


def not_converged(states: States, ste_um: FloatArray, what: str) -> Sequence[str]:
    """Name the states without a solution."""
    return [f"{what} at {state_text(states.where(i))}" for i in np.flatnonzero(~np.isfinite(ste_um)).tolist()]


def state_text(where: Mapping[str, Any]) -> str:
    """Write where a state is, for messages and notes."""
    return (
        f"{where['phi_deg']:.2f} deg, {where['torque_Nm']:.3g} N m, {where['in_plane_um']:+.1f} um in plane, "
        f"{where['out_of_plane_um']:+.1f} um out of plane"
    )
