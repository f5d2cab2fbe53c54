"""Parts of a REXS gearbox that stand on geometry or matrices: bearings by their inner geometry, the housing."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NoReturn

import numpy as np

from pmor.body.beam import NODE
from pmor.body.rolling_bearing import LAMINAE, BallBearing, RollerBearing, impossible
from pmor.case.reader import checked
from pmor.case.seats import checked_stiffness, refuse_half
from pmor.core.arrays import FloatArray
from pmor.core.errors import CaseError
from pmor.rexs.bearings import KINDS
from pmor.rexs.joints import axis_of
from pmor.rexs.model import Component, Gearbox

# Those that have a contact angle.
ANGLED = ("angular_contact_ball_bearing", "radial_tapered_roller_bearing")
MATRIX = "reduced_static_stiffness_matrix"
CLEARANCES = ("operating_radial_bearing_clearance", "mounted_radial_bearing_clearance", "radial_bearing_clearance")


def inner_geometry(
    gearbox: Gearbox, bearing: Component, note: Callable[[str], None]
) -> BallBearing | RollerBearing | None:
    """Return the inner geometry of a bearing; None where the file has none, or not all of it, with a note.

    Raises
    ------
    CaseError
        When a number is out of range.
    """
    rows = gearbox.beside(bearing.number, "rolling_bearing_row")
    elements = [one for row in rows for one in gearbox.beside(row.number, "rolling_element")]
    if len(rows) != 1 or not elements:
        if elements:
            note(f"{bearing.label}: {len(rows)} rows of rolling elements, and one is solved: by its stiffness")
        return None
    (row,), element, kind = rows, elements[0], bearing.text_of("bearing_type")
    if kind not in KINDS:
        said = f"bearing_type {kind}" if kind else "without bearing_type"
        note(f"{bearing.label}: {said}: its inner geometry is not solved: by its stiffness")
        return None
    ball = KINDS[kind]
    length = row.number_of("significant_contact_length_inner_ring") or element.number_of("length_of_rolling_element")
    needed = {
        "number_of_rolling_elements": row.whole_number_of("number_of_rolling_elements"),
        "reference_diameter_rolling_bearing": row.number_of("reference_diameter_rolling_bearing", "reference_diameter"),
        "diameter_of_rolling_element": element.number_of("diameter_of_rolling_element"),
        **({} if ball else {"length_of_rolling_element": length}),
        **({"pressure_angle": row.number_of("pressure_angle")} if kind in ANGLED else {}),
    }
    if missing := [name for name, value in needed.items() if not value]:
        note(f"{bearing.label}: {', '.join(missing)} missing: by its stiffness")
        return None
    count, pitch, diameter = (value or 0.0 for value in list(needed.values())[:3])
    clearance = bearing.number_of(*CLEARANCES)
    if clearance is None:
        note(f"{bearing.label}: no radial clearance is said: 0")
    said = row.text_of("axial_force_absorption_of_row") or bearing.text_of("axial_force_absorption")
    angle = (row.number_of("pressure_angle") or 0.0) * (-1.0 if said == "negative" else 1.0)
    first = element.number_of("angular_position_around_u") or 0.0
    where = f"{bearing.file}: {bearing.label}"
    if not ball:
        laminae, profile = row.whole_number_of("custom_pmor_laminae"), row.text_of("custom_pmor_logarithmic_profile")
        roller = RollerBearing(
            rollers=int(count), roller_diameter_mm=diameter, effective_length_mm=length or 0.0,
            pitch_diameter_mm=pitch, clearance_mm=clearance or 0.0, contact_angle_deg=angle, first_roller_deg=first,
            laminae=laminae or LAMINAE, logarithmic_profile=profile != "false",
        )  # fmt: skip
        return _possible(checked(roller, RollerBearing, where, "roller"), bearing, note)
    grooves = [row.number_of(f"raceway_radius_of_{ring}_ring") for ring in ("inner", "outer")]
    usual = 0.52, 0.53
    if None in grooves:
        note(f"{bearing.label}: no raceway radii are said: {usual[0]:g} and {usual[1]:g} of the balls' diameter")
    osculation = [groove / diameter if groove else value for groove, value in zip(grooves, usual, strict=True)]
    steel = {}
    for material in gearbox.beside(element.number, "material"):
        modulus, ratio = material.number_of("elastic_modulus"), material.number_of("poisson_ratio")
        if modulus and ratio is not None:
            steel = {"youngs_modulus_GPa": 1e-3 * modulus, "poisson_ratio": ratio}
    found = BallBearing(
        balls=int(count), ball_diameter_mm=diameter, pitch_diameter_mm=pitch, clearance_mm=clearance or 0.0,
        contact_angle_deg=angle, first_ball_deg=first, inner_osculation=osculation[0], outer_osculation=osculation[1],
        **steel,
    )  # fmt: skip
    return _possible(checked(found, BallBearing, where, "ball"), bearing, note)


def _possible(
    found: BallBearing | RollerBearing, bearing: Component, note: Callable[[str], None]
) -> BallBearing | RollerBearing | None:
    """None of a bearing that cannot be made, with a note."""
    if (fault := impossible(found)) is None:
        return found
    note(f"{bearing.label}: {fault[0]} cannot be: {fault[1]}; by its stiffness")
    return None


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
        raise CaseError(f"{group.file}: {group.label}: {MATRIX}: {rule}")

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
    return checked_stiffness(seats, len(bearings), "bearing to the housing", refuse)


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
