"""Variants of a pair on many angles: every second angle is known where half as many were solved before.

Chosen variants are judged on twice and twice as many angles (`pmor.design.fine`). The angles of a level are among those
of the next, and a state depends on nothing that was solved before, to the last bit: what is known is not solved again.
"""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import fields, replace
from typing import Any

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.gear.condition import Assembly
from pmor.line.hubs import Hubs
from pmor_online.model import ReducedPair
from pmor_online.variants import VariantSolver, VariantState

# Angles whose flexibilities are in memory together, where they do not stay there.
BLOCK = 256
# Memory of sections that stay placed for further variants, for each thread, and of states that stay known.
MOST_PLACED_BYTES, MOST_KNOWN_BYTES = 1 << 26, 1 << 26
# Numbers of a section beside its flexibilities to the others, about: gradients, laws.
SECTION_NUMBERS = 64
# Fields of a state by the axis that counts angles.
ANGLE_AXIS = {"ste_um": 1, "converged": 1, "overloaded": 1, "load_N_per_mm": 1, "edge_load_N_per_mm": 1,
              "pressure_MPa": 1, "sensitivity": 1, "roll_rad": 0, "pair": 0}  # fmt: skip


class FineSolver(VariantSolver):
    """Solves variants on many angles, block by block; threads may share it.

    Parameters
    ----------
    reduced, phi, torques_Nm, hubs
        As of `VariantSolver`.
    coarser : FineSolver, optional
        Of every second of these angles, from the first one on.
    """

    def __init__(
        self, reduced: ReducedPair, phi: FloatArray, torques_Nm: Sequence[float], hubs: Sequence[Hubs] = (),
        coarser: FineSolver | None = None,
    ) -> None:  # fmt: skip
        super().__init__(reduced, phi, torques_Nm, hubs)
        self._coarser = coarser
        own = self.phi if coarser is None else self.phi[1::2]
        self._blocks = [own[i : i + BLOCK] for i in range(0, len(own), BLOCK)]
        size = reduced.layered.tooth_pair_count * len(reduced.layered.width)
        placed = 8 * len(own) * size * (size + SECTION_NUMBERS) * max(1, len(self.hubs))
        self._staying = [self._solver_of(phi) for phi in self._blocks] if placed <= MOST_PLACED_BYTES else None
        self._known: OrderedDict[Assembly, VariantState] = OrderedDict()
        self._known_bytes, self._lock_of_known = 0, threading.Lock()

    def solve(self, assembly: Assembly, differentiated: bool = False) -> VariantState:
        """Return the state of the pair as it is built in one way; see `VariantSolver.solve`."""
        if differentiated:
            return self._solve(assembly, True)
        with self._lock_of_known:
            found = self._known.get(assembly)
        if found is None:
            found = self._solve(assembly, False)
            self._keep_known(assembly, found)
        return found

    def _solve(self, assembly: Assembly, differentiated: bool) -> VariantState:
        solvers = self._staying or map(self._solver_of, self._blocks)
        found = _joined([solver.solve(assembly, differentiated) for solver in solvers], np.concatenate)
        return (
            found
            if self._coarser is None
            else _joined([self._coarser.solve(assembly, differentiated), found], _alternating)
        )

    def _solver_of(self, phi: FloatArray) -> VariantSolver:
        return VariantSolver(self.reduced, phi, self.torques_Nm, self.hubs)

    def _keep_known(self, assembly: Assembly, state: VariantState) -> None:
        with self._lock_of_known:
            if assembly not in self._known:
                self._known[assembly] = state
                self._known_bytes += _size(state)
            while self._known_bytes > MOST_KNOWN_BYTES:
                self._known_bytes -= _size(self._known.popitem(last=False)[1])


def _joined(parts: Sequence[VariantState], join: Any) -> VariantState:
    """Return states at several angles as one."""
    there = {name: axis for name, axis in ANGLE_AXIS.items() if getattr(parts[0], name) is not None}
    arrays: dict[str, Any] = {
        name: join([getattr(part, name) for part in parts], axis=axis) for name, axis in there.items()
    }
    return replace(parts[0], **arrays)


def _alternating(parts: Sequence[np.ndarray], axis: int) -> np.ndarray:
    """Return two arrays as one, by turns along an axis."""
    first, second = (np.moveaxis(part, axis, 0) for part in parts)
    found = np.empty((2 * len(first), *first.shape[1:]), dtype=first.dtype)
    found[0::2], found[1::2] = first, second
    return np.ascontiguousarray(np.moveaxis(found, 0, axis))


def _size(state: VariantState) -> int:
    return sum(value.nbytes for one in fields(state) if isinstance(value := getattr(state, one.name), np.ndarray))
