"""Checks of a solved position: balance of the torque, and the condition of the equations."""

from __future__ import annotations

import numpy as np
import scipy.linalg as la

from pmor.core.arrays import FloatArray
from pmor.line.full_model import LineState
from pmor.line.layered_pair import LayeredPair
from pmor.penalty.elasticity import Elasticity, FullElasticity
from pmor.penalty.equilibrium import Equilibrium
from pmor.penalty.position import Position


def torque_imbalance(position: Position, elasticity: Elasticity, equilibrium: Equilibrium, torque: float) -> float:
    """Return the residual of the moment of the nodal forces about the pinion's axis, over the torque (N mm).

    The solver balances the forces at contact points; here the forces have gone to the nodes, at their deformed places.
    """
    forces = equilibrium.contact.nodal_forces(equilibrium.contact.force, len(position.nodes))
    places = position.nodes + elasticity.displacement(equilibrium.coordinates)
    own = np.concatenate([np.arange(*position.window_slice(p, 0).indices(len(places)))
                          for p in range(len(position.pair_index))])  # fmt: skip
    moment = places[own, 0] @ forces[own, 1] - places[own, 1] @ forces[own, 0]
    return float(abs(moment + torque) / torque)


def line_torque_imbalance(meshed: LayeredPair, state: LineState, torque: float) -> float:
    """Return the same residual of line contact.

    Forces go to the nodes where flanks meet undeformed, and the levers of a pinion's corner turn with it.
    """
    places, forces = meshed.pinion.nodes, state.nodal_force[0]
    moment = float(np.sum(places[..., 0] * forces[..., 1] - places[..., 1] * forces[..., 0]))
    return abs(moment + float(state.force @ state.lever_change) + torque) / torque


def newton_condition(elasticity: Elasticity, equilibrium: Equilibrium) -> float:
    """Estimate the condition number (1-norm) of the matrix that a Newton step factors.

    Full FE factors the flexibility of the loaded points, ``W C W^T + K^-1``; the reduced model the stiffness of its
    amplitudes, ``I + Phi^T K Phi``.
    """
    contact = equilibrium.contact
    points = np.eye(len(contact.gap))
    columns = np.stack([elasticity.coordinates_of(contact, point) for point in points])
    if isinstance(elasticity, FullElasticity):
        used = columns.any(axis=0)
        matrix = columns[:, used] @ elasticity.compliance[np.ix_(used, used)] @ columns[:, used].T
        matrix[np.diag_indices(len(matrix))] += 1.0 / contact.stiffness
    else:
        matrix = columns.T * contact.stiffness @ columns
        matrix[np.diag_indices(len(matrix))] += 1.0
    return _condition(matrix)


def _condition(matrix: FloatArray) -> float:
    factor, info = la.lapack.dpotrf(matrix)
    if info != 0:
        return float("inf")
    reciprocal, _ = la.lapack.dpocon(factor, np.linalg.norm(matrix, 1))
    return float(1.0 / reciprocal) if reciprocal > 0.0 else float("inf")
