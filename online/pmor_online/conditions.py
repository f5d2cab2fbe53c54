"""Sweeps over conditions: those that share their axes (line loads), or axes and flanks (shapes), in one call."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np

from pmor.case.coast import flank_of
from pmor.core.arrays import FloatArray
from pmor.gear.condition import Assembly, Misalignment
from pmor.line.unloaded import with_unloaded
from pmor.pair.conditions import conditions_of_assembly, listed_conditions, torques_of
from pmor.results.sweep import SteSweep
from pmor_online.mesh_error import with_mesh_error
from pmor_online.model import ReducedPair, sweep_angles
from pmor_online.other_flank import other_flank_pair
from pmor_online.sweep import sweep_reduced_pair

# Positions that are solved in one call at most: their forces stay within some hundred megabytes.
POSITIONS_AT_A_TIME = 200_000


@dataclass(frozen=True)
class ConditionSweep:
    """The sweep of one of the conditions that a case lists.

    Parameters
    ----------
    own : int
        Index of the condition's own torque in the sweep.
    flank : {"drive", "coast"}
        Flanks that carry; `sweep` counts as in a case of these.
    """

    name: str
    assembly: Assembly
    own: int
    sweep: SteSweep
    flank: str = "drive"


def sweep_listed(
    reduced: ReducedPair, executor: Executor | None = None, progress: Callable[[int], None] = lambda n: None
) -> tuple[ConditionSweep, ...]:
    """Sweep each condition that a case lists, at the torques of the case's sweep and at its own.

    Parameters
    ----------
    executor : concurrent.futures.Executor, optional
        Shares out blocks of angles between threads.
    progress : callable
        Called with the number of angles done, counted for each condition.
    """
    case = reduced.basis.case
    solved = [condition.assembly for condition in listed_conditions(case)]
    found: dict[int, ConditionSweep] = {}
    for flank in ("drive", "coast"):
        numbers = [n for n, condition in enumerate(case.conditions) if flank_of(condition) == flank]
        if not numbers:
            continue
        there = reduced if flank == case.flank else other_flank_pair(reduced)
        torques = [torques_of(case, case.conditions[n]) for n in numbers]
        sweeps = sweep_assemblies(there, sweep_angles(case), [solved[n] for n in numbers], torques, executor, progress)
        for n, own, sweep in zip(numbers, torques, sweeps, strict=True):
            condition = case.conditions[n]
            sweep = with_mesh_error(sweep, there, conditions_of_assembly(solved[n], own))
            built = Assembly(condition.misalignment, condition.pinion, condition.wheel)
            found[n] = ConditionSweep(condition.name, built, own.index(abs(condition.torque_Nm)), sweep, flank)
    return tuple(found[n] for n in range(len(solved)))


def sweep_assemblies(
    reduced: ReducedPair, phi: FloatArray, assemblies: Sequence[Assembly], torques_Nm: Sequence[Sequence[float]],
    executor: Executor | None = None, progress: Callable[[int], None] = lambda n: None,
) -> list[SteSweep]:  # fmt: skip
    """Sweep a pair that is built in several ways, each at torques of its own.

    Parameters
    ----------
    phi : ndarray, shape (n,)
        Pinion angles, rad.
    assemblies : sequence of Assembly
        Axes and flanks.
    torques_Nm : sequence of sequences of float
        As many.
    executor, progress
        As in `sweep_listed`.

    Returns
    -------
    list of SteSweep
        As many, with the transmission error without load.
    """
    found: dict[int, SteSweep] = {}
    most = max(1, POSITIONS_AT_A_TIME // (len(phi) * max(map(len, torques_Nm), default=1)))
    for numbers in _together(reduced, assemblies, most):
        conditions = [condition for n in numbers for condition in conditions_of_assembly(assemblies[n], torques_Nm[n])]
        sweep = sweep_reduced_pair(reduced, phi, conditions, executor, progress=_for_each(progress, len(numbers)))
        sweep = with_unloaded(sweep, reduced.meshed, conditions)
        ends = np.cumsum([len(torques_Nm[n]) for n in numbers]).tolist()
        for n, end in zip(numbers, ends, strict=True):
            found[n] = sweep.at_torques(slice(end - len(torques_Nm[n]), end))
    return [found[n] for n in range(len(assemblies))]


def _together(reduced: ReducedPair, assemblies: Sequence[Assembly], most: int) -> list[list[int]]:
    """Numbers of the assemblies solved in one call: shared sections or shapes are prepared once."""
    groups: dict[Misalignment | Assembly, list[int]] = {}
    for n, one in enumerate(assemblies):
        groups.setdefault(one.misalignment if reduced.basis.shapes is None else one, []).append(n)
    return [group[i : i + most] for group in groups.values() for i in range(0, len(group), most)]


def _for_each(progress: Callable[[int], None], count: int) -> Callable[[int], None]:
    return lambda done: progress(done * count)
