"""The mesh of a whole gear: its sectors with the side faces merged."""

from __future__ import annotations

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.core.conventions import rotation_z
from pmor.core.errors import MeshError
from pmor.fe.sector import SectorMesh


def whole_gear_mesh(mesh: SectorMesh) -> tuple[FloatArray, IntArray, IntArray]:
    """Repeat a sector around the axis and merge the side faces.

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
