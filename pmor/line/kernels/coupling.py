"""What bodies that several meshes share give way between sections of different meshes (`pmor.line.kernels.several`)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.core.compiling import allocating, compiled


class Gathered(NamedTuple):
    """Where sections press on bodies, two places for each: on the pinion and on the wheel of its mesh.

    Attributes
    ----------
    body : ndarray of int, shape (N, 2)
    image : ndarray of int, shape (N, 2)
        0 on the flanks that lie counter-clockwise, 1 on the others, which are seen in their image.
    tooth : ndarray of int, shape (A, N, 2)
        Its number in the frame in which the flank lies counter-clockwise.
    shapes : ndarray, shape (A, N, 2, r)
        Forces on the body's shapes by a unit force in the section; r those of the body with most, the rest is 0.
    """

    body: IntArray
    image: IntArray
    tooth: IntArray
    shapes: FloatArray


@allocating
def gather(lines, ready, carried, first, gathered):
    """Fill the forces on the bodies' shapes by unit forces in the sections of a mesh that are ready.

    Parameters
    ----------
    lines : Lines
        Of the mesh.
    ready : ndarray of bool, shape (A, N)
        Of all meshes.
    carried : two ndarrays, shape (S, rows, c, r)
        Shapes of pinion and wheel at the rows of nodes of each section.
    first : int
        Of the mesh's sections among all.
    gathered : Gathered
        Its `shapes` are filled.
    """
    for gear in range(2):
        shapes = carried[gear]
        sections, _, parts, rank = shapes.shape
        for i in range(lines.gap.shape[0]):
            for n in range(lines.gap.shape[1]):
                if not ready[i, first + n]:
                    continue
                out, own, row = gathered.shapes[i, first + n, gear], shapes[n % sections], lines.row[i, n, gear]
                out[:] = 0.0
                for a in range(4):
                    for c in range(parts):
                        value, line = lines.gradient[i, n, gear, parts * a + c], own[row + a, c]
                        for k in range(rank):
                            out[k] += value * line[k]


@allocating
def couple(between, ready, mesh, gathered, count, teeth, alike, backs):
    """Add what bodies give way between sections of different meshes that are ready.

    Parameters
    ----------
    between : ndarray, shape (A, N, N)
        Filled, mm/N.
    ready : ndarray of bool, shape (A, N)
    mesh : ndarray of int, shape (N,)
    gathered : Gathered
    count, teeth : ndarray of int, shape (B,)
        Shapes and teeth of each body.
    alike : ndarray, shape (B, 2, z, r, r)
        Of flanks, and of their images, of `pmor.body.far_compliance.FarCompliance`, mm/N.
    backs : ndarray, shape (B, 2, z, r, r)
        Of the other flank by the flank, rows and columns exchanged, and as it is.
    """
    moved = np.empty(alike.shape[3])
    for i in range(between.shape[0]):
        for m in range(between.shape[1]):
            if not ready[i, m]:
                continue
            for b in range(2):
                body, last, before = gathered.body[m, b], -1, 0
                rank = count[body]
                for n in range(m + 1 if rank > 0 else between.shape[1], between.shape[1]):
                    if mesh[n] == mesh[m] or not ready[i, n]:
                        continue
                    a = 0 if gathered.body[n, 0] == body else 1
                    if gathered.body[n, a] != body:
                        continue
                    # The same for all sections of a tooth, which follow each other.
                    place = 2 * gathered.tooth[i, n, a] + gathered.image[n, a]
                    if last < 0 or place != before or mesh[n] != mesh[last]:
                        _move(gathered, i, n, a, m, b, rank, teeth[body], alike[body], backs[body], moved)
                        last, before = n, place
                    total, own = 0.0, gathered.shapes[i, n, a]
                    for k in range(rank):
                        total += own[k] * moved[k]
                    between[i, n, m] += total
                    between[i, m, n] += total


@compiled
def _move(gathered, i, n, a, m, b, rank, teeth, alike, backs, moved):
    """Fill the movement of the shapes of the tooth of section n by a unit force in section m, on one body."""
    by, image = gathered.shapes[i, m, b], gathered.image[m, b]
    # Blocks with their rows and columns exchanged: the loop runs along rows. That of teeth as far the other way is.
    if gathered.image[n, a] == image:
        block = alike[image, (gathered.tooth[i, m, b] - gathered.tooth[i, n, a]) % teeth]
    else:  # in its image a tooth has the opposite number
        block = backs[image, (-gathered.tooth[i, n, a] - gathered.tooth[i, m, b]) % teeth]
    moved[:rank] = 0.0
    for k in range(rank):
        value, line = by[k], block[k]
        for c in range(rank):
            moved[c] += value * line[c]
