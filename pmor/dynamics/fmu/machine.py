"""Content of a unit for co-simulation of a gearbox: its modes, what they leave, and its meshes as tables.

Displacements are those beside the state under the mean load, in which the unit starts. The meshes are tables of both
forces (`pmor.dynamics.kernels.hub_table`) and act on modes that are closed by their mean tangents, so that flanks may
part. The speed is prescribed; gyroscopic moments and centrifugal forces are those of it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from pmor.case.capability import refuse_beyond
from pmor.core.arrays import FloatArray
from pmor.dynamics.fmu.write import Unit, Variable, write_unit
from pmor.dynamics.kernels.hub_table import ClosedMeshes
from pmor.dynamics.whine.modal import closed, receptance_of
from pmor.dynamics.whine.moving import bearing_rows
from pmor.dynamics.whine.parting import backlash_of_mesh, machine_of
from pmor.dynamics.whine.response import RPM, LoadResponse
from pmor.dynamics.whine.run import about_first_load
from pmor.line.hub_law import COORDINATES
from pmor.machine.loaded import ABOUT_AXIS
from pmor.machine.loader import GearboxFile

# Of the phases of a table every so many are in the unit, which is linear between them.
EVERY = 2
AXES = "xyz"


@dataclass(frozen=True)
class MachineLaw:
    """A gearbox about a load: n modes, M meshes with r = 2 M coordinates, t torques, B bearings.

    Parameters
    ----------
    meshes : ClosedMeshes
        Their cycles are those by a turn of the first torque's shaft.
    arrays : mapping of str to ndarray
        What else is in the source, by its names there; OMEGA and RATIO are angular frequencies, and damping over the
        critical one.
    torques : tuple of (str, float)
        Shaft and place of each.
    """

    load: str
    speed_rpm: float
    meshes: ClosedMeshes
    arrays: Mapping[str, FloatArray]
    mesh_names: tuple[str, ...]
    bearing_names: tuple[str, ...]
    torques: tuple[tuple[str, float], ...]


def machine_law(response: LoadResponse, file: GearboxFile) -> MachineLaw:
    """Tabulate the meshes of a gearbox about a load.

    Raises
    ------
    ConvergenceError
        Where a mesh has no force in the range of its table.
    """
    machine, solved = response.machine, response.solved
    turned = [machine.row(one.shaft, one.at_mm, ABOUT_AXIS) for one in solved.load.torques]
    readings = np.concatenate([*bearing_rows(machine, solved), np.eye(len(machine.mass))[machine.housing]])
    found = receptance_of(
        machine, closed(machine, response.tangent), response.modes, np.concatenate([machine.meshes, turned]), readings,
        float(response.receptance.damping_ratio[-1]),
    )  # fmt: skip
    numbers = range(len(solved.meshes))
    backlash = [backlash_of_mesh(response, file, number) for number in numbers]
    parting = machine_of(replace(response, receptance=found), numbers, backlash)
    count, elastic, meshes = len(machine.meshes), found.modes.square > 0.0, parting.law.meshes
    among, rest = np.ix_(elastic, elastic), found.left_ports
    by_modes, left = _bearings(response, found.readings), _bearings(response, found.left_readings)
    rows = parting.oscillator.rows
    arrays = {
        "OMEGA": np.sqrt(found.modes.square[elastic]), "RATIO": found.damping_ratio[elastic],
        "GYROSCOPIC": machine.sense * found.gyroscopic[among], "CENTRIFUGAL": found.centrifugal[among],
        "BY_MODES": rows, "MOBILITY": rows @ rows.T, "TORQUE_ON_MODES": found.ports[count:, elastic].T,
        "BY_TORQUES": -parting.arms[:, None] * rest[:count, count:], "FORCE_BY_MODES": by_modes[:, elastic],
        "FORCE_BY_MESHES": left[:, :count] * parting.arms, "FORCE_BY_TORQUES": left[:, count:],
    }  # fmt: skip
    return MachineLaw(
        solved.load.name, float(response.speeds_rpm[-1]),
        meshes._replace(cycles=machine.mesh_rate(0) * meshes.cycles), arrays, tuple(response.mesh_names),
        tuple(bearing.settings.name for bearing in machine.gearbox.bearings),
        tuple((one.shaft, one.at_mm) for one in solved.load.torques),
    )  # fmt: skip


def _bearings(response: LoadResponse, readings: FloatArray) -> FloatArray:
    """Forces of all bearings along x, y, z by the columns of readings, (3 B, ...)."""
    forces = response.bearing_forces(np.asarray(readings.T, dtype=complex)).real[..., :3]
    return np.asarray(forces.reshape(len(forces), -1).T)


def machine_unit(law: MachineLaw, file: GearboxFile) -> Unit:
    """Return the unit of a gearbox."""
    variables = [Variable("speed", "input", "rad/s", "of the shaft of the first torque, its amount",
                          RPM * law.speed_rpm)]  # fmt: skip
    variables += [
        Variable(f"torque_{_plain(shaft)}_{number}", "input", "N.m", f"on {shaft} at {at:g} mm, beside the mean torque")
        for number, (shaft, at) in enumerate(law.torques, start=1)
    ]
    variables += [
        Variable(f"mesh_{_plain(name)}", "output", "N", f"normal force of the mesh {name}") for name in law.mesh_names
    ]
    variables += [
        Variable(f"bearing_{_plain(name)}_{number}_{axis}", "output", "N", f"of {name} along {axis}, beside its mean")
        for number, name in enumerate(law.bearing_names, start=1) for axis in AXES
    ]  # fmt: skip
    omega, backs = law.arrays["OMEGA"], [table.backlash for table in law.meshes.tables]
    sentence = (
        f"{file.sections.title} in motion about {law.load}: {len(omega)} modes up to "
        f"{omega.max() / (2.0 * math.pi):.4g} Hz and what they leave at rest, meshes as tables of exact line contact "
        f"whose flanks may part; backs of teeth carry where they mirror flanks ({int(np.isfinite(backs).sum())} of "
        f"{len(backs)} meshes). The speed is prescribed: what of all torques would change it, the inertia takes."
    )
    return Unit(file.name, sentence, tuple(variables), "machine.c", _table_text(law))


def write_machine_unit(file: GearboxFile, path: Path, overwrite: bool = False) -> bool:
    """Write a gearbox about its first load as a unit for co-simulation; as of `machine_law` and `write_unit`.

    CaseError where no tables hold its meshes, or as of `about_first_load`.
    """
    refuse_beyond(file, "fmu")
    return write_unit(machine_unit(machine_law(about_first_load(file), file), file), path, overwrite)


def _plain(name: str) -> str:
    return re.sub(r"\W+", "_", name, flags=re.ASCII).strip("_")


def _table_text(law: MachineLaw) -> str:
    meshes, values = law.meshes, [table.values[::EVERY].astype(np.float32) for table in law.meshes.tables]
    phases, approaches, tilts = values[0].shape[:3]
    forces, torques = law.arrays["FORCE_BY_TORQUES"].shape
    whole = {
        "MODES": len(law.arrays["OMEGA"]), "MESHES": len(values), "SIZE": COORDINATES * len(values),
        "TORQUES": torques, "FORCES": forces, "PHASES": phases, "APPROACHES": approaches, "TILTS": tilts,
    }  # fmt: skip
    of_tables = {
        name: np.array([getattr(table, name.lower()) for table in meshes.tables])
        for name in ("LOW", "SPAN", "MIDDLE", "TILT", "BACKLASH")
    }
    of_meshes = {
        "RATE": meshes.cycles, "AHEAD": meshes.offset, "TANGENT": meshes.tangent, "RESIDUAL": meshes.residual,
        "CENTRE": meshes.centre, "LOAD": meshes.load,
    }  # fmt: skip
    lines = [f"#define {name} {value}" for name, value in whole.items()]
    lines.append(f"#define SPEED_START {RPM * law.speed_rpm!r}")
    for name, array in (dict(law.arrays) | of_meshes | of_tables).items():
        shape = "".join(f"[{size}]" for size in array.shape)
        lines.append(f"static const double {name}{shape} = {_braced(array)};")
    for number, one in enumerate(values):
        text = ",".join(f"{value:.8g}" for value in one.ravel().tolist())
        lines.append(f"static const float VALUES_{number}[{one.size}] = {{{text}}};")
    names = ", ".join(f"VALUES_{number}" for number in range(len(values)))
    return "\n".join([*lines, f"static const float *const VALUES[{len(values)}] = {{{names}}};", ""])


def _braced(array: FloatArray) -> str:
    if array.ndim == 1:
        return "{" + ", ".join("HUGE_VAL" if np.isinf(one) else repr(float(one)) for one in array) + "}"
    return "{" + ",\n".join(_braced(row) for row in array) + "}"
