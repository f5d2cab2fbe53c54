"""Section `[dynamics]` of a case file: keys, and the rules that tie them together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from pmor.case.values import toml_text
from pmor.core.errors import CaseError
from pmor.core.ranges import Density, Range, Torques

DEGREES_OF_FREEDOM = (1, 6, 12)
# Values that lists by direction hold, by the degrees of freedom.
DIRECTIONS = {6: 2, 12: 3}
DIRECTION_NAMES = "x, y, z"
TILTING_AXES = 2
GEARS = ("pinion", "wheel")
Inertia = Annotated[float, Range(0.0, 1e9, "kg m2", low_excluded=True)]
# Of each direction in its place.
BEARING_STIFFNESS = Range(0.0, 1e12, "N/um", low_excluded=True, in_order=True)
BEARING_DAMPING = Range(0.0, 1e9, "N s/mm", in_order=True)
TILTING_STIFFNESS = Range(0.0, 1e12, "kN m/rad", low_excluded=True, in_order=True)


@dataclass(frozen=True, kw_only=True)
class DynamicsCase:
    """The pair in motion (section `[dynamics]`, of `pmor dynamics`).

    Lists by direction: x across the plane of the axes, y along the line of centres, with twelve degrees of freedom z
    along the axis too.

    Parameters
    ----------
    torques_Nm : tuple of float
        Mean torques in N m, increasing; a frequency response each.
    degrees_of_freedom : int
        1: along the line of action. 6: with two displacements of each gear. 12: with axial and tilting ones too, for
        helical pairs.
    mesh_frequency_ratio : tuple of float
        Lowest and highest mesh frequency, over the natural frequency.
    mesh_frequency_Hz : tuple of float or None
        The same in Hz; None is by the ratio.
    speed_range_rpm : tuple of float or None
        The same as speeds of the pinion in rpm; None is by the ratio.
    damping_ratio : float
        Damping ratio of the mesh: its damping over 2 sqrt(k m), k the mean stiffness, m the mass on the line of action.
        Literature: 0.01 to 0.1; peaks of resonance are inverse to it.
    mesh_damping_N_s_mm : float or None
        Damping of the mesh in N s/mm; None is by the ratio.
    backlash_um : float or None
        Backlash along the transverse line of action, um: so far apart the coast flanks touch. None is that of the
        drawing, by tooth thicknesses and centre distance; where the drawing has none, coast flanks are left out.
    density_kg_m3 : float
        Density of both gears, in kg/m3: for their mass, here and on the data sheet.
    pinion_inertia_kg_m2, wheel_inertia_kg_m2 : float or None
        Polar moment of inertia of a gear in kg m2; None is that of its blank as drawn, from its bore to its reference
        diameter.
    pinion_shaft_inertia_kg_m2, wheel_shaft_inertia_kg_m2 : float
        Inertia of all that turns with a gear beside it, in kg m2.
    pinion_mass_kg, wheel_mass_kg : float or None
        Mass of a gear and of all that moves with it on its bearings, in kg; None is as drawn.
    pinion_bearing_stiffness_N_um, wheel_bearing_stiffness_N_um : tuple of float or None
        Stiffness of the bearings of a gear together, by direction, in N/um; None is rigid.
    pinion_bearing_damping_N_s_mm, wheel_bearing_damping_N_s_mm : tuple of float or None
        Likewise, in N s/mm; None is by the ratio below.
    pinion_tilting_stiffness_kNm_rad, wheel_tilting_stiffness_kNm_rad : tuple of float or None
        About x and y, in kN m/rad; None is rigid.
    bearing_damping_ratio : float
        Damping ratio of each gear on its bearings alone, in each direction.
    run_cycles : int
        Mesh cycles of the run-up, and of the run-down, integrated over time with evenly changing speed; 0: none.
    accuracy_grade : int
        Flank tolerance class of both gears, ISO 1328-1:2013, for K_v of ISO 6336-1 alone.
    law : {"table", "exact"}
        Mesh force of branches: from a table of the line loads, or these themselves, ten times slower. Runs take the
        table.
    """

    torques_Nm: Torques
    degrees_of_freedom: Annotated[int, Range(1, 12)] = 1
    mesh_frequency_ratio: Annotated[tuple[float, ...], Range(1e-3, 100.0)] = (0.25, 1.4)
    mesh_frequency_Hz: Annotated[tuple[float, ...], Range(1e-3, 1e7, "Hz")] | None = None
    speed_range_rpm: Annotated[tuple[float, ...], Range(1e-3, 1e7, "rpm")] | None = None
    damping_ratio: Annotated[float, Range(0.0, 2.0, low_excluded=True)] = 0.02
    mesh_damping_N_s_mm: Annotated[float, Range(0.0, 1e9, "N s/mm", low_excluded=True)] | None = None
    backlash_um: Annotated[float, Range(0.0, 1e5, "um")] | None = None
    density_kg_m3: Density = 7810.0
    pinion_inertia_kg_m2: Inertia | None = None
    wheel_inertia_kg_m2: Inertia | None = None
    pinion_shaft_inertia_kg_m2: Annotated[float, Range(0.0, 1e9, "kg m2")] = 0.0
    wheel_shaft_inertia_kg_m2: Annotated[float, Range(0.0, 1e9, "kg m2")] = 0.0
    pinion_mass_kg: Annotated[float, Range(0.0, 1e9, "kg", low_excluded=True)] | None = None
    wheel_mass_kg: Annotated[float, Range(0.0, 1e9, "kg", low_excluded=True)] | None = None
    pinion_bearing_stiffness_N_um: Annotated[tuple[float, ...], BEARING_STIFFNESS] | None = None
    wheel_bearing_stiffness_N_um: Annotated[tuple[float, ...], BEARING_STIFFNESS] | None = None
    pinion_bearing_damping_N_s_mm: Annotated[tuple[float, ...], BEARING_DAMPING] | None = None
    wheel_bearing_damping_N_s_mm: Annotated[tuple[float, ...], BEARING_DAMPING] | None = None
    pinion_tilting_stiffness_kNm_rad: Annotated[tuple[float, ...], TILTING_STIFFNESS] | None = None
    wheel_tilting_stiffness_kNm_rad: Annotated[tuple[float, ...], TILTING_STIFFNESS] | None = None
    bearing_damping_ratio: Annotated[float, Range(0.0, 2.0)] = 0.02
    run_cycles: Annotated[int, Range(0, 10_000_000)] = 5000
    accuracy_grade: Annotated[int, Range(1, 11)] = 6
    law: Literal["table", "exact"] = "table"


def check_dynamics(dynamics: DynamicsCase, where: str) -> None:
    """Raise CaseError where values of `[dynamics]` contradict each other; see `pmor.case.checks.check_together`."""
    if dynamics.degrees_of_freedom not in DEGREES_OF_FREEDOM:
        raise _refused(where, dynamics, "degrees_of_freedom", "must be 1, 6 or 12: write one of them")
    _check_frequencies(dynamics, where)
    for gear in GEARS:
        _check_bearings(dynamics, gear, where)


def _check_frequencies(dynamics: DynamicsCase, where: str) -> None:
    for key in ("mesh_frequency_ratio", "mesh_frequency_Hz", "speed_range_rpm"):
        values = getattr(dynamics, key)
        if values is not None and len(values) != 2:
            rule = f"must be two values, the lowest and the highest, not {len(values)}: write both, as in [0.3, 1.3]"
            raise _refused(where, dynamics, key, rule)
    for value, other in (
        ("speed_range_rpm", "mesh_frequency_Hz"), ("speed_range_rpm", "mesh_frequency_ratio"),
        ("mesh_frequency_Hz", "mesh_frequency_ratio"), ("mesh_damping_N_s_mm", "damping_ratio"),
    ):  # fmt: skip
        if getattr(dynamics, value) is not None and getattr(dynamics, other) != getattr(DynamicsCase, other):
            raise _refused(where, dynamics, value, f"{other} sets it too: leave one of them out")


def _check_bearings(dynamics: DynamicsCase, gear: str, where: str) -> None:
    stiffness, damping = f"{gear}_bearing_stiffness_N_um", f"{gear}_bearing_damping_N_s_mm"
    tilting, freedom = f"{gear}_tilting_stiffness_kNm_rad", dynamics.degrees_of_freedom
    for key in (stiffness, damping, tilting):
        if getattr(dynamics, key) is not None and freedom == 1:
            rule = "with degrees_of_freedom = 1 bearings are rigid: write 6 or 12 there, or leave this out"
            raise _refused(where, dynamics, key, rule)
    if getattr(dynamics, tilting) is not None and freedom == DEGREES_OF_FREEDOM[1]:
        raise _refused(where, dynamics, tilting, "with degrees_of_freedom = 6 gears do not tilt: write 12 there")
    if getattr(dynamics, damping) is not None and getattr(dynamics, stiffness) is None:
        raise _refused(where, dynamics, damping, f"without {stiffness} bearings are rigid: give it, or leave this out")
    for key in (stiffness, damping):
        values = getattr(dynamics, key)
        if values is not None and len(values) != DIRECTIONS[freedom]:
            names = ", ".join(DIRECTION_NAMES.split(", ")[: DIRECTIONS[freedom]])
            rule = f"must be {DIRECTIONS[freedom]} values with degrees_of_freedom = {freedom}: one each for {names}"
            raise _refused(where, dynamics, key, rule)
    values = getattr(dynamics, tilting)
    if values is not None and len(values) != TILTING_AXES:
        raise _refused(where, dynamics, tilting, "must be two values: one each about x and y")


def _refused(where: str, dynamics: DynamicsCase, key: str, rule: str) -> CaseError:
    return CaseError(f"{where}: [dynamics] {key} = {toml_text(getattr(dynamics, key))}: {rule}")
