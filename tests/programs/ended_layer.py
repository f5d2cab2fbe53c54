r"""The end of the surface layer at a tip corner, solved once by finite elements for `pmor.line.tip_corner`.

Line contact stands on an infinite elastic layer bonded to a rigid base (`pmor.line.hertz`). At the tip of a
tooth the layer ends at the tip land, which is free and at the angle psi to the flank. A unit line load at s, on lengths
in depths and in units of c = 2 (1 - nu^2) / (pi E), moves the flank at x by

    G(x, s) = -ln|x - s| + a(nu) + ln d + H(x, s),                                                              (1)

x and s from the corner, d the layer's depth halfway between them. H falls to nothing within a depth from the corner; at
the corner, where the tooth is a wedge, it is (R - 1)(-ln max(x, s)) and a function of x / s, with Flamant's R
(`pmor.line.tip_corner`).

G is Flamant's field of the load on a half-plane, singular and known, and a smooth rest: what frees the tip land of
Flamant's tractions and the inner face of his displacements. Only the rest is found by finite elements, quadratic ones
that are graded to the corner by a constant factor. Depths grow from the corner on; by how much hardly matters once the
logarithm is that of the depth at the place (H at x = s = 0.1 falls from 0.22 to 0.20 from a constant depth to a growth
of 0.45 for each length). A growth of 0.25 is taken, that of ordinary teeth.

What enters the law of the corner are the means of H over a patch of contact with the middle m and half-length l = b m,
with the pressure q of a flat punch, and T_k Chebyshev's polynomials over the patch,

    M_k(m, b) = \iint q(x) T_k(x) H(x, s) q(s) dx ds,     k = 0, 1, 2.                                            (2)

They are fitted by (y = m / `INFLUENCE_LENGTH`)

    M_0 = (R - 1)[-ln y - (1 - y) - (1 - y)^2 / 2] + (1 - y)^2 P_0(y, b^2),    M_k = b^k (1 - y)^2 P_k(y, b^2),     (3)

which end smoothly at y = 1; P_k are polynomials. Measured: the fit is within 0.006 at psi = 121 degrees, 0.016 at 100;
the approach of two steel flanks is 8 to 13 of these units.

``python -m tests.programs.ended_layer`` writes the table anew, in about three minutes.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from scipy.interpolate import CubicSpline, RectBivariateSpline

from pmor.core.arrays import FloatArray
from pmor.fe.assembly import added_up
from pmor.line.bonded_layer import bonded_layer_constant
from pmor.line.tip_corner import ANGLES_DEG, INFLUENCE_LENGTH, POWERS, RATIOS, SPREADS, TABLE, wedge_softness

# H of distances from the corner, an array of each.
Difference = Callable[[FloatArray, FloatArray], FloatArray]
# Growth of the layer's depth along the flank.
TAPER = 0.25
# First element at the corner in depths, growth from one to the next, and largest one.
FIRST, GROWTH, LARGEST = 1e-6, 1.4, 0.15
# First element where no load is near the corner.
COARSE = 0.05
LENGTH = 8.0
# Loads that H is found for, and how many Chebyshev points a patch has.
LOADS, POINTS = np.geomspace(1e-4, 2.6, 48), 48
# Below this distance from the corner H scales.
SCALING = 2e-4
# Half-length of the widest patch that the fit sees, in depths; line contact is refused beyond 0.5.
WIDEST_FITTED = 0.6


def flamant(x: FloatArray, y: FloatArray, poisson_ratio: float) -> tuple[FloatArray, ...]:
    """Return displacement (u_x, u_y) and stress (xx, yy, xy) below a unit line load on a half-plane y < 0, with c = 1.

    Johnson, Contact Mechanics, 1985, eqs. 2.15 and 2.20, the surface beside the load moving by -ln|x|.
    """
    radius = np.hypot(x, y)
    sine, cosine, angle = x / radius, -y / radius, np.arctan2(x, -y)
    over = 1.0 / (2.0 * (1.0 - poisson_ratio))  # (1 + nu) / (pi E)
    around = (1.0 - 2.0 * poisson_ratio) * over
    radial = -cosine * np.log(radius) - around * angle * sine + over * cosine
    tangential = sine * np.log(radius) + (2.0 * poisson_ratio - 1.0) * over * sine - around * (angle * cosine - sine)
    pressure = -(2.0 / math.pi) * cosine / radius
    stress = pressure * sine**2, pressure * cosine**2, -pressure * sine * cosine
    return radial * sine + tangential * cosine, -radial * cosine + tangential * sine, *stress


def _graded(first: float, largest: float, end: float) -> FloatArray:
    """Ends of elements from 0 to `end`, the middles between them put in."""
    ends = [0.0, first]
    while ends[-1] < end:
        ends.append(ends[-1] + min((ends[-1] - ends[-2]) * GROWTH, largest))
    scaled = np.array(ends) * end / ends[-1]
    return np.append(np.stack([scaled[:-1], 0.5 * (scaled[1:] + scaled[:-1])], axis=1).ravel(), scaled[-1])


def _quadratic(place: float) -> tuple[FloatArray, FloatArray]:
    """Shape functions of three nodes and their derivatives at a place from -1 to 1."""
    values = np.array([0.5 * place * (place - 1.0), 1.0 - place**2, 0.5 * place * (place + 1.0)])
    return values, np.array([place - 0.5, -2.0 * place, place + 0.5])


def _stiffness(places: FloatArray, elements: np.ndarray, poisson_ratio: float) -> sp.csc_array:
    """Plane strain, elements of nine nodes, c = 1."""
    modulus = 2.0 * (1.0 - poisson_ratio**2) / math.pi
    shear = 0.5 * modulus / (1.0 + poisson_ratio)
    lame = 2.0 * shear * poisson_ratio / (1.0 - 2.0 * poisson_ratio)
    elasticity = np.array([[lame + 2.0 * shear, lame, 0.0], [lame, lame + 2.0 * shear, 0.0], [0.0, 0.0, shear]])
    x, y = places[elements, 0], places[elements, 1]
    matrices = np.zeros((len(elements), 18, 18))
    points, weights = np.polynomial.legendre.leggauss(3)
    for one, its in zip(points, weights, strict=True):
        for other, others in zip(points, weights, strict=True):
            (along, d_along), (across, d_across) = _quadratic(one), _quadratic(other)
            first, second = np.outer(d_along, across).ravel(), np.outer(along, d_across).ravel()
            x1, x2, y1, y2 = ((v @ d)[:, None] for v in (x, y) for d in (first, second))
            area = x1 * y2 - x2 * y1
            strain = np.zeros((len(elements), 3, 18))
            strain[:, 0, 0::2] = strain[:, 2, 1::2] = (y2 * first - y1 * second) / area
            strain[:, 1, 1::2] = strain[:, 2, 0::2] = (x1 * second - x2 * first) / area
            weighted = np.abs(area)[:, :, None] * (its * others) * strain
            matrices += np.matmul(weighted.transpose(0, 2, 1), elasticity @ strain)
    unknowns = (2 * elements[:, :, None] + np.arange(2)).reshape(len(elements), 18)
    return added_up(matrices, unknowns, 2 * len(places)).tocsc()


def smooth_rest(
    angle: float, poisson_ratio: float, loads: FloatArray, first: float = FIRST, taper: float = TAPER
) -> tuple[FloatArray, FloatArray]:
    """Solve for what a layer's end, its inner face and its depth add to Flamant's field.

    Parameters
    ----------
    angle : float
        Between flank and tip land, rad.
    poisson_ratio : float
    loads : ndarray, shape (n,)
        Distances of unit loads from the corner, in depths at the corner.
    first : float
        Element at the corner; coarse where no load is near it.
    taper : float
        Growth of the depth along the flank.

    Returns
    -------
    x : ndarray, shape (p,)
        Nodes along the flank.
    down : ndarray, shape (p, n)
        How far they go down for each load.
    """
    along, across = _graded(first, LARGEST, LENGTH), _graded(first, 0.25, 1.0)
    slope = math.cos(angle) / math.sin(angle)
    depth = (1.0 + taper * along) / (1.0 - taper * slope)  # in the direction of the tip land
    places = np.stack([along[:, None] + depth[:, None] * across * slope, -depth[:, None] * across], axis=-1)
    grid, places = np.arange(len(along) * len(across)).reshape(len(along), -1), places.reshape(-1, 2)
    cells = np.lib.stride_tricks.sliding_window_view(grid, (3, 3))[::2, ::2].reshape(-1, 9)
    stiffness = _stiffness(places, cells, poisson_ratio)
    held = np.union1d(grid[:, -1], grid[-1])
    moved, force = np.zeros((2, 2 * grid.size, len(loads)))
    ux, uy, *_ = flamant(places[held, :1] - loads, np.broadcast_to(places[held, 1:], (len(held), len(loads))),
                         poisson_ratio)  # fmt: skip
    moved[2 * held], moved[2 * held + 1] = -ux, -uy
    outward = -math.sin(angle), -math.cos(angle)
    for element in range(0, len(across) - 1, 2):
        ends, nodes = across[[element, element + 2]] * depth[0], grid[0, element : element + 3]
        for point, weight in zip(*np.polynomial.legendre.leggauss(6), strict=True):
            down = 0.5 * (ends.sum() + np.ptp(ends) * point)
            _, _, xx, yy, xy = flamant(down * slope - loads, np.full(len(loads), -down), poisson_ratio)
            share = _quadratic(point)[0][:, None] * weight * 0.5 * np.ptp(ends) / math.sin(angle)
            force[2 * nodes] -= share * (xx * outward[0] + xy * outward[1])
            force[2 * nodes + 1] -= share * (xy * outward[0] + yy * outward[1])
    fixed = (2 * held[:, None] + np.arange(2)).ravel()
    free = np.setdiff1d(np.arange(2 * grid.size), fixed)
    rows = stiffness[free]
    moved[free] = spla.splu(rows[:, free].tocsc()).solve(force[free] - rows[:, fixed] @ moved[fixed])
    return along, -moved[2 * grid[:, 0] + 1]


def ended_layer(angle: float, poisson_ratio: float) -> Difference:
    """Return H of equation (1), a function of two arrays of distances from the corner in depths.

    Parameters
    ----------
    angle : float
        Between flank and tip land, rad.
    poisson_ratio : float
    """
    constant = bonded_layer_constant(poisson_ratio)
    along = _graded(COARSE, LARGEST, LENGTH)
    middle = len(along) // 2
    _, far = smooth_rest(0.5 * math.pi, poisson_ratio, along[[middle]], COARSE, 0.0)
    infinite = CubicSpline(along[middle:] - along[middle], far[middle:, 0] - constant)  # of a layer without an end
    along, down = smooth_rest(angle, poisson_ratio, LOADS)
    found = np.stack([CubicSpline(along, column)(LOADS) for column in down.T])
    logarithm = np.log(LOADS)
    spline = RectBivariateSpline(logarithm, logarithm, 0.5 * (found + found.T) - constant)
    excess = wedge_softness(angle) - 1.0

    def difference(x: FloatArray, s: FloatArray) -> FloatArray:
        scale = np.maximum(1.0, SCALING / np.maximum(x, s))
        places = (np.log(np.clip(v * scale, LOADS[0], LOADS[-1])) for v in (x, s))
        depth = 1.0 + 0.5 * TAPER * (x + s)
        ended = spline(*places, grid=False) + excess * np.log(scale)
        return np.asarray(ended - np.log(depth) - infinite(np.abs(x - s) / depth))

    return difference


def patch_means(difference: Difference, middle: float, spread: float) -> FloatArray:
    """Return M_0, M_1 and M_2 of equation (2), shape (3,).

    Parameters
    ----------
    difference : callable
        H.
    middle, spread : float
        m in depths, and b.
    """
    angle = (np.arange(POINTS) + 0.5) * math.pi / POINTS
    place = middle * (1.0 + spread * np.cos(angle))
    mean = difference(place[:, None], place[None]).mean(axis=1)
    return np.array([(np.cos(k * angle) * mean).mean() for k in range(3)])


def fitted(angle: float, poisson_ratio: float) -> FloatArray:
    """Return the coefficients of P_k, shape (3, `POWERS`, `SPREADS`)."""
    difference = ended_layer(angle, poisson_ratio)
    y = np.concatenate([[0.002, 0.004, 0.008], np.linspace(0.015, 1.0, 40)])
    spread = np.sqrt(0.5 - 0.5 * np.cos(np.linspace(0.0, math.pi, 11)))
    y, spread = (grid.ravel() for grid in np.meshgrid(y, spread, indexing="ij"))
    spread = np.minimum(spread, WIDEST_FITTED / (INFLUENCE_LENGTH * y))
    means = np.stack([patch_means(difference, INFLUENCE_LENGTH * m, b) for m, b in zip(y, spread, strict=True)], axis=1)
    means[0] -= (wedge_softness(angle) - 1.0) * (-np.log(y) - (1.0 - y) - 0.5 * (1.0 - y) ** 2)
    coefficients = []
    for k in range(3):
        powers = [y**i * spread ** (k + 2 * j) for i in range(POWERS) for j in range(SPREADS)]
        solution = np.linalg.lstsq(np.stack([(1.0 - y) ** 2 * power for power in powers], axis=1), means[k])[0]
        coefficients.append(solution.reshape(POWERS, SPREADS))
    return np.stack(coefficients)


def main() -> None:
    """Write the table."""
    rows = [(angle, ratio, *fitted(math.radians(angle), ratio).ravel()) for angle in ANGLES_DEG for ratio in RATIOS]
    header = (
        "Tip corner (tests.programs.ended_layer): angle in degrees, Poisson's ratio, coefficients of P_0, P_1 and P_2"
    )
    np.savetxt(TABLE, np.array(rows), fmt="%.6g", header=header)


if __name__ == "__main__":
    main()
