"""The housing of a REXS gearbox by its stiffness matrix."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NoReturn

import numpy as np

from pmor.body.beam import NODE
from pmor.case.seats import checked_matrix, refuse_half
from pmor.core.arrays import FloatArray
from pmor.rexs.joints import axis_of
from pmor.rexs.model import Component, Gearbox

MATRIX = "reduced_static_stiffness_matrix"


def read_housing_matrix(
    gearbox: Gearbox, bearings: Sequence[Component], note: Callable[[str], None]
) -> FloatArray | None:
    """Return the stiffness of the seats of some bearings; None where the file has none for all of them.

    Points of the matrix without a bearing are free: they are condensed.

    Parameters
    ----------
    bearings : sequence of Component
        To the housing, in the order of the seats.

    Raises
    ------
    CaseError
        When the matrix is none of a housing that is held.
    """
    for casing in gearbox.of_kind("gear_casing"):
        for group in gearbox.beside(casing.number, "assembly_group", "reference"):
            if values := group.numbers_of(MATRIX):
                return _of_group(gearbox, group, np.array(values), bearings, note)
    return None


def _of_group(
    gearbox: Gearbox, group: Component, values: FloatArray, bearings: Sequence[Component], note: Callable[[str], None]
) -> FloatArray | None:
    def refuse(rule: str) -> NoReturn:
        raise group.refusal(f"{MATRIX}: {rule}")

    points = gearbox.ordered(group.number, "reduction_point")
    size = NODE * len(points)
    if len(values) != size**2:
        refuse(f"has {len(values)} numbers, and must have {size} x {size}: six rows for each reduction_point")
    note(f"{group.label}: units of {MATRIX} are not said: N, mm, rad; shifts along u, v, w, then turns about them")
    refuse_half(values.reshape(size, size), refuse)
    places = [_bearing_of(gearbox, point, bearings) for point in points]
    if lacking := [one.label for one in bearings if one.number not in places]:
        note(f"{group.label}: no reduction_point for {', '.join(lacking)}: left out, the housing is rigid")
        return None
    u, w = axis_of(group), group.direction_of("w_axis_vector") or [0.0, 0.0, 1.0]
    axes = np.kron(np.eye(2 * len(points)), np.array([u, np.cross(w, u), w]))
    matrix = axes.T @ values.reshape(size, size) @ axes
    rows = np.array([NODE * places.index(one.number) + i for one in bearings for i in range(NODE)])
    free = np.setdiff1d(np.arange(size), rows)
    seats = matrix[np.ix_(rows, rows)]
    if len(free):
        note(f"{group.label}: {len(free) // NODE} reduction points without a bearing to the housing: free")
        inner = matrix[np.ix_(free, free)]
        if np.linalg.matrix_rank(inner) < len(inner):
            refuse("its points without a bearing can move away: hold the housing at its feet")
        seats = seats - matrix[np.ix_(rows, free)] @ np.linalg.solve(inner, matrix[np.ix_(free, rows)])
    return checked_matrix(seats, len(bearings), "bearing to the housing", "stiffness", refuse)


def _bearing_of(gearbox: Gearbox, point: Component, bearings: Sequence[Component]) -> int | None:
    """The number of the bearing that stands on a point: the one it refers to, or the one at its place."""
    for one in bearings:
        if any(point.number in members and one.number in members for members in gearbox.members("reference")):
            return one.number
    place = point.numbers_of("support_vector")
    near = [one.number for one in bearings if len(place) == 3 and _same(place, one.numbers_of("support_vector"))]
    return near[0] if len(near) == 1 else None


def _same(one: Sequence[float], other: Sequence[float]) -> bool:
    return len(other) == 3 and math.dist(one, other) < 1e-3
