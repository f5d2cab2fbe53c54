"""A meshed body condensed onto the harmonics of the cylinder that it ends at.

Nodes of the cylinder move as the columns of nodes of the rim above them do,

    u(theta, z) = sum_n sum_l U_nl N_l(z) e^(i n (theta - tau z)),                                                   (1)

N_l the rim's own shape functions over the width: rigid motions and even strains are among them, so that neither costs a
force where rim and body meet. The mesh sees harmonics up to n of a few elements to a wave. With G the stiffness of the
body's nodes on the cylinder, T_n their displacement by harmonic n,

    K_nm = T_n^H G T_m.                                                                                              (2)

K_nn is a body of revolution; what remains, of harmonics that differ by multiples of the number of times that the body
repeats, makes teeth differ.

Stiffness of tetrahedra, linear isotropic elasticity, all elements at once.

``tetra`` has four nodes and constant strain, ``tetra10`` quadratic shape functions, of the corners L_a (2 L_a - 1) and
of the edges 4 L_a L_b with volume coordinates L, edges curved as their middles say, at four points (Zienkiewicz &
Taylor, The Finite Element Method, vol. 1, 5th ed. (2000), ch. 8.12).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pmor.case.body_mesh import KINDS, BodyVolume
from pmor.core.arrays import ComplexArray, FloatArray, IntArray
from pmor.core.errors import MeshError
from pmor.fe.elimination import condense
from pmor.fe.hexahedron import element_stiffness

# Elements whose matrices are integrated at a time.
BLOCK = 256
_INNER = (5.0 - np.sqrt(5.0)) / 20.0
_EDGES = np.array([[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]])
# Gradients of the volume coordinates over the second, third and fourth of them.
_SLOPES = np.array([[-1.0, -1.0, -1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


def tetrahedron_stiffness(
    nodes: FloatArray, elements: IntArray, youngs_modulus: float, poisson_ratio: float
) -> FloatArray:
    """Return the stiffness matrices of elements of k = 4 or 10 nodes in VTK's order, (n, 3 k, 3 k), N/mm.

    Raises
    ------
    MeshError
        When the Jacobian is not positive at an integration point.
    """
    count = elements.shape[1]
    slopes = _slopes_at_points(count)
    weight = 1.0 / (6.0 * len(slopes))
    shear = youngs_modulus / (2.0 * (1.0 + poisson_ratio))
    lame = 2.0 * shear * poisson_ratio / (1.0 - 2.0 * poisson_ratio)
    stiffness = np.empty((len(elements), 3 * count, 3 * count))
    for first in range(0, len(elements), BLOCK):
        corners = nodes[elements[first : first + BLOCK]]
        jacobian = slopes.transpose(0, 2, 1) @ corners[:, None]
        det = np.linalg.det(jacobian)
        if det.min() <= 0.0:
            worst = int(np.unravel_index(det.argmin(), det.shape)[0])
            place = ", ".join(f"{x:.4g}" for x in corners[worst].mean(axis=0))
            raise MeshError(f"an element near ({place}) mm has a negative Jacobian at an integration point")
        gradients = slopes @ np.linalg.inv(jacobian).transpose(0, 1, 3, 2)
        gradients *= np.sqrt(weight * det)[:, :, None, None]
        flat = gradients.reshape(len(corners), len(slopes), -1)
        products = (flat.transpose(0, 2, 1) @ flat).reshape(len(corners), count, 3, count, 3)
        full = shear * products.transpose(0, 1, 4, 3, 2) + lame * products
        trace = shear * np.trace(products, axis1=2, axis2=4)
        for axis in range(3):
            full[:, :, axis, :, axis] += trace
        stiffness[first : first + BLOCK] = full.reshape(len(corners), 3 * count, -1)
    return stiffness


def _slopes_at_points(count: int) -> FloatArray:
    """Gradients of the shape functions at the integration points, (p, k, 3)."""
    if count == 4:
        return _SLOPES[None]
    places = np.full((4, 4), _INNER) + (1.0 - 4.0 * _INNER) * np.eye(4)
    corners = (4.0 * places - 1.0)[:, :, None] * _SLOPES
    first, other = _EDGES.T
    edges = 4.0 * (places[:, first, None] * _SLOPES[other] + places[:, other, None] * _SLOPES[first])
    return np.concatenate([corners, edges], axis=1)


# Nodes of the interface at most: their stiffness is a full matrix, here of 0.8 GB.
MOST_NODES = 3300
# Forces of rigid motions, over those of as large a motion of single nodes.
RIGID = 1e-9


class Condensed(NamedTuple):
    """A body on its interface.

    Attributes
    ----------
    stiffness : ndarray, shape (N + 1, 3 l, 3 l)
        K_nn of n = 0 ... N over radial, circumferential and axial amplitudes of the columns, N/mm.
    coupling : ndarray, shape ((2 M + 1) c, (2 M + 1) c)
        K_nm of n, m = -M ... M, different ones, in c shapes over the columns.
    """

    stiffness: ComplexArray
    coupling: ComplexArray


def condensed_nodes(volume: BodyVolume, youngs_modulus: float, poisson_ratio: float) -> FloatArray:
    """Return the stiffness of the nodes of the interface, held at the bore and not held anywhere else, N/mm.

    Over radial, circumferential and axial displacement node by node.

    Raises
    ------
    MeshError
        For too many nodes, elements that are turned inside out, or forces of rigid motions.
    """
    if len(volume.interface) > MOST_NODES:
        raise MeshError(
            f"the mesh has {len(volume.interface)} nodes on its interface, more than the {MOST_NODES} that are "
            "condensed: take larger elements there"
        )
    material = youngs_modulus, poisson_ratio
    widest = max(KINDS[kind] for kind in volume.elements)
    count = sum(len(cells) for cells in volume.elements.values())
    elements, stiffness = np.full((count, widest), -1), np.zeros((count, 3 * widest, 3 * widest))
    first = 0
    for kind, cells in volume.elements.items():
        own = slice(first, first + len(cells))
        elements[own, : cells.shape[1]] = cells
        size = 3 * cells.shape[1]
        if kind.startswith("tetra"):
            stiffness[own, :size, :size] = tetrahedron_stiffness(volume.nodes, cells, *material)
        else:
            name = "hex20" if KINDS[kind] == 20 else "hex8i"
            stiffness[own, :size, :size] = element_stiffness(volume.nodes, cells, *material, name)
        first += len(cells)
    _refuse_forces_of_rigid_motions(volume, elements, stiffness)
    matrix = condense(stiffness, elements, _places(volume, elements), volume.interface, volume.bore)
    return in_own_frames(matrix, volume.nodes[volume.interface])


def _refuse_forces_of_rigid_motions(volume: BodyVolume, elements: IntArray, stiffness: FloatArray) -> None:
    nodes = np.append(volume.nodes, np.zeros((1, 3)), axis=0)
    x, y, z = nodes.T / np.abs(nodes).max()
    none, one = np.zeros_like(x), np.ones_like(x)
    shifts = (one, none, none), (none, one, none), (none, none, one)
    turns = (-y, x, none), (none, -z, y), (z, none, -x)
    motions = np.stack([np.stack(motion, axis=1) for motion in (*shifts, *turns)], axis=-1)
    moved = motions[elements].reshape(len(elements), stiffness.shape[1], 6)
    if np.abs(stiffness @ moved).max() > RIGID * np.abs(stiffness).max():
        raise MeshError("rigid motions of the mesh cost a force: its elements are too distorted, mesh it anew")


def _places(volume: BodyVolume, elements: IntArray) -> IntArray:
    """Row, column and layer of each element in a grid around the axis, for the nested dissection."""
    middle = volume.nodes[elements[:, :4]].mean(axis=1)
    radius, angle = np.hypot(middle[:, 0], middle[:, 1]), np.arctan2(middle[:, 1], middle[:, 0])
    size = max(volume.across, 1e-3 * float(radius.max()))
    places = np.stack([radius / size, angle * float(radius.mean()) / size, middle[:, 2] / size], axis=1)
    return np.floor(places).astype(np.int64)


def in_own_frames(matrix: FloatArray, nodes: FloatArray) -> FloatArray:
    """Return a matrix over radial, circumferential and axial displacement of nodes, in place of that over x, y, z."""
    x, y = (nodes[:, :2] / np.hypot(nodes[:, 0], nodes[:, 1])[:, None]).T
    for over in (matrix, matrix.T):
        one, other = over[0::3].copy(), over[1::3].copy()
        over[0::3] = x[:, None] * one + y[:, None] * other
        over[1::3] = x[:, None] * other - y[:, None] * one
    return matrix


def onto_harmonics(
    matrix: FloatArray, waves: ComplexArray, columns: FloatArray, shapes: FloatArray, coupled: int, repeats: int
) -> Condensed:
    """Return a body on the harmonics of its interface: equation (2).

    Parameters
    ----------
    matrix : ndarray, shape (3 m, 3 m)
        As `condensed_nodes` returns it.
    waves : ndarray, shape (N + 1, m)
        e^(i n (theta - tau z)) at its nodes.
    columns : ndarray, shape (m, l)
        N_l there.
    shapes : ndarray, shape (3 l, c)
        Over the columns, of the harmonics that feel each other.
    coupled : int
        M.
    repeats : int
        Of the body around its axis; 0 couples none.
    """
    size, layers, count = len(waves), columns.shape[1], shapes.shape[1]
    over = np.kron(columns, np.eye(3))
    inner = over @ shapes
    stiffness = np.empty((size, 3 * layers, 3 * layers), dtype=complex)
    number = 2 * coupled + 1 if repeats else 0
    coupling = np.zeros((number, count, number, count), dtype=complex)
    for n in range(size):
        wave = np.repeat(waves[n], 3)[:, None]
        moved = matrix @ np.hstack([wave.real * over, wave.imag * over])
        forces = moved[:, : 3 * layers] + 1j * moved[:, 3 * layers :]
        stiffness[n] = over.T @ (wave.conj() * forces)
        if repeats and n <= coupled:
            forces = forces @ shapes
            for m in range(-coupled, coupled + 1):
                if m == n or (m - n) % repeats:
                    continue
                other = np.repeat(waves[abs(m)] if m >= 0 else waves[-m].conj(), 3)[:, None]
                coupling[coupled + m, :, coupled + n] = inner.T @ (other.conj() * forces)
                coupling[coupled - m, :, coupled - n] = coupling[coupled + m, :, coupled + n].conj()
    flat = coupling.reshape(number * count, number * count)
    return Condensed(_hermitian(stiffness), _hermitian(flat[None])[0])


def _hermitian(matrices: ComplexArray) -> ComplexArray:
    return np.asarray(0.5 * (matrices + matrices.conj().transpose(0, 2, 1)), dtype=np.complex128)
