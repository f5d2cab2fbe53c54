"""Quantities of the motion of a pair: transmission error, mesh force, forces on bearings, loss of contact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.dynamics.gear_model import GearModel
from pmor.dynamics.harmonic_balance import Balance, harmonics_of, rms
from pmor.dynamics.oscillator import motion_of, position_under

# Orders of the dynamic transmission error that are kept.
ORDERS = 10
# mm to um
UM = 1e3


@dataclass(frozen=True)
class Cycle:
    """Periodic motion over its period."""

    phase: FloatArray  # shape (s,): Of the mesh, rad
    # shape (s,): Along the line of action, mm, mm/s, N
    displacement: FloatArray
    velocity: FloatArray
    force: FloatArray
    bearing: FloatArray  # shape (s, 2, 3): Forces of both gears on their bearings along x, y, z, N
    positions: FloatArray  # shape (s, n - 1): Of the supports, mm


@dataclass(frozen=True)
class PointQuantities:
    """Quantities of a point of a branch."""

    # Dynamic transmission error about its mean
    dte_rms_um: float
    dte_peak_to_peak_um: float
    dte_orders_um: tuple[float, ...]  # Amplitudes of the first orders of the mesh frequency, zero to peak
    # The order of the largest amplitude, broken where motion takes several mesh cycles, and that amplitude
    dominant_order: float
    dominant_order_um: float
    # Of the mesh, along the transverse line of action; below 0 the coast flanks push
    largest_force_N: float
    smallest_force_N: float
    dynamic_factor: float  # Largest mesh force over the mean one
    contact_loss: float  # Share of the cycle without any contact
    separation_um: float  # How far the flanks part at most, from where those of the drawing touch; 0: not at all
    bearing_force_N: tuple[float, float]  # Largest transverse force of pinion and wheel on their bearings


def cycle_of(model: GearModel, balance: Balance, unknowns: FloatArray, speed: float) -> Cycle:
    """Return the motion over its period that harmonic balance found at an angular mesh frequency."""
    oscillator, force = balance.oscillator, balance.forces(unknowns)[0][0]
    states = _states(balance, unknowns, speed, force)
    lever = oscillator.lever
    return Cycle(
        phase=balance.phase, displacement=states[:, : oscillator.size] @ lever,
        velocity=states[:, oscillator.size :] @ lever, force=force,
        bearing=model.bearing_forces(oscillator, states, force), positions=states[:, 1 : oscillator.size],
    )  # fmt: skip


def quantities(model: GearModel, balance: Balance, unknowns: FloatArray, speed: float) -> PointQuantities:
    """Return the quantities of a point of a branch; arguments as in `cycle_of`."""
    cycle = cycle_of(model, balance, unknowns, speed)
    amplitudes = UM * np.hypot(unknowns[1::2], unknowns[2::2])
    largest = int(amplitudes.argmax())
    across = np.hypot(cycle.bearing[:, :, 0], cycle.bearing[:, :, 1]).max(axis=0)
    return PointQuantities(
        dte_rms_um=UM * float(rms(unknowns)),
        dte_peak_to_peak_um=UM * float(np.ptp(cycle.displacement)),
        dte_orders_um=tuple(amplitudes[balance.cycles - 1 :: balance.cycles][:ORDERS].tolist()),
        dominant_order=(largest + 1) / balance.cycles,
        dominant_order_um=float(amplitudes[largest]),
        largest_force_N=float(cycle.force.max()),
        smallest_force_N=float(cycle.force.min()),
        dynamic_factor=float(cycle.force.max() / cycle.force.mean()),
        contact_loss=float((cycle.force == 0.0).mean()),
        separation_um=UM * max(0.0, -float(cycle.displacement.min())),
        bearing_force_N=(float(across[0]), float(across[1])),
    )


def _states(balance: Balance, unknowns: FloatArray, speed: float, force: FloatArray) -> FloatArray:
    """Displacements and velocities of all degrees of freedom at the phases of a balance, (s, 2n)."""
    oscillator, samples = balance.oscillator, len(balance.phase)
    coefficients = harmonics_of(force, balance.orders)
    frequency = speed * np.arange(1, balance.orders + 1) / balance.cycles
    moved = motion_of(oscillator, frequency, (coefficients[1::2] - 1j * coefficients[2::2])[:, None])
    spectrum = np.zeros((2, samples // 2 + 1, oscillator.size), dtype=complex)
    spectrum[0, 0] = samples * position_under(oscillator, coefficients[:1], unknowns[:1])
    spectrum[0, 1 : balance.orders + 1] = 0.5 * samples * moved
    spectrum[1, 1 : balance.orders + 1] = 0.5 * samples * 1j * frequency[:, None] * moved
    return np.asarray(np.hstack(list(np.fft.irfft(spectrum, samples, axis=1))))
