"""Flank compliance of the whole gear from one condensed sector and the ring of equal ones: exact, not a reduction."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from pmor.body.fillet_stress import NEIGHBOURS, FilletPoints, FilletStress, sector_stress
from pmor.core.arrays import FloatArray
from pmor.fe.completion import completion, nodes_of_elements
from pmor.fe.condensation import CondensedSector, condense_sector
from pmor.fe.fillet import FilletMesh
from pmor.fe.ring import ring_compliance, symmetric_coordinates
from pmor.fe.sector import SectorMesh
from pmor.fe.surface_layer import inverse_flank_stiffness


@dataclass(frozen=True)
class ElasticGear:
    """Cyclic part of a gear's compliance, with its bore held: C_local of equation (A) in `pmor.body`.

    Parameters
    ----------
    neighbours : int
        Number of neighbouring teeth on either side that the compliance covers.
    compliance : ndarray, shape (2 neighbours + 1, n, n)
        ``compliance[neighbours + k]`` is the displacement of the flank nodes of tooth k under unit forces on the flank
        nodes of tooth 0, each in its own tooth's frame, mm/N; n = 3 x flank nodes. Without the local compliance of
        the surface layer where that was taken out. On half the width a unit force is shared by a node and its image.
    side_displacement : ndarray, shape (2 neighbours + 2, n_left, n)
        Displacement of the left side face of sectors -neighbours - 1 ... neighbours under unit forces on the flank's
        nodes that elements have, mm/N; of no sectors unless asked for.
    layer_columns : int
        Columns of elements below the flank whose local compliance was taken out.
    fillet : FilletStress or None
        Where it was asked for.
    """

    mesh: SectorMesh
    neighbours: int
    compliance: FloatArray
    sector: CondensedSector
    side_displacement: FloatArray
    layer_columns: int = 0
    fillet: FilletStress | None = None

    def tooth_compliance(self, offset: int) -> FloatArray:
        """Return the displacement of tooth `offset` under unit forces on tooth 0, shape (n, n), mm/N.

        Raises
        ------
        IndexError
            When the tooth is beyond the gear's neighbours.
        """
        if abs(offset) > self.neighbours:
            raise IndexError(f"tooth {offset} is beyond the {self.neighbours} neighbours that the compliance covers")
        return np.asarray(self.compliance[self.neighbours + offset])


def elastic_gear(
    mesh: SectorMesh, youngs_modulus: float, poisson_ratio: float, element: str, neighbours: int = 1,
    keep_rows: bool = False, layer_columns: int = 0, fillet: FilletMesh | None = None,
) -> ElasticGear:  # fmt: skip
    """Build the elastic model of a gear from one sector.

    Parameters
    ----------
    mesh, youngs_modulus, poisson_ratio, element
        As in `pmor.fe.condensation.condense_sector`.
    neighbours : int
        Neighbouring teeth to cover, on either side.
    keep_rows : bool
        Keep the factors for `pmor.body.volume`.
    layer_columns : int
        Columns of elements below the flank whose local compliance is taken out (`pmor.line.hertz`).
    fillet : FilletMesh, optional
        Where the stress along the fillets is asked for too.
    """
    points, carried = sector_stress(fillet, mesh, youngs_modulus, poisson_ratio) if fillet else (None, ())
    sector = condense_sector(mesh, youngs_modulus, poisson_ratio, element, keep_rows, layer_columns, carried)
    n_flank, n_side = len(sector.flank), len(sector.left)
    own = inverse_flank_stiffness(mesh, sector.stiffness[:n_flank, :n_flank].copy())
    load = -sector.stiffness[n_flank:, :n_flank] @ own
    side = sector.stiffness[n_flank:, n_flank:] + load @ sector.stiffness[:n_flank, n_flank:]

    to_left, even = symmetric_coordinates(mesh, nodes_of_elements(mesh, mesh.left))
    to_right, _ = symmetric_coordinates(mesh, nodes_of_elements(mesh, mesh.right))
    left, right = slice(None, n_side), slice(n_side, None)
    diagonal = _turned(to_left, side[left, left], to_left) + _turned(to_right, side[right, right], to_right)
    faces = ring_compliance(diagonal, _turned(to_left, side[left, right], to_right), even, mesh.teeth, neighbours + 1)
    load = np.concatenate([to_left @ load[left], to_right @ load[right]])

    def moved(k: int) -> FloatArray:
        """Displacement of the left side face of sector k, in symmetric coordinates."""
        both = [faces[j] if j >= 0 else faces[-j].T for j in (k, k + 1)]
        return np.asarray(np.hstack(both) @ load)

    compliance = np.empty((2 * neighbours + 1, n_flank, n_flank))
    before = moved(-1)
    for k in range(neighbours + 1):
        after = moved(k)
        compliance[neighbours + k] = load.T @ np.concatenate([after, before])
        compliance[neighbours - k] = compliance[neighbours + k].T
        before = after
    compliance[neighbours] += own
    displacement, stress = np.empty((0, n_side, n_flank)), None
    if keep_rows:
        displacement = np.stack([to_left.T @ moved(k) for k in range(-neighbours - 1, neighbours + 1)])
    if points is not None:
        functions = np.concatenate([f.over(np.concatenate([sector.flank, sector.left, sector.right])) for f in carried])
        of_left, of_right = functions[:, n_flank : n_flank + n_side], functions[:, n_flank + n_side :]
        of_sides = np.hstack([(to_left @ of_left.T).T, (to_right @ of_right.T).T])
        near = range(-NEIGHBOURS, NEIGHBOURS + 1)
        moves = [np.concatenate([compliance[neighbours + k], moved(k), moved(k - 1)]) for k in near]
        stress = _of_the_fillets(mesh, points, np.hstack([functions[:, :n_flank], of_sides]) @ np.stack(moves))
    compliance = _on_the_grid(mesh, compliance)
    if sector.layer is not None:
        compliance[neighbours] -= sector.layer
    return ElasticGear(mesh, neighbours, _reciprocal(compliance), sector, displacement, layer_columns, stress)


def with_layer(gear: ElasticGear) -> ElasticGear:
    """Return a gear with the local compliance of its surface layer put back: as it is solved for without a layer."""
    if gear.sector.layer is None:
        return gear
    compliance = gear.compliance.copy()
    compliance[gear.neighbours] += gear.sector.layer
    sector = replace(gear.sector, layer=None)
    return replace(gear, compliance=_reciprocal(compliance), sector=sector, layer_columns=0)


def _turned(left: sp.csr_array, matrix: FloatArray, right: sp.csr_array) -> FloatArray:
    """Matrix in other coordinates of its rows and columns."""
    return np.asarray(left @ (right @ matrix.T).T)


def _on_the_grid(mesh: SectorMesh, compliance: FloatArray) -> FloatArray:
    """Compliance of all nodes of the flank from that of those that elements have, both (teeth, n, n)."""
    if not len(mesh.middles):
        return compliance
    full = completion(mesh, mesh.flank)
    return np.stack([full @ (full @ block.T).T for block in compliance])


def _of_the_fillets(mesh: SectorMesh, points: FilletPoints, stress: FloatArray) -> FilletStress:
    """Sort stress, (teeth, m, n), by side, point and column; over forces on all nodes of the flank."""
    full = completion(mesh, mesh.flank)
    over_grid = np.stack([(full @ block.T).T for block in stress])
    return FilletStress(points, over_grid.reshape(len(stress), 2, *points.shape, -1))


def _reciprocal(compliance: FloatArray) -> FloatArray:
    """Let reciprocity hold exactly, which the solvers count on, and not to round-off."""
    return np.asarray(0.5 * (compliance + compliance[::-1].transpose(0, 2, 1)))
