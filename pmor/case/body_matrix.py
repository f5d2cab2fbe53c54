"""Stiffness matrices of bodies that the engineer brings: read, held against what a gear's body is, and measured.

An FE package condensed the body, held at its bore, onto nodes of the cylinder that it ends at. Displacements are x, y,
z of each node, node by node, as nodes are listed.
"""

from __future__ import annotations

import hashlib
import math
import zipfile
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import NoReturn

import numpy as np

from pmor.case.body import UNITS, BodyMatrix, MatrixCase
from pmor.case.seats import refuse_half
from pmor.core.arrays import FloatArray
from pmor.core.errors import CaseError
from pmor.core.reading import read_bytes

#: newtons in the unit of force beside each unit of length
FORCES = {"mm": 1.0, "m": 1.0, "in": 4.4482216152605}
# Nodes stand off the radius of their cylinder by so much of it at most: the digits of files.
ON_CYLINDER = 2e-4
# Work of a rigid motion, over that of single nodes that move as far; a thin web still has 1e-5 along the axis.
RIGID = 1e-8
MOTIONS = ("along x", "along y", "along z", "about x", "about y", "about z")
# Distance of a place on the cylinder to the nearest node, over that between nodes.
FARTHEST = 1.5
# Nodes closer than this share of the radius are at one place.
ONE_PLACE = 1e-7
# Nodes to a wave of the highest harmonic that tells how often a body repeats, such harmonics at most, and the share of
# the stiffness that counts. *Measured*: 0.0065 of a web without holes in quadratic tetrahedra of uneven size, 0.010 of
# six holes of 1 mm in a web of 4 mm, 0.12 of those of 3.5 mm.
NODES_TO_A_WAVE, MOST_HARMONICS, UNEVEN = 8, 24, 8e-3


@dataclass(frozen=True)
class BodyStiffness:
    """A body on the nodes of a cylinder about z.

    Parameters
    ----------
    nodes : ndarray, shape (m, 3)
        mm.
    matrix : ndarray, shape (3 m, 3 m)
        Over x, y, z of node by node, N/mm.
    spacing : float
        Between nodes, mm.
    """

    nodes: FloatArray
    matrix: FloatArray
    spacing: float


def body_matrix(path: Path, unit: str) -> BodyMatrix:
    """Return what a case keeps of a file with a matrix; CaseError, without its place, where it is no body of a gear."""
    sha = _sha(path)
    body = _checked(str(path), sha, unit)
    radius, width = float(np.hypot(*body.nodes[0, :2])), float(np.ptp(body.nodes[:, 2]))
    own = float(np.median(body.matrix.diagonal())) / body.spacing
    return BodyMatrix(str(path.resolve()), sha, radius, width, _repeats(body), own)


def body_stiffness(body: MatrixCase) -> BodyStiffness:
    """Return the matrix of a body; CaseError where its file is gone or another one."""
    path = Path(body.matrix.file)
    if _sha(path) != body.matrix.sha256:
        raise CaseError(f"{path}: the matrix is not the one that the case was read with: read the case anew")
    stiffness = _checked(str(path), body.matrix.sha256, body.unit)
    if not body.matrix.mirrored:
        return stiffness
    image = np.array([-1.0, 1.0, 1.0])
    signs = np.tile(image, len(stiffness.nodes))
    return BodyStiffness(stiffness.nodes * image, signs[:, None] * stiffness.matrix * signs, stiffness.spacing)


def _sha(path: Path) -> str:
    digest = hashlib.sha256()
    for file in _files(path):
        try:
            digest.update(read_bytes(file))
        except FileNotFoundError:
            raise CaseError(f"{file.name}: there is no such file: check the path") from None
        except OSError as error:
            raise CaseError(f"{file.name}: cannot be read ({error.strerror}): name a file with a matrix") from None
    return digest.hexdigest()


def _files(path: Path) -> list[Path]:
    """The file of a matrix and that of its nodes."""
    return [path] if path.suffix.lower() == ".npz" else [path, path.with_suffix(".csv")]


@lru_cache(maxsize=1)
def _checked(path: str, sha: str, unit: str) -> BodyStiffness:
    """Read and check a file, whose content `sha` tells apart."""
    nodes, matrix = _read(Path(path))
    if nodes.ndim != 2 or nodes.shape[1] != 3:
        raise CaseError(f"has nodes of the shape {nodes.shape}: write x, y and z of each in a row")
    if matrix.ndim != 2 or matrix.shape != (size := 3 * len(nodes), size):
        shape = " x ".join(str(length) for length in matrix.shape)
        raise CaseError(
            f"its matrix is {shape}, and {len(nodes)} nodes take {size} x {size}: condense onto these alone"
        )
    if not (np.isfinite(nodes).all() and np.isfinite(matrix).all()):
        raise CaseError("has entries that are no numbers: write it anew")
    nodes, spacing = _on_a_cylinder(nodes * UNITS[unit])
    refuse_half(matrix, _refuse_matrix)
    matrix = (0.5 * FORCES[unit] / UNITS[unit]) * (matrix + matrix.T)
    _refuse_loose(nodes, matrix)
    return BodyStiffness(nodes, matrix, spacing)


def _refuse_matrix(rule: str) -> NoReturn:
    raise CaseError(f"its matrix {rule}")


def _read(path: Path) -> tuple[FloatArray, FloatArray]:
    suffix = path.suffix.lower()
    if suffix not in (".npz", ".mtx"):
        raise CaseError(f"{suffix or 'no suffix'} is no format of a matrix here: write .npz, or .mtx with a .csv")
    try:
        if suffix == ".npz":
            with path.open("rb") as file, np.load(file) as arrays:
                nodes, matrix = arrays["nodes"], arrays["stiffness"]
        else:
            from scipy.io import mmread

            nodes, matrix = np.loadtxt(path.with_suffix(".csv"), delimiter=",", ndmin=2), mmread(path)
            matrix = matrix if isinstance(matrix, np.ndarray) else matrix.toarray()
        return np.asarray(nodes, dtype=float), np.asarray(matrix, dtype=float)
    except (KeyError, ValueError, TypeError, OSError, EOFError, AttributeError, zipfile.BadZipFile) as error:
        words = " ".join(str(error).split())[:80]
        wanted = (
            "the arrays nodes and stiffness" if suffix == ".npz" else "Matrix Market, and x, y, z of nodes in a .csv"
        )
        raise CaseError(f"cannot be read ({words}): write {wanted}") from None


def _on_a_cylinder(nodes: FloatArray) -> tuple[FloatArray, float]:
    """Nodes moved onto their cylinder exactly, and how far they are apart."""
    from scipy.spatial import cKDTree  # a case without a matrix starts without it

    off, radii = np.empty(3), np.empty(3)
    for axis in range(3):
        own = np.hypot(*np.delete(nodes, axis, axis=1).T)
        radii[axis] = 0.5 * (own.min() + own.max())
        off[axis] = np.ptp(own) / max(own.max(), np.finfo(float).tiny)
    radius = float(radii[2])
    low, width = float(nodes[:, 2].min()), float(np.ptp(nodes[:, 2]))
    if off[2] > 2.0 * ON_CYLINDER or width == 0.0:
        other = int(off.argmin())
        about = f", but about {'xyz'[other]}" if other < 2 and off[other] <= 2.0 * ON_CYLINDER else ""
        own = np.hypot(*nodes[:, :2].T)
        raise CaseError(
            f"its nodes are on no cylinder about the z axis{about}, radii from {own.min():.6g} to {own.max():.6g} mm: "
            "turn and move the body so that z is its axis, and keep the nodes of its outside alone"
        )
    nodes = nodes.copy()
    nodes[:, :2] *= (radius / np.hypot(*nodes[:, :2].T))[:, None]
    tree = cKDTree(nodes)
    if twice := len(tree.query_pairs(ONE_PLACE * radius)):
        raise CaseError(f"has {twice} pairs of nodes at one place: merge them before the body is condensed")
    ends = np.minimum(nodes[:, 2] - low, low + width - nodes[:, 2]) < 1e-3 * width
    between = math.sqrt(2.0 * math.pi * radius * width / max(1.0, len(nodes) - 0.5 * np.count_nonzero(ends)))
    around, along = (math.ceil(length / between) for length in (2.0 * math.pi * radius, width))
    angle, z = np.meshgrid(np.arange(2 * around) * math.pi / around, low + width * np.linspace(0.0, 1.0, 2 * along + 1))
    places = np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=-1).reshape(-1, 3)
    farthest = float(tree.query(places)[0].max())
    if farthest > FARTHEST * between:
        raise CaseError(
            f"its nodes leave a part of their cylinder out, {between:.3g} mm apart on average and {farthest:.3g} mm "
            "from one place of it: condense onto all nodes of the cylinder"
        )
    return nodes, max(between, farthest)


def _refuse_loose(nodes: FloatArray, matrix: FloatArray) -> None:
    """Refuse bodies that are held nowhere, or that push themselves on."""
    from scipy import linalg as la

    x, y, z = (nodes / np.abs(nodes).max()).T
    none, one = np.zeros_like(x), np.ones_like(x)
    listed = (one, none, none), (none, one, none), (none, none, one), (none, -z, y), (z, none, -x), (-y, x, none)
    motions = np.stack([np.stack(motion, axis=1).ravel() for motion in listed], axis=1)
    diagonal = matrix.diagonal()
    if diagonal.min() > 0.0:
        work, shapes = la.eigh(motions.T @ matrix @ motions, motions.T @ (diagonal[:, None] * motions))
        if abs(work[0]) < RIGID:
            motion = MOTIONS[int(np.abs(shapes[:, 0]).argmax())]
            raise CaseError(
                f"its body is not held: a motion {motion} costs no force: hold its bore before it is condensed"
            )
    try:
        la.cholesky(matrix, lower=True, check_finite=False)
    except la.LinAlgError:
        raise CaseError(
            "its matrix is not positive definite: write the stiffness of a body that is held at its bore, x, y, z of "
            "the first node first"
        ) from None


def _repeats(body: BodyStiffness) -> int:
    """How often a body repeats around its axis: which harmonics feel each other; 0 where none do."""
    coupled = _coupled(body)
    uneven = 1 + np.flatnonzero(coupled[1:] > UNEVEN)
    return int(np.gcd.reduce(uneven)) if len(uneven) else 0


def _coupled(body: BodyStiffness) -> FloatArray:
    """Largest share of the stiffness in which harmonics n and n + k feel each other, over k."""
    x, y, z = body.nodes.T
    radius = float(np.hypot(x[0], y[0]))
    most = max(1, min(MOST_HARMONICS, int(2.0 * math.pi * radius / (NODES_TO_A_WAVE * body.spacing))))
    frames = np.zeros((len(x), 3, 3))  # rows over x, y, z
    frames[:, 0, 0], frames[:, 1, 0], frames[:, 2, 2] = x / radius, y / radius, 1.0
    frames[:, 0, 1], frames[:, 1, 1] = -y / radius, x / radius
    over = np.stack([np.ones_like(z), 2.0 * (z - z.min()) / np.ptp(z) - 1.0], axis=1)
    n = np.arange(-most, most + 1)
    waves = np.exp(1j * np.outer(np.arctan2(y, x), n))
    moved = np.einsum("man,mk,mj->makjn", frames, waves, over).reshape(3 * len(x), -1)
    forces = body.matrix @ moved.real + 1j * (body.matrix @ moved.imag)
    work = np.abs(moved.conj().T @ forces)
    alone = np.sqrt(work.diagonal())
    shares = (work / alone[:, None] / alone).reshape(len(n), 6, len(n), 6).max(axis=(1, 3))
    return np.array([shares.diagonal(k).max() if k else 1.0 for k in range(2 * most + 1)])
