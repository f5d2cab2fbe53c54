"""Reductions with the samplings of their training, and the grids of uniform sampling."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import prod
from typing import Any

import numpy as np

from pmor.case import Case, OfflineCase, change_case, without_models
from pmor.core.errors import CaseError

# Parameters of a training beside the angle, in the order in which a grid takes their middles in: tilts change the load
# distribution, out of plane more than in plane, while torque mostly scales it.
PARAMETERS = ("out_of_plane_um", "in_plane_um", "torques_Nm", "centre_distance_um")
# Coarser grids cannot tell the entry of a pair from its exit.
FEWEST_ANGLES = 4
# Greedy solves of the deliberately coarse basis, on which the error estimate is tried where errors are large.
FEW_SOLVES = 16


@dataclass(frozen=True)
class Grid:
    """A full-factorial training: angles with every combination of a few values of each parameter."""

    angles: int
    values: dict[str, list[float]]  # Values of each parameter that has a range, by its key in [offline]

    @property
    def conditions(self) -> int:
        """States at each angle."""
        return prod(map(len, self.values.values()))

    @property
    def solves(self) -> int:
        """Full solves in all."""
        return self.angles * self.conditions

    @property
    def label(self) -> str:
        """Angles and numbers of values, in the order of `PARAMETERS`."""
        return " x ".join(str(n) for n in (self.angles, *map(len, self.values.values())))


@dataclass(frozen=True)
class Variant:
    """A reduction with the sampling of its training."""

    shapes: str  # [reduction] shapes, with the interpolation where there is one
    sampling: str  # {"greedy", "sobol", "grid", "none"}
    positions: int | None  # How many of the training's positions are used, the first ones; None for all
    grid: Grid | None  # None where the training is none
    case: Case  # The case as that reduction needs it

    @property
    def label(self) -> str:
        """Reduction and training, for pictures."""
        return f"{self.shapes}, {self.training}" if self.case.reduction.trained else self.shapes

    @property
    def training(self) -> str:
        """Sampling with its size."""
        if self.grid is not None:
            return f"grid {self.grid.label}"
        return self.sampling if self.positions is None else f"{self.sampling} {self.positions}"


def variants(case: Case, greedy_solves: int) -> list[Variant]:
    """Return the reductions of the table; a Sobol sampling is shown with as many solves as the greedy one."""
    dense, broad = table_grids(case.offline)

    def spread(shapes: str, sampling: str, positions: int | None = None) -> Variant:
        return Variant(shapes, sampling, positions, None, changed(case, {"sampling": sampling}, shapes))

    def on_grid(shapes: str, grid: Grid, interpolation: str = "linear") -> Variant:
        name = f"{shapes}, {interpolation}" if shapes in ("positions", "pod") else shapes
        return Variant(name, "grid", None, grid, changed(case, grid_keys(grid), shapes, interpolation))

    listed = [
        spread("flank_lines", "greedy", greedy_solves),
        spread("flank_lines", "greedy", min(FEW_SOLVES, greedy_solves)),
        spread("flank_lines", "sobol", greedy_solves),
        spread("flank_lines", "sobol", case.offline.solves),
        on_grid("flank_lines", dense),
        on_grid("flank_lines", broad),
        *(on_grid(shapes, grid, interpolation) for shapes in ("positions", "pod")
          for grid, interpolation in ((dense, "linear"), (broad, "linear"), (dense, "cubic"))),
        spread("global_pod", "sobol", case.offline.solves),
        on_grid("global_pod", dense),
        on_grid("global_pod", broad),
        replace(spread("static_modes", "sobol"), sampling="none"),
    ]  # fmt: skip
    return list({variant.label: variant for variant in listed}.values())  # budgets may coincide


def changed(case: Case, offline: dict[str, Any], shapes: str = "flank_lines", interpolation: str = "linear") -> Case:
    """Return a case with other shapes and other keys of its training; the error estimate is always wanted."""
    reduction = {"shapes": shapes, "interpolation": interpolation, "error_estimate": True}
    return change_case(without_models(case), offline=offline, reduction=reduction)


def grid_keys(grid: Grid) -> dict[str, Any]:
    """Return the keys of [offline] that ask for a grid."""
    return {"sampling": "grid", "angles_per_pitch": grid.angles, **grid.values}


def grid_families(offline: OfflineCase) -> list[dict[str, list[float]]]:
    """Return values of the parameters: the ends of all ranges, then with the middle of one range after the other."""
    ranges = {name: getattr(offline, name) for name in PARAMETERS if len(getattr(offline, name)) > 1}
    families = []
    for refined in range(len(ranges) + 1):
        counts = [3 if i < refined else 2 for i in range(len(ranges))]
        families.append({
            name: np.linspace(values[0], values[-1], count).tolist()
            for (name, values), count in zip(ranges.items(), counts, strict=True)
        })  # fmt: skip
    return families


def table_grids(offline: OfflineCase) -> tuple[Grid, Grid]:
    """Return the two grids of the table, with at most `offline.solves` states each.

    The first is dense in the angle, for shapes that are interpolated over it: both ends of every range and, where that
    leaves enough angles, the middle of the one that matters most. The second has as many parameter values as possible.

    Raises
    ------
    CaseError
        When the ends alone, at the fewest angles, are more states than that.
    """
    grids = [Grid(offline.solves // Grid(1, values).solves, values) for values in grid_families(offline)]
    possible = [grid for grid in grids if grid.angles >= FEWEST_ANGLES]
    if not possible:
        least = FEWEST_ANGLES * grids[0].conditions
        raise CaseError(f"[offline] solves = {offline.solves}: the smallest grid over the ranges has {least}: raise it")
    return possible[min(1, len(possible) - 1)], possible[-1]


def counts_up_to(last: int, first: int = 8) -> Sequence[int]:
    """Return numbers of solves to look at, four to an octave, with the last one."""
    if last <= first:
        return [last]
    steps = np.arange(0.0, np.log2(last / first), 0.25)
    return sorted({*np.round(first * 2.0**steps).astype(int).tolist(), last})
