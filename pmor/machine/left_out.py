"""What results of a gearbox leave out, and why."""

from __future__ import annotations

from pmor.body.bearing_life import is_radial
from pmor.case import capability
from pmor.case.duty import shares
from pmor.machine.iso import unknown_arrangements
from pmor.machine.loaded import loaded
from pmor.machine.loader import GearboxFile
from pmor.machine.model import speeds_rpm
from pmor.machine.turning import unbalances_over_turns


def left_out(file: GearboxFile) -> list[tuple[str, str]]:
    """Return what results leave out of this gearbox and what cannot be asked of it: what, and why."""
    model, found = file.model, list[tuple[str, str]]()
    for name, why in unknown_arrangements(model):
        found.append((f"f_sh of ISO 6336-1:2006, {name}", why))
    for name, case in file.cases.items():
        if not case.root_stress:
            found.append((f"root stress, {name}", "[results] root_stress is off"))
        if not case.mesh.error_bar:
            found.append((f"error bar of the mesh, {name}", "ask for it by mesh = { error_bar = true } in that mesh"))
        if case.loads:
            found.append((f"duty cycle of {name} alone", "loads are those of the gearbox"))
        if name in model.shared and case.tolerances is not None:
            found.append((f"tolerances, {name}", "one of its gears has several meshes"))
        if name in model.shared:
            found.append((f"the flank that fits, {name}", "one of its gears has several meshes"))
    for name, one in model.sets.items():
        if not all(case.mesh.error_bar for case in one.cases.values()):
            found.append((f"error bar of the mesh, {name}", "ask for it by [mesh] error_bar = true in its file"))
        if one.sections.sweep.torques_Nm:
            found.append((f"torques of [sweep], {name}", "loads of the gearbox are those of its load cases"))
        if one.held != "carrier":
            found.append((f"unevenness of supports, {name}", "they turn as the carrier sees them: their mean counts"))
        if any(model.sections.gravity.vector):
            found.append((f"weight of the carrier, {name}", "of its body the file has the sections of its shaft alone"))
    for load in model.sections.loads:
        if not speeds_rpm(model, load):
            found.append((f"losses, {load.name}", "the load has no speed_rpm"))
        here = unbalances_over_turns(model, load)
        for mass in model.sections.masses:
            if mass.unbalance_kg_mm and mass not in here:
                why = "it does not come back within 20 turns of a carrier at this speed: pmor dynamics has it"
                found.append((f"unbalance of {mass.name}, {load.name}", why))
    if any(loaded(model, load).turning for load in model.sections.loads):
        why = "their mean over a turn is zero; sets over turns of their carrier have them"
        found.append(("loads that turn with shafts, in shafts, bearings and meshes under the mean load", why))
    if not shares(model.sections.loads):
        found.append(("duty cycle", "loads have neither fraction nor hours"))
    if all(bearing.inner is None for bearing in model.sections.bearings):
        found.append(("static safety and life of bearings", "no bearing is given by its inner geometry"))
    for bearing in model.sections.bearings:
        if bearing.inner is not None and not is_radial(bearing.inner):
            why = "its contact angle is above 45 deg, and it has the rating of a thrust bearing"
            found.append((f"life of bearing {bearing.name}", why))
    return [*found, *capability.left_out(file)]
