"""A meshed pair under the penalty law: surfaces through its nodes, their refined points, windows."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.gear.condition import Assembly
from pmor.gear.meshed_pair import Flank, MeshedPair
from pmor.penalty.kernels.surface import prepare_surface, refine
from pmor.penalty.kernels.types import NodalScheme, Pair, WindowLimits

# Share of the approach by which flanks interpenetrate where they meet, and which windows must hold: the rest is
# deflection of the teeth as a whole. Facets also stand off the involute between their edges. Too small costs a
# repetition with a larger window, never accuracy.
LOCAL_SHARE = 1.0 / 16.0
# The search goes outwards from the kinematic contact and ends at the first row of points that is clear of the mate by
# this share of the depth for which the windows were cut: flanks separate quadratically, so all rows behind are clear.
SMOOTH_CLEARANCE = 0.04
# Facets stand off the involute between their edges, by at most the surface error that the depth contains.
FACET_CLEARANCE = 1.0
# Last step to a foot, in elements: changes the gap by its square times the element's sagitta, which is nothing.
FOOT_STEP = 1e-6

# Negative: the gear whose tip is nearer is the slave.
PINION_SHARE = {"pinion": 1.0, "wheel": 0.0, "both": 0.5, "tip": -1.0}


@dataclass(frozen=True)
class ContactScheme:
    """How penalty contact is evaluated.

    Facets between two layers of nodes of a helical gear cut off the bulge of the helicoid between them
    (`Tooth.helix_sagitta`): with layers of 1 mm 0.3 um of each flank at 25 deg, 1-2 % of the transmission error, which
    comes out too large by two thirds of it. Finer layers, or Ferguson patches on both flanks, have no such error.

    Parameters
    ----------
    surface : {"hermite", "facet"}
        Bicubic Ferguson patches through the deformed nodes, or bilinear facets.
    projection : {"patch", "facet"}
        Where slave points are projected: on the master's patches themselves, or on bilinear facets through its refined
        points (the paper).
    slave : {"tip", "pinion", "wheel", "both"}
        Gear whose points are projected on its mate: the one whose tip is nearer, one of them, or both with half the
        penalty each (two-pass).
    edge_normals : {"parabolic", "average"}
        Node normals at the edges of a flank: one-sided parabolas, or the paper's plain average.
    lodm_profile, lodm_width : int
        Level-of-detail magnification: subdivisions of an element per direction.
    penalty : float
        N/mm^3.
    """

    surface: str
    projection: str
    slave: str
    edge_normals: str
    lodm_profile: int
    lodm_width: int
    penalty: float

    @property
    def smooth(self) -> bool:
        """Whether the surface is made of Ferguson patches."""
        return self.surface == "hermite"

    @property
    def direct(self) -> bool:
        """Whether slave points are projected on the patches themselves."""
        return self.projection == "patch"

    @property
    def parabolic(self) -> bool:
        """Whether edge normals come from one-sided parabolas."""
        return self.edge_normals == "parabolic"

    @property
    def clearance(self) -> float:
        """Share of the windows' depth at which a row of points counts as clear of the mate."""
        return SMOOTH_CLEARANCE if self.smooth else FACET_CLEARANCE


@dataclass(frozen=True, kw_only=True)
class PenaltyPair(MeshedPair):
    """A meshed pair with a scheme of penalty contact."""

    scheme: ContactScheme

    @cached_property
    def extents(self) -> tuple[FloatArray, FloatArray]:
        """Half distances between the refined points of pinion and wheel (`refined_extents`)."""
        pinion = refined_extents(self.pinion, self.scheme, self.mirrored)
        if self.wheel is self.pinion:
            return pinion, pinion
        return pinion, refined_extents(self.wheel, self.scheme, self.mirrored)

    @cached_property
    def limits(self) -> WindowLimits:
        """Limits of windows, beside the depth."""
        spacing = 2.0 * max(float(extents[:, :, :2].max()) for extents in self.extents)
        return WindowLimits(
            least_radius=least_radius(self), local_share=LOCAL_SHARE if self.scheme.smooth else 1.0, row_spacing=spacing
        )

    @cached_property
    def _kernel_scheme(self) -> NodalScheme:
        s = self.scheme
        return NodalScheme(
            mirrored=self.mirrored, penalty=s.penalty, pinion_share=PINION_SHARE[s.slave], lodm_profile=s.lodm_profile,
            lodm_width=s.lodm_width, smooth=s.smooth, direct=s.direct, parabolic=s.parabolic, foot_step=FOOT_STEP,
        )  # fmt: skip

    def for_kernels(self, assembly: Assembly) -> Pair:
        """Return the pair as the kernels see it, with the wheel's axis in a place and flanks that deviate."""
        kinematics, deviations = self.kinematics(assembly.misalignment), self.deviations(assembly)
        return Pair(kinematics, self.gears, self.extents, self.limits, self._kernel_scheme, deviations)

    def clearance(self, assembly: Assembly) -> float:
        """Return the share of the windows' depth at which a row of points counts as clear of the mate.

        Deviations of the flanks, which the depth contains, may close the gap again behind a row.
        """
        return FACET_CLEARANCE if assembly.modified else self.scheme.clearance


def least_radius(meshed: MeshedPair) -> float:
    """Return the bottom of the radii of curvature, mm."""
    return 0.1 * meshed.pair.pinion.module


def as_penalty(meshed: MeshedPair) -> PenaltyPair:
    """Return a meshed pair that is known to be one of penalty contact."""
    if not isinstance(meshed, PenaltyPair):
        raise TypeError("needs a pair of penalty contact, and this one is of line contact")
    return meshed


def refined_extents(flank: Flank, scheme: ContactScheme, mirrored: bool = False) -> FloatArray:
    """Return the half distances of each refined point of a flank to its neighbours.

    Parameters
    ----------
    mirrored : bool
        The last column is the plane of symmetry of a half.

    Returns
    -------
    ndarray, shape (n lodm_profile + 1, m lodm_width + 1, 4)
        Towards root and tip, and across the profile towards -z and +z, mm.
    """
    points = _refined_points(flank.nodes, scheme, mirrored)
    extents = np.zeros((*points.shape[:2], 4))
    along = 0.5 * np.linalg.norm(np.diff(points, axis=0), axis=-1)
    across_half = 0.5 * np.linalg.norm(_across_profile(points), axis=-1)
    extents[1:, :, 0], extents[:-1, :, 1] = along, along
    extents[:, 1:, 2], extents[:, :-1, 3] = across_half, across_half
    return extents


def _across_profile(points: FloatArray) -> FloatArray:
    """Chords from column to column, without their part along the profile: areas are products of extents."""
    profile = np.gradient(points, axis=0)
    profile = profile[:, 1:] + profile[:, :-1]
    chord = np.diff(points, axis=1)
    along = np.sum(chord * profile, axis=-1, keepdims=True) / np.sum(profile**2, axis=-1, keepdims=True)
    return np.asarray(chord - along * profile)


def _refined_points(nodes: FloatArray, scheme: ContactScheme, mirrored: bool) -> FloatArray:
    elements, across = nodes.shape[0] - 1, nodes.shape[1] - 1
    points = np.empty((elements * scheme.lodm_profile + 1, across * scheme.lodm_width + 1, 3))
    surface = prepare_surface(nodes, True, True, scheme.smooth, scheme.parabolic, mirrored)
    refine(surface, 0, elements, scheme.lodm_profile, scheme.lodm_width, points)
    return points
