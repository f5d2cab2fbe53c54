"""How wide the contact of a section is, and how large the pressure in it (`pmor.line.hertz`)."""

from __future__ import annotations

import numpy as np

from pmor.core.compiling import compiled
from pmor.line.kernels.tip_corner import contact_patch, stored_law

# Places at which the largest pressure across a rounded edge is looked for.
PRESSURES = 400
# Results of `line_patches` for each section: half-width, offset, peak pressure.
PATCH_FIELDS = 3


@compiled
def edge_pressure(patch, law):
    """Return the largest pressure times C (see `pmor.line.kernels.tip_corner`) of a patch on half-planes.

    Hertz's; across the edge of an arc with the curvatures' step D there, C p is, at m - l cos(phi),

        (l / pi^2) [(pi kappa + D beta) sin(phi) + D (cos(beta) - cos(phi)) ln|r|],
        r = sin((phi - beta) / 2) / sin((phi + beta) / 2).

    Parameters
    ----------
    patch : Patch
    law : LineLaw

    Returns
    -------
    float
        NaN where a sharp edge cuts the contact off: there the pressure has no bound.
    """
    if patch.middle - patch.length > 0.0:
        return patch.length * law.curvature / np.pi
    if law.edge_curvature == 0.0:
        return np.nan
    if patch.middle + patch.length < 0.0:
        return patch.length * law.edge_curvature / np.pi
    cosine, step, most = patch.middle / patch.length, law.edge_curvature - law.curvature, 0.0
    beta = np.arccos(cosine)
    for n in range(PRESSURES):
        phi = (n + 0.5) * np.pi / PRESSURES
        ratio = abs(np.sin(0.5 * (phi - beta)) / np.sin(0.5 * (phi + beta)))
        # At phi = beta the logarithm's factor is zero.
        edge = (cosine - np.cos(phi)) * np.log(ratio) if ratio > 0.0 else 0.0
        most = max(most, (np.pi * law.curvature + step * beta) * np.sin(phi) + step * edge)
    return patch.length / np.pi**2 * most


@compiled
def _patch(load, law):
    """Half-width, offset and peak pressure under a line load."""
    size = law.compliance * load
    if load <= law.plain:
        half_width = np.sqrt(2.0 * size / law.curvature)
        return half_width, 0.0, half_width * law.curvature / (np.pi * law.compliance)
    patch = contact_patch(size, law.angle, law.curvature, law.edge_curvature)
    offset = patch.middle - max(-law.angle / law.curvature, 0.0)
    to_tip_of_pinion = law.corner == 1.0 or law.corner == 2.0
    return patch.length, offset if to_tip_of_pinion else -offset, edge_pressure(patch, law) / law.compliance


@compiled
def line_patches(laws, load, out):
    """Fill the patches of contact of n sections under m loads each.

    Parameters
    ----------
    laws : ndarray, shape (n, 12)
        `LineLaw` of each section, in the order of its fields.
    load : ndarray, shape (m, n)
        N/mm; not positive where a section carries nothing.
    out : ndarray, shape (m, n, 3)
        Half-width (mm), offset towards the tip of the pinion (mm), peak pressure (MPa; NaN where a sharp edge is in
        contact); zero where nothing is carried.
    """
    for i in range(load.shape[0]):
        for n in range(load.shape[1]):
            out[i, n] = 0.0
            if load[i, n] > 0.0:
                out[i, n, 0], out[i, n, 1], out[i, n, 2] = _patch(load[i, n], stored_law(laws[n]))
