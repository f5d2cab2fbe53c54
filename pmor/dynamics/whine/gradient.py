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
from pmor.dynamics.whine.cycle import StandingMesh
from pmor.dynamics.whine.hill import MeshCycle, equations, signed, time_invariant
from pmor.dynamics.whine.response import AIR, RPM, LoadResponse, MeshMotion, Source
from pmor.gear.condition import Condition

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
        To the root mean square of each target by the lines of the mesh alone: N, or of power its square root, mW^0.5.
    transmission_error_um : float
        To that of the static transmission error under the mean load.
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
    source, mesh = response.meshes[number], response.meshes[number].mesh
    assert mesh is not None, "of a mesh"
    adjoints, found = [_adjoint(response, source, mesh, target) for target in targets], []
    for parameter in parameters or amounts(mesh.standing):
        lower, upper = (cycle_with(mesh, parameter, step) for step in (-STEP, STEP))
        force, tangent = (upper.force - lower.force) / (2 * STEP), (upper.tangent - lower.tangent) / (2 * STEP)
        error = (error_rms(upper) - error_rms(lower)) / (2.0 * STEP)
        found.append(Change(parameter, tuple(_changed(one, force, tangent) for one in adjoints), error))
    return found


def amounts(standing: StandingMesh) -> list[str]:
    """Return the amounts that the flanks of a mesh can have, and reliefs and twists where they have one."""
    flanks = ("pinion", standing.condition.pinion), ("wheel", standing.condition.wheel)
    return [f"{gear}.{key}" for gear, flank in flanks for key in (*AMOUNTS, *FURTHER)
            if key in AMOUNTS or getattr(flank, key) != 0.0]  # fmt: skip


def cycle_with(motion: MeshMotion, parameter: str, step: float) -> MeshCycle:
    """Return the cycle of a mesh with a further amount, um, at the deflection that the machine takes with it."""
    gear, _, key = parameter.partition(".")
    flank = getattr(motion.standing.condition, gear)
    changed = replace(flank, **{key: getattr(flank, key) + step})
    return cycle_of_flanks(motion, replace(motion.standing.condition, **{gear: changed}), 1)


def cycle_of_flanks(motion: MeshMotion, condition: Condition, steps: int) -> MeshCycle:
    """Return the cycle of a mesh with other flanks, at the deflection that the machine takes with them.

    One step leaves what goes with the square of small amounts, and out of a central difference.
    """
    mesh, moved = replace(motion.standing, condition=condition), np.zeros(2)
    own = np.linalg.inv(motion.at_rest) - motion.cycle.mean  # of the machine without the mesh
    for _ in range(steps):
        moved = moved + motion.at_rest @ (mesh.moved(moved).law().force.mean(axis=0) - mesh.load - own @ moved)
    cycle = mesh.moved(moved).cycle()
    cycle.force[0] -= own @ moved
    return cycle


def error_rms(cycle: MeshCycle) -> float:
    """Return the root mean square of the transmission error at fixed load, um."""
    moved = np.linalg.solve(cycle.mean, time_invariant(cycle)[1:].T)[0]
    return float(1e3 * np.sqrt(2.0 * (abs(moved) ** 2).sum()))


@dataclass(frozen=True)
class _Adjoint:
    """Solution l and motion x by all harmonics of either sign, (2 K + 1, 2), and the root mean square."""

    solution: ComplexArray
    moved: ComplexArray
    rms: float


def _adjoint(response: LoadResponse, source: Source, mesh: MeshMotion, target: Target) -> _Adjoint:
    cycle, own = mesh.cycle, source.ports
    place = int(abs(response.speeds_rpm - target.speed_rpm).argmin())
    receptance = np.stack([mesh.at_rest, *(order.ports(own, own)[place] for order in source.orders)])
    orders = np.arange(-len(receptance) + 1, len(receptance))
    matrix, answer = equations(cycle, receptance[None])[0], signed(receptance, orders)
    acting = np.linalg.solve(matrix, signed(cycle.force, orders).ravel()).reshape(-1, 2)
    right, square = np.zeros(acting.shape, dtype=complex), 0.0
    for at, order in enumerate(orders.tolist()):
        if order and abs(order) <= source.told.shape[1] and source.told[place, abs(order) - 1]:
            rows = _rows(response, source, mesh, abs(order), place, target)
            rows = rows if order > 0 else rows.conj()
            right[at] = rows.conj().T @ rows @ acting[at]
            square += float(abs(np.vdot(acting[at], right[at])))
    solution = np.linalg.solve(matrix.conj().T, right.ravel()).reshape(-1, 2)
    return _Adjoint(solution, np.einsum("nab,nb->na", answer, acting), math.sqrt(square))


def _rows(
    response: LoadResponse, source: Source, mesh: MeshMotion, harmonic: int, place: int, target: Target
) -> ComplexArray:
    """Rows O of a target by the forces that act on the closed machine, (..., 2)."""
    order, own = source.orders[harmonic - 1], source.ports
    if target.kind == "mesh":
        return np.asarray((np.eye(2) - mesh.cycle.mean @ order.ports(own, own)[place])[:1])
    units = np.broadcast_to(np.eye(2, dtype=complex)[:, None], (2, len(order.speeds), 2))
    readings = order.readings(own, units)[:, place]
    if target.kind == "bearing":
        return np.asarray(response.bearing_forces(readings)[:, target.number, :3].T)
    omega = order.order * RPM * response.speeds_rpm[place]
    return np.asarray(omega * math.sqrt(AIR) * response.machine.surface @ response.housing(readings).T)


def _changed(adjoint: _Adjoint, force: ComplexArray, tangent: ComplexArray) -> float:
    orders = np.arange(-len(force) + 1, len(force))
    stiffer = np.einsum("njab,jb->na", signed(tangent, orders[:, None] - orders), adjoint.moved)
    return float(np.vdot(adjoint.solution, signed(force, orders) - stiffer).real) / adjoint.rms
