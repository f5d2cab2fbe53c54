"""What is read off a gearbox in motion: bearing forces, peaks with their lines and modes, modes with their families."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.signal import argrelmax

from pmor.body.beam import NODE
from pmor.core.arrays import ComplexArray, FloatArray
from pmor.dynamics.whine.moving import MovingMachine
from pmor.dynamics.whine.response import RPM, Lines, LoadResponse, MeshResponse, of_mesh

Data = dict[str, Any]
# Directions of a shaft's nodes by the kind of motion, and their names.
KINDS = (("axial", (0,)), ("torsion", (3,)), ("bending", (1, 2, 4, 5)))
# Peaks that are told of each reading.
MOST_PEAKS = 3


def bearing_names(response: LoadResponse) -> list[str]:
    """Return the names of the bearings."""
    return [bearing.settings.name for bearing in response.machine.gearbox.bearings]


def bearing_forces(response: LoadResponse, readings: ComplexArray) -> ComplexArray:
    """Return forces and moments on what holds each bearing, (..., bearings, 6), from readings (..., o)."""
    gearbox = response.machine.gearbox
    count = NODE * len(gearbox.bearings)
    found = readings[..., :count].reshape(*readings.shape[:-1], len(gearbox.bearings), NODE).copy()
    place = count
    for number, bearing in enumerate(gearbox.bearings):
        for direction in bearing.rigid:
            # A reaction acts on the shaft.
            found[..., number, direction] -= readings[..., place]
            place += 1
    return found


def force_lines(response: LoadResponse, mesh: MeshResponse, lines: Lines) -> FloatArray:
    """Return the forces of a mesh's lines on all bearings, as rms of the vector, (S, K, bearings), N."""
    force = bearing_forces(response, lines.readings)[..., :3]
    return np.asarray(np.sqrt(2.0 * (abs(force) ** 2).sum(axis=-1)) * mesh.told[..., None])


def bearing_rms(response: LoadResponse, constant: bool = False) -> FloatArray:
    """Return the forces on all bearings over the speed, rms of all lines of all meshes, (S, bearings), N."""
    every = [force_lines(response, mesh, lines_of(mesh, constant)) ** 2 for mesh in response.meshes]
    return np.asarray(np.sqrt(sum(one.sum(axis=1) for one in every)))


def mesh_rms(mesh: MeshResponse, constant: bool = False) -> FloatArray:
    """Return the dynamic mesh force over the speed, rms of its own lines, (S,), N."""
    return np.asarray(np.sqrt(2.0 * (abs(lines_of(mesh, constant).force) ** 2 * mesh.told).sum(axis=1)))


def lines_of(mesh: MeshResponse, constant: bool) -> Lines:
    """Return the lines of a mesh, by its varying stiffness or a constant one."""
    return mesh.time_invariant if constant else mesh.lines


def mode_rows(response: LoadResponse) -> list[Data]:
    """Return each natural mode: frequency, strain energy of the meshes, what moves, its family."""
    machine, modes = response.machine, response.modes
    own = machine.mass @ modes.shape * modes.shape
    rows = []
    for number in range(len(modes.square)):
        if modes.square[number] == 0.0:
            continue
        strain = [
            float(x @ response.tangent[of_mesh(n), of_mesh(n)] @ x) / float(modes.square[number])
            for n, x in enumerate(np.split(response.receptance.ports[:, number], len(response.meshes)))
        ]
        shares = _kinetic(machine, own[:, number])
        shaft = max(shares, key=lambda name: sum(shares[name].values()))
        kinds = {kind: sum(share[kind] for share in shares.values()) for kind, _ in KINDS}
        rows.append({
            "mode": number + 1 - int((modes.square == 0.0).sum()),
            "natural_frequency_Hz": float(modes.frequency_Hz[number]),
            "mesh_strain_energy_share": strain,
            "kinetic_energy_share": {name: sum(share.values()) for name, share in shares.items()},
            "moves_most": shaft, "kind": max(kinds, key=lambda kind: kinds[kind]), "kind_share": max(kinds.values()),
        })  # fmt: skip
    return rows


def _kinetic(machine: MovingMachine, energy: FloatArray) -> dict[str, dict[str, float]]:
    """Share of each shaft and the housing in the kinetic energy of a mode, by the kind of motion."""
    gearbox, found = machine.gearbox, {}
    parts = {name: (first, NODE * len(gearbox.beams[name].stations)) for name, first in gearbox.first.items()}
    if len(gearbox.housing):
        parts["housing"] = len(energy) - len(gearbox.housing), len(gearbox.housing)
    for name, (first, size) in parts.items():
        nodes = energy[first : first + size].reshape(-1, NODE)
        found[name] = {kind: float(nodes[:, list(ways)].sum()) for kind, ways in KINDS}
    return found


def peak_rows(response: LoadResponse) -> list[Data]:
    """Return the largest peaks of the force of each bearing over the speed, with the line and the mode of each.

    A peak is that of the line whose square bends down most there; without it there is none.
    """
    total, constant = bearing_rms(response), bearing_rms(response, constant=True)
    lines = np.stack([force_lines(response, mesh, mesh.lines) for mesh in response.meshes], axis=1)
    rows = []
    for bearing, name in enumerate(bearing_names(response)):
        over_speed = total[:, bearing]
        tops = sorted(argrelmax(over_speed)[0].tolist(), key=lambda place: -float(over_speed[place]))
        for place in tops[:MOST_PEAKS]:
            bends = np.diff(lines[place - 1 : place + 2, :, :, bearing] ** 2, n=2, axis=0)[0]
            number, harmonic = divmod(int(bends.argmin()), lines.shape[2])
            line, mesh = float(lines[place, number, harmonic, bearing]), response.meshes[number]
            speed = float(response.speeds_rpm[place])
            rows.append({
                "bearing": name, "speed_rpm": speed, "force_rms_N": float(over_speed[place]), "mesh": mesh.name,
                "harmonic": harmonic + 1, "frequency_Hz": speed / 60.0 * mesh.rate * (harmonic + 1),
                "line_rms_N": line, "without_line_rms_N": float(np.sqrt(max(over_speed[place] ** 2 - line**2, 0.0))),
                **_mode_of(response, number, harmonic, place, bearing),
                "constant_stiffness_rms_N": float(constant[place, bearing]),
            })  # fmt: skip
    return rows


def _mode_of(response: LoadResponse, number: int, harmonic: int, place: int, bearing: int) -> Data:
    """The mode that gives most of a line's force on a bearing, and the speed at which the order meets it."""
    mesh, order = response.meshes[number], response.meshes[number].orders[harmonic]
    amplitude = order.modal(of_mesh(number), mesh.lines.closing[:, harmonic])[place]
    share = bearing_forces(response, (order.by_readings * amplitude).T)[:, bearing, :3]
    dominant = int((abs(share) ** 2).sum(axis=1).argmax())
    at_rest = int((abs(order.mixed[:, dominant]) ** 2).argmax())
    rigid = int((response.modes.square == 0.0).sum())
    return {"mode": at_rest + 1 - rigid, "resonance_rpm": float(order.resonance[dominant] / RPM)}
