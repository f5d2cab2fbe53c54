"""Sets as they are made: flanks of all gears that scatter independently, and pins that are off their places."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.design.files import PINS, SetDesign
from pmor.design.settings import Scatter
from pmor.design.variables import SEED, Draw, normal_points
from pmor.sets.plan import planetary_errors


@dataclass(frozen=True, eq=False)
class SetDraw:
    """By how much one set of those that are made is off: the flanks of each mesh, and the hubs (6 B,), mm."""

    flanks: tuple[Draw, ...]
    displacement: FloatArray


def drawn_sets(file: SetDesign, scatter: Scatter, count: int, seed: int = SEED) -> tuple[SetDraw, ...]:
    """Return `count` draws of the flanks and pins of a set, as even as a Sobol sequence; another seed gives fresh ones.

    Flanks of a gear are those on one side of all its teeth: of planets both sides, each planet by itself. None of a
    scatter of nothing.
    """
    plan, said = file.set.plan, file.filed.sections
    sizes, pins = np.array(list(scatter.modifications.values())), file.pins
    sides = [
        ((mesh.pinion, file.set.cases[mesh.case].flank), (mesh.wheel, file.set.cases[mesh.case].flank))
        for mesh in plan.meshes
    ]
    places = {side: place for place, side in enumerate(dict.fromkeys(side for both in sides for side in both))}
    flanks, planets, found = len(places) * len(sizes), said.planets.count, list[SetDraw]()
    for point in normal_points(flanks + planets * len(pins), count, seed):
        amounts = [
            {key: float(value) for key, value in zip(scatter.modifications, sizes * part, strict=True)}
            for part in point[:flanks].reshape(len(places), -1)
        ]
        draws = tuple(Draw(amounts[places[pinion]], amounts[places[wheel]]) for pinion, wheel in sides)
        moved = dict(zip(pins, point[flanks:].reshape(len(pins), planets), strict=True))
        off: dict[str, Any] = {
            PINS[key]: tuple((size * moved[key] + (getattr(said.planets, PINS[key]) or 0.0)).tolist())
            for key, size in pins.items()
        }
        displacement = plan.displacement
        if off:
            errors = replace(said, planets=replace(said.planets, **off))
            displacement, _ = planetary_errors(errors, plan.bodies, plan.clockwise)
        found.append(SetDraw(draws, displacement))
    return tuple(found)
