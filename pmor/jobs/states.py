"""States that no training has seen, and what full FE and a reduced model say about them."""

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
from pmor.line.full_model import solve_angle
from pmor.line.layered_pair import LayeredPair, as_layered
from pmor.penalty.pair import as_penalty
from pmor.penalty.solve import solve_position
from pmor.results.sweep import SteSweep
from pmor_offline.sampling import SEED, sobol_positions
from pmor_online.model import ReducedPair
from pmor_online.sweep import sweep_reduced_pair

# The training draws from SEED, the greedy candidates from the one after it.
UNSEEN_SEED = SEED + 2
# True errors below this, um, are not held against an estimate: no measurement of a gear resolves them.
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


@dataclass(frozen=True)
class Solved:
    """Solutions at scattered states.

    Parameters
    ----------
    ste_um : ndarray, shape (n,)
        NaN where not converged.
    loads : tuple of n dict, or None
        Line loads of each tooth pair by its index, shape (sections,), N/mm; None without line contact.
    """

    ste_um: FloatArray
    loads: tuple[Mapping[int, FloatArray], ...] | None


def unseen_states(offline: OfflineCase, pair: GearPair, count: int) -> States:
    """Return states spread over the ranges of a training, none of them in it."""
    positions = sobol_positions(offline, pair, count, UNSEEN_SEED)
    return States(np.array([p.phi for p in positions]), tuple(p.conditions[0] for p in positions))


def solve_states(
    meshed: MeshedPair, elasticity_at: Callable[..., Any], states: States, executor: Executor | None = None,
    progress: Callable[[], None] = lambda: None,
) -> Solved:  # fmt: skip
    """Solve all states with any elastic model.

    Parameters
    ----------
    meshed : MeshedPair
    elasticity_at : callable
    states : States
    executor : Executor, optional
        Solves several states at a time.
    progress : callable
        Called after each state, for progress.
    """

    def solve(state: tuple[float, Condition]) -> tuple[float, dict[int, FloatArray]]:
        return _solve(meshed, elasticity_at, *state)

    found = list(in_order(solve, zip(states.phi.tolist(), states.conditions, strict=True), executor, progress))
    loads = tuple(load for _, load in found) if isinstance(meshed, LayeredPair) else None
    return Solved(np.array([ste for ste, _ in found]), loads)


def _solve(
    meshed: MeshedPair, elasticity_at: Callable[..., Any], phi: float, condition: Condition
) -> tuple[float, dict[int, FloatArray]]:
    radius, loads = meshed.pair.pinion.base_radius, dict[int, FloatArray]()
    if not isinstance(meshed, LayeredPair):
        equilibrium = solve_position(as_penalty(meshed), phi, [condition], elasticity_at).equilibria[0]
        return float("nan") if equilibrium is None else 1e3 * equilibrium.advance * radius, loads
    (state,) = solve_angle(meshed, elasticity_at, phi, [condition]).states
    if state is None:
        return float("nan"), loads
    for pair in state.loaded_pairs.tolist():
        mine, loads[pair] = state.pair == pair, np.zeros(len(meshed.sections.z))
        loads[pair][state.section[mine]] = state.line_load[mine]
    return 1e3 * state.advance * radius, loads


def sweep_states(reduced: ReducedPair, states: States) -> tuple[Solved, FloatArray]:
    """Solve all states by the compiled sweep of a reduced model, each by itself.

    Parameters
    ----------
    reduced : ReducedPair
    states : States

    Returns
    -------
    Solved
    estimate_um : ndarray, shape (n,)
        What the model says that its STE lacks; NaN where not converged, or without an estimate.
    """
    meshed = reduced.meshed
    ste, estimate = np.full((2, len(states.phi)), np.nan)
    loads = []
    for i, condition in enumerate(states.conditions):
        sweep = sweep_reduced_pair(reduced, states.phi[i : i + 1], [condition], recorded=True)
        ste[i] = sweep.ste_um[0, 0]
        if sweep.ste_error_um is not None:
            estimate[i] = sweep.ste_error_um[0, 0]
        loads.append(_line_loads(meshed, sweep))
    return Solved(ste, tuple(loads) if isinstance(meshed, LayeredPair) else None), estimate


def _line_loads(meshed: MeshedPair, sweep: SteSweep) -> dict[int, FloatArray]:
    """Line loads of the only state of a sweep."""
    assert sweep.states is not None
    found, widths = sweep.states.loads, as_layered(meshed).width
    loads = {int(index): np.zeros(len(widths)) for index in np.unique(found.pair)}
    for index, column, force in zip(found.pair, found.column, found.force_N, strict=True):
        loads[int(index)][column] = force / widths[column]
    return loads


def load_errors_percent(reduced: Solved, full: Solved) -> FloatArray | None:
    """Return the largest error of any line load of each state over the peak of that state, shape (n,), per cent.

    NaN where either did not converge; None without line contact.
    """
    if reduced.loads is None or full.loads is None:
        return None
    return np.array([_load_error(r, f) for r, f in zip(reduced.loads, full.loads, strict=True)])


def _load_error(reduced: Mapping[int, FloatArray], full: Mapping[int, FloatArray]) -> float:
    if not reduced or not full:
        return float("nan")
    peak = max(float(load.max()) for load in full.values())
    differences = (np.abs(reduced.get(index, 0.0) - full.get(index, 0.0)) for index in {*reduced, *full})
    return 100.0 * max(float(np.max(d)) for d in differences) / peak


def not_converged(states: States, ste_um: FloatArray, what: str) -> Sequence[str]:
    """Name the states without a solution."""
    return [f"{what} at {state_text(states.where(i))}" for i in np.flatnonzero(~np.isfinite(ste_um)).tolist()]


def state_text(where: Mapping[str, Any]) -> str:
    """Write where a state is, for messages and notes."""
    return (
        f"{where['phi_deg']:.2f} deg, {where['torque_Nm']:.3g} N m, {where['in_plane_um']:+.1f} um in plane, "
        f"{where['out_of_plane_um']:+.1f} um out of plane"
    )
