"""Stiffness of tetrahedra, linear isotropic elasticity, all elements at once.

``tetra`` has four nodes and constant strain, ``tetra10`` quadratic shape functions, of the corners L_a (2 L_a - 1) and
of the edges 4 L_a L_b with volume coordinates L, edges curved as their middles say, at four points (Zienkiewicz &
Taylor, The Finite Element Method, vol. 1, 5th ed. (2000), ch. 8.12).
"""

from __future__ import annotations

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.core.errors import MeshError

# Elements whose matrices are integrated at a time.
BLOCK = 256
_INNER = (5.0 - np.sqrt(5.0)) / 20.0
_EDGES = np.array([[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]])
# Gradients of the volume coordinates over the second, third and fourth of them.
_SLOPES = np.array([[-1.0, -1.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


def tetrahedron_stiffness(
    nodes: FloatArray, elements: IntArray, youngs_modulus: float, poisson_ratio: float
) -> FloatArray:
    """Return the stiffness matrices of elements of k = 4 or 10 nodes in VTK's order, (n, 3 k, 3 k), N/mm.

    Raises
    ------
    MeshError
        When the Jacobian is not positive at an integration point.
    """
    count = elements.shape[1]
    slopes = _slopes_at_points(count)
    weight = 1.0 / (6.0 * len(slopes))
    shear = youngs_modulus / (2.0 * (1.0 + poisson_ratio))
    lame = 2.0 * shear * poisson_ratio / (1.0 - 2.0 * poisson_ratio)
    found = np.empty((len(elements), 3 * count, 3 * count))
    for first in range(0, len(elements), BLOCK):
        corners = nodes[elements[first : first + BLOCK]]
        jacobian = slopes.transpose(0, 2, 1) @ corners[:, None]
        det = np.linalg.det(jacobian)
        if det.min() <= 0.0:
            worst = int(np.unravel_index(det.argmin(), det.shape)[0])
            place = ", ".join(f"{x:.4g}" for x in corners[worst].mean(axis=0))
            raise MeshError(f"an element near ({place}) mm has a negative Jacobian at an integration point")
        gradients = slopes @ np.linalg.inv(jacobian).transpose(0, 1, 3, 2)
        gradients *= np.sqrt(weight * det)[:, :, None, None]
        flat = gradients.reshape(len(corners), len(slopes), -1)
        products = (flat.transpose(0, 2, 1) @ flat).reshape(len(corners), count, 3, count, 3)
        full = shear * products.transpose(0, 1, 4, 3, 2) + lame * products
        trace = shear * np.trace(products, axis1=2, axis2=4)
        for axis in range(3):
            full[:, :, axis, :, axis] += trace
        found[first : first + BLOCK] = full.reshape(len(corners), 3 * count, -1)
    return found


def _slopes_at_points(count: int) -> FloatArray:
    """Gradients of the shape functions at the integration points, (p, k, 3)."""
    if count == 4:
        return _SLOPES[None]
    places = np.full((4, 4), _INNER) + (1.0 - 4.0 * _INNER) * np.eye(4)
    corners = (4.0 * places - 1.0)[:, :, None] * _SLOPES
    one, other = _EDGES.T
    edges = 4.0 * (places[:, one, None] * _SLOPES[other] + places[:, other, None] * _SLOPES[one])
    return np.concatenate([corners, edges], axis=1)
