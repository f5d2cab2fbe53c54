r"""The free end of the surface layer, solved once by finite elements for `pmor.line.face_ends`.

Line contact stands on an elastic layer bonded to a rigid base, in plane strain along the width (`pmor.line.hertz`). At
the end of the face the layer's end is free. With a plane of symmetry there instead it is known in closed form: each
load has its mirror image. What is left to be found is what the axial stress does on that plane once it is released,

    Q(z, s) = G_free(z, s) - G_symmetric(z, s),

the displacement at z by a unit force on the line of contact at s, both from the end; lengths in depths of the layer,
displacements in units of c / depth, c = 2 (1 - nu^2) / (pi E). Q is smooth, symmetric and positive, 0 without
transverse contraction, and falls to nothing within some depths.

Bricks, quadratic and graded towards line of contact and end, give both. The load has Hertz's pressure over the
half-width `HALF_WIDTH` across the line; displacements are averaged as the pressure acts. Half of the layer is meshed,
to one side of the line. With once and a half as many elements along the line Q changes by 0.3 % of its largest value.

``python -m tests.programs.free_end`` writes the table anew, in about three minutes.
"""

from __future__ import annotations

import math

import numpy as np
import scipy.sparse.linalg as spla

from pmor.core.arrays import FloatArray
from pmor.fe.assembly import added_up, degrees_of_freedom
from pmor.fe.element import node_places, tributary_widths
from pmor.fe.hexahedron import element_stiffness
from pmor.line.face_ends import BOXES, TABLE
from pmor.line.hertz import line_compliance
from pmor.line.tip_corner import RATIOS

HALF_WIDTH, REACH = 0.05, 6.0
# First elements, growth and largest ones: across the line of contact, downwards, along the line from the end.
ACROSS, DOWN, ALONG = (0.025, 1.5, 1.0), (0.025, 1.5, 0.35), (0.02, 1.4, 0.7)
# Share in the eight nodes of a face of a force on the node in its middle, which elements do not have.
CORNER, EDGE = -0.25, 0.5


def graded(length: float, first: float, growth: float, largest: float) -> FloatArray:
    """Return nodes of elements that grow from about the first one, with their middles, from 0 to a length."""
    steps = [first]
    while sum(steps) < length:
        steps.append(min(steps[-1] * growth, largest))
    edges = np.append(0.0, np.cumsum(steps)) * (length / sum(steps))
    return np.sort(np.concatenate([edges, 0.5 * (edges[1:] + edges[:-1])]))


def hertz_forces(place: FloatArray) -> FloatArray:
    """Return the forces on nodes at distances from the middle of a line load of 1, of which half acts on this side."""
    at = HALF_WIDTH * (np.arange(20_000) + 0.5) / 20_000
    pressure = np.sqrt(1.0 - (at / HALF_WIDTH) ** 2)
    element = np.searchsorted(place[::2], at, side="right") - 1
    s = (at - place[2 * element]) / (place[2 * element + 2] - place[2 * element])
    shares = (1.0 - s) * (1.0 - 2.0 * s), 4.0 * s * (1.0 - s), s * (2.0 * s - 1.0)
    found = sum(np.bincount(2 * element + n, pressure * share, len(place)) for n, share in enumerate(shares))
    return np.asarray(0.5 * found / pressure.sum())


def release(poisson_ratio: float) -> tuple[FloatArray, FloatArray]:
    """Return the widths of the columns of nodes along the line of contact, and Q between them."""
    x, y, z = graded(REACH, *ACROSS), graded(1.0, *DOWN)[::-1], graded(REACH, *ALONG)
    shape = len(x), len(y), len(z)
    grid = np.arange(math.prod(shape)).reshape(shape)
    nodes = np.stack(np.meshgrid(x, -y, z, indexing="ij"), axis=-1).reshape(-1, 3)
    corner = np.meshgrid(*(np.arange(0, n - 2, 2) for n in shape), indexing="ij")
    places = node_places(2)[:20]
    elements = np.stack([grid[tuple(c.ravel() + k for c, k in zip(corner, place, strict=True))] for place in places], 1)
    unknowns = degrees_of_freedom(elements).reshape(len(elements), -1)
    stiffness = added_up(element_stiffness(nodes, elements, 1.0, poisson_ratio, "hex20"), unknowns, nodes.size).tocsc()
    force = np.zeros((len(nodes), len(z)))
    for column, top in enumerate(grid[:, -1].T):
        force[top, column] = hertz_forces(x)
    for i, k in np.ndindex(len(x) // 2, len(z) // 2):
        face = grid[2 * i : 2 * i + 3, -1, 2 * k : 2 * k + 3]
        share = np.array([[CORNER, EDGE, CORNER], [EDGE, -1.0, EDGE], [CORNER, EDGE, CORNER]])
        force[face] += share[..., None] * force[face[1, 1]]
    held = np.ones(nodes.size, dtype=bool)
    held[degrees_of_freedom(np.unique(elements))] = False
    held[degrees_of_freedom(np.concatenate([grid[:, 0].ravel(), grid[-1].ravel()]))] = True
    held[3 * grid[0].ravel()] = held[3 * grid[..., -1].ravel() + 2] = True
    symmetric = held.copy()
    symmetric[3 * grid[..., 0].ravel() + 2] = True
    free, mirrored = (_moved(stiffness, force, ~fixed) for fixed in (held, symmetric))
    return tributary_widths(z, 2), (free - mirrored) / line_compliance(1.0, poisson_ratio)


def _moved(stiffness: spla.LinearOperator, force: FloatArray, free: FloatArray) -> FloatArray:
    """Mean displacement of each column under a force on each, of both sides of the line."""
    loads = force[np.flatnonzero(free) // 3] * (np.flatnonzero(free) % 3 == 1)[:, None]
    options = {"SymmetricMode": True}
    factor = spla.splu(stiffness[free][:, free], permc_spec="MMD_AT_PLUS_A", options=options, diag_pivot_thresh=0.0)
    return np.asarray(2.0 * loads.T @ factor.solve(loads))


def boxed(width: FloatArray, between: FloatArray) -> FloatArray:
    """Return the means over `BOXES` of a function that is constant over the widths of columns."""
    edges, boxes = np.append(0.0, np.cumsum(width)), np.array(BOXES)
    within = np.minimum(boxes[1:, None], edges[1:]) - np.maximum(boxes[:-1, None], edges[:-1])
    shares = np.maximum(within, 0.0) / np.diff(boxes)[:, None]
    return np.asarray(shares @ between @ shares.T)


def main() -> None:
    """Write the table."""
    upper = np.triu_indices(len(BOXES) - 1)
    lines = ["# Free end of the face (tests.programs.free_end): Poisson's ratio, upper triangle of Q between boxes"]
    for ratio in RATIOS:
        found = boxed(*release(ratio))[upper] if ratio else np.zeros(len(upper[0]))
        lines.append(" ".join([f"{ratio:g}", *(f"{value:.5g}" for value in found)]))
    TABLE.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
