"""Positions of a set without a solution: how many under each torque, why, and what to do."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.line.hubs import HUB
from pmor.line.kernels.loads import MOST_SINGLE_STEPS
from pmor.line.lost import NOT_FOUND, OVERLOADED, left_out
from pmor.sets.plan import SetPlan
from pmor.sets.solution import SetSolution
from pmor.sets.supports import ROTATION


def lost_positions(solved: SetSolution, names: Sequence[str]) -> list[str]:
    """Return a sentence for each torque under which positions have no solution; names are those of the torques."""
    found = []
    for number, name in enumerate(names):
        lost = ~solved.converged[number]
        if lost.any():
            loose, steps = solved.found.loose[number, lost], solved.found.steps[number, lost]
            found.append(left_out(name, lost, _reasons(solved.plan, loose, steps)))
    return found


def known(figure: Callable[[FloatArray], Any], values: FloatArray) -> float:
    """Return a figure of the positions that have a solution; NaN where none has."""
    there = values[np.isfinite(values)]
    return float(figure(there)) if there.size else math.nan


def _reasons(plan: SetPlan, loose: IntArray, steps: IntArray) -> list[str]:
    found = []
    for movement in np.unique(loose[loose >= 0]).tolist():
        what = _moved(plan, movement)
        found.append(f'{what}: check [planets], or hold it in [supports] by a number instead of "free"')
    circling = (loose < 0) & (steps >= MOST_SINGLE_STEPS)
    if circling.any():
        found.append(NOT_FOUND)
    if ((loose < 0) & ~circling).any():
        found.append(OVERLOADED)
    return found


def _moved(plan: SetPlan, movement: int) -> str:
    """Return which members a movement has out of balance, and how."""
    bodies = plan.free[movement].reshape(-1, HUB)
    names = ", ".join(body.name for body, moved in zip(plan.bodies, bodies, strict=True) if moved.any())
    return f"{names}: nothing holds it {'about' if bodies[:, ROTATION].any() else 'across'} its axis"
