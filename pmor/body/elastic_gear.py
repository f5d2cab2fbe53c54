"""Flank compliance of the whole gear from one condensed sector and the ring of equal ones: exact, not a reduction."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from pmor.body.blank import Blank, signed_teeth
from pmor.body.far_compliance import FaceResponse, FarCompliance, FarTeeth, far_compliance
from pmor.body.fillet_stress import FilletPoints, FilletStress, sector_stress
from pmor.body.on_blank import (
    OnBlank,
    on_blank,
    onto_all_nodes,
    side_coordinates,
    stress_by_the_rim,
    stress_of_the_web,
    support_on_blank,
    turned,
)
from pmor.body.rim import (
    LEAST_MOVED,
    NEIGHBOURS,
    REACH,
    RimMotion,
    RimStress,
    even_on_the_cut,
    face_patterns,
    leading,
    rim_motion,
    rim_stress,
)
from pmor.body.root_stress import other_hand
from pmor.body.support import (
    Support,
    forces_of_holes,
    moved_elsewhere,
)
from pmor.body.web_stress import WebStress
from pmor.core.arrays import FloatArray
from pmor.fe.completion import completion, nodes_of_elements
from pmor.fe.condensation import CondensedSector, condense_sector
from pmor.fe.fillet import FilletMesh
from pmor.fe.ring import ring_compliance, symmetric_coordinates
from pmor.fe.sector import SectorMesh
from pmor.fe.surface_layer import inverse_flank_stiffness

# Stress in teeth beyond the next ones, by that over the displacement of a sector's faces, (2 p c 3, m), and p, c, 3.
BeyondNeighbours = Callable[[FloatArray, tuple[int, int, int]], RimStress | None]


@dataclass(frozen=True)
class OtherFlank:
    """How a gear yields to forces on the other flanks of its teeth, where these are no images of its flanks.

    Unknowns are those in the image, x to -x.

    Parameters
    ----------
    compliance : ndarray, shape (2 neighbours + 1, n, n)
        As `ElasticGear.compliance`, with teeth counted counter-clockwise in the image.
    fillet : FilletStress or None
        On the sides and the teeth of the gear itself, where it was asked for.
    """

    compliance: FloatArray
    fillet: FilletStress | None


@dataclass(frozen=True)
class ElasticGear:
    """Cyclic part of a gear's compliance, with its bore held: C_local of equation (A) in `pmor.body`.

    Parameters
    ----------
    neighbours : int
        Number of neighbouring teeth on either side that the compliance covers.
    compliance : ndarray, shape (2 neighbours + 1, n, n)
        ``compliance[neighbours + k]`` is the displacement of the flank nodes of tooth k under unit forces on the flank
        nodes of tooth 0, each in its own tooth's frame, mm/N; n = 3 x flank nodes. Without the local compliance of
        the surface layer where that was taken out. On half the width a unit force is shared by a node and its image.
    side_displacement : ndarray, shape (2 neighbours + 2, n_left, n)
        Displacement of the left side face of sectors -neighbours - 1 ... neighbours under unit forces on the flank's
        nodes that elements have, mm/N; of no sectors unless asked for.
    interface_displacement : ndarray, shape (2 neighbours + 1, n_interface, n)
        Likewise of the interface with a blank, of sectors -neighbours ... neighbours.
    layer_columns : int
        Columns of elements below the flank whose local compliance was taken out.
    fillet : FilletStress or None
        Where it was asked for.
    far : FarCompliance or None
        Where it was asked for; forces there have two components at a node of spur gears.
    support : Support or None
        The part of low rank, of holes: `compliance` is without it.
    web_stress : WebStress or None
        Where it was asked for.
    other : OtherFlank or None
        Of a gear on a blank whose other flanks carry and may be unlike.
    rim_motion : RimMotion or None
        Of a ring with several meshes, all of which load the same side of its teeth.
    """

    mesh: SectorMesh
    neighbours: int
    compliance: FloatArray
    sector: CondensedSector
    side_displacement: FloatArray
    interface_displacement: FloatArray
    layer_columns: int = 0
    fillet: FilletStress | None = None
    far: FarCompliance | None = None
    support: Support | None = None
    web_stress: WebStress | None = None
    other: OtherFlank | None = None
    rim_motion: RimMotion | None = None

    def tooth_compliance(self, offset: int) -> FloatArray:
        """Return the displacement of tooth `offset` under unit forces on tooth 0, shape (n, n), mm/N.

        Raises
        ------
        IndexError
            When the tooth is beyond the gear's neighbours.
        """
        if abs(offset) > self.neighbours:
            raise IndexError(f"tooth {offset} is beyond the {self.neighbours} neighbours that the compliance covers")
        return np.asarray(self.compliance[self.neighbours + offset])


def elastic_gear(
    mesh: SectorMesh, youngs_modulus: float, poisson_ratio: float, element: str, neighbours: int = 1,
    keep_rows: bool = False, layer_columns: int = 0, fillet: FilletMesh | None = None, far: FarTeeth | None = None,
    blank: Blank | None = None,
) -> ElasticGear:  # fmt: skip
    """Build the elastic model of a gear from one sector.

    Parameters
    ----------
    mesh, youngs_modulus, poisson_ratio, element
        As in `pmor.fe.condensation.condense_sector`.
    neighbours : int
        Neighbouring teeth to cover, on either side.
    keep_rows : bool
        Keep the factors for `pmor.body.volume`.
    layer_columns : int
        Columns of elements below the flank whose local compliance is taken out (`pmor.line.hertz`).
    fillet : FilletMesh, optional
        Where the stress along the fillets is asked for too.
    far : FarTeeth, optional
        Teeth beyond the neighbours, and their other flanks, that are loaded together with a tooth.
    blank : Blank, optional
        What a sector stands on that ends within its rim (`SectorMesh.on_blank`).
    """
    points, carried = sector_stress(fillet, mesh, youngs_modulus, poisson_ratio) if fillet else (None, ())
    back = far is not None and len(far.backs) + len(far.images) > 0
    sector = condense_sector(mesh, youngs_modulus, poisson_ratio, element, keep_rows, layer_columns, carried, back)
    n_flanks, n_side = len(sector.flank), len(sector.left)
    n_flank = n_flanks // 2 if back else n_flanks
    own = inverse_flank_stiffness(mesh, sector.stiffness[:n_flanks, :n_flanks].copy(), sector.flank)
    load = -sector.stiffness[n_flanks:, :n_flanks] @ own
    side = sector.stiffness[n_flanks:, n_flanks:] + load @ sector.stiffness[:n_flanks, n_flanks:]

    support, web_stress, on, other = None, None, None, None
    # Of a gear with several meshes any two teeth may be loaded together; else the rim alone reaches beyond neighbours.
    stressed = mesh.teeth // 2 if far is not None else neighbours if blank is None else REACH
    beyond: BeyondNeighbours
    if blank is None:
        to = side_coordinates(mesh)
        load, side = to @ load, turned(to, side, to)
        reach = neighbours + 1 if far is None else max(neighbours + 1, mesh.teeth // 2)
        faces = _bored_ring(mesh, side, reach)
        response: FaceResponse = partial(_of_bored_ring, faces)
        sectors = range(-neighbours - 1, neighbours + 1)
        by_face = [np.hstack([faces(k), faces(k + 1)]) @ load[:, :n_flank] for k in sectors]
        moved = np.stack([np.concatenate([own_face, before]) for before, own_face in pairwise(by_face)])
        beyond = partial(_stress_by_the_ring, mesh, response, load[:, :n_flank], stressed)
    else:
        on = on_blank(mesh, blank, load, side, own[:n_flank, :n_flank], neighbours, stressed if points else 0)
        to, load, response, moved = on.to, on.load, on.response, on.flank.ring.moved
        # Of a gear with several meshes any two teeth may be loaded together.
        reach = neighbours if far is None else mesh.teeth - 1
        support = None if on.change is None else support_on_blank(mesh, on, neighbours, reach)
        web_stress = stress_of_the_web(mesh, on) if blank.stress else None
        beyond = partial(stress_by_the_rim, mesh, on, False)

    displacement, stress, told = np.empty((0, n_side, n_flank)), None, None
    of_interface = np.zeros((2 * neighbours + 1, 0, n_flank))
    if keep_rows:
        before = moved[0][n_side : 2 * n_side]  # the left side face of the sector before
        displacement = np.stack([to[:n_side, :n_side].T @ face for face in (before, *(m[:n_side] for m in moved))])
        if blank is not None:
            of_interface = np.stack([to[2 * n_side :, 2 * n_side :].T @ face[2 * n_side :] for face in moved])
    if points is not None:
        functions = np.concatenate([f.over(sector.retained) for f in carried])
        told = _Told(points, functions[:, :n_flanks], (to @ functions[:, n_flanks:].T).T)
    compliance, stress = _of_a_flank(mesh, False, neighbours, load, own, moved, told, beyond, sector.layer)
    if on is not None and on.other is not None:
        of_image = _layer_of_the_image(mesh, sector.layer)
        beyond = partial(stress_by_the_rim, mesh, on, True)
        behind, of_back = _of_a_flank(mesh, True, neighbours, load, own, on.other.ring.moved, told, beyond, of_image)
        other = OtherFlank(_reciprocal(behind[::-1]), of_back)  # in the image teeth count the other way
    between = _between_far_teeth(mesh, response, load, far) if far is not None else None
    ring = far is not None and not back and signed_teeth(mesh) < 0
    rim = _of_the_rim(mesh, to, load, response, on) if ring else None
    return ElasticGear(
        mesh,
        neighbours,
        _reciprocal(compliance),
        sector,
        displacement,
        of_interface,
        layer_columns,
        stress,
        between,
        support,
        web_stress,
        other,
        rim,
    )


class _Told(NamedTuple):
    """Stress along fillets, told by the displacement of both flanks and by that of the faces, MPa/mm."""

    points: FilletPoints
    of_flanks: FloatArray
    of_faces: FloatArray


def _of_a_flank(
    mesh: SectorMesh, back: bool, neighbours: int, load: FloatArray, own: FloatArray, moved: FloatArray,
    told: _Told | None, beyond: BeyondNeighbours, layer: FloatArray | None,
) -> tuple[FloatArray, FilletStress | None]:  # fmt: skip
    """Return the compliance between equal flanks of teeth, of all of their nodes, and the stress in the fillets.

    Parameters
    ----------
    back : bool
        Of the other flanks: unknowns are those in the image, teeth count counter-clockwise as they are.
    load : ndarray, shape (s, n or 2 n)
        On the faces of a sector by unit forces on the nodes that elements have, of one flank or both.
    own : ndarray, shape (n or 2 n, n or 2 n)
        Displacement of the flanks while the faces are held, mm/N.
    moved : ndarray, shape (2 neighbours + 1, s, n)
        Of the faces of sectors -neighbours ... neighbours by unit forces on the flank of sector 0, mm/N.
    beyond : callable
        Stress in further teeth, by that over the displacement of the faces of a sector and its shape.
    layer : ndarray or None
        Compliance to take out.
    """
    count = moved.shape[2]
    columns = slice(count, 2 * count) if back else slice(0, count)
    onto = onto_all_nodes(mesh, back)
    flanks = np.stack([load.T @ face for face in moved])
    flanks[neighbours] += own[:, columns]
    stress = None
    if told is not None:
        near = neighbours + np.arange(-NEIGHBOURS, NEIGHBOURS + 1)
        shown = told.of_flanks @ flanks[near] + told.of_faces @ moved[near]
        stress = _of_the_fillets(told.points, shown, onto)
        bent = told.of_faces + told.of_flanks @ load.T
        stress = replace(stress, rim=beyond(bent, told.points.shape))
    compliance = np.ascontiguousarray(flanks[:, columns])
    if back or len(mesh.middles):
        compliance = np.stack([onto @ (onto @ block.T).T for block in compliance])
    if layer is not None:
        compliance[neighbours] -= layer
    return compliance, stress


def _stress_by_the_ring(
    mesh: SectorMesh, response: FaceResponse, load: FloatArray, reach: int, bent: FloatArray,
    shape: tuple[int, int, int],
) -> RimStress | None:  # fmt: skip
    """Stress in the teeth beyond the next ones under forces on all nodes of a flank, the bore held; None without any.

    *Measured*, a sun between three planets: the loads of the other two meshes make 1.25 % of its range.
    """
    reach = min(reach, mesh.teeth // 2)  # of few teeth
    if reach <= NEIGHBOURS:
        return None
    patterns = face_patterns(load)
    moved = response(load @ patterns)
    far = np.stack([moved(k) for k in range(-reach, reach + 1)])
    none = np.zeros((len(load), 1, 0), dtype=complex), np.zeros((0, 1, patterns.shape[1]), dtype=complex)
    stress = rim_stress(bent, shape, far, patterns, *none, signed_teeth(mesh))
    return replace(stress, rows=np.asarray(onto_all_nodes(mesh, False) @ stress.rows))


def _layer_of_the_image(mesh: SectorMesh, layer: FloatArray | None) -> FloatArray | None:
    if layer is None or mesh.twist_per_length == 0.0:
        return layer
    order, sign = other_hand(len(layer), len(mesh.z))
    return layer[order[:, None], order] * sign[:, None] * sign


def _of_bored_ring(faces: Callable[[int], FloatArray], forces: FloatArray) -> Callable[[int], FloatArray]:
    """Displacement of the side faces of sector k, left and right, by forces on those of sector 0, the bore held."""
    left, right = np.split(forces, 2)

    def moved(k: int) -> FloatArray:
        here = faces(k)
        return np.concatenate([here @ left + faces(k + 1) @ right, faces(k - 1) @ left + here @ right])

    return moved


def _between_far_teeth(mesh: SectorMesh, faces: FaceResponse, load: FloatArray, asked: FarTeeth) -> FarCompliance:
    """Compliance between far teeth, of all nodes of a flank, in the components that contact forces have."""
    components = 2 if mesh.twist_per_length == 0.0 else 3
    used = (3 * np.arange(mesh.flank.size)[:, None] + np.arange(components)).ravel()
    count = 3 * len(nodes_of_elements(mesh, mesh.flank))
    flank = np.ascontiguousarray((completion(mesh, mesh.flank) @ load[:, :count].T)[used].T)
    back = np.empty((len(load), 0))
    if load.shape[1] > count:
        image = np.tile([-1.0, 1.0, 1.0][:components], mesh.back.size)
        back = np.ascontiguousarray((completion(mesh, mesh.back) @ load[:, count:].T)[used].T) * image
    return far_compliance(faces, flank, back, mesh.teeth, asked)


def _of_the_rim(
    mesh: SectorMesh, to: sp.csr_array, load: FloatArray, response: FaceResponse, on: OnBlank | None
) -> RimMotion:
    """Motion of a ring's root between teeth under forces on all nodes of the flank."""
    even = even_on_the_cut(mesh)
    forces = np.zeros((to.shape[1], even.shape[1]))
    forces[: len(even)] = even
    forces = to @ forces
    moved, onto = response(forces), onto_all_nodes(mesh, False)
    count = onto.shape[1]
    cyclic = np.stack([(onto @ (load[:, :count].T @ moved(-k))).T for k in range(mesh.teeth)])
    if on is None or on.change is None:
        return rim_motion(cyclic, np.zeros((1, mesh.teeth, 2, 0)), np.zeros((cyclic.shape[2], 0)))
    (softening, pieces), ring = on.change, on.flank.ring
    amplitudes = ring.felt.reshape(-1, count)
    patterns = leading(np.hstack([amplitudes.real.T, amplitudes.imag.T]), LEAST_MOVED)
    freed = forces_of_holes(ring.felt, ring.flexibility, softening, signed_teeth(mesh), pieces, patterns)
    by_lugs = moved_elsewhere(on.ring_under(forces, 0).felt, freed, signed_teeth(mesh))
    return rim_motion(cyclic, by_lugs, np.asarray(onto @ patterns))


def with_layer(gear: ElasticGear) -> ElasticGear:
    """Return a gear with the local compliance of its surface layer put back: as it is solved for without a layer."""
    if gear.sector.layer is None:
        return gear
    compliance = gear.compliance.copy()
    compliance[gear.neighbours] += gear.sector.layer
    sector = replace(gear.sector, layer=None)
    return replace(gear, compliance=_reciprocal(compliance), sector=sector, layer_columns=0)


def _bored_ring(mesh: SectorMesh, stiffness: FloatArray, reach: int) -> Callable[[int], FloatArray]:
    """Displacement of side face k by unit forces on side face 0, the bore held: callable, of k up to `reach`."""
    sides = len(stiffness) // 2
    left, right = slice(None, sides), slice(sides, None)
    even = symmetric_coordinates(mesh, nodes_of_elements(mesh, mesh.left))[1]
    diagonal = stiffness[left, left] + stiffness[right, right]
    blocks = ring_compliance(diagonal, stiffness[left, right], even, mesh.teeth, reach)

    def faces(k: int) -> FloatArray:
        if abs(k) >= len(blocks):
            k = (k + mesh.teeth // 2) % mesh.teeth - mesh.teeth // 2
        return np.asarray(blocks[k] if k >= 0 else blocks[-k].T)

    return faces


def _of_the_fillets(points: FilletPoints, stress: FloatArray, onto: sp.csr_array) -> FilletStress:
    """Sort stress, (teeth, m, n), by side, point and column; over forces on all nodes of the flank."""
    over_grid = np.stack([(onto @ block.T).T for block in stress])
    return FilletStress(points, over_grid.reshape(len(stress), 2, *points.shape, -1))


def _reciprocal(compliance: FloatArray) -> FloatArray:
    """Let reciprocity hold exactly, which the solvers count on, and not to round-off."""
    return np.asarray(0.5 * (compliance + compliance[::-1].transpose(0, 2, 1)))
