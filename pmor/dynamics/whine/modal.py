"""Modes of a machine in small motion, and its receptances by these and what they leave at rest.

Modes are those with all meshes closed by their mean tangents, without damping and gyroscopic moments, up to a limit;
what further modes do is their static part, so that the static limit is exact with any number of modes. Gyroscopic
moments act among the modes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve, eigh

from pmor.core.arrays import ComplexArray, FloatArray
from pmor.dynamics.whine.moving import MovingMachine

# Of the energy that a mode's displacements would have one by one: below it a mode is a rotation that nothing holds.
RIGID = 1e-11
# Of the largest square of a frequency: what rounding makes of 0.
ROUNDING = 1e-14
# Of the square of the limit: so far the first mode beyond it is looked for.
BEYOND = 1.5


@dataclass(frozen=True)
class Modes:
    """Natural modes, m of them, rising; n displacements.

    Parameters
    ----------
    square : ndarray, shape (m,)
        Angular frequencies, squared; 0 of rotations that nothing holds.
    shape : ndarray, shape (n, m)
        Of unit modal mass.
    next_square : float
        Of the first mode that is not among them, or less.
    """

    square: FloatArray
    shape: FloatArray
    next_square: float

    @property
    def frequency_Hz(self) -> FloatArray:
        """Natural frequencies, (m,)."""
        return np.asarray(np.sqrt(self.square) / (2.0 * np.pi))


@dataclass(frozen=True)
class Receptance:
    """Displacements of p ports and o further readings under forces on the ports, by modes and what these leave.

    Parameters
    ----------
    modes : Modes
    ports, readings : ndarray, shape (p, m) and (o, m)
        By the modes.
    left_ports, left_readings : ndarray, shape (p, p) and (o, p)
        Static part of all that is not in the modes.
    second_readings : ndarray, shape (o, p)
        What of it grows with the square of the frequency.
    gyroscopic, centrifugal : ndarray, shape (m, m)
        At 1 rad/s; the second adds to the stiffness, with the square of the speed.
    damping_ratio : ndarray, shape (m,)
    """

    modes: Modes
    ports: FloatArray
    readings: FloatArray
    left_ports: FloatArray
    left_readings: FloatArray
    second_readings: FloatArray
    gyroscopic: FloatArray
    centrifugal: FloatArray
    damping_ratio: FloatArray


def closed(machine: MovingMachine, tangent: FloatArray) -> FloatArray:
    """Return the stiffness with all meshes closed by tangents on their coordinates (2 M, 2 M), shape (n, n)."""
    return np.asarray(machine.stiffness + machine.meshes.T @ tangent @ machine.meshes)


def modes_of(machine: MovingMachine, stiffness: FloatArray, highest_Hz: float) -> Modes:
    """Return the modes up to a frequency."""
    free = machine.free
    reduced = free.T @ stiffness @ free
    limit = (2.0 * np.pi * highest_Hz) ** 2
    square, shape = eigh(reduced, subset_by_value=(-np.inf, BEYOND * limit))
    count = int(np.searchsorted(square, limit))
    beyond = float(square[count]) if count < len(square) else BEYOND * limit
    square, shape = square[:count], shape[:, :count]
    rounding = ROUNDING * float(np.diagonal(reduced).max())
    rigid = square < np.maximum(RIGID * (np.diagonal(reduced) @ shape**2), rounding)
    return Modes(np.where(rigid, 0.0, square), free @ shape, beyond)


def receptance_of(
    machine: MovingMachine, stiffness: FloatArray, modes: Modes, ports: FloatArray, readings: FloatArray,
    damping_ratio: float,
) -> Receptance:  # fmt: skip
    """Return the receptance between ports, and of readings.

    Parameters
    ----------
    stiffness : ndarray, shape (n, n)
        With all meshes closed, as the modes have it.
    ports : ndarray, shape (p, n)
        By displacements: coordinates of the meshes, and where else forces act.
    readings : ndarray, shape (o, n)
        By displacements; those of rigid bearings follow (`MovingMachine.reactions`).
    """
    free, rigid = machine.free, modes.square == 0.0
    elastic, by_mass = modes.shape[:, ~rigid], machine.mass @ modes.shape[:, rigid]
    # Rotations that nothing holds get a stiffness; forces that turn them are balanced by their inertia.
    reduced, turning = free.T @ stiffness @ free, free.T @ by_mass
    held = reduced + np.diagonal(reduced).mean() * turning @ turning.T
    force = ports.T - by_mass @ (modes.shape[:, rigid].T @ ports.T)
    factor = cho_factor(held)
    at_rest = free @ cho_solve(factor, free.T @ force)
    second = free @ cho_solve(factor, free.T @ machine.mass @ at_rest)
    inner = stiffness @ modes.shape - machine.mass @ modes.shape * modes.square
    shown = np.concatenate([readings @ modes.shape, machine.reactions(inner)])
    left = np.concatenate([readings @ at_rest, machine.reactions(stiffness @ at_rest - force)])
    pushed = stiffness @ second - machine.mass @ at_rest
    further = np.concatenate([readings @ second, machine.reactions(pushed)])
    participation = ports @ elastic / modes.square[~rigid]
    return Receptance(
        modes, ports @ modes.shape, shown, ports @ at_rest - participation @ (ports @ elastic).T,
        left - shown[:, ~rigid] @ participation.T,
        further - shown[:, ~rigid] @ (participation / modes.square[~rigid]).T,
        modes.shape.T @ machine.gyroscopic @ modes.shape, modes.shape.T @ machine.centrifugal @ modes.shape,
        np.full(len(modes.square), damping_ratio),
    )  # fmt: skip


def truncation(receptance: Receptance, omega: float, reading: int, port: int) -> float:
    """Return by how much a reading under a unit force is missed at an angular frequency, by what modes leave out.

    From the second term of the static part, as the first mode left out has it.
    """
    left = omega**2 * abs(float(receptance.second_readings[reading, port]))
    return left / (1.0 - omega**2 / receptance.modes.next_square)


@dataclass(frozen=True)
class Transfer:
    """Receptances at n frequencies, complex: of ports (n, p, p) and of readings (n, o, p)."""

    ports: ComplexArray
    readings: ComplexArray

    def closed_further(self, tangent: FloatArray) -> Transfer:
        """Return those of a machine whose meshes have more tangent, (p, p)."""
        moved = np.asarray(np.linalg.solve(np.eye(len(tangent)) + self.ports @ tangent, self.ports))
        return Transfer(moved, self.readings @ (np.eye(len(tangent)) - tangent @ moved))


def transfer(receptance: Receptance, omega: FloatArray, spin: FloatArray | None = None) -> Transfer:
    """Return the receptances at angular frequencies (n,).

    Parameters
    ----------
    spin : ndarray, shape (n,), optional
        Angular speeds of the first torque's shaft; without them gyroscopic moments are left out.
    """
    square, ports = receptance.modes.square, receptance.ports
    damping = 2.0 * receptance.damping_ratio * np.sqrt(square) * omega[:, None]
    own = np.asarray(square - omega[:, None] ** 2 + 1j * damping)
    rigid = square == 0.0
    own[:, rigid] = np.inf  # no force of a mesh moves these
    if spin is None:
        answer = np.asarray(ports.T / own[..., None])
    else:
        matrix = np.asarray(1j * (omega * spin)[:, None, None] * receptance.gyroscopic)
        matrix += (spin**2)[:, None, None] * receptance.centrifugal
        own[:, rigid] = 1.0
        matrix[:, rigid] = matrix[:, :, rigid] = 0.0
        matrix[:, np.arange(len(square)), np.arange(len(square))] += own
        answer = np.asarray(np.linalg.solve(matrix, np.where(rigid, 0.0, ports).T))
    return Transfer(ports @ answer + receptance.left_ports, receptance.readings @ answer + receptance.left_readings)
