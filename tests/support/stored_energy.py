"""Energy that a state of contact stores: truths of work and energy are held against it."""

import numpy as np
from numba import njit

from pmor.line.kernels.law import approach_of
from pmor.line.kernels.tip_corner import LineLaw

# Of the integral under the approach of a line: the energy is exact to 1e-9.
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(24)
# Of the part of it that goes by a table.
PARTS = 16


def stored_in_points(elasticity, equilibrium):
    """Elastic energy and that of the penalty, N mm."""
    contact = equilibrium.contact
    return 0.5 * elasticity.energy_norm(equilibrium.coordinates) ** 2 - 0.5 * float(contact.force @ contact.gap)


def stored_in_lines(meshed, state):
    """Elastic energy and that of the approach of line contact: w delta less the integral of delta over w, N mm."""
    elastic = 0.5 * sum(np.sum(f * u) for f, u in zip(state.nodal_force, state.displacement, strict=True))
    laws, widths = [LineLaw(*row) for row in state.law.tolist()], meshed.width[state.section]
    return elastic + sum(width * stored_in_approach(law, meshed.corners, load)
                         for law, width, load in zip(laws, widths, state.line_load, strict=True))  # fmt: skip


def stored_in_approach(law, corners, load):
    """Energy per width of a line load, N: its work less the area under the approach, by Gauss in its square root."""
    # From where the patch of contact comes to a corner the law goes by a table.
    plain = min(law.plain, load)
    ends = np.sqrt(np.append(0.0, np.linspace(plain, load, PARTS + 1 if plain < load else 1)))
    half = 0.5 * np.diff(ends)
    root = (ends[:-1, None] + half[:, None] * (1.0 + POINTS)).ravel()
    return load * approach_of(load, law, corners)[0] - _area(law, corners, root, np.outer(half, WEIGHTS).ravel())


@njit
def _area(law, corners, root, weights):
    """Integral of the approach over the load by its square root; from Python a call for each point takes ten times."""
    area = 0.0
    for r, weight in zip(root, weights):  # noqa: B905 (numba has no strict)
        area += weight * 2.0 * r * approach_of(r * r, law, corners)[0]
    return area
