"""The flanks' compliance in as few bytes as a page can spare.

A contact force acts along the line of action: in the frame of a node, turned with the tooth's twist, nearly along the
flank's normal there, the more so the nearer the node. So of the displacements at a node two count: along its normal
(that of a helical flank goes with its axial part, which is the same everywhere) and, small, at right angles to it in
the transverse plane. The second is scaled by what it can contribute, and all entries are rounded to one step, 2^-15 of
the largest: as integers, as differences and deflated, they take a twentieth of what double precision takes. Where the
normal does not turn between nodes but at a corner, on helical flanks, the part of the axial displacement that does not
go with the normal is lost: second order in a small angle.
Between teeth compliance is smooth and of low rank: products of a few vectors.

*Measured* (tests/consistency/test_live_page.py): what it costs the transmission error.
"""

from __future__ import annotations

import base64
import zlib
from typing import Any

import numpy as np

from pmor.arrays import FloatArray
from pmor.contact.kernels.types import Gear

# Steps to the largest entry.
STEPS = 2**20
# A block between teeth has fewer vectors than this; they are rounded to a part of a step.
MOST_VECTORS, FINER = 64, 4.0
# Most that a normal turns between a node and the contact that it helps to carry, over the distance of the nodes; and at
# the tip, where a corner meets its mate's flank at an angle, rad.
TURN, CORNER_TURN = 1.5, 0.1


def packed_compliance(blocks: FloatArray, gear: Gear) -> dict[str, Any]:
    """Pack the compliance of a gear's flanks.

    Parameters
    ----------
    blocks : ndarray, shape (reach + 1, n, n)
        Of teeth 0, 1, ... apart (`pmor.reduction.error_estimate.FlankCompliance`), mm/N.
    gear : Gear

    Returns
    -------
    dict
        `step`, mm/N; `tangential`, the scale of the second displacement of each node; `own`, packed integers: normal by
        normal (upper triangle), normal by tangential, tangential by tangential (upper triangle); `neighbours`: for
        each tooth `rank`, `factors` and the packed vectors `left` and `right`. Nodes go column by column.
    """
    local = _local(blocks, gear)
    rows, columns = gear.nodes.shape[:2]
    turns = TURN * np.gradient(gear.roll)
    turns[-1] = CORNER_TURN
    tangential, nodes = np.tile(turns, columns), rows * columns
    scale = np.concatenate([np.ones(nodes), tangential])
    scaled = local * scale[:, None] * scale
    step = float(np.abs(scaled[0]).max()) / STEPS
    upper = np.triu_indices(nodes)
    own = scaled[0].reshape(2, nodes, 2, nodes)
    parts = own[0, :, 0][upper], own[0, :, 1].ravel(), own[1, :, 1][upper]
    return {
        "step": step,
        "tangential": [float(value) for value in tangential],
        "own": packed_integers(np.concatenate(parts) / step),
        "neighbours": [_products(block, step) for block in scaled[1:]],
    }


def _local(blocks: FloatArray, gear: Gear) -> FloatArray:
    """Compliance in the nodes' own directions, column by column: (teeth, 2 n, 2 n)."""
    rows, columns = gear.nodes.shape[:2]
    nodes, components = rows * columns, blocks.shape[1] // (rows * columns)
    angle = (gear.half_angle - gear.roll[:, None] + gear.twist * gear.nodes[0, :, 2]).T.ravel()
    cosine, sine, axial = np.cos(angle), np.sin(angle), gear.twist * gear.base_radius
    by_column = components * np.arange(nodes).reshape(rows, columns).T.ravel()

    def along(array: FloatArray) -> FloatArray:
        """Take displacements, the first axis, in the nodes' own directions."""
        x, y = (array[by_column + component] for component in range(2))
        normal, tangential = (c * a + d * b for c, a, d, b in ((cosine, x, sine, y), (-sine, x, cosine, y)))
        if components == 3:
            normal += axial * array[by_column + 2]
        return np.concatenate([normal, tangential])

    cosine, sine = cosine[:, None], sine[:, None]
    return np.stack([along(along(block).T).T for block in blocks])


def _products(block: FloatArray, step: float) -> dict[str, Any]:
    """A smooth block as a sum of products of vectors, each as fine as what it adds needs."""
    left, size, right = _leading_vectors(block)
    kept = size > step
    largest = np.abs(left).max(axis=0), np.abs(right).max(axis=1)
    levels = np.ceil(FINER * size * largest[0] * largest[1] / step)[kept]
    factors = (size * largest[0] * largest[1])[kept] / levels**2
    return {
        "rank": int(np.count_nonzero(kept)),
        "factors": factors.tolist(),
        "left": packed_integers((left / largest[0]).T[kept] * levels[:, None]),
        "right": packed_integers((right / largest[1][:, None])[kept] * levels[:, None]),
    }


def _leading_vectors(block: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Singular vectors of a smooth matrix, from its products with a few random ones (Halko et al., SIAM Rev. 53)."""
    samples = np.random.default_rng(2011).standard_normal((len(block), min(len(block), MOST_VECTORS)))
    range_of, _ = np.linalg.qr(block @ (block.T @ (block @ samples)))
    left, size, right = np.linalg.svd(range_of.T @ block, full_matrices=False)
    return range_of @ left, size, right


def packed_integers(numbers: FloatArray) -> str:
    """Round numbers to 24-bit integers: their differences, low, middle and high bytes apart, deflated, in base64."""
    integers = np.round(np.ravel(numbers)).astype("<i4")
    differences = np.diff(integers, prepend=np.int32(0)).astype("<i4")
    planes = differences.view(np.uint8).reshape(-1, 4)[:, :3].T
    return base64.b64encode(zlib.compress(planes.tobytes(), 9)).decode("ascii")
