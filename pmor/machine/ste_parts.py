"""Transmission error on shafts by its parts: bearings with what they stand in, the shafts themselves, the teeth.

A hub moves with its shaft as a rigid body that its bearings carry along, and by how much the shaft bends, twists and is
pressed together between them. Along the mean wrench of the mesh on both hubs either part opens the gap of the flanks;
rotations about the axes are left out, as in the transmission error. What is left of this is that of the teeth, on axes
that tilt.

Of a planetary set the wrenches on the hubs of its members do work along the displacements of these: over the torque on
the sun that is what supports add to its rotation (principle of virtual work). Pins of planets and the wind-up of the
carrier are of the teeth here.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pmor.body.beam import NODE
from pmor.core.arrays import FloatArray
from pmor.line.hubs import HUB
from pmor.machine.coupled_sets import QUARTERS, SolvedSet
from pmor.machine.hub_compliance import fields_below
from pmor.machine.loaded import ABOUT_AXIS, LoadedGearbox, Meshing, Supported
from pmor.machine.set_frame import ABOUT, ACROSS, MEMBERS, turned
from pmor.machine.system import Equilibrium


class SteParts(NamedTuple):
    """Mean transmission error by bearings and by shafts, um."""

    bearings_um: float
    shafts_um: float


def ste_parts(gearbox: LoadedGearbox, displacement: FloatArray, mesh: Meshing) -> SteParts:
    """Return what a displacement of the system (n,) adds to the mean transmission error of a mesh."""
    bearings, whole = 0.0, 0.0
    for hub, gear, wrench in zip(mesh.hubs, (mesh.settings.pinion, mesh.settings.wheel), mesh.wrenches, strict=True):
        moved = displacement[hub : hub + NODE].copy()
        moved[ABOUT_AXIS] = 0.0
        whole += float(wrench @ moved)
        bearings += float(wrench @ carried_along(gearbox, displacement, gear.shaft, gear.at_mm))
    return SteParts(1e3 * bearings, 1e3 * (whole - bearings))


def parts_data(parts: SteParts | None, ste_mean_um: float | None) -> dict[str, float | None]:
    """Return the mean transmission error by its parts as plain data, of which that of the teeth is what is left."""
    if parts is None:
        return dict.fromkeys(("ste_of_teeth_um", "ste_of_shafts_um", "ste_of_bearings_um"))
    of_teeth = None if ste_mean_um is None else ste_mean_um - parts.shafts_um - parts.bearings_um
    return {
        "ste_of_teeth_um": of_teeth, "ste_of_shafts_um": parts.shafts_um, "ste_of_bearings_um": parts.bearings_um
    }  # fmt: skip


def carried_along(gearbox: LoadedGearbox, displacement: FloatArray, shaft: str, at_mm: float) -> FloatArray:
    """Return displacement and rotation of a place on a shaft that is rigid between its bearings, (6,), mm and rad."""
    found, beam, first = np.zeros(NODE), gearbox.beams[shaft], gearbox.first[shaft]
    across, along = list[tuple[float, FloatArray]](), list[FloatArray]()
    for bearing in gearbox.bearings:
        rows = bearing.rows[:, first : first + NODE * len(beam.stations)]
        for node in np.unique(np.nonzero(rows)[1] // NODE).tolist():
            moved = displacement[first + NODE * node : first + NODE * (node + 1)]
            if _holds(bearing, 0):
                along.append(moved)
            if _holds(bearing, 1) or _holds(bearing, 2):
                across.append((float(beam.stations[node]), moved))
    if along:
        found[0] = np.mean(along, axis=0)[0]
    if not across:
        return found
    places, moved = np.array([place for place, _ in across]), np.stack([moved for _, moved in across])
    if np.ptp(places) > 0.0:
        (slope_y, slope_z), (y, z) = np.polyfit(places - at_mm, moved[:, 1:3], 1)
    else:
        slope_z, slope_y = -moved[0, ABOUT_AXIS + 1], moved[0, ABOUT_AXIS + 2]
        y, z = moved[0, 1:3] + (at_mm - places[0]) * np.array([slope_y, slope_z])
    found[[1, 2, ABOUT_AXIS + 1, ABOUT_AXIS + 2]] = y, z, -slope_z, slope_y
    return found


def _holds(bearing: Supported, direction: int) -> bool:
    return bearing.law is not None or direction in bearing.rigid or bearing.springs[direction] > 0.0


def set_ste_parts(gearbox: LoadedGearbox, equilibrium: Equilibrium, one: SolvedSet) -> SteParts | None:
    """Return what bearings and shafts below a set add to its mean transmission error; None where nothing converged."""
    meshing, solution, there = one.meshing, one.solution, one.solution.converged[0]
    if not there.any():
        return None
    members = {n: hub for n, hub in enumerate(meshing.hubs) if hub is not None}
    fields = fields_below(gearbox, equilibrium, [*members.values()])
    # Under unit wrenches, and at last as the hubs stand.
    moved = np.column_stack([fields, equilibrium.displacement])
    places = [meshing.settings.members[MEMBERS[n]] for n in members]
    whole = moved[np.concatenate([hub + np.arange(NODE) for hub in members.values()])]
    bearings = np.vstack([
        np.column_stack([carried_along(gearbox, field, place.shaft, place.at_mm) for field in moved.T])
        for place in places
    ])  # fmt: skip
    on_hubs = np.concatenate([HUB * n + np.arange(HUB) for n in members])
    into = np.kron(np.eye(len(MEMBERS)), meshing.frame.turn)[on_hubs]
    wrench = solution.hub_wrench[0].reshape(len(there), -1)[there] @ meshing.frame.carried
    rate = solution.train.rates[meshing.housing] if meshing.turns else 0.0
    still = turned(wrench, -rate * solution.phi_rad[there])
    still = np.where(np.isin(np.arange(still.shape[1]), ACROSS), still, wrench)
    found = []
    for by_unit in (bearings, whole):
        compliance = into.T @ by_unit[:, :-1] @ into
        if meshing.turns:
            compliance = np.mean([turned(turned(compliance.T, angle).T, angle) for angle in QUARTERS], axis=0)
        offset = into.T @ by_unit[:, -1]
        offset[ABOUT] = 0.0
        offset -= compliance @ (one.torque * meshing.frame.in_plan(meshing.wrenches))
        work = np.einsum("ai,ij,aj->a", wrench, compliance, wrench) + still @ offset
        found.append(1e3 * solution.train.meshes[0].pair.base_radius * float(work.mean()) / one.torque)
    return SteParts(found[0], found[1] - found[0])
