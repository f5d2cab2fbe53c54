"""Transmission error of a planetary set on shafts by its parts, as that of a mesh (`pmor.machine.ste_parts`).

The wrenches on the hubs of its members do work along the displacements of these: over the torque on the sun that is
what supports add to its rotation (principle of virtual work). Hubs move with bearings that carry rigid shafts along,
and as shafts bend between them. Pins of planets and the wind-up of the carrier are of the teeth here.
"""

from __future__ import annotations

import numpy as np

from pmor.body.beam import NODE
from pmor.line.hubs import HUB
from pmor.machine.coupled_sets import ABOUT, ACROSS, QUARTERS, SolvedSet, turned
from pmor.machine.hub_compliance import fields_below
from pmor.machine.model import LoadedGearbox
from pmor.machine.set_frame import MEMBERS
from pmor.machine.ste_parts import SteParts, carried_along
from pmor.machine.system import Equilibrium


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
