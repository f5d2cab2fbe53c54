"""Displacements beyond which some section is overloaded: line contact has no law there, and a table of it neither."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pmor.core.arrays import BoolArray, FloatArray
from pmor.dynamics.kernels.laws import ForceTable
from pmor.gear.condition import Assembly
from pmor_online.mesh_force import overload_of
from pmor_online.model import ReducedPair

# Phases of a mesh cycle at which the limit is known; displacements that are tried at a time, twice.
PHASES, TRIED = 64, 33


@dataclass(frozen=True)
class LoadLimit:
    """Range of motion in which no section is overloaded.

    Parameters
    ----------
    displacement : ndarray, shape (cycles PHASES,)
        Largest one along the line of action at equal phases, mm; infinite where all of the table is within.
    backlash : float
        As of `ForceTable`: backs of teeth mirror the flanks.
    """

    displacement: FloatArray
    backlash: float

    @property
    def lowest(self) -> float:
        """The least of them at any phase, mm; infinite where nothing is overloaded."""
        return float(self.displacement.min())

    def shifted(self, shift: float) -> LoadLimit:
        """Return the limit for displacements that are larger by `shift` at the same force."""
        return replace(self, displacement=self.displacement + shift, backlash=self.backlash - 2.0 * shift)

    def exceeded(self, phase: FloatArray, x: FloatArray) -> BoolArray:
        """Return whether a section is overloaded at phases (rad) and displacements (mm), (n,) each."""
        back = x <= -0.5 * self.backlash
        phase, x = np.where(back, -phase, phase), np.where(back, -x - self.backlash, x)
        place = np.rint(phase * PHASES / (2.0 * np.pi)).astype(int) % len(self.displacement)
        return np.asarray(x > self.displacement[place])


def load_limit(reduced: ReducedPair, assembly: Assembly, table: ForceTable, alike: Sequence[int] = (0,)) -> LoadLimit:
    """Find where sections are overloaded within the range of a table.

    Parameters
    ----------
    reduced : ReducedPair
        Of line loads.
    alike : sequence of int
        Of each mesh cycle, as in `pmor.dynamics.force_table.tabulate`.
    """
    kinds, overloaded = np.asarray(alike), overload_of(reduced, assembly)
    first = np.unique(kinds, return_index=True)[1]
    limits = np.full((len(first), PHASES), np.inf)
    for kind, cycle in enumerate(first):
        for place in range(PHASES):
            phase, low, high = 2.0 * np.pi * (cycle + place / PHASES), table.low, table.high
            if not overloaded(phase, np.array([high]))[0]:
                continue
            for _ in range(2):
                x = np.linspace(low, high, TRIED)
                beyond = max(int(np.argmax(overloaded(phase, x))), 1)
                low, high = x[beyond - 1], x[beyond]
            limits[kind, place] = low
    return LoadLimit(limits[kinds].ravel(), table.backlash)
