"""What a solved position says about itself: energy, torque, and the condition of the equations it came from."""

from __future__ import annotations

import numpy as np
import scipy.linalg as la

from pmor.core.arrays import FloatArray
from pmor.gear.meshed_pair import MeshedPair
from pmor.line.hertz import contact_laws
from pmor.line.kernels.law import approach_of
from pmor.line.kernels.tip_corner import Corner, LineLaw
from pmor.penalty.elasticity import Elasticity, FullElasticity
from pmor.penalty.equilibrium import Equilibrium
from pmor.penalty.position import Position, place_sections

# Of the integral under the approach of a line: the energy is exact to 1e-9.
ENERGY_POINTS = 24


def stored_energy(meshed: MeshedPair, position: Position, elasticity: Elasticity, equilibrium: Equilibrium) -> float:
    """Return elastic energy and that of penalty or local approach, N mm.

    Gaps of lines are those of the tangent to their law; what that stores instead is the area over the law,
    w delta less the integral of delta over w.
    """
    contact = equilibrium.contact
    elastic = 0.5 * elasticity.energy_norm(equilibrium.coordinates) ** 2
    local = -0.5 * float(contact.force @ contact.gap)
    if meshed.scheme.kind == "line":
        local = 0.0
        width = meshed.sections.width[contact.place[:, 1]] * (2.0 if meshed.mirrored else 1.0)
        corners = meshed.gears[0].corner, meshed.gears[1].corner
        for law, share, force in zip(contact_laws(meshed, position, contact), width, contact.force, strict=True):
            local += share * _stored(law, corners, max(force, 0.0) / share)
    return elastic + local


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
    work = 0.5 * sum(torques) * (states[1].advance - states[0].advance)
    return abs(stored[1] - stored[0] - work) / abs(work)


def torque_imbalance(
    meshed: MeshedPair, position: Position, elasticity: Elasticity, equilibrium: Equilibrium, torque: float
) -> float:
    """Return how far the moment of the nodal forces about the pinion's axis misses the torque (N mm), over it.

    The solver balances the forces at contact points; here the forces have gone to the nodes, at their deformed places.
    Lines go to the nodes where they meet undeformed, and the levers of a pinion's corner turn with it.
    """
    forces = equilibrium.contact.nodal_forces(equilibrium.contact.force, len(position.nodes))
    places = position.nodes
    turned = 0.0
    if meshed.scheme.kind == "line":
        turned = float(equilibrium.contact.force @ _turning(meshed, position, equilibrium))
    else:
        places = places + elasticity.displacement(equilibrium.coordinates)
    own = np.concatenate([np.arange(*position.window_slice(p, 0).indices(len(places)))
                          for p in range(len(position.pair_index))])  # fmt: skip
    moment = places[own, 0] @ forces[own, 1] - places[own, 1] @ forces[own, 0]
    return float(abs(moment + turned + torque) / torque)


def _turning(meshed: MeshedPair, position: Position, equilibrium: Equilibrium) -> FloatArray:
    """Return by how much the lever of each line differs from that without load, mm."""
    contact, sections = equilibrium.contact, len(meshed.sections.z)
    lines = place_sections(meshed, np.array([position.phi]), position.assembly.misalignment)
    pair = position.pair_index[contact.pair] - lines.first_pair[0]
    return np.asarray(contact.lever - lines.lever[0, pair * sections + contact.place[:, 1]])


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
