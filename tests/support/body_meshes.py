"""Meshes of blanks as an engineer would bring them: rings of rectangular section, of tetrahedra or hexahedra."""

from itertools import permutations

import numpy as np

from pmor.fe.body_condensation import condensed_nodes
from pmor.fe.perforated_web import web_mesh

TETRA_EDGES = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]
HEXA = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
HEXA_EDGES = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]


def body_mesh(radii, z, around, solid, kind="tetra10", closed=True, angles=None):
    """Nodes and elements of a body of revolution, or of what `solid` (r, z, theta of a cell's middle) leaves of it."""
    radii, z = np.asarray(radii, dtype=float), np.asarray(z, dtype=float)
    steps = 2 * around if closed else 2 * around + 1
    fine = [_doubled(radii), _doubled(z), np.arange(steps) * np.pi / around if angles is None else angles]
    r, height, theta = np.meshgrid(*fine, indexing="ij")
    points = np.stack([r * np.cos(theta), r * np.sin(theta), height], axis=-1).reshape(-1, 3)
    shape = np.array(r.shape)

    def number(place):
        place = place % shape if closed else place
        return (place[..., 0] * shape[1] + place[..., 1]) * shape[2] + place[..., 2]

    i, j, k = (
        grid.ravel() for grid in np.meshgrid(*map(np.arange, (len(radii) - 1, len(z) - 1, around)), indexing="ij")
    )
    kept = solid(0.5 * (radii[i] + radii[i + 1]), 0.5 * (z[j] + z[j + 1]), (k + 0.5) * 2.0 * np.pi / around)
    cells = 2 * np.stack([i, j, k], axis=1)[kept]
    if kind.startswith("tetra"):
        paths = [np.cumsum([np.zeros(3, int), *np.eye(3, dtype=int)[list(order)]], axis=0)
                 for order in permutations(range(3))]  # fmt: skip
        # Radius, width and angle are a left-handed system: even permutations turn the other way.
        paths = [path if np.linalg.det(path[1:]) < 0 else path[[1, 0, 2, 3]] for path in paths]
        edges, per = TETRA_EDGES, 4
    else:
        paths, edges, per = [np.array(HEXA)[:, [0, 2, 1]]], HEXA_EDGES, 8
    listed = []
    for path in paths:
        places = cells[:, None] + 2 * path
        places = np.concatenate([places, np.stack([(places[:, a] + places[:, b]) // 2 for a, b in edges], axis=1)], 1)
        listed.append(number(places)[:, : None if kind[-1].isdigit() else per])
    elements = np.concatenate(listed)
    used = np.unique(elements)
    renumbered = np.full(len(points), -1)
    renumbered[used] = np.arange(len(used))
    return points[used], renumbered[elements]


def holed_body(web, hub, rim, z):
    """Quadratic hexahedra of a web with round holes, the first one on the x axis, and lines of radii of hub and rim."""
    sector = web_mesh(web)
    x, y, height = sector.nodes.T
    radius, own = np.hypot(x, y), np.arctan2(-x, y)
    on = (np.abs(radius - web.outer) < 1e-6) & (np.abs(height - web.z[0]) < 1e-6)
    within = np.sort(own[on & (own < np.pi / web.count - 1e-9)])
    pitch = 2.0 * np.pi / web.count
    angles = np.concatenate([within + k * pitch for k in range(web.count)])
    parts = [
        body_mesh(radii, z, len(angles) // 2, lambda r, *_: r > 0.0, "hexahedron20", angles=angles)
        for radii in (hub, rim)
    ]
    kept = sector.elements[sector.solid]
    for k in range(web.count):
        turned = [radius * np.cos(own + k * pitch), radius * np.sin(own + k * pitch), height]
        parts.append((np.stack(turned, axis=1), kept))
    first = np.cumsum([0, *(len(nodes) for nodes, _ in parts)])
    points = np.concatenate([nodes for nodes, _ in parts])
    elements = np.concatenate([cells + start for (_, cells), start in zip(parts, first, strict=False)])
    keys = np.floor(points / 1e-4 + 0.37).astype(int)
    _, place, number = np.unique(keys, axis=0, return_index=True, return_inverse=True)
    elements = number.ravel()[elements]
    used = np.unique(elements)
    renumbered = np.full(len(place), -1)
    renumbered[used] = np.arange(len(used))
    return points[place][used], renumbered[elements]


def _doubled(lines):
    return np.sort(np.concatenate([lines, 0.5 * (lines[1:] + lines[:-1])]))


def write_mesh(path, points, elements, kind="tetra10"):
    """Write a mesh in the format of the path's suffix."""
    import meshio

    mesh, named = meshio.Mesh(np.round(points, 9), [(kind, elements)]), {".msh": "gmsh"}
    meshio.write(path, mesh, file_format=named.get(path.suffix))
    return path


def condensed_body(volume, youngs_modulus, poisson_ratio):
    """Nodes of a body's interface, and its stiffness over x, y, z of node by node, as an FE package writes them."""
    nodes = volume.nodes[volume.interface]
    along = np.zeros((len(nodes), 3, 3))  # x, y, z of radial, circumferential and axial directions
    x, y = (nodes[:, :2] / np.hypot(nodes[:, 0], nodes[:, 1])[:, None]).T
    along[:, 0, 0] = along[:, 1, 1] = x
    along[:, 1, 0], along[:, 0, 1], along[:, 2, 2] = y, -y, 1.0
    size = len(nodes)
    own = condensed_nodes(volume, youngs_modulus, poisson_ratio).reshape(size, 3, size, 3)
    matrix = np.einsum("mia,manb,njb->minj", along, own, along, optimize=True).reshape(3 * size, 3 * size)
    return nodes, 0.5 * (matrix + matrix.T)
