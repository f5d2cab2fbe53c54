"""From a case to the mechanical model: geometry, meshes, elastic gears, contact."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from pmor.case import Case, GearCase
from pmor.case.checks import refuse_uneven_sections
from pmor.case.width import meshed_width
from pmor.core.arrays import FloatArray
from pmor.core.errors import GeometryError, MeshError
from pmor.core.threads import one_thread
from pmor.fe.element import MeshQuality, mesh_quality
from pmor.fe.fillet import build_fillet
from pmor.fe.outline import tooth_outline
from pmor.fe.sector import SectorMesh, build_sector
from pmor.fe.surface_layer import surface_layer
from pmor.gear.clearance import refuse_interference, refuse_working_geometry
from pmor.gear.meshed_pair import Flank, MeshedPair
from pmor.gear.pair import GearPair, zero_backlash_centre_distance
from pmor.gear.ring_root import Shaper
from pmor.gear.tip_edge import TipEdge, tip_edge
from pmor.gear.tooth import Tooth
from pmor.line.hertz import approach_constants, check_half_width, line_compliance
from pmor.line.layered_pair import LayeredPair, SurfaceLayer, layers_of
from pmor.pair.blank import interface_radius, stands_on_blank
from pmor.pair.conditions import misalignments_of
from pmor.pair.limits import largest_torque, refuse_bent_blank, refuse_impossible_load, refuse_lost_load
from pmor.pair.modifications import refuse_modifications_off_the_flank
from pmor.penalty.elasticity import full_elasticity
from pmor.penalty.equilibrium import round_off_residual
from pmor.penalty.pair import ContactScheme, PenaltyPair

if TYPE_CHECKING:
    from pmor.body.elastic_gear import ElasticGear
    from pmor.body.far_compliance import FarTeeth
    from pmor.body.support import Support

T = TypeVar("T")

# Stiffness of one tooth pair per face width over Young's modulus: ISO 6336 gives 14 N/(mm um) for steel.
PAIR_STIFFNESS_OVER_MODULUS = 0.067


@dataclass(frozen=True)
class MeshModel:
    """The meshed pair before any finite-element solution.

    Parameters
    ----------
    pinion, wheel : SectorMesh
        The same object when the gears are of one shape.
    quality : MeshQuality
        Of the worse of the two meshes.
    """

    pinion: SectorMesh
    wheel: SectorMesh
    quality: MeshQuality
    meshed: MeshedPair


@dataclass(frozen=True)
class ElasticModel:
    """The full finite-element model of the pair.

    Parameters
    ----------
    pinion, wheel : ElasticGear
        The same object when the gears are identical.

    Raises
    ------
    ValueError
        For a compliance of another mesh, or without another layer below the flank; under penalty contact for holes.
    """

    mesh: MeshModel
    pinion: ElasticGear
    wheel: ElasticGear

    def __post_init__(self) -> None:
        """Refuse compliances of another mesh: sizes may agree, and every result be wrong."""
        for gear, (sector, body) in enumerate(((self.mesh.pinion, self.pinion), (self.mesh.wheel, self.wheel))):
            name = ("pinion", "wheel")[gear]
            if not sector.is_like(body.mesh):
                raise ValueError(f"{name}: the compliance is that of another mesh than the flanks are of")
            layers = layers_of(self.mesh.meshed)
            columns = layers[gear].columns if layers else 0
            if body.layer_columns != columns:
                raise ValueError(
                    f"{name}: contact takes {columns} columns of elements below the flank for its layer, "
                    f"the compliance is without {body.layer_columns}"
                )
        if any(self.supports) and not isinstance(self.mesh.meshed, LayeredPair):
            raise ValueError('penalty contact takes no holes in the gears: write [contact] scheme = "line"')

    @property
    def supports(self) -> tuple[Support | None, Support | None]:
        """The part of low rank of their compliance, for three components of displacement at each node of a flank."""
        return self.pinion.support, self.wheel.support

    @property
    def elasticity_at(self) -> Any:
        """Full compliance of the windows of a position, callable; under line contact the model itself."""
        if isinstance(self.mesh.meshed, LayeredPair):
            return self
        return partial(full_elasticity, self.pinion, self.wheel)

    def between(self, gear: int, offset: int) -> FloatArray:
        """Return the displacement of tooth `offset` of a gear under unit forces on tooth 0, shape (n, n), mm/N."""
        return (self.pinion, self.wheel)[gear].tooth_compliance(offset)


def gear_pair(case: Case) -> GearPair:
    """Return the geometry of a case's gear pair.

    Raises
    ------
    GeometryError
        When there are no such gears, they cannot mesh on the axes of the case, a tip meets the mate's root or fillet,
        or its edge does not fit.
    CaseError
        When modifications do not lie on the flanks.
    """
    pair, width = case.pair, case.pair.face_width_mm
    pinion, wheel = _tooth(case, pair.pinion, 1.0), _tooth(case, pair.wheel, -1.0)
    distance = zero_backlash_centre_distance(pinion, wheel)
    if pair.centre_distance_mm is not None:
        distance = pair.wheel.sign * pair.centre_distance_mm
    edges = _tip_edge("pinion", pair.pinion, pinion), _tip_edge("wheel", pair.wheel, wheel)
    made = GearPair(pinion, wheel, width, distance, pair.pinion.face(width), pair.wheel.face(width), *edges)
    refuse_interference(made)
    refuse_modifications_off_the_flank(case, made)
    refuse_working_geometry(made, misalignments_of(case))
    return made


def _tip_edge(name: str, gear: GearCase, tooth: Tooth) -> TipEdge:
    try:
        return tip_edge(tooth, gear.tip_rounding_mm, gear.tip_chamfer_mm)
    except GeometryError as error:
        raise GeometryError(f"[{name}] {error}") from None


def contact_scheme(case: Case) -> ContactScheme:
    """Return the scheme of penalty contact of a case."""
    c = case.contact
    surface = "facet" if c.scheme == "facet" else "hermite"
    projection = "facet" if c.scheme == "paper" else "patch"
    edge_normals = c.edge_normals or ("average" if c.scheme == "paper" else "parabolic")
    return ContactScheme(surface, projection, c.slave, edge_normals, c.lodm_profile, c.lodm_width, c.penalty_N_mm3)


def stiffness_estimate(case: Case, pair: GearPair) -> float:
    """Return a rough stiffness of one tooth pair, N/mm."""
    moduli = [gear.youngs_modulus_GPa * 1e3 for gear in (case.pair.pinion, case.pair.wheel)]
    return PAIR_STIFFNESS_OVER_MODULUS * 2.0 / sum(1.0 / e for e in moduli) * pair.common_width


def approach_estimate(case: Case, pair: GearPair) -> float:
    """Return a rough approach of the flanks under the nominal torque, mm."""
    return 1e3 * case.torque_Nm / pair.pinion.base_radius / stiffness_estimate(case, pair)


def held_radii(case: Case, pair: GearPair) -> tuple[float, float]:
    """Return the radii at which pinion and wheel are held, mm.

    Those of their bores; of a ring that of its outside, negative.
    """
    return _held_radius(case.pair.pinion, pair.pinion), _held_radius(case.pair.wheel, pair.wheel)


def _held_radius(gear: GearCase, tooth: Tooth) -> float:
    if gear.bore_radius_mm is not None:
        return gear.bore_radius_mm
    return tooth.root_radius - (gear.rim_thickness_mm or 0.0)


def sector_ends(case: Case, pair: GearPair) -> tuple[float, float]:
    """Return the radii at which the sectors of pinion and wheel end, mm: where they are held, or on a blank's rim."""
    ends = list(held_radii(case, pair))
    for place, (gear, tooth) in enumerate(((case.pair.pinion, pair.pinion), (case.pair.wheel, pair.wheel))):
        if stands_on_blank(gear, case):
            ends[place] = interface_radius(gear, case, tooth)
    return ends[0], ends[1]


def sector_meshes(case: Case, pair: GearPair) -> tuple[SectorMesh, SectorMesh]:
    """Mesh a tooth sector of pinion and wheel; gears of one shape share one mesh unless the case says otherwise.

    GeometryError or MeshError where there is no such gear.
    """
    faces, ends = pair.faces, sector_ends(case, pair)
    pinion = _sector(case, case.pair.pinion, pair.pinion, faces[0], ends[0])
    gears = case.pair.pinion, case.pair.wheel
    # Where holes stand to the line of centres, they stand otherwise to the teeth of pinion and wheel.
    cyclic = not any(gear.repeats(pair.face_width) for gear in gears)
    alike = pair.pinion == pair.wheel and faces[0] == faces[1] and ends[0] == ends[1]
    stand = [stands_on_blank(gear, case) for gear in gears]
    same = case.mesh.share_identical and alike and cyclic and stand[0] == stand[1]
    return pinion, pinion if same else _sector(case, case.pair.wheel, pair.wheel, faces[1], ends[1])


def same_body(case: Case, pinion: SectorMesh, wheel: SectorMesh) -> bool:
    """Return whether the gears are identical, material and all: then one finite-element model stands for both."""
    return wheel is pinion and case.pair.pinion == case.pair.wheel


def mesh_model(case: Case) -> MeshModel:
    """Mesh both gears of a case.

    Raises
    ------
    CaseError
        When the load is beyond any geometry of contact.
    GeometryError, MeshError
    """
    pair = gear_pair(case)
    refuse_loads_of_bodies(case, pair)
    pinion, wheel = sector_meshes(case, pair)
    qualities = [mesh_quality(mesh.nodes, mesh.elements) for mesh in (pinion, wheel)]
    meshed = assemble_pair(case, pair, (pinion.flank_nodes, wheel.flank_nodes),
                           (pinion.flank_roll_angle, wheel.flank_roll_angle), surface_layers(case, pair),
                           pinion.mirrored)  # fmt: skip
    refuse_loads(case, meshed)
    return MeshModel(pinion, wheel, min(qualities, key=lambda q: q.min_scaled_jacobian), meshed)


def refuse_loads_of_bodies(case: Case, pair: GearPair) -> None:
    """Refuse loads of training and sweep that teeth or blanks cannot bear, as far as this shows before meshing.

    Raises
    ------
    CaseError, GeometryError
    """
    refuse_impossible_load(case, approach_estimate(case, pair))
    refuse_bent_blank(case, pair, held_radii(case, pair))


def refuse_loads(case: Case, meshed: MeshedPair) -> None:
    """Refuse loads of training and sweep beyond the range of the contact model, or lost in round-off.

    CaseError or GeometryError says which.
    """
    refuse_loads_of_bodies(case, meshed.pair)
    if isinstance(meshed, PenaltyPair):
        refuse_lost_load(case, partial(round_off_residual, meshed))
    if isinstance(meshed, LayeredPair):
        refuse_lost_load(case, meshed.round_off)
        rolls = meshed.pinion.roll_angle, meshed.wheel.roll_angle
        check_half_width(meshed.pair, meshed.layers, rolls, 1e3 * largest_torque(case)[0])


def refuse_loads_unmeshed(case: Case) -> None:
    """Refuse loads as `refuse_loads` does before anything is meshed, but for those lost in round-off."""
    pair = gear_pair(case)
    refuse_loads_of_bodies(case, pair)
    if case.contact.kind == "line":
        mesh = case.mesh
        rolls = [
            tooth_outline(tooth, mesh.profile_elements, mesh.spacing, mesh.order).flank_roll_angle
            for tooth in (pair.pinion, pair.wheel)
        ]
        check_half_width(pair, surface_layers(case, pair), rolls, 1e3 * largest_torque(case)[0])


def assemble_pair(
    case: Case, pair: GearPair, nodes: tuple[FloatArray, FloatArray], roll_angles: tuple[FloatArray, FloatArray],
    layers: tuple[SurfaceLayer, ...] = (), mirrored: bool = False,
) -> MeshedPair:  # fmt: skip
    """Put two meshed flanks (pinion first) and the case's contact scheme together.

    Parameters
    ----------
    nodes : two ndarrays, shape (n + 1, m + 1, 3)
        mm.
    roll_angles : two ndarrays, shape (n + 1,)
        rad.
    layers : two SurfaceLayer
        Below the flanks, of the scheme "line" alone.
    mirrored : bool
        The flanks are halves up to a plane of symmetry at their last column.

    Raises
    ------
    CaseError
        For helical gears, and unequal faces, in schemes that take all sections for alike.
    """
    refuse_uneven_sections(case, case.name)
    pinion, wheel = (
        Flank(np.ascontiguousarray(n), np.ascontiguousarray(u)) for n, u in zip(nodes, roll_angles, strict=True)
    )
    common = pair, pinion, wheel, stiffness_estimate(case, pair), mirrored, case.mesh.order
    if case.contact.kind == "line":
        plane_strain = case.mesh.width == "plane_strain"
        return LayeredPair(*common, layers=(layers[0], layers[1]), plane_strain=plane_strain)
    return PenaltyPair(*common, scheme=contact_scheme(case))


def surface_layers(case: Case, pair: GearPair) -> tuple[SurfaceLayer, ...]:
    """Return the layers below the flanks of pinion and wheel, on the mesh that a case asks for; none without lines."""
    if case.contact.kind != "line":
        return ()
    return _layer(case, case.pair.pinion, pair.pinion), _layer(case, case.pair.wheel, pair.wheel)


@one_thread()
def elastic_model(case: Case, mesh: MeshModel, keep_volume: bool = False) -> ElasticModel:
    """Solve for the flank compliance of both gears; identical gears share one.

    Parameters
    ----------
    keep_volume : bool
        Keep the factors for back-substitution to the volume.
    """

    def build(sector: SectorMesh, gear: GearCase) -> ElasticGear:
        return solved_gear(case, mesh, sector, gear, keep_volume)

    return ElasticModel(mesh, *per_gear(case, mesh, build))


@one_thread()
def solved_gear(
    case: Case, mesh: MeshModel, sector: SectorMesh, gear: GearCase, keep_volume: bool = False,
    far: FarTeeth | None = None,
) -> ElasticGear:  # fmt: skip
    """Solve for the flank compliance of one gear of a pair.

    Parameters
    ----------
    sector : SectorMesh
        Of the gear: one of those in `mesh`.
    keep_volume : bool
        Keep the factors for back-substitution to the volume.
    far : FarTeeth, optional
        Teeth beyond the neighbours that are loaded together with a tooth.
    """
    from pmor.body.elastic_gear import elastic_gear  # with scipy, which a sweep with a basis does without
    from pmor.pair.blank import blank_below

    layers, pair = layers_of(mesh.meshed), mesh.meshed.pair
    place, tooth = (0, pair.pinion) if sector is mesh.pinion else (1, pair.wheel)
    return elastic_gear(
        sector, gear.youngs_modulus_GPa * 1e3, gear.poisson_ratio, case.mesh.element, pair.neighbouring_teeth,
        keep_volume, layers[place].columns if layers else 0, build_fillet(tooth, sector) if case.root_stress else None,
        far, blank_below(case, gear, tooth, sector, place),
    )  # fmt: skip


def model_of_solved(case: Case, mesh: MeshModel, solved: ElasticModel) -> ElasticModel:
    """Return the model of a case whose gears are those of a solved one, under another contact scheme.

    Finite elements are solved again only where its mesh is another, or its layer below the flank one that was not
    taken out.

    Parameters
    ----------
    mesh : MeshModel
        Of the case.
    """
    from pmor.body.elastic_gear import with_layer

    sectors, bodies = (mesh.pinion, mesh.wheel), (solved.pinion, solved.wheel)
    layers = layers_of(mesh.meshed)
    if not layers:
        pinion = with_layer(solved.pinion)
        bodies = pinion, pinion if solved.wheel is solved.pinion else with_layer(solved.wheel)
    alike = all(sector.is_like(body.mesh) for sector, body in zip(sectors, bodies, strict=True))
    columns = [layer.columns for layer in layers] or [0, 0]
    if alike and columns == [body.layer_columns for body in bodies]:
        return ElasticModel(mesh, *bodies)
    return elastic_model(case, mesh)


def per_gear(case: Case, mesh: MeshModel, work: Callable[[SectorMesh, GearCase], T]) -> tuple[T, T]:
    """Do a piece of work for pinion and wheel, once if they are identical."""
    gears = case.pair.pinion, case.pair.wheel
    pinion = work(mesh.pinion, gears[0])
    return pinion, pinion if same_body(case, mesh.pinion, mesh.wheel) else work(mesh.wheel, gears[1])


def _layer(case: Case, gear: GearCase, tooth: Tooth) -> SurfaceLayer:
    wanted = case.contact.layer_depth * case.pair.module_mm
    columns, depth = surface_layer(tooth, case.mesh.profile_elements, case.mesh.spacing, wanted, case.mesh.order)
    compliance = line_compliance(gear.youngs_modulus_GPa * 1e3, gear.poisson_ratio)
    return SurfaceLayer(depth, compliance, approach_constants(depth, gear.poisson_ratio), columns,
                        gear.poisson_ratio)  # fmt: skip


def _tooth(case: Case, gear: GearCase, hand: float) -> Tooth:
    said, shaper = gear.shaper, None
    if said is not None:
        shaper = Shaper(said.teeth, said.addendum, said.tip_radius_mm, said.profile_shift)
    arc = gear.rack_tip_radius * case.pair.module_mm if gear.root_fillet_mm is None else gear.root_fillet_mm
    return Tooth(
        teeth=gear.sign * gear.teeth, module=case.pair.module_mm,
        pressure_angle=math.radians(case.pair.pressure_angle_deg),
        helix_angle=hand * math.radians(case.pair.helix_angle_deg), profile_shift=gear.profile_shift,
        addendum=gear.addendum, dedendum=gear.dedendum, rack_tip_radius=gear.rack_tip_radius,
        thickness_allowance=0.5 * sum(gear.thickness_allowances_mm), tip_shortening=gear.tip_shortening_mm,
        shaper=shaper, root_fillet=arc if gear.internal and not shaper else 0.0,
    )  # fmt: skip


def _sector(case: Case, gear: GearCase, tooth: Tooth, face: tuple[float, float], end_mm: float) -> SectorMesh:
    mesh = case.mesh
    try:
        sector = build_sector(tooth, end_mm, face[1] - face[0], mesh.profile_elements, mesh.width_elements,
                              mesh.spacing, meshed_width(case), gear.face_offset_mm, mesh.order)  # fmt: skip
        return replace(sector, on_blank=stands_on_blank(gear, case))
    except MeshError as error:
        raise MeshError(f"gear with {gear.teeth} teeth: {error}") from error
