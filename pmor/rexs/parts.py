"""Parts of machines of any kind as components of a REXS file: shafts, and what they stand on."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from pmor.body.bearing_faults import InnerGeometry
from pmor.body.roller_bearing import STEEL_MODULUS, STEEL_RATIO, RollerBearing
from pmor.body.rolling_bearing import BallBearing
from pmor.rexs.document import Attributes, Document, Value

ALONG, ACROSS = [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]
# Axes u, v, w of the file by x, y, z of a set alone.
ALONE = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
# What stands for rigid, N/m and N mm/rad.
STIFF = 1e20


def at(place: Sequence[float]) -> dict[str, Value]:
    """Return a place, mm, and the axes of all parts: u, v, w along x, y, z."""
    return {"support_vector": [float(x) for x in place], "u_axis_vector": ALONG, "w_axis_vector": ACROSS}


def add_shaft(
    document: Document, unit: int, name: str, start: Sequence[float],
    sections: Iterable[tuple[float, float, float]] = (), material: Attributes | None = None, /,
    **more: Value,
) -> int:  # fmt: skip
    """Add a shaft that begins at a place, of sections of a length, an outer and an inner diameter; return its id."""
    shaft, place = document.add_to(unit, "shaft", name, **at(start), **more), 0.0
    if material is not None:
        document.refer(shaft, "material", **material)
    for length, outer, inner in sections:
        document.add_to(
            shaft, "shaft_section", u_coordinate_on_shaft=place, length=length, outer_diameter_begin=outer,
            outer_diameter_end=outer, inner_diameter_begin=inner, inner_diameter_end=inner,
        )  # fmt: skip
        place += length
    return shaft


def springs(radial_N_per_mm: float | str, axial_N_per_mm: float | str, tilt_Nmm_per_rad: float | str) -> Attributes:
    """Return the stiffness of a bearing: numbers, "rigid" or "free"."""
    return {
        "radial_stiffness": stiffness(radial_N_per_mm, 1e3),
        "radial_force_absorption": radial_N_per_mm != "free",
        "axial_stiffness": stiffness(axial_N_per_mm, 1e3),
        "axial_force_absorption": "no_direction" if axial_N_per_mm == "free" else "both_directions",
        "bending_stiffness": stiffness(tilt_Nmm_per_rad, 1.0),
    }


def stiffness(value: float | str, unit: float = 1.0) -> float:
    """Return a stiffness as a number."""
    return STIFF if value == "rigid" else 0.0 if value == "free" else unit * float(value)


def add_rolling(
    document: Document, inner: InnerGeometry, sides: tuple[int, int], name: str, /, **place: Value
) -> int:
    """Add a bearing by its inner geometry between two parts, and return its id."""
    angle, ball = inner.contact_angle_deg, isinstance(inner, BallBearing)
    takes = ("both_directions" if ball else "no_direction") if not angle else "positive" if angle > 0.0 else "negative"
    row: dict[str, Value] = {
        "reference_diameter_rolling_bearing": inner.pitch_diameter_mm, "pressure_angle": abs(angle),
        "axial_force_absorption_of_row": takes,
    }  # fmt: skip
    if isinstance(inner, BallBearing):
        kind = "angular_contact_ball_bearing" if angle else "radial_grooved_ball_bearing"
        constants, diameter = (inner.youngs_modulus_GPa, inner.poisson_ratio), inner.ball_diameter_mm
        row |= {
            "number_of_rolling_elements": inner.balls,
            "raceway_radius_of_inner_ring": inner.inner_osculation * diameter,
            "raceway_radius_of_outer_ring": inner.outer_osculation * diameter,
        }
        element: Attributes = {
            "diameter_of_rolling_element": diameter, "angular_position_around_u": inner.first_ball_deg
        }  # fmt: skip
    else:
        kind = "radial_tapered_roller_bearing" if angle else "radial_roller_bearing"
        constants = 1e-3 * STEEL_MODULUS, STEEL_RATIO
        row |= {
            "number_of_rolling_elements": inner.rollers, "custom_pmor_laminae": inner.laminae,
            "significant_contact_length_inner_ring": inner.effective_length_mm,
            "custom_pmor_logarithmic_profile": isinstance(inner, RollerBearing) and inner.logarithmic_profile,
        }  # fmt: skip
        element = {
            "diameter_of_rolling_element": inner.roller_diameter_mm,
            "length_of_rolling_element": inner.effective_length_mm,
            "angular_position_around_u": inner.first_roller_deg,
        }
    said = inner.dynamic_rating_N
    rating: Attributes = {} if said is None else {"radial_dynamic_load_rating": 1e-3 * said}
    bearing = document.join(
        *sides, "rolling_bearing_with_detailed_geometry", name, **place, bearing_type=kind,
        axial_force_absorption=takes, operating_radial_bearing_clearance=1e3 * inner.clearance_mm, **rating,
    )  # fmt: skip
    row_id = document.add_to(bearing, "rolling_bearing_row", "", "ordered_assembly", **row)
    element_id = document.add_to(row_id, "rolling_element", "", "ordered_assembly", **element)
    document.refer(element_id, "material", elastic_modulus=1e3 * constants[0], poisson_ratio=constants[1])
    return bearing
