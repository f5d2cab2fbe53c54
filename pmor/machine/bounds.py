"""Warnings about a solved gearbox: bearings without load or overloaded, faces that lift off, angles that are too large.

A warning is a sentence with load, part, value and rule. It says where a state is outside the range of the equations;
the results themselves are not changed.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from pmor.case import Case
from pmor.machine.coupled import SolvedLoad, SolvedMesh
from pmor.machine.coupled_sets import SolvedSet
from pmor.machine.readings import Data
from pmor.pair.bounds import mesh_bounds
from pmor.sets.bounds import set_bounds

ABOUT_Z = 5


def named_bounds(cases: Mapping[str, Case], solved: SolvedLoad, entry: Data) -> list[str]:
    """Return what leaves its bounds under a load; `entry` is that of the load in `gearbox.json`."""
    bearings = [f"bearing {one['name']}: {text}" for one in entry["bearings"] for text in _bearing(one)]
    meshes = [
        f"mesh {one['name']}: {text}"
        for mesh, one in zip(solved.meshes, entry["meshes"], strict=True)
        for text in _mesh(cases[one["name"]], mesh, one)
    ]
    sets = [f"set {one.meshing.settings.name}, {text}" for one in solved.sets for text in _set(one)]
    return [f"load {solved.load.name}, {text}" for text in (*bearings, *meshes, *sets)]


def _bearing(entry: Data) -> Iterator[str]:
    if entry.get("loaded_elements") == 0:
        yield "carries nothing: its shaft stands within the clearance"
    safety = entry.get("static_safety")
    if safety is not None and safety < 1.0:
        yield (
            f"overloaded, contact pressure {entry['contact_pressure_max_MPa']:.4g} MPa, static safety {safety:.2g} by "
            "ISO 76:2006, below 1"
        )


def _set(one: SolvedSet) -> Iterator[str]:
    yield from (f"{place}: {bound.text}" for place, bound in set_bounds(one.meshing.file, one.solution, 0))


def _mesh(case: Case, mesh: SolvedMesh, entry: Data) -> Iterator[str]:
    ste = mesh.sweep.ste_um.ravel()
    displacement = np.tile(mesh.displacement, (len(ste), 1, 1))
    displacement[:, 0, ABOUT_Z] = 1e-3 * ste / mesh.meshing.pair.pinion.base_radius
    said = (entry[key] for key in ("ste_mean_um", "carrying_face_percent", "flank_pressure_max_MPa"))
    yield from (bound.text for bound in mesh_bounds(case, mesh.meshing.pair, displacement, *said))
