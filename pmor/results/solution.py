"""A solution of any machine, under D loads at A angles: its meshes, gears and supports by name.

Sweeps of pairs, solutions of sets, and results of gearboxes are such; a pair has one mesh, and hubs that are held.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

from pmor.core.arrays import FloatArray
from pmor.core.shown import brief
from pmor.gear.pair import GearPair
from pmor.results.loads import LineStates
from pmor.results.quantities import Figures, figures_of_mesh


@brief
@dataclass(frozen=True, eq=False)
class MeshView:
    """A mesh of a solution.

    Attributes
    ----------
    lines : LineStates
        Its line contact under D torques at A angles.
    """

    name: str
    pair: GearPair
    lines: LineStates

    @cached_property
    def figures(self) -> Figures:
        """What is read off it under each torque, (D,), by keys of `pmor.results.quantities`."""
        return figures_of_mesh(self.pair, self.lines)

    @property
    def force_N(self) -> FloatArray:
        """Force in the transverse plane, (D, A)."""
        return self.lines.force_N.sum(axis=(2, 3))


@brief
@dataclass(frozen=True, eq=False)
class PartView:
    """A gear or a support of a solution.

    Attributes
    ----------
    wrench : (D, A, 6)
        Force, N, and moment, N mm: of the meshes on a gear's hub; of a shaft or gear on what it stands on.
    displacement : (D, A, 6)
        Of the hub, or of what stands on a support against it, mm and rad.

    Shafts of a gearbox feel the mean over the angles, which are one for them.
    """

    name: str
    wrench: FloatArray
    displacement: FloatArray


class Solution(Protocol):
    """What solutions of pairs, sets and gearboxes have in common."""

    def mesh(self, name: str) -> MeshView: ...  # noqa: D102

    def gear(self, name: str) -> PartView: ...  # noqa: D102

    def support(self, name: str) -> PartView: ...  # noqa: D102


def place_of(what: str, name: str, names: Sequence[str]) -> int:
    """Return the place of a name.

    Raises
    ------
    KeyError
        With the names that there are.
    """
    if name not in names:
        raise KeyError(f"no {what} {name!r}: there are {', '.join(names)}")
    return list(names).index(name)
