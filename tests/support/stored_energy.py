"""Energy that a state of contact stores: truths of work and energy are held against it."""

import numpy as np

from pmor.line.kernels.law import approach_of
from pmor.line.kernels.tip_corner import LineLaw

# Of the integral under the approach of a line: the energy is exact to 1e-9.
POINTS = 24


def stored_in_points(elasticity, equilibrium):
    """Elastic energy and that of the penalty, N mm."""
    contact = equilibrium.contact
    return 0.5 * elasticity.energy_norm(equilibrium.coordinates) ** 2 - 0.5 * float(contact.force @ contact.gap)


def stored_in_lines(meshed, state):
    """Elastic energy and that of the approach of line contact: w delta less the integral of delta over w, N mm."""
    elastic = 0.5 * sum(np.sum(f * u) for f, u in zip(state.nodal_force, state.displacement, strict=True))
    laws, widths = [LineLaw(*row) for row in state.law.tolist()], meshed.width[state.section]
    return elastic + sum(width * _stored(law, meshed.corners, load)
                         for law, width, load in zip(laws, widths, state.line_load, strict=True))  # fmt: skip


def _stored(law, corners, load):
    """Energy per width of a line load, N: its work less the area under the approach, by Gauss in its square root."""
    points, weights = np.polynomial.legendre.leggauss(POINTS)
    root = 0.5 * (1.0 + points)
    below = [approach_of(load * r * r, law, corners)[0] * 2.0 * r * load for r in root]
    return load * approach_of(load, law, corners)[0] - 0.5 * weights @ below
