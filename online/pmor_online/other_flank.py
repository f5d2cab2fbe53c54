"""The other flanks of a reduced pair, from the same finite elements.

The pair that is mirrored about the plane of its axes (`pmor.case.coast`) is the one that is mirrored about mid width,
turned by half a revolution about the line of centres: teeth are symmetric. So the compliance of its flanks is that of
the pair itself with the columns of nodes in the opposite order and axial displacements reversed.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pmor.body.flank_compliance import FlankCompliance
from pmor.case.coast import other_flank
from pmor.case.width import meshed_width
from pmor.core.arrays import FloatArray
from pmor.core.errors import CaseError
from pmor.reduction.basis import Basis
from pmor_online.model import ReducedPair, reduced_pair

AXIAL = 2


def other_flank_pair(reduced: ReducedPair) -> ReducedPair:
    """Return the pair whose other flanks carry, without root stress where the whole width is meshed.

    Raises
    ------
    CaseError
        Where its finite elements are not images of those of the pair.
    """
    return reduced_pair(_other(reduced.basis))


def _other(basis: Basis) -> Basis:
    case = other_flank(basis.case)
    coarser = None if basis.coarser is None else _other(basis.coarser)
    if meshed_width(basis.case) != "whole":
        whole = None if basis.whole is None else _other(basis.whole)
        return replace(basis, case=case, coarser=coarser, whole=whole)
    gears = case.pair.pinion, case.pair.wheel
    solid = basis.compliance is not None and not any(basis.compliance.supports)
    blanks = [gear.light_blank(case.pair.face_width_mm) for gear in gears]
    off_middle = any(blank is not None and not (blank.web_even and blank.held_offset_mm == 0.0) for blank in blanks)
    off_middle = off_middle or any(gear.body is not None for gear in gears)
    uneven = off_middle or any(gear.face_offset_mm for gear in gears)
    if basis.shapes is not None or not solid or (case.pair.helix_angle_deg != 0.0 and uneven):
        raise CaseError(
            f"{case.name}: trained shapes over the whole width, holes, and helical gears with face_offset_mm, "
            "web_offset_mm, web_profile, held_offset_mm or a mesh as blank, stand for the flanks that they were made "
            "for: give a case of its own with [load] torque_Nm of the other sign"
        )
    assert basis.compliance is not None
    if off_middle:  # spur teeth are their own image, mirrored about the plane of the axes
        return replace(basis, case=case, coarser=coarser)
    pinion, wheel = (_mirrored_nodes(n, g.face_offset_mm) for n, g in zip(basis.flank_nodes, gears, strict=True))
    return replace(
        basis, case=case, coarser=coarser, flank_nodes=(pinion, wheel), root_stress=None,
        web_stress=(None, None),
        compliance=_mirrored_compliance(basis.compliance, (pinion.shape[1], wheel.shape[1])),
    )  # fmt: skip


def _mirrored_nodes(nodes: FloatArray, middle: float) -> FloatArray:
    mirrored = nodes[:, ::-1].copy()
    mirrored[..., 2] = 2.0 * middle - mirrored[..., 2]
    return mirrored


def _mirrored_compliance(compliance: FlankCompliance, columns: tuple[int, int]) -> FlankCompliance:
    pinion, wheel = compliance.gears
    parts = compliance.components
    first = _reordered(pinion, columns[0], parts)
    return replace(compliance, gears=(first, first if wheel is pinion else _reordered(wheel, columns[1], parts)))


def _reordered(blocks: FloatArray, columns: int, parts: int) -> FloatArray:
    order = np.arange(blocks.shape[1]).reshape(-1, columns, parts)[:, ::-1].ravel()
    sign = np.where(np.arange(blocks.shape[1]) % parts == AXIAL, -1.0, 1.0)
    found: FloatArray = blocks[:, order[:, None], order]
    found *= sign[:, None] * sign
    return found
