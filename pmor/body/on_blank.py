"""A sector of a gear on a blank: with as many harmonics as it needs, and what forces on its flanks then do.

What holes and lugs add, and stress by rim and web, are of `pmor.body.support`, `rim_stress` and `web_stress`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np
import scipy.sparse as sp

from pmor.body.blank import LEFT_OUT, Blank, signed_teeth
from pmor.body.far_compliance import FaceResponse
from pmor.body.rim import RimStress, face_patterns, rim_stress
from pmor.body.ring_on_blank import Ring
from pmor.body.support import (
    Change,
    Support,
    added_by_the_last,
    amplitudes_by_holes,
    forces_of_holes,
    support_of_holes,
)
from pmor.body.web_stress import WebStress, stress_by_holes, stress_of_revolution
from pmor.core.arrays import FloatArray
from pmor.fe.completion import completion, nodes_of_elements
from pmor.fe.element import tributary_widths
from pmor.fe.lugs import Lugs
from pmor.fe.ring import symmetric_coordinates
from pmor.fe.sector import SectorMesh


class Pressed(NamedTuple):
    """What forces on a flank do, and their patterns that matter at the faces, where these were asked for."""

    ring: Ring
    patterns: FloatArray | None


class OnBlank(NamedTuple):
    """A blank with enough harmonics; faces of a sector, loads there, what these do, what makes teeth differ.

    `other` is of the other flank where it carries and may be unlike, `response` what any loads on the faces do.
    """

    blank: Blank
    to: sp.csr_array
    load: FloatArray
    flank: Pressed
    other: Pressed | None
    change: tuple[Change, int] | None
    response: FaceResponse
    ring_under: Callable[[FloatArray, int], Ring]


def on_blank(
    mesh: SectorMesh, blank: Blank, of_nodes: FloatArray, held: FloatArray, own: FloatArray, neighbours: int,
    stressed: int,
) -> OnBlank:  # fmt: skip
    """Put a sector on a blank, with as many harmonics as it needs: loads on faces under forces on the flanks.

    Stress in fillets is asked for in so many teeth on either side of a loaded one: `stressed`, 0 without.
    """
    lines, sides = _line_loads(mesh), side_coordinates(mesh)
    while True:
        to = sp.block_diag([sides, blank.coordinates(mesh)], format="csr")
        of_faces, stiffness, patterns, reach = to @ of_nodes, turned(to, held, to), None, 0
        load = of_faces[:, : len(own)]
        if stressed or blank.stress:
            patterns, reach = face_patterns(load), min(mesh.teeth // 2, stressed)
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
                other = Pressed(blank.ring(mesh, stiffness, backs, neighbours, none, kept, reach), kept)
            under = partial(_ring_under, mesh, blank, stiffness)
            response = partial(_response, mesh, under)
            return OnBlank(blank, to, of_faces, Pressed(ring, patterns), other, change, response, under)
        blank = wider


def _ring_under(mesh: SectorMesh, blank: Blank, stiffness: FloatArray, forces: FloatArray, reach: int) -> Ring:
    """What any forces on the faces of sector 0 do to those of sectors up to a reach, on a blank."""
    return blank.ring(mesh, stiffness, forces, reach, np.zeros((forces.shape[1], 0)))


def _response(
    mesh: SectorMesh, ring_under: Callable[[FloatArray, int], Ring], forces: FloatArray
) -> Callable[[int], FloatArray]:
    """Displacement of the faces of sector k by forces on those of sector 0, on a blank."""
    reach = mesh.teeth // 2
    moved = ring_under(forces, reach).moved
    return lambda k: moved[(k + reach) % mesh.teeth]


def side_coordinates(mesh: SectorMesh) -> sp.csr_array:
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


def support_on_blank(mesh: SectorMesh, on: OnBlank, neighbours: int, reach: int) -> Support:
    """Part of low rank of the compliance of all nodes of the flank, and of the other one where that carries."""
    assert on.change is not None
    (softening, holes), (ring, _) = on.change, on.flank
    felt, count = ring.felt, ring.felt.shape[2]
    if on.other is not None:
        felt = np.concatenate([felt, on.other.ring.felt], axis=2)
    support = support_of_holes(felt, ring.flexibility, softening, signed_teeth(mesh), holes, neighbours, reach)
    rows, backs = np.asarray(onto_all_nodes(mesh, False) @ support.rows[:count]), None
    if on.other is not None:
        backs = np.asarray(onto_all_nodes(mesh, True) @ support.rows[count:])
    return replace(support, rows=rows, backs=backs)


def stress_by_the_rim(
    mesh: SectorMesh, on: OnBlank, back: bool, bent: FloatArray, shape: tuple[int, int, int]
) -> RimStress:
    """Stress by the rim under forces on all nodes of a flank."""
    pressed = on.other if back else on.flank
    assert pressed is not None
    ring, patterns = pressed
    assert patterns is not None
    forces = np.zeros((0, 1, patterns.shape[1]), dtype=complex)
    if on.change is not None:
        forces = forces_of_holes(ring.felt, ring.flexibility, on.change[0], signed_teeth(mesh), on.change[1], patterns)
    stress = rim_stress(bent, shape, ring.far, patterns, ring.pressed, forces, signed_teeth(mesh))
    return replace(stress, rows=np.asarray(onto_all_nodes(mesh, back) @ stress.rows))


def stress_of_the_web(mesh: SectorMesh, on: OnBlank) -> WebStress:
    """Stress on the surfaces of a web under forces on all nodes of the flank."""
    blank, (ring, patterns) = on.blank, on.flank
    assert patterns is not None
    if blank.web is None or on.change is None:
        assert blank.gauges is not None
        places = blank.gauges.places(blank.blocks[blank.gauges.block])
        stress = stress_of_revolution(places, ring.shown, patterns, mesh.teeth, mesh.twist_per_length)
    else:
        softening, holes = on.change
        assert not isinstance(softening, Lugs)
        eased = amplitudes_by_holes(ring.felt, ring.flexibility, softening, mesh.teeth, holes, patterns)
        material = blank.youngs_modulus, blank.poisson_ratio
        stress = stress_by_holes(blank.web, eased, patterns, *material, mesh.twist_per_length)
    return replace(stress, pattern=np.asarray((onto_all_nodes(mesh, False) @ stress.pattern.T).T))


def onto_all_nodes(mesh: SectorMesh, back: bool) -> sp.csr_array:
    """Unknowns of all nodes of a flank, of the other one in its image, from those of nodes that elements have."""
    if not back:
        return completion(mesh, mesh.flank)
    return sp.csr_array(sp.diags_array(np.tile([-1.0, 1.0, 1.0], mesh.back.size)) @ completion(mesh, mesh.back))


def turned(left: sp.csr_array, matrix: FloatArray, right: sp.csr_array) -> FloatArray:
    """Matrix in other coordinates of its rows and columns."""
    return np.asarray(left @ (right @ matrix.T).T)
