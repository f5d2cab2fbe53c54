"""A train of gears on fixed axes and its results as a REXS 2.0 file: each gear once, whatever it meshes with.

Its axis is x, its x and y are y and z. Shafts reach over the faces of their gears, and stand in rigid bearings below
each of them. Mesh, sweep of angles, tolerances and duty cycle of the set file are left out.
"""

from __future__ import annotations

from pmor.case.coast import as_drawn
from pmor.pair.model import gear_pair
from pmor.rexs.document import Attributes, Document
from pmor.rexs.parts import ALONE, add_shaft, at, springs
from pmor.rexs.set_results import gear_forces, mesh_attributes, stage_results
from pmor.rexs.shafts import shaft_attributes
from pmor.rexs.trains import FIXED_AXES
from pmor.rexs.write import add_gear, stage_attributes
from pmor.sets.loader import SetFile
from pmor.sets.settings import Gear
from pmor.sets.solution import SetSolution


def train_rexs(file: SetFile, solved: SetSolution | None, date: str) -> bytes:
    """Return the text of the file; `date` is ISO 8601."""
    document, said, plan = Document(), file.sections, file.plan
    unit = document.add("gear_unit", said.title, model_name=file.name, **{FIXED_AXES: True})
    casing = document.add_to(unit, "gear_casing", "Housing")
    pairs = {name: gear_pair(case) for name, case in file.cases.items()}
    # Of each gear the first mesh that it has a part in, and which part.
    part = {body: (mesh.case, role) for mesh in reversed(plan.meshes)
            for role, body in ((1, mesh.wheel), (0, mesh.pinion))}  # fmt: skip
    faces = []
    for number, gear in enumerate(said.gears):
        case, role = part[number]
        faces.append(tuple(_place(gear)[2] + end for end in pairs[case].faces[role]))
    shafts, gears = dict[str, int](), list[int]()
    acting: dict[int, float | None] = {}
    for number, gear in enumerate(said.gears):
        own = [n for n, one in enumerate(said.gears) if (one.shaft or one.name) == (gear.shaft or gear.name)]
        start, end = min(faces[n][0] for n in own), max(faces[n][1] for n in own)
        name, (x, y, _), middle = gear.shaft or gear.name, _place(gear), 0.5 * sum(faces[number])
        if name not in shafts:
            bores = [said.members[said.gears[n].name].get("bore_radius_mm") or 1.0 for n in own]
            shafts[name] = add_shaft(
                document, unit, name, (start, x, y), [(end - start, 2.0 * min(bores), 0.0)]
            )  # fmt: skip
        case, role = part[number]
        more = shaft_attributes(gear.timing_mrad, gear.torsion_Nmm_per_rad)
        gears.append(add_gear(
            document, as_drawn(file.cases[case]), pairs[case], role, gear.name, faces[number][0] - start,
            **at((middle, x, y)), **more,
        )[0])  # fmt: skip
        document.relate("assembly", assembly=shafts[name], part=gears[number])
        rigid = springs("rigid", "rigid", "rigid")
        document.join(shafts[name], casing, "concept_bearing", f"Axis of {gear.name}", **at((middle, x, y)), **rigid)
        if gear.torque_Nm is not None:
            held = gear.torque_Nm == "balance"
            load = document.add_to(
                shafts[name], "external_load", "Held" if held else "Torque", u_coordinate_on_shaft=middle - start,
                transmits_torque=True, defines_torque=not held,
            )  # fmt: skip
            acting[load] = None if isinstance(gear.torque_Nm, str) else gear.torque_Nm
    stages, flanks = list[int](), dict[int, Attributes]()
    for mesh in plan.meshes:
        carrying, both = file.cases[mesh.case], (gears[mesh.pinion], gears[mesh.wheel])
        stages.append(document.add_to(
            unit, "cylindrical_stage", f"{plan.bodies[mesh.pinion].name} - {plan.bodies[mesh.wheel].name}",
            **stage_attributes(pairs[mesh.case]),
        ))  # fmt: skip
        for driving, gear_number in zip((True, False), both, strict=True):
            data = document.add("cylindrical_stage_gear_data", "", is_driving_gear=driving)
            document.relate("stage_gear_data", stage=stages[-1], gear=gear_number, stage_gear_data=data)
            flanks[data] = {"loaded_tooth_flank": "left" if carrying.flank == "drive" else "right"}
        document.relate("stage", stage=stages[-1], gear_1=both[0], gear_2=both[1])
    for number, amount in enumerate(file.torques_Nm):
        share = amount / plan.nominal_Nm
        loads: dict[int, Attributes] = {
            load: {"torque_around_u_axis": share * torque} for load, torque in acting.items() if torque is not None
        }
        loads |= flanks
        if solved is not None and solved.converged[number].any():
            loads |= {unit: stage_results(solved, number)}
            loads |= {stage: mesh_attributes(solved, number, mesh) for mesh, stage in enumerate(stages)}
            loads |= {gear_id: gear_forces(solved, number, body, ALONE) for body, gear_id in enumerate(gears)}
        document.cases.append(loads)
    return document.text(date)


def _place(gear: Gear) -> tuple[float, float, float]:
    x, y, z = (*gear.at_mm, 0.0)[:3]
    return x, y, z
