"""What the force of a mesh on both hubs is found with, wherever they stand, one position after the other.

The gaps are those of `pmor.line.hubs` with the displacements given: g_0 + L u + l advance + D F + delta(w). The wrench
on the hubs is L^T F (`pmor.line.kernels.hubs.contact_of_hubs`).
"""

from __future__ import annotations

import math

import numpy as np

from pmor.gear.condition import Assembly
from pmor.line.bonded_layer import WIDEST
from pmor.line.hertz import mean_layer_constant
from pmor.line.hubs import axes_of
from pmor.line.kernels.hubs import ROWS, Contact, Placed
from pmor.line.kernels.places import empty_lines
from pmor.line.pair import LinePair, new_flexibility, no_results


def contact_of(pair: LinePair, assembly: Assembly) -> Contact:
    """Return all that line loads depend on beside angles and displacements.

    Parameters
    ----------
    pair : LinePair
        Without a support. Of one half of the width tilts have no answer, and moments across the axes are those of it.
    assembly : Assembly
        Axes that displacements count from, and flanks.
    """
    meshed = pair.meshed
    return Contact(
        axes_of(meshed.pair), meshed.kinematics(assembly.misalignment), meshed.gears, meshed.kernel_layers,
        meshed.deviations(assembly), assembly.modified, meshed.sections.z, pair.meshes, pair.between_flanks,
        0.5 * WIDEST * math.exp(-mean_layer_constant(meshed)),
    )  # fmt: skip


def nothing_placed(pair: LinePair) -> Placed:
    """Return room for a position of a pair."""
    angles, size = 1, pair.size
    return Placed(
        np.full(angles, np.nan), empty_lines(angles, size, pair.components), np.zeros((angles, size, ROWS)),
        np.zeros((angles, size)), np.zeros((angles, size)),
        new_flexibility(np.zeros((angles, size, size))),
        no_results((1, angles, 1), size, pair.meshed.tooth_pair_count), np.zeros(ROWS),
    )  # fmt: skip
