r"""Free ends of the face: compliance between sections that plane strain does not know (`tests.programs.free_end`).

The law of line contact (`pmor.line.hertz`) is that of an elastic layer, bonded to a rigid base, in plane strain: each
section deforms under its own line load alone. A line load that changes along the width, or ends, presses its
neighbourhood down too. Lengths in depths d of the layer, displacements in units of c / d, the layer moves at a distance
z along the line of contact from a unit force by (Johnson, Contact Mechanics, 1985, ch. 3; L and a of `pmor.line.hertz`)

    P(z) = [1 / z + int_0^inf (L(k) - 1) J_0(k z) dk] / 2,                                                       (1)

of which plane strain, all of it at the place of the force, is taken off. Between sections that carry even loads over
their widths [e_i, e_i+1] it acts by its mean,

    [Phi(e_i+1 - e_j) + Phi(e_i - e_j+1) - Phi(e_i - e_j) - Phi(e_i+1 - e_j+1)] / (l_i l_j),   Phi'' = P,

    Phi(z) = 1/2 (z ln z - z) + 1/2 int_0^inf (L - 1) k z [int_0^kz J_0 - J_1(kz)] / k^2 dk + 1/2 (ln 2 - a) z,  (2)

even, constant beyond `FAR`: even loads amid the face get what plane strain gives them. At both ends of the face each
load has its mirror images, as if planes of symmetry were there, and Q of `tests.programs.free_end` is what releasing
the axial stress on each of them adds; on faces narrower than a depth the two would not be independent. Against bricks
that resolve contact and end (tests/verification/test_face_ends.py) the line load at the face is then theirs, 0.58 of
the largest one, which is a millimetre inside.

1 / z of (1) is that of a line as narrow as a thread, and sections much shorter than the contact is wide would answer to
a load by rising. It is taken as 1 / sqrt(z^2 + s^2), with the least s that leaves the compliance of the layer positive
definite under any load, with the law's least slope: up to 0.6 depths between sections without width, less where they
are longer. By that s, and sections that are half a depth wide beside the end, the largest load of a tilted face is
0.9 % low.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache, partial
from pathlib import Path

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.line.bonded_layer import bonded_layer_constant, layer_transform
from pmor.line.kernels.law import LEAST_SLOPE
from pmor.line.tip_corner import RATIOS, interpolation_weights

# Borders of the lengths along the line of contact, in depths from the end, between which the table has means of Q.
BOXES = (0.0, 0.05, 0.1, 0.17, 0.25, 0.35, 0.5, 0.7, 0.9, 1.2, 1.6, 2.1, 2.8, 3.6, 4.6, 6.0)
TABLE = Path(__file__).with_name("face_end.txt")
# Depths along the line beyond which a force is not felt.
FAR = 8.0
# Of (2): points of the integral in each unit of k, where it stops, degree of the polynomials that stand for it.
POINTS, LAST, DEGREE = 20, 12, 60
BESSEL_POINTS = 40  # over a quarter of the angles
# Values of s, in depths: the first that is enough is taken.
SMOOTHINGS = np.geomspace(0.02, 0.6, 24)


def layer_coupling(
    edges: FloatArray, face: tuple[float, float], depth: FloatArray, compliance: float, poisson_ratio: float
) -> FloatArray:
    """Return what a layer adds to plane strain between sections of a spur flank.

    Parameters
    ----------
    edges : ndarray, shape (S + 1,)
        Between the widths of the sections, rising, mm.
    face : (float, float)
        Where the face begins and ends, mm.
    depth : ndarray, shape (n,)
        Of the layer, mm.
    compliance : float
        c, mm^2/N.
    poisson_ratio : float

    Returns
    -------
    ndarray, shape (n, S, S)
        mm/N.
    """
    largest = float(depth.max())
    in_depths = (edges - face[0]) / largest, (face[1] - face[0]) / largest
    width = np.diff(in_depths[0])
    own = np.diag(LEAST_SLOPE / width) + _unsmoothed(*in_depths, poisson_ratio)
    scale = np.sqrt(np.outer(width, width))
    for smoothing in SMOOTHINGS:
        least = np.linalg.eigvalsh(scale * (own + _with_images(*in_depths, partial(_near, smoothing))))[0]
        if least > 0.0:
            break
    places = [((edges - face[0]) / d, (face[1] - face[0]) / d) for d in depth]
    return np.stack([
        compliance / d * (_unsmoothed(*place, poisson_ratio) + _with_images(*place, partial(_near, smoothing)))
        for d, place in zip(depth, places, strict=True)
    ])  # fmt: skip


def _unsmoothed(edges: FloatArray, length: float, poisson_ratio: float) -> FloatArray:
    """Compliance between sections of a face from 0 to a length, in depths, (S, S), in units of c / d, less `_near`."""
    found, released = _with_images(edges, length, _regular_part(poisson_ratio)), _release(poisson_ratio)
    for shares in (_in_boxes(edges), _in_boxes((length - edges)[::-1])[::-1]):
        found += shares @ released @ shares.T
    return found


def _with_images(edges: FloatArray, length: float, phi: Callable[[FloatArray], FloatArray]) -> FloatArray:
    """Means of the second derivative of a part of Phi over sections, of loads and of their images."""
    cells = 2.0 * length * np.arange(-math.ceil(0.5 * FAR / length), math.ceil(0.5 * FAR / length) + 1)[:, None]
    loaded = np.stack([cells + edges, (cells - edges)[:, ::-1]])
    there = phi(np.minimum(np.abs(edges[:, None] - loaded[:, :, None]), FAR))
    means = there[..., 1:, :-1] + there[..., :-1, 1:] - there[..., :-1, :-1] - there[..., 1:, 1:]
    means /= np.diff(edges)[:, None] * np.diff(loaded)[:, :, None]
    return np.asarray((means[0] + means[1, :, :, ::-1]).sum(axis=0))


def _near(smoothing: float, z: FloatArray) -> FloatArray:
    """The logarithm of Phi of equation (2), smoothed."""
    near = z * np.arcsinh(z / smoothing) - np.hypot(z, smoothing) + smoothing + z * math.log(0.5 * smoothing)
    return np.asarray(0.5 * near)


@cache
def _regular_part(poisson_ratio: float) -> np.polynomial.Chebyshev:
    """Phi less the logarithm, up to `FAR`."""
    points, weights = np.polynomial.legendre.leggauss(POINTS)
    k = (np.arange(LAST)[:, None] + 0.5 * (1.0 + points)).ravel()
    weight = np.tile(0.5 * weights, LAST) * (layer_transform(k, poisson_ratio) - 1.0) / k**2
    rest = math.log(2.0) - bonded_layer_constant(poisson_ratio)

    def phi(z: FloatArray) -> FloatArray:
        kz = k * z[:, None]
        return np.asarray(0.5 * (kz * _integral_less_bessel(kz)) @ weight + 0.5 * rest * z)

    return np.polynomial.Chebyshev.interpolate(phi, DEGREE, (0.0, FAR))


def _integral_less_bessel(x: FloatArray) -> FloatArray:
    """int_0^x J_0 - J_1(x) by Bessel's integrals: of what is periodic, sums are exact (up to x = 12 FAR)."""
    angle = (np.arange(BESSEL_POINTS) + 0.5) * 0.5 * math.pi / BESSEL_POINTS
    sine, found = np.sin(angle), np.zeros_like(x)
    for s, weight in zip(sine, np.cos(angle) ** 2 / sine, strict=True):
        found += weight / BESSEL_POINTS * np.sin(s * x)
    return found


@cache
def _release(poisson_ratio: float) -> FloatArray:
    """Means of Q over `BOXES`, in units of c / d."""
    boxes, table = len(BOXES) - 1, np.loadtxt(TABLE)[:, 1:]
    found, upper = np.zeros((boxes, boxes)), np.triu_indices(boxes)
    found[upper] = interpolation_weights(RATIOS, min(poisson_ratio, RATIOS[-1])) @ table
    return np.asarray(np.triu(found) + np.triu(found, 1).T)


def _in_boxes(edges: FloatArray) -> FloatArray:
    """Shares of sections in `BOXES`, (S, boxes)."""
    boxes = np.array(BOXES)
    within = np.minimum(edges[1:, None], boxes[1:]) - np.maximum(edges[:-1, None], boxes[:-1])
    return np.asarray(np.maximum(within, 0.0) / np.diff(edges)[:, None])
