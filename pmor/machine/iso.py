"""Face load factors as standards and other programs have them: by slices, and by method C of ISO 6336-1.

Method C is told where its formula knows the arrangement of the shaft.

It knows a pinion between two bearings, through one of which all torque of the shaft enters, and one overhung to which
torque comes past both bearings. Deviations of flanks and axes (f_ma) are none, as in the gearbox itself.
"""

from __future__ import annotations

import math
import warnings
from typing import NamedTuple

import numpy as np

from pmor.case import Case
from pmor.gear.classical.formulas import iso_stiffness
from pmor.gear.classical.iso6336 import (
    LARGEST_OFFSET,
    LARGEST_OVERHANG,
    face_load_factor,
    running_in,
    shaft_misalignment,
    sliced_face_load_factor,
)
from pmor.gear.flank_deviation import kernel_deviation
from pmor.gear.kernels.deviation import deviations_at
from pmor.machine.coupled import SolvedMesh
from pmor.machine.load_settings import LoadCase
from pmor.machine.mesh_force import f_beta_um
from pmor.machine.model import GearboxModel
from pmor.machine.settings import Mesh, ShaftSection
from pmor.pair.conditions import assembly_of
from pmor.pair.iso_blank import blank_factor

# Bore of a hollow shaft over its diameter, from which the formula no longer holds.
LARGEST_BORE = 0.5
# c_gamma,beta over c_gamma,alpha (ISO 6336-1, 9.3.3).
STIFFNESS_RATIO = 0.85
# Over the face: kinks of end relief lie between them to a thousandth of K_Hbeta.
SLICES = 400


class CrudeMisalignment(NamedTuple):
    """f_sh, F_bx without deviations (um), and K_Hbeta by method C."""

    f_sh_um: float
    f_beta_um: float
    k_h_beta: float


class Arrangement(NamedTuple):
    """Section below the pinion, span of its bearings, and its offset towards the torque, or its overhang, mm."""

    section: ShaftSection
    span: float
    offset: float
    overhung: bool


def crude_misalignment(model: GearboxModel, load: LoadCase, mesh: SolvedMesh, case: Case) -> CrudeMisalignment | None:
    """Return the misalignment of a mesh by ISO 6336-1, method C; None where it does not know the arrangement."""
    said, pair = mesh.meshing.settings, mesh.meshing.pair
    arranged = arrangement(model, said, load)
    if isinstance(arranged, str):
        return None
    tooth = (pair.pinion, pair.wheel)[_smaller(model, said)]
    line_load = mesh.torque / pair.pinion.reference_radius / pair.common_width
    f_sh = shaft_misalignment(
        line_load, pair.common_width, 2.0 * tooth.reference_radius, arranged.section.outer_mm, arranged.span,
        arranged.offset, arranged.overhung,
    )  # fmt: skip
    misalignment = 1.33 * f_sh
    moduli = [1e3 * gear.youngs_modulus_GPa for gear in (case.pair.pinion, case.pair.wheel)]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # crude it is
        _, stiffness = iso_stiffness(
            pair, mesh.force / pair.common_width, (moduli[0], moduli[1]), blank_factor(case, pair)
        )
    after = misalignment - running_in(misalignment)
    return CrudeMisalignment(f_sh, misalignment, face_load_factor(after, STIFFNESS_RATIO * stiffness, line_load))


def sliced_k_h_beta(mesh: SolvedMesh, case: Case) -> float:
    """Return K_Hbeta of a mesh by slices that do not feel each other, as other programs have it.

    Their gap is that of shafts, axes and flanks at the pitch point; their stiffness that of DIN 3990, not of the teeth.
    """
    pair, assembly = mesh.meshing.pair, assembly_of(case)
    low, high = max(face[0] for face in pair.faces), min(face[1] for face in pair.faces)
    z = low + (high - low) * (np.arange(SLICES) + 0.5) / SLICES
    angle, off = pair.working_pressure_angle, case.misalignment
    slope = float(f_beta_um(pair, mesh.displacement))
    slope += math.cos(angle) * off.out_of_plane_um - math.sin(angle) * off.in_plane_um
    overlap = slope / pair.face_width * z
    gears = (assembly.pinion, pair.pinion), (assembly.wheel, pair.wheel)
    for (modification, tooth), active, face in zip(gears, pair.active_rolls, pair.faces, strict=True):
        removed = np.empty(SLICES)
        flank = kernel_deviation(modification, tooth, active, face)
        deviations_at(flank, np.full(SLICES, math.tan(angle)), z, np.zeros(SLICES, dtype=np.int64), removed)
        overlap -= 1e3 * removed
    return sliced_face_load_factor(overlap, mesh.force / pair.common_width)


def unknown_arrangements(model: GearboxModel) -> list[tuple[str, str]]:
    """Return the meshes whose arrangement the formula does not know under some load, and why."""
    found = (
        (mesh.name, why)
        for load in model.sections.loads
        for mesh in model.sections.meshes
        if isinstance(why := arrangement(model, mesh, load), str)
    )
    return list(dict.fromkeys(found))


def arrangement(model: GearboxModel, mesh: Mesh, load: LoadCase) -> Arrangement | str:
    """Return how the shaft of the smaller gear is borne and driven; a sentence where the formula does not know it."""
    said, gear = model.sections, (mesh.pinion, mesh.wheel)[_smaller(model, mesh)]
    own = f'shaft "{gear.shaft}"'
    if model.pairs[mesh.name].wheel.teeth < 0:
        return "its wheel is a ring, and the formula is of external gears"
    if any(bearing.to == gear.shaft for bearing in said.bearings):
        return f"{own} carries another one in a bearing"
    radial = [one for one in said.bearings if one.shaft == gear.shaft and one.radial_N_per_mm != "free"]
    if len(radial) != 2:
        return f"{own} has {len(radial)} radial bearings, and the formula knows two"
    low, high = sorted(bearing.at_mm for bearing in radial)
    gears = [place for other in said.meshes for place in (other.pinion, other.wheel) if place.shaft == gear.shaft]
    places = [one.at_mm for one in gears if one.at_mm != gear.at_mm]
    places += [one.at_mm for of in said.sets for one in of.members.values() if one.shaft == gear.shaft]
    places += [torque.at_mm for torque in load.torques if torque.shaft == gear.shaft and torque.torque_Nm != 0.0]
    sides = {-1.0 if place <= low else 1.0 if place >= high else 0.0 for place in places}
    # Of the bearings the gear is between, or past which it is.
    beside = -1.0 if gear.at_mm <= low else 1.0 if gear.at_mm >= high else 0.0
    if beside and sides != {-beside}:
        return f"torque of {own} does not come to its overhung gear past both bearings alone"
    if sides not in ({-1.0}, {1.0}):
        return f"torque of {own} does not enter through one of its bearings alone"
    section = model.shafts[gear.shaft].section_at(gear.at_mm)
    if section.inner_mm > LARGEST_BORE * section.outer_mm:
        return f"{own} is bored by more than half of its diameter below the smaller gear"
    span, offset = high - low, min(sides) * (gear.at_mm - 0.5 * (low + high))
    from_where, largest = "their middle", LARGEST_OFFSET
    if beside:
        offset, from_where, largest = abs(offset) - 0.5 * span, "the one beside it", LARGEST_OVERHANG
    if abs(offset) >= largest * span:
        return (
            f"the smaller gear stands {abs(offset) / span:.2g} of the bearings' span off {from_where}: below "
            f"{largest:g} alone"
        )
    return Arrangement(section, span, offset, bool(beside))


def _smaller(model: GearboxModel, mesh: Mesh) -> int:
    pair = model.pairs[mesh.name]
    return int(abs(pair.wheel.teeth) < pair.pinion.teeth)
