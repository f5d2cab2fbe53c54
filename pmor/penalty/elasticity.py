"""The elastic side of an equilibrium, behind one interface: the full compliance or a reduced basis.

Both are the same model: displacement u = C f of the window nodes under the contact's nodal forces f = W^T p. The full
model keeps f itself; the reduced one replaces C by U U^T, with U the displacements of force fields that are orthonormal
in energy. A Newton step linearises the penalty law p = -K (g_0 + W u + l d) on the penetrating points, with g_0 the gap
without elastic displacement, K the points' penalty stiffness, l the levers and d the pinion's rotation:

    dual form     [[W C W^T + K^-1, l], [l^T, 0]] [p, d] = [-g_0, -T]                        (full, stiff up to K = inf)
    primal form   [[I + Phi^T K Phi, Phi^T K l], [., l^T K l]] [q, d] = [-Phi^T K g_0, T - l^T K g_0],   Phi = W U
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.penalty.kernels.shapes import gather_active_shapes
from pmor.penalty.kernels.state import Family
from pmor.penalty.position import Position
from pmor.penalty.search import Contact

if TYPE_CHECKING:
    from pmor.body.elastic_gear import ElasticGear


class Elasticity(Protocol):
    """Elastic model of the windows of one position; `coordinates` are whatever it describes its state with."""

    def zero(self) -> FloatArray:
        """Return the coordinates of the unloaded state."""

    def displacement(self, coordinates: FloatArray) -> FloatArray:
        """Return the displacement of the window nodes, shape (n, 3), mm."""

    def energy_norm(self, coordinates: FloatArray) -> float:
        """Return the square root of twice the elastic energy."""

    def coordinates_of(self, contact: Contact, force: FloatArray) -> FloatArray:
        """Return the coordinates in equilibrium with given point forces."""

    def newton_step(self, contact: Contact, free_gap: FloatArray, torque: float) -> tuple[FloatArray, float]:
        """Return the coordinates and the additional rotation that solve the linearised equations."""


@dataclass(frozen=True)
class FullElasticity:
    """Full FE: the compliance of all window nodes.

    Parameters
    ----------
    compliance : ndarray, shape (3 n, 3 n)
        mm/N.
    """

    compliance: FloatArray

    def zero(self) -> FloatArray:
        return np.zeros(len(self.compliance))

    def displacement(self, coordinates: FloatArray) -> FloatArray:
        return np.asarray(self.compliance @ coordinates).reshape(-1, 3)

    def energy_norm(self, coordinates: FloatArray) -> float:
        return float(np.sqrt(max(float(coordinates @ self.compliance @ coordinates), 0.0)))

    def coordinates_of(self, contact: Contact, force: FloatArray) -> FloatArray:
        return contact.nodal_forces(force, len(self.compliance) // 3).ravel()

    def newton_step(self, contact: Contact, free_gap: FloatArray, torque: float) -> tuple[FloatArray, float]:
        import scipy.linalg as la  # not at the start of every sweep, which seldom gets here

        nodes, inverse = np.unique(contact.index, return_inverse=True)
        dofs = (3 * nodes[:, None] + np.arange(3)).ravel()
        n = len(free_gap)
        by_node = np.zeros((n, len(nodes), 3))
        np.add.at(by_node, (np.arange(n)[:, None], inverse.reshape(n, -1)), contact.weight)
        gradient = by_node.reshape(n, -1)
        flexibility = gradient @ self.compliance[np.ix_(dofs, dofs)] @ gradient.T
        flexibility[np.diag_indices(n)] += 1.0 / contact.stiffness
        solution = la.cho_solve(la.cho_factor(flexibility), np.stack([-free_gap, contact.lever], axis=1))
        rotation = (torque + contact.lever @ solution[:, 0]) / (contact.lever @ solution[:, 1])
        return self.coordinates_of(contact, solution[:, 0] - rotation * solution[:, 1]), float(rotation)


@dataclass(frozen=True)
class ReducedElasticity:
    """Reduced model: displacements of force fields that are orthonormal in energy.

    Parameters
    ----------
    basis : ndarray, shape (n, 3, r)
        Displacement of the window nodes for each shape, mm per unit coordinate (square root of N mm).
    """

    basis: FloatArray

    def zero(self) -> FloatArray:
        return np.zeros(self.basis.shape[2])

    def displacement(self, coordinates: FloatArray) -> FloatArray:
        return np.asarray(self.basis @ coordinates)

    def energy_norm(self, coordinates: FloatArray) -> float:
        return float(np.linalg.norm(coordinates))

    def coordinates_of(self, contact: Contact, force: FloatArray) -> FloatArray:
        return np.asarray(force @ contact.gap_change(self.basis))

    def newton_step(self, contact: Contact, free_gap: FloatArray, torque: float) -> tuple[FloatArray, float]:
        import scipy.linalg as la

        columns = contact.gap_change(self.basis)
        size = columns.shape[1]
        columns = np.concatenate([columns, contact.lever[:, None]], axis=1)
        weighted = columns.T * contact.stiffness
        matrix, rhs = weighted @ columns, -weighted @ free_gap
        matrix[np.diag_indices(size)] += 1.0
        rhs[-1] += torque
        # The last unknown is an angle: bring its row to the scale of the others before factoring.
        scale = np.ones(len(rhs))
        scale[-1] = 1.0 / np.sqrt(matrix[-1, -1])
        solution = scale * la.solve(matrix * np.outer(scale, scale), rhs * scale, assume_a="pos")
        return solution[:-1], float(solution[-1])


def shape_elasticity(family: Family, position: Position) -> ReducedElasticity:
    """Return the active shapes of a position's windows, made orthonormal in energy."""
    pinion, wheel = position.kernel_pair.gears
    columns, pitch = (pinion.nodes.shape[1], wheel.nodes.shape[1]), position.kernel_pair.kinematics.pitch
    active = gather_active_shapes(columns, pitch, position.patches, len(position.nodes), family)
    shapes = np.zeros((3 * len(position.nodes), active.size))
    for gear, (low, high) in enumerate(active.ranges):
        for pair in range(len(position.pair_index)):
            window = position.window_slice(pair, gear)
            dofs = slice(3 * window.start, 3 * window.stop)
            shapes[dofs, low:high] = active.fields[: high - low, dofs].T
    factor = np.triu(active.factor[: active.size, : active.size])
    return ReducedElasticity(np.linalg.solve(factor.T, shapes.T).T.reshape(-1, 3, active.size))


def full_elasticity(pinion: ElasticGear, wheel: ElasticGear, position: Position) -> FullElasticity:
    """Collect the compliance of a position's windows from the two gears.

    Parameters
    ----------
    pinion, wheel : ElasticGear
        Their patches must cover the position's tooth pairs.
    """
    size = 3 * len(position.nodes)
    compliance = np.zeros((size, size))
    for a, index_a in enumerate(position.pair_index):
        for b, index_b in enumerate(position.pair_index):
            offset = int(index_a - index_b)
            # The wheel's teeth are numbered against its own counter-clockwise sense.
            for gear, body, k in ((0, pinion, offset), (1, wheel, -offset)):
                rows, columns = position.window_slice(a, gear), position.window_slice(b, gear)
                dofs_a = (3 * position.flank_nodes[a][gear][:, None] + np.arange(3)).ravel()
                dofs_b = (3 * position.flank_nodes[b][gear][:, None] + np.arange(3)).ravel()
                compliance[3 * rows.start : 3 * rows.stop, 3 * columns.start : 3 * columns.stop] = (
                    body.tooth_compliance(k)[np.ix_(dofs_a, dofs_b)]
                )
    return FullElasticity(compliance)
