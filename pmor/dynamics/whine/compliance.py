"""Compliance of both gears at a mesh over the frequency, and the mesh force by unit of transmission error.

Each gear on its own side of the open mesh, in the direction of the transverse mesh force, all other meshes with their
mean stiffness and shafts at rest. With both, D, and the mesh k, a transmission error e makes the force e / (D + 1 / k).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pmor.body.beam import NODE
from pmor.core.arrays import ComplexArray, FloatArray
from pmor.dynamics.whine.modal import closed, receptance_of, transfer
from pmor.dynamics.whine.response import LoadResponse, of_mesh


@dataclass(frozen=True)
class MeshCompliance:
    """A mesh over n frequencies.

    Parameters
    ----------
    gears : ndarray of complex, shape (n, 2)
        Of pinion and wheel, mm/N.
    contact : float
        Of the mesh itself, mm/N.
    force : ndarray of complex, shape (n,)
        By transmission error, N/mm.
    """

    name: str
    frequency_Hz: FloatArray
    gears: ComplexArray
    contact: float
    force: ComplexArray


def mesh_compliance(response: LoadResponse, number: int, frequency_Hz: FloatArray) -> MeshCompliance:
    """Return the compliance of both gears at a mesh, and its force by transmission error."""
    machine, tangent, own = response.machine, response.tangent, of_mesh(number)
    row, sides = machine.meshes[own.start], []
    for hub in machine.gearbox.meshes[number].hubs:
        sides.append(np.where((np.arange(len(row)) // NODE == hub // NODE), row, 0.0))
    ports = np.concatenate([machine.meshes, sides])
    ratio = float(response.receptance.damping_ratio[-1])
    receptance = receptance_of(
        machine, closed(machine, tangent), response.modes, ports, np.zeros((0, len(row))), ratio
    )
    found, count = transfer(receptance, 2.0 * np.pi * frequency_Hz), len(tangent)
    # Forces of all other meshes where the flanks of this one are free, less those that close it.
    taken = tangent[:, own] @ np.linalg.solve(tangent[own, own], tangent[own])
    opened = np.pad(-taken, ((0, len(sides)), (0, len(sides))))
    gears = np.diagonal(found.closed_further(opened).ports, axis1=1, axis2=2)[:, count:]
    closing = np.eye(count) - tangent @ found.ports[:, :count, :count]
    force = (closing @ tangent)[:, own.start, own.start]
    name = response.mesh_names[number]
    return MeshCompliance(name, frequency_Hz, gears, 1.0 / float(tangent[own.start, own.start]), force)
