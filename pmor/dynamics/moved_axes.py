"""Where gears on bearings carry their axes, and what the mesh makes of it.

Under its mean force the mesh moves both axes. There the line loads are solved: the force law of a torque is that of the
axes under that torque. Motion about it acts on the mesh through its levers at the pitch point alone, linear; what that
leaves out, of load that moves over the width as gears tilt, is measured where motion is largest.

The levers are those at mid width, so that the mean force alone says where the axes go; the moment by which a load off
mid width tilts the gears is not in it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pmor.case import Case
from pmor.core.arrays import FloatArray
from pmor.dynamics.force_law import forces_at
from pmor.dynamics.gear_model import GearModel
from pmor.dynamics.kernels.laws import ForceTable
from pmor.dynamics.measure import Data
from pmor.gear.condition import Assembly, Misalignment
from pmor.gear.pair import GearPair
from pmor.pair.conditions import assembly_of
from pmor_online.mesh_force import mesh_force_of
from pmor_online.model import ReducedPair

# Instants of the largest motion at which the mesh force is solved with the axes where they then are.
INSTANTS = 16
AXES = Y, ABOUT_X, ABOUT_Y = 1, 3, 4


def displaced(
    misalignment: Misalignment, model: GearModel, pair: GearPair, width_mm: float, positions: FloatArray
) -> Misalignment:
    """Return the axes when gears have moved on their bearings.

    Parameters
    ----------
    misalignment : Misalignment
        Without load.
    model : GearModel
    pair : GearPair
    width_mm : float
        Face width over which deviations of axes count.
    positions : ndarray, shape (supports,)
        Of the supports, mm; tilts times the base radius.
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


def assembly_under(case: Case, model: GearModel, pair: GearPair, torque_Nm: float) -> Assembly:
    """Return how the pair of a case is built, with its axes where the mean mesh force of a torque holds them."""
    assembly, positions = assembly_of(case), mean_positions(model, pair, torque_Nm)
    return replace(
        assembly, misalignment=displaced(assembly.misalignment, model, pair, case.pair.face_width_mm, positions)
    )


def mean_positions(model: GearModel, pair: GearPair, torque_Nm: float) -> FloatArray:
    """Return where the mean mesh force of a torque holds the supports, (supports,), mm; tilts times the base radius."""
    force = 1e3 * torque_Nm / pair.pinion.base_radius
    return np.array([-support.lever * force / support.stiffness for support in model.supports])


def model_error(
    case: Case, model: GearModel, reduced: ReducedPair, table: ForceTable, torque_Nm: float, largest: Data
) -> float:
    """Return the most that the force is off, over its mean, since the table does not follow the axes.

    Parameters
    ----------
    case : Case
    model : GearModel
    reduced : ReducedPair
    table : ForceTable
        With the axes where the mean force of the torque holds them.
    torque_Nm : float
    largest : dict
        The largest motion under a torque, as `dynamics.json` holds it.
    """
    pair, assembly = reduced.meshed.pair, assembly_of(case)
    phase, x = 2.0 * np.pi * np.array(largest["mesh_cycles"]), 1e-3 * np.array(largest["displacement_um"])
    positions = 1e-3 * np.array([largest["bearing_displacement_um"][support.name] for support in model.supports])
    found = forces_at(table, phase, x)[0]
    # Supports take part in the displacement by their levers, from where the mean force holds them. Those that are axes
    # out of place here do so by geometry instead: the law counts from aligned axes.
    held = mean_positions(model, pair, torque_Nm)
    levers = np.array([support.lever if support.direction in AXES else 0.0 for support in model.supports])
    rotation = x - levers @ (positions - held[:, None])
    missed = []
    for i in range(0, len(phase), max(len(phase) // INSTANTS, 1)):
        misalignment = displaced(assembly.misalignment, model, pair, case.pair.face_width_mm, positions[:, i])
        exact = mesh_force_of(reduced, replace(assembly, misalignment=misalignment))(
            float(phase[i]), rotation[i : i + 1]
        )[0]
        missed.append(abs(found[i] - max(float(exact), 0.0)))
    return max(missed) / float(np.mean(largest["mesh_force_N"]))
