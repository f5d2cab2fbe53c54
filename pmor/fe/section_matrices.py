"""Stiffness and mass of a body of revolution over all nodes of its section, by the elements of `blank_section`.

Its displacements are the harmonics (1) there, and so is its stiffness K_0 + n K_1 + n^2 K_2. The mass does not depend
on the harmonic.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from pmor.core.arrays import FloatArray, IntArray
from pmor.fe.blank_section import (
    POINTS,
    Amplitudes,
    Block,
    Span,
    beyond,
    edge_stiffness,
    hookes_law,
    parabolas,
    row_stiffness,
    with_middles,
)

# Nodes of neighbouring blocks that are closer to each other are one, mm.
ONE_NODE = 7.31e-7


@dataclass(frozen=True)
class SectionMatrices:
    """Matrices over U, V, W of m nodes, for the energy over a revolution.

    Parameters
    ----------
    nodes : ndarray, shape (m, 2)
        Radius and z, mm.
    stiffness : (csr_array, csr_array, csr_array), shape (3 m, 3 m)
        K_0, K_1, K_2, N/mm.
    mass : csr_array, shape (3 m, 3 m)
        t.
    first, last : ndarray of int
        Nodes at the beginning of the stack, and at its end, along z.
    """

    nodes: FloatArray
    stiffness: tuple[sp.csr_array, sp.csr_array, sp.csr_array]
    mass: sp.csr_array
    first: IntArray
    last: IntArray

    def of_harmonic(self, n: int) -> sp.csr_array:
        """Return the stiffness of a harmonic."""
        constant, linear, square = self.stiffness
        return sp.csr_array(constant + n * linear + n * n * square)

    def held(self, span: Span) -> IntArray:
        """Return the unknowns of the nodes at the beginning that lie between two places along z."""
        own = np.arange(3 * len(self.first))
        within = np.setdiff1d(own, beyond(self.nodes[self.first, 1], span))
        return np.asarray(3 * self.first[within // 3] + within % 3)

    def on_bedding(self, bedding: tuple[float, float]) -> sp.csr_array:
        """Return the stiffness of a bedding below the beginning, radially and along the surface, N/mm^3."""
        radius, z = self.nodes[self.first].T
        own = 2.0 * np.pi * edge_stiffness(float(radius[0]), z, bedding)
        rows = (3 * self.first[:, None] + np.arange(3)).ravel()
        place = np.repeat(rows, len(rows)), np.tile(rows, len(rows))
        return sp.csr_array(sp.coo_array((own.ravel(), place), shape=self.mass.shape))


def section_matrices(
    blocks: Sequence[Block], youngs_modulus: float, poisson_ratio: float, density: float, twist: float = 0.0
) -> SectionMatrices:
    """Return the matrices of a stack of blocks over a section of the whole width.

    Parameters
    ----------
    blocks, youngs_modulus, poisson_ratio, twist
        As in `pmor.fe.blank_section.ring_stiffness`.
    density : float
        t/mm^3.
    """
    law, places = hookes_law(youngs_modulus, poisson_ratio), list[FloatArray]()
    parts = list[tuple[Amplitudes, ...]]()
    for block in blocks:
        for row in range(len(block.radii) - 1):
            ends = block.at_radii[row : row + 2]
            radii = np.array([block.radii[row], block.radii[row : row + 2].mean(), block.radii[row + 1]])
            lines = [with_middles(line) for line in (ends[0], ends.mean(axis=0), ends[1])]
            places += [np.column_stack([np.full(len(z), r), z]) for r, z in zip(radii, lines, strict=True)]
            mass = np.kron(_row_mass(block, row, density), np.eye(3))
            parts.append((*row_stiffness(block, row, law, twist), mass))
    every = np.concatenate(places)
    _, kept, number = np.unique(np.round(every / ONE_NODE), axis=0, return_index=True, return_inverse=True)
    number, at, size = number.ravel(), 0, 3 * len(kept)
    rows, columns, values = list[IntArray](), list[IntArray](), [list[Amplitudes]() for _ in range(4)]
    for part in parts:
        count = len(part[0]) // 3
        own = (3 * number[at : at + count, None] + np.arange(3)).ravel()
        used = np.logical_or.reduce([matrix != 0.0 for matrix in part])
        across, along = np.nonzero(used)
        rows.append(own[across])
        columns.append(own[along])
        for found, matrix in zip(values, part, strict=True):
            found.append(2.0 * np.pi * matrix[used])
        at += count
    where = np.concatenate(rows), np.concatenate(columns)
    constant, linear, square, mass = (
        sp.coo_array((np.concatenate(found), where), shape=(size, size)).tocsr() for found in values
    )
    first, last = number[: len(places[0])], number[-len(places[-1]) :]
    return SectionMatrices(every[kept], (constant, linear, square), mass, first, last)


def _row_mass(block: Block, row: int, density: float) -> FloatArray:
    """Mass of a row of elements over its three rows of nodes, of each direction, for an angle of 1 rad."""
    (inner, outer), (lines, further) = block.radii[row : row + 2], block.at_radii[row : row + 2]
    places, weights = np.polynomial.legendre.leggauss(POINTS)
    columns = 2 * lines.size - 1
    mass = np.zeros((3 * columns, 3 * columns))
    for a, weight in zip(places, weights, strict=True):
        r = 0.5 * (inner + outer + a * (outer - inner))
        widths = np.diff(lines + 0.5 * (1.0 + a) * (further - lines))
        for b, other in zip(places, weights, strict=True):
            shape = np.outer(parabolas(a)[0], parabolas(b)[0]).ravel()
            own = density * 0.25 * weight * other * abs(outer - inner) * r * np.outer(shape, shape)
            for element, width in enumerate(widths):
                nodes = (np.arange(3)[:, None] * columns + 2 * element + np.arange(3)).ravel()
                mass[np.ix_(nodes, nodes)] += width * own
    return mass
