"""Flank compliance of the whole gear from one condensed sector and the ring of equal ones: exact, not a reduction."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from pmor.body.blank import LEFT_OUT, Blank, Ring, signed_teeth
from pmor.body.far_compliance import FaceResponse, FarCompliance, FarTeeth, far_compliance
from pmor.body.fillet_stress import FilletPoints, FilletStress, sector_stress
from pmor.body.rim_motion import LEAST_MOVED, RimMotion, even_on_the_cut, rim_motion
from pmor.body.rim_stress import NEIGHBOURS, REACH, RimStress, face_patterns, leading, rim_stress
from pmor.body.root_stress import other_hand
from pmor.body.support import (
    Change,
    Support,
    added_by_the_last,
    amplitudes_by_holes,
    forces_of_holes,
    moved_elsewhere,
    support_of_holes,
)
from pmor.body.web_stress import WebStress, stress_by_holes, stress_of_revolution
from pmor.core.arrays import FloatArray
from pmor.fe.completion import completion, nodes_of_elements
from pmor.fe.condensation import CondensedSector, condense_sector
from pmor.fe.element import tributary_widths
from pmor.fe.fillet import FilletMesh
from pmor.fe.lugs import Lugs
from pmor.fe.ring import ring_compliance, symmetric_coordinates
from pmor.fe.sector import SectorMesh
from pmor.fe.surface_layer import inverse_flank_stiffness


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
    if blank is None:
        to = _coordinates(mesh)
        load, side = to @ load, _turned(to, side, to)
        reach = neighbours + 1 if far is None else max(neighbours + 1, mesh.teeth // 2)
        faces = _bored_ring(mesh, side, reach)
        response: FaceResponse = partial(_of_bored_ring, faces)
        sectors = range(-neighbours - 1, neighbours + 1)
        by_face = [np.hstack([faces(k), faces(k + 1)]) @ load[:, :n_flank] for k in sectors]
        moved = np.stack([np.concatenate([own_face, before]) for before, own_face in pairwise(by_face)])
    else:
        on = _on_blank(mesh, blank, load, side, own[:n_flank, :n_flank], neighbours, points is not None)
        to, load, response, moved = on.to, on.load, on.response, on.flank.ring.moved
        # Of a gear with several meshes any two teeth may be loaded together.
        reach = neighbours if far is None else mesh.teeth - 1
        support = None if on.change is None else _of_holes(mesh, on, neighbours, reach)
        web_stress = _of_the_web(mesh, on) if blank.stress else None

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
    compliance, stress = _of_a_flank(mesh, False, neighbours, load, own, moved, told, on, sector.layer)
    if on is not None and on.other is not None:
        of_image = _layer_of_the_image(mesh, sector.layer)
        found, of_back = _of_a_flank(mesh, True, neighbours, load, own, on.other.ring.moved, told, on, of_image)
        other = OtherFlank(_reciprocal(found[::-1]), of_back)  # in the image teeth count the other way
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
    told: _Told | None, on: _OnBlank | None, layer: FloatArray | None,
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
    layer : ndarray or None
        Compliance to take out.
    """
    count = moved.shape[2]
    columns = slice(count, 2 * count) if back else slice(0, count)
    onto = _onto_all_nodes(mesh, back)
    flanks = np.stack([load.T @ face for face in moved])
    flanks[neighbours] += own[:, columns]
    stress = None
    if told is not None:
        near = neighbours + np.arange(-NEIGHBOURS, NEIGHBOURS + 1)
        shown = told.of_flanks @ flanks[near] + told.of_faces @ moved[near]
        stress = _of_the_fillets(told.points, shown, onto)
        if on is not None:
            bent = told.of_faces + told.of_flanks @ load.T
            stress = replace(stress, rim=_by_the_rim(mesh, on, back, bent, told.points.shape))
    compliance = np.ascontiguousarray(flanks[:, columns])
    if back or len(mesh.middles):
        compliance = np.stack([onto @ (onto @ block.T).T for block in compliance])
    if layer is not None:
        compliance[neighbours] -= layer
    return compliance, stress


def _onto_all_nodes(mesh: SectorMesh, back: bool) -> sp.csr_array:
    """Unknowns of all nodes of a flank, of the other one in its image, from those of nodes that elements have."""
    if not back:
        return completion(mesh, mesh.flank)
    return sp.csr_array(sp.diags_array(np.tile([-1.0, 1.0, 1.0], mesh.back.size)) @ completion(mesh, mesh.back))


def _layer_of_the_image(mesh: SectorMesh, layer: FloatArray | None) -> FloatArray | None:
    if layer is None or mesh.twist_per_length == 0.0:
        return layer
    order, sign = other_hand(len(layer), len(mesh.z))
    return layer[order[:, None], order] * sign[:, None] * sign


class _Pressed(NamedTuple):
    """What forces on a flank do, and their patterns that matter at the faces, where these were asked for."""

    ring: Ring
    patterns: FloatArray | None


class _OnBlank(NamedTuple):
    """A blank with enough harmonics; faces of a sector, loads there, what these do, what makes teeth differ.

    `other` is of the other flank where it carries and may be unlike, `response` what any loads on the faces do.
    """

    blank: Blank
    to: sp.csr_array
    load: FloatArray
    flank: _Pressed
    other: _Pressed | None
    change: tuple[Change, int] | None
    response: FaceResponse
    ring_under: Callable[[FloatArray, int], Ring]


def _on_blank(
    mesh: SectorMesh, blank: Blank, of_nodes: FloatArray, held: FloatArray, own: FloatArray, neighbours: int,
    with_stress: bool,
) -> _OnBlank:  # fmt: skip
    """Put a sector on a blank, with as many harmonics as it needs: loads on faces under forces on the flanks."""
    lines, sides = _line_loads(mesh), _coordinates(mesh)
    while True:
        to = sp.block_diag([sides, blank.coordinates(mesh)], format="csr")
        of_faces, stiffness, patterns, reach = to @ of_nodes, _turned(to, held, to), None, 0
        load = of_faces[:, : len(own)]
        if with_stress or blank.stress:
            patterns, reach = face_patterns(load), min(mesh.teeth // 2, REACH) if with_stress else 0
        ring = blank.ring(mesh, stiffness, load, neighbours, lines, patterns, reach)
        change, added = blank.change(mesh.twist_per_length), ring.added
        if blank.web is not None and change is not None:
            added = added + added_by_the_last(ring.felt @ lines, ring.flexibility, change[0], mesh.teeth, change[1])
        itself = np.einsum("ik,ik->k", lines, own @ lines + load.T @ (ring.moved[neighbours] @ lines))
        wider = blank.wider(mesh.teeth)
        if wider is None or (added <= LEFT_OUT * itself).all():
            other, backs = None, of_faces[:, len(own) :]
            # On a body of revolution by dimensions the flanks of straight teeth are images of each other.
            if backs.size and (change is not None or blank.body is not None or mesh.twist_per_length != 0.0):
                kept, none = None if patterns is None else face_patterns(backs), np.zeros((backs.shape[1], 0))
                other = _Pressed(blank.ring(mesh, stiffness, backs, neighbours, none, kept, reach), kept)
            ring_under = partial(_ring_under, mesh, blank, stiffness)
            response = partial(_of_blank, mesh, ring_under)
            return _OnBlank(blank, to, of_faces, _Pressed(ring, patterns), other, change, response, ring_under)
        blank = wider


def _ring_under(mesh: SectorMesh, blank: Blank, stiffness: FloatArray, forces: FloatArray, reach: int) -> Ring:
    """What any forces on the faces of sector 0 do to those of sectors up to a reach, on a blank."""
    return blank.ring(mesh, stiffness, forces, reach, np.zeros((forces.shape[1], 0)))


def _of_blank(
    mesh: SectorMesh, ring_under: Callable[[FloatArray, int], Ring], forces: FloatArray
) -> Callable[[int], FloatArray]:
    """Displacement of the faces of sector k by forces on those of sector 0, on a blank."""
    reach = mesh.teeth // 2
    moved = ring_under(forces, reach).moved
    return lambda k: moved[(k + reach) % mesh.teeth]


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
    mesh: SectorMesh, to: sp.csr_array, load: FloatArray, response: FaceResponse, on: _OnBlank | None
) -> RimMotion:
    """Motion of a ring's root between teeth under forces on all nodes of the flank."""
    even = even_on_the_cut(mesh)
    forces = np.zeros((to.shape[1], even.shape[1]))
    forces[: len(even)] = even
    forces = to @ forces
    moved, onto = response(forces), _onto_all_nodes(mesh, False)
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


def _coordinates(mesh: SectorMesh) -> sp.csr_array:
    """Symmetric coordinates of both side faces, left and right."""
    both = (symmetric_coordinates(mesh, nodes_of_elements(mesh, side))[0] for side in (mesh.left, mesh.right))
    return sp.block_diag(list(both), format="csr")


def _line_loads(mesh: SectorMesh) -> FloatArray:
    """Even loads of 1 N on each row of nodes of the flank, around the axis: of nodes that elements have, (n, rows)."""
    share = tributary_widths(mesh.z, mesh.order)
    rows = np.zeros((*mesh.flank.shape, 3, len(mesh.flank)))
    for row in range(len(mesh.flank)):
        rows[row, :, 0, row] = share / share.sum()
    return np.asarray(completion(mesh, mesh.flank).T @ rows.reshape(-1, len(mesh.flank)))


def _of_holes(mesh: SectorMesh, on: _OnBlank, neighbours: int, reach: int) -> Support:
    """Part of low rank of the compliance of all nodes of the flank, and of the other one where that carries."""
    assert on.change is not None
    (softening, holes), (ring, _) = on.change, on.flank
    felt, count = ring.felt, ring.felt.shape[2]
    if on.other is not None:
        felt = np.concatenate([felt, on.other.ring.felt], axis=2)
    found = support_of_holes(felt, ring.flexibility, softening, signed_teeth(mesh), holes, neighbours, reach)
    rows, backs = np.asarray(_onto_all_nodes(mesh, False) @ found.rows[:count]), None
    if on.other is not None:
        backs = np.asarray(_onto_all_nodes(mesh, True) @ found.rows[count:])
    return replace(found, rows=rows, backs=backs)


def _by_the_rim(mesh: SectorMesh, on: _OnBlank, back: bool, bent: FloatArray, shape: tuple[int, int, int]) -> RimStress:
    """Stress by the rim under forces on all nodes of a flank."""
    pressed = on.other if back else on.flank
    assert pressed is not None
    ring, patterns = pressed
    assert patterns is not None
    forces = np.zeros((0, 1, patterns.shape[1]), dtype=complex)
    if on.change is not None:
        forces = forces_of_holes(ring.felt, ring.flexibility, on.change[0], signed_teeth(mesh), on.change[1], patterns)
    found = rim_stress(bent, shape, ring, patterns, forces, signed_teeth(mesh))
    return replace(found, rows=np.asarray(_onto_all_nodes(mesh, back) @ found.rows))


def _of_the_web(mesh: SectorMesh, on: _OnBlank) -> WebStress:
    """Stress on the surfaces of a web under forces on all nodes of the flank."""
    blank, (ring, patterns) = on.blank, on.flank
    assert patterns is not None
    if blank.web is None or on.change is None:
        assert blank.gauges is not None
        places = blank.gauges.places(blank.blocks[blank.gauges.block])
        found = stress_of_revolution(places, ring.shown, patterns, mesh.teeth, mesh.twist_per_length)
    else:
        softening, holes = on.change
        assert not isinstance(softening, Lugs)
        eased = amplitudes_by_holes(ring.felt, ring.flexibility, softening, mesh.teeth, holes, patterns)
        material = blank.youngs_modulus, blank.poisson_ratio
        found = stress_by_holes(blank.web, eased, patterns, *material, mesh.twist_per_length)
    return replace(found, pattern=np.asarray((_onto_all_nodes(mesh, False) @ found.pattern.T).T))


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


def _turned(left: sp.csr_array, matrix: FloatArray, right: sp.csr_array) -> FloatArray:
    """Matrix in other coordinates of its rows and columns."""
    return np.asarray(left @ (right @ matrix.T).T)


def _of_the_fillets(points: FilletPoints, stress: FloatArray, onto: sp.csr_array) -> FilletStress:
    """Sort stress, (teeth, m, n), by side, point and column; over forces on all nodes of the flank."""
    over_grid = np.stack([(onto @ block.T).T for block in stress])
    return FilletStress(points, over_grid.reshape(len(stress), 2, *points.shape, -1))


def _reciprocal(compliance: FloatArray) -> FloatArray:
    """Let reciprocity hold exactly, which the solvers count on, and not to round-off."""
    return np.asarray(0.5 * (compliance + compliance[::-1].transpose(0, 2, 1)))
