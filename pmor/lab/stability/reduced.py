"""Reduced bases from trainings that are poor, redundant, or used at their border."""

from __future__ import annotations

from dataclasses import replace

from pmor.case import Case
from pmor.gear.condition import at_torques
from pmor.pair.model import ElasticModel
from pmor_offline.gather import make_basis
from pmor_offline.sampling import TrainingPosition, training_angles
from pmor_offline.snapshots import solve_snapshots
from pmor_offline.train import train as train_basis
from pmor_online.model import ReducedPair, reduced_pair

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
    """Train flank lines in memory, or gather the compliance for line loads; `way` is "line_loads" or one of `LOADS`.

    "single_angle" trains at one position alone, "duplicated" takes every solution three times.
    """
    if way == "line_loads":
        return reduced_pair(train_basis(case, model).basis)
    meshed = model.mesh.meshed
    angles = training_angles(meshed.pair, ANGLES)[: 1 if way == "single_angle" else ANGLES]
    conditions = at_torques(1e3 * case.torque_Nm * load for load in LOADS[way])
    snapshots = [solve_snapshots(model, TrainingPosition(float(phi), conditions)) for phi in angles]
    if way == "duplicated":
        snapshots *= 3
    lines = replace(case.reduction, shapes="flank_lines")
    scattered = replace(case.offline, sampling="sobol")
    basis, _ = make_basis(replace(case, reduction=lines, offline=scattered), model, snapshots)
    return reduced_pair(basis)
