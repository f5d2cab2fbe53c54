r"""Line contact where a tip corner carries: cut off at the corner, on a wedge, at an angle to the mate's flank.

One gear has the corner near the contact. Along its flank, s from where the flank ends (into the tooth), the gap of the
undeformed flanks is to second order

    h(s) = theta s + kappa s^2 / 2,                                                                                (1)

kappa the sum of the curvatures and theta the angle of the corner to the mate's flank: 0 at the end of the path of
contact, positive beyond; -kappa s_0 while the flanks touch at s_0 inside. At a sharp edge the gap ends with s = 0; a
rounded one goes on (s < 0) with the curvature kappa_e of its arc on the mate. A chamfer's edge is a sharp one.

*Half-planes.* Let W = C w, C = c_1 + c_2, and the patch of contact have the middle m and the half-length l. With
Chebyshev's polynomials T_k over the patch and q the pressure of a flat punch, the pressure is q (W T_0 + W_1 T_1 + ...)
/ C, since -ln|x - s| takes q T_k to T_k / k: W_k = -k h_k by the gap's coefficients. The pressure ends smoothly where
contact is not cut off, and the approach grows with the load as under the flat punch of the present patch:

    d delta / dW = A - ln l   whatever the gap,     delta = W (A - ln l) + h_0,                                    (2)

A = sum c_i [ln(2 d_i) + a_i] / C. Hertz: l^2 = 2 W / kappa, W_1 = 0, W_2 = -W. Cut off at the corner (m = l):

    W = theta l + 3 kappa l^2 / 2,   W_1 = -l (theta + kappa l),   W_2 = -kappa l^2 / 2.                           (3)

Across the edge of an arc, with cos(beta) = m / l and D = kappa_e - kappa:

    theta = l P,  P = -kappa cos(beta) + D (sin(beta) - beta cos(beta)) / pi,
    W = l^2 Q,    Q = kappa / 2 + D (beta - sin(beta) cos(beta)) / (2 pi),                                         (4)
    W_1 = -S,  W_2 = -W + S cos(beta),  S = D l^2 sin(beta)^3 / (3 pi).

All of them follow each other with their slopes: Hertz's patch touches the corner with theta = -kappa l, and (4) becomes
(3) as the radius of the edge goes to nothing.

*The layer's end* adds H to the compliance of this gear (`tests.programs.ended_layer`), a wedge at the corner and
nothing a depth inside. The complementary energy is stationary in the pressure, so to first order it grows by that of
the pressure above, 1/2 \iint p H p, and the approach by its derivative by w, in which dp/dw = q:

    delta_H = (c / C) [W M_0 + W_1 M_1 + W_2 M_2],    M_k = \iint q T_k H q.                                       (5)

Against strips of pressure that are free to choose themselves (tests/verification/test_tip_corner.py) delta is within
0.4 % at a sharp edge, 0.3 % at rounded ones, from 3 degrees inside to 2 beyond, over three decades of load. Without the
layer's end it is 4 to 12 % low at the corner. Where Hertz's patch comes to a sharp edge the approach goes on smoothly
over the angle; its slope by the load jumps by 0.4 to 0.7 %, that of a patch whose end is taken from half-planes.

*Undercut* ends the involute at the form circle with a sharp edge, s from there towards the tip: the same equations.
The fillet goes on at 160 to 180 degrees inside the tooth, and the layer below it: of H the wedge alone is left, R - 1 a
hundredth at most. The curvature is that at the edge, although it falls within the patch where the form circle is near
the base circle. Against CalculiX the transmission error is 0.6 % high at such an edge, -0.1 % on the flank beside it
(tests/verification/test_undercut.py).

Left out: the material that a rounding or chamfer takes off the wedge; that the pressure's middle is m beside the place
at which the body's displacements and levers are taken (0.1 % of the transmission error); how loads turn the teeth
(theta).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.compiling import compiled

# Half-length of the patch over its distance from the corner, below which its length does not matter for the layer's
# end; above twice that it matters fully, and between them smoothly. That moves the approach by 2e-4.
SHORT = 0.2
# Half-length over the distance at which the table ends: it is not followed any further.
LONGEST = 0.5
# Distance over influence length from a second corner, below which it does not count more: patches are as long.
NEAREST = 0.01


class Corner(NamedTuple):
    """End of a gear's surface layer at the tip.

    Attributes
    ----------
    place : float
        Distance along the flank from the corner of the body's mesh to where the usable flank ends, mm.
    depth : float
        Of the layer at the corner, mm.
    influence_length : float
        Distance over that depth beyond which the layer's end is not felt.
    excess : float
        R - 1, by which the wedge is softer than a half-plane.
    coefficients : ndarray, shape (3, powers, spreads)
        Of P_k (`tests.programs.ended_layer`); empty for schemes without a layer.
    """

    place: float
    depth: float
    influence_length: float
    excess: float
    coefficients: FloatArray


class Corners(NamedTuple):
    """Corners of the flanks of M meshes, four of each in the order of `LineLaw.corner`.

    Attributes
    ----------
    numbers : ndarray, shape (M, 4, 4)
        All that `Corner` has but the coefficients.
    coefficients : ndarray, shape (M, 4, 3, powers, spreads)
    """

    numbers: FloatArray
    coefficients: FloatArray


@compiled
def corner_at(corners, mesh, number):
    """Return a corner of a mesh."""
    numbers = corners.numbers[mesh, number]
    return Corner(
        place=numbers[0], depth=numbers[1], influence_length=numbers[2], excess=numbers[3],
        coefficients=corners.coefficients[mesh, number],
    )  # fmt: skip


class LineLaw(NamedTuple):
    """Law of the line load where two flanks meet, along the transverse line of action.

    Attributes
    ----------
    compliance : float
        C, mm^2/N.
    constant : float
        A of ``C w (A - ln(w) / 2)``, away from corners.
    least : float
        Load below which the law is linear, N/mm.
    plain : float
        Load up to which compliance and constant are all of it, N/mm; infinite where no corner is near.
    corner : float
        The corner that is near: 0 and 1 the tips of pinion and wheel, 2 and 3 their undercut edges.
    opening : float
        A of equation (2).
    angle, curvature, edge_curvature : float
        theta, kappa and kappa_e; 0 at a sharp edge.
    place, influence_length : float
        Distance of the edge from the corner of the mesh, and that beyond which the layer's end is not felt, mm.
    share : float
        c / C of the gear that has the corner.
    """

    compliance: float
    constant: float
    least: float
    plain: float
    corner: float
    opening: float
    angle: float
    curvature: float
    edge_curvature: float
    place: float
    influence_length: float
    share: float


# How many numbers a law is when it is stored.
LAW_FIELDS = len(LineLaw._fields)


@compiled
def store_law(law, row):
    """Write a law into an array, shape (`LAW_FIELDS`,)."""
    for n, value in enumerate(law):
        row[n] = value


@compiled
def stored_law(row):
    """Return the law that `store_law` wrote."""
    return LineLaw(
        compliance=row[0], constant=row[1], least=row[2], plain=row[3], corner=row[4], opening=row[5], angle=row[6],
        curvature=row[7], edge_curvature=row[8], place=row[9], influence_length=row[10], share=row[11],
    )  # fmt: skip


class Patch(NamedTuple):
    """Patch of contact on half-planes and its pressure, with their derivatives by W.

    Attributes
    ----------
    middle, length : float
        m and l, mm.
    mean : float
        h_0 less the gap where flanks would touch, mm.
    first, second : float
        W_1 and W_2, mm.
    """

    middle: float
    length: float
    mean: float
    first: float
    second: float
    middle_slope: float
    length_slope: float
    first_slope: float
    second_slope: float


@compiled
def _hertz(size, angle, curvature):
    length = np.sqrt(2.0 * size / curvature)
    return Patch(
        middle=-angle / curvature, length=length, mean=0.5 * size, first=0.0, second=-size, middle_slope=0.0,
        length_slope=0.5 * length / size, first_slope=0.0, second_slope=-1.0,
    )  # fmt: skip


@compiled
def _cut_off(size, angle, curvature):
    """Equation (3)."""
    length = 2.0 * size / (np.sqrt(angle * angle + 6.0 * curvature * size) + angle)
    slope = 1.0 / (angle + 3.0 * curvature * length)
    inside = 0.5 * angle * angle / curvature if angle < 0.0 else 0.0
    return Patch(
        middle=length, length=length, mean=angle * length + 0.75 * curvature * length**2 + inside,
        first=-length * (angle + curvature * length), second=-0.5 * curvature * length**2, middle_slope=slope,
        length_slope=slope, first_slope=-(angle + 2.0 * curvature * length) * slope,
        second_slope=-curvature * length * slope,
    )  # fmt: skip


@compiled
def _across(size, angle, curvature, edge_curvature):
    """Equation (4), for beta by Newton between bounds: theta sqrt(Q) - P sqrt(W) falls."""
    low, high, beta = 0.0, np.pi, 0.5 * np.pi
    step = (edge_curvature - curvature) / np.pi
    for _ in range(60):
        c, s = np.cos(beta), np.sin(beta)
        p, q = -curvature * c + step * (s - beta * c), 0.5 * (curvature + step * (beta - s * c))
        p_slope, q_slope = curvature * s + step * beta * s, step * s * s
        root = angle / np.sqrt(size)
        rest = p - root * np.sqrt(q)
        if rest > 0.0:
            high = beta
        else:
            low = beta
        move = -rest / (p_slope - 0.5 * root * q_slope / np.sqrt(q))
        if abs(move) <= 1e-14 * beta:
            break
        beta = beta + move if low < beta + move < high else 0.5 * (low + high)
    length = np.sqrt(size / q)
    length_slope = 1.0 / (length * (2.0 * q - p * q_slope / p_slope))
    turn = -p / (length * p_slope) * length_slope
    third = step * s**3 / 3.0
    first = third * length**2
    first_slope = 2.0 * third * length * length_slope + step * s * s * c * length**2 * turn
    square = 0.5 * step * (beta * (0.5 + c * c) - 1.5 * s * c)
    middle = length * c
    mean = angle * middle + curvature * (0.5 * middle**2 + 0.25 * length**2) + square * length**2
    mean += 0.5 * angle * angle / (curvature if angle < 0.0 else edge_curvature)
    return Patch(
        middle=middle, length=length, mean=mean, first=-first, second=first * c - size,
        middle_slope=c * length_slope - length * s * turn, length_slope=length_slope, first_slope=-first_slope,
        second_slope=first_slope * c - first * s * turn - 1.0,
    )  # fmt: skip


@compiled
def contact_patch(size, angle, curvature, edge_curvature):
    """Patch of contact under W = `size` (mm) at a corner; `edge_curvature` is 0 for a sharp one."""
    if angle <= -np.sqrt(2.0 * size * curvature):
        return _hertz(size, angle, curvature)
    if edge_curvature == 0.0:
        return _cut_off(size, angle, curvature)
    if angle >= np.sqrt(2.0 * size * edge_curvature):
        return _hertz(size, angle, edge_curvature)
    return _across(size, angle, curvature, edge_curvature)


@compiled
def _spread_part(coefficients, k, y, square):
    """P_k and its derivatives by y and b^2."""
    value = by_place = by_square = 0.0
    for i in range(coefficients.shape[1] - 1, -1, -1):
        inner = slope = 0.0
        for j in range(coefficients.shape[2] - 1, -1, -1):
            slope = slope * square + inner
            inner = inner * square + coefficients[k, i, j]
        by_place = by_place * y + value
        value, by_square = value * y + inner, by_square * y + slope
    return value, by_place, by_square


@compiled
def single_mean(corner, y):
    """M_0 of a short patch in the distance y (over the influence_length) from the corner."""
    if y >= 1.0:
        return 0.0
    near = 1.0 - y
    value, _, _ = _spread_part(corner.coefficients, 0, y, 0.0)
    return corner.excess * (-np.log(y) - near - 0.5 * near**2) + near**2 * value


@compiled
def _felt(spread):
    """Spread of a patch as far as it counts (see `SHORT`), and the derivative."""
    t = spread / SHORT - 1.0
    if t <= 0.0:
        return 0.0, 0.0
    if t >= 1.0:
        return spread, 1.0
    part = t * t * (3.0 - 2.0 * t)
    return spread * part, part + spread * 6.0 * t * (1.0 - t) / SHORT


@compiled
def _layer_end(patch, size, law, corner):
    """Equation (5) without c / C, and its derivative by W."""
    middle, middle_slope = law.place + patch.middle, patch.middle_slope
    if middle < patch.length:  # on an arc that turns away from the flank: the patch begins at the corner
        middle, middle_slope = patch.length, patch.length_slope
    y = middle / law.influence_length
    if y >= 1.0:
        return 0.0, 0.0
    near, excess, y_slope = 1.0 - y, corner.excess, middle_slope / law.influence_length
    spread = patch.length / middle
    spread_slope = (patch.length_slope - spread * middle_slope) / middle
    longest = LONGEST * law.influence_length / middle
    if spread > longest:
        spread, spread_slope = longest, -longest * middle_slope / middle
    felt, part = _felt(spread)
    felt_slope = part * spread_slope
    value, by_place, by_square = _spread_part(corner.coefficients, 0, y, felt**2)
    mean = excess * (-np.log(y) - near - 0.5 * near**2) + near**2 * value
    by_y = excess * (-1.0 / y + 1.0 + near) + near**2 * by_place - 2.0 * near * value
    total = size * mean
    slope = mean + size * (by_y * y_slope + near**2 * by_square * 2.0 * felt * felt_slope)
    for k in range(1, 3):
        weight, weight_slope = (patch.first, patch.first_slope) if k == 1 else (patch.second, patch.second_slope)
        value, by_place, by_square = _spread_part(corner.coefficients, k, y, felt**2)
        power = felt if k == 1 else felt**2
        power_slope = 1.0 if k == 1 else 2.0 * felt
        mean = near**2 * power * value
        by_y = power * (near**2 * by_place - 2.0 * near * value)
        by_felt = near**2 * (power_slope * value + power * by_square * 2.0 * felt)
        total += weight * mean
        slope += weight_slope * mean + weight * (by_y * y_slope + by_felt * felt_slope)
    return total, slope


@compiled
def corner_approach(load, law, corner):
    """Approach of the flanks under a line load (N/mm) at a corner, mm, and its derivative."""
    size = law.compliance * load
    patch = contact_patch(size, law.angle, law.curvature, law.edge_curvature)
    end, end_slope = _layer_end(patch, size, law, corner)
    slope = law.opening - np.log(patch.length)
    approach = size * slope + patch.mean + law.share * end
    return approach, law.compliance * (slope + law.share * end_slope)
