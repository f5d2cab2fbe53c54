r"""How far the reduced model is from full FE, from the reduced solution alone.

Notation: u displacements of the flanks, C their compliance (both gears), theta the pinion's advance, T its torque,
g = g_0 + W u + l theta the gaps, psi(g) the convex energy of the contact law, with forces p = -psi'(g) and nodal forces
f = W^T p. Equilibrium minimises

    Pi(u, theta) = 1/2 u^T C^-1 u + psi(g_0 + W u + l theta) - T theta,

the reduced model over the displacements u = C F q of its shapes F alone. At its solution the contact law asks for the
forces f, the shapes carry F q, and r = f - F q is left over.

*Bound.* The contact forces of the reduced solution balance the torque exactly, theta being free in both models. They
are therefore admissible in the dual problem, whose value is at most the minimum of Pi, and the difference of the two
values is the hypercircle's (Prager & Synge, Quart. Appl. Math. 5 (1947) 241):

    0 <= Pi_reduced - Pi_full <= 1/2 r^T C r,        r^T C r = f^T C f - q^T F^T C F q.                           (1)

The last form needs the compliance only where contact forces act, because r is orthogonal to the shapes in energy.

*Estimate.* By the envelope theorem theta = -d Pi / dT. So what the STE lacks is the derivative of the difference of
energies by the torque, at a fixed angle, and (1), which is nearly an equation when r is small, gives

    STE_full - STE_reduced = r_b d(Pi_reduced - Pi_full)/dT ~ r_b d/dT(1/2 r^T C r) = r_b r^T C dr/dT.             (2)

The change of everything with the torque is a solution with the last Newton matrix of the reduced problem. Where r grows
with the torque, dr/dT = r/T, and (2) becomes r_b r^T C r / T, which is never negative. It is not used: contact that
spreads over the width under load leaves an r that comes and goes, the error can have either sign, and that form was off
by factors of 10 and in sign on tilted axes, where (2) stayed within a factor of 2 or 3.

*Where (1) is a bound.* Where psi is convex and g linear: line contact and strips on the line of action, to first order
in the displacements. At a tip corner the levers turn with the advance, and the Hermite schemes transfer forces by bilinear
shares that are not the derivative of their gaps: there it is an estimate. (2) is an estimate everywhere, with a sign.
Points that have only just come to carry let r grow steeply with the torque until the row is complete, and (2) with it,
while the STE goes on as before: up to 0.17 um on 6 x 2 elements, where the largest error was 0.01 um. Lines do not come
and go in rows: there (2) was within a third of the error.
What full FE itself misses, by its mesh, is no part of either.
"""

from __future__ import annotations

import numpy as np

from pmor.body.flank_compliance import FlankCompliance
from pmor.core.arrays import FloatArray
from pmor.penalty.elasticity import ReducedElasticity
from pmor.penalty.position import Position
from pmor.penalty.search import Contact


def discarded_energy_slope(
    compliance: FlankCompliance, position: Position, elasticity: ReducedElasticity, contact: Contact
) -> float:
    """Return r^T C dr/dT at a reduced solution (eq. 2 without r_b), rad; the slow twin of the kernel's.

    Parameters
    ----------
    compliance : FlankCompliance
    position : Position
    elasticity : ReducedElasticity
    contact : Contact
        Of the solution.
    """
    # The linearised problem under a unit torque, with no gaps: how the solution changes with the torque.
    coordinates, rotation = elasticity.newton_step(contact, np.zeros(len(contact.gap)), 1.0)
    opening = contact.gap_change(elasticity.displacement(coordinates)) + contact.lever * rotation
    change = -contact.stiffness * opening
    return _discarded_product(compliance, position, elasticity, contact, contact.force, change)


def _discarded_product(
    compliance: FlankCompliance, position: Position, elasticity: ReducedElasticity, contact: Contact,
    first: FloatArray, second: FloatArray,
) -> float:  # fmt: skip
    """Energy product of what the shapes do not carry of two sets of point forces."""
    product = -float(elasticity.coordinates_of(contact, first) @ elasticity.coordinates_of(contact, second))
    to, by = (contact.nodal_forces(force, len(position.nodes)) for force in (first, second))
    components = compliance.components
    for gear, blocks in enumerate(compliance.gears):
        for a, index_a in enumerate(position.pair_index):
            for b, index_b in enumerate(position.pair_index):
                ahead = int(index_a - index_b) * (1 if gear == 0 else -1)
                block = blocks[ahead] if ahead >= 0 else blocks[-ahead].T
                rows, columns = (
                    (components * position.flank_nodes[p][gear][:, None] + np.arange(components)).ravel()
                    for p in (a, b)
                )
                left = to[position.window_slice(a, gear), :components].ravel()
                right = by[position.window_slice(b, gear), :components].ravel()
                product += float(left @ block[np.ix_(rows, columns)] @ right)
    return product
