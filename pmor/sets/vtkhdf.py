"""A set in motion as VTKHDF: the surfaces of all gears, how they turn and give way, and their line loads.

A step is a position of the first gear's first pitch, at one torque. Points are those of the first position; `motion_mm`
turns the gears, `displacement_mm` is by how much their hubs move under load, from where a set without load has them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import h5py
import numpy as np

from pmor.case import Case
from pmor.core.arrays import FloatArray, IntArray
from pmor.core.conventions import rotation_z
from pmor.core.version import __version__
from pmor.export.gear_surface import (
    BEFORE,
    QUADRILATERAL,
    Grid,
    flank_columns,
    gear_rings,
    hat_functions,
    quads_between,
    write_grid,
)
from pmor.fe.element import tributary_widths
from pmor.gear.tooth import Tooth
from pmor.line.layered_pair import LayeredPair
from pmor.line.several import PlacedMesh
from pmor.pair.model import sector_ends
from pmor.sets.solution import SetSolution
from pmor.storage.atomic import atomic_path
from pmor_online.root_stress import SENSE

# Points of a flank and of a fillet, sections over the width, and steps at most.
PROFILE, FILLET, PLANES, MOST_STEPS = 8, 2, 9, 20
# Places over the face from which line loads go to the sections.
FINE = 200
#: fields at the points, and their components
FIELDS = {"motion_mm": 3, "displacement_mm": 3, "line_load_N_per_mm": 1}


@dataclass(frozen=True, eq=False)
class _Surface:
    """A gear in the frame of one of its meshes, its first tooth on the y axis.

    Parameters
    ----------
    mesh, gear
        A mesh in whose frame the flanks of the gear are its own, and which of its gears it is.
    roll, z : ndarray
        Of points on the flanks, and of the transverse sections.
    rings : ndarray, shape (K, N, 3)
        About its axis, closed through the bore.
    """

    body: int
    mesh: PlacedMesh
    gear: int
    tooth: Tooth
    roll: FloatArray
    z: FloatArray
    rings: FloatArray

    def turned(self, phi: float) -> float:
        """Angle of its first tooth at an angle of the train, rad."""
        mesh = self.mesh.mesh
        own = mesh.start + mesh.rate * phi
        return own if self.gear == 0 else math.pi + mesh.pair.meshed.pair.wheel_tooth_rotation(own)


def write_set(solved: SetSolution, cases: Mapping[str, Case], torque: int, target: Path) -> None:
    """Write the surfaces of a set over the positions that converged under a torque by its number; nothing without any.

    Cells have the numbers of their gears; the names of these are an attribute of the file.

    Parameters
    ----------
    cases : mapping of str to Case
        Of the meshes.

    Raises
    ------
    OutputError
    """
    steps = np.flatnonzero(solved.converged[torque, : solved.angles_per_pitch])
    if not len(steps):
        return
    steps = steps[:: max(1, math.ceil(len(steps) / MOST_STEPS))]
    surfaces = [_surface(solved, cases, number) for number in range(len(solved.plan.bodies))]
    quads, firsts = [], np.cumsum([0, *(one.rings[..., 0].size for one in surfaces)])
    for one, first in zip(surfaces, firsts, strict=False):
        inside_out = one.mesh.mesh.image != solved.plan.clockwise
        quads.append(first + quads_between(one.rings)[:, :: -1 if inside_out else 1])
    points = [_points(solved, one, steps[:1])[0].reshape(-1, 3) for one in surfaces]
    grid = Grid(
        points=np.concatenate(points) * _side(solved), cells=np.concatenate(quads), kind=QUADRILATERAL,
        numbers={"gear": np.repeat(np.arange(len(surfaces)), [len(one) for one in quads])},
    )  # fmt: skip
    with atomic_path(target) as temporary, h5py.File(temporary, "w") as file:
        file.attrs["pmor_version"] = __version__
        file.attrs["gears"] = [body.name for body in solved.plan.bodies]
        write_grid(file, grid, solved.phi_rad[steps], FIELDS, _fields(solved, surfaces, torque, steps))


def _surface(solved: SetSolution, cases: Mapping[str, Case], body: int) -> _Surface:
    uses = [(n, gear) for n, one in enumerate(solved.train.meshes) for gear in range(2) if one.bodies[gear] == body]
    number, gear = next(use for use in uses if solved.train.meshes[use[0]].image == solved.train.bodies[body].image)
    placed = solved.placed.placed[number]
    pair = placed.mesh.pair.meshed.pair
    tooth = (pair.pinion, pair.wheel)[gear]
    bore = abs(sector_ends(cases[solved.plan.meshes[number].case], pair)[gear])
    roll, z = np.linspace(tooth.form_roll_angle, tooth.tip_roll_angle, PROFILE), np.linspace(*pair.faces[gear], PLANES)
    rings = gear_rings(tooth, 0.0, bore, roll, FILLET, z)
    return _Surface(body, placed, gear, tooth, roll, z, np.concatenate([rings, rings[:1]]))


def _points(solved: SetSolution, one: _Surface, steps: IntArray) -> FloatArray:
    """Return the points of a gear in axes of the train, (steps, K, N, 3)."""
    to_train = one.mesh.mesh.to_train[:3, :3]
    turns = np.stack([to_train @ rotation_z(one.turned(phi)) for phi in solved.phi_rad[steps].tolist()])
    body = solved.plan.bodies[one.body]
    return np.asarray(np.einsum("sij,knj->skni", turns, one.rings) + [body.x, body.y, body.z])


def _side(solved: SetSolution) -> FloatArray:
    """Signs of x, y, z: a plan on coast flanks has x the other way."""
    return np.array([-1.0 if solved.plan.clockwise else 1.0, 1.0, 1.0])


def _fields(
    solved: SetSolution, surfaces: Sequence[_Surface], torque: int, steps: IntArray
) -> Iterator[dict[str, FloatArray]]:
    side = _side(solved)
    of_meshes = [solved.face_loads(number).load_N_per_mm[torque, steps] for number in range(len(solved.placed.placed))]
    for one in surfaces:
        points, body = _points(solved, one, steps), solved.plan.bodies[one.body]
        moved = solved.hub_displacement[torque, steps, one.body][:, None, None]
        hub = moved[..., :3] + np.cross(moved[..., 3:], points - [body.x, body.y, body.z])
        loads = np.stack([
            _line_load(solved, one, step, [loads[place] for loads in of_meshes])
            for place, step in enumerate(steps.tolist())
        ])  # fmt: skip
        values = (points - points[0]) * side, hub * side, loads[..., None]
        yield {
            name: value.reshape(len(steps), -1, parts).transpose(1, 2, 0)
            for (name, parts), value in zip(FIELDS.items(), values, strict=True)
        }


def _line_load(solved: SetSolution, one: _Surface, step: int, loads: Sequence[FloatArray]) -> FloatArray:
    """Line loads of all meshes, (P, S), on the points nearest to where they act, N/mm, (K, N): 0 elsewhere.

    Linear between the transverse sections of the surface, over which their integral is the force.
    """
    found = np.zeros(one.rings.shape[:2])
    reference, count = one.mesh.mesh, abs(one.tooth.teeth)
    for placed, load in zip(solved.placed.placed, loads, strict=True):
        mesh, meshed = placed.mesh, placed.mesh.pair.meshed
        if one.body not in mesh.bodies:
            continue
        gear, flipped = mesh.bodies.index(one.body), mesh.image != reference.image
        z = meshed.sections.z
        roll = placed.lines.roll[step, :, gear].reshape(load.shape)
        teeth = mesh.first_tooth[gear] + SENSE[gear] * (placed.lines.first_pair[step] + np.arange(len(load)))
        places = -np.abs(one.z) if meshed.mirrored else one.z
        for tooth, of_sections, rolls in zip(-teeth if flipped else teeth, load, roll, strict=True):
            if not of_sections.any():
                continue
            row = np.abs(one.roll - np.interp(places, z, rolls)[:, None]).argmin(axis=1)
            columns = flank_columns(
                (int(tooth) - reference.first_tooth[one.gear]) % count, not flipped, PROFILE, FILLET
            )
            found[BEFORE + np.arange(PLANES), columns[row]] = _over_face(meshed, of_sections, one.z)
    return found


def _over_face(meshed: LayeredPair, load: FloatArray, z: FloatArray) -> FloatArray:
    """Return line loads of sections, (S,), at places over the face, between which they are linear with the same sum."""
    low, high = meshed.pair.common_face
    fine = low + (high - low) * (np.arange(FINE) + 0.5) / FINE
    within = np.interp(-np.abs(fine) if meshed.mirrored else fine, meshed.sections.z, load)
    shown = within @ hat_functions(fine, z) / tributary_widths(z, 1)
    return np.asarray(shown * (load @ meshed.width) / (shown @ tributary_widths(z, 1)))
