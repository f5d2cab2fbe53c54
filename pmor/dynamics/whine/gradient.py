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
from pmor.dynamics.whine.blades import SIDEBANDS
from pmor.dynamics.whine.coherent import CoherentMeshes
from pmor.dynamics.whine.cycle import FROM_END_TO_END, GEARS
from pmor.dynamics.whine.hill import MeshCycle, signed
from pmor.dynamics.whine.orders import Order
from pmor.dynamics.whine.pitches import time_invariant
from pmor.dynamics.whine.response import AIR, LoadResponse, MeshMotion, Source
from pmor.dynamics.whine.set_motion import SetMotion
from pmor.line.hub_law import COORDINATES

# Amounts that each flank can have, whatever it has: um.
AMOUNTS = "profile_crowning_um", "profile_slope_um", "helix_crowning_um", "helix_slope_um"
# Those that need a place, and twists, where a flank has them.
FURTHER = "tip_relief_um", "root_relief_um", "end_relief_um", "twist_um"
# Half of a micrometre either way. The tangent jumps where a section first touches, as cycles are seen at some angles
# alone: a smaller step finds that jump over the step.
STEP = 0.5
# Meshes of each planet: with the sun, and with the ring.
OF_A_SET = 2


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
    source, meshes, places = passing_at(response, number)
    assert meshes.standing is not None
    adjoints, found = [_adjoint(response, source, meshes, target, places) for target in targets], []
    standing = meshes.standing.keeping()
    meshes = replace(meshes, standing=standing)
    for parameter in parameters or amounts(standing, places[0]):
        lower, upper = (cycle_with(meshes, places, parameter, step) for step in (-STEP, STEP))
        error = (error_rms(upper, meshes, places) - error_rms(lower, meshes, places)) / (2.0 * STEP)
        found.append(Change(parameter, tuple(_changed(one, meshes, lower, upper) for one in adjoints), error))
    return found


def passing_at(response: LoadResponse, number: int) -> tuple[Source, MeshMotion | SetMotion, tuple[int, ...]]:
    """Return the source in which a mesh is, its motion, and the places there: of a set one for each planet."""
    pairs = len(response.solved.meshes)
    if number < pairs:
        source, mesh, place = response.source_of(number)
        return source, mesh, (place,)
    source = response.of_sets[(number - pairs) // OF_A_SET]
    assert source.of_set is not None
    assert source.of_set.standing is not None
    names = source.of_set.standing.names
    return source, source.of_set, tuple(range((number - pairs) % OF_A_SET, len(names), OF_A_SET))


def amounts(standing: CoherentMeshes, place: int) -> list[str]:
    """Return the amounts that the flanks of a mesh, by its place, can have, and reliefs and twists where they have one.

    Of a flank that carries in meshes before it, none: it is told there. Of half a width, none that differ from end to
    end: these change nothing at first.
    """
    found, half = [], len(standing.load) == len(standing.names)
    for gear, name in enumerate(GEARS):
        flank = standing.flank(place, gear)
        if not standing.told_before(place, gear):
            keys = [key for key in (*AMOUNTS, *FURTHER) if key in AMOUNTS or getattr(flank, key) != 0.0]
            found += [f"{name}.{key}" for key in keys if not (half and key in FROM_END_TO_END)]
    return found


def cycle_with(motion: MeshMotion | SetMotion, places: Sequence[int], parameter: str, step: float) -> MeshCycle:
    """Return the cycle with a further amount of a mesh, um, at the deflection that the machine takes with it.

    Of a set of the meshes of all planets.
    """
    name, _, key = parameter.partition(".")
    gear, standing = GEARS.index(name), motion.standing
    assert standing is not None
    meshes = standing
    for place in places:
        flank, way = standing.flank(place, gear), -1.0 if standing.image(place) and key in FROM_END_TO_END else 1.0
        meshes = meshes.with_flank(place, gear, replace(flank, **{key: getattr(flank, key) + way * step}))
    return cycle_of_flanks(motion, meshes, 1)


def cycle_of_flanks(motion: MeshMotion | SetMotion, meshes: CoherentMeshes, steps: int) -> MeshCycle:
    """Return the cycle of meshes with other flanks, at the deflection that the machine takes with them.

    One step leaves what goes with the square of small amounts, and out of a central difference.
    """
    moved, mean, further = np.zeros(len(meshes.load)), motion.cycle.mean, np.zeros(len(meshes.load))
    for _ in range(steps):
        further = meshes.moved(moved).mean_force() - meshes.load + mean @ moved
        moved = motion.at_rest @ further
    cycle = meshes.moved(moved).cycle()
    cycle.force[0] += mean @ moved - further
    return cycle


def error_rms(cycle: MeshCycle, motion: MeshMotion | SetMotion, places: Sequence[int]) -> float:
    """Return the root mean square of the transmission error of a mesh, by its places, at fixed load, um."""
    assert motion.standing is not None
    each = len(cycle.mean) // len(motion.standing.names)
    moved = np.linalg.solve(cycle.mean, time_invariant(cycle)[1:].T)[each * np.array(places)]
    return float(1e3 * np.sqrt(2.0 * (abs(moved) ** 2).sum() / len(places)))


@dataclass(frozen=True)
class _Adjoint:
    """Solution l and motion x by all harmonics of either sign, (2 K + 1, q), and the root mean square."""

    solution: ComplexArray
    moved: ComplexArray
    rms: float


def _adjoint(
    response: LoadResponse, source: Source, meshes: MeshMotion | SetMotion, target: Target, places: Sequence[int]
) -> _Adjoint:
    speed = int(abs(response.speeds_rpm - target.speed_rpm).argmin())
    receptance = _moving(source, meshes, speed)
    most, size = len(receptance) - 1, receptance.shape[-1]
    matrix, answer = meshes.matrix(receptance), signed(receptance, np.arange(-most, most + 1))
    still = meshes.pressed(meshes.cycle, np.zeros(answer.shape[:2], dtype=complex))
    acting = np.linalg.solve(matrix, still.ravel()).reshape(-1, size) if matrix.size else still
    right, square = np.zeros(acting.shape, dtype=complex), 0.0
    for line, solved in enumerate(_solved(source, meshes)):
        if solved is not None and source.told[speed, line]:
            rows = _rows(response, source, meshes, line, solved, speed, target, places)
            for at, own in ((most + solved[0], rows), (most - solved[0], rows.conj())):
                more = own.conj().T @ own @ acting[at]
                right[at] += more
                square += float(abs(np.vdot(acting[at], more)))
    solution = right
    if matrix.size:
        solution = np.linalg.solve(matrix.conj().T, right.ravel()).reshape(right.shape)
    return _Adjoint(solution, np.einsum("nab,nb->na", answer, acting), math.sqrt(square))


def _at_speed(order: Order, speed: int) -> Order:
    """An order at one of its speeds."""
    return replace(order, speeds=order.speeds[speed : speed + 1])


def _moving(source: Source, meshes: MeshMotion | SetMotion, speed: int) -> ComplexArray:
    """Receptance on the unknowns at a speed, (n + 1, q, q)."""
    if isinstance(meshes, SetMotion):
        return meshes.moving([[_at_speed(order, speed) for order in each] for each in meshes.orders])[0]
    return meshes.moving([_at_speed(order, speed) for order in source.orders])[0]


def _solved(source: Source, meshes: MeshMotion | SetMotion) -> list[tuple[int, int] | None]:
    """Harmonic that is solved, and which of its orders, of each line; seen from a carrier three lines have the same."""
    if isinstance(meshes, MeshMotion):
        return [(harmonic, 0) for harmonic in range(1, source.told.shape[1] + 1)]
    repeats = source.told.shape[1] // max(len(meshes.lines), 1)
    return [place for place in meshes.lines for _ in range(repeats)]


def _rows(
    response: LoadResponse, source: Source, meshes: MeshMotion | SetMotion, line: int, solved: tuple[int, int],
    speed: int, target: Target, places: Sequence[int],
) -> ComplexArray:  # fmt: skip
    """Rows O of a target by the unknowns that act on the closed machine, (..., q)."""
    order, own = _at_speed(source.orders[line], speed), source.ports
    size = len(meshes.still) if isinstance(meshes, SetMotion) else len(meshes.at_rest)
    by = meshes.by[solved] if isinstance(meshes, SetMotion) else np.eye(size, dtype=complex)
    if target.kind == "mesh":
        mean = meshes.of_set.tangent if isinstance(meshes, SetMotion) else meshes.cycle.mean
        forces = (np.eye(size) - mean @ order.ports(own, own)[0]) @ by
        if isinstance(meshes, MeshMotion):
            return np.asarray(forces[[COORDINATES * places[0]]])
        seen = not meshes.of_set.blades.carried or source.sidebands[line][1] == 0
        return np.asarray(seen * meshes.of_set.of_planets(places[0]) @ forces)
    readings = order.readings(own, by.T[:, None])
    if isinstance(meshes, SetMotion) and meshes.of_set.blades.carried:
        one = response.machine.sets[response.of_sets.index(source)]
        readings = one.in_housing(readings)[:, [SIDEBANDS.index(source.sidebands[line][1])]]
    if target.kind == "bearing":
        return np.asarray(response.bearing_forces(readings[:, 0])[:, target.number, :3].T)
    omega = order.order * order.speeds[0]
    return np.asarray(omega * math.sqrt(AIR) * response.machine.surface @ response.housing(readings[:, 0]).T)


def _changed(adjoint: _Adjoint, meshes: MeshMotion | SetMotion, lower: MeshCycle, upper: MeshCycle) -> float:
    """What a micrometre between two cycles does to a target; nothing where the mesh has no part in it."""
    if not adjoint.rms:
        return 0.0
    more = (meshes.pressed(upper, adjoint.moved) - meshes.pressed(lower, adjoint.moved)) / (2.0 * STEP)
    return float(np.vdot(adjoint.solution, more).real) / adjoint.rms
