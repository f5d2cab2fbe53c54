"""The whole machine as VTKHDF: surfaces of shafts, gears and bearings with displacements and line loads, a step a load.

Time is the number of the load case, from 0 on.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.version import __version__
from pmor.export.gear_surface import QUADRILATERAL, Grid, write_grid
from pmor.machine.bodies import Body, Detail, bodies
from pmor.machine.coupled import SolvedLoad
from pmor.machine.model import GearboxModel
from pmor.storage.atomic import atomic_path

FINE = Detail(circle=48, profile=10, fillet=3, planes=9)
#: fields at the points, and their components
FIELDS = {"displacement_mm": 3, "displacement_without_twist_mm": 3, "line_load_N_per_mm": 1}


def write_machine(model: GearboxModel, loads: Sequence[SolvedLoad], target: Path) -> None:
    """Write a gearbox under its load cases; OutputError where that fails.

    Cells have the numbers of their bodies; names of bodies and load cases, in the order of their numbers, are
    attributes of the file.
    """
    found = bodies(model, loads[0].gearbox, FINE)
    told = {"loads": [solved.load.name for solved in loads]}
    write_bodies(found, target, told, np.arange(float(len(loads))), FIELDS, _fields(found, loads))


def write_bodies(
    found: Sequence[Body], target: Path, told: Mapping[str, Any], steps: FloatArray,
    fields: Mapping[str, int], parts: Iterable[Mapping[str, FloatArray]],
) -> None:  # fmt: skip
    """Write surfaces of bodies with fields over steps; OutputError where that fails.

    Parameters
    ----------
    told : mapping
        Attributes of the file.
    steps, fields, parts
        As of `pmor.export.gear_surface.write_grid`, a part for each body.
    """
    firsts = np.cumsum([0, *(body.rings[..., 0].size for body in found)])
    quads = [body.quads for body in found]
    grid = Grid(
        points=np.concatenate([body.rings.reshape(-1, 3) for body in found]),
        cells=np.concatenate([one + first for one, first in zip(quads, firsts, strict=False)]),
        kind=QUADRILATERAL,
        numbers={"body": np.repeat(np.arange(len(found)), [len(one) for one in quads])},
    )
    with atomic_path(target) as temporary, h5py.File(temporary, "w") as file:
        file.attrs["pmor_version"] = __version__
        file.attrs["bodies"] = [f"{body.kind} {body.name}" for body in found]
        for name, values in told.items():
            file.attrs[name] = values
        write_grid(file, grid, steps, fields, parts)


def _fields(found: Sequence[Body], loads: Sequence[SolvedLoad]) -> Iterator[dict[str, FloatArray]]:
    for body in found:
        moved = [solved.equilibrium.displacement for solved in loads]
        by_load = (
            [body.displacement(one) for one in moved],
            [body.displacement(one, twist=False) for one in moved],
            [body.line_load(solved)[..., None] for solved in loads],
        )
        yield {
            name: np.stack([value.reshape(-1, parts) for value in values], axis=-1)
            for (name, parts), values in zip(FIELDS.items(), by_load, strict=True)
        }
