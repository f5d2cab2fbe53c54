"""Stress at the feet of all teeth by the bending of what is below them: around the whole gear, and by holes.

The stress in a fillet is a linear function of the displacement of its sector's flank, side faces and interface
(`pmor.body.fillet_stress`): H u by the displacement u of side faces and interface where its own flank is free. On a
blank of revolution u follows from the harmonics of all sectors (`pmor.body.blank`), so that rim, web and hub bend as
they do for the flanks. Holes move the faces of tooth m by the forces g that the web's circles feel through them when
tooth i is loaded: with P the faces of tooth 0 under unit loads on the circles, harmonic by harmonic, and equation (B)
of `pmor.body.support`,

    sigma_m = Re sum_n H P_n e^(2 pi i n m / z) g_ni,    g_i = M Y_i f.                                              (1)

Of a gear on its bore u is that of the ring of sectors alone. All are smooth along a fillet: few patterns of stress, and
few of forces, are enough.

Motion of a ring's rim between its teeth, under forces on any of them.

With G even forces, radial and circumferential, on the root line of the cut between two teeth, and f forces on a flank,
reciprocity says how far f moves the cut by how far G moves the faces of the loaded tooth's sector,

    w_m = P_i^T u_(i - m)(G) f,                                                                                    (1)

P the forces on the faces of a sector that those on its flank make, u the faces' displacement in a ring of equal
sectors. Lugs add Y_m^H M Y_i f of `pmor.body.support`, with Y_m the amplitudes under G.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pmor.core.arrays import ComplexArray, FloatArray, IntArray
from pmor.fe.completion import nodes_of_elements
from pmor.fe.element import tributary_widths
from pmor.fe.sector import SectorMesh

# Teeth on either side of a loaded one whose fillets feel it through their sectors. *Measured*, helical pair with three
# teeth in mesh: those next to it 5 %, those beyond 0.6 % of the stress in its own.
NEIGHBOURS = 1
# Teeth on either side that feel a loaded one through the rim, in a gear with one mesh.
REACH = 24
# Singular values, over the largest, of patterns of forces by what they do to the faces of their sector, and of patterns
# of stress, that are left out.
LEAST_FORCE, LEAST_STRESS = 1e-4, 1e-4


@dataclass(frozen=True)
class RimStress:
    """Stress by the rim, beside that which `FilletStress.shapes` has of the teeth next to a loaded one.

    Parameters
    ----------
    stress : ndarray, shape (2, p, c, 3, a)
        Patterns: on the loaded flank's side, on the other one; points; columns; along the outline, across it, shear.
    rows : ndarray, shape (n, q)
        Patterns of forces over the unknowns of a flank.
    moved : ndarray, shape (t, 2 R + 1, a, q)
        Amplitudes of the patterns of stress on teeth -R ... R, counted counter-clockwise from a loaded one, which is
        tooth 0 ... t - 1, after which the gear repeats; MPa/N.
    """

    stress: FloatArray
    rows: FloatArray
    moved: FloatArray


def face_patterns(load: FloatArray) -> FloatArray:
    """Return the patterns of forces on a flank, (n, q), that matter at the faces of its sector, load (m, n) there."""
    return leading(load.T, LEAST_FORCE)


def rim_stress(
    functions: FloatArray, shape: tuple[int, int, int], far: FloatArray, rows: FloatArray, pressed: ComplexArray,
    forces: ComplexArray, teeth: int,
) -> RimStress:  # fmt: skip
    """Return the stress by the rim.

    Parameters
    ----------
    functions : ndarray, shape (2 p c 3, m)
        H: stress over the displacement of a sector's faces, its flank free, MPa/mm.
    shape : (int, int, int)
        p, c, 3.
    far : ndarray, shape (2 R + 1, m, q)
        Displacement of the faces of teeth -R ... R under patterns of forces, mm.
    rows : ndarray, shape (n, q)
        These patterns.
    pressed : ndarray, shape (m, 2 N + 1, c)
        Faces of tooth 0 under loads on the web's circles, as in `pmor.body.ring_on_blank.Ring`.
    forces : ndarray, shape (s, t, q)
        g under them on teeth 0 ... t - 1, N, or of lugs the displacements; no rows without either, and one tooth.
    teeth : int
        Negative where they follow each other clockwise.
    """
    reach = len(far) // 2
    near = np.abs(np.arange(-reach, reach + 1)) <= NEIGHBOURS
    by_rim = functions @ np.where(near[:, None, None], 0.0, far)
    harmonics = (np.arange(pressed.shape[1]) - pressed.shape[1] // 2).repeat(pressed.shape[2])
    pressed = functions @ pressed.reshape(functions.shape[1], -1)
    scaled = pressed * np.sqrt((np.abs(forces) ** 2).mean(axis=(1, 2)) if forces.size else 0.0)
    every = np.concatenate([by_rim.transpose(1, 0, 2).reshape(len(functions), -1), scaled.real, scaled.imag], axis=1)
    patterns = leading(every, LEAST_STRESS)
    moved = np.broadcast_to(patterns.T @ by_rim, (forces.shape[1], len(by_rim), patterns.shape[1], rows.shape[1]))
    if forces.size:
        moved = moved + _by_holes(patterns.T @ pressed, harmonics, forces, teeth, reach)
    felt = leading(moved.reshape(-1, rows.shape[1]).T, LEAST_STRESS)
    # In the order in which files have them, so that a gear that is read answers as the one that was solved.
    return RimStress(patterns.reshape(2, *shape, -1), rows @ felt, np.ascontiguousarray(moved @ felt))


def _by_holes(pressed: ComplexArray, harmonics: np.ndarray, forces: ComplexArray, teeth: int, reach: int) -> FloatArray:
    """Equation (1) for amplitudes of patterns, (t, 2 R + 1, a, q)."""
    period = forces.shape[1]
    turned = pressed * np.exp(2j * np.pi * np.outer(np.arange(abs(teeth)), harmonics) / teeth)[:, None]
    flat = forces.reshape(len(forces), -1)
    every = (turned.real @ flat.real - turned.imag @ flat.imag).reshape(abs(teeth), len(pressed), period, -1)
    tooth = np.arange(period)[:, None] + np.arange(-reach, reach + 1)
    return np.asarray(every[tooth % abs(teeth), :, np.arange(period)[:, None]])


def leading(matrix: FloatArray, least: float) -> FloatArray:
    """Return orthonormal columns that span those of a matrix but for singular values below a share of the largest."""
    tall = len(matrix) > matrix.shape[1]
    energy, columns = np.linalg.eigh(matrix.T @ matrix if tall else matrix @ matrix.T)
    kept = energy > least**2 * energy[-1] if len(energy) else energy > 0.0
    if not tall:
        return np.ascontiguousarray(columns[:, kept][:, ::-1])
    # Those of small values come out less orthogonal, by round-off over the square of these.
    return np.ascontiguousarray(np.linalg.qr(matrix @ (columns[:, kept] / np.sqrt(energy[kept]))[:, ::-1])[0])


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
    forces = np.zeros((len(nodes), 3, 2))
    forces[place, :2, 0] = radial
    forces[place, :2, 1] = np.stack([-radial[:, 1], radial[:, 0]], axis=1)
    forces[place] *= (share / share.sum())[:, None, None]
    return forces.reshape(-1, 2)


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
