"""Stress on the faces of a web, and at the edges of its holes, under forces on the flanks of a gear.

Forces on the flank of tooth i move the web by harmonics over the angle (`pmor.body.blank`, `pmor.body.support`), whose
stress in its surfaces is known of each (`pmor.fe.blank_section`, `pmor.fe.web_surfaces`). The surfaces are divided into
cells, all alike: sectors of the teeth, or of the holes. In cell m there is

    sigma_m = Re sum_n S_n e^(2 pi i n m / cells) e_ni,                                                             (1)

S_n the stress in cell 0 by an amplitude of 1 mm, e_ni the amplitudes under forces on tooth i. Webs are smooth, and far
from the flank: few patterns of stress, and few of forces, are enough.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg as la

from pmor.body.rim import LEAST_STRESS, leading
from pmor.core.arrays import BoolArray, ComplexArray, FloatArray
from pmor.fe.perforated_web import PerforatedWeb
from pmor.fe.web_surfaces import surface_stress

# Angles over a tooth's sector at which a web without holes has its points.
ANGLES = 4


@dataclass(frozen=True)
class WebStress:
    """Stress on the surfaces of a web under unit forces on a flank.

    Parameters
    ----------
    places : ndarray, shape (p, 3)
        Radius, mm, angle from the middle of tooth 0, rad, and z, mm, of the points of cell 0.
    edge : ndarray of bool, shape (p,)
        At the edge of a hole.
    stress : ndarray, shape (p, 3, a)
        Patterns: two directions in the surface at right angles, and their shear.
    pattern : ndarray, shape (q, n)
        Amplitude of each pattern of forces under unit forces on the flank's unknowns.
    moved : ndarray, shape (t, m, a, q)
        Amplitudes of the patterns of stress in cells 0 ... m - 1 by those of forces on tooth 0 ... t - 1, after which
        the gear repeats; MPa/N.
    """

    places: FloatArray
    edge: BoolArray
    stress: FloatArray
    pattern: FloatArray
    moved: FloatArray

    def of_components(self, components: int) -> WebStress:
        """Return it under forces along the first axes, so many of x, y and z, at each node of a flank."""
        by_node = self.pattern.reshape(len(self.pattern), -1, 3)[:, :, :components]
        return replace(self, pattern=np.ascontiguousarray(by_node.reshape(len(self.pattern), -1)))


def stress_of_revolution(
    places: FloatArray, shown: ComplexArray, patterns: FloatArray, teeth: int, twist: float
) -> WebStress:
    """Return the stress on a web without holes.

    Parameters
    ----------
    places : ndarray, shape (g, 2)
        Radius and z of the gauges, mm.
    shown : ndarray, shape (2 N + 1, 3 g, q)
        Amplitudes of what they show, harmonics -N ... N, under patterns of forces on tooth 0, MPa.
    patterns : ndarray, shape (n, q)
        Over the unknowns of a flank.
    twist : float
        Angle of the teeth along the axis, by which harmonics follow them, rad/mm.
    """
    harmonics, size = np.arange(len(shown)) - len(shown) // 2, patterns.shape[1]
    angle = 2.0 * np.pi / (ANGLES * teeth) * np.arange(ANGLES * teeth)
    wave, flat = np.exp(1j * np.outer(angle, harmonics)), shown.reshape(len(shown), -1)
    every = (wave.real @ flat.real - wave.imag @ flat.imag).reshape(teeth, -1, size)
    of_cell = every.transpose(1, 0, 2)
    own = leading(of_cell.reshape(len(of_cell), -1), LEAST_STRESS)
    moved = (own.T @ every)[None]
    radius, z = (np.tile(part, ANGLES) for part in places.T)
    at = np.stack([radius, angle[:ANGLES].repeat(len(places)) + twist * z, z], axis=1)
    return _of_few_forces(at, np.zeros(len(at), dtype=bool), own, moved, patterns)


def stress_by_holes(
    web: PerforatedWeb, amplitudes: ComplexArray, patterns: FloatArray, youngs_modulus: float, poisson_ratio: float,
    twist: float,
) -> WebStress:  # fmt: skip
    """Return the stress on a web with holes.

    Parameters
    ----------
    amplitudes : ndarray, shape ((2 N + 1) c, t, q)
        Of both circles of the web under patterns of forces on teeth 0 ... t - 1, mm.
    patterns : ndarray, shape (n, q)
    """
    surfaces = surface_stress(web, youngs_modulus, poisson_ratio, twist)
    flat = amplitudes.reshape(len(amplitudes), -1)
    scaled = surfaces.stress * np.sqrt((np.abs(flat) ** 2).mean(axis=1))
    onto, triangle = la.qr(np.concatenate([scaled.real, scaled.imag], axis=1), mode="economic", check_finite=False)
    own = onto @ leading(triangle, LEAST_STRESS)
    few, harmonics = own.T @ surfaces.stress, np.arange(-web.largest, web.largest + 1)
    phase = np.exp(2j * np.pi / web.count * np.outer(np.arange(web.count), harmonics))
    turned = few * phase.repeat(len(flat) // len(harmonics), axis=1)[:, None]
    moved = (turned.real @ flat.real - turned.imag @ flat.imag).reshape(*turned.shape[:2], *amplitudes.shape[1:])
    return _of_few_forces(surfaces.places, surfaces.edge, own, moved.transpose(2, 0, 1, 3), patterns)


def _of_few_forces(
    places: FloatArray, edge: BoolArray, own: FloatArray, moved: FloatArray, patterns: FloatArray
) -> WebStress:
    felt = leading(moved.reshape(-1, moved.shape[3]).T, LEAST_STRESS)
    return WebStress(places, edge, own.reshape(len(places), 3, -1), (patterns @ felt).T, moved @ felt)
