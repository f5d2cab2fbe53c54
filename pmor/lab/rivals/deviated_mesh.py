"""Flank nodes of whole gears moved by the deviations of the flanks, for programs that know only meshes.

pmor itself leaves the bodies as drawn and puts deviations of the flanks into the gap: without some hundredths of a
millimetre a body is another one only to second order.
"""

from __future__ import annotations

import math

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.conventions import rotation_z
from pmor.fe.sector import SectorMesh
from pmor.gear.kernels.deviation import Deviation, deviations_at
from pmor.gear.tooth import Tooth


def flank_shift(mesh: SectorMesh, tooth: Tooth, deviation: Deviation) -> FloatArray:
    """Return by how much deviations move the flank nodes of all teeth of a gear, mm.

    They go along the normal of the transverse section, as far as the gap opens along the transverse line of action:
    the parallel curve of an involute is the involute that is turned by so much.

    Returns
    -------
    ndarray, shape (teeth, n + 1, m + 1, 3)
        In the frame of tooth 0; teeth counter-clockwise.
    """
    shape = mesh.teeth, *mesh.flank.shape
    roll, z = np.broadcast_arrays(mesh.flank_roll_angle[:, None], mesh.z)
    number = np.broadcast_to(np.arange(mesh.teeth)[:, None, None], shape).ravel()
    amount = np.empty(len(number))
    everywhere = [np.broadcast_to(values, shape).ravel() for values in (roll, z)]
    deviations_at(deviation, *everywhere, number, amount)
    inwards = -tooth.flank_normal(roll, z)
    inwards[..., 2] = 0.0
    inwards /= math.cos(math.atan(tooth.base_radius * tooth.twist_per_length))
    turned = [inwards @ rotation_z(k * tooth.angular_pitch).T for k in range(mesh.teeth)]
    return amount.reshape(*shape, 1) * np.array(turned)
