"""Stress on the faces of a web, and at the edges of its holes, under forces on the flanks of a gear.

Forces on the flank of tooth i move the web by harmonics over the angle (`pmor.body.blank`, `pmor.body.support`), whose
stress in its surfaces is known of each (`pmor.fe.blank_section`, `pmor.body.web_stress`). The surfaces are divided into
cells, all alike: sectors of the teeth, or of the holes. In cell m there is

    sigma_m = Re sum_n S_n e^(2 pi i n m / cells) e_ni,                                                             (1)

S_n the stress in cell 0 by an amplitude of 1 mm, e_ni the amplitudes under forces on tooth i. Webs are smooth, and far
from the flank: few patterns of stress, and few of forces, are enough.

Stress on the faces of a web with holes, and at their edges, by how the circles move where it meets hub and rim.

A sector of the web is meshed anew, finer around its hole than for its stiffness (`pmor.fe.perforated_web`). The stress
in its surfaces is taken from their own displacement, as no traction acts there: in the middle of elements on the faces,
and along the edge of the hole where elements of second order have the right strain, at 1 / sqrt(3) of their length.
These functions of the displacement are carried through the elimination of the mesh (`pmor.fe.elimination`).

*Measured* in twist, where the largest stress at a small hole is 4 times the shear: hole r 0.5 mm on r 50 mm in a thin
web, 4.03. Elements of half the size change it by 0.6 % (r 1 mm) and 0.3 % (r 12 mm), ones of half the height in a web
of 8 mm by 1.3 % and 0.6 %.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import scipy.linalg as la

from pmor.body.rim import LEAST_STRESS, leading
from pmor.case.blank import CLEAR
from pmor.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from pmor.fe.assembly import degrees_of_freedom
from pmor.fe.element import QUADRATIC_NODES, law_in_surface, node_places, surface_strain
from pmor.fe.elimination import CarriedFunctions
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
    spots = [_spots(mesh, np.flatnonzero(clear & on), 2, (0.0, 0.0, side), False) for side, on in faces]
    return [spot for spot in spots if len(spot.nodes)]  # none of a web shorter than it is thick


def _at_the_edge(web: PerforatedWeb, mesh: WebMesh) -> list[_Spots]:
    """Points along the edge of a hole, in the middle of its elements and where it meets the faces of the web."""
    filling, z = np.unique(mesh.elements[~mesh.solid]), mesh.nodes[mesh.elements, 2]
    on_filling, spots = np.isin(mesh.elements, filling), list[_Spots]()
    heights = [(0.0, np.ones(len(z), dtype=bool)), (-1.0, z.min(axis=1) == web.z[0])]
    heights += [] if web.mirrored else [(1.0, z.max(axis=1) == web.z[1])]
    for axis in range(2):
        for side in (-1.0, 1.0):
            face = node_places(2)[:QUADRATIC_NODES, axis] == int(1.0 + side)
            at_edge = mesh.solid & on_filling[:, face].all(axis=1)
            for height, there in heights:
                for along in (-1.0 / math.sqrt(3.0), 1.0 / math.sqrt(3.0)):
                    place = (side, along, height) if axis == 0 else (along, side, height)
                    spots.append(_spots(mesh, np.flatnonzero(at_edge & there), axis, place, True))
    return [spot for spot in spots if len(spot.nodes)]


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
