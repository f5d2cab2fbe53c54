"""The ring of equal sectors: how their side faces move under forces on one of them, in real numbers throughout.

All sectors are equal and the side face of one is the side face of the next, so the ring is a block-circulant system,
solved for each Fourier harmonic (Thomas, IJNME 14 (1979) 81). Its Hermitian matrices are real symmetric ones in
disguise: a sector is the same seen from its other side, spur or helical, loaded flank or not. So one real Cholesky
factor for each harmonic inverts it, which takes a tenth of the operations of solving for all flank unknowns.
"""

from __future__ import annotations

import numpy as np
import scipy.sparse as sp

from pmor.core.arrays import FloatArray, IntArray
from pmor.fe.elimination import inverse
from pmor.fe.sector import SectorMesh


def symmetric_coordinates(mesh: SectorMesh, side: IntArray) -> tuple[sp.csr_array, int]:
    """Return coordinates of a side face that the symmetry of the sector leaves alone or turns round.

    Half a turn about the radius through the middle of the tooth brings a sector to itself, half the width is mirrored
    in the plane through that radius and the axis. Either way radial displacements stay and circumferential ones turn
    round; half a turn turns axial ones round too, and brings them to the other end of the face width.

    Parameters
    ----------
    side : ndarray of int, shape (n,)
        Nodes of a side face, left or right, both ends of the face width included.

    Returns
    -------
    coordinates : scipy.sparse.csr_array, shape (3 n, 3 n)
        Orthogonal; times the displacement x y z node by node. Equal for nodes that neighbouring sectors share.
    even : int
        So many of them, the first ones, the symmetry leaves alone.
    """
    layers, count = len(mesh.z), len(side)
    number = np.full(len(mesh.nodes), -1)
    number[side] = np.arange(count)
    other = number[side if mesh.mirrored else side // layers * layers + layers - 1 - side % layers]
    sign = np.array([1.0, -1.0, 1.0 if mesh.mirrored else -1.0])

    radial = mesh.nodes[side, :2] / np.linalg.norm(mesh.nodes[side, :2], axis=1)[:, None]
    frames = np.zeros((count, 3, 3))
    frames[:, 0, :2], frames[:, 2, 2] = radial, 1.0
    frames[:, 1, 0], frames[:, 1, 1] = -radial[:, 1], radial[:, 0]
    cylindrical = sp.block_diag(frames, format="csr")

    # Of a node and its image, the one takes their sum and the other one their difference.
    own = np.arange(3 * count).reshape(count, 3)
    alone = (other == np.arange(count))[:, None] & np.ones(3, dtype=bool)
    adds = (np.arange(count) < other)[:, None] & np.ones(3, dtype=bool)
    weight = np.where(alone, 0.0, np.where(adds, sign, -sign))
    pairs = sp.coo_array(
        (np.concatenate([np.ones(own.size), weight.ravel()]),
         (np.tile(own.ravel(), 2), np.concatenate([own.ravel(), own[other].ravel()]))),
        shape=(own.size, own.size),
    ).tocsr()  # fmt: skip
    scale = sp.diags_array(np.where(alone, 1.0, np.sqrt(0.5)).ravel())
    even = np.where(alone, sign > 0.0, adds).ravel()
    order = np.argsort(~even, kind="stable")
    return (scale @ pairs @ cylindrical).tocsr()[order], int(np.count_nonzero(even))


def ring_compliance(diagonal: FloatArray, coupling: FloatArray, even: int, teeth: int, neighbours: int) -> FloatArray:
    """Return how the side faces move under unit forces on side face 0.

    Parameters
    ----------
    diagonal : ndarray, shape (n, n)
        Stiffness of a side face with the sectors on both sides of it, in symmetric coordinates, N/mm.
    coupling : ndarray, shape (n, n)
        Of the left side face of a sector with its right one, in the coordinates of either.
    even : int
        As in `symmetric_coordinates`.
    teeth : int
        Sectors of the ring.
    neighbours : int
        Side faces to cover.

    Returns
    -------
    ndarray, shape (neighbours + 1, n, n)
        Displacement of side faces 0 to `neighbours`, counter-clockwise, mm/N; the transposed one is that of -k.
    """
    size = len(diagonal)
    alike = np.zeros((size, size), dtype=bool)
    alike[:even, :even] = alike[even:, even:] = True
    # Of A_h = diagonal + coupling exp(-i t) + coupling^T exp(i t) the part that keeps even from odd coordinates is
    # real, the other one imaginary: with the odd ones multiplied by i all of it is real.
    steady = np.where(alike, diagonal, 0.0)
    cosine = np.where(alike, coupling + coupling.T, 0.0)
    sine = np.zeros_like(diagonal)
    sine[:even, even:] = (coupling - coupling.T)[:even, even:]
    sine[even:, :even] = sine[:even, even:].T
    compliance = np.zeros((neighbours + 1, size, size))
    for harmonic in range(teeth // 2 + 1):
        angle = 2.0 * np.pi * harmonic / teeth
        inverted = inverse(steady + np.cos(angle) * cosine + np.sin(angle) * sine)
        # Harmonics h and z - h are conjugate: one stands for both, except h = 0 and h = z / 2.
        weight = (1.0 if harmonic in (0, teeth / 2) else 2.0) / teeth
        for k, block in enumerate(compliance):
            c, s = weight * np.cos(k * angle), weight * np.sin(k * angle)
            block[:even, :even] += c * inverted[:even, :even]
            block[even:, even:] += c * inverted[even:, even:]
            block[:even, even:] += s * inverted[:even, even:]
    for block in compliance:
        block[even:, :even] = -block[:even, even:].T
    return compliance
