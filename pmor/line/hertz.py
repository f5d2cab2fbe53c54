r"""Semi-analytic line contact: a law for the layer below the loaded surface that a finite-element mesh cannot resolve.

The pressure between two teeth acts on a strip of some hundredth of the tooth's thickness. A mesh of the tooth is far
coarser, and its displacement near the load depends on where between its nodes the load is. So the tooth is cut into a
*surface layer* of depth d below the flank and the rest (Weber & Banaschek 1953 and Cappellini et al., Meccanica 53
(2018) 49, cut at a depth too). With the layer's inner face held, the mesh's compliance of the layer is C_layer; the
compliance of all is C, and, exactly, by static condensation,

    C - C_layer = T^T C_inner T,

T the forces that the held inner face receives from loads on the flank, C_inner the compliance of the inner face. That
difference is the part without the local dent: the displacement below the layer, averaged as the layer spreads the load.
It takes the place of C, and is smooth (`pmor.fe.surface_layer`). The layer itself is put back in closed form: an
elastic layer bonded to a rigid base, in plane strain, under the line load w with Hertz's pressure over the half-width b
<< d. At the middle of the load it gives

    delta = c w [ln(2 d / b) + 1/2 + a(nu)],      c = 2 (1 - nu^2) / (pi E),                                        (1)

by superposition of the layer's surface displacement c w [-ln(|x| / d) + a] near a concentrated load w: Hertz's pressure
has the mean -ln|x| of ln(2 / b) + 1/2 (Johnson, Contact Mechanics, 1985, ch. 5). The constant a follows from the
layer's Fourier transform L (ibid.; kappa = 3 - 4 nu):

    a = int_0^1 L/y dy + int_1^inf (L - 1)/y dy - Euler's gamma,
    L(y) = [2 kappa sinh 2y - 4 y] / [2 kappa cosh 2y + 4 y^2 + 1 + kappa^2].                                       (2)

With a = -1/2 - nu / (2 (1 - nu)) instead, (1) is the approach of the surface and a *point* at depth d in a half-space
(Johnson, ch. 5; Cappellini et al. 2018), which goes with the displacement at that point; -0.71 against -0.53 for steel.
Both gears together, with 1/rho the sum of the curvatures and b^2 = 2 (c_1 + c_2) w rho,

    delta_1 + delta_2 = C w (A - ln(w) / 2),  C = c_1 + c_2,
    A = sum c_i [ln(2 d_i) + 1/2 + a_i] / C - ln(2 C rho) / 2.                                                      (3)

There is no penalty: w is the unknown, one for each section and tooth pair, nonlinear in the approach.

Where it stops being valid. *Wide contact*: (1) needs b << d; against a bonded layer solved by finite elements it is 0.5
% low at b = d / 4 and 3 % at b = d / 2. Wider contact is refused before anything is solved (`check_half_width`), and a
state in which it is wider in some section counts as not converged (`WidthLimit`). *Tip corner*: within a depth from the
tip, and where its edge carries, the law is that of `pmor.line.kernels.tip_corner`, to second order in the gap, of
flanks without deviations: a relief that runs out at the tip turns the corner away from the mate, which is left out.
*Root*: in the fillet the layer ends at a held face, (1) does not; where contact begins, 0.8 to 1.2 depths from there,
(1) is too large by 0.03 to 0.006 c w, 0.3 % at most. *Along the width*: how sections press each other down through the
layer, and how it gives way at its free ends, is added by `pmor.line.face_ends` to what plane strain knows, of spur
gears. Against bricks that resolve contact and end the largest load of a tilted face, about half a depth inside, is 0.9
% low, and falls to 0.6 of it at the face as theirs does; the displacement is 0.2 % low. Tilts that leave part of the
face without load have it 1.5 to 3 % low: what falls over half a millimetre is not resolved by sections half a depth
wide (tests/verification/test_face_ends.py). *Helical faces*: on helical flanks the layer keeps plane strain up to the
face, and sections are coupled through the material below it alone: load must not change much over the width within one
depth.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from pmor.core.arrays import BoolArray, FloatArray
from pmor.core.errors import GeometryError
from pmor.gear.pair import GearPair
from pmor.line.bonded_layer import WIDEST, bonded_layer_constant
from pmor.line.kernels.tip_corner import LineLaw
from pmor.line.layered_pair import LayeredPair, SurfaceLayer

TOO_WIDE = (
    "overloads a section, whose contact is wider than half the depth of the layer that line contact stands on: lower "
    'the torque, relieve the edges, raise [contact] layer_depth, or, of external gears, choose scheme = "direct"'
)


def line_compliance(youngs_modulus: float, poisson_ratio: float) -> float:
    """Return c = 2 (1 - nu^2) / (pi E), mm^2/N; E in MPa."""
    return 2.0 * (1.0 - poisson_ratio**2) / (math.pi * youngs_modulus)


def approach_constants(depth: FloatArray, poisson_ratio: float) -> FloatArray:
    """Return ln(2 d) + 1/2 + a for layer depths d (mm), shape as `depth`."""
    return np.asarray(np.log(2.0 * depth) + 0.5 + bonded_layer_constant(poisson_ratio))


class WidthLimit(NamedTuple):
    """Load of placed sections beyond which their contact is too wide for the layer.

    `check_half_width` knows the mean load alone; edges of the face may carry several times as much.

    Attributes
    ----------
    compliance : ndarray, shape (A, N)
        Of the law, over the width of the section, mm/N.
    approach : ndarray, shape (A, N)
        Compliance times the largest force, mm.
    """

    compliance: FloatArray
    approach: FloatArray

    def exceeded(self, force: FloatArray) -> BoolArray:
        """Return in which states (D, A) some section exceeds it, under forces (D, A, N), N."""
        return np.asarray((force * self.compliance > self.approach).any(axis=2))


def mean_layer_constant(meshed: LayeredPair) -> float:
    """Return the constant a of both layers together, each by its compliance."""
    total = sum(layer.compliance for layer in meshed.layers)
    return sum(layer.compliance * bonded_layer_constant(layer.poisson_ratio) for layer in meshed.layers) / total


def width_limit(meshed: LayeredPair, law: FloatArray) -> WidthLimit:
    """Return the limit of sections from their laws (`LineLaw`), shape (A, N, 12)."""
    fields = map(LineLaw._fields.index, ("compliance", "opening", "curvature", "angle", "edge_curvature"))
    compliance, opening, curvature, angle, edge = (law[..., field] for field in fields)
    depth = 0.5 * np.exp(
        opening - mean_layer_constant(meshed)
    )  # both layers' in the logarithmic mean, as the approach has it
    # As `pmor.line.kernels.law.load_at`.
    half_width = WIDEST * depth
    wedge = np.where(edge > 0.0, np.minimum(angle, edge * half_width), angle)
    allowed = 0.5 * half_width * np.maximum(curvature * half_width, wedge)
    width = np.tile(meshed.width, law.shape[1] // len(meshed.width))
    return WidthLimit(compliance / width, allowed)


def check_half_width(
    pair: GearPair, layers: Sequence[SurfaceLayer], rolls: Sequence[FloatArray], torque: float
) -> None:
    """Raise GeometryError for a torque under which the contact is too wide for the layer.

    Parameters
    ----------
    layers : two SurfaceLayer
        Of pinion and wheel.
    rolls : two ndarrays, shape (n + 1,)
        Roll angles of the rows of their depths, rad.
    torque : float
        N mm; as if one tooth pair carried it at the pitch point.
    """
    roll = math.tan(pair.working_pressure_angle)
    line_load = torque / (pair.pinion.base_radius * pair.common_width)
    compliance = sum(layer.compliance for layer in layers)
    half_width = math.sqrt(2.0 * compliance * line_load * pair.pitch_point_radius)
    depth = min(
        float(np.interp(gear.base_radius * roll, gear.base_radius * rows, layer.depth))
        for gear, rows, layer in zip((pair.pinion, pair.wheel), rolls, layers, strict=True)
    )
    if half_width > WIDEST * depth:
        other = "" if pair.wheel.internal else ', or choose scheme = "direct"'
        raise GeometryError(
            f"torque {torque * 1e-3:g} N m: makes the contact {half_width:.3g} mm half-wide, more than half the depth "
            f"{depth:.3g} mm of the layer that line contact stands on; lower it, raise [contact] layer_depth{other}"
        )
