"""Requests of the Python API as a case: torques, angles, axes and flanks of a sweep, checked."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from pmor.case import Case, ConditionCase, check_flanks, refuse_uneven_load
from pmor.case.width import meshed_width
from pmor.core.arrays import FloatArray
from pmor.core.errors import CaseError
from pmor.gear.condition import Assembly, Misalignment
from pmor.gear.meshed_pair import MeshedPair
from pmor.gear.modification import Modification
from pmor.gear.pair import GearPair
from pmor.pair.modifications import refuse_modifications_off_the_flank
from pmor_online.model import online_angles


def asked_case(
    case: Case, pair: GearPair, torques_Nm: Iterable[float] | None, angles: int | FloatArray | None,
    misalignment: Misalignment | None, flanks: tuple[Modification | None, Modification | None],
) -> Case:  # fmt: skip
    """Return the case of a model with the requested sweep.

    Raises
    ------
    CaseError
    """
    online, off = case.online, case.misalignment
    if torques_Nm is not None:
        torques = tuple(map(float, torques_Nm))
        if not torques or not all(np.isfinite(torque) and torque > 0.0 for torque in torques):
            raise CaseError(f"torques_Nm = {list(torques)}: must be positive numbers, and at least one")
        online = replace(online, torques_Nm=torques)
    if isinstance(angles, int | np.integer):
        if angles < 1:
            raise CaseError(f"angles = {angles}: must be a whole number of at least 1, or angles in rad")
        online = replace(online, angles_per_pitch=int(angles))
    if misalignment is not None:
        off = misalignment
    pinion, wheel = flanks
    asked = replace(
        case, online=online, misalignment=off, pinion_modification=pinion or case.pinion_modification,
        wheel_modification=wheel or case.wheel_modification,
    )  # fmt: skip
    check_assembly(asked, case, pair)
    return asked


def check_assembly(asked: Case, case: Case, pair: GearPair) -> None:
    """Raise CaseError where axes or flanks do not suit a case, or the mesh of its model."""
    check_flanks(asked, case.name)
    refuse_modifications_off_the_flank(asked, pair)
    refuse_uneven_load(asked, case.name)
    if meshed_width(case) == "half" != meshed_width(asked):
        raise CaseError(
            f"{case.name}: tilted axes or flanks whose halves differ load the width unevenly, and the model has half "
            'the width, which stands for both halves: write [mesh] width = "whole" and train again'
        )


def with_assembly(case: Case, assembly: Assembly) -> Case:
    """Return the case with other axes and flanks."""
    return replace(
        case, misalignment=assembly.misalignment, pinion_modification=assembly.pinion, wheel_modification=assembly.wheel
    )


def listed(case: Case, number: int, assembly: Assembly) -> ConditionCase:
    """Return an assembly as a condition, named in messages by its number in the list."""
    return ConditionCase(
        name=f"assemblies[{number}]", torque_Nm=case.torque_Nm, misalignment=assembly.misalignment,
        pinion=assembly.pinion, wheel=assembly.wheel
    )  # fmt: skip


def positions(case: Case, meshed: MeshedPair, angles: int | FloatArray | None) -> FloatArray:
    """Return the pinion angles of a sweep (n,), rad: the given ones, or a number of them over a pitch.

    Raises
    ------
    CaseError
    """
    if angles is None or isinstance(angles, int | np.integer):
        return online_angles(meshed.pair.pitch, case.online.angles_per_pitch, case.pitches)
    phi = np.atleast_1d(np.asarray(angles, dtype=float))
    if not len(phi) or not np.isfinite(phi).all():
        raise CaseError(f"angles = {phi.tolist()}: must be finite numbers in rad, and at least one")
    return phi
