"""What drives a REXS gearbox: torques of its loads, by themselves or by power and speed, and how fast shafts turn."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from pmor.rexs.joints import COUPLINGS, RING, axis_of, joints, shaft_joints, shafts_of, stages
from pmor.rexs.model import Component, Gearbox

PLANETARY = "planetary_stage"
TORQUE, POWER, SPEED = "torque_around_u_axis", "power", "rotational_speed"
# Of a null space: what moves less is held.
LOOSE = 1e-9
# Relative; a speed below that of the fastest shaft stands still.
STILL = 1e-9

Case = Mapping[int, Component]


class Drive(NamedTuple):
    """A torque that the file says enters or leaves a shaft.

    Attributes
    ----------
    torque_Nm : float or None
        About u of the shaft; None where the file has none, or has it as a result of the torque of another place.
    note : str
        How it follows from power and speed; empty without.
    result_Nm : float or None
        Such a result.
    """

    load: Component
    shaft: Component
    torque_Nm: float | None
    note: str
    result_Nm: float | None = None


def drives(gearbox: Gearbox, case: Case) -> list[Drive]:
    """Return the places at which torque enters or leaves the gearbox in a load case.

    Where one load has `defines_torque`, torques of loads that have not are results of it. Where all loads have a
    torque, the first one is taken: the others follow from it.
    """
    loads = [load for load in gearbox.of_kind("external_load") if load.text_of("transmits_torque") != "false"]
    speeds = shaft_speeds(gearbox, case) if any(said(case, load, POWER) is not None for load in loads) else {}
    found = [
        Drive(load, shaft, *_torque(load, case, speeds.get(shaft.number)))
        for load in loads for shaft in gearbox.beside(load.number, "shaft", "assembly")
    ]  # fmt: skip
    defined = any(one.load.text_of("defines_torque") == "true" and one.torque_Nm is not None for one in found)
    given = [one for one in found if _is_given(one, defined)]
    if len(given) == len(found):
        given = given[:1]
    return [
        one if one in given or one.torque_Nm is None else Drive(one.load, one.shaft, None, "", one.torque_Nm or None)
        for one in found
    ]


def said(case: Case, component: Component, attribute: str) -> float | None:
    """Return a number of a component in a load case; that of all load cases where this one has none."""
    own = case.get(component.number, component).number_of(attribute)
    return component.number_of(attribute) if own is None else own


def _is_given(one: Drive, defined: bool) -> bool:
    defines = one.load.text_of("defines_torque")
    if one.torque_Nm is None or defines == "false":
        return False
    return defines == "true" or (not defined and one.torque_Nm != 0.0)


def _torque(load: Component, case: Case, speed: float | None) -> tuple[float | None, str]:
    """Torque of a load, N m, and how it follows; a load case comes before all load cases, a torque before a power."""
    for values in (case.get(load.number), load):
        if values is None:
            continue
        torque, power = values.number_of(TORQUE), values.number_of(POWER)
        if torque or (torque is not None and power is None):
            return torque, ""
        if power is not None:
            if not power:
                return 0.0, ""
            if not speed:
                return None, f"{load.label}: power = {power:g} kW, and no rotational_speed: no torque follows"
            torque = 1e3 * power / (2.0 * math.pi * speed / 60.0)
            return torque, f"{load.label}: {torque:.6g} N m of {power:g} kW at {speed:g} rpm"
    return None, ""


def shaft_speeds(gearbox: Gearbox, case: Case) -> dict[int, float]:
    """Return the speeds of shafts about their own axes, rpm, by number: said ones, and those that follow from them.

    Meshes, couplings and held members are linear equations of the speeds.
    """
    shafts = gearbox.of_kind("shaft")
    place = {shaft.number: i for i, shaft in enumerate(shafts)}
    own = {shaft.number: speed for shaft in shafts if (speed := said(case, shaft, SPEED)) is not None}
    if not own:
        return {}
    sense = _senses(shafts)
    rows = [
        {n: sense[n] * factor for n, factor in row.items()} for row in _equations(gearbox)
        if row.keys() <= sense.keys()
    ]  # fmt: skip
    matrix = np.zeros((len(rows) + len(own), len(shafts)))
    for i, row in enumerate(rows):
        for number, factor in row.items():
            matrix[i, place[number]] += factor
    for i, number in enumerate(own, start=len(rows)):
        matrix[i, place[number]] = 1.0
    right = np.array([0.0] * len(rows) + list(own.values()))
    found = np.linalg.lstsq(matrix, right, rcond=None)[0]
    _, sizes, directions = np.linalg.svd(matrix)
    free = directions[int((sizes > LOOSE * sizes[0]).sum()) :]
    held = np.abs(free).max(axis=0, initial=0.0) < LOOSE
    still = STILL * float(np.abs(right).max())
    derived = {
        number: float(found[i]) if abs(found[i]) > still else 0.0
        for number, i in place.items() if held[i]
    }  # fmt: skip
    return derived | own


def _senses(shafts: list[Component]) -> dict[int, float]:
    """Which way the axes of shafts look that are parallel to the first one."""
    first = np.array(axis_of(shafts[0]))
    along = {shaft.number: float(first @ axis_of(shaft)) for shaft in shafts}
    return {number: math.copysign(1.0, cosine) for number, cosine in along.items() if abs(cosine) > 1.0 - LOOSE}


def _equations(gearbox: Gearbox) -> Iterator[dict[int, float]]:
    """Factors of the speeds of shafts whose sum vanishes, about one axis."""
    carriers = dict[int, list[int]]()
    for relation in gearbox.relations:
        if relation.kind == "planet_carrier_shaft":
            carriers.setdefault(relation.role(PLANETARY) or -1, []).append(relation.role("shaft") or -1)
    for those in carriers.values():
        yield from ({those[0]: 1.0, other: -1.0} for other in those[1:])
    of_stage = {
        mesh.number: those[0] for stage, those in carriers.items()
        for mesh in gearbox.beside(stage, "cylindrical_stage", "assembly")
    }  # fmt: skip
    for number, gears in stages(gearbox).items():
        row = dict[int, float]()
        ring = -1.0 if RING in (gears[0].kind, gears[1].kind) else 1.0
        for gear, sign in zip(gears, (1.0, ring), strict=True):
            shaft, teeth = next(iter(shafts_of(gearbox, gear)), None), gear.whole_number_of("number_of_teeth")
            if shaft is None or not teeth:
                break
            for part, factor in ((shaft.number, sign * teeth), (of_stage.get(number), -sign * teeth)):
                if part is not None:
                    row[part] = row.get(part, 0.0) + factor
        else:
            yield row
    for _, inner, outer in shaft_joints(gearbox):
        yield {inner.number: 1.0, outer.number: -1.0}
    casings = {casing.number for casing in gearbox.of_kind("gear_casing")}
    for shaft in gearbox.of_kind("shaft"):
        if any(joint.kind in COUPLINGS and other in casings for joint, other in joints(gearbox, shaft)):
            yield {shaft.number: 1.0}
