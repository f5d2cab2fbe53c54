"""Machines made and changed in Python; of cases each keyword has its type: editors and notebooks complete them."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, Literal, TypedDict, Unpack

from pmor.app.records import KINDS, called, kind_of_sections, kind_of_settings, typed
from pmor.case import Case
from pmor.case import change_case as changed_case
from pmor.case import make_case as made_case
from pmor.case.change import document_text, merged
from pmor.core.errors import CaseError
from pmor.core.wording import in_python, suggesting, typed_out

Section = Mapping[str, Any]
Numbers = float | Sequence[float]
Scheme = Literal["line", "direct", "paper", "facet"]
PictureFormat = Literal["png", "svg", "pdf"]


class Settings(TypedDict, total=False):
    """Sections of a case file as mappings, and its keys that only one section has, or both gears have."""

    title: str
    condition: Sequence[Section]
    loads: Sequence[Section]
    load: Section
    pair: Section
    pinion: Section
    wheel: Section
    mesh: Section
    contact: Section
    misalignment: Section
    reduction: Section
    offline: Section
    online: Section
    compare: Section
    results: Section
    dynamics: Section
    lubricant: Section
    tolerances: Section
    output: Section
    # [load]
    torque_Nm: float
    speed_rpm: float
    # [pair]
    module_mm: float
    pressure_angle_deg: float
    helix_angle_deg: float
    face_width_mm: float
    centre_distance_mm: float
    # [pinion]
    teeth: int
    internal: bool
    root_fillet_mm: float
    held: Literal["outside"] | Section
    seat_radial_N_per_mm: float | Literal["rigid", "free"]
    seat_tangential_N_per_mm: float | Literal["rigid", "free"]
    profile_shift: float
    addendum: float
    dedendum: float
    rack_tip_radius: float
    bore_radius_mm: float
    one_piece: bool
    face_offset_mm: float
    tip_rounding_mm: float
    tip_chamfer_mm: float
    tip_shortening_mm: float
    tooth_thickness_allowance_um: Numbers
    youngs_modulus_GPa: float
    poisson_ratio: float
    # [mesh]
    profile_elements: int
    width_elements: int
    width: Literal["half", "whole", "plane_strain"]
    element: Literal["hex20", "hex8i", "hex8"]
    spacing: Literal["arc_length", "roll_angle"]
    share_identical: bool
    error_bar: bool
    # [contact]
    scheme: Scheme
    slave: Literal["tip", "pinion", "wheel", "both"]
    edge_normals: Literal["parabolic", "average"]
    lodm_profile: int
    lodm_width: int
    penalty_N_mm3: float
    layer_depth: float
    # [reduction]
    shapes: Literal["line_loads", "flank_lines", "positions", "pod", "global_pod", "static_modes"]
    interpolation: Literal["linear", "cubic"]
    pod_tolerance: float
    distribution_tolerance: float
    error_estimate: bool
    # [offline]
    sampling: Literal["grid", "sobol", "greedy"]
    solves: int
    tolerance_percent: float
    # [online]
    pitches: int | Literal["revolution", "hunting"]
    extrapolate: bool
    # [compare]
    angles: int
    models: Scheme | Sequence[Scheme]
    largest_error_percent: float
    # [results]
    maps: bool
    harris_torques_Nm: Numbers
    root_stress: bool
    # [dynamics]
    degrees_of_freedom: int
    mesh_frequency_ratio: Numbers
    mesh_frequency_Hz: Numbers
    speed_range_rpm: Numbers
    damping_ratio: float
    mesh_damping_N_s_mm: float
    backlash_um: float
    density_kg_m3: float
    pinion_inertia_kg_m2: float
    wheel_inertia_kg_m2: float
    pinion_shaft_inertia_kg_m2: float
    wheel_shaft_inertia_kg_m2: float
    pinion_mass_kg: float
    wheel_mass_kg: float
    pinion_bearing_stiffness_N_um: Numbers
    wheel_bearing_stiffness_N_um: Numbers
    pinion_bearing_damping_N_s_mm: Numbers
    wheel_bearing_damping_N_s_mm: Numbers
    pinion_tilting_stiffness_kNm_rad: Numbers
    wheel_tilting_stiffness_kNm_rad: Numbers
    bearing_damping_ratio: float
    run_cycles: int
    accuracy_grade: int
    law: Literal["table", "exact"]
    # [lubricant]
    friction: float | Literal["schlenk"]
    viscosity_mPas: float
    roughness_um: float
    lubricant_factor: float
    # [tolerances]
    flank_tolerance_class: int
    waves_per_pitch: float | Sequence[float]
    samples: int
    seed: int
    # [output]
    plots: bool
    report: bool
    live_page: bool
    format: PictureFormat | Sequence[PictureFormat]


@contextmanager
def in_keywords() -> Iterator[None]:
    """Word what is refused as keywords of Python, not as sections of a file."""
    try:
        yield
    except CaseError as error:
        raise type(error)(in_python(str(error))) from None


@typed_out(Settings)
def make_case(name: str = "case", **settings: Unpack[Settings]) -> Case:
    """Make a case without a file.

    Parameters
    ----------
    name : str
        Names results; used in messages.
    **settings
        Sections as mappings, or single keys by their names in a case file where only one section has them (a key of the
        gears sets both): ``pinion={"teeth": 21}``, ``module_mm=4.0``. Names carry the units.

    Returns
    -------
    Case
        Complete: every default is filled in.

    Raises
    ------
    CaseError
        As for a case file: key, value, allowed values and remedy.

    Examples
    --------
    >>> case = make_case(teeth=21, bore_radius_mm=20.0, module_mm=4.0, face_width_mm=20.0, torque_Nm=100.0)
    >>> case.pair.wheel.teeth
    21
    """
    with in_keywords():
        return made_case(name, **settings)


@typed_out(Settings)
@suggesting
def change_case(case: Case, **settings: Unpack[Settings]) -> Case:
    """Return a case with some settings changed; see `make_case`."""
    with in_keywords():
        return changed_case(case, **settings)


def make(name: str = "machine", **sections: Any) -> Any:
    """Make a machine without a file: a pair, a planetary set, a train of gears or a gearbox, by its sections.

    Parameters
    ----------
    name : str
        Names results; used in messages.
    **sections
        As the file has them: mappings, and lists of mappings for what a file has in double brackets. Names of files in
        them are whole paths. Of a pair single keys too, as `make_case` takes them.

    Returns
    -------
    Case, SetFile or GearboxFile
        As `load` returns it.

    Raises
    ------
    CaseError, GeometryError
        As for a file: key, value, allowed values and remedy.

    Examples
    --------
    >>> make(teeth=21, bore_radius_mm=20.0, module_mm=4.0, face_width_mm=20.0, torque_Nm=100.0).pair.wheel.teeth
    21
    """
    kind = KINDS[kind_of_sections(sections)]
    if kind is KINDS["case"]:
        return make_case(name, **sections)
    if not kind.parse:
        raise CaseError(f"{name}: is {kind.words}, which names a machine: write a file, and use {typed(kind.command)}")
    with in_keywords():
        return called(kind.parse)(document_text(merged({}, sections, name)), name, name)


def change(machine: Any, **sections: Any) -> Any:
    """Return a machine with some settings changed, checked as that of a file.

    Parameters
    ----------
    machine : Case, SetFile or GearboxFile
    **sections
        Mappings with the keys that change; None takes a key or a section away. Of sections that have names, those that
        change by their names: ``bearings={"left": {"at_mm": 12.0}}``; a list takes the place of all.

    Raises
    ------
    CaseError, GeometryError

    Examples
    --------
    >>> pair = make(teeth=21, bore_radius_mm=20.0, module_mm=4.0, face_width_mm=20.0, torque_Nm=100.0)
    >>> change(pair, pair={"helix_angle_deg": 10.0}).pair.helix_angle_deg
    10.0
    """
    kind = kind_of_settings(machine)
    if kind == "case":
        return change_case(machine, **sections)
    if not KINDS[kind].parse or not machine.text:
        rule = "is no text of sections: write a TOML file of it (pmor.export_file), and change that"
        raise CaseError(f"{machine.name}: {rule}")
    with in_keywords():
        document = merged(tomllib.loads(machine.text), sections, machine.name)
        changed = called(KINDS[kind].parse)(document_text(document), machine.name, machine.name, machine.inputs)
    return replace(changed, notes=machine.notes, changed=machine.changed) if kind == "set" else changed
