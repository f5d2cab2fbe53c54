"""Strain and stress in a surface: two directions at right angles in its tangent plane, and their shear."""

from __future__ import annotations

import numpy as np

from pmor.core.arrays import FloatArray


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
