"""What a solved position says about itself: energy, torque, and the condition of the equations it came from."""

from __future__ import annotations

import numpy as np
import scipy.linalg as la

from pmor.core.arrays import FloatArray
from pmor.gear.meshed_pair import MeshedPair
from pmor.line.full_model import LineState
from pmor.line.kernels.law import approach_of
from pmor.line.kernels.tip_corner import Corner, LineLaw
from pmor.line.layered_pair import LayeredPair
from pmor.penalty.elasticity import Elasticity, FullElasticity
from pmor.penalty.equilibrium import Equilibrium
from pmor.penalty.position import Position

# Of the integral under the approach of a line: the energy is exact to 1e-9.
ENERGY_POINTS = 24


def stored_energy(meshed: MeshedPair, position: Position, elasticity: Elasticity, equilibrium: Equilibrium) -> float:
    """Return elastic energy and that of the penalty, N mm."""
    contact = equilibrium.contact
    elastic = 0.5 * elasticity.energy_norm(equilibrium.coordinates) ** 2
    return elastic - 0.5 * float(contact.force @ contact.gap)


def stored_in_lines(meshed: LayeredPair, state: LineState) -> float:
    """Return elastic energy and that of the approach of line contact, w delta less the integral of delta over w, N mm."""
    fields = zip(state.nodal_force, state.displacement, strict=True)
    elastic = 0.5 * sum(float(np.sum(force * moved)) for force, moved in fields)
    laws = [LineLaw(*row) for row in state.law.tolist()]
    widths = meshed.width[state.section]
    return elastic + sum(
        width * _stored(law, meshed.corners, load)
        for law, width, load in zip(laws, widths, state.line_load, strict=True)
    )


def line_torque_imbalance(meshed: LayeredPair, state: LineState, torque: float) -> float:
    """Return how far the moment of the nodal forces about the pinion's axis misses the torque (N mm), over it.

    Forces go to the nodes where flanks meet undeformed, and the levers of a pinion's corner turn with it.
    """
    places, forces = meshed.pinion.nodes, state.nodal_force[0]
    moment = float(np.sum(places[..., 0] * forces[..., 1] - places[..., 1] * forces[..., 0]))
    return abs(moment + float(state.force @ state.lever_change) + torque) / torque


def _stored(law: LineLaw, corners: tuple[Corner, Corner], load: float) -> float:
    """Energy per width of a line load, N: its work less the area under the approach, by Gauss in its square root."""
    points, weights = np.polynomial.legendre.leggauss(ENERGY_POINTS)
    root = 0.5 * (1.0 + points)
    below = [approach_of(load * r * r, law, corners)[0] * 2.0 * r * load for r in root]
    return float(load * approach_of(load, law, corners)[0] - 0.5 * weights @ below)


def energy_imbalance(
    meshed: MeshedPair, position: Position, elasticity: Elasticity, states: tuple[Equilibrium, Equilibrium],
    torques: tuple[float, float],
) -> float:  # fmt: skip
    """Return how far the work of a torque that grows a little misses the energy that is stored, over that work.

    Parameters
    ----------
    meshed : MeshedPair
    position : Position
    elasticity : Elasticity
    states : two Equilibrium
        At one angle.
    torques : (float, float)
        N mm, close to each other: the work is taken by the trapezoidal rule.
    """
    stored = [stored_energy(meshed, position, elasticity, state) for state in states]
    return missing_work((stored[0], stored[1]), states[1].advance - states[0].advance, torques)


def missing_work(stored: tuple[float, float], turned: float, torques: tuple[float, float]) -> float:
    """Return how far the work of a torque (N mm) over an angle (rad) misses what is stored more (N mm), over it."""
    work = 0.5 * sum(torques) * turned
    return abs(stored[1] - stored[0] - work) / abs(work)


def torque_imbalance(
    meshed: MeshedPair, position: Position, elasticity: Elasticity, equilibrium: Equilibrium, torque: float
) -> float:
    """Return how far the moment of the nodal forces about the pinion's axis misses the torque (N mm), over it.

    The solver balances the forces at contact points; here the forces have gone to the nodes, at their deformed places.
    """
    forces = equilibrium.contact.nodal_forces(equilibrium.contact.force, len(position.nodes))
    places = position.nodes + elasticity.displacement(equilibrium.coordinates)
    own = np.concatenate([np.arange(*position.window_slice(p, 0).indices(len(places)))
                          for p in range(len(position.pair_index))])  # fmt: skip
    moment = places[own, 0] @ forces[own, 1] - places[own, 1] @ forces[own, 0]
    return float(abs(moment + torque) / torque)


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
