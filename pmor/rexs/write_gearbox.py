"""A gearbox and what was found of it as a REXS 2.0 file: axes of all shafts along x, v and w along y and z.

Names of parts are kept, their numbers are not.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from pathlib import Path

import numpy as np

from pmor.machine.coupled import SolvedLoad
from pmor.machine.duty import shares
from pmor.machine.loader import GearboxFile
from pmor.machine.model import pinion_senses
from pmor.machine.readings import Data
from pmor.machine.rolling_bearing import STEEL_MODULUS, STEEL_RATIO, BallBearing, RollerBearing
from pmor.machine.settings import HOUSING, Bearing, Gravity, LoadCase, Mesh, Shaft
from pmor.rexs.document import Attributes, Document, Value
from pmor.rexs.gearbox_results import GEARS, Numbers, found_attributes
from pmor.rexs.loads import LOAD_NAME
from pmor.rexs.lubricant import lubricant_attributes
from pmor.rexs.springs import springs, torsion
from pmor.rexs.write import ACROSS, ALONG, add_gear, misaligned, stage_attributes
from pmor.storage.atomic import atomic_path


@dataclass
class _Draft(Numbers):
    """A file in the making."""

    file: GearboxFile
    document: Document = field(default_factory=Document)
    unit: int = 0
    # By shaft, place and kind of the load.
    acting: dict[tuple[str, float, str], int] = field(default_factory=dict)


def write_gearbox_rexs(
    file: GearboxFile, loads: Sequence[SolvedLoad], entries: Sequence[Data], path: Path, overwrite: bool
) -> None:
    """Write a gearbox and what was found of it; see `gearbox_rexs`. OutputError where it cannot be."""
    text = gearbox_rexs(file, loads, entries, datetime.now().astimezone().isoformat(timespec="seconds"))
    with atomic_path(path, overwrite) as temporary:
        temporary.write_bytes(text)


def gearbox_rexs(file: GearboxFile, loads: Sequence[SolvedLoad], entries: Sequence[Data], date: str) -> bytes:
    """Return the text of the file.

    Parameters
    ----------
    loads : sequence of SolvedLoad
        Load cases that have an equilibrium; the others are in the file without results.
    entries : sequence of mapping
        Of these loads in `gearbox.json`.
    date : str
        ISO 8601.
    """
    draft = _Draft(file)
    said = file.model.sections
    hours = [load.hours for load in said.loads]
    time: Attributes = {"operating_time": sum(h for h in hours if h)} if all(hours) else {}
    heavy = _gravity(said.gravity)
    draft.unit = draft.document.add("gear_unit", said.title, model_name=file.name, **time, **heavy)
    for shaft in said.shafts:
        _add_shaft(draft, shaft)
    _add_bearings(draft)
    senses = pinion_senses(file.model, said.loads[0])
    for mesh in said.meshes:
        _add_mesh(draft, mesh, senses[mesh.name])
    for load in said.loads:
        _add_loads(draft, load)
    parts = shares(said.loads) or [None] * len(said.loads)
    solved = {load.load.name: found_attributes(draft, load, entry) for load, entry in zip(loads, entries, strict=True)}
    for load, part in zip(said.loads, parts, strict=True):
        case = _given(draft, load, part, senses)
        for number, attributes in solved.get(load.name, {}).items():
            case[number] = {**case.get(number, {}), **attributes}
        draft.document.cases.append(case)
    return draft.document.text(date)


def _gravity(gravity: Gravity) -> Attributes:
    size = math.hypot(*gravity.vector)
    if not size:
        return {}
    down = {f"direction_vector_gravity_{way}": part / size for way, part in zip("uvw", gravity.vector, strict=True)}
    return {
        "account_for_gravity": True, "gravitational_acceleration": size, "u_axis_vector": ALONG,
        "w_axis_vector": ACROSS, **down,
    }  # fmt: skip


def _add_shaft(draft: _Draft, shaft: Shaft) -> None:
    document = draft.document
    number = document.add(
        "shaft", shaft.name, support_vector=[shaft.start_mm, *shaft.at_mm], u_axis_vector=ALONG, w_axis_vector=ACROSS
    )
    draft.shafts[shaft.name] = number
    document.relate("assembly", assembly=draft.unit, part=number)
    material = document.add(
        "material", "", elastic_modulus=1e3 * shaft.youngs_modulus_GPa, poisson_ratio=shaft.poisson_ratio,
        density=1e-3 * shaft.density_kg_m3,
    )  # fmt: skip
    document.relate("reference", origin=number, referenced=material)
    place = 0.0
    for section in shaft.sections:
        part = document.add(
            "shaft_section", "", u_coordinate_on_shaft=place, length=section.length_mm,
            outer_diameter_begin=section.outer_mm, outer_diameter_end=section.outer_mm,
            inner_diameter_begin=section.inner_mm, inner_diameter_end=section.inner_mm,
        )  # fmt: skip
        document.relate("assembly", assembly=number, part=part)
        place += section.length_mm


def _add_bearings(draft: _Draft) -> None:
    document, model = draft.document, draft.file.model
    casing = document.add("gear_casing", "Housing")
    document.relate("assembly", assembly=draft.unit, part=casing)
    oil = document.add("lubricant", "", **lubricant_attributes(model.sections.lubricant))
    document.relate("reference", origin=casing, referenced=oil)
    group = None
    if model.housing is not None:
        group = document.add(
            "assembly_group", "Housing", reduced_static_stiffness_matrix=model.housing,
            matrix_with_inertial_environment_boundary=True,
        )  # fmt: skip
        document.relate("reference", origin=casing, referenced=group)
    for bearing in model.sections.bearings:
        shaft = model.shafts[bearing.shaft]
        place = [shaft.start_mm + bearing.at_mm, *shaft.at_mm]
        at: Attributes = {
            "u_coordinate_on_shaft_inner_side": bearing.at_mm, "support_vector": place, "u_axis_vector": ALONG,
            "w_axis_vector": ACROSS,
        }  # fmt: skip
        number = _add_rolling(document, bearing, at)
        if number is None:
            stiffness = springs(bearing.radial_N_per_mm, bearing.axial_N_per_mm, bearing.tilt_Nmm_per_rad)
            kind = "coupling" if bearing.couples else "concept_bearing"
            about = torsion(bearing.torsion_Nmm_per_rad) if bearing.couples else {}
            number = document.add(kind, bearing.name, **at, **stiffness, **about)
        draft.bearings[bearing.name] = number
        outer = casing if bearing.to == HOUSING else draft.shafts[bearing.to]
        document.relate("side", assembly=number, inner_part=draft.shafts[bearing.shaft], outer_part=outer)
        if group is not None and bearing.to == HOUSING:
            point = document.add("reduction_point", bearing.name, support_vector=place)
            document.relate("ordered_assembly", assembly=group, part=point)
            document.relate("reference", origin=point, referenced=number)


def _add_rolling(document: Document, bearing: Bearing, at: Attributes) -> int | None:
    """Add a bearing by its inner geometry; None of one by its stiffness."""
    inner = bearing.ball or bearing.roller
    if inner is None:
        return None
    angle = inner.contact_angle_deg
    takes = "both_directions" if isinstance(inner, BallBearing) else "no_direction"
    takes = takes if angle == 0.0 else "positive" if angle > 0.0 else "negative"
    row: dict[str, Value] = {
        "reference_diameter_rolling_bearing": inner.pitch_diameter_mm, "pressure_angle": abs(angle),
        "axial_force_absorption_of_row": takes,
    }  # fmt: skip
    if isinstance(inner, BallBearing):
        kind = "angular_contact_ball_bearing" if angle else "radial_grooved_ball_bearing"
        diameter = inner.ball_diameter_mm
        row |= {
            "number_of_rolling_elements": inner.balls,
            "raceway_radius_of_inner_ring": inner.inner_osculation * diameter,
            "raceway_radius_of_outer_ring": inner.outer_osculation * diameter,
        }
        element: Attributes = {
            "diameter_of_rolling_element": diameter,
            "angular_position_around_u": inner.first_ball_deg,
        }
        constants = inner.youngs_modulus_GPa, inner.poisson_ratio
    else:
        kind, element, constants = _roller(inner, row)
    number = document.add(
        "rolling_bearing_with_detailed_geometry", bearing.name, **at, bearing_type=kind, axial_force_absorption=takes,
        operating_radial_bearing_clearance=1e3 * inner.clearance_mm,
    )  # fmt: skip
    parts = document.add("rolling_bearing_row", "", **row), document.add("rolling_element", "", **element)
    document.relate("ordered_assembly", assembly=number, part=parts[0])
    document.relate("ordered_assembly", assembly=parts[0], part=parts[1])
    material = document.add("material", "", elastic_modulus=1e3 * constants[0], poisson_ratio=constants[1])
    document.relate("reference", origin=parts[1], referenced=material)
    return number


def _roller(inner: RollerBearing, row: dict[str, Value]) -> tuple[str, Attributes, tuple[float, float]]:
    row |= {
        "number_of_rolling_elements": inner.rollers, "custom_pmor_laminae": inner.laminae,
        "significant_contact_length_inner_ring": inner.effective_length_mm,
        "custom_pmor_logarithmic_profile": inner.logarithmic_profile,
    }  # fmt: skip
    kind = "radial_tapered_roller_bearing" if inner.contact_angle_deg else "radial_roller_bearing"
    element: Attributes = {
        "diameter_of_rolling_element": inner.roller_diameter_mm, "length_of_rolling_element": inner.effective_length_mm,
        "angular_position_around_u": inner.first_roller_deg,
    }  # fmt: skip
    return kind, element, (1e-3 * STEEL_MODULUS, STEEL_RATIO)


def _add_mesh(draft: _Draft, mesh: Mesh, sense: float) -> None:
    """Add a stage with its gears; z of the case looks along `sense` x under the first load."""
    document, model = draft.document, draft.file.model
    pair, case = model.pairs[mesh.name], draft.file.cases[mesh.name]
    stage = document.add("cylindrical_stage", mesh.name, **stage_attributes(pair), **misaligned(case.misalignment))
    document.relate("assembly", assembly=draft.unit, part=stage)
    draft.stages[mesh.name] = stage
    for number, (name, place) in enumerate(zip(GEARS, (mesh.pinion, mesh.wheel), strict=True)):
        shaft = model.shafts[place.shaft]
        low, high = pair.faces[number]
        middle = place.at_mm + sense * 0.5 * (low + high)
        gear, _ = add_gear(
            document, case, pair, number, f"{mesh.name}, {name}", middle - 0.5 * (high - low),
            "positive" if sense > 0.0 else "negative", support_vector=[shaft.start_mm + middle, *shaft.at_mm],
            u_axis_vector=ALONG, w_axis_vector=ACROSS,
        )  # fmt: skip
        document.relate("assembly", assembly=draft.shafts[place.shaft], part=gear)
        data = document.add("cylindrical_stage_gear_data", "", is_driving_gear=number == 0)
        document.relate("stage_gear_data", stage=stage, gear=gear, stage_gear_data=data)
        draft.gears[mesh.name, name], draft.data[mesh.name, name] = gear, data
    gears = [draft.gears[mesh.name, name] for name in GEARS]
    document.relate("stage", stage=stage, gear_1=gears[0], gear_2=gears[1])


def _add_loads(draft: _Draft, load: LoadCase) -> None:
    """Add a component for each place at which a torque acts or is held, or a force or moment acts."""
    keys = [
        (torque.shaft, torque.at_mm, "held" if torque.torque_Nm == "balance" else "torque") for torque in load.torques
    ]
    keys += [(force.shaft, force.at_mm, "force") for force in load.forces]
    keys += [(moment.shaft, moment.at_mm, "force") for moment in load.moments]
    for key in keys:
        if key not in draft.acting:
            shaft, place, kind = key
            driven: Attributes = {} if kind == "force" else {"defines_torque": kind == "torque"}
            number = draft.document.add(
                "external_load", "", u_coordinate_on_shaft=place, transmits_torque=kind != "force", **driven
            )
            draft.document.relate("assembly", assembly=draft.shafts[shaft], part=number)
            draft.acting[key] = number


def _given(draft: _Draft, load: LoadCase, part: float | None, senses: Mapping[str, float]) -> dict[int, Attributes]:
    """What is given of a load case: its name, time, speed and loads, and the flanks that carry."""
    share: Attributes = {} if part is None else {"operating_time_fraction": 100.0 * part}
    case: dict[int, Attributes] = {draft.unit: {LOAD_NAME: load.name, **share}}
    if load.speed_rpm is not None:
        case[draft.shafts[load.torques[0].shaft]] = {"rotational_speed": load.speed_rpm}
    case |= {number: {"torque_around_u_axis": 0.0} for (_, _, kind), number in draft.acting.items() if kind == "torque"}
    for torque in load.torques:
        if not isinstance(torque.torque_Nm, str):
            case[draft.acting[torque.shaft, torque.at_mm, "torque"]] = {"torque_around_u_axis": torque.torque_Nm}
    acting: dict[int, np.ndarray] = {}
    for force in load.forces:
        values = acting.setdefault(draft.acting[force.shaft, force.at_mm, "force"], np.zeros(5))
        values[:3] += force.x_N, force.y_N, force.z_N
    for moment in load.moments:
        values = acting.setdefault(draft.acting[moment.shaft, moment.at_mm, "force"], np.zeros(5))
        values[3:] += moment.y_Nm, moment.z_Nm
    names = [*(f"force_{way}_direction" for way in "uvw"), *(f"torque_around_{way}_axis" for way in "vw")]
    case |= {number: dict(zip(names, values.tolist(), strict=True)) for number, values in acting.items()}
    now = pinion_senses(draft.file.model, load)
    for (mesh, _), number in draft.data.items():
        case[number] = {"loaded_tooth_flank": "left" if now[mesh] == senses[mesh] else "right"}
    return case
