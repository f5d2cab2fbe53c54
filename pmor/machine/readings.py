"""What an engineer reads off a solved gearbox, as plain data: the content of `gearbox.json`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from pmor.body.beam import NODE
from pmor.case import Case
from pmor.core.arrays import FloatArray
from pmor.machine.coupled import RigidMesh, RootStresses, SolvedLoad, SolvedMesh
from pmor.machine.iso import CrudeMisalignment, crude_misalignment, sliced_k_h_beta
from pmor.machine.mesh_force import f_beta_um
from pmor.machine.mesh_losses import mesh_losses, per_second
from pmor.machine.model import GearboxModel, LoadedGearbox, Supported, speeds_rpm
from pmor.machine.rolling_bearing import BearingState
from pmor.machine.set_readings import set_entry
from pmor.machine.set_ste_parts import set_ste_parts
from pmor.machine.settings import LoadCase, Lubricant
from pmor.machine.ste_parts import parts_data, ste_parts
from pmor.machine.system import Equilibrium
from pmor.results.load_distribution import face_load_factor, largest_pressure, line_states
from pmor.results.sweep import SteSweep, mesh_orders, peak_to_peak_um, ste_mean_um

Data = dict[str, Any]
HARMONICS = 5


def load_data(model: GearboxModel, cases: Mapping[str, Case], solved: SolvedLoad) -> Data:
    """Return the entry of a load case."""
    speeds = speeds_rpm(model, solved.load)
    meshes = [
        mesh_data(solved, mesh, rigid)
        | {"sliced_k_h_beta": sliced_k_h_beta(mesh, cases[mesh.meshing.settings.name])}
        | _iso(crude_misalignment(model, solved.load, mesh, cases[mesh.meshing.settings.name]))
        | losses(mesh, speeds.get(mesh.meshing.settings.pinion.shaft), model.sections.lubricant)
        for mesh, rigid in zip(solved.meshes, solved.rigid, strict=True)
    ]
    lubricant = model.sections.lubricant
    sets = [
        set_entry(one, speeds, lubricant, set_ste_parts(solved.gearbox, solved.equilibrium, one)) for one in solved.sets
    ]
    joints = [*meshes, *sets]
    known = [one["losses_W"] for one in joints if one["losses_W"] is not None]
    lost = sum(known) if len(known) == len(joints) else None
    held = _held(solved)
    power = _power(solved.load, speeds, held)
    return {
        "name": solved.load.name,
        "speeds_rpm": speeds,
        "meshes": meshes,
        "sets": sets,
        "power_W": power,
        "losses_W": lost,
        "efficiency": 1.0 - lost / power if power and lost is not None else None,
        "bearings": bearing_data(solved),
        "shafts": shaft_data(solved),
        "held_torques_Nm": held,
    }


def _power(load: LoadCase, speeds: Mapping[str, float], held: Sequence[Data]) -> float | None:
    """Return the power that enters at all torques of a load; None where a shaft has no speed."""
    given = [(one.shaft, one.torque_Nm) for one in load.torques if not isinstance(one.torque_Nm, str)]
    all_torques = [*given, *((one["shaft"], one["torque_Nm"]) for one in held)]
    if any(shaft not in speeds for shaft, _ in all_torques):
        return None
    return sum(max(torque * per_second(speeds[shaft]), 0.0) for shaft, torque in all_torques)


def mesh_data(solved: SolvedLoad, mesh: SolvedMesh, rigid: RigidMesh) -> Data:
    """Return what a mesh does, beside the same pair on rigid supports."""
    pair, frame = mesh.meshing.pair, mesh.meshing.frame
    relative = mesh.displacement[1] - mesh.displacement[0]
    width = pair.face_width
    swept = sweep_data(mesh.sweep, 0, mesh.root_stress)
    return {
        "name": mesh.meshing.settings.name,
        "torque_Nm": 1e-3 * mesh.torque,
        "force_N": mesh.force,
        "f_beta_um": frame.along * f_beta_um(pair, mesh.displacement),
        "in_plane_um": -1e3 * width * float(relative[3]),
        "out_of_plane_um": 1e3 * width * float(relative[4]),
        "centre_distance_um": 1e3 * float(relative[1]),
        "converged": bool(mesh.sweep.converged.all()),
        "pitches": mesh.sweep.pitches,
        **swept,
        **parts_data(ste_parts(solved.gearbox, solved.equilibrium.displacement, mesh.meshing), swept["ste_mean_um"]),
        **{f"rigid_{key}": value for key, value in sweep_data(*rigid).items()},
    }


def _iso(found: CrudeMisalignment | None) -> Data:
    values = found or (None, None, None)
    return {f"iso_{key}": value for key, value in zip(CrudeMisalignment._fields, values, strict=True)}


def losses(mesh: SolvedMesh, pinion_rpm: float | None, lubricant: Lubricant) -> Data:
    """Return loss factor, friction and power lost in a mesh; null without a speed, or at rest."""
    pair = mesh.meshing.pair
    return mesh_losses(pair, line_states(mesh.sweep), mesh.force, pinion_rpm, lubricant)


def sweep_data(sweep: SteSweep, row: int, root_stress: RootStresses) -> Data:
    """Return the figures of a sweep under one of its torques; null where a position did not converge."""
    lines = line_states(sweep)
    whole = bool(sweep.converged[row].all())
    carries = lines.load_N_per_mm[row].sum(axis=(0, 1)) > 0.0
    pressure = float(largest_pressure(lines.pressure_MPa[row], (0, 1, 2)))
    return {
        "ste_mean_um": _number(ste_mean_um(sweep)[row], whole),
        "ste_peak_to_peak_um": _number(peak_to_peak_um(sweep)[row], whole),
        "ste_harmonics_um": [float(a) for a in mesh_orders(sweep, row, HARMONICS)] if whole else None,
        "k_h_beta": _number(face_load_factor(lines)[row], whole),
        "carrying_face_percent": _number(100.0 * lines.width_mm[carries].sum() / lines.width_mm.sum(), whole),
        "flank_pressure_max_MPa": _number(pressure, whole and not math.isnan(pressure)),
        "root_stress_max_MPa": list(root_stress) if whole and root_stress else None,
    }


def bearing_data(solved: SolvedLoad) -> list[Data]:
    """Return force, displacement and tilt of each bearing, of its shaft against what it stands on."""
    return carried(solved.gearbox, solved.equilibrium)


def carried(gearbox: LoadedGearbox, equilibrium: Equilibrium) -> list[Data]:
    """Return what `bearing_data` does, of a gearbox in equilibrium."""
    found, constraint, seat = [], 0, 0
    displacement = equilibrium.displacement
    for bearing in gearbox.bearings:
        moved = bearing.rows @ displacement
        moved[list(bearing.rigid)] = 0.0
        force = bearing.springs * moved + 0.0
        state = None
        for direction in bearing.rigid:
            force[direction] -= equilibrium.reactions[constraint]
            constraint += 1
        if bearing.inner is not None:
            state = equilibrium.bearings[seat]
            force[[0, 1, 2, 4, 5]] += state.force
            seat += 1
        found.append(_bearing(bearing, moved, force, state))
    return found


def _bearing(bearing: Supported, moved: FloatArray, force: FloatArray, state: BearingState | None) -> Data:
    entry = {
        "name": bearing.settings.name,
        "shaft": bearing.settings.shaft,
        "to": bearing.settings.to,
        "force_N": force[:3].tolist(),
        "radial_force_N": float(np.hypot(*force[1:3])),
        "moment_Nmm": force[4:].tolist(),
        "displacement_um": (1e3 * moved[:3]).tolist(),
        "tilt_mrad": (1e3 * moved[4:]).tolist(),
    }
    if bearing.settings.couples:
        entry["torque_Nm"] = 1e-3 * float(force[3])
    if state is not None:
        entry |= {
            "element_force_N": state.element_force.tolist(),
            "loaded_elements": int(np.count_nonzero(state.element_force)),
            "contact_pressure_max_MPa": state.pressure,
            "static_safety": state.static_safety if state.pressure > 0.0 else None,
        }
    return entry


def shaft_data(solved: SolvedLoad) -> list[Data]:
    """Return the deflection line of each shaft: places along it, displacements across the axis and along it, twist."""
    found = []
    for name, beam in solved.gearbox.beams.items():
        first = solved.gearbox.first[name]
        moved = solved.equilibrium.displacement[first : first + NODE * len(beam.stations)].reshape(-1, NODE)
        found.append({
            "name": name,
            "at_mm": beam.stations.tolist(),
            "displacement_um": (1e3 * moved[:, :3]).tolist(),
            "tilt_mrad": (1e3 * moved[:, 4:]).tolist(),
            "twist_mrad": (1e3 * (moved[:, 3] - moved[0, 3])).tolist(),
        })  # fmt: skip
    return found


def _held(solved: SolvedLoad) -> list[Data]:
    held = [torque for torque in solved.load.torques if torque.torque_Nm == "balance"]
    first = sum(len(bearing.rigid) for bearing in solved.gearbox.bearings)
    reactions = solved.equilibrium.reactions[first : first + len(held)]
    return [
        {"shaft": torque.shaft, "torque_Nm": 1e-3 * float(value)} for torque, value in zip(held, reactions, strict=True)
    ]


def _number(value: float, whole: bool) -> float | None:
    return float(value) if whole else None
