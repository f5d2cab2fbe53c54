"""Stress on the faces of a web with holes, and at their edges, by how the circles move where it meets hub and rim.

A sector of the web is meshed anew, finer around its hole than for its stiffness (`pmor.fe.perforated_web`). The stress
in its surfaces is taken from their own displacement, as no traction acts there: in the middle of elements on the faces,
and along the edge of the hole where elements of second order have the right strain, at 1 / sqrt(3) of their length.
These functions of the displacement are carried through the elimination of the mesh (`pmor.fe.carried_functions`).

*Measured* in twist, where the largest stress at a small hole is 4 times the shear: hole r 0.5 mm on r 50 mm in a thin
web, 4.03. Elements of half the size change it by 0.6 % (r 1 mm) and 0.3 % (r 12 mm), ones of half the height in a web
of 8 mm by 1.3 % and 0.6 %.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from pmor.case.blank import CLEAR
from pmor.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from pmor.fe.assembly import degrees_of_freedom
from pmor.fe.carried_functions import CarriedFunctions
from pmor.fe.element import QUADRATIC_NODES, law_in_surface, node_places, surface_strain
from pmor.fe.hexahedron import shape_functions, shape_gradient
from pmor.fe.perforated_web import PerforatedWeb, WebMesh, by_amplitudes, condensed_sector, web_mesh


class Surfaces(NamedTuple):
    """Stress in the surfaces of the sector of the first hole, p points.

    Attributes
    ----------
    places : ndarray, shape (p, 3)
        Radius, mm, angle from the middle of tooth 0, rad, and z, mm.
    edge : ndarray of bool, shape (p,)
        At the edge of the hole.
    stress : ndarray, shape (3 p, (2 largest + 1) 2 c)
        Two directions in the surface at right angles, and their shear, by amplitudes of 1 mm, in the order and frame of
        `PerforatedWeb.softening`; MPa/mm.
    """

    places: FloatArray
    edge: BoolArray
    stress: ComplexArray


class _Spots(NamedTuple):
    """Points at one place of some elements: their nodes on the face, shape functions there and slopes along it."""

    nodes: IntArray
    shape: FloatArray
    slopes: FloatArray
    edge: bool


def surface_stress(web: PerforatedWeb, youngs_modulus: float, poisson_ratio: float, twist: float) -> Surfaces:
    """Return the stress in the surfaces of a web by the amplitudes of its circles."""
    mesh = web_mesh(web, fine=True)
    spots = [*_on_faces(web, mesh), *_at_the_edge(web, mesh)]
    law, rows, weights = law_in_surface(youngs_modulus, poisson_ratio), [], []
    for spot in spots:
        weights.append(law @ surface_strain(mesh.nodes[spot.nodes], spot.slopes))
        rows.append(degrees_of_freedom(spot.nodes).reshape(len(spot.nodes), -1))
    unknowns, count = np.unique(np.concatenate([row.ravel() for row in rows])), sum(map(len, rows))
    functions, first = np.zeros((len(unknowns), 3 * count)), 0
    for row, weight in zip(rows, weights, strict=True):
        place = np.searchsorted(unknowns, row)
        column = 3 * (first + np.arange(len(row)))[:, None, None] + np.arange(3)[:, None]
        functions[place[:, None, :], column] = weight
        first += len(row)
    carried = CarriedFunctions(unknowns, functions, 3 * len(mesh.nodes))
    condensed = condensed_sector(mesh, web.stiffness_of(mesh, youngs_modulus, poisson_ratio), mesh.solid, carried)
    stress = np.zeros((3 * count, len(web.phase)), dtype=complex)
    for place, turn, onto in web.families(mesh, twist):
        stress[:, place] = by_amplitudes(*condensed, len(mesh.left), turn, onto)[1]
    x, y, z = np.concatenate([np.einsum("k,pkd->pd", spot.shape, mesh.nodes[spot.nodes]) for spot in spots]).T
    places = np.stack([np.hypot(x, y), web.first + np.arctan2(-x, y), z], axis=1)
    edge = np.concatenate([np.full(len(spot.nodes), spot.edge) for spot in spots])
    return Surfaces(places, edge, stress * web.phase)


def _spots(mesh: WebMesh, elements: IntArray, axis: int, place: tuple[float, ...], edge: bool) -> _Spots:
    """Spots of elements at a place of the unit cube, on the face across an axis of it."""
    side = int(1.0 + place[axis])
    face = np.flatnonzero(node_places(2)[:QUADRATIC_NODES, axis] == side)
    along = [other for other in range(3) if other != axis]
    shape, slopes = shape_functions(np.array(place), 2), shape_gradient(np.array(place), 2)
    return _Spots(mesh.elements[elements][:, face], shape[face], slopes[face][:, along], edge)


def _on_faces(web: PerforatedWeb, mesh: WebMesh) -> list[_Spots]:
    """Middles of elements on the faces of a web, clear of hub and rim."""
    middle, z = mesh.nodes[mesh.elements].mean(axis=1), mesh.nodes[mesh.elements, 2]
    radius, apart = np.hypot(middle[:, 0], middle[:, 1]), CLEAR * web.thickness
    clear = mesh.solid & (radius > web.inner + apart) & (radius < web.outer - apart)
    low, top = z.min(axis=1) == web.z[0], z.max(axis=1) == web.z[1]
    faces = [(-1.0, low)] if web.mirrored else [(-1.0, low), (1.0, top)]
    found = [_spots(mesh, np.flatnonzero(clear & on), 2, (0.0, 0.0, side), False) for side, on in faces]
    return [spot for spot in found if len(spot.nodes)]  # none of a web shorter than it is thick


def _at_the_edge(web: PerforatedWeb, mesh: WebMesh) -> list[_Spots]:
    """Points along the edge of a hole, in the middle of its elements and where it meets the faces of the web."""
    filling, z = np.unique(mesh.elements[~mesh.solid]), mesh.nodes[mesh.elements, 2]
    on_filling, found = np.isin(mesh.elements, filling), list[_Spots]()
    heights = [(0.0, np.ones(len(z), dtype=bool)), (-1.0, z.min(axis=1) == web.z[0])]
    heights += [] if web.mirrored else [(1.0, z.max(axis=1) == web.z[1])]
    for axis in range(2):
        for side in (-1.0, 1.0):
            face = node_places(2)[:QUADRATIC_NODES, axis] == int(1.0 + side)
            at_edge = mesh.solid & on_filling[:, face].all(axis=1)
            for height, there in heights:
                for along in (-1.0 / math.sqrt(3.0), 1.0 / math.sqrt(3.0)):
                    place = (side, along, height) if axis == 0 else (along, side, height)
                    found.append(_spots(mesh, np.flatnonzero(at_edge & there), axis, place, True))
    return [spot for spot in found if len(spot.nodes)]
