"""Grids of nodes with the surface that the kernels lay over them."""

import numpy as np

from pmor.penalty.kernels import projection, state, surface
from pmor.penalty.pair import FOOT_STEP

ROUND_OFF = 1e-13  # mm or 1, for surfaces of size 1
# The projection stops when a step is below FOOT_STEP of an element; the foot is that far off, the gap by its square.
FOOT = 2.0 * FOOT_STEP
GAP = 1e-11


class Surface:
    """A grid of nodes with everything that the kernels prepare for it."""

    def __init__(self, nodes, smooth=True, parabolic=True, edges=(True, True), mirrored=False):
        self.nodes, self.smooth = np.ascontiguousarray(nodes, dtype=float), smooth
        self.normals = np.empty_like(self.nodes)
        surface.node_normals(self.nodes, *edges, parabolic, mirrored, self.normals)
        self.prepared = surface.prepare_surface(self.nodes, *edges, smooth, parabolic, mirrored)

    @property
    def elements(self):
        return [(i, k) for i in range(self.nodes.shape[0] - 1) for k in range(self.nodes.shape[1] - 1)]

    def at(self, i, k, s, t):
        point, tangent_s, tangent_t = np.empty(3), np.empty(3), np.empty(3)
        surface.surface_point(self.prepared, i, k, s, t, point, tangent_s, tangent_t)
        return point, tangent_s, tangent_t

    def normal(self, i, k, s, t):
        _, tangent_s, tangent_t = self.at(i, k, s, t)
        normal = np.cross(tangent_t, tangent_s)
        return normal / np.linalg.norm(normal)

    def project(self, x, start=(0, 0), guess=(0.5, 0.5), foot_step=FOOT_STEP):
        """Element, parameters, foot and signed gap."""
        foot = state.Foot(
            np.array(start, dtype=np.int64), np.array(guess, dtype=float), np.empty(3), np.empty(3), np.empty(3)
        )
        projection.project(self.prepared, 0, self.nodes.shape[0] - 1, np.asarray(x, float), foot, foot_step)
        normal = np.cross(foot.tangent_t, foot.tangent_s)
        gap = float((x - foot.point) @ normal / np.linalg.norm(normal))
        return foot.element, foot.guess, foot.point, gap, (foot.tangent_s, foot.tangent_t)


def cylinder(profile, x, columns=4, width=1.0):
    """Nodes of a surface (x, profile(x), z): rows along x, columns along z, outward normal +y... -y by the profile."""
    z = np.linspace(0.0, width, columns)
    x = np.asarray(x, dtype=float)
    return np.stack(np.broadcast_arrays(x[:, None], profile(x)[:, None], z[None]), axis=-1)


def circle(elements, columns=4, radius=1.0, angle=1.0):
    turn = np.linspace(0.0, angle, elements + 1)
    z = np.linspace(0.0, 1.0, columns)
    return np.stack(np.broadcast_arrays(radius * np.sin(turn)[:, None], radius * np.cos(turn)[:, None], z[None]), -1)


def saddle(rows=5, columns=6):
    """A smooth doubly curved, unevenly spaced grid."""
    x, z = np.linspace(0.0, 1.0, rows) ** 1.3, np.linspace(0.0, 1.5, columns) ** 0.9
    x, z = np.meshgrid(x, z, indexing="ij")
    return np.stack([x, 0.3 * np.sin(2.0 * x) * np.cos(1.5 * z) - 0.2 * x * z, z], axis=-1)


def random_rotation(rng):
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    return turn * np.sign(np.linalg.det(turn))
