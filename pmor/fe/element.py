"""Hexahedra: places of the nodes in VTK's order, widths of columns of nodes, strain in a surface, quality of a mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.core.errors import MeshError

_CORNERS = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]])
_EDGES = [[0, 1], [1, 2], [2, 3], [3, 0], [4, 5], [5, 6], [6, 7], [7, 4], [0, 4], [1, 5], [2, 6], [3, 7]]
_FACES = [[0, 1, 1], [2, 1, 1], [1, 0, 1], [1, 2, 1], [1, 1, 0], [1, 1, 2]]

# Nodes of quadratic hexahedra, on corners and edges. The grid has nodes in the middle of faces and elements too.
QUADRATIC_NODES = 20


def node_places(order: int) -> IntArray:
    """Return the place of each node in the element's grid of (order + 1)^3 nodes, shape (n, 3), from 0 to `order`.

    Corners first, counter-clockwise at the lower z and then above them; of quadratic elements the middles of the edges
    (below, above, upright), of the faces (-x, +x, -y, +y, -z, +z) and of the element follow.
    """
    if order == 1:
        return _CORNERS
    return np.concatenate([2 * _CORNERS, _CORNERS[_EDGES].sum(axis=1), _FACES, [[1, 1, 1]]])


def tributary_widths(z: FloatArray, order: int) -> FloatArray:
    """Return the width that each column of nodes carries, so that even loads are the elements' consistent nodal forces.

    Parameters
    ----------
    z : ndarray, shape (m + 1,)
        Columns of nodes, rising, mm.
    order : int
        Intervals between columns that an element spans.

    Returns
    -------
    ndarray, shape (m + 1,)
        mm.
    """
    step = np.diff(z)
    if order == 1:
        return np.append(0.5 * step, 0.0) + np.insert(0.5 * step, 0, 0.0)
    simpson = np.zeros(len(z))
    span = step[::2] + step[1::2]
    simpson[0:-2:2] += span / 6.0
    simpson[1::2] += span * (4.0 / 6.0)
    simpson[2::2] += span / 6.0
    return simpson


def law_in_surface(youngs_modulus: float, poisson_ratio: float) -> FloatArray:
    """Return Hooke's law in a surface without traction, over two strains and their shear."""
    modulus = youngs_modulus / (1.0 - poisson_ratio**2)
    shear = 0.5 * youngs_modulus / (1.0 + poisson_ratio)
    across = modulus * poisson_ratio
    return np.array([[modulus, across, 0.0], [across, modulus, 0.0], [0.0, 0.0, shear]])


def surface_strain(corners: FloatArray, slopes: FloatArray) -> FloatArray:
    """Return the strain in the surface of faces at a point of each, over the displacement of their nodes.

    Parameters
    ----------
    corners : ndarray, shape (..., k, 3)
        Nodes of the faces.
    slopes : ndarray, shape (k, 2)
        Of the shape functions along both local coordinates of a face.

    Returns
    -------
    ndarray, shape (..., 3, 3 k)
        Along the first coordinate, across it, shear.
    """
    along, width = (np.einsum("k,...kd->...d", slopes[:, d], corners) for d in range(2))
    first = along / np.linalg.norm(along, axis=-1, keepdims=True)
    within = width - np.einsum("...d,...d->...", width, first)[..., None] * first
    second = within / np.linalg.norm(within, axis=-1, keepdims=True)
    basis = np.stack([first, second], axis=-2)
    frame = np.stack([along, width], axis=-2) @ basis.swapaxes(-1, -2)
    gradient = np.linalg.inv(frame) @ slopes.T  # of the shape functions along both directions
    one, two = (np.einsum("...k,...d->...kd", gradient[..., i, :], basis[..., i, :]) for i in range(2))
    mixed = np.einsum("...k,...d->...kd", gradient[..., 1, :], first)
    mixed = mixed + np.einsum("...k,...d->...kd", gradient[..., 0, :], second)
    return np.stack([one, two, mixed], axis=-3).reshape(*corners.shape[:-2], 3, -1)


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
