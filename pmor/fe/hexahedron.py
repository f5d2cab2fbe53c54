"""Stiffness of eight-node hexahedra, linear isotropic elasticity, all elements at once.

``hex8`` is the trilinear element with full 2 x 2 x 2 integration. ``hex8i`` adds the three incompatible bubble modes
of Wilson, Taylor, Doherty & Ghaboussi (1973), with the gradient correction of Taylor, Beresford & Wilson (IJNME 10
(1976) 1211) that makes distorted elements pass the patch test: the bubble gradients are taken with the Jacobian at
the element centre, scaled by det(J_0) / det(J). The bubbles are condensed out element by element.
"""

from __future__ import annotations

import numpy as np

from pmor.arrays import FloatArray, IntArray
from pmor.errors import MeshError

CORNERS = np.array(
    [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]], dtype=float
)


def shape_gradient(xi: FloatArray) -> FloatArray:
    """Return the gradients of the trilinear shape functions at a point of the unit cube [-1, 1]^3, shape (8, 3)."""
    factors = 1.0 + CORNERS * xi
    return 0.125 * CORNERS * np.stack(
        [factors[:, 1] * factors[:, 2], factors[:, 0] * factors[:, 2], factors[:, 0] * factors[:, 1]], axis=-1
    )


def elasticity_matrix(youngs_modulus: float, poisson_ratio: float) -> FloatArray:
    """Return the isotropic elasticity matrix for strains (xx, yy, zz, xy, yz, zx) with engineering shear, MPa."""
    lame = youngs_modulus * poisson_ratio / ((1.0 + poisson_ratio) * (1.0 - 2.0 * poisson_ratio))
    shear = youngs_modulus / (2.0 * (1.0 + poisson_ratio))
    matrix = np.diag([2.0 * shear] * 3 + [shear] * 3)
    matrix[:3, :3] += lame
    return matrix


def element_stiffness(
    nodes: FloatArray, elements: IntArray, youngs_modulus: float, poisson_ratio: float, element: str
) -> FloatArray:
    """Return the stiffness matrices of all elements.

    Parameters
    ----------
    nodes : ndarray, shape (n_nodes, 3)
        mm.
    elements : ndarray of int, shape (n_elements, 8)
    youngs_modulus : float
        MPa.
    poisson_ratio : float
    element : {"hex8", "hex8i"}

    Returns
    -------
    ndarray, shape (n_elements, 24, 24)
        N/mm; degrees of freedom node by node, x y z within a node.

    Raises
    ------
    MeshError
        When the Jacobian is not positive at an integration point.
    """
    corners = nodes[elements]
    elasticity = elasticity_matrix(youngs_modulus, poisson_ratio)
    incompatible = element == "hex8i"
    columns = 33 if incompatible else 24
    stiffness = np.zeros((len(elements), columns, columns))
    centre_jacobian = np.einsum("ni,enj->eij", shape_gradient(np.zeros(3)), corners)
    centre_inverse, centre_det = np.linalg.inv(centre_jacobian), np.linalg.det(centre_jacobian)
    for point in CORNERS / np.sqrt(3.0):
        gradient = shape_gradient(point)
        jacobian = np.einsum("ni,enj->eij", gradient, corners)
        det = np.linalg.det(jacobian)
        if det.min() <= 0.0:
            raise MeshError(f"element {int(det.argmin())} has a negative Jacobian at an integration point")
        gradients = np.einsum("eij,nj->eni", np.linalg.inv(jacobian), gradient)
        if incompatible:
            bubbles = np.diag(-2.0 * point)
            corrected = np.einsum("eij,nj->eni", centre_inverse, bubbles) * (centre_det / det)[:, None, None]
            gradients = np.concatenate([gradients, corrected], axis=1)
        strain = _strain_matrix(gradients)
        stress = np.einsum("ij,ejk->eik", elasticity, strain) * det[:, None, None]
        stiffness += strain.transpose(0, 2, 1) @ stress
    if incompatible:
        coupling, bubble = stiffness[:, 24:, :24], stiffness[:, 24:, 24:]
        stiffness = stiffness[:, :24, :24] - coupling.transpose(0, 2, 1) @ np.linalg.solve(bubble, coupling)
    return 0.5 * (stiffness + stiffness.transpose(0, 2, 1))


def _strain_matrix(gradients: FloatArray) -> FloatArray:
    """Strain-displacement matrices (n_elements, 6, 3 n) from shape function gradients (n_elements, n, 3)."""
    count, modes, _ = gradients.shape
    strain = np.zeros((count, 6, modes, 3))
    gx, gy, gz = gradients[..., 0], gradients[..., 1], gradients[..., 2]
    strain[:, 0, :, 0] = strain[:, 3, :, 1] = strain[:, 5, :, 2] = gx
    strain[:, 1, :, 1] = strain[:, 3, :, 0] = strain[:, 4, :, 2] = gy
    strain[:, 2, :, 2] = strain[:, 4, :, 1] = strain[:, 5, :, 0] = gz
    return strain.reshape(count, 6, 3 * modes)
