"""Evaluate the contact of all tooth pairs that can touch for given displacements and pinion rotation."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.penalty.kernels.search import search_all, search_workspace
from pmor.penalty.kernels.state import SearchWorkspace
from pmor.penalty.pair import PenaltyPair
from pmor.penalty.position import Position


@dataclass(frozen=True)
class Contact:
    """Slave points that penetrate, or nearly do (n of them), over all tooth pairs.

    Parameters
    ----------
    pair, slave, index, weight, gap, stiffness, lever, mate_lever, place
        As in `pmor.penalty.kernels.state.Points`; its `node` is `index` here.
    smallest_gap : float
        Over all points, touching or not, mm; infinite when no point projects.
    touches_border : bool
        Whether contact reaches the end of a window that is not an edge of the flank.
    """

    pair: IntArray
    slave: IntArray
    index: IntArray
    weight: FloatArray
    gap: FloatArray
    stiffness: FloatArray
    lever: FloatArray
    mate_lever: FloatArray
    place: IntArray
    smallest_gap: float
    touches_border: bool

    @property
    def force(self) -> FloatArray:
        """Normal force at each point by the penalty law, shape (n,), N."""
        return -self.stiffness * self.gap

    def nodal_forces(self, force: FloatArray, n_nodes: int) -> FloatArray:
        """Return the window nodes' forces for given point forces, shape (n_nodes, 3), N."""
        nodal = np.zeros((n_nodes, 3))
        np.add.at(nodal, self.index, self.weight * force[:, None, None])
        return nodal

    def gap_change(self, displacement: FloatArray) -> FloatArray:
        """Return the linearised change of the gaps, shape (n, ...), for displacements of shape (n_nodes, 3, ...)."""
        return np.einsum("nad,nad...->n...", self.weight, displacement[self.index])


def search_contact(
    meshed: PenaltyPair, position: Position, displacement: FloatArray, advance: float, largest_gap: float = 0.0,
    workspace: SearchWorkspace | None = None,
) -> Contact:  # fmt: skip
    """Find all penetrating points, and those that stand off a little.

    Parameters
    ----------
    displacement : ndarray, shape (n, 3)
        Displacements of the position's nodes, in each tooth's frame, mm.
    advance : float
        Rotation of the pinion ahead of its kinematic position, rad.
    largest_gap : float
        Points with a gap below it are listed, mm.
    workspace : SearchWorkspace, optional
        Of this position, from earlier searches: a point begins on the patch where it was found the last time, so that
        one at the border between two patches stays where it is.
    """
    nodes = position.nodes + displacement
    pair, patches = position.kernel_pair, position.patches
    workspace = workspace or search_workspace(pair, patches)
    listing = search_all(pair, patches, advance, nodes, largest_gap, workspace)
    listed: Any = [np.array(values[: listing.listed]) for values in workspace.points]  # in the order of the fields
    return Contact(*[*listed, listing.smallest, listing.border])
