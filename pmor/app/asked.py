"""Requests of the Python API as a case: torques, angles, axes and flanks of a sweep, checked."""

from __future__ import annotations

import logging
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import Annotated, Any

import numpy as np

from pmor.case import (
    Case,
    ConditionCase,
    beyond_training,
    check_flanks,
    refuse_uneven_load,
    trained_flanks,
)
from pmor.case.checks import MOST_ANGLES
from pmor.case.coast import mirrored_axes, mirrored_flank
from pmor.case.document import GEARS
from pmor.case.reader import Reader, checked
from pmor.case.width import meshed_width
from pmor.core.arrays import FloatArray
from pmor.core.errors import CaseError
from pmor.core.ranges import Range
from pmor.gear.condition import Assembly, Condition, Misalignment
from pmor.gear.meshed_pair import MeshedPair
from pmor.gear.modification import Modification
from pmor.gear.pair import GearPair
from pmor.pair.conditions import conditions_of
from pmor.pair.model import refuse_loads
from pmor.pair.modifications import refuse_modifications_off_the_flank
from pmor.work.cost import refuse_large_sweep
from pmor_online.model import online_angles

_LOG = logging.getLogger("pmor")
# Torques of a sweep in Python keep their order.
TORQUES = Annotated[tuple[float, ...], Range(0.0, 1e12, "N m", low_excluded=True, in_order=True)]
ANGLES = Annotated[int, Range(1, MOST_ANGLES)]
# Parts of a built pair.
BUILT = (Assembly, Misalignment, Modification)


def asked_case(
    case: Case, pair: GearPair, torques_Nm: float | Iterable[float] | None, angles: int | FloatArray | None,
    misalignment: Misalignment | None, flanks: tuple[Modification | None, Modification | None],
) -> Case:  # fmt: skip
    """Return the case of a model with a requested sweep, torques listed, checked by the rules for keys of a case file.

    CaseError where one is broken.
    """
    reader, online, off = Reader(case.name), case.online, case.misalignment
    coast = case.flank == "coast"
    if torques_Nm is not None:
        torques_Nm = negated(torques_Nm) if coast else torques_Nm
        online = replace(online, torques_Nm=reader.value(torques_Nm, TORQUES, "torques_Nm"))
    if angles is not None and _is_single(angles):
        online = replace(online, angles_per_pitch=reader.value(angles, ANGLES, "angles"))
    if misalignment is not None:
        off = checked(misalignment, Misalignment, case.name, "misalignment")
        off = mirrored_axes(off) if coast else off
    pinion, wheel = (
        own if flank is None else _seen(checked(flank, Modification, case.name, f"{gear}.modification"), coast)
        for gear, flank, own in zip(GEARS, flanks, (case.pinion_modification, case.wheel_modification), strict=True)
    )
    asked = replace(case, online=online, misalignment=off, pinion_modification=pinion, wheel_modification=wheel)
    check_assembly(asked, case, pair)
    return asked


def _seen(flank: Modification, coast: bool) -> Modification:
    return mirrored_flank(flank) if coast else flank


def seen_from(case: Case, assembly: Assembly) -> Assembly:
    """Return an assembly as the flanks of a case see it: of coast flanks its image."""
    if case.flank == "drive":
        return assembly
    flanks = mirrored_flank(assembly.pinion), mirrored_flank(assembly.wheel)
    return Assembly(mirrored_axes(assembly.misalignment), *flanks)


def negated(torques_Nm: Any) -> Any:
    """Return torques of the other sign; what is no number stays, and is refused where values are checked."""
    if isinstance(torques_Nm, list | tuple):
        return [negated(torque) for torque in torques_Nm]
    return torques_Nm if isinstance(torques_Nm, str | bytes | bool | Mapping) else -torques_Nm


def loaded_flank(case: Case, torques_Nm: Any) -> tuple[str, Any]:
    """Return which flanks torques load, by default those of the case, and the torques, listed.

    Raises
    ------
    CaseError
        Where they have both signs.
    """
    if torques_Nm is None:
        return case.flank, None
    negative, listed = of_one_sign(case.name, torques_Nm)
    return "coast" if negative else "drive", listed


def of_one_sign(name: str, torques_Nm: Any) -> tuple[bool, Any]:
    """Return whether torques are negative, and the torques, listed; CaseError where they have both signs."""
    listed = _listed(torques_Nm, f"{name}: torques_Nm")
    values = [value for value in np.ravel(np.array(listed, dtype=object)) if isinstance(value, int | float | np.number)]
    signs = {bool(value < 0) for value in values}
    if len(signs) > 1:
        raise CaseError(
            f"{name}: torques_Nm = {torques_Nm!r:.60}: load the drive flanks and the coast flanks: sweep those of "
            "one sign at a time"
        )
    return True in signs, listed


def amounts_of(name: str, torques_Nm: Any) -> tuple[tuple[float, ...], float]:
    """Return torques of a machine as amounts, checked as those of a case, and their sign; CaseError where they fail."""
    negative, listed = of_one_sign(name, torques_Nm)
    return Reader(name).value(negated(listed) if negative else listed, TORQUES, "torques_Nm"), -1.0 if negative else 1.0


def whole_angles(name: str, angles: Any) -> int:
    """Return how many angles to a mesh cycle are asked for of a machine; CaseError where that is no such number."""
    return int(Reader(name).value(angles, ANGLES, "angles"))


@dataclass(frozen=True)
class Asked:
    """A requested sweep: its case, pinion angles (A,) in rad, and a condition for each torque."""

    case: Case
    phi: FloatArray
    conditions: tuple[Condition, ...]


def asked_sweep(
    case: Case, meshed: MeshedPair, torques_Nm: float | Iterable[float] | None, angles: int | FloatArray | None,
    misalignment: Misalignment | None, flanks: tuple[Modification | None, Modification | None], sections: int = 0,
) -> Asked:  # fmt: skip
    """Return a requested sweep of the case's pair, which records some sections in each position.

    Raises
    ------
    CaseError
        As `asked_case`, and when a load is beyond the range of contact, or the sweep takes more memory than there is.
    """
    torques_Nm = listed_within_memory(case, meshed, torques_Nm, angles, sections=sections)
    asked = asked_case(case, meshed.pair, torques_Nm, angles, misalignment, flanks)
    refuse_loads(asked, meshed)
    phi = positions(asked, meshed, angles)
    # Teeth that differ by flanks that are asked for take more pitches.
    refuse_large_sweep(case.name, meshed, len(phi), len(asked.online.torques_Nm), sections=sections)
    return Asked(asked, phi, tuple(conditions_of(asked, asked.online.torques_Nm)))


def listed_within_memory(case: Case, meshed: MeshedPair, torques_Nm: Any, angles: Any, **sizes: int) -> Any:
    """List the torques of a requested sweep; CaseError when it takes more memory than there is, by its lengths."""
    torques = None if torques_Nm is None else _listed(torques_Nm, f"{case.name}: torques_Nm")
    count = len(torques) if isinstance(torques, list) else len(case.online.torques_Nm) if torques is None else 1
    of_angles = case.pitches * case.online.angles_per_pitch
    if isinstance(angles, int | np.integer):
        of_angles = max(int(angles), 0)
    elif isinstance(angles, list | tuple | np.ndarray):
        of_angles = np.size(angles) if isinstance(angles, np.ndarray) else len(angles)
    refuse_large_sweep(case.name, meshed, of_angles, count, **sizes)
    return torques


def listed_assemblies(assemblies: Any) -> list[Any]:
    """List the assemblies of a request: a single one is a list of one."""
    return [assemblies] if isinstance(assemblies, BUILT) or not isinstance(assemblies, Iterable) else list(assemblies)


def checked_assemblies(case: Case, assemblies: Sequence[Any]) -> tuple[Assembly, ...]:
    """Return assemblies, checked by the rules for the keys of a case file; axes alone are of plain flanks.

    Raises
    ------
    CaseError
        With the number of the assembly, from 0.
    """
    assembled = []
    for number, one in enumerate(assemblies):
        where = f"{case.name}: assemblies[{number}]"
        if isinstance(one, Misalignment):
            one = Assembly(one)
        if isinstance(one, Modification):
            ways = "Assembly(pinion=m), Assembly(wheel=m) or, of both gears, Assembly(pinion=m, wheel=m)"
            raise CaseError(f"{where} = {one!r:.60}: says nothing of its gear: write {ways}")
        if not isinstance(one, Assembly):
            ways = "Assembly(pinion=Modification(...), misalignment=Misalignment(...))"
            raise CaseError(f"{where} = {one!r:.60}: must be an Assembly: write {ways}")
        flanks = [checked(getattr(one, gear), Modification, where, f"{gear}.modification") for gear in GEARS]
        assembled.append(Assembly(checked(one.misalignment, Misalignment, where, "misalignment"), *flanks))
    if not assembled:
        raise CaseError("assemblies: there is none: give at least one")
    return tuple(assembled)


def _is_single(value: Any) -> bool:
    one = isinstance(value, str | bytes | Mapping) or not isinstance(value, Iterable)
    return one or (isinstance(value, np.ndarray) and value.ndim == 0)


def _listed(values: Any, where: str) -> Any:
    """List the values of an iterable; text and single values as they are."""
    if _is_single(values):
        return values
    items = list(islice(values, MOST_ANGLES + 1))
    if len(items) > MOST_ANGLES:
        raise CaseError(f"{where}: {len(items)} values or more, and {MOST_ANGLES} are enough: sweep fewer at a time")
    return items


def check_assembly(asked: Case, case: Case, pair: GearPair) -> None:
    """Raise CaseError where axes or flanks do not suit a case."""
    check_flanks(asked, case.name)
    refuse_modifications_off_the_flank(asked, pair)
    refuse_uneven_load(asked, case.name)


def takes_whole_width(asked: Case, case: Case) -> bool:
    """Whether a request loads the halves of the face differently, and its model has one for both; the log says so."""
    if not meshed_width(case) == "half" != meshed_width(asked):
        return False
    _LOG.info("%s: the halves of the face are loaded differently: a model of the whole width answers", case.name)
    return True


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
    """Return the pinion angles of a sweep (n,), rad: the given ones, or a number of them over each pitch.

    CaseError where these are no angles.
    """
    if angles is None or _is_single(angles):
        return online_angles(meshed.pair.pitch, case.online.angles_per_pitch, case.pitches)
    where = f"{case.name}: angles"
    try:
        phi = np.asarray(angles if isinstance(angles, np.ndarray) else _listed(angles, where))
    except ValueError:  # lists of different lengths
        phi = np.empty((0, 0))
    numbers = phi.ndim == 1 and phi.dtype.kind in "iuf" and 0 < len(phi) <= MOST_ANGLES
    if not numbers or not np.isfinite(phi).all():
        raise CaseError(
            f"{where}, of shape {phi.shape} and type {phi.dtype}: must be a whole number, or a list of 1 to "
            f"{MOST_ANGLES} finite numbers in rad: correct them"
        )
    largest, period = float(np.abs(phi).max()), math.tau * _revolutions(case)
    if largest > period + meshed.pair.pitch:
        raise CaseError(
            f"{where} reach {largest:g}: they are in rad, and all states of the pair are there within {period:.4g} "
            "rad: where these are degrees, write angles=numpy.radians(angles)"
        )
    return np.asarray(phi, dtype=float)


def _revolutions(case: Case) -> int:
    """Revolutions of the pinion after which all states of a pair repeat: several where its teeth differ."""
    flanks = [case.pinion_modification, case.wheel_modification, *case.other_flanks]
    flanks += [flank for condition in case.conditions for flank in (condition.pinion, condition.wheel)]
    pinion, wheel = case.pair.pinion.teeth, case.pair.wheel.teeth
    uneven = any(flank.tooth_keys for flank in flanks)
    return wheel // math.gcd(pinion, wheel) if uneven else math.ceil(case.pair.repeats_after / pinion)


def refuse_beyond_training(trained: Case, asked: Case, extrapolate: bool) -> None:
    """Raise CaseError for a case beyond the training of another, unless it is to be extrapolated."""
    beyond = beyond_training(asked)
    if trained_flanks(asked) != trained_flanks(trained):
        beyond += ("flanks that load the width otherwise than those of the training",)
    if beyond and not (extrapolate or asked.online.extrapolate):
        raise CaseError(f"beyond the training: {beyond[0]}: train over it, or pass extrapolate=True")
