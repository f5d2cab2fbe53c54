"""What a micrometre of each flank modification does to a bearing force and to a mesh force: by the adjoint.

With the equations of `pmor.dynamics.whine.hill`, A f = w, and a force rms^2 = sum |O_n f_n|^2 over the lines told,

    d rms = Re(l^H (dw - dK x)) / rms,    A^H l = g,    g_n = O_n^H O_n f_n:

one solution for all modifications. dw and dK are differences of the mesh's own law, at the deflection that the machine
takes with the modified flank.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pmor.core.arrays import ComplexArray
from pmor.dynamics.whine.coherent import CoherentMeshes
from pmor.dynamics.whine.cycle import FROM_END_TO_END, GEARS
from pmor.dynamics.whine.hill import MeshCycle, equations, signed
from pmor.dynamics.whine.orders import Order, Ports
from pmor.dynamics.whine.pitches import time_invariant
from pmor.dynamics.whine.response import AIR, LoadResponse, MeshMotion, Source
from pmor.line.hub_law import COORDINATES

# Amounts that each flank can have, whatever it has: um.
AMOUNTS = "profile_crowning_um", "profile_slope_um", "helix_crowning_um", "helix_slope_um"
# Those that need a place, and twists, where a flank has them.
FURTHER = "tip_relief_um", "root_relief_um", "end_relief_um", "twist_um"
# Half of the difference of an amount, um.
STEP = 0.02


@dataclass(frozen=True)
class Target:
    """What changes: a force or a power, at the nearest of the speeds.

    Parameters
    ----------
    kind : {"bearing", "mesh", "power"}
        Force on a bearing; of the mesh; equivalent radiated power of the housing.
    number : int
        Of the bearing.
    """

    kind: str
    speed_rpm: float
    number: int = 0


@dataclass(frozen=True)
class Change:
    """What a micrometre of a modification does.

    Parameters
    ----------
    targets : tuple of float
        To the root mean square of each target by the lines of the mesh alone, with those that keep step with it: N, or
        of power its square root, mW^0.5.
    transmission_error_um : float
        To that of the mesh's static transmission error under the mean load.
    """

    parameter: str
    targets: tuple[float, ...]
    transmission_error_um: float


def changes(
    response: LoadResponse, number: int, targets: Sequence[Target], parameters: Sequence[str] = ()
) -> list[Change]:
    """Return what a micrometre of each modification of a mesh does to what its own lines cause.

    Parameters
    ----------
    parameters : sequence of str
        Such as ``pinion.helix_slope_um``; by default all amounts that the flanks can have.
    """
    source, mesh, place = response.source_of(number)
    adjoints, found = [_adjoint(response, source, mesh, target, place) for target in targets], []
    mesh = replace(mesh, standing=mesh.standing.keeping())
    for parameter in parameters or amounts(mesh.standing, place):
        lower, upper = (cycle_with(mesh, place, parameter, step) for step in (-STEP, STEP))
        force, tangent = (upper.force - lower.force) / (2 * STEP), (upper.varying - lower.varying) / (2 * STEP)
        error = (error_rms(upper, place) - error_rms(lower, place)) / (2.0 * STEP)
        found.append(Change(parameter, tuple(_changed(one, force, tangent) for one in adjoints), error))
    return found


def amounts(standing: CoherentMeshes, place: int) -> list[str]:
    """Return the amounts that the flanks of a mesh, by its place, can have, and reliefs and twists where they have one.

    Of a flank that carries in meshes before it, none: it is told there.
    """
    found = []
    for gear, name in enumerate(GEARS):
        flank = standing.flank(place, gear)
        if not standing.told_before(place, gear):
            found += [f"{name}.{key}" for key in (*AMOUNTS, *FURTHER) if key in AMOUNTS or getattr(flank, key) != 0.0]
    return found


def cycle_with(motion: MeshMotion, place: int, parameter: str, step: float) -> MeshCycle:
    """Return the cycle with a further amount of a mesh, um, at the deflection that the machine takes with it."""
    name, _, key = parameter.partition(".")
    gear, standing = GEARS.index(name), motion.standing
    flank, way = standing.flank(place, gear), -1.0 if standing.image(place) and key in FROM_END_TO_END else 1.0
    changed = replace(flank, **{key: getattr(flank, key) + way * step})
    return cycle_of_flanks(motion, standing.with_flank(place, gear, changed), 1)


def cycle_of_flanks(motion: MeshMotion, meshes: CoherentMeshes, steps: int) -> MeshCycle:
    """Return the cycle of meshes with other flanks, at the deflection that the machine takes with them.

    One step leaves what goes with the square of small amounts, and out of a central difference.
    """
    moved = np.zeros(len(meshes.load))
    own = np.linalg.inv(motion.at_rest) - motion.cycle.mean  # of the machine without the meshes
    for _ in range(steps):
        moved = moved + motion.at_rest @ (meshes.moved(moved).mean_force() - meshes.load - own @ moved)
    cycle = meshes.moved(moved).cycle()
    cycle.force[0] -= own @ moved
    return cycle


def error_rms(cycle: MeshCycle, place: int) -> float:
    """Return the root mean square of the transmission error of a mesh, by its place, at fixed load, um."""
    moved = np.linalg.solve(cycle.mean, time_invariant(cycle)[1:].T)[COORDINATES * place]
    return float(1e3 * np.sqrt(2.0 * (abs(moved) ** 2).sum()))


@dataclass(frozen=True)
class _Adjoint:
    """Solution l and motion x by all harmonics of either sign, (2 K + 1, 2), and the root mean square."""

    solution: ComplexArray
    moved: ComplexArray
    rms: float


def _adjoint(response: LoadResponse, source: Source, mesh: MeshMotion, target: Target, mesh_place: int) -> _Adjoint:
    cycle, size = mesh.cycle, len(mesh.at_rest)
    place = int(abs(response.speeds_rpm - target.speed_rpm).argmin())
    orders = [replace(order, speeds=order.speeds[place : place + 1]) for order in source.orders]
    receptance = mesh.moving(orders)[0]
    matrix, answer = equations(cycle, receptance[None])[0], signed(receptance, cycle.places)
    acting = np.linalg.solve(matrix, signed(cycle.force, cycle.places).ravel()).reshape(-1, size)
    right, square = np.zeros(acting.shape, dtype=complex), 0.0
    for at, line in enumerate(cycle.places.tolist()):
        if line and abs(line) <= source.told.shape[1] and source.told[place, abs(line) - 1]:
            rows = _rows(response, source.ports, mesh, orders[abs(line) - 1], target, mesh_place)
            rows = rows if line > 0 else rows.conj()
            right[at] = rows.conj().T @ rows @ acting[at]
            square += float(abs(np.vdot(acting[at], right[at])))
    solution = np.linalg.solve(matrix.conj().T, right.ravel()).reshape(-1, size)
    return _Adjoint(solution, np.einsum("nab,nb->na", answer, acting), math.sqrt(square))


def _rows(
    response: LoadResponse, own: Ports, mesh: MeshMotion, order: Order, target: Target, mesh_place: int
) -> ComplexArray:
    """Rows O of a target by the forces that act on the closed machine along an order at one speed, (..., q)."""
    size = len(mesh.at_rest)
    if target.kind == "mesh":
        at = COORDINATES * mesh_place
        return np.asarray((np.eye(size) - mesh.cycle.mean @ order.ports(own, own)[0])[at : at + 1])
    readings = order.readings(own, np.eye(size, dtype=complex)[:, None])[:, 0]
    if target.kind == "bearing":
        return np.asarray(response.bearing_forces(readings)[:, target.number, :3].T)
    omega = order.order * order.speeds[0]
    return np.asarray(omega * math.sqrt(AIR) * response.machine.surface @ response.housing(readings).T)


def _changed(adjoint: _Adjoint, force: ComplexArray, tangent: ComplexArray) -> float:
    """What further forces (K + 1, q) and tangents between harmonics do to a target."""
    places = np.arange(-len(force) + 1, len(force))
    stiffer = np.einsum("njab,jb->na", tangent, adjoint.moved)
    return float(np.vdot(adjoint.solution, signed(force, places) - stiffer).real) / adjoint.rms
