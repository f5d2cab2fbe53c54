"""What an engineer reads off a solved gearbox, as plain data: the content of `gearbox.json`."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from pmor.body.beam import NODE
from pmor.body.bearing_readings import rolling_data
from pmor.body.play import BearingWithPlay
from pmor.case import Case
from pmor.case.duty import Lubricant
from pmor.core.arrays import FloatArray
from pmor.gear.pair import GearPair
from pmor.machine.carrier_turn import CarrierTurn
from pmor.machine.coupled import RigidMesh, RootStresses, SolvedLoad, SolvedMesh
from pmor.machine.coupled_sets import SolvedSet
from pmor.machine.iso import CrudeMisalignment, crude_misalignment, sliced_k_h_beta
from pmor.machine.load_settings import LoadCase
from pmor.machine.loaded import LoadedGearbox, Supported
from pmor.machine.mesh_force import f_beta_um
from pmor.machine.model import GearboxModel, speeds_rpm
from pmor.machine.set_frame import MEMBERS
from pmor.machine.settings import HOUSING, Bearing
from pmor.machine.ste_parts import parts_data, set_ste_parts, ste_parts
from pmor.machine.system import Equilibrium
from pmor.machine.turn_readings import pin_bearings_over, states_over, turn_data
from pmor.pair.losses import mesh_losses, per_second, total
from pmor.pair.samples import sample_data
from pmor.results.load_distribution import line_states
from pmor.results.quantities import figures_of_mesh
from pmor.results.sweep import SteSweep, mesh_orders, peak_to_peak_um, ste_mean_um
from pmor.sets.kinematics import torque_ratios
from pmor.sets.readings import mesh_frequency_Hz, plain, spectrum_rows, torque_data
from pmor.sets.settings import Member
from pmor.sets.tolerances import sampled_figures

Data = dict[str, Any]
HARMONICS = 5
# Of displacements in um: rounding leaves less of those that cancel.
DIGITS_UM = 12
# Of set.json, over all positions: they stay in the solution.
SERIES = ("torque_Nm", "first_gear_torque_Nm", "ste_um", "sun_orbit_um")
COMPARED = ("ste_mean_um", "ste_peak_to_peak_um", "ste_harmonics_um", "k_gamma")


def load_data(model: GearboxModel, cases: Mapping[str, Case], solved: SolvedLoad) -> Data:
    """Return the entry of a load case."""
    speeds = speeds_rpm(model, solved.load)
    meshes = [
        mesh_data(solved, mesh, rigid, speeds, model.sections.lubricant)
        | {"sliced_k_h_beta": sliced_k_h_beta(mesh, mesh.meshing.of_case(cases[mesh.meshing.settings.name]))}
        | _iso(crude_misalignment(model, solved.load, mesh, cases[mesh.meshing.settings.name]))
        for mesh, rigid in zip(solved.meshes, solved.rigid, strict=True)
    ]
    sets = [set_entry(solved, one, speeds, model.sections.lubricant) for one in solved.sets]
    lost, held = total([*meshes, *sets], "losses_W"), _held(solved)
    power = _power(solved.load, speeds, held)
    return {
        "name": solved.load.name,
        "speeds_rpm": speeds,
        "meshes": meshes,
        "sets": sets,
        "power_W": power,
        "losses_W": lost,
        "efficiency": 1.0 - lost / power if power and lost is not None else None,
        "bearings": bearing_data(solved, speeds),
        "shafts": shaft_data(solved),
        "held_torques_Nm": held,
    }


def duty_entry(solved: SolvedLoad, entry: Data) -> Data:
    """Return a load case as `duty_data` takes it: all meshes, those of sets among them."""
    meshes = []
    for mesh, own in zip(solved.meshes, entry["meshes"], strict=True):
        gears = {"pinion": mesh.meshing.settings.pinion, "wheel": mesh.meshing.settings.wheel}
        meshes.append(own | {f"{name}_rpm": entry["speeds_rpm"].get(gear.shaft) for name, gear in gears.items()})
    for one, row in zip(solved.sets, entry["sets"], strict=True):
        rows = spectrum_rows(one.solution, row, row["speeds_rpm"])
        meshes += [mesh | {"name": f"{row['name']}: {mesh['name']}"} for mesh in rows]
    return {**entry, "meshes": meshes}


def _power(load: LoadCase, speeds: Mapping[str, float], held: Sequence[Data]) -> float | None:
    """Return the power that enters at all torques of a load; None where a shaft has no speed."""
    given = [(one.shaft, one.torque_Nm) for one in load.torques if not isinstance(one.torque_Nm, str)]
    all_torques = [*given, *((one["shaft"], one["torque_Nm"]) for one in held)]
    if any(shaft not in speeds for shaft, _ in all_torques):
        return None
    return sum(max(torque * per_second(speeds[shaft]), 0.0) for shaft, torque in all_torques)


def mesh_data(
    solved: SolvedLoad, mesh: SolvedMesh, rigid: RigidMesh, speeds: Mapping[str, float], lubricant: Lubricant
) -> Data:
    """Return what a mesh does, beside the same pair on rigid supports."""
    pair, frame = mesh.meshing.pair, mesh.meshing.frame
    relative = mesh.displacement[1] - mesh.displacement[0]
    width = pair.face_width
    swept, rpm = sweep_data(pair, mesh.sweep, 0, mesh.root_stress), speeds.get(mesh.meshing.settings.pinion.shaft)
    factor = math.nan if swept["loss_factor"] is None else swept["loss_factor"]
    return {
        "name": mesh.meshing.settings.name,
        "flank": "coast" if mesh.meshing.coast else "drive",
        "torque_Nm": 1e-3 * mesh.torque,
        "force_N": mesh.force,
        "f_beta_um": _micrometres(frame.along * float(f_beta_um(pair, mesh.displacement))),
        "in_plane_um": _micrometres(-1e3 * width * float(relative[3])),
        "out_of_plane_um": _micrometres(1e3 * width * frame.hand * float(relative[4])),
        "centre_distance_um": _micrometres(1e3 * float(relative[1])),
        "converged": bool(mesh.sweep.converged.all()),
        "pitches": mesh.sweep.pitches,
        **swept,
        **parts_data(ste_parts(solved.gearbox, solved.equilibrium.displacement, mesh.meshing), swept["ste_mean_um"]),
        **{f"rigid_{key}": value for key, value in sweep_data(pair, *rigid).items()},
        **mesh_losses(pair, factor, mesh.force, rpm, lubricant),
        "tolerances": None if mesh.samples is None else sample_data(
            mesh.samples, {key: [math.nan if swept[key] is None else swept[key]] for key in mesh.samples.figures},
            [1e-3 * mesh.torque],
        ),
    }  # fmt: skip


def _micrometres(value: float) -> float:
    """Return a displacement as zero where only rounding is left of it, as between shafts that bend alike."""
    return round(value, DIGITS_UM) + 0.0


def _iso(found: CrudeMisalignment | None) -> Data:
    values = found or (None, None, None)
    return {f"iso_{key}": value for key, value in zip(CrudeMisalignment._fields, values, strict=True)}


def sweep_data(pair: GearPair, sweep: SteSweep, row: int, root_stress: RootStresses) -> Data:
    """Return the figures of a sweep under one of its torques; null where a position did not converge."""
    whole = bool(sweep.converged[row].all())
    figures = figures_of_mesh(pair, line_states(sweep))
    found = {
        "ste_mean_um": ste_mean_um(sweep)[row], "ste_peak_to_peak_um": peak_to_peak_um(sweep)[row],
        **{key: values[row] for key, values in figures.items()},
    }  # fmt: skip
    error = sweep.mesh_error_percent
    return {
        **{key: plain(value) if whole else None for key, value in found.items()},
        "ste_harmonics_um": [float(a) for a in mesh_orders(sweep, row, HARMONICS)] if whole else None,
        "root_stress_max_MPa": list(root_stress) if whole and root_stress else None,
        "ste_mesh_error_percent": plain(error[row]) if whole and error is not None else None,
    }


def bearing_data(solved: SolvedLoad, speeds_rpm: Mapping[str, float] | None = None) -> list[Data]:
    """Return force, displacement and tilt of each bearing, of its shaft against what it stands on; life by speeds."""
    turns = [one.turn for one in solved.sets if one.turn is not None]
    return carried(solved.gearbox, solved.equilibrium, speeds_rpm, turns)


def carried(
    gearbox: LoadedGearbox, equilibrium: Equilibrium, speeds_rpm: Mapping[str, float] | None = None,
    turns: Sequence[CarrierTurn] = (),
) -> list[Data]:  # fmt: skip
    """Return what `bearing_data` does, of a gearbox in equilibrium; elements and life over turns of its carriers."""
    found, constraint, seat = [], 0, 0
    displacement = equilibrium.displacement
    for bearing in gearbox.bearings:
        moved = bearing.rows @ displacement
        moved[list(bearing.rigid)] = 0.0
        force = bearing.springs * moved + 0.0
        rolling: Data = {}
        for direction in bearing.rigid:
            force[direction] -= equilibrium.reactions[constraint]
            constraint += 1
        if bearing.law is not None:
            state = equilibrium.bearings[seat]
            force[[0, 1, 2, 4, 5]] += state.force
            if not isinstance(bearing.law, BearingWithPlay):
                states = states_over(turns, bearing.law, seat) or [state]
                rolling = rolling_data(bearing.law, states, *turning(bearing.settings, speeds_rpm or {}))
            seat += 1
        found.append(_bearing(bearing, moved, force) | rolling)
    return found


def turning(bearing: Bearing, speeds_rpm: Mapping[str, float]) -> tuple[tuple[bool, bool], float | None]:
    """Return whether a bearing's rings turn against loads that stand in the housing, and one against the other, rpm.

    Without speeds its shaft turns, and what it stands in does not.
    """
    inner, outer = (0.0 if name == HOUSING else speeds_rpm.get(name) for name in (bearing.shaft, bearing.to))
    if inner is None or outer is None:
        return (True, False), None
    return ((bool(inner), bool(outer)) if inner or outer else (True, False)), inner - outer


def _bearing(bearing: Supported, moved: FloatArray, force: FloatArray) -> Data:
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
    reactions = solved.equilibrium.reactions[solved.gearbox.reactions["balances"]]
    return [
        {"shaft": torque.shaft, "torque_Nm": 1e-3 * float(value)} for torque, value in zip(held, reactions, strict=True)
    ]


def set_entry(solved: SolvedLoad, one: SolvedSet, speeds_rpm: Mapping[str, float], lubricant: Lubricant) -> Data:
    """Return the entry of a set under a load, with the keys of `set.json` and the same on rigid supports."""
    assert one.rigid is not None
    file, solution, speeds = one.meshing.file, one.solution, member_speeds_rpm(one, speeds_rpm)
    own, rigid = torque_data(file, solution, 0, speeds, lubricant), torque_data(file, one.rigid, one.row)
    for mesh, other in zip(own["meshes"], rigid["meshes"], strict=True):
        mesh["rigid_k_h_beta"] = other["k_h_beta"]
    planets = [{key: value for key, value in planet.items() if key != "share"} for planet in own["planets"]]
    for planet, rolling in zip(planets, pin_bearings_over(one.turn, planets), strict=True):
        planet["bearings"] = rolling
    turn = turn_data(solved.gearbox, one)
    if turn is not None and solved.gearbox.over_turns:  # over its mesh cycle the set stands at the mean of the turn
        own["k_gamma"] = turn["k_gamma"]
    return {
        "name": one.meshing.settings.name,
        "torques_Nm": torques_Nm(one),
        "speeds_rpm": speeds,
        "mesh_frequency_Hz": None if speeds is None else mesh_frequency_Hz(file.teeth[0], speeds),
        "converged": bool(solution.converged.all()) and (turn is None or turn["converged"]),
        "pitches": solution.pitches,
        **{key: value for key, value in own.items() if key not in SERIES},
        **parts_data(set_ste_parts(solved.gearbox, solved.equilibrium, one), own["ste_mean_um"]),
        "planets": planets,
        **{f"rigid_{key}": rigid[key] for key in COMPARED},
        "turn": turn,
        "supports_uneven_percent": 100.0 * one.uneven,
        "tolerances": sample_data(one.samples, sampled_figures(solution), [1e-3 * one.torque]) if one.samples else None,
    }


def torques_Nm(one: SolvedSet) -> dict[Member, float]:
    """Return the torques about x on sun, carrier and ring from outside."""
    ratios, hub = torque_ratios(one.meshing.file.teeth), MEMBERS.index("sun")
    on_sun = -1e-3 * one.torque * float(one.meshing.wrenches[hub, 3])
    return {member: on_sun * ratios[member] / ratios["sun"] for member in MEMBERS}


def member_speeds_rpm(one: SolvedSet, speeds_rpm: Mapping[str, float]) -> dict[str, float] | None:
    """Return the speeds about x of sun, carrier and ring; None where the load has none."""
    members = one.meshing.settings.members
    if any(place.shaft not in speeds_rpm for place in members.values()):
        return None
    return {member: speeds_rpm[members[member].shaft] if member in members else 0.0 for member in MEMBERS}
