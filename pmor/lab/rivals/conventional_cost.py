"""What a Newton step of the conventional way costs where the pair is too large to be factored: an extrapolation.

*Measured* (paper's pair without contact): extrapolated entries of the factors 1.6 % below the true ones with 8 elements
over the profile, 0.1 % above them with 16.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from pmor.case import Case, GearCase
from pmor.fe.completion import nodes_of_elements
from pmor.fe.sparse_direct import factorise
from pmor.lab.rivals.conventional import assemble_gear
from pmor.mesh.sector import SectorMesh
from pmor.pair.model import MeshModel, per_gear

# Value and index of an entry of the factors, and the room that they need while they grow.
BYTES_PER_ENTRY = 16.0
# Entries of an arc over those of an arc of half its sectors, at most.
GROWTH = 2.3


@dataclass(frozen=True)
class GearCost:
    """Cost of a gear's share of one Newton step, extrapolated from arcs of it.

    Parameters
    ----------
    teeth : int
    unknowns : int
        Of the whole gear.
    sectors : tuple of int
        Sectors of the arcs that were measured.
    seconds : tuple of float
        Wall time to factor each arc and to solve once, s.
    entries : tuple of int
        Entries of each arc's factors.
    """

    teeth: int
    unknowns: int
    sectors: tuple[int, ...]
    seconds: tuple[float, ...]
    entries: tuple[int, ...]

    def whole(self, arcs: tuple[float, ...]) -> float:
        """Return what the closed ring takes: for each tooth what each further sector adds to an arc."""
        return self.teeth * (arcs[-1] - arcs[0]) / (self.sectors[-1] - self.sectors[0])


@dataclass(frozen=True)
class StepEstimate:
    """Cost of one Newton step of a whole pair, extrapolated: a pair too large to be factored has no measured one."""

    pinion: GearCost
    wheel: GearCost

    @property
    def seconds(self) -> float:
        """Wall time to factor the pair and to solve once, s."""
        return sum(gear.whole(gear.seconds) for gear in (self.pinion, self.wheel))

    @property
    def factor_entries(self) -> float:
        """Entries of the factors."""
        return sum(gear.whole(gear.entries) for gear in (self.pinion, self.wheel))

    @property
    def unknowns(self) -> int:
        """Unknowns of the pair."""
        return self.pinion.unknowns + self.wheel.unknowns + 1

    @property
    def sectors(self) -> tuple[int, ...]:
        """Sectors of the pinion's arcs that were measured."""
        return self.pinion.sectors


def newton_step_seconds(case: Case, mesh: MeshModel, memory_bytes: float = 5e9, most_sectors: int = 8) -> StepEstimate:
    """Estimate the cost of one Newton step of the whole pair from arcs of two, four and eight sectors.

    Nested dissection eliminates sector by sector, so each further sector of an arc costs the same, and the closed ring
    costs that for every tooth. Left out: contact, which adds 1 % to the fill, and whatever memory the machine lacks.

    Parameters
    ----------
    case : Case
    mesh : MeshModel
    memory_bytes : float
        Arcs are measured as long as their factors are expected to need less, those of two and four in any case.
    most_sectors : int
        Of the longest arc.
    """
    return StepEstimate(
        *per_gear(case, mesh, lambda sector, gear: _gear_cost(case, sector, gear, memory_bytes, most_sectors))
    )


def _gear_cost(case: Case, mesh: SectorMesh, gear: GearCase, memory_bytes: float, most_sectors: int) -> GearCost:
    sectors: list[int] = []
    seconds: list[float] = []
    entries: list[int] = []
    count = 2
    while count <= 4 or (count <= most_sectors and GROWTH * BYTES_PER_ENTRY * entries[-1] <= memory_bytes):
        stiffness, _ = assemble_gear(case, mesh, gear, count)
        start = time.perf_counter()
        factor = factorise(stiffness)
        factor.solve(np.ones(stiffness.shape[0]))
        seconds.append(time.perf_counter() - start)
        sectors.append(count)
        entries.append(int(factor.nnz))
        count *= 2
    rest = np.setdiff1d(np.arange(len(mesh.nodes)), np.concatenate([mesh.left, mesh.bore]))
    nodes = len(nodes_of_elements(mesh, rest))
    return GearCost(mesh.teeth, 3 * nodes * mesh.teeth, tuple(sectors), tuple(seconds), tuple(entries))
