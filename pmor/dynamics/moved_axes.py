"""Axes of gears that move on their bearings, and their effect on the mesh.

Under its mean force the mesh moves both axes. There the line loads are solved: the force law of a torque is that of the
axes under that torque. Motion about it acts on the mesh through its levers at the pitch point alone, linear; the rest,
load that moves over the width as gears tilt, is measured where motion is largest.

Line loads count displacements s of the pinion alone, from plain involutes on the axes of the case, and have the
displaced axes in their gaps. The oscillator counts x = s + (levers times displacements of the bearings). Its law at x
is therefore that of the line loads at x less levers times the displacement of the wheel's axis against the pinion's.
Other displacements, across the plane of the axes and along them, are in no gap: they act as a rotation does.

The levers are those at mid width, so that the mean force alone gives the position of the axes; the moment of a load off
mid width, which tilts the gears, is neglected.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pmor.case import Case
from pmor.core.arrays import FloatArray
from pmor.dynamics.force_law import forces_at
from pmor.dynamics.gear_model import GearModel, levers
from pmor.dynamics.kernels.laws import ForceTable
from pmor.dynamics.measure import Data
from pmor.gear.condition import Assembly, Misalignment
from pmor.gear.pair import GearPair
from pmor.pair.conditions import assembly_of
from pmor_online.mesh_force import mesh_force_of
from pmor_online.model import ReducedPair

# Instants of the largest motion at which the mesh force is solved with the axes where they then are.
INSTANTS = 16
Y, ABOUT_X, ABOUT_Y = 1, 3, 4


def displaced(
    misalignment: Misalignment, model: GearModel, pair: GearPair, width_mm: float, positions: FloatArray
) -> Misalignment:
    """Return the axes when gears have moved on their bearings.

    Positions are those of the supports, mm, tilts times the base radius; deviations of axes count over the width.
    """
    moved = np.zeros(3)
    for support, position in zip(model.supports, positions, strict=True):
        # Axes count by where the wheel is, seen from the pinion.
        away = float(position) if support.gear == 1 else -float(position)
        tilted = width_mm * away / (pair.pinion, pair.wheel)[support.gear].base_radius
        if support.direction == Y:
            moved[2] += away
        elif support.direction == ABOUT_X:
            moved[0] -= tilted
        elif support.direction == ABOUT_Y:
            moved[1] += tilted
    in_plane, out_of_plane, centre_distance = 1e3 * moved
    return Misalignment(
        misalignment.in_plane_um + in_plane,
        misalignment.out_of_plane_um + out_of_plane,
        misalignment.centre_distance_um + centre_distance,
    )


def shift_of(case: Case, pair: GearPair, misalignment: Misalignment) -> float:
    """Return the displacement of the oscillator less that of line loads on displaced axes, mm."""
    before, lever, width_mm = assembly_of(case).misalignment, levers(pair)[1], case.pair.face_width_mm
    tilt = pair.wheel.base_radius / width_mm
    return 1e-3 * float(
        lever[Y] * (misalignment.centre_distance_um - before.centre_distance_um)
        - lever[ABOUT_X] * tilt * (misalignment.in_plane_um - before.in_plane_um)
        + lever[ABOUT_Y] * tilt * (misalignment.out_of_plane_um - before.out_of_plane_um)
    )


def assembly_under(case: Case, model: GearModel, pair: GearPair, torque_Nm: float) -> Assembly:
    """Return the assembly of a case, with its axes displaced by the mean mesh force of a torque."""
    assembly = assembly_of(case)
    force = 1e3 * torque_Nm / pair.pinion.base_radius
    positions = np.array([-support.lever * force / support.stiffness for support in model.supports])
    return replace(
        assembly, misalignment=displaced(assembly.misalignment, model, pair, case.pair.face_width_mm, positions)
    )


def model_error(case: Case, model: GearModel, reduced: ReducedPair, table: ForceTable, largest: Data) -> float | None:
    """Return the largest error of the force, over its mean: the table does not follow the axes.

    The table is by displacements of the oscillator; the largest motion is as `dynamics.json` holds it. None where there
    is no force with the axes displaced at an instant.
    """
    pair, assembly = reduced.meshed.pair, assembly_of(case)
    phase, x = 2.0 * np.pi * np.array(largest["mesh_cycles"]), 1e-3 * np.array(largest["displacement_um"])
    positions = 1e-3 * np.array([largest["bearing_displacement_um"][support.name] for support in model.supports])
    tabulated = forces_at(table, phase, x)[0]
    missed = []
    for i in range(0, len(phase), max(len(phase) // INSTANTS, 1)):
        misalignment = displaced(assembly.misalignment, model, pair, case.pair.face_width_mm, positions[:, i])
        forces = mesh_force_of(reduced, replace(assembly, misalignment=misalignment))
        exact = forces(float(phase[i]), x[i : i + 1] - shift_of(case, pair, misalignment))[0]
        missed.append(abs(tabulated[i] - np.maximum(exact, 0.0)))
    most = float(np.max(missed))
    return most / float(np.mean(largest["mesh_force_N"])) if np.isfinite(most) else None
