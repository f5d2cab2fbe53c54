"""Meshes of bodies that the engineer brings: read by `meshio`, held against what a gear's body is, and measured.

Elements become tetrahedra and hexahedra in VTK's order of nodes. The interface is the outermost cylinder about the z
axis: its faces cover it once, or the mesh is refused; so is one in several pieces, without a bore, or with elements
that are turned inside out.
"""

from __future__ import annotations

import hashlib
import importlib
import io
import math
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import numpy as np

from pmor.case.body import UNITS, BodyCase, BodyMesh
from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.core.errors import CaseError
from pmor.core.reading import read_bytes

#: readers of meshio by suffix
READERS = {
    ".inp": "abaqus", ".bdf": "nastran", ".nas": "nastran", ".fem": "nastran", ".msh": "gmsh", ".vtk": "vtk",
    ".vtu": "vtu",
}  # fmt: skip
#: nodes of the elements that are taken, by meshio's names
KINDS = {"tetra": 4, "tetra10": 10, "hexahedron": 8, "hexahedron20": 20}
# Of lower dimension, which mesh generators leave in their files: passed over.
PASSED_OVER = ("vertex", "line", "triangle", "quad", "polygon")
_TETRA_FACES = np.array([[0, 1, 2], [0, 1, 3], [1, 2, 3], [0, 2, 3]])
_TETRA_EDGES = np.array([[0, 1, 4], [1, 2, 5], [0, 2, 6], [0, 3, 7], [1, 3, 8], [2, 3, 9]])
_HEXA_FACES = np.array([[0, 1, 2, 3], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])
_HEXA_TETRAS = np.array([[0, 1, 3, 4], [1, 2, 0, 5], [2, 3, 1, 6], [3, 0, 2, 7], [4, 7, 5, 0], [5, 4, 6, 1],
                         [6, 5, 7, 2], [7, 6, 4, 3]])  # fmt: skip
# Six that fill it, where those are one around each corner.
_HEXA_FILLED = np.array([[0, 1, 2, 6], [0, 2, 3, 6], [0, 3, 7, 6], [0, 7, 4, 6], [0, 4, 5, 6], [0, 5, 1, 6]])
_HEXA_EDGES = np.array([
    [0, 1, 8], [1, 2, 9], [2, 3, 10], [3, 0, 11], [4, 5, 12], [5, 6, 13], [6, 7, 14], [7, 4, 15], [0, 4, 16],
    [1, 5, 17], [2, 6, 18], [3, 7, 19],
])  # fmt: skip
# Corners on a cylinder stand off its radius by so much of it at most: the digits of files.
ON_CYLINDER = 2e-4
# Share of a cylinder that its faces may miss, of the interface, and of the bore, which may have keyways.
OPEN, OPEN_BORE = 1e-3, 0.5
# Harmonics of the mass over the angle that tell how often a body repeats, and the share of the mass that counts.
MOST_REPEATS, UNEVEN = 48, 5e-4
# Nodes closer than this share of the largest coordinate are at one place.
ONE_PLACE = 1e-7
# Bores below this share of the outside are none.
SMALLEST_BORE = 1e-3


@dataclass(frozen=True)
class BodyVolume:
    """A mesh of a body, in mm, its interface a cylinder about z.

    Parameters
    ----------
    nodes : ndarray, shape (n, 3)
    elements : dict of str to ndarray of int
        By meshio's names of their kinds, nodes in VTK's order.
    interface : ndarray of int, shape (m,)
        Nodes on the outermost cylinder, exactly.
    bore : ndarray of int
        Nodes on the innermost one.
    low, high : float
        Ends of the interface along z.
    across : float
        Length of an element's side on the interface.
    """

    nodes: FloatArray
    elements: dict[str, IntArray]
    interface: IntArray
    bore: IntArray
    low: float
    high: float
    across: float

    @property
    def quadratic(self) -> bool:
        """Whether elements have nodes on the middles of their edges."""
        return any(KINDS[kind] > 8 for kind in self.elements)


def body_mesh(path: Path, unit: str) -> BodyMesh:
    """Return what a case keeps of a file with a mesh; CaseError, without its place, where it is no body of a gear."""
    content = _bytes(path)
    sha = hashlib.sha256(content).hexdigest()
    volume = _volume(str(path), sha, unit)
    radius = float(np.hypot(*volume.nodes[volume.interface[0], :2]))
    bore = float(np.median(np.hypot(*volume.nodes[volume.bore, :2].T)))
    return BodyMesh(str(path.resolve()), sha, radius, volume.high - volume.low, bore, *_measured(volume))


def body_volume(body: BodyCase) -> BodyVolume:
    """Return the mesh of a body; CaseError where its file is gone or another one."""
    path = Path(body.mesh.file)
    if hashlib.sha256(_bytes(path)).hexdigest() != body.mesh.sha256:
        raise CaseError(f"{path}: the mesh is not the one that the case was read with: read the case anew")
    volume = _volume(str(path), body.mesh.sha256, body.unit)
    return _image(volume) if body.mesh.mirrored else volume


def _bytes(path: Path) -> bytes:
    try:
        return read_bytes(path)
    except FileNotFoundError:
        raise CaseError(f"{path.name}: there is no such mesh: check the path") from None
    except OSError as error:
        raise CaseError(f"{path.name}: cannot be read ({error.strerror}): name a file with a mesh") from None


@lru_cache(maxsize=2)
def _volume(path: str, sha: str, unit: str) -> BodyVolume:
    """Read and check a file, whose content `sha` tells apart."""
    points, elements = _read(Path(path))
    points = points * UNITS[unit]
    used = np.unique(np.concatenate([cells.ravel() for cells in elements.values()]))
    if used[0] < 0 or used[-1] >= len(points) or not np.isfinite(points[used]).all():
        raise CaseError("elements name nodes that it does not have, or that are no numbers: write the mesh anew")
    number = np.full(len(points), -1)
    number[used] = np.arange(len(used))
    points, elements = points[used], {kind: number[cells] for kind, cells in elements.items()}
    _refuse_inverted(points, elements)
    _refuse_pieces(points, elements)
    faces = _boundary(elements)
    return _with_cylinders(points, elements, faces)


def _read(path: Path) -> tuple[FloatArray, dict[str, IntArray]]:
    if path.suffix.lower() not in READERS:
        known = ", ".join(READERS)
        raise CaseError(f"{path.suffix or 'no suffix'} is no format of a mesh here: write one of {known}")
    try:
        reader = importlib.import_module(f"meshio.{READERS[path.suffix.lower()]}")
    except ImportError:
        raise CaseError("meshes are read by meshio, which is not installed: pip install 'pmor-gear[mesh]'") from None
    try:
        with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
            mesh = reader.read(str(path))
        blocks = [(block.type, np.asarray(block.data, dtype=np.int64)) for block in mesh.cells]
        points = np.asarray(mesh.points, dtype=float)
    except (Exception, SystemExit) as error:  # meshio's readers raise whatever a line of another kind makes of them
        words = " ".join(str(error).split())[:80]
        reason = f" ({words})" if words else ""
        raise CaseError(
            f"is no mesh that meshio reads as {READERS[path.suffix.lower()]}{reason}: write it anew"
        ) from None
    solid = [(kind, cells) for kind, cells in blocks if not kind.startswith(PASSED_OVER) and len(cells)]
    other = sorted({kind for kind, _ in solid if kind not in KINDS})
    if other:
        raise CaseError(f"has elements of the kind {other[0]}: mesh it with tetrahedra or hexahedra alone")
    if not solid or points.ndim != 2 or points.shape[1] != 3:
        raise CaseError("has no tetrahedra and no hexahedra: export the volume, not its surface")
    kinds = sorted({kind for kind, _ in solid})
    if len({KINDS[kind] > 8 for kind in kinds}) > 1:
        raise CaseError(f"mixes linear and quadratic elements, {' and '.join(kinds)}: take one order for all")
    return points, {kind: np.concatenate([cells for own, cells in solid if own == kind]) for kind in kinds}


def _refuse_inverted(points: FloatArray, elements: dict[str, IntArray]) -> None:
    turned, total, first = 0, 0, np.zeros(3)
    for kind, cells in elements.items():
        corners = _HEXA_TETRAS if kind.startswith("hexa") else np.arange(4)[None]
        at = points[cells[:, corners]]
        sides = at[:, :, 1:] - at[:, :, :1]
        volumes = np.linalg.det(sides) / 6.0
        flat = volumes <= 1e-9 * np.linalg.norm(sides, axis=-1).max(axis=-1) ** 3
        bad = flat.any(axis=1)
        if bad.any() and not turned:
            first = points[cells[bad.argmax(), : KINDS[kind]]].mean(axis=0)
        turned, total = turned + int(bad.sum()), total + len(cells)
    if turned:
        place = ", ".join(f"{x:.4g}" for x in first)
        raise CaseError(
            f"{turned} of {total} elements are flat or turned inside out, one near ({place}) mm: repair the mesh, or "
            "the order of their nodes"
        )


def _refuse_pieces(points: FloatArray, elements: dict[str, IntArray]) -> None:
    """Refuse bodies that do not hang together, or only seem to."""
    import scipy.sparse as sp  # a case without a mesh starts without it
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    count = len(points)
    if twice := len(cKDTree(points).query_pairs(ONE_PLACE * float(np.abs(points).max()))):
        raise CaseError(f"has {twice} pairs of nodes at one place, across which it does not hang together: merge them")
    rows = np.concatenate([np.repeat(cells[:, 0], cells.shape[1]) for cells in elements.values()])
    columns = np.concatenate([cells.ravel() for cells in elements.values()])
    linked = sp.coo_array((np.ones(len(rows)), (rows, columns)), shape=(count, count))
    bodies, own = connected_components(linked, directed=False)
    if bodies > 1:
        sizes = np.sort(np.bincount(own))[::-1]
        raise CaseError(
            f"has {bodies} bodies that do not hang together, the largest of {sizes[0]}, the next of {sizes[1]} nodes: "
            "leave one of them alone"
        )


def _boundary(elements: dict[str, IntArray]) -> IntArray:
    """Corners of the faces that one element alone has, (faces, 4); of triangles the last one is twice."""
    listed = []
    for kind, cells in elements.items():
        faces = _TETRA_FACES[:, [0, 1, 2, 2]] if kind.startswith("tetra") else _HEXA_FACES
        listed.append(cells[:, faces].reshape(-1, 4))
    faces = np.concatenate(listed)
    triangle = faces[:, 2] == faces[:, 3]
    keys = np.sort(np.where(triangle[:, None] & (np.arange(4) == 3), -1, faces), axis=1)
    _, first, count = np.unique(keys, axis=0, return_index=True, return_counts=True)
    if count.max() > 2:
        raise CaseError("has faces that more than two elements share: remove elements that are there twice")
    return np.asarray(faces[first[count == 1]])


def _with_cylinders(points: FloatArray, elements: dict[str, IntArray], faces: IntArray) -> BodyVolume:
    radius = np.hypot(points[:, 0], points[:, 1])
    corners = np.unique(faces)
    outer, inner = float(radius[corners].max()), float(radius[corners].min())
    outside, area = _on_cylinder(points, radius, faces, outer)
    if not len(outside):
        raise CaseError("its outside is no cylinder about the z axis: turn and move it so that z is its axis")
    z = points[np.unique(outside), 2]
    low, high = float(z.min()), float(z.max())
    missing = 1.0 - area / (2.0 * math.pi * outer * (high - low)) if high > low else 1.0
    if abs(missing) > OPEN:
        raise CaseError(
            f"its outside is an open cylinder: faces at radius {outer:.6g} mm, from z = {low:.6g} to {high:.6g}, miss "
            f"{100.0 * missing:.3g} % of it: close it, without teeth, and centre it on the z axis"
        )
    if inner < SMALLEST_BORE * outer:
        raise CaseError("has no bore: it is solid down to its axis, and a gear is held at its bore")
    within, held = _on_cylinder(points, radius, faces, inner)
    span = float(np.ptp(points[np.unique(within), 2])) if len(within) else 0.0
    if span == 0.0 or held < (1.0 - OPEN_BORE) * 2.0 * math.pi * inner * span:
        raise CaseError(
            f"has no bore: no cylinder about the z axis at its smallest radius, {inner:.6g} mm, where the gear is "
            "held: give it a round one"
        )
    edges = _middles(elements)
    nodes = points.copy()
    surfaces = []
    for own, at in ((outside, outer), (within, inner)):
        on = np.zeros(len(points), dtype=bool)
        on[own] = True
        on[edges[_edges_of(own, edges), 2]] = True
        nodes[on, :2] *= (at / radius[on])[:, None]
        surfaces.append(np.flatnonzero(on))
    triangles = np.count_nonzero(outside[:, 2] == outside[:, 3])
    across = math.sqrt(area / (len(outside) - 0.5 * triangles))
    return BodyVolume(nodes, elements, surfaces[0], surfaces[1], low, high, across)


def _on_cylinder(points: FloatArray, radius: FloatArray, faces: IntArray, at: float) -> tuple[IntArray, float]:
    """Faces on a cylinder about z, and their area there: over angle times radius, and z."""
    near: BoolArray = np.abs(radius[faces] - at) <= ON_CYLINDER * at
    own = faces[near.all(axis=1)]
    x, y, z = np.moveaxis(points[own], -1, 0)
    angle = np.arctan2(y, x)
    angle = at * (angle[:, :1] + (angle - angle[:, :1] + math.pi) % (2.0 * math.pi) - math.pi)
    following = np.roll(np.arange(4), -1)
    areas = 0.5 * np.abs((angle * z[:, following] - angle[:, following] * z).sum(axis=1))
    # Faces of the ends may have all their corners on it.
    size = np.linalg.norm(np.ptp(points[own], axis=1), axis=1)
    round_ = areas > 1e-6 * size**2
    return own[round_], float(areas[round_].sum())


def _middles(elements: dict[str, IntArray]) -> IntArray:
    """Both corners, the smaller one first, and the middle of all edges of quadratic elements, (e, 3)."""
    listed = [np.empty((0, 3), dtype=np.int64)]
    for kind, cells in elements.items():
        if KINDS[kind] > 8:
            edges = _TETRA_EDGES if kind.startswith("tetra") else _HEXA_EDGES
            listed.append(cells[:, edges].reshape(-1, 3))
    edges = np.concatenate(listed)
    edges[:, :2] = np.sort(edges[:, :2], axis=1)
    return np.unique(edges, axis=0)


def _edges_of(faces: IntArray, edges: IntArray) -> BoolArray:
    """Which edges belong to faces."""
    own = np.concatenate([np.sort(faces[:, [a, b]], axis=1) for a, b in ((0, 1), (1, 2), (2, 3), (3, 0), (0, 2))])
    size = int(max(faces.max(initial=0), edges.max(initial=0))) + 1
    return np.isin(edges[:, 0] * size + edges[:, 1], own[:, 0] * size + own[:, 1])


def _measured(volume: BodyVolume) -> tuple[int, float, float, float]:
    """How often a body repeats around its axis, its volume, its polar and its tilting moment."""
    radius = float(np.hypot(*volume.nodes[volume.interface[0], :2]))
    # Elements repeat themselves: what has fewer than two to a wave is theirs.
    n = np.arange(1, max(2, min(MOST_REPEATS, int(math.pi * radius / volume.across))))
    middle, half = 0.5 * (volume.low + volume.high), 0.5 * (volume.high - volume.low)
    waves, total, polar, tilting = np.zeros((3, len(n)), dtype=complex), 0.0, 0.0, 0.0
    for kind, cells in volume.elements.items():
        places, weights = _points_of(volume.nodes, cells, kind)
        x, y, z = places.reshape(-1, 3).T
        own, r = weights.ravel(), np.hypot(x, y)
        wave = np.exp(-1j * np.outer(n, np.arctan2(y, x)))
        for row, moment in enumerate((np.ones_like(r), r / radius, (z - middle) / half)):
            waves[row] += wave @ (own * moment)
        total, polar = total + float(own.sum()), polar + float(own @ r**2)
        tilting += float(own @ (0.5 * r**2 + (z - middle) ** 2))
    uneven = n[(np.abs(waves) > UNEVEN * total).any(axis=0)]
    return int(np.gcd.reduce(uneven)) if len(uneven) else 0, total, polar, tilting


def _points_of(nodes: FloatArray, cells: IntArray, kind: str) -> tuple[FloatArray, FloatArray]:
    """Places inside of elements and their shares of the volume, by corners: (n, p, 3) and (n, p)."""
    tetras = nodes[cells[:, np.arange(4)[None] if kind.startswith("tetra") else _HEXA_FILLED]]
    volumes = np.linalg.det(tetras[:, :, 1:] - tetras[:, :, :1]) / 6.0
    inner = (5.0 - math.sqrt(5.0)) / 20.0
    share = np.full((4, 4), inner) + (1.0 - 4.0 * inner) * np.eye(4)
    places = np.einsum("pa,ntac->ntpc", share, tetras)
    return places.reshape(len(cells), -1, 3), np.repeat(0.25 * volumes, 4, axis=1)


def _image(volume: BodyVolume) -> BodyVolume:
    """The mirror image, x to -x: elements turn inside out, and other orders of their nodes turn them back."""
    nodes = volume.nodes * [-1.0, 1.0, 1.0]
    back = {
        "tetra": [1, 0, 2, 3],
        "tetra10": [1, 0, 2, 3, 4, 6, 5, 8, 7, 9],
        "hexahedron": [4, 5, 6, 7, 0, 1, 2, 3],
        "hexahedron20": [4, 5, 6, 7, 0, 1, 2, 3, 12, 13, 14, 15, 8, 9, 10, 11, 16, 17, 18, 19],
    }
    elements = {kind: cells[:, back[kind]] for kind, cells in volume.elements.items()}
    return BodyVolume(nodes, elements, volume.interface, volume.bore, volume.low, volume.high, volume.across)
