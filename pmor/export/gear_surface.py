"""Surface of a gear as rings of points along its axis, for pictures and VTK."""

from __future__ import annotations

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.core.conventions import rotation_z
from pmor.gear.tooth import Tooth, twist_sections

# Rings before the first transverse section with a flank: bore and face have points of their own, which carry nothing.
BEFORE = 2


def gear_rings(tooth: Tooth, turned: float, bore: float, roll: FloatArray, fillet: int, z: FloatArray) -> FloatArray:
    """Return rings around a gear, from bore to bore, (Z + 4, 2 T (R + fillet), 3), mm.

    Parameters
    ----------
    turned : float
        Angle of its first tooth, the others follow by `Tooth.angular_pitch`, rad.
    bore : float
        Radius of the surface that the teeth stand on: of a ring that of its outside, mm.
    roll : ndarray, shape (R,)
        Roll angles of points on both flanks, rad.
    fillet : int
        Points of a fillet.
    z : ndarray, shape (Z,)
        Of the transverse sections, mm.
    """
    outline = _outline(tooth, roll, fillet)
    teeth = [outline @ rotation_z(turned + tooth.angular_pitch * j)[:2, :2].T for j in range(abs(tooth.teeth))]
    sections = twist_sections(np.concatenate(teeth), z[:, None], tooth.twist_per_length)
    faces = sections[[0, -1]]
    bores = faces.copy()
    bores[..., :2] *= bore / np.linalg.norm(faces[..., :2], axis=-1, keepdims=True)
    return np.concatenate([bores[:1], faces[:1], sections, faces[1:], bores[1:]])


def quads_between(rings: FloatArray) -> IntArray:
    """Return the corners of the quadrilaterals between rings (K, N, 3), (m, 4), by the numbers of points.

    They look outwards where the rings run counter-clockwise about the axis, one after the other along it.
    """
    count, points = rings.shape[:2]
    first = points * np.arange(count - 1)[:, None] + np.arange(points)
    beside = points * np.arange(count - 1)[:, None] + (np.arange(points) + 1) % points
    return np.asarray(np.stack([first, beside, beside + points, first + points], axis=-1).reshape(-1, 4))


def flank_columns(tooth: int, loaded: bool, points: int, fillet: int) -> IntArray:
    """Return where the points of a flank are on a ring, by rising roll angle.

    Parameters
    ----------
    tooth : int
        Its number from the first one on.
    loaded : bool
        Whether it is the drive flank.
    points : int
        R, of the flank.
    fillet : int
        Points of a fillet.
    """
    first = 2 * (points + fillet) * tooth + fillet
    along = np.arange(points)
    return np.asarray(first + (2 * points - 1 - along if loaded else along))


def _outline(tooth: Tooth, roll: FloatArray, fillet: int) -> FloatArray:
    """Outline of a tooth, counter-clockwise: fillet and flank of the coast side, flank and fillet of the loaded one."""
    flank = tooth.flank_section(roll)[::-1]
    loaded = np.concatenate([flank, tooth.root_section(np.linspace(0.0, 1.0, fillet + 1)[1:])])
    return np.concatenate([loaded[::-1] * [-1.0, 1.0], loaded])
