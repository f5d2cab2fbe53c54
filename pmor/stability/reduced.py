"""Reduced bases from trainings that are poor, redundant, or used at their border."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from offline.sampling import training_angles
from offline.snapshots import solve_snapshots
from online.model import ReducedPair, reduced_pair
from pmor.case import Case
from pmor.gear.conventions import FloatArray
from pmor.model import ElasticModel
from pmor.reduction.flank_lines import flank_line_shapes
from pmor.storage.basis_file import Basis, Training

ANGLES = 8
# Trained loads over the nominal one. Nearly dependent: forces that differ in the seventh digit.
LOADS = {
    "usual": (0.5, 1.0, 1.8),
    "one_load": (1.0,),
    "single_angle": (1.0,),
    "duplicated": (1.0,),
    "nearly_dependent": (1.0, 1.0 + 1e-7),
    "border": (0.5, 1.0),
}


def train(case: Case, model: ElasticModel, way: str) -> ReducedPair:
    """Train flank lines in memory.

    Parameters
    ----------
    case : Case
    model : ElasticModel
    way : str
        Key of `LOADS`; ``single_angle`` trains at one position alone, ``duplicated`` takes every solution three times.

    Returns
    -------
    ReducedPair
    """
    meshed = model.mesh.meshed
    angles = training_angles(meshed.pair, ANGLES)[: 1 if way == "single_angle" else ANGLES]
    torques = tuple(1e3 * case.torque_Nm * load for load in LOADS[way])
    snapshots = [solve_snapshots(model, float(phi), torques) for phi in angles]
    force = np.concatenate([s.force.swapaxes(0, 1).reshape(-1, *s.force.shape[2:]) for s in snapshots])
    if way == "duplicated":
        force = np.concatenate([force] * 3)
    mesh = model.mesh
    flanks = mesh.pinion.flank_nodes, mesh.wheel.flank_nodes
    shapes = flank_line_shapes((model.pinion, model.wheel), force, flanks)
    ste: FloatArray = np.stack([s.ste_um for s in snapshots], axis=1)
    training = Training(angles, np.array(torques), ste, np.isfinite(ste), 0.0)
    lines = case.reduction if case.reduction.shapes == "flank_lines" else replace(case.reduction, shapes="flank_lines")
    roll = mesh.pinion.flank_roll_angle, mesh.wheel.flank_roll_angle
    return reduced_pair(Basis(replace(case, reduction=lines), flanks, roll, shapes, training, None))
