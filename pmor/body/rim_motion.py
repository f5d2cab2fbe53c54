"""Motion of a ring's rim between its teeth, under forces on any of them.

With G even forces, radial and circumferential, on the root line of the cut between two teeth, and f forces on a flank,
reciprocity says how far f moves the cut by how far G moves the faces of the loaded tooth's sector,

    w_m = P_i^T u_(i - m)(G) f,                                                                                    (1)

P the forces on the faces of a sector that those on its flank make, u the faces' displacement in a ring of equal
sectors. Lugs add Y_m^H M Y_i f of `pmor.body.support`, with Y_m the amplitudes under G.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pmor.body.rim_stress import leading
from pmor.core.arrays import FloatArray, IntArray
from pmor.fe.completion import nodes_of_elements
from pmor.fe.element import tributary_widths
from pmor.fe.sector import SectorMesh

# Of the largest singular value: patterns of forces that move the rim less are left out.
LEAST_MOVED = 1e-4


@dataclass(frozen=True)
class RimMotion:
    """Mean displacement over the width of the root between teeth.

    Parameters
    ----------
    rows : ndarray, shape (n, r)
        Patterns of forces over the unknowns of a flank.
    moved : ndarray, shape (p, z, 2, r)
        Radial and circumferential displacement of the cut behind tooth i + k, in the order of the teeth, under patterns
        of forces on tooth i = 0 ... p - 1, after which the ring repeats; mm/N.
    """

    rows: FloatArray
    moved: FloatArray

    def under(self, loads: FloatArray, tooth: IntArray) -> FloatArray:
        """Return the displacement of all cuts under patterns of loads on a tooth, (..., A, z, 2), mm.

        Parameters
        ----------
        loads : ndarray, shape (..., A, r)
            N.
        tooth : ndarray of int, shape (A,)
            Its number.
        """
        period, teeth = self.moved.shape[:2]
        by_cut = (np.arange(teeth) - tooth[:, None]) % teeth
        moved = self.moved[tooth[:, None] % period, by_cut]
        return np.asarray(np.einsum("akcr,...ar->...akc", moved, loads))


def even_on_the_cut(mesh: SectorMesh) -> FloatArray:
    """Return unit forces, radial and circumferential, on the root line of a sector's left face, over its nodes.

    They are spread evenly over the width.

    Returns
    -------
    ndarray, shape (3 n, 2)
        Of the nodes of the face that elements have.
    """
    nodes = nodes_of_elements(mesh, mesh.left)
    root = mesh.left[: len(mesh.z)]
    place = [int(np.flatnonzero(nodes == node)[0]) for node in root]
    share = tributary_widths(mesh.z, mesh.order)
    radial = mesh.nodes[root, :2] / np.linalg.norm(mesh.nodes[root, :2], axis=1)[:, None]
    found = np.zeros((len(nodes), 3, 2))
    found[place, :2, 0] = radial
    found[place, :2, 1] = np.stack([-radial[:, 1], radial[:, 0]], axis=1)
    found[place] *= (share / share.sum())[:, None, None]
    return found.reshape(-1, 2)


def rim_motion(cyclic: FloatArray, by_lugs: FloatArray, patterns: FloatArray) -> RimMotion:
    """Return the motion of a rim in few patterns of forces.

    Parameters
    ----------
    cyclic : ndarray, shape (z, 2, n)
        Of the cut behind tooth k under unit forces on the flank of tooth 0, mm/N.
    by_lugs : ndarray, shape (p, z, 2, q)
        What lugs add under patterns of forces on tooth i; p = 1, and no patterns, without.
    patterns : ndarray, shape (n, q)
    """
    rows = leading(np.hstack([leading(cyclic.reshape(-1, cyclic.shape[2]).T, LEAST_MOVED), patterns]), LEAST_MOVED)
    return RimMotion(rows, np.asarray(cyclic @ rows + by_lugs @ (patterns.T @ rows)))
