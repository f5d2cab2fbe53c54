"""What the contact search knows of a pair of meshed gears: the two flanks, the scheme, and the kinematics."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.gear.condition import Assembly, Misalignment
from pmor.gear.flank_deviation import kernel_deviation
from pmor.gear.kernels.deviation import NO_DEVIATION, Deviation
from pmor.gear.kernels.motion import axial_opening, section_offset
from pmor.gear.kernels.types import Gear, Kinematics, LineScheme, NodalScheme, Pair, Sections, StripScheme
from pmor.gear.pair import GearPair
from pmor.gear.tip_edge import TipEdge
from pmor.gear.tooth import Tooth
from pmor.line.kernels.tip_corner import Corner
from pmor.line.sections import flank_sections
from pmor.line.tip_corner import INFLUENCE_LENGTH, corner_coefficients, wedge_softness
from pmor.penalty.kernels.surface import prepare_surface, refine

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

# Gauss points in each piece of a strip: exact for the pressure of a gap that is a cubic over the arc length.
STRIP_POINTS = 3

# Negative: the gear whose tip is nearer is the slave.
PINION_SHARE = {"pinion": 1.0, "wheel": 0.0, "both": 0.5, "tip": -1.0}


@dataclass(frozen=True)
class ContactScheme:
    """How contact is evaluated.

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
    kind : {"nodal", "strip", "line"}
        Refined surface points under the penalty law; penalty pressure integrated over the strips of contact on
        exact flanks; or one line load for each section (`pmor.line.hertz`). All of the above but `slave` and
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

    @property
    def clearance(self) -> float:
        """Share of the windows' depth at which a row of points counts as clear of the mate."""
        return SMOOTH_CLEARANCE if self.smooth or self.exact else FACET_CLEARANCE


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
        Half distances of each refined point to its neighbours towards root and tip, and across the profile towards -z
        and +z, mm; of each node for exact flanks, which are not refined.
    """

    nodes: FloatArray
    roll_angle: FloatArray
    extents: FloatArray

    @property
    def element_rows(self) -> int:
        """Number of patches between nodes along the profile: elements, or halves of quadratic ones."""
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
        ln(2 depth) + 1/2 + a of the approach (`pmor.line.hertz`).
    columns : int
        Columns of nodes above the layer's inner face.
    poisson_ratio : float
    """

    depth: FloatArray
    compliance: float
    constant: FloatArray
    columns: int
    poisson_ratio: float


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
    order : int
        Intervals between nodes along the edge of an element.
    """

    pair: GearPair
    pinion: Flank
    wheel: Flank
    scheme: ContactScheme
    stiffness_estimate: float
    mirrored: bool = False
    layers: tuple[SurfaceLayer, ...] = ()
    order: int = 1

    def kinematics(self, misalignment: Misalignment) -> Kinematics:
        """Kinematics for the kernels, with the wheel's axis in a place."""
        pair, width = self.pair, self.pair.face_width
        spacing = 2.0 * max(float(flank.extents[:, :, :2].max()) for flank in (self.pinion, self.wheel))
        if self.scheme.kind == "line":
            spacing = 0.0  # contact is where the line of action is, not in rows of points around it
        (start, end), (low, high) = pair.roll_position_range, pair.common_face
        kinematics = Kinematics(
            action_length=pair.action_length,
            pressure_angle=pair.working_pressure_angle,
            centre_distance=pair.centre_distance,
            pitch=pair.pitch,
            path_start=start,
            path_end=end,
            least_radius=0.1 * pair.pinion.module,
            local_share=LOCAL_SHARE if self.scheme.smooth or self.scheme.exact else 1.0,
            row_spacing=spacing,
            offset_y=1e-3 * misalignment.centre_distance_um,
            slope_x=1e-3 * (misalignment.out_of_plane_um / width),
            slope_y=1e-3 * (misalignment.in_plane_um / width),
            face_low=low,
            face_high=high,
        )
        across = min(section_offset(kinematics, self.gears, side * 0.5 * width)[3] for side in (-1.0, 1.0))
        along = min(axial_opening(kinematics, self.gears, roll) for roll in pair.pinion_roll_range)
        return kinematics._replace(first_touch=(across + along) / pair.pinion.base_radius)

    @cached_property
    def sections(self) -> Sections:
        """Where line contact is evaluated; of other schemes too, for their bodies' compliance."""
        helical = self.pair.pinion.helix_angle != 0.0
        return flank_sections(self.pinion.nodes[0, :, 2], self.wheel.nodes[0, :, 2], helical, self.order)

    @cached_property
    def gears(self) -> tuple[Gear, Gear]:
        """Flanks of pinion and wheel for the kernels."""
        none = SurfaceLayer(np.empty(0), 0.0, np.empty(0), 0, 0.0)
        layers = self.layers or (none, none)
        flanks, teeth = (self.pinion, self.wheel), (self.pair.pinion, self.pair.wheel)
        pinion, wheel = map(_gear, flanks, teeth, self.pair.tip_edges, layers)
        return pinion, wheel

    @cached_property
    def _kernel_scheme(self) -> LineScheme | StripScheme | NodalScheme:
        s = self.scheme
        if s.kind == "line":
            return LineScheme(True, self.mirrored)
        if s.kind == "strip":
            points, weights = np.polynomial.legendre.leggauss(STRIP_POINTS)
            return StripScheme(True, self.mirrored, s.penalty, PINION_SHARE[s.slave], points, weights)
        return NodalScheme(
            False, self.mirrored, s.penalty, PINION_SHARE[s.slave], s.lodm_profile, s.lodm_width, s.smooth, s.direct,
            s.parabolic, FOOT_STEP,
        )  # fmt: skip

    def for_kernels(self, assembly: Assembly) -> Pair:
        """Return the pair as the kernels see it, with the wheel's axis in a place and flanks that deviate."""
        deviations = self.deviations(assembly) if assembly.modified else (NO_DEVIATION, NO_DEVIATION)
        sections = self.sections if self.scheme.exact else None
        return Pair(self.kinematics(assembly.misalignment), self.gears, self._kernel_scheme, sections, deviations)

    def deviations(self, assembly: Assembly) -> tuple[Deviation, Deviation]:
        """Return what the flanks of pinion and wheel deviate by, for the kernels."""
        pair = self.pair
        pinion = kernel_deviation(assembly.pinion, pair.pinion, pair.active_rolls[0], pair.faces[0])
        return pinion, kernel_deviation(assembly.wheel, pair.wheel, pair.active_rolls[1], pair.faces[1])

    def clearance(self, assembly: Assembly) -> float:
        """Return the share of the windows' depth at which a row of points counts as clear of the mate.

        Deviations of the flanks, which the depth contains, may close the gap again behind a row.
        """
        return FACET_CLEARANCE if assembly.modified else self.scheme.clearance

    def expected_approach(self, torque: float) -> float:
        """Return the approach of the flanks to expect under a pinion torque (N mm), mm."""
        return torque / self.pair.pinion.base_radius / self.stiffness_estimate

    def expected_closing(self, torque: float, misalignment: Misalignment) -> float:
        """Return how far the first touching sections of flanks on tilted axes close up under a torque (N mm), mm.

        The gap grows evenly over the face width, which carries load as far as it is closed, like a bed of springs.
        """
        approach, spread = self.expected_approach(torque), misalignment.spread
        return approach + 0.5 * spread if approach > 0.5 * spread else math.sqrt(2.0 * approach * spread)


def _gear(flank: Flank, tooth: Tooth, edge: TipEdge, layer: SurfaceLayer) -> Gear:
    return Gear(
        flank.nodes, flank.roll_angle, flank.extents, tooth.base_radius, tooth.form_roll_angle, edge.roll_angle,
        tooth.base_half_angle, layer.compliance, layer.constant, tooth.twist_per_length, edge.radius,
        _corner(tooth, edge, layer),
    )  # fmt: skip


def _corner(tooth: Tooth, edge: TipEdge, layer: SurfaceLayer) -> Corner:
    if len(layer.depth) == 0:
        return Corner(0.0, 0.0, 0.0, 0.0, np.empty((3, 0, 0)))
    angle = 0.5 * math.pi + math.acos(tooth.base_radius / tooth.tip_radius)
    place = 0.5 * tooth.base_radius * (tooth.tip_roll_angle**2 - edge.roll_angle**2)
    return Corner(
        place, float(layer.depth[-1]), INFLUENCE_LENGTH, wedge_softness(angle) - 1.0,
        corner_coefficients(angle, layer.poisson_ratio),
    )  # fmt: skip


def make_flank(nodes: FloatArray, roll_angle: FloatArray, scheme: ContactScheme, mirrored: bool = False) -> Flank:
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
    across_half = 0.5 * np.linalg.norm(_across_profile(points), axis=-1)
    extents[1:, :, 0], extents[:-1, :, 1] = along, along
    extents[:, 1:, 2], extents[:, :-1, 3] = across_half, across_half
    return Flank(nodes, np.ascontiguousarray(roll_angle), extents)


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
