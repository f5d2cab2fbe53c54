"""Blanks that do not change around the axis: quadratic elements over a section, Fourier's series over the angle.

The displacement of a body of revolution is a sum of harmonics that do not feel each other,

    u_r = U e^(i n t),    u_theta = i V e^(i n t),    u_z = W e^(i n t),    t = theta - tau z,                       (1)

U, V, W functions of r and z (Wilson, AIAA J. 3 (1965) 2269; Zienkiewicz & Taylor, The Finite Element Method, vol. 1,
5th ed. (2000), ch. 9). Lines of equal t follow helical teeth: across them harmonics of many waves would change their
sign within an element. Derivatives along z are d/dz - i n tau. The stiffness of each harmonic is a polynomial in n, K_0
+ n K_1 + n^2 K_2, real where tau is 0. The section is a stack of blocks of nine-node elements, from the hub at the
bore, where it is held, out to the rim: rows of elements are eliminated one after the other, of all harmonics together,
and what is left is the stiffness of the outermost row of nodes. Of the rim around an internal gear it is the innermost
one: the stack begins at its outside, which is free.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.fe.element import law_in_surface

# Real of spur gears, complex of helical ones.
Amplitudes = NDArray[np.inexact[Any]]
# Of Gauss's rule in each direction.
POINTS = 3
# Harmonics that are eliminated at a time: their matrices fit into the memory next to the processor.
TOGETHER = 32
# Share of a harmonic's amplitude at the interface below which what lies further in is taken as held: (r / R)^n.
UNFELT = 1e-8
Span = tuple[float, float]
ALL: Span = (-np.inf, np.inf)
NONE = np.empty(0, dtype=np.int64)
# Of the stiffness that holds a mean motion, or a rigid bedding, over Young's modulus, 1/mm.
MUCH = 1e4


@dataclass(frozen=True)
class Block:
    """A ring of nine-node elements, of rectangular section, or of one whose faces change over the radius.

    Parameters
    ----------
    radii, z : ndarray
        Of the lines between elements, mm: z rising, radii too, or falling from the outside of a ring inwards. Lines
        along a radius whose z changes have one at each of the radii, (radii, lines).
    """

    radii: FloatArray
    z: FloatArray

    @property
    def at_radii(self) -> FloatArray:
        """Z of the lines at each of the radii, (radii, lines), mm."""
        return np.broadcast_to(self.z, (len(self.radii), self.z.shape[-1]))

    @property
    def nodes_z(self) -> FloatArray:
        """Place z of the columns of nodes: lines and the middles between them, mm."""
        return with_middles(self.z)


def with_middles(lines: FloatArray) -> FloatArray:
    """Return positions with those in the middle between neighbours."""
    places = np.empty(2 * len(lines) - 1)
    places[::2], places[1::2] = lines, 0.5 * (lines[1:] + lines[:-1])
    return places


class Gauges(NamedTuple):
    """Points on the faces of a block at which the stress in the surface is asked for.

    Attributes
    ----------
    block : int
        Its place in the stack.
    row : ndarray of int, shape (g,)
        Rows of elements of the block.
    across : ndarray, shape (g,)
        Place between the inner side of the row, -1, and the outer one, 1.
    upper : ndarray of bool, shape (g,)
        On the face of larger z.
    """

    block: int
    row: IntArray
    across: FloatArray
    upper: BoolArray

    def places(self, block: Block) -> FloatArray:
        """Return radius and z of the points, (g, 2), mm."""
        inner, outer = block.radii[self.row], block.radii[self.row + 1]
        radius = 0.5 * (inner + outer + self.across * (outer - inner))
        return np.stack([radius, np.where(self.upper, block.z[-1], block.z[0])], axis=1)


class Loads(NamedTuple):
    """So many unit loads on the nodes between two rows of elements, at a radius, mm.

    `at` has them over the nodes, (3 m, c) or (h, 3 m, c), of their z and of harmonics (h, 1, 1).
    """

    radius: float
    size: int
    at: Callable[[FloatArray, FloatArray], Amplitudes]


def ring_stiffness(
    blocks: tuple[Block, ...], youngs_modulus: float, poisson_ratio: float, harmonics: IntArray, mirrored: bool,
    twist: float = 0.0, loads: tuple[Loads, ...] = (), core: float = 0.0, held: Span | None = ALL,
    gauges: Gauges | None = None, bedding: tuple[float, float] = (0.0, 0.0),
) -> Amplitudes:  # fmt: skip
    """Return the stiffness of the last row of nodes of a body of revolution that is held at its first one, or free.

    With a core nothing is held but the mean motion as a rigid body of the cylinder around it.

    Parameters
    ----------
    blocks : tuple of Block
        From the bore outwards; lines of neighbours meet wherever both have material.
    youngs_modulus : float
        MPa.
    harmonics : ndarray of int, shape (h,)
        0 or above.
    mirrored : bool
        The section ends at z = 0 in a plane of symmetry: nodes there keep their z, and it counts twice.
    twist : float
        tau, rad/mm.
    loads : tuple of Loads
        C in all, in the order of the blocks.
    core : float
        Radius of that cylinder, between two rows of elements, mm; 0 where there is none.
    held : (float, float) or None
        Between these z the first row of nodes, at the bore, is held, mm; None is nowhere.
    bedding : (float, float)
        Stiffness below the first row of nodes where it is not held, radially and along the surface, N/mm^3.
    gauges : Gauges, optional
        They are three loads each, after the others, which work on the stress along the section, around the axis, and
        the shear of both, MPa: of amplitudes whose shear is over i.

    Returns
    -------
    ndarray, shape (h, 3 m + C, 3 m + C)
        Over U, V, W of equation (1), node by node along z, N/mm: for the energy over a whole revolution,
        u^H K u / 2 with the amplitudes u. With loads [[K, -r], [-r^H, -F]]: r the forces that they pass on to the
        outermost row, were it held, and F the displacements that they then cause.
    """
    law = hookes_law(youngs_modulus, poisson_ratio)
    plane, count = law_in_surface(youngs_modulus, poisson_ratio), sum(load.size for load in loads)
    rows = list[_Row]()
    for number, block in enumerate(blocks):
        for place in range(len(block.radii) - 1):
            on = np.flatnonzero(gauges.row == place) if gauges and gauges.block == number else ()
            own = [
                (count + 3 * int(g), *_surface_stress(block, place, gauges.across[g], gauges.upper[g], plane, twist))
                for g in on if gauges
            ]  # fmt: skip
            free = beyond(with_middles(block.at_radii[0]), held) if held and not rows else NONE
            stiffness = row_stiffness(block, place, law, twist)
            z = [with_middles(lines) for lines in block.at_radii[place : place + 2]]
            rows.append(_Row(z[0], z[1], block.radii[place + 1], stiffness, own, free))
    count += 3 * len(gauges.row) if gauges else 0
    revolution, parts = 4.0 * np.pi if mirrored else 2.0 * np.pi, []
    for first in range(0, len(harmonics), TOGETHER):
        n = harmonics[first : first + TOGETHER]
        felt = [row for row in rows if count or held is None or (row.outer / rows[-1].outer) ** n[0] > UNFELT]
        still = _MeanMotion(core, MUCH * youngs_modulus, twist)
        edge = None
        if held is None:
            edge = _Edge(float(blocks[0].radii[0]), bedding)
        parts.append(_eliminated(felt, n[:, None, None].astype(float), mirrored, loads, count, revolution, still, edge))
    return np.concatenate(parts)


class _Row(NamedTuple):
    """A row of elements: z of its columns of nodes at its inner and its outer radius, and the latter.

    Of its stiffness K_0, K_1 and K_2 over its three rows of nodes.

    Of each gauge the number of its first load, and its stress over these nodes: steady, and what n multiplies; of the
    inner row of nodes the unknowns that are free though it is held.
    """

    inner_z: FloatArray
    z: FloatArray
    outer: float
    stiffness: tuple[Amplitudes, Amplitudes, Amplitudes]
    gauges: list[tuple[int, Amplitudes, Amplitudes]]
    free: IntArray


class _Edge(NamedTuple):
    """A free edge at a radius, and the stiffness of its bedding, radially and along the surface, N/mm^3."""

    radius: float
    bedding: tuple[float, float]


def edge_stiffness(radius: float, z: FloatArray, bedding: tuple[float, float]) -> FloatArray:
    """Return the stiffness of a bedding over U, V, W at columns of nodes, for an angle of 1 rad, (3 m, 3 m).

    Parameters
    ----------
    radius : float
        Of the edge, mm.
    bedding : (float, float)
        Radially and along the surface, N/mm^3.
    """
    shares = np.zeros((len(z), len(z)))
    element = np.array([[4.0, 2.0, -1.0], [2.0, 16.0, 2.0], [-1.0, 2.0, 4.0]]) / 30.0
    for place in range(0, len(z) - 1, 2):
        shares[place : place + 3, place : place + 3] += (z[place + 2] - z[place]) * element
    radial, along = bedding
    return np.asarray(radius * np.kron(shares, np.diag([radial, along, along])))


class _MeanMotion(NamedTuple):
    """Mean motion of a cylinder as a rigid body, held by a stiffness for its area, N/mm^3; twist of equation (1)."""

    radius: float
    stiffness: float
    twist: float

    def stiffness_of(self, n: int, z: FloatArray, mirrored: bool) -> Amplitudes:
        """Over U, V, W at the columns of nodes, for an angle of 1 rad, (3 m, 3 m); none but of harmonics 0 and 1."""
        ones, none, height = np.ones_like(z), np.zeros_like(z), z - z.mean()
        modes = {0: [(none, ones, none), (none, none, ones)],
                 1: [(ones, ones, none), (height, height, -self.radius * ones)]}.get(n, [])  # fmt: skip
        # Of loads that are symmetrical about the plane z = 0.
        modes = modes[:1] if mirrored else modes
        area = np.zeros_like(z)
        for place in range(0, len(z) - 1, 2):
            area[place : place + 3] += np.array([1.0, 4.0, 1.0]) / 6.0 * (z[place + 2] - z[place])
        stiffness = np.zeros((3 * len(z), 3 * len(z)), dtype=complex if self.twist else float)
        for mode in modes:
            field = np.stack(mode, axis=-1)
            moved = (field * (area * np.exp(1j * n * self.twist * z) if self.twist else area)[:, None]).ravel()
            size = float(area @ (field**2).sum(axis=1))
            stiffness += self.stiffness * self.radius / size * np.outer(moved, moved.conj())
        return stiffness


def _eliminated(
    rows: list[_Row],
    n: FloatArray,
    mirrored: bool,
    loads: tuple[Loads, ...],
    count: int,
    revolution: float,
    core: _MeanMotion,
    edge: _Edge | None,
) -> Amplitudes:
    """Matrix of the last row of nodes and `count` loads, harmonics (h, 1, 1); from a free edge, or held."""
    z = rows[0].inner_z
    size = 0 if edge is None else 3 * len(z)
    left: Amplitudes = np.zeros((len(n), size + count, size + count), dtype=rows[0].stiffness[0].dtype)
    if edge is not None:
        left[:, :size, :size] += revolution * edge_stiffness(edge.radius, z, edge.bedding)
        _add_loads(left, loads, edge.radius, z, n)
    for row in rows:
        left, z, size = _handed_on(left, count, z, row.inner_z), row.z, 3 * len(row.z)
        constant, linear, square = row.stiffness
        own = np.zeros((len(n), 3 * size + count, 3 * size + count), dtype=constant.dtype)
        own[:, : 3 * size, : 3 * size] = revolution * (constant + n * linear + n * n * square)
        for first, steady, turning in row.gauges:
            stress, at = steady + n * turning, slice(3 * size + first, 3 * size + first + 3)
            own[:, at, : 3 * size], own[:, : 3 * size, at] = -stress, -stress.conj().swapaxes(-1, -2)
        if mirrored:
            held = (3 * np.flatnonzero(z == 0.0) + 2 + size * np.arange(3)[:, None]).ravel()
            own[:, held, :] = own[:, :, held] = 0.0
            own[:, held, held] = revolution * constant.max()
        at_bore = left.shape[1] == count
        before = np.arange(3 * size, 3 * size + count)
        before = before if at_bore else np.concatenate([np.arange(size), before])
        own[:, before[:, None], before] = own[:, before[:, None], before] + left
        inner, outer = np.arange(2 * size), slice(2 * size, None)
        if at_bore and not core.radius:
            inner = np.append(row.free, inner[size:])
        across = own[:, inner, outer]
        left = own[:, outer, outer] - own[:, outer, inner] @ np.linalg.solve(own[:, inner[:, None], inner], across)
        left = 0.5 * (left + left.conj().transpose(0, 2, 1))
        if abs(core.radius - row.outer) <= 1e-9 * row.outer:
            for h, harmonic in enumerate(n.ravel().tolist()):
                left[h, :size, :size] += revolution * core.stiffness_of(int(harmonic), z, mirrored)
        _add_loads(left, loads, row.outer, z, n)
    return left


def _add_loads(matrix: Amplitudes, loads: tuple[Loads, ...], radius: float, z: FloatArray, n: FloatArray) -> None:
    """Put those at a radius into a matrix over the row of nodes there, and all loads."""
    size = place = 3 * len(z)
    for load in loads:
        if abs(load.radius - radius) <= 1e-9 * radius:
            own = load.at(z, n)
            across = slice(place, place + load.size)
            matrix[:, :size, across] = matrix[:, :size, across] - own
            matrix[:, across, :size] = matrix[:, across, :size] - own.conj().swapaxes(-1, -2)
        place += load.size


def _handed_on(matrix: Amplitudes, count: int, z: FloatArray, wanted: FloatArray) -> Amplitudes:
    """Matrix over the nodes of the next block and `count` loads: nodes that it does not have are free."""
    if matrix.shape[1] == count:
        return matrix
    reach = 1e-9 * (wanted[-1] - wanted[0])
    shared = [int(np.abs(z - place).argmin()) for place in wanted]
    met = np.abs(z[shared] - wanted) <= reach
    own, other = np.asarray(shared)[met], np.setdiff1d(np.arange(len(z)), np.asarray(shared)[met])
    kept, free = np.append(_unknowns(own), 3 * len(z) + np.arange(count)), _unknowns(other)
    schur = matrix[:, kept[:, None], kept]
    if len(free):
        across = matrix[:, free[:, None], kept]
        schur = schur - across.conj().transpose(0, 2, 1) @ np.linalg.solve(matrix[:, free[:, None], free], across)
    size = 3 * len(wanted)
    handed_on = np.zeros((len(matrix), size + count, size + count), dtype=schur.dtype)
    to = np.append(_unknowns(np.flatnonzero(met)), size + np.arange(count))
    handed_on[:, to[:, None], to] = schur
    return handed_on


def beyond(z: FloatArray, held: Span) -> IntArray:
    """Unknowns of nodes that are not between two places along the axis, of which lines of elements go through."""
    slack = 1e-9 * (z[-1] - z[0])
    return _unknowns(np.flatnonzero((z < held[0] - slack) | (z > held[1] + slack)))


def _unknowns(nodes: IntArray) -> IntArray:
    return (3 * np.asarray(nodes, dtype=np.int64)[:, None] + np.arange(3)).ravel()


def hookes_law(youngs_modulus: float, poisson_ratio: float) -> FloatArray:
    """Hooke's law over strain rr, tt, zz, rz, rt, tz."""
    shear = 0.5 * youngs_modulus / (1.0 + poisson_ratio)
    law = np.zeros((6, 6))
    law[:3, :3] = 2.0 * shear * poisson_ratio / (1.0 - 2.0 * poisson_ratio)
    law[range(6), range(6)] += [2.0 * shear] * 3 + [shear] * 3
    return law


def _surface_stress(
    block: Block, row: int, across: float, upper: bool, law: FloatArray, twist: float
) -> tuple[Amplitudes, Amplitudes]:
    """Stress along the section, around the axis and shear at a point of a face, over a row's nodes, (3, 9 m).

    Steady, and what n multiplies.
    """
    inner, outer = block.radii[row : row + 2]
    (shape_r, slope_r), (shape_z, slope_z) = parabolas(across), parabolas(1.0 if upper else -1.0)
    element = len(block.z) - 2 if upper else 0
    shape = np.outer(shape_r, shape_z).ravel()
    by_r = np.outer(slope_r, shape_z).ravel() * 2.0 / (outer - inner)
    by_z = np.outer(shape_r, slope_z).ravel() * 2.0 / (block.z[element + 1] - block.z[element])
    steady, turning = _strains(shape, by_r, by_z[None], 0.5 * (inner + outer + across * (outer - inner)), twist)
    columns = 2 * len(block.z) - 1
    places = _unknowns((np.arange(3)[:, None] * columns + 2 * element + np.arange(3)).ravel())
    stress = np.zeros((2, 3, 9 * columns), dtype=complex if twist else float)
    stress[:, :, places] = law @ np.stack([steady[0, [0, 1, 4]], turning[[0, 1, 4]]])
    return stress[0], stress[1]


def row_stiffness(block: Block, row: int, law: FloatArray, twist: float) -> tuple[Amplitudes, Amplitudes, Amplitudes]:
    """K_0, K_1 and K_2 of a row of elements, over its three rows of nodes: (9 m, 9 m) each, for an angle of 1 rad."""
    inner, outer = block.radii[row : row + 2]
    height, (lines, further) = outer - inner, block.at_radii[row : row + 2]
    # Widths at the inner radius; how much wider they are, and how far their lower lines have moved, at the outer one.
    widths, wider, moved = np.diff(lines), np.diff(further - lines), (further - lines)[:-1]
    places, weights = np.polynomial.legendre.leggauss(POINTS)
    elements = len(widths)
    size = 3 * 3 * (2 * elements + 1)
    kind = complex if twist else float
    assembled, own = np.zeros((3, size, size), dtype=kind), np.zeros((3, elements, 27, 27), dtype=kind)
    for a, weight in zip(places, weights, strict=True):
        shape_r, slope_r = parabolas(a)
        r = 0.5 * (inner + outer + a * height)
        width = widths + 0.5 * (1.0 + a) * wider
        for b, other in zip(places, weights, strict=True):
            shape_z, slope_z = parabolas(b)
            shape = np.outer(shape_r, shape_z).ravel()
            by_z = np.outer(shape_r, slope_z).ravel() * 2.0 / width[:, None]
            slope = (moved + 0.5 * (1.0 + b) * wider)[:, None] / height
            by_r = np.outer(slope_r, shape_z).ravel() * 2.0 / height - slope * by_z
            steady, turning = _strains(shape, by_r, by_z, r, twist)
            volume = (0.25 * weight * other * abs(height) * r * width)[:, None, None]
            for place, product in enumerate((
                steady.transpose(0, 2, 1) @ law @ steady,
                steady.transpose(0, 2, 1) @ law @ turning + turning.conj().T @ law @ steady,
                np.broadcast_to(turning.conj().T @ law @ turning, (elements, 27, 27)),
            )):  # fmt: skip
                own[place] += volume * product
    for e in range(elements):
        nodes = (np.arange(3)[:, None] * (2 * elements + 1) + 2 * e + np.arange(3)).ravel()
        own_places = _unknowns(nodes)
        assembled[:, own_places[:, None], own_places] += own[:, e]
    return assembled[0], assembled[1], assembled[2]


def _strains(
    shape: FloatArray, by_r: FloatArray, by_z: FloatArray, r: float, twist: float
) -> tuple[FloatArray, Amplitudes]:
    """Strain rr, tt, zz, rz, rt, tz of equation (1) over U, V, W: (e, 6, 27), and (6, 27) that n multiplies."""
    steady, turning = np.zeros((len(by_z), 6, 27)), np.zeros((6, 27))
    u, v, w = (slice(part, None, 3) for part in range(3))
    steady[:, 0, u], steady[:, 1, u], steady[:, 2, w] = by_r, shape / r, by_z
    steady[:, 3, u], steady[:, 3, w] = by_z, by_r
    steady[:, 4, v], steady[:, 5, v] = by_r - shape / r, by_z
    turning[1, v], turning[4, u], turning[5, w] = -shape / r, shape / r, shape / r
    if not twist:
        return steady, turning
    along = np.zeros_like(turning)
    along[2, w] = along[3, u] = along[5, v] = twist * shape
    return steady, turning - 1j * along


def parabolas(place: float) -> tuple[FloatArray, FloatArray]:
    """Shape functions of three nodes on a line, at -1, 0 and 1, and their slopes."""
    x = float(place)
    return np.array([0.5 * x * (x - 1.0), 1.0 - x * x, 0.5 * x * (x + 1.0)]), np.array([x - 0.5, -2.0 * x, x + 0.5])
