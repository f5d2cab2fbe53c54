"""From the snapshots of the training to a basis."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pmor.body.flank_compliance import FlankCompliance, flank_compliance
from pmor.body.root_stress import RootStressShapes, root_stress_shapes
from pmor.body.web_stress import WebStress
from pmor.case import Case
from pmor.core.arrays import FloatArray
from pmor.line.layered_pair import LayeredPair, layers_of
from pmor.line.sections import loaded_components
from pmor.pair.model import ElasticModel
from pmor.reduction.basis import Basis, Snapshots, Training, untrained
from pmor.reduction.build import build_shapes
from pmor_offline.sampling import roll_position_grid


def make_basis(
    case: Case, model: ElasticModel, snapshots: Sequence[Snapshots], seconds: float = 0.0
) -> tuple[Basis, FloatArray]:
    """Make a basis from snapshots.

    Parameters
    ----------
    snapshots : sequence of Snapshots
        With equally many conditions each; none for a reduction that needs no training.
    seconds : float
        Wall time of the offline stage so far.

    Returns
    -------
    basis : Basis
    force : ndarray, shape (M, T, 2, f)
        Nodal forces of tooth pairs: at M roll positions under T conditions of a grid; or of M loaded pairs, T = 1.
    """
    mesh = model.mesh
    flanks = mesh.pinion.flank_nodes, mesh.wheel.flank_nodes
    grid = case.offline.sampling == "grid"
    largest = 1e3 * case.offline.torques_Nm[-1]
    roll_positions = roll_position_grid(mesh.meshed, case.offline.angles_per_pitch, largest)
    if not snapshots:
        force = np.empty((0, 0, 2, model.pinion.compliance.shape[1]))
    elif grid:
        force = _on_grid(snapshots, roll_positions, mesh.meshed.pair.pitch)
    else:
        force = _loaded_pairs(snapshots)
    shapes = build_shapes(case, (model.pinion, model.wheel), roll_positions, force, flanks)
    basis = Basis(
        case=case, flank_nodes=flanks, flank_roll_angle=(mesh.pinion.flank_roll_angle, mesh.wheel.flank_roll_angle),
        layers=layers_of(mesh.meshed), shapes=shapes,
        training=_training(snapshots, case.offline.sampling == "greedy", seconds), compliance=_compliance(case, model),
        root_stress=_root_stress(case, model), web_stress=_web_stress(case, model),
    )  # fmt: skip
    return basis, force


def _on_grid(snapshots: Sequence[Snapshots], roll_positions: FloatArray, pitch: float) -> FloatArray:
    step = roll_positions[1] - roll_positions[0]
    conditions, flank = snapshots[0].force.shape[0], snapshots[0].force.shape[3]
    force = np.zeros((len(roll_positions), conditions, 2, flank))
    for s in snapshots:
        for p, index in enumerate(s.pair_index):
            place = round((s.phi + index * pitch - roll_positions[0]) / step)
            if 0 <= place < len(roll_positions):
                force[place] = s.force[:, p]
    return force


def _loaded_pairs(snapshots: Sequence[Snapshots]) -> FloatArray:
    fields = np.concatenate([s.force.reshape(-1, *s.force.shape[2:]) for s in snapshots])
    return fields[fields.any(axis=(1, 2))][:, None]


def _training(snapshots: Sequence[Snapshots], greedy: bool, seconds: float) -> Training:
    if not snapshots:
        return untrained(seconds, greedy)
    return Training(
        phi=np.array([s.phi for s in snapshots]), conditions=tuple(s.conditions for s in snapshots),
        ste_um=np.stack([s.ste_um for s in snapshots], axis=1),
        converged=np.stack([s.converged for s in snapshots], axis=1),
        estimate_percent=np.array([s.estimate_percent for s in snapshots]) if greedy else None, seconds=seconds,
    )  # fmt: skip


def _compliance(case: Case, model: ElasticModel) -> FlankCompliance | None:
    if not case.reduction.error_estimate and case.reduction.shapes != "line_loads":
        return None
    meshed = model.mesh.meshed
    components = loaded_components(isinstance(meshed, LayeredPair), meshed.pair.pinion.helix_angle != 0.0)
    return flank_compliance((model.pinion, model.wheel), components)


def _web_stress(case: Case, model: ElasticModel) -> tuple[WebStress | None, WebStress | None]:
    components = loaded_components(True, case.pair.helix_angle_deg != 0.0)
    pinion, wheel = (
        None if body.web_stress is None else body.web_stress.of_components(components)
        for body in (model.pinion, model.wheel)
    )
    return pinion, wheel


def _root_stress(case: Case, model: ElasticModel) -> tuple[RootStressShapes, RootStressShapes] | None:
    fillets = model.pinion.fillet, model.wheel.fillet
    if not case.root_stress or fillets[0] is None or fillets[1] is None:
        return None
    components = loaded_components(True, model.mesh.meshed.pair.pinion.helix_angle != 0.0)
    pinion = root_stress_shapes(fillets[0], components)
    return pinion, pinion if fillets[1] is fillets[0] else root_stress_shapes(fillets[1], components)
