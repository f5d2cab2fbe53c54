"""What bearings and couplings do to a shaft, by the attributes of a REXS file."""

from __future__ import annotations

from pmor.rexs.document import Attributes

# What stands for rigid, N/m and N mm/rad.
STIFF = 1e20


def springs(radial_N_per_mm: float | str, axial_N_per_mm: float | str, tilt_Nmm_per_rad: float | str) -> Attributes:
    """Return the stiffness of a bearing: numbers, "rigid" or "free"."""
    return {
        "radial_stiffness": _number(radial_N_per_mm, 1e3),
        "radial_force_absorption": radial_N_per_mm != "free",
        "axial_stiffness": _number(axial_N_per_mm, 1e3),
        "axial_force_absorption": "no_direction" if axial_N_per_mm == "free" else "both_directions",
        "bending_stiffness": _number(tilt_Nmm_per_rad, 1.0),
    }


def torsion(about_axis_Nmm_per_rad: float | str) -> Attributes:
    """Return what a coupling has about its axis."""
    return {"rotational_stiffness": _number(about_axis_Nmm_per_rad, 1.0)}


def _number(value: float | str, unit: float) -> float:
    return STIFF if value == "rigid" else 0.0 if value == "free" else unit * float(value)
