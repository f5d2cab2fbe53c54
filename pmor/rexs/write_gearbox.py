"""A gearbox and what was found of it as a REXS 2.0 file: axes of all shafts along x, v and w along y and z.

Names of parts are kept, their numbers are not.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from pmor.case.coast import as_drawn
from pmor.case.duty import shares
from pmor.machine.coupled import SolvedLoad
from pmor.machine.load_settings import Gravity, LoadCase
from pmor.machine.loader import GearboxFile
from pmor.machine.model import pinion_senses, set_torques
from pmor.machine.readings import Data
from pmor.machine.set_frame import set_frame
from pmor.machine.settings import HOUSING, Mesh, PlanetarySet, Shaft
from pmor.rexs.document import Attributes, Document
from pmor.rexs.gearbox_results import GEARS, Numbers, found_attributes
from pmor.rexs.loads import LOAD_NAME
from pmor.rexs.lubricant import lubricant_attributes
from pmor.rexs.parts import ACROSS, ALONG, add_rolling, add_shaft, at, springs, stiffness
from pmor.rexs.write import add_gear, case_attributes, stage_attributes
from pmor.rexs.write_set import SetParts


@dataclass
class _Draft(Numbers):
    """A file in the making."""

    file: GearboxFile
    document: Document = field(default_factory=Document)
    unit: int = 0
    casing: int = 0
    sets: dict[str, SetParts] = field(default_factory=dict)
    # By shaft, place and kind of the load.
    acting: dict[tuple[str, float, str], int] = field(default_factory=dict)


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
    draft.casing = draft.document.add_to(draft.unit, "gear_casing", "Housing")
    for shaft in said.shafts:
        _add_shaft(draft, shaft)
    _add_bearings(draft)
    senses = pinion_senses(file.model, said.loads[0])
    for mesh in said.meshes:
        _add_mesh(draft, mesh, senses[mesh.name])
    for planetary in said.sets:
        _add_set(draft, planetary)
    for load in said.loads:
        _add_loads(draft, load)
    parts = shares(said.loads) or [None] * len(said.loads)
    solved = {load.load.name: found_attributes(draft, load, entry) for load, entry in zip(loads, entries, strict=True)}
    for under in loads:
        for one in under.sets:
            if one.solution.converged[0].any():
                solved[under.load.name] |= draft.sets[one.meshing.settings.name].results(one.solution, 0)
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
    steel: Attributes = {
        "elastic_modulus": 1e3 * shaft.youngs_modulus_GPa, "poisson_ratio": shaft.poisson_ratio,
        "density": 1e-3 * shaft.density_kg_m3,
    }  # fmt: skip
    sections = [(section.length_mm, section.outer_mm, section.inner_mm) for section in shaft.sections]
    start = shaft.start_mm, *shaft.at_mm
    draft.shafts[shaft.name] = add_shaft(draft.document, draft.unit, shaft.name, start, sections, steel)


def _add_bearings(draft: _Draft) -> None:
    document, model, casing = draft.document, draft.file.model, draft.casing
    document.refer(casing, "lubricant", **lubricant_attributes(model.sections.lubricant))
    group = None
    if model.housing is not None:
        group = document.refer(
            casing, "assembly_group", "Housing", reduced_static_stiffness_matrix=model.housing,
            matrix_with_inertial_environment_boundary=True,
        )  # fmt: skip
    for bearing in model.sections.bearings:
        shaft = model.shafts[bearing.shaft]
        place = at([shaft.start_mm + bearing.at_mm, *shaft.at_mm])
        there = {"u_coordinate_on_shaft_inner_side": bearing.at_mm, **place}
        sides = draft.shafts[bearing.shaft], casing if bearing.to == HOUSING else draft.shafts[bearing.to]
        if (inner := bearing.inner) is not None:
            number = add_rolling(document, inner, sides, bearing.name, **there)
        else:
            there |= springs(bearing.radial_N_per_mm, bearing.axial_N_per_mm, bearing.tilt_Nmm_per_rad)
            about = {"rotational_stiffness": stiffness(bearing.torsion_Nmm_per_rad)} if bearing.couples else {}
            kind = "coupling" if bearing.couples else "concept_bearing"
            number = document.join(*sides, kind, bearing.name, **there, **about)
        draft.bearings[bearing.name] = number
        if group is not None and bearing.to == HOUSING:
            point = document.add_to(
                group, "reduction_point", bearing.name, "ordered_assembly", support_vector=place["support_vector"]
            )
            document.relate("reference", origin=point, referenced=number)


def _add_mesh(draft: _Draft, mesh: Mesh, sense: float) -> None:
    """Add a stage with its gears; z of the drawing looks along `sense` x under the first load, of coast flanks back."""
    document, model = draft.document, draft.file.model
    pair, case = model.pairs[mesh.name], draft.file.cases[mesh.name]
    sense = -sense if case.flank == "coast" else sense
    stage = document.add_to(
        draft.unit, "cylindrical_stage", mesh.name, **stage_attributes(pair), **case_attributes(case)
    )
    draft.stages[mesh.name] = stage
    for number, (name, place) in enumerate(zip(GEARS, (mesh.pinion, mesh.wheel), strict=True)):
        shaft = model.shafts[place.shaft]
        low, high = pair.faces[number]
        middle = place.at_mm + sense * 0.5 * (low + high)
        gear, _ = add_gear(
            document, as_drawn(case), pair, number, f"{mesh.name}, {name}", middle - 0.5 * (high - low),
            "positive" if sense > 0.0 else "negative", **at([shaft.start_mm + middle, *shaft.at_mm]),
        )  # fmt: skip
        document.relate("assembly", assembly=draft.shafts[place.shaft], part=gear)
        data = document.add("cylindrical_stage_gear_data", "", is_driving_gear=number == 0)
        document.relate("stage_gear_data", stage=stage, gear=gear, stage_gear_data=data)
        draft.gears[mesh.name, name], draft.data[mesh.name, name] = gear, data
    gears = [draft.gears[mesh.name, name] for name in GEARS]
    document.relate("stage", stage=stage, gear_1=gears[0], gear_2=gears[1])


def _add_set(draft: _Draft, one: PlanetarySet) -> None:
    """Add a planetary set on its shafts, its axis as the torque of the first load on its sun has it."""
    model = draft.file.model
    sense = set_torques(model, model.sections.loads[0])[one.name]
    frame = set_frame(model.sets[one.name].plan, sense and math.copysign(1.0, sense), (0.0, 0.0, 0.0))
    first = one.members.get("sun") or next(iter(one.members.values()))
    shaft = model.shafts[first.shaft]
    y, z = shaft.at_mm
    middle = shaft.start_mm + first.at_mm, y, z
    given = {
        member: (draft.shafts[place.shaft], place.at_mm, middle[0] - model.shafts[place.shaft].start_mm)
        for member, place in one.members.items()
    }
    draft.sets[one.name] = SetParts(
        draft.document, draft.unit, draft.casing, model.sets[one.name], one.name, frame.turn[:3, :3], middle, given
    )
    draft.sets[one.name].add()


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
            draft.acting[key] = draft.document.add_to(
                draft.shafts[shaft], "external_load", u_coordinate_on_shaft=place, transmits_torque=kind != "force",
                **driven,
            )  # fmt: skip


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
        drives = (now[mesh] == senses[mesh]) == (draft.file.cases[mesh].flank == "drive")
        case[number] = {"loaded_tooth_flank": "left" if drives else "right"}
    return case
