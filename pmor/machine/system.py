"""Equilibrium of shafts on bearings: beams, springs, rolling bearings, rigid supports and the forces of gear meshes.

Displacements u of all nodes minimise the elastic energy under the constraints C u = 0, whose multipliers are the
reactions: of rigid bearings, of a shaft that is held, and of gear meshes. A mesh is rigid along its common normal, so
that its multiplier is its force.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve, null_space

from pmor.body.rolling_bearing import BearingState, RollingBearing
from pmor.core.arrays import BoolArray, FloatArray
from pmor.core.errors import ConvergenceError, GeometryError

MOST_STEPS = 200
# Of the largest force: the sums over all rolling elements do not come closer than this.
EQUILIBRIUM = 1e-10
# Stiffness of a free direction over the largest one, in coordinates of like size.
FREE = 1e-13
# Arm that turns rotations into displacements of like size, mm.
ARM = 100.0
# Displacements of an inner ring in units of like size.
UNITS = np.array([1.0, 1.0, 1.0, 1.0 / ARM, 1.0 / ARM])
# Displacement of an inner ring at which any bearing carries, mm and rad.
PRESSED = np.array([10.0, 10.0, 10.0, 0.05, 0.05])
# Springs that stand in for rolling bearings in the first guess, N/mm.
FIRST_GUESS = 1e5


class Seat(NamedTuple):
    """A rolling bearing between nodes.

    Attributes
    ----------
    rows : ndarray, shape (5, n)
        Displacement of the inner ring against the outer one, of the displacements of all nodes.
    """

    rows: FloatArray
    bearing: RollingBearing


@dataclass(frozen=True)
class System:
    """Shafts on their supports, n displacements.

    Parameters
    ----------
    stiffness : ndarray, shape (n, n)
        Of beams and springs.
    constraints : ndarray, shape (m, n)
        C.
    names : sequence of str
        Of the displacements, for messages.
    rotations : ndarray of bool, shape (n,)
    """

    stiffness: FloatArray
    seats: Sequence[Seat]
    constraints: FloatArray
    names: Sequence[str]
    rotations: BoolArray


class Equilibrium(NamedTuple):
    """Solution of a system.

    Attributes
    ----------
    displacement : ndarray, shape (n,)
        mm and rad.
    reactions : ndarray, shape (m,)
        Multipliers of the constraints: the forces C^T reactions act on the nodes.
    """

    displacement: FloatArray
    reactions: FloatArray
    bearings: tuple[BearingState, ...]


def solve_system(system: System, load: FloatArray) -> Equilibrium:
    """Solve the equilibrium under forces and moments on all nodes, shape (n,), by Newton's method.

    Steps that would raise the unbalanced force are shortened by a stiffness that is added to all directions (Levenberg
    1944).

    Raises
    ------
    GeometryError
        When a shaft can move away.
    ConvergenceError
        When no equilibrium is found.
    """
    scale = np.where(system.rotations, 1.0 / ARM, 1.0)
    free = null_space(system.constraints * scale) if len(system.constraints) else np.eye(len(load))
    basis = scale[:, None] * free
    _refuse_loose(system, basis)
    force = basis.T @ load
    size = max(float(np.abs(force).max()), 1e-12)
    guess = system.stiffness + sum(
        (FIRST_GUESS * s.rows.T @ s.rows for s in system.seats), np.zeros_like(system.stiffness)
    )
    place = np.linalg.solve(basis.T @ guess @ basis, force)
    added, history = 0.0, []
    residual, tangent, states = _unbalanced(system, basis, place, force)
    for _ in range(MOST_STEPS):
        worst = float(np.abs(residual).max()) / size
        history.append((worst,))
        if worst < EQUILIBRIUM or not system.seats:
            displacement = basis @ place
            inner = system.stiffness @ displacement
            for seat, state in zip(system.seats, states, strict=True):
                inner = inner + seat.rows.T @ state.force
            reactions = np.linalg.lstsq((system.constraints * scale).T, scale * (inner - load), rcond=None)[0]
            return Equilibrium(np.asarray(displacement), np.asarray(reactions), states)
        step = _solved(tangent, added, residual)
        tried = _unbalanced(system, basis, place + step, force)
        # Of a convex energy, a step that still goes downhill at its end lowers it: a shaft falls in its clearance.
        if np.linalg.norm(tried[0]) < np.linalg.norm(residual) or tried[0] @ step >= 0.0:
            place, (residual, tangent, states) = place + step, tried
            added = 0.0 if added < 1e-9 * np.trace(tangent) else 0.1 * added
        else:
            added = max(4.0 * added, 1e-6 * float(np.trace(tangent)) / len(tangent))
    raise ConvergenceError(_unheld(system, basis @ place, history[-1][0]), history)


def _unheld(system: System, moved: FloatArray, left: float) -> str:
    """Say why there is no equilibrium by how far all moved: bearings that hold one way let a shaft go the other way."""
    most = int(np.abs(moved).argmax())
    if abs(moved[most]) > PRESSED[0]:
        way = "positive" if moved[most] > 0.0 else "negative"
        return (
            f"{system.names[most]}: nothing holds it in {way} direction, and loads or its own bearings push it there: "
            "turn one of its bearings that take thrust one way alone around (the sign of contact_angle_deg), or add one"
        )
    return (
        f"shafts and bearings: no equilibrium after {MOST_STEPS} steps, {left:.2g} of the load is left: check "
        "clearances, and whether each shaft is located along its axis"
    )


def _unbalanced(
    system: System, basis: FloatArray, place: FloatArray, force: FloatArray
) -> tuple[FloatArray, FloatArray, tuple[BearingState, ...]]:
    displacement = basis @ place
    inner = system.stiffness @ displacement
    states = tuple(seat.bearing.state(seat.rows @ displacement) for seat in system.seats)
    for seat, state in zip(system.seats, states, strict=True):
        inner += seat.rows.T @ state.force
    return force - basis.T @ inner, basis.T @ tangent_of(system, states) @ basis, states


def tangent_of(system: System, states: Sequence[BearingState]) -> FloatArray:
    """Return the stiffness of beams, springs and rolling bearings in some states, shape (n, n)."""
    tangent = system.stiffness.copy()
    for seat, state in zip(system.seats, states, strict=True):
        tangent += seat.rows.T @ state.stiffness @ seat.rows
    return tangent


def _solved(tangent: FloatArray, added: float, residual: FloatArray) -> FloatArray:
    while True:
        try:
            return np.asarray(cho_solve(cho_factor(tangent + added * np.eye(len(tangent))), residual))
        except np.linalg.LinAlgError:
            added = max(4.0 * added, 1e-9 * float(np.trace(tangent)) / len(tangent))


def _refuse_loose(system: System, basis: FloatArray) -> None:
    """Refuse a system in which a shaft moves away without any force, bearings taken as pressed together."""
    held = system.stiffness.copy()
    for seat in system.seats:
        pressed = np.abs(seat.bearing.state(PRESSED).stiffness).sum(axis=1) > 0.0
        held += FIRST_GUESS * seat.rows[pressed].T @ seat.rows[pressed]
    values, vectors = np.linalg.eigh(basis.T @ held @ basis)
    if len(values) and values[0] < FREE * values[-1]:
        moved = np.abs(basis @ vectors[:, 0])  # mm beside rad: a shaft that screws is one that slides
        raise GeometryError(
            f"{system.names[int(moved.argmax())]}: nothing holds it: add a bearing, or give one of its bearings a "
            'stiffness or "rigid" in this direction'
        )
