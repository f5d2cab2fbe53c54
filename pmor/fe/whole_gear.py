"""The whole gear as one sparse system: the brute-force oracle of the cyclic condensation."""

from __future__ import annotations

import numpy as np
import scipy.sparse.linalg as spla

from pmor.core.arrays import FloatArray, IntArray
from pmor.core.conventions import rotation_z
from pmor.core.errors import MeshError
from pmor.fe.assembly import assemble, degrees_of_freedom
from pmor.fe.completion import completion, nodes_of_elements
from pmor.mesh.sector import SectorMesh


def whole_gear_mesh(mesh: SectorMesh) -> tuple[FloatArray, IntArray, IntArray]:
    """Repeat a sector around the axis and merge the side faces.

    Parameters
    ----------
    mesh : SectorMesh

    Returns
    -------
    nodes : ndarray, shape (n_nodes, 3)
        In the frame of tooth 0, mm.
    elements : ndarray of int, shape (n_elements, 8 or 27)
    numbers : ndarray of int, shape (teeth, sector nodes)
        Node of the whole gear for each node of each sector.

    Raises
    ------
    MeshError
        When the sector does not span the whole face width.
    """
    if mesh.width != "whole":
        raise MeshError(f'whole gears have the whole face width, not "{mesh.width}": write [mesh] width = "whole"')
    count = len(mesh.nodes)
    # The bore's corner nodes are shared between neighbours as well.
    left = np.concatenate([mesh.left, mesh.bore[: len(mesh.z)]])
    right = np.concatenate([mesh.right, mesh.bore[-len(mesh.z) :]])
    own = np.setdiff1d(np.arange(count), right)
    numbers = np.empty((mesh.teeth, count), dtype=np.int64)
    numbers[:, own] = np.arange(mesh.teeth * len(own)).reshape(mesh.teeth, len(own))
    numbers[:, right] = np.roll(numbers, 1, axis=0)[:, left]
    nodes = np.empty((mesh.teeth * len(own), 3))
    for k in range(mesh.teeth):
        nodes[numbers[k, own]] = mesh.nodes[own] @ rotation_z(2.0 * np.pi * k / mesh.teeth).T
    return nodes, numbers[:, mesh.elements].reshape(-1, mesh.elements.shape[1]), numbers


def whole_gear_displacement(
    mesh: SectorMesh, youngs_modulus: float, poisson_ratio: float, element: str, flank_forces: FloatArray
) -> FloatArray:
    """Solve the whole gear for forces on the flank of tooth 0.

    Parameters
    ----------
    mesh : SectorMesh
    youngs_modulus : float
        MPa.
    poisson_ratio : float
    element : {"hex8", "hex8i", "hex20"}
    flank_forces : ndarray, shape (n, m)
        Forces on the flank's degrees of freedom, m load cases, N.

    Returns
    -------
    ndarray, shape (teeth, 3 x sector nodes, m)
        Displacement of each sector in its own frame, mm.
    """
    nodes, elements, numbers = whole_gear_mesh(mesh)
    stiffness = assemble(nodes, elements, youngs_modulus, poisson_ratio, element)
    load = np.zeros((3 * len(nodes), flank_forces.shape[1]))
    own = nodes_of_elements(mesh, mesh.flank)
    load[degrees_of_freedom(numbers[0, own])] = completion(mesh, mesh.flank).T @ flank_forces
    held = np.concatenate([numbers[:, mesh.bore].ravel(), numbers[:, mesh.middles].ravel()])
    free = np.setdiff1d(np.arange(3 * len(nodes)), degrees_of_freedom(held))
    factor = spla.splu(stiffness[free][:, free].tocsc(), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True})
    solution = np.zeros_like(load)
    solution[free] = factor.solve(load[free])
    result = np.empty((mesh.teeth, 3 * len(mesh.nodes), flank_forces.shape[1]))
    every = np.arange(len(mesh.nodes))
    full, own = completion(mesh, every), degrees_of_freedom(nodes_of_elements(mesh, every))
    for k in range(mesh.teeth):
        vectors = solution.reshape(len(nodes), 3, -1)[numbers[k]]
        turned = np.einsum("ij,njm->nim", rotation_z(-2.0 * np.pi * k / mesh.teeth), vectors)
        result[k] = full @ turned.reshape(3 * len(mesh.nodes), -1)[own]
    return result
