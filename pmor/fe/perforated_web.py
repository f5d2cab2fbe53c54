"""A web with equal holes: by how much they soften it, between the circles where it meets hub and rim.

One sector of the web, with one hole, is meshed with quadratic hexahedra: four blocks around the hole in a part of the
sector that is as high as the web, plain columns beside them. The hole is filled by blocks of its own. With and without
them the sector is condensed onto its sides and both circles; the circles move in Fourier's harmonics over the angle
times parabolas over the thickness,

    u(theta, z) = sum_n sum_j e_nj f_j(z) e^(i n (theta - tau z)),                                                   (1)

and the sides as cyclic symmetry says, of all harmonics n = g + k N, N holes. The difference of both is what the holes
take off: negative, of harmonics that differ by multiples of N, and 0 for holes of no size, whatever the mesh.

A kidney-shaped slot is where a round hole goes along a circle about the axis. Its sector is that of a round hole, cut
along the radius through the hole's middle; its halves turn away from each other by half the slot's length, and columns
are between them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy.linalg as la

from pmor.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from pmor.fe.assembly import degrees_of_freedom
from pmor.fe.blank_section import Loads, with_middles
from pmor.fe.element import QUADRATIC_NODES, node_places, tributary_widths
from pmor.fe.elimination import CarriedFunctions, condense
from pmor.fe.hexahedron import element_stiffness

# Rows of elements from a hole's edge to the circles, and from the core of its filling to the edge.
AROUND, WITHIN = 5, 1
# Half the side of the core, of the hole's radius.
CORE = 0.5
# Half the width of the box around a hole, over its radius, as far as there is room; strips beside it that are narrower
# than this share of it belong to it.
BESIDE, NARROW = 1.7, 0.35
# Elements to a wave of the highest harmonic along the circles; least and most ones along the sides of a hole's blocks.
TO_A_WAVE, LEAST, MOST = 4.0, 4, 24
# Least ones of a fine mesh; its first row around a hole, over the hole's radius, and the growth of the next ones.
LEAST_FINE, FIRST_ROW, GROWTH = 6, 0.12, 1.6
# Elements along the end of a slot, over the root of its radius over the bridge to the next one. *Measured*, five slots
# of radius 10 mm that leave 3.7 mm or 1.8 mm: the web twists 0.2 or 0.3 % less than with finer elements, with 3 of them
# 1.6 or 5 % less.
TO_A_BRIDGE = 7.0
# Elements over the thickness.
THROUGH = 2


@dataclass(frozen=True)
class PerforatedWeb:
    """A web with equal holes.

    Parameters
    ----------
    inner, outer : float
        Radii of hub and rim, where the web ends, mm.
    z : (float, float)
        Its faces, mm; 0 is the upper one of half a web.
    count : int
        Holes.
    radius, on_radius, first : float
        Of a hole and of the circle of their centres, mm; angle of the first one from the middle of tooth 0, rad.
    mirrored : bool
        Half of it stands for the whole.
    largest : int
        Harmonics that feel the holes go from minus it to it.
    length : float
        Angle between the ends of a kidney-shaped slot, rad; 0 of a round hole.
    """

    inner: float
    outer: float
    z: tuple[float, float]
    count: int
    radius: float
    on_radius: float
    first: float
    mirrored: bool
    largest: int
    length: float = 0.0

    @property
    def thickness(self) -> float:
        """Thickness of the whole web, mm."""
        return (self.z[1] - self.z[0]) * (2.0 if self.mirrored else 1.0)

    @property
    def parts(self) -> IntArray:
        """Direction of each f_j, (c,): 0 radial, 1 around, 2 along the axis."""
        return np.array([part for part, _ in self._powers])

    @property
    def _powers(self) -> list[tuple[int, int]]:
        powers = [(0, 2), (0, 2), (1,)] if self.mirrored else [(0, 1, 2)] * 3
        return [(part, power) for part in range(3) for power in powers[part]]

    def shapes(self, z: FloatArray) -> FloatArray:
        """Return f_j at places, (places, c)."""
        low, high = self.z
        middle = high if self.mirrored else 0.5 * (low + high)
        return np.stack([((z - middle) / (middle - low)) ** power for _, power in self._powers], axis=-1)

    def loads(self) -> tuple[Loads, Loads]:
        """Return unit loads on both circles that work on e_nj: of amplitudes whose circumferential part is over i."""

        def at(z: FloatArray, _: FloatArray) -> FloatArray:
            slack = 1e-9 * (self.z[1] - self.z[0])
            within = np.flatnonzero((z >= self.z[0] - slack) & (z <= self.z[1] + slack))
            functions, weights = self.shapes(z[within]), tributary_widths(z[within], 2)[:, None]
            unit_loads = np.zeros((3 * len(z), len(self.parts)))
            for part in range(3):
                own, places = functions[:, self.parts == part], np.flatnonzero(self.parts == part)
                mean = np.linalg.solve(own.T @ (weights * own), (weights * own).T)
                unit_loads[3 * within[:, None] + part, places] = mean.T
            return unit_loads

        return Loads(self.inner, len(self.parts), at), Loads(self.outer, len(self.parts), at)

    def unknowns(self) -> tuple[int, int, int]:
        """Return how many amplitudes, unknowns of both circles in a sector and unknowns of its side there are."""
        mesh = web_mesh(self)
        return 2 * len(self.parts) * (2 * self.largest + 1), 3 * len(mesh.circles), 3 * len(mesh.left)

    def softening(self, youngs_modulus: float, poisson_ratio: float, twist: float) -> ComplexArray:
        """Return what the holes take off the stiffness of inner and outer circle, 0 or negative, N/mm.

        Over the amplitudes of equation (1), harmonic by harmonic from the lowest on, inner circle first, for the energy
        over a revolution, in the frame of tooth 0: shape (2 largest + 1, 2 c) twice.
        """
        mesh = web_mesh(self)
        stiffness = self.stiffness_of(mesh, youngs_modulus, poisson_ratio)
        both = [condensed_sector(mesh, stiffness, used) for used in (np.ones_like(mesh.solid), mesh.solid)]
        size = 2 * len(self.parts) * (2 * self.largest + 1)
        taken_off = np.zeros((size, size), dtype=complex)
        for place, turn, onto in self.families(mesh, twist):
            filled, open_ = (by_amplitudes(*part, len(mesh.left), turn, onto)[0] for part in both)
            taken_off[place[:, None], place] = self.count * (open_ - filled)
        return np.asarray(self.phase.conj()[:, None] * taken_off * self.phase)

    def stiffness_of(self, mesh: WebMesh, youngs_modulus: float, poisson_ratio: float) -> FloatArray:
        """Return the stiffness of each element of a sector, and of its image where half of it stands for the whole."""
        stiffness = element_stiffness(mesh.nodes, mesh.elements, youngs_modulus, poisson_ratio, "hex20")
        if self.mirrored:
            stiffness *= 2.0
            _hold(stiffness, mesh, self.z[1])
        return stiffness

    def families(self, mesh: WebMesh, twist: float) -> Iterator[tuple[IntArray, complex, ComplexArray]]:
        """Yield harmonics that feel each other: places of amplitudes, turn of a sector, displacement of the circles."""
        n, functions = np.arange(-self.largest, self.largest + 1), self.shapes(mesh.nodes[mesh.circles, 2])
        size = 2 * functions.shape[1]
        for g in range(self.count):
            own = np.flatnonzero((n - g) % self.count == 0)
            if len(own):
                onto = _onto(mesh, n[own], functions, self.parts, twist)
                yield (own[:, None] * size + np.arange(size)).ravel(), np.exp(-2j * np.pi * g / self.count), onto

    @property
    def phase(self) -> ComplexArray:
        """Phase of amplitudes in the frame of the first hole against those in the frame of tooth 0."""
        n = np.arange(-self.largest, self.largest + 1)
        return np.asarray(np.exp(1j * n * self.first).repeat(2 * len(self.parts)))


@dataclass(frozen=True)
class WebMesh:
    """A sector of a web: nodes and elements, of the filling too; nodes of its sides (partners share an index)."""

    nodes: FloatArray
    elements: IntArray
    solid: BoolArray
    places: IntArray
    left: IntArray
    right: IntArray
    circles: IntArray
    outer: IntArray


def condensed_sector(
    mesh: WebMesh, stiffness: FloatArray, used: BoolArray, carried: CarriedFunctions | None = None
) -> tuple[FloatArray, FloatArray]:
    """Return the stiffness of sides and circles, with some of the elements, and functions of them.

    Sides come before circles, left one first, over radial, circumferential and axial displacement.
    """
    kept = np.flatnonzero(used)
    retained = np.concatenate([mesh.left, mesh.right, mesh.circles])
    visit = carried.eliminate if carried else None
    condensed = condense(stiffness[kept], mesh.elements[kept], mesh.places[kept], retained, np.empty(0, dtype=np.int64),
                     visit)  # fmt: skip
    functions = carried.over(degrees_of_freedom(retained)) if carried else np.zeros((0, len(condensed)))
    # Sides follow each other in radial and circumferential displacement, not in that along x and y.
    x, y, _ = mesh.nodes[retained[: 2 * len(mesh.left)]].T
    frames = np.zeros((len(x), 3, 3))
    frames[:, 2, 2] = 1.0
    frames[:, :2, :2] = np.array([[x, -y], [y, x]]).transpose(2, 0, 1) / np.hypot(x, y)[:, None, None]
    sides = slice(0, 3 * len(x))
    size = len(condensed)  # written out, as the sector of a single hole has no sides
    condensed[sides] = (frames.transpose(0, 2, 1) @ condensed[sides].reshape(len(x), 3, size)).reshape(3 * len(x), size)
    for matrix in (condensed, functions):
        matrix[:, sides] = (matrix[:, sides].reshape(len(matrix), len(x), 1, 3) @ frames).reshape(
            len(matrix), 3 * len(x)
        )
    return condensed, functions


def by_amplitudes(
    matrix: FloatArray, functions: FloatArray, sides: int, turn: complex, onto: ComplexArray
) -> tuple[ComplexArray, ComplexArray]:
    """Return the stiffness of the circles' amplitudes where the sides follow, and functions of these amplitudes.

    Sectors turn by `turn` from one to the next.
    """
    s = 3 * sides
    half = np.concatenate([matrix[:s] + np.conj(turn) * matrix[s : 2 * s], onto.conj().T @ matrix[2 * s :]])
    half = half.conj().T
    full = np.concatenate([half[:s] + np.conj(turn) * half[s : 2 * s], onto.conj().T @ half[2 * s :]])
    told = functions[:, 2 * s :] @ onto
    if not s:
        return np.asarray(full), np.asarray(told)
    inner = la.solve(full[:s, :s], full[:s, s:], assume_a="pos")
    told = told - (functions[:, :s] + turn * functions[:, s : 2 * s]) @ inner
    return np.asarray(full[s:, s:] - full[s:, :s] @ inner), np.asarray(told)


def _onto(mesh: WebMesh, n: IntArray, functions: FloatArray, parts: IntArray, twist: float) -> ComplexArray:
    """Radial, circumferential and axial displacement of the circles' nodes over amplitudes, (3 m, harmonics 2 c)."""
    x, y, z = mesh.nodes[mesh.circles].T
    wave = np.exp(1j * np.outer(np.arctan2(-x, y) - twist * z, n))
    count = functions.shape[1]
    moved = np.zeros((len(x), 3, len(n), 2, count), dtype=complex)
    for j, part in enumerate(parts.tolist()):
        for circle in range(2):
            on = mesh.outer == circle
            moved[on, part, :, circle, j] = wave[on] * functions[on, j, None]
    # Unknowns are those of x, y, z: turned into the node's own frame.
    radial = np.stack([x, y], axis=1) / np.hypot(x, y)[:, None]
    turned = moved.copy()
    for axis in range(2):
        around = -radial[:, 1] if axis == 0 else radial[:, 0]
        turned[:, axis] = radial[:, axis, None, None, None] * moved[:, 0] + around[:, None, None, None] * moved[:, 1]
    return turned.reshape(3 * len(x), -1)


def _hold(stiffness: FloatArray, mesh: WebMesh, plane: float) -> None:
    on_plane = np.abs(mesh.nodes[:, 2] - plane) < 1e-12 * max(1.0, np.abs(mesh.nodes[:, 2]).max())
    number, node = np.nonzero(on_plane[mesh.elements])
    place = 3 * node + 2
    diagonal = stiffness[number, place, place]
    stiffness[number, place, :] = stiffness[number, :, place] = 0.0
    stiffness[number, place, place] = diagonal


class _Box(NamedTuple):
    """Part of a sector around its hole: half its angle, its radii, elements along its sides."""

    half: float
    low: float
    high: float
    along: int
    up: int


def web_mesh(web: PerforatedWeb, fine: bool = False) -> WebMesh:
    """Mesh a sector of a web around its hole; a fine mesh is good for the stress at the hole's edge."""
    half = math.pi / web.count - 0.5 * web.length  # without what is between the ends of a slot
    room = min(web.outer - web.on_radius, web.on_radius - web.inner)
    wide = max(BESIDE * web.radius, 0.5 * room)
    beside = wide / web.on_radius
    beside = half if half - beside < NARROW * beside else beside
    tall = max(wide, web.on_radius * beside)
    low, high = web.on_radius - tall, web.on_radius + tall
    low = web.inner if low - web.inner < NARROW * tall else low
    high = web.outer if web.outer - high < NARROW * tall else high
    waves, least = TO_A_WAVE * web.largest / (2.0 * math.pi), LEAST_FINE if fine else LEAST
    along = max(least, math.ceil(2.0 * beside * waves))
    along += along % 2 if web.length else 0  # a line of elements is in the middle, where slots are cut
    size = max(2.0 * beside * web.on_radius / along, (web.outer - web.inner) / MOST)
    up = max(least, math.ceil((high - low) / size))
    if web.length:
        bridge = 2.0 * (web.on_radius * math.sin(min(half, 0.5 * math.pi)) - web.radius)
        up = max(up, math.ceil(TO_A_BRIDGE * math.sqrt(web.radius / bridge)))
    box = _Box(beside, low, high, along, up)
    theta = [(-beside, beside, along)]
    if beside < half:
        columns = max(2, math.ceil((half - beside) * waves))
        theta = [(-half, -beside, columns), *theta, (beside, half, columns)]
    radii = [(low, high, box.up)]
    radii += [(web.inner, low, max(1, math.ceil((low - web.inner) / size)))] if low > web.inner else []
    radii += [(high, web.outer, max(1, math.ceil((web.outer - high) / size)))] if high < web.outer else []
    blocks = [(block, True) for block in _around(web, box, _shares(web, box, fine))] + [
        (block, False) for block in _filling(web, box)
    ]
    for first, last, columns in theta:
        for inner, outer, rows in radii:
            if (first, inner) != (-beside, low):
                points = np.linspace(inner, outer, 2 * rows + 1)[:, None], np.linspace(first, last, 2 * columns + 1)
                blocks.append((_points(*points), True))
    if web.length:
        columns = math.ceil(web.length * web.on_radius / size)
        blocks = [(part, solid) for block, solid in blocks for part in _drawn_out(block, 0.5 * web.length, columns)]
    return _extruded(web, blocks, math.pi / web.count)


def _drawn_out(block: FloatArray, turn: float, columns: int) -> list[FloatArray]:
    """Turn what is on either side of x = 0 away from it, and fill the angle between with columns of elements."""
    radius, theta = np.hypot(*block.T).T, np.arctan2(-block[..., 0], block[..., 1])
    middle = block.shape[1] // 2
    if np.abs(theta[:, middle]).max() > 1e-9:
        return [_points(radius, theta + math.copysign(turn, theta.sum()))]
    between = _points(radius[:, middle, None], np.linspace(-turn, turn, 2 * columns + 1))
    halves = (slice(None, middle + 1), slice(middle, None))
    return [
        between, *(_points(radius[:, s], theta[:, s] + math.copysign(turn, theta[:, s].sum())) for s in halves),
    ]  # fmt: skip


def _points(radius: FloatArray | float, theta: FloatArray | float) -> FloatArray:
    return np.stack(np.broadcast_arrays(-radius * np.sin(theta), radius * np.cos(theta)), axis=-1)


def _outlines(web: PerforatedWeb, box: _Box) -> list[tuple[FloatArray, FloatArray]]:
    """The four sides of the box around a hole, going around it, each with the part of the hole's edge that faces it."""
    theta = np.linspace(-box.half, box.half, 2 * box.along + 1)
    radius = np.linspace(box.low, box.high, 2 * box.up + 1)
    sides = [
        _points(box.low, theta), _points(radius, box.half), _points(box.high, theta[::-1]),
        _points(radius[::-1], -box.half),
    ]  # fmt: skip
    centre, outlines = np.array([0.0, web.on_radius]), []
    for side in sides:
        off = side - centre
        angle = np.unwrap(np.arctan2(off[:, 1], off[:, 0]))
        even = np.linspace(angle[0], angle[-1], len(side))
        outlines.append((side, centre + web.radius * np.stack([np.cos(even), np.sin(even)], axis=-1)))
    return outlines


def _shares(web: PerforatedWeb, box: _Box, fine: bool) -> FloatArray:
    """Shares of the way from a hole's edge to the box around it, of lines of nodes, which crowd at the hole."""
    if not fine:
        even = np.linspace(0.0, 1.0, AROUND + 1)
        return with_middles(0.5 * (even + even**2))
    way = min(web.on_radius - box.low, box.high - web.on_radius) / web.radius - 1.0
    rows = math.ceil(math.log1p(way / FIRST_ROW * (GROWTH - 1.0)) / math.log(GROWTH))
    grown = np.asarray(GROWTH ** np.arange(rows + 1), dtype=np.float64)
    return with_middles((grown - 1.0) / (grown[-1] - 1.0))


def _around(web: PerforatedWeb, box: _Box, shares: FloatArray) -> list[FloatArray]:
    return [edge + shares[:, None, None] * (side - edge) for side, edge in _outlines(web, box)]


def _filling(web: PerforatedWeb, box: _Box) -> list[FloatArray]:
    centre, patches, cores = np.array([0.0, web.on_radius]), [], []
    share = np.linspace(0.0, 1.0, 2 * WITHIN + 1)[:, None, None]
    corners = [centre + CORE * (edge[[0, -1]] - centre) for _, edge in _outlines(web, box)]
    for (_, edge), (first, last) in zip(_outlines(web, box), corners, strict=True):
        core = first + np.linspace(0.0, 1.0, len(edge))[:, None] * (last - first)
        cores.append(core)
        patches.append(core + share * (edge - core))
    up, right = np.linspace(0.0, 1.0, 2 * box.up + 1)[:, None, None], cores[0]
    return [*patches, right + up * (cores[2][::-1] - right)]


def _extruded(web: PerforatedWeb, blocks: list[tuple[FloatArray, bool]], half: float) -> WebMesh:
    low, top = web.z
    z = np.linspace(low, top, 2 * (THROUGH if not web.mirrored else max(1, THROUGH // 2)) + 1)
    points = np.concatenate([block.reshape(-1, 2) for block, _ in blocks])
    keys = np.round(points / (1e-7 * web.outer)).astype(np.int64)
    _, first, number = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    section, number, layers = points[first], number.ravel(), len(z)
    cells, solid, start = [], [], 0
    for block, is_solid in blocks:
        rows, columns = block.shape[:2]
        grid = number[start : start + rows * columns].reshape(rows, columns)
        start += rows * columns
        windows = np.lib.stride_tricks.sliding_window_view(grid, (3, 3))[::2, ::2].reshape(-1, 3, 3)
        one, other, third = section[windows[:, 0, 0]], section[windows[:, 0, 2]], section[windows[:, 2, 0]]
        area = (other - one)[:, 0] * (third - one)[:, 1] - (other - one)[:, 1] * (third - one)[:, 0]
        # Of node places the first one counts along x, the second one along y: right-handed with z.
        cells.append(np.where((area > 0.0)[:, None, None], windows.transpose(0, 2, 1), windows))
        solid.append(np.full(len(windows), is_solid))
    cell, through = np.concatenate(cells), np.arange(0, layers - 1, 2)[:, None] + np.arange(3)
    grid = cell[:, None, :, :, None] * layers + through[None, :, None, None, :]
    column, row, layer = node_places(2)[:QUADRATIC_NODES].T
    elements = grid[:, :, column, row, layer].reshape(-1, QUADRATIC_NODES)
    nodes = np.concatenate([np.repeat(section, layers, axis=0), np.tile(z, len(section))[:, None]], axis=1)
    used = np.unique(elements)
    renumbered = np.full(len(nodes), -1)
    renumbered[used] = np.arange(len(used))
    nodes, elements = nodes[used], renumbered[elements]
    radius, theta, reach = np.hypot(nodes[:, 0], nodes[:, 1]), np.arctan2(-nodes[:, 0], nodes[:, 1]), 1e-7
    inner, outer = (np.abs(radius - r) < reach * web.outer for r in (web.inner, web.outer))
    own = ~inner & ~outer & (web.count > 1)  # the sector of a single hole closes on itself
    on = [np.flatnonzero((np.abs(theta - side) < reach) & own) for side in (half, -half)]
    left, right = (side[np.lexsort((nodes[side, 2].round(6), radius[side].round(6)))] for side in on)
    circles = np.flatnonzero(inner | outer)
    middle = nodes[elements].mean(axis=1)
    places = np.stack([
        np.arctan2(-middle[:, 0], middle[:, 1]) * 100.0, np.hypot(middle[:, 0], middle[:, 1]) * 50.0 / web.outer,
        (middle[:, 2] - low) / (top - low) * len(through) * 0.999,
    ], axis=1)  # fmt: skip
    return WebMesh(nodes, elements, np.repeat(np.concatenate(solid), len(through)),
                 np.floor(places).astype(np.int64), left, right, circles, outer[circles].astype(int))  # fmt: skip
