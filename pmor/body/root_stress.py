"""Root stress in the basis: from the forces on a flank to the stress along the fillets, in few numbers.

Far from the flank few patterns of its forces matter (Saint-Venant). A singular value decomposition parts the map of all
forces (`pmor.body.fillet_stress`) into amplitudes of patterns and stresses under them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pmor.body.fillet_stress import FilletStress
from pmor.core.arrays import FloatArray, IntArray

# Singular values below this fraction of the largest one are dropped.
SMALLEST_PATTERN = 1e-4


@dataclass(frozen=True)
class RootStressShapes:
    """Stress along both fillets of the teeth of one gear: p points in c columns, r patterns of forces.

    Parameters
    ----------
    section : ndarray, shape (p, 2)
        Points along the fillet of the loaded side in the section z = 0, from the start of the involute to the middle of
        the tooth space, mm; those of the other side are their images.
    z : ndarray, shape (c,)
        Columns, mm.
    pattern : ndarray, shape (r, n)
        Amplitude of each pattern under unit forces on the flank's unknowns, orthonormal.
    stress : ndarray, shape (2 NEIGHBOURS + 1, 2, p, c, 3, r)
        Of the teeth around, counted counter-clockwise from the loaded one; loaded side, other side; along the outline,
        across it, shear; MPa for an amplitude of 1 N.
    rim_stress : ndarray, shape (2, p, c, 3, a)
        Patterns of stress by the bending of the rim below, of gears on blanks.
    rim_pattern : ndarray, shape (q, n)
        Amplitude of each pattern of forces that the rim feels under unit forces on the flank's unknowns.
    rim_moved : ndarray, shape (t, 2 R + 1, a, q)
        Amplitudes of the patterns of stress on teeth -R ... R, counted counter-clockwise from a loaded one, under
        those of forces on tooth 0 ... t - 1, after which the gear repeats; MPa/N.
    """

    section: FloatArray
    z: FloatArray
    pattern: FloatArray
    stress: FloatArray
    rim_stress: FloatArray
    rim_pattern: FloatArray
    rim_moved: FloatArray

    @property
    def repeats(self) -> int:
        """Number of teeth after which the gear repeats."""
        return len(self.rim_moved)

    @property
    def neighbours(self) -> int:
        """Teeth on either side of a loaded one that feel it."""
        return len(self.stress) // 2


def root_stress_shapes(fillet: FilletStress, components: int) -> RootStressShapes:
    """Factor the stress under forces on a flank into patterns and the stress of each.

    Parameters
    ----------
    components : int
        Of the forces: the first of x, y and z in the tooth's frame.
    """
    shape = fillet.shapes.shape
    over_nodes = fillet.shapes.reshape(*shape[:-1], -1, 3)[..., :components]
    whole = over_nodes.reshape(-1, shape[-1] // 3 * components)
    # Squared values lose half of the digits, which are far more than are kept.
    energy, pattern = np.linalg.eigh(whole.T @ whole)
    kept = energy > (SMALLEST_PATTERN**2) * energy[-1]
    pattern = np.ascontiguousarray(pattern[:, kept].T[::-1])
    stress = (whole @ pattern.T).reshape(*shape[:-1], len(pattern))
    return RootStressShapes(fillet.points.section, fillet.points.z, pattern, stress, *_by_rim(fillet, components))


def other_hand(unknowns: int, columns: int) -> tuple[IntArray, FloatArray]:
    """Return where the unknowns of a flank are in the image of the gear in the plane at mid width, and their signs.

    Parameters
    ----------
    unknowns : int
        Three at each node.
    columns : int
        Of nodes, along the width.
    """
    order = np.arange(unknowns).reshape(-1, columns, 3)[:, ::-1].ravel()
    return order, np.tile([1.0, 1.0, -1.0], unknowns // 3)


def of_the_other_flank(shapes: RootStressShapes, helical: bool, columns: int) -> RootStressShapes:
    """Return the shapes of a gear whose teeth are alike under forces on the other flanks of its teeth.

    These are on the drive flanks of its image, x to -x, and in the frames of the teeth of that; the stress is on the
    sides and the teeth of the gear itself.

    Parameters
    ----------
    columns : int
        Of nodes of the flank, along the width.
    """
    patterns, stress = (shapes.pattern, shapes.rim_pattern), (shapes.stress[::-1, ::-1], shapes.rim_stress[::-1])
    if helical:  # half a turn about the tooth's middle, which takes each face to the other one
        order, sign = other_hand(shapes.pattern.shape[1], columns)
        patterns = patterns[0][:, order] * sign, patterns[1][:, order] * sign
        stress = stress[0][:, :, :, ::-1], stress[1][:, :, ::-1]
    arrays = map(np.ascontiguousarray, (*patterns, *stress, shapes.rim_moved[:, ::-1]))
    names = "pattern", "rim_pattern", "stress", "rim_stress", "rim_moved"
    return replace(shapes, **dict(zip(names, arrays, strict=True)))


def _by_rim(fillet: FilletStress, components: int) -> tuple[FloatArray, FloatArray, FloatArray]:
    if fillet.rim is None:
        unknowns = fillet.shapes.shape[-1] // 3 * components
        return np.zeros((*fillet.shapes.shape[1:-1], 0)), np.zeros((0, unknowns)), np.zeros((1, 1, 0, 0))
    rows = fillet.rim.rows.reshape(-1, 3, fillet.rim.rows.shape[1])[:, :components]
    pattern = np.ascontiguousarray(rows.reshape(-1, rows.shape[2]).T)
    return fillet.rim.stress, pattern, fillet.rim.moved
