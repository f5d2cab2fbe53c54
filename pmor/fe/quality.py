"""Quality of a hexahedral mesh: are all elements the right way out, and how far from bricks are they."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.core.errors import MeshError

# For each corner of a hexahedron its three neighbours, ordered so that a brick has a positive triple product.
CORNER_NEIGHBOURS = np.array([[1, 3, 4], [2, 0, 5], [3, 1, 6], [0, 2, 7], [7, 5, 0], [4, 6, 1], [5, 7, 2], [6, 4, 3]])


@dataclass(frozen=True)
class MeshQuality:
    """Worst and typical elements of a mesh.

    Parameters
    ----------
    min_scaled_jacobian : float
        Smallest corner triple product of unit edge vectors: 1 for a brick, <= 0 inside out (Knupp 2003).
    max_aspect_ratio : float
        Longest over shortest edge of an element.
    """

    n_elements: int
    min_scaled_jacobian: float
    median_scaled_jacobian: float
    max_aspect_ratio: float


def mesh_quality(nodes: FloatArray, elements: IntArray) -> MeshQuality:
    """Measure a mesh.

    Parameters
    ----------
    nodes : ndarray, shape (n_nodes, 3)
    elements : ndarray of int, shape (n_elements, 8 or more)
        Corners first.

    Raises
    ------
    MeshError
        When an element is turned inside out at a corner.
    """
    corners = nodes[elements[:, :8]]
    edges = corners[:, CORNER_NEIGHBOURS] - corners[:, :, None, :]
    lengths = np.linalg.norm(edges, axis=-1)
    scaled = np.linalg.det(edges) / np.prod(lengths, axis=-1)
    worst = scaled.min(axis=1)
    if worst.min() <= 0.0:
        element = int(worst.argmin())
        place = ", ".join(f"{c:.3g}" for c in corners[element].mean(axis=0))
        raise MeshError(
            f"element {element} near ({place}) mm is turned inside out (scaled Jacobian {worst.min():.2g}); "
            "use more elements over the profile or a larger rack_tip_radius"
        )
    return MeshQuality(
        n_elements=len(elements),
        min_scaled_jacobian=float(worst.min()),
        median_scaled_jacobian=float(np.median(worst)),
        max_aspect_ratio=float((lengths.max(axis=(1, 2)) / lengths.min(axis=(1, 2))).max()),
    )
