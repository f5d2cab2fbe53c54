"""Surfaces of the gears of a planetary set in its machine, each at angle 0, as rings along the axis."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.export.gear_surface import gear_rings
from pmor.line.train import to_train
from pmor.machine.loaded import SetMeshing
from pmor.machine.model import GearboxModel
from pmor.machine.set_frame import CARRIED_BY, MEMBERS
from pmor.pair.model import gear_pair, sector_ends
from pmor.sets.kinematics import Meeting, placements


class GearOfSet(NamedTuple):
    """A gear of a set.

    Attributes
    ----------
    rings : ndarray, shape (K, N, 3)
        In axes of the machine, mm, counter-clockwise about x but for those of an internal gear, and closed.
    member : int
        That it moves with, by its number in `MEMBERS`.
    """

    name: str
    rings: FloatArray
    member: int


def member_places(model: GearboxModel, one: SetMeshing) -> FloatArray:
    """Return the places of the hubs of sun, carrier and ring, (3, 3), mm.

    That of one in the housing is the other's; of a set without shafts all are the origin.
    """
    found = {}
    for member, place in one.settings.members.items():
        shaft = model.shafts[place.shaft]
        found[member] = [shaft.start_mm + place.at_mm, *shaft.at_mm]
    first = next(iter(found.values()), [0.0, 0.0, 0.0])
    return np.array([found.get(member, first) for member in MEMBERS])


def gears_of_set(model: GearboxModel, one: SetMeshing, profile: int, fillet: int, planes: int) -> Iterator[GearOfSet]:
    """Return the gears of a set: points of an involute, of a fillet, and transverse sections."""
    plan, cases = one.file.plan, one.file.cases
    pairs = {name: gear_pair(case) for name, case in cases.items()}
    placed = placements(
        [body.centre for body in plan.bodies],
        [Meeting(pairs[mesh.case], mesh.pinion, mesh.wheel) for mesh in plan.meshes],
    )
    middle = member_places(model, one)[0]
    for number, body in enumerate(plan.bodies):
        mesh, place = next(
            (mesh, place) for mesh, place in zip(plan.meshes, placed, strict=True)
            if number in (mesh.pinion, mesh.wheel)
        )  # fmt: skip
        pair, gear = pairs[mesh.case], (mesh.pinion, mesh.wheel).index(number)
        tooth = (pair.pinion, pair.wheel)[gear]
        turned = place.start if gear == 0 else math.pi + pair.wheel_tooth_rotation(place.start)
        roll = np.linspace(tooth.form_roll_angle, tooth.tip_roll_angle, profile)
        bore = abs(sector_ends(cases[mesh.case], pair)[gear])
        rings = gear_rings(tooth, turned, bore, roll, fillet, np.linspace(*pair.faces[gear], planes))
        to_plan, to_machine = to_train(place.direction, place.image)[:3, :3], one.frame.turn[:3, :3]
        turn = to_machine @ to_plan
        rings = rings @ turn.T + to_machine @ [body.x, body.y, body.z] + middle
        # Rings go along x, and their points run about it as before.
        along = math.copysign(1.0, turn[0, 2])
        rings = rings[:: int(along), :: int(along * round(float(np.linalg.det(turn))))]
        yield GearOfSet(body.name, np.concatenate([rings, rings[:1]]), CARRIED_BY[body.member])
