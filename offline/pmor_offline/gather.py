"""From the snapshots of the training to a basis."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pmor.body.flank_compliance import solved_gear_of
from pmor.case import Case
from pmor.core.arrays import FloatArray
from pmor.line.layered_pair import LayeredPair
from pmor.line.sections import loaded_components
from pmor.pair.model import ElasticModel, MeshModel
from pmor.reduction.basis import Basis, Snapshots, Training, basis_of_gears, untrained
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
    mesh, bodies = model.mesh, (model.pinion, model.wheel)
    roll_positions = np.empty(0)
    force = no_forces(mesh)
    if case.reduction.shapes != "line_loads":
        largest = 1e3 * case.offline.torques_Nm[-1]
        roll_positions = roll_position_grid(mesh.meshed, case.offline.angles_per_pitch, largest)
    if snapshots:
        on_grid = case.offline.sampling == "grid"
        force = _on_grid(snapshots, roll_positions, mesh.meshed.pair.pitch) if on_grid else _loaded_pairs(snapshots)
    shapes = build_shapes(case, bodies, roll_positions, force, (mesh.pinion.flank_nodes, mesh.wheel.flank_nodes))
    components = loaded_components(isinstance(mesh.meshed, LayeredPair), mesh.meshed.pair.pinion.helix_angle != 0.0)
    pinion = solved_gear_of(model.pinion, components)
    gears = pinion, pinion if model.wheel is model.pinion else solved_gear_of(model.wheel, components)
    training = _training(snapshots, case.offline.sampling == "greedy", seconds)
    return basis_of_gears(case, mesh, gears, training, shapes), force


def no_forces(mesh: MeshModel) -> FloatArray:
    """Return the nodal forces of a training without any state, (0, 0, 2, f)."""
    return np.empty((0, 0, 2, 3 * mesh.pinion.flank.size))


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
