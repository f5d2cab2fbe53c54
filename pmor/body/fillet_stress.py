"""Stress along the root fillets under unit forces on the flanks: a linear map, found once and for all.

The sector's mesh resolves how a tooth bends, not the notch at its foot. So the material around the fillet has a fine
mesh of its own (`pmor.fe.fillet`), whose cut follows the displacement of the sector, and the strain along the surface
is taken from the displacement of the surface itself. No traction acts there: two strains and a shear in the surface are
all that is needed (plane stress in the tangent plane). The stresses, as functions of the sector's displacement, are
carried through its elimination (`pmor.fe.elimination`), whatever the number of forces on flanks.

*Measured*, paper's pair in plane strain, a line load at the outer point of single contact: 86.72 MPa, and 86.84 MPa by
CalculiX on elements of 0.015 modules; 33 elements around the fillet, and 451 give 86.78. With 8 elements on the flank
or 32, a fillet of 6 elements in the sector's mesh or of 24: within 0.15 %. In 3-D: 91.2 MPa at mid width, CalculiX
91.4. Linear elements in the sector bend too little, and the stress is too low with them: by 1 % (16 ``hex8i`` on the
flank), 3 % (8 ``hex8``).

The fillet of the other side is the image of the loaded one: in the plane through the tooth's middle and the axis where
all sections are alike or half the width is meshed, else by half a turn about the radius through the tooth's middle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from pmor.body.rim import RimStress
from pmor.core.arrays import FloatArray, IntArray
from pmor.core.conventions import rotation_z
from pmor.core.errors import MeshError
from pmor.fe.assembly import degrees_of_freedom
from pmor.fe.condensation import uncouple
from pmor.fe.element import QUADRATIC_NODES, law_in_surface, surface_strain
from pmor.fe.elimination import CarriedFunctions, condense
from pmor.fe.fillet import FilletMesh
from pmor.fe.hexahedron import element_stiffness, shape_functions, shape_gradient
from pmor.fe.sector import SectorMesh

# Of an element's local coordinates, which go from -1 to 1: how far outside of it points may lie, as those on the true
# flank do where elements are flat.
OUTSIDE = 0.5
NEWTON_STEPS = 12
# Where Newton's iteration for such a place is held back.
FARTHEST = 2.0
SMALLEST_SHARE = 1e-14
# Elements of a section whose middle is nearest, among which the one that holds a point is sought.
CANDIDATES = 12


@dataclass(frozen=True)
class FilletPoints:
    """Where the stress is known: points along the loaded side's fillet, at columns of nodes.

    Parameters
    ----------
    section : ndarray, shape (p, 2)
        In the section z = 0, from the start of the involute to the middle of the tooth space, mm.
    z : ndarray, shape (c,)
        mm.
    """

    section: FloatArray
    z: FloatArray

    @property
    def shape(self) -> tuple[int, int, int]:
        """Shape of the stress in the surface: points, columns, components."""
        return len(self.section), len(self.z), 3


@dataclass(frozen=True)
class FilletStress:
    """Stress along the fillets under unit forces on a flank.

    Parameters
    ----------
    shapes : ndarray, shape (2 NEIGHBOURS + 1, 2, p, c, 3, n)
        Of the teeth around, counted counter-clockwise from the loaded one; on the loaded flank's side, on the other
        one; points; columns; along the outline, across it, shear; under unit forces on the flank's unknowns, MPa/N.
    rim : RimStress or None
        What the bending of the rim adds to it, and at teeth farther away; of gears on blanks.
    """

    points: FilletPoints
    shapes: FloatArray
    rim: RimStress | None = None


def surface_stress(mesh: FilletMesh, youngs_modulus: float, poisson_ratio: float) -> tuple[FilletPoints, sp.csr_array]:
    """Return the stress in the surface over the displacement of a fillet's nodes.

    Parameters
    ----------
    youngs_modulus : float
        MPa.

    Returns
    -------
    points : FilletPoints
    rows : scipy.sparse.csr_array, shape (3 p c, 3 n_nodes)
        Along the outline, across it and the shear of both, point by point and column by column, MPa/mm.
    """
    columns, layers = mesh.section.shape[1], len(mesh.z)
    wide, across = (columns - 1) // 2, (layers - 1) // 2
    elements = mesh.elements.reshape(-1, wide, across, QUADRATIC_NODES)[0]
    law = law_in_surface(youngs_modulus, poisson_ratio)
    values, rows, cols, count = [], [], [], np.zeros((columns, layers))
    for a in range(3):
        for b in range(3):
            slopes = shape_gradient(np.array([a - 1.0, -1.0, b - 1.0]), 2)[:, [0, 2]]
            face = np.flatnonzero(np.abs(slopes).max(axis=1) > 1e-12)
            strain = surface_strain(mesh.nodes[elements[..., face]], slopes[face])
            column, layer = np.arange(wide) * 2 + a, np.arange(across) * 2 + b
            count[np.ix_(column, layer)] += 1.0
            place = column[:, None] * layers + layer
            row = np.broadcast_to(3 * place[..., None, None] + np.arange(3)[:, None], (wide, across, 3, 3 * len(face)))
            unknown = (3 * elements[..., face][..., None] + np.arange(3)).reshape(wide, across, 1, -1)
            values.append((law @ strain).ravel())
            rows.append(row.ravel())
            cols.append(np.broadcast_to(unknown, row.shape).ravel())
    shape = 3 * columns * layers, 3 * len(mesh.nodes)
    summed = sp.coo_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(cols))), shape=shape).tocsr()
    mean = sp.diags_array(np.repeat(1.0 / count.ravel(), 3)) @ summed
    own = np.arange(mesh.first, columns)
    kept = degrees_of_freedom(own[:, None] * layers + mesh.columns)
    return FilletPoints(mesh.section[0, mesh.first :], mesh.z[mesh.columns]), mean.tocsr()[kept]


def cut_stress(
    mesh: FilletMesh, sector: SectorMesh, youngs_modulus: float, poisson_ratio: float
) -> tuple[FilletPoints, FloatArray, IntArray]:
    """Return the stress along a fillet over the displacement of the cut around its mesh.

    Parameters
    ----------
    mesh, youngs_modulus, poisson_ratio
        As in `surface_stress`.
    sector : SectorMesh
        That it is cut out of.

    Returns
    -------
    points : FilletPoints
    stress : ndarray, shape (3 p c, 3 m)
        MPa/mm.
    cut : ndarray of int, shape (m,)
        Nodes of the fillet's mesh.
    """
    numbers, used = mesh.numbers, np.unique(mesh.elements)
    cut = np.concatenate([numbers[1:, [0, -1]].ravel(), numbers[-1, 1:-1].ravel(), numbers[0, [0, -1]].ravel()])
    cut, surface = np.intersect1d(cut, used), np.intersect1d(numbers[0, 1:-1].ravel(), used)
    stiffness = element_stiffness(mesh.nodes, mesh.elements, youngs_modulus, poisson_ratio, "hex20")
    held, retained = _held(mesh, sector), np.concatenate([surface, cut])
    uncouple(stiffness, held[degrees_of_freedom(mesh.elements).reshape(len(mesh.elements), -1)])
    schur = condense(stiffness, mesh.elements, mesh.places, retained, np.empty(0, dtype=np.int64))
    points, rows = surface_stress(mesh, youngs_modulus, poisson_ratio)
    free = 3 * len(surface)
    direct = rows[:, degrees_of_freedom(retained)].toarray()
    factor = la.cho_factor(schur[:free, :free], lower=True, check_finite=False)
    through = la.cho_solve(factor, direct[:, :free].T, check_finite=False)
    stress = direct[:, free:] - through.T @ schur[:free, free:]
    stress[:, held[degrees_of_freedom(cut)]] = 0.0
    return points, stress, cut


def _held(mesh: FilletMesh, sector: SectorMesh) -> np.ndarray:
    """Which unknowns do not move along the axis."""
    held, layers = np.zeros(3 * len(mesh.nodes), dtype=bool), len(mesh.z)
    if sector.width == "plane_strain":
        held[2::3] = True
    elif sector.mirrored:
        held[3 * layers - 1 :: 3 * layers] = True
    return held


def sector_stress(
    mesh: FilletMesh, sector: SectorMesh, youngs_modulus: float, poisson_ratio: float
) -> tuple[FilletPoints, tuple[CarriedFunctions, CarriedFunctions]]:
    """Return the stress along both fillets of a sector as functions of its displacement.

    Parameters
    ----------
    mesh, sector, youngs_modulus, poisson_ratio
        As in `cut_stress`.

    Returns
    -------
    points : FilletPoints
    stress : two CarriedFunctions
        3 p c each, of the loaded side and of the other one, MPa/mm.
    """
    points, stress, cut = cut_stress(mesh, sector, youngs_modulus, poisson_ratio)
    layers, helical = len(mesh.z), sector.twist_per_length != 0.0
    section, layer = np.divmod(cut, layers)
    xy = mesh.section.reshape(-1, 2)[section]
    middle = sector.twist_per_length * 0.5 * (sector.z[0] + sector.z[-1])
    axis = np.array([-np.sin(middle), np.cos(middle), 0.0])
    along = np.array([0.0, 0.0, 0.0 if helical else 1.0])
    image = 2.0 * (np.outer(axis, axis) + np.outer(along, along)) - np.eye(3)
    imaged = (stress.reshape(*points.shape, -1, 3) @ image).reshape(*points.shape, -1)
    if helical:  # the image of a column is at the other end of the width
        imaged = imaged[:, ::-1]
    own = _displacement_at(sector, xy, layer, layers)
    other = _displacement_at(sector, xy * [-1.0, 1.0], layers - 1 - layer if helical else layer, layers)
    return points, (_carried(sector, stress, own), _carried(sector, imaged.reshape(stress.shape), other))


def _carried(sector: SectorMesh, stress: FloatArray, displacement: sp.csr_array) -> CarriedFunctions:
    """Stress over the displacement of a cut, and that over the displacement of the sector's nodes, put together."""
    still = np.isin(displacement.indices, np.append(sector.held_axially, degrees_of_freedom(sector.held)))
    displacement.data[still] = 0.0
    unknowns = np.unique(displacement.indices)
    return CarriedFunctions(unknowns, displacement[:, unknowns].T @ stress.T, displacement.shape[1])


def _displacement_at(sector: SectorMesh, xy: FloatArray, layer: IntArray, layers: int) -> sp.csr_array:
    """Displacement at places of a sector's section, on layers of quadratic elements, (3 m, 3 n_nodes)."""
    width, through = len(sector.z), (layers - 1) // 2
    nodes = sector.elements[:, :QUADRATIC_NODES]
    nodes = nodes.reshape(-1, through, nodes.shape[1])
    plane = [0, 1, 2, 3] if sector.order == 1 else [0, 1, 2, 3, 8, 9, 10, 11]
    angle = -sector.twist_per_length * sector.z[0]
    flat = sector.nodes[::width] @ rotation_z(angle).T
    corners = flat[nodes[:, 0, plane] // width, :2]
    places, which = np.unique(xy.round(9), axis=0, return_inverse=True)
    elements, local = _holding(corners, places, sector.order)
    # On the two faces of an element that sections are, and in the middle between them.
    shares = np.stack([
        [shape_functions(np.array([*point, depth]), sector.order) for depth in (-1.0, 0.0, 1.0)] for point in local
    ])  # fmt: skip
    which, slab = which.ravel(), np.minimum(layer // 2, through - 1)
    share, own = shares[which, layer - 2 * slab], nodes[elements[which], slab]
    used = np.abs(share) > SMALLEST_SHARE
    row = np.broadcast_to(np.arange(len(xy))[:, None], share.shape)
    shape = len(xy), len(sector.nodes)
    return sp.kron(sp.coo_array((share[used], (row[used], own[used])), shape=shape), np.eye(3)).tocsr()


def _holding(corners: FloatArray, points: FloatArray, order: int) -> tuple[IntArray, FloatArray]:
    """Elements of a section that hold points, and the points' places in them, (m, 2).

    Raises
    ------
    MeshError
        Where there is none.
    """
    middle = corners[:, :4].mean(axis=1)
    nearest = np.argsort(np.linalg.norm(middle - points[:, None], axis=2), axis=1)[:, :CANDIDATES]
    elements, (places, outside) = nearest[:, 0].copy(), _places_in(corners[nearest[:, 0]], points, order)
    # The nearest middle is seldom that of another element: only where it is, all others are tried.
    others = np.flatnonzero(outside > 0.0)
    if len(others):
        tried = nearest[others]
        found, beyond = _places_in(
            corners[tried].reshape(-1, *corners.shape[1:]), points[others].repeat(tried.shape[1], axis=0), order
        )
        beyond = beyond.reshape(tried.shape)
        best = np.where((beyond <= 0.0).any(axis=1), (beyond <= 0.0).argmax(axis=1), beyond.argmin(axis=1))
        chosen = np.arange(len(others)), best
        elements[others], outside[others] = tried[chosen], beyond[chosen]
        places[others] = found.reshape(*tried.shape, 2)[chosen]
    if outside.max(initial=0.0) > OUTSIDE:
        worst = points[outside.argmax()]
        raise MeshError(
            f"no element of the sector holds the point ({worst[0]:.6g}, {worst[1]:.6g}) mm of a fillet's mesh; "
            "take more elements, or write [results] root_stress = false"
        )
    return elements, places


def _places_in(corners: FloatArray, points: FloatArray, order: int) -> tuple[FloatArray, FloatArray]:
    """Return places of points in an element each, (m, 2), and by how much they are outside it, (m,)."""
    local = np.zeros((len(points), 2))
    for _ in range(NEWTON_STEPS):
        values, slopes = _plane_shapes(local, order)
        miss = np.einsum("pk,pkd->pd", values, corners) - points
        jacobian = np.einsum("pke,pkd->pde", slopes, corners)
        local = np.clip(local - np.linalg.solve(jacobian, miss[..., None])[..., 0], -FARTHEST, FARTHEST)
    return local, np.abs(local).max(axis=1) - 1.0


def _plane_shapes(local: FloatArray, order: int) -> tuple[FloatArray, FloatArray]:
    """Shape functions of quadrilaterals with 4 or 8 nodes at points, (m, k), and their gradients, (m, k, 2)."""
    corners = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    far = 1.0 + local[:, None] * corners
    values, slopes = 0.25 * far.prod(axis=2), 0.25 * corners * far[..., ::-1]
    if order == 1:
        return values, slopes
    along = (local[:, None] * corners).sum(axis=2) - 1.0
    slopes = slopes * along[..., None] + values[..., None] * corners
    values = values * along
    x, y = local.T
    wide, high = 1.0 - x * x, 1.0 - y * y
    middles = 0.5 * np.stack([wide * (1.0 - y), (1.0 + x) * high, wide * (1.0 + y), (1.0 - x) * high])
    by_x = np.stack([-x * (1.0 - y), 0.5 * high, -x * (1.0 + y), -0.5 * high])
    by_y = np.stack([-0.5 * wide, -(1.0 + x) * y, 0.5 * wide, -(1.0 - x) * y])
    return np.hstack([values, middles.T]), np.concatenate([slopes, np.stack([by_x.T, by_y.T], axis=2)], axis=1)
