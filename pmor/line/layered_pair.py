"""A meshed pair under line contact: layers below its flanks, and the sections that carry the line loads."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.gear.condition import ALIGNED, Misalignment
from pmor.gear.meshed_pair import MeshedPair
from pmor.gear.tip_edge import TipEdge
from pmor.gear.tooth import Tooth
from pmor.line.face_ends import layer_coupling
from pmor.line.hubs import Hubs
from pmor.line.kernels.places import Lines, Places, place_flanks, place_lines
from pmor.line.kernels.tip_corner import Corner, Corners
from pmor.line.kernels.types import Layer, Sections
from pmor.line.sections import flank_sections
from pmor.line.tip_corner import INFLUENCE_LENGTH, corner_coefficients, wedge_softness


@dataclass(frozen=True)
class SurfaceLayer:
    """Layer below a gear's loaded flank that the law of the line load stands for.

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
    """

    depth: FloatArray
    compliance: float
    constant: FloatArray
    columns: int
    poisson_ratio: float


@dataclass(frozen=True, kw_only=True)
class LayeredPair(MeshedPair):
    """A meshed pair whose flanks stand on surface layers.

    Parameters
    ----------
    layers : two SurfaceLayer
        Of pinion and wheel.
    plane_strain : bool
        All sections deform alike: the face has no ends.
    hubs : Hubs, optional
        What the hubs stand on; by default they are held.
    """

    layers: tuple[SurfaceLayer, SurfaceLayer]
    plane_strain: bool = False
    hubs: Hubs | None = None

    def __post_init__(self) -> None:
        """Hubs tilt, and load both halves of the width differently."""
        if self.hubs is not None and self.mirrored:
            raise ValueError("hubs that give way take the whole width, and half of it is meshed")

    def on_hubs(self, hubs: Hubs | None) -> LayeredPair:
        """Return the pair on other hubs: nothing that was found of it, and is kept, depends on them."""
        found = replace(self, hubs=hubs)
        vars(found).update({name: value for name, value in vars(self).items() if name not in vars(found)})
        return found

    @cached_property
    def sections(self) -> Sections:
        """Where line loads are."""
        return sections_of(self)

    @property
    def carriers(self) -> tuple[tuple[IntArray, FloatArray], tuple[int, int]]:
        """Columns of nodes that carry the sections, with their shares; rows of nodes on pinion and wheel."""
        rows = len(self.pinion.roll_angle), len(self.wheel.roll_angle)
        return (self.sections.column, self.sections.share), rows

    @cached_property
    def width(self) -> FloatArray:
        """Widths of the sections with their images behind a plane of symmetry, shape (S,), mm."""
        return self.sections.width * (2.0 if self.mirrored else 1.0)

    def round_off(self, torque: float) -> float:
        """Return the relative error below which a state under a pinion torque (N mm) is round-off of coordinates."""
        return float(np.finfo(float).eps * self.pair.centre_distance / self.expected_approach(torque))

    @property
    def free_ends(self) -> bool:
        """Whether the layers end freely, at right angles to the lines of contact, and this is known (`face_ends`)."""
        return not self.plane_strain and self.pair.pinion.helix_angle == 0.0

    @cached_property
    def layer_coupling(self) -> tuple[FloatArray, FloatArray]:
        """What the layers of pinion and wheel, n deep, add between sections of a tooth pair, two of (n, S, S), mm/N."""
        pinion, wheel = (self._layer_coupling(*one) for one in zip(self.layers, self.pair.faces, strict=True))
        return pinion, wheel

    def _layer_coupling(self, layer: SurfaceLayer, face: tuple[float, float]) -> FloatArray:
        width = self.sections.width
        if not self.free_ends:
            return np.zeros((len(layer.depth), len(width), len(width)))
        edges = self.pair.common_face[0] + np.append(0.0, np.cumsum(width))
        known = face, layer.depth, layer.compliance, layer.poisson_ratio
        if not self.mirrored:
            return layer_coupling(edges, *known)
        # A section in the plane of symmetry is one with its image.
        inside = len(edges) - int(self.sections.z[-1] + 0.25 * width[-1] > edges[-1])
        found = layer_coupling(np.append(edges[:inside], -edges[-2::-1]), *known)[:, : len(width)]
        # Half of a force is in the image.
        return 0.5 * (found[..., : len(width)] + found[..., ::-1][..., : len(width)])

    @cached_property
    def kernel_layers(self) -> tuple[Layer, Layer]:
        """Layers of pinion and wheel for the kernels."""
        pinion, wheel = map(_layer, (self.pair.pinion, self.pair.wheel), self.pair.tip_edges, self.layers)
        return pinion, wheel

    @cached_property
    def corners(self) -> Corners:
        """Corners of the flanks."""
        pinion, wheel = self.kernel_layers
        corners = pinion.tip, wheel.tip, pinion.undercut, wheel.undercut
        numbers, coefficients = [corner[:-1] for corner in corners], [corner.coefficients for corner in corners]
        return Corners(np.array([numbers], dtype=float), np.array([coefficients]))


def as_layered(meshed: MeshedPair) -> LayeredPair:
    """Return a meshed pair that is known to be one of line contact."""
    if not isinstance(meshed, LayeredPair):
        raise TypeError("needs a pair of line contact, and this one is of penalty contact")
    return meshed


def layers_of(meshed: MeshedPair) -> tuple[SurfaceLayer, ...]:
    """Return the layers below the flanks of pinion and wheel; none under penalty contact."""
    return meshed.layers if isinstance(meshed, LayeredPair) else ()


def sections_of(meshed: MeshedPair) -> Sections:
    """Return where line contact of a pair is evaluated."""
    helical, depth = meshed.pair.pinion.helix_angle != 0.0, math.inf
    if isinstance(meshed, LayeredPair) and meshed.free_ends and not meshed.mirrored:
        depth = min(float(layer.depth[len(layer.depth) // 2]) for layer in meshed.layers)
    return flank_sections(meshed.pinion.nodes[0, :, 2], meshed.wheel.nodes[0, :, 2], helical, meshed.order, depth)


def place_flanks_of(
    meshed: MeshedPair, phi: FloatArray, misalignment: Misalignment = ALIGNED, z: FloatArray | None = None
) -> Places:
    """Find where the flanks of a pair meet, of any contact: its flanks are taken for the involutes that they stand for.

    Parameters
    ----------
    phi : ndarray, shape (n,)
        Pinion angles, rad.
    z : ndarray, shape (S,), optional
        By default of the sections in which line contact is evaluated, mm.
    """
    z = sections_of(meshed).z if z is None else z
    places: Places = place_flanks(phi, meshed.kinematics(misalignment), meshed.gears, z, meshed.tooth_pair_count)
    return places


def place_sections(
    meshed: LayeredPair, phi: FloatArray, misalignment: Misalignment = ALIGNED, components: int = 2
) -> Lines:
    """Place the sections of all tooth pairs that can touch, for line loads.

    Parameters
    ----------
    phi : ndarray, shape (n,)
        Pinion angles, rad.
    components : int
        Of displacement: 2 without, 3 with those along the axis.
    """
    lines: Lines = place_lines(
        phi, meshed.kinematics(misalignment), meshed.gears, meshed.kernel_layers, meshed.sections.z,
        meshed.tooth_pair_count, components,
    )  # fmt: skip
    return lines


def _layer(tooth: Tooth, edge: TipEdge, layer: SurfaceLayer) -> Layer:
    angle = 0.5 * math.pi + math.acos(tooth.base_radius / tooth.tip_radius)
    tip = Corner(
        place=0.5 * tooth.base_radius * (tooth.tip_roll_angle**2 - edge.roll_angle**2),
        depth=float(layer.depth[-1]),
        influence_length=INFLUENCE_LENGTH,
        excess=wedge_softness(angle) - 1.0,
        coefficients=corner_coefficients(angle, layer.poisson_ratio),
    )
    # The layer goes on below the fillet: of the table of tip corners only the wedge is left.
    undercut = Corner(
        place=0.0,
        depth=float(layer.depth[0]),
        influence_length=INFLUENCE_LENGTH,
        excess=wedge_softness(tooth.undercut_edge_angle) - 1.0,
        coefficients=np.zeros_like(tip.coefficients),
    )
    return Layer(layer.compliance, layer.constant, tip, undercut)
