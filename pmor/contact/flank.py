"""What the contact search knows of a pair of meshed gears: the two flanks, the scheme, and the kinematics."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pmor.arrays import FloatArray
from pmor.contact.condition import Axes
from pmor.contact.kernel import prepare_surface, refine, section_offset
from pmor.gear.pair import GearPair

# Share of the approach by which flanks interpenetrate where they meet, and which windows must hold: the rest is
# deflection of the teeth as a whole. Facets also stand off the involute between their edges. Too small costs a
# repetition with a larger window, never accuracy.
LOCAL_SHARE = 1.0 / 16.0
# Last step to a foot, in elements: changes the gap by its square times the element's sagitta, which is nothing.
FOOT_STEP = 1e-6

# Gauss points in each piece of a strip: exact for the pressure of a gap that is a cubic over the arc length.
STRIP_POINTS = 3

KIND = {"nodal": 0, "strip": 1, "line": 2}
KernelScheme = tuple[int, int, bool, bool, bool, bool, float, float, float, int, FloatArray]


@dataclass(frozen=True)
class ContactScheme:
    """How contact is evaluated.

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
    kind : {"nodal", "strip", "line"}
        Refined surface points under the penalty law; penalty pressure integrated over the strips of contact on
        exact flanks; or one line load for each section (`pmor.contact.line_contact`). All of the above but `slave` and
        `penalty` belongs to the nodal scheme; strips use those two, lines none.
    """

    surface: str
    projection: str
    slave: str
    edge_normals: str
    lodm_profile: int
    lodm_width: int
    penalty: float
    kind: str = "nodal"

    @property
    def exact(self) -> bool:
        """Whether the flanks are involutes, not surfaces through nodes."""
        return self.kind != "nodal"

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


@dataclass(frozen=True)
class Flank:
    """Loaded flank of a gear, undeformed, in the tooth frame.

    Parameters
    ----------
    nodes : ndarray, shape (n + 1, m + 1, 3)
        From the start of the involute to the tip, along +z, mm.
    roll_angle : ndarray, shape (n + 1,)
        rad.
    extents : ndarray, shape (n lodm_profile + 1, m lodm_width + 1, 4)
        Half distances of each refined point to its neighbours towards root, tip, -z, +z, mm; of each node for exact
        flanks, which are not refined.
    """

    nodes: FloatArray
    roll_angle: FloatArray
    extents: FloatArray

    @property
    def element_rows(self) -> int:
        """Number of elements along the profile."""
        return self.nodes.shape[0] - 1

    @property
    def columns(self) -> int:
        """Number of nodes along the width."""
        return self.nodes.shape[1]


@dataclass(frozen=True)
class SurfaceLayer:
    """Layer below a gear's loaded flank that a closed form stands for in the scheme "line".

    Parameters
    ----------
    depth : ndarray, shape (n + 1,)
        Below each row of flank nodes, mm.
    compliance : float
        2 (1 - nu^2) / (pi E), mm^2/N.
    constant : ndarray, shape (n + 1,)
        ln(2 depth) + 1/2 + a of the approach (`pmor.contact.line_contact`).
    columns : int
        Elements through the layer.
    """

    depth: FloatArray
    compliance: float
    constant: FloatArray
    columns: int


@dataclass(frozen=True)
class MeshedPair:
    """A gear pair with meshed flanks and a contact scheme.

    Parameters
    ----------
    pair : GearPair
    pinion, wheel : Flank
    scheme : ContactScheme
    stiffness_estimate : float
        Rough stiffness of one tooth pair along the line of action, N/mm: where searches start, how large windows are.
    mirrored : bool
        The flanks are halves up to a plane of symmetry at mid width; every contact point counts twice.
    layers : two SurfaceLayer
        Of pinion and wheel; only the scheme "line" has them.
    """

    pair: GearPair
    pinion: Flank
    wheel: Flank
    scheme: ContactScheme
    stiffness_estimate: float
    mirrored: bool = False
    layers: tuple[SurfaceLayer, ...] = ()

    @property
    def section_widths(self) -> FloatArray:
        """Share of the face width of each column of nodes (the trapezoidal rule), shape (m + 1,), mm."""
        half = 0.5 * np.diff(self.pinion.nodes[0, :, 2])
        return np.asarray(np.append(half, 0.0) + np.insert(half, 0, 0.0))

    def kinematics(self, axes: Axes) -> FloatArray:
        """Kinematics with the wheel's axis in a place, for the kernel (`pmor.contact.kernel`, windows)."""
        pair, width = self.pair, self.pair.face_width
        smallest_radius = 0.1 * pair.pinion.module
        spacing = 2.0 * max(float(flank.extents[:, :, :2].max()) for flank in (self.pinion, self.wheel))
        local = LOCAL_SHARE if self.scheme.smooth or self.scheme.exact else 1.0
        if self.scheme.kind == "line":
            spacing = 0.0  # contact is where the line of action is, not in rows of points around it
        axis = 1e-3 * np.array([0.0, axes.centre_distance_um, axes.out_of_plane_um / width, axes.in_plane_um / width])
        geometry = np.array([pair.action_length, pair.working_pressure_angle, pair.centre_distance, pair.pitch,
                             *pair.roll_position_range, smallest_radius, local, spacing, *axis, 0.0])  # fmt: skip
        first = min(section_offset(geometry, self.gears, side * 0.5 * width)[3] for side in (-1.0, 1.0))
        geometry[-1] = first / pair.pinion.base_radius
        return geometry

    @cached_property
    def gears(self) -> tuple[tuple[FloatArray, ...], ...]:
        """Flanks for the kernel: nodes, roll angles, extents, circles, layer and widths of sections of both gears."""
        flanks, teeth = (self.pinion, self.wheel), (self.pair.pinion, self.pair.wheel)
        none = SurfaceLayer(np.empty(0), 0.0, np.empty(0), 0)
        return tuple(
            (flank.nodes, flank.roll_angle, flank.extents,
             np.array([tooth.base_radius, tooth.form_roll_angle, tooth.tip_roll_angle, tooth.base_half_angle,
                       layer.compliance]), layer.constant, self.section_widths)
            for flank, tooth, layer in zip(flanks, teeth, self.layers or (none, none), strict=True)
        )  # fmt: skip

    @cached_property
    def kernel_scheme(self) -> KernelScheme:
        """Contact scheme for the kernel; a negative slave mode lets the gear whose tip is nearer be the slave."""
        s = self.scheme
        mode = {"pinion": 1.0, "wheel": 0.0, "both": 0.5, "tip": -1.0}[s.slave]
        return (s.lodm_profile, s.lodm_width, s.smooth, s.direct, s.parabolic, self.mirrored, s.penalty, FOOT_STEP,
                mode, KIND[s.kind], np.stack(np.polynomial.legendre.leggauss(STRIP_POINTS), axis=-1))  # fmt: skip

    def expected_approach(self, torque: float) -> float:
        """Return the approach of the flanks to expect under a pinion torque (N mm), mm."""
        return torque / self.pair.pinion.base_radius / self.stiffness_estimate

    def expected_closing(self, torque: float, axes: Axes) -> float:
        """Return how far the first touching sections of flanks on tilted axes close up under a torque (N mm), mm.

        The gap grows evenly over the face width, which carries load as far as it is closed, like a bed of springs.
        """
        approach, spread = self.expected_approach(torque), axes.spread
        return approach + 0.5 * spread if approach > 0.5 * spread else math.sqrt(2.0 * approach * spread)


def make_flank(
    nodes: FloatArray, roll_angle: FloatArray, scheme: ContactScheme, mirrored: bool = False
) -> Flank:
    """Prepare a flank for the contact search.

    Parameters
    ----------
    nodes : ndarray, shape (n + 1, m + 1, 3)
        From the start of the involute to the tip, along +z, in the tooth frame, mm.
    roll_angle : ndarray, shape (n + 1,)
        rad.
    scheme : ContactScheme
    mirrored : bool
        The last column is the plane of symmetry of a half.

    Returns
    -------
    Flank
    """
    nodes = np.ascontiguousarray(nodes)
    points = nodes if scheme.exact else _refined_points(nodes, scheme, mirrored)
    extents = np.zeros((*points.shape[:2], 4))
    along = 0.5 * np.linalg.norm(np.diff(points, axis=0), axis=-1)
    across_half = 0.5 * np.linalg.norm(np.diff(points, axis=1), axis=-1)
    extents[1:, :, 0], extents[:-1, :, 1] = along, along
    extents[:, 1:, 2], extents[:, :-1, 3] = across_half, across_half
    return Flank(nodes, np.ascontiguousarray(roll_angle), extents)


def _refined_points(nodes: FloatArray, scheme: ContactScheme, mirrored: bool) -> FloatArray:
    elements, across = nodes.shape[0] - 1, nodes.shape[1] - 1
    points = np.empty((elements * scheme.lodm_profile + 1, across * scheme.lodm_width + 1, 3))
    along_rows, along_columns = np.empty((*nodes.shape[:2], 2, 3)), np.empty((*nodes.shape[:2], 2, 3))
    prepare_surface(nodes, True, True, scheme.smooth, scheme.parabolic, mirrored, along_rows, along_columns)
    refine(nodes, along_rows, along_columns, scheme.smooth, 0, elements, scheme.lodm_profile, scheme.lodm_width,
           points)  # fmt: skip
    return points
