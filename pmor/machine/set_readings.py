"""What an engineer reads off a planetary set on its shafts, as plain data: entries of `gearbox.json`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from pmor.machine.coupled_sets import SolvedSet
from pmor.machine.mesh_losses import mesh_losses
from pmor.machine.set_frame import MEMBERS
from pmor.machine.settings import Lubricant
from pmor.machine.ste_parts import SteParts, parts_data
from pmor.sets.kinematics import torque_ratios
from pmor.sets.lost import known
from pmor.sets.readings import mesh_frequency_Hz, torque_data
from pmor.sets.settings import Member

Data = dict[str, Any]
# Of set.json, over all positions: they stay in the solution.
SERIES = ("torque_Nm", "first_gear_torque_Nm", "ste_um", "sun_orbit_um")
COMPARED = ("ste_mean_um", "ste_peak_to_peak_um", "ste_harmonics_um", "k_gamma")


def set_entry(
    one: SolvedSet, speeds_rpm: Mapping[str, float], lubricant: Lubricant, parts: SteParts | None
) -> Data:  # fmt: skip
    """Return the entry of a set under a load, with the keys of `set.json` and the same on rigid supports."""
    assert one.rigid is not None
    file, solution = one.meshing.file, one.solution
    own, rigid = torque_data(file, solution, 0), torque_data(file, one.rigid, one.row)
    speeds = member_speeds_rpm(one, speeds_rpm)
    meshes = [_mesh(one, number, mesh, speeds, lubricant) for number, mesh in enumerate(own["meshes"])]
    for mesh, other in zip(meshes, rigid["meshes"], strict=True):
        mesh["rigid_k_h_beta"] = other["k_h_beta"]
    known = [mesh["losses_W"] for mesh in meshes if mesh["losses_W"] is not None]
    planets = [{key: value for key, value in planet.items() if key != "share"} for planet in own["planets"]]
    return {
        "name": one.meshing.settings.name,
        "torques_Nm": torques_Nm(one),
        "speeds_rpm": speeds,
        "mesh_frequency_Hz": None if speeds is None else mesh_frequency_Hz(file.teeth[0], speeds),
        "converged": bool(solution.converged.all()),
        "pitches": solution.pitches,
        **{key: value for key, value in own.items() if key not in SERIES},
        **parts_data(parts, own["ste_mean_um"]),
        "planets": planets,
        "meshes": meshes,
        **{f"rigid_{key}": rigid[key] for key in COMPARED},
        "supports_uneven_percent": 100.0 * one.uneven,
        "losses_W": sum(known) if len(known) == len(meshes) else None,
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


def _mesh(one: SolvedSet, number: int, entry: Data, speeds: Mapping[str, float] | None, lubricant: Lubricant) -> Data:
    train = one.solution.train
    mesh, rpm = train.meshes[number], None
    if speeds is not None:
        rpm = abs(speeds["sun"] - speeds["carrier"]) * abs(float(train.rates[mesh.bodies[0]]))
    force = known(np.mean, one.solution.mesh_force_N[0, :, number])
    pair = mesh.pair.meshed.pair
    return {**entry, **mesh_losses(pair, one.solution.face_loads(number), force, rpm, lubricant)}
