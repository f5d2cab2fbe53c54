"""Measured or designed flanks as amounts on a grid of roll angles and places over the width."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from pmor.core.errors import CaseError
from pmor.core.shown import brief

# Points beyond which a grid is a slip: no machine measures so many, and they are kept with every result.
MOST_POINTS = 250_000
LARGEST_UM = 1000.0
MOST_TEETH = 2000
# Range of a bicubic over that of its points: a quarter of a step on either side, along both directions.
SWING = 1.5**2


@brief
@dataclass(frozen=True, repr=False)
class Topography:
    """Amounts on a grid, of all teeth or of each; equal where all numbers are.

    Parameters
    ----------
    roll_deg : tuple of float
        Roll angles of its rows, ascending, deg.
    z_mm : tuple of float
        Places of its columns from the gear's own mid width, ascending, mm.
    amount_um : tuple of tuple of float
        One row for each roll angle, um along the transverse line of action, positive removes material.
    teeth_um : tuple of tuple of tuple of float
        Where teeth differ, such rows of each tooth, in the order of `Modification.pitch_deviations_um`; `amount_um` has
        the first one's.

    Raises
    ------
    CaseError
        One line: which number breaks which rule, and the remedy.
    """

    roll_deg: tuple[float, ...]
    z_mm: tuple[float, ...]
    amount_um: tuple[tuple[float, ...], ...]
    teeth_um: tuple[tuple[tuple[float, ...], ...], ...] = ()

    def __post_init__(self) -> None:
        """Refuse a grid that is none."""
        _check_axis(self.roll_deg, "roll angle", "deg", "the first column")
        _check_axis(self.z_mm, "z", "mm", "the first row")
        if len(self.grids_um) * len(self.roll_deg) * len(self.z_mm) > MOST_POINTS:
            teeth = f"{len(self.teeth_um)} x " if self.teeth_um else ""
            raise CaseError(
                f"{teeth}{len(self.roll_deg)} x {len(self.z_mm)} points, more than {MOST_POINTS}: thin the grid out"
            )
        if self.teeth_um and self.amount_um != self.teeth_um[0]:
            raise CaseError("amount_um is not that of the first tooth in teeth_um: correct it")
        for grid in self.grids_um:
            self._check_amounts(grid)

    def _check_amounts(self, grid: tuple[tuple[float, ...], ...]) -> None:
        if len(grid) != len(self.roll_deg):
            raise CaseError(f"{len(grid)} rows of amounts for {len(self.roll_deg)} roll angles: give one for each")
        for roll, row in zip(self.roll_deg, grid, strict=True):
            if len(row) != len(self.z_mm):
                raise CaseError(
                    f"{len(row)} amounts at the roll angle {roll:g} deg for {len(self.z_mm)} places z: give one each"
                )
            for z, amount in zip(self.z_mm, row, strict=True):
                if not abs(amount) <= LARGEST_UM:  # nan too
                    raise CaseError(
                        f"amount {amount:g} um at roll angle {roll:g} deg, z = {z:g} mm: must be between "
                        f"{-LARGEST_UM:g} and {LARGEST_UM:g} (um): correct it"
                    )

    def __repr__(self) -> str:
        return (
            f"<Topography: {len(self.roll_deg)} x {len(self.z_mm)} points, {self.roll_deg[0]:g} to "
            f"{self.roll_deg[-1]:g} deg, {self.z_mm[0]:g} to {self.z_mm[-1]:g} mm>"
        )

    @property
    def grids_um(self) -> tuple[tuple[tuple[float, ...], ...], ...]:
        """Amounts of all teeth: one grid, or one for each."""
        return self.teeth_um or (self.amount_um,)

    @property
    def mirrored(self) -> bool:
        """Whether both halves of the face are alike, to the last digits that a file may round."""
        places = all(math.isclose(z, -other, abs_tol=1e-9) for z, other in zip(self.z_mm, self.z_mm[::-1], strict=True))
        return places and all(row == row[::-1] for grid in self.grids_um for row in grid)

    @property
    def even(self) -> bool:
        """Whether all sections over the width are alike."""
        return all(amount == row[0] for grid in self.grids_um for row in grid for amount in row)

    @property
    def largest_um(self) -> float:
        """Most that it can deviate between any two places of any teeth, um: a bicubic swings beyond its points."""
        amounts = [amount for grid in self.grids_um for row in grid for amount in row]
        return SWING * (max(*amounts, 0.0) - min(*amounts, 0.0))


def read_topography(text: str) -> Topography:
    """Read a topography from CSV text: places z (mm) in the first row, roll angles (deg) in the first column.

    The corner's cell may hold anything. Where it says ``tooth``, the first column has the number of the tooth, from 1
    on, the second one roll angles, the same of each tooth. Commas, semicolons or tabs part the cells.

    Raises
    ------
    CaseError
        One line: cell, allowed values, remedy.
    """
    lines = [line for line in text.splitlines() if line.strip(" \t,;")]
    if not lines:
        raise CaseError("is empty: give places z in the first row, roll angles in the first column, amounts in um")
    rows = list(csv.reader(lines, delimiter=_delimiter(lines[0])))
    first = int(rows[0][0].strip().lower() == "tooth")
    if len(rows) < 3 or len(rows[0]) < first + 3:
        raise CaseError(
            f"{max(len(rows) - 1, 0)} x {max(len(rows[0]) - 1 - first, 0)} points: at least 2 x 2 are needed: give "
            "places z in the first row, roll angles in the first column"
        )
    teeth = [_tooth(row, i + 1) for i, row in enumerate(rows[1:], 1)] if first else [1] * (len(rows) - 1)
    numbers = [
        [_number(cell, i, k + first, k == 0) for k, cell in enumerate(row[first:]) if i or k]
        for i, row in enumerate(rows)
    ]
    z, grids = tuple(numbers[0]), []
    for tooth in range(1, max(teeth) + 1):
        own = [row for one, row in zip(teeth, numbers[1:], strict=True) if one == tooth]
        if not own:
            raise CaseError(f"tooth {tooth} has no rows, and {max(teeth)} has: give each tooth its rows")
        grids.append(Topography(tuple(row[0] for row in own), z, tuple(tuple(row[1:]) for row in own)))
    return of_teeth(grids) if first else grids[0]


def of_teeth(grids: Sequence[Topography]) -> Topography:
    """Return topographies of single teeth as that of their gear.

    Raises
    ------
    CaseError
        Where their points differ.
    """
    first = grids[0]
    for tooth, grid in enumerate(grids, 1):
        if (grid.roll_deg, grid.z_mm) != (first.roll_deg, first.z_mm):
            raise CaseError(f"tooth {tooth} has other roll angles or places z than tooth 1: give all the same points")
    return replace(first, teeth_um=tuple(grid.amount_um for grid in grids))


def _tooth(row: list[str], number: int) -> int:
    text = row[0].strip()
    if not (text.isascii() and text.isdigit() and 0 < int(text) <= MOST_TEETH):
        raise CaseError(f'row {number}, column 1: "{text}" is no number of a tooth: write 1, 2, ... up to {MOST_TEETH}')
    return int(text)


def _delimiter(line: str) -> str:
    return next((mark for mark in (";", "\t") if mark in line), ",")


def _number(cell: str, row: int, column: int, first: bool) -> float:
    try:
        return float(cell)
    except ValueError:
        what = "a place z in mm" if row == 0 else "a roll angle in deg" if first else "an amount in um"
        shown = f'"{cell.strip()}"' if cell.strip() else "an empty cell"
        raise CaseError(
            f"row {row + 1}, column {column + 1}: {shown} is not a number: write {what}, with a decimal point"
        ) from None


def _check_axis(values: tuple[float, ...], name: str, unit: str, place: str) -> None:
    if len(values) < 2:
        raise CaseError(f"{len(values)} value of {name} in {place}: at least 2 x 2 points are needed")
    for value in values:
        if not math.isfinite(value):
            raise CaseError(f"{name} = {value} in {place}: must be a finite number ({unit}): correct it")
    for before, after in zip(values[:-1], values[1:], strict=True):
        if after <= before:
            raise CaseError(
                f"{name} = {after:g} {unit} follows {before:g} in {place}: must ascend: sort them, and leave none twice"
            )
