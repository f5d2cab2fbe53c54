"""Receptances along an order: at frequencies that go with the speed.

Along the order r the frequency is r W, W the speed, and modes with their gyroscopic moments and centrifugal
forces

    diag(s) - (r W)^2 + i r W^2 G + W^2 C = diag(s) - W^2 B,    B = r^2 - i r G - C,

are one Hermitian problem for all speeds, B v = v / W_n^2 diag(s): W_n are the speeds at which the order meets a mode,
forwards and backwards whirl apart; there is none where 1 / W_n^2 is negative.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import eigh

from pmor.core.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from pmor.dynamics.whine.modal import Receptance

# Some of the ports.
Ports = slice | IntArray


@dataclass(frozen=True)
class Order:
    """Receptances along an order at S speeds, by m modes that spin.

    Parameters
    ----------
    order : float
        Frequency over that of the first torque's shaft.
    speeds : ndarray, shape (S,)
        rad/s.
    inverse : ndarray, shape (m,)
        1 / W_n^2.
    mixed : ndarray of complex, shape (m', m)
        Modes by those at rest, m' with rotations that nothing holds; of unit strain energy, twice.
    """

    receptance: Receptance
    order: float
    speeds: FloatArray
    inverse: FloatArray
    mixed: ComplexArray

    @property
    def resonance(self) -> FloatArray:
        """Speeds at which the order meets each mode, (m,), rad/s; NaN where it meets none."""
        return np.asarray(1.0 / np.sqrt(np.where(self.inverse > 0.0, self.inverse, np.nan)))

    @cached_property
    def by_ports(self) -> ComplexArray:
        """Participation of the ports, (p, m)."""
        return np.asarray(self.receptance.ports @ self.mixed)

    @cached_property
    def by_readings(self) -> ComplexArray:
        """Readings of each mode, (o, m)."""
        return np.asarray(self.receptance.readings @ self.mixed)

    @cached_property
    def amplification(self) -> ComplexArray:
        """Answer of each mode to a unit of its load, (S, m); none beyond the highest mode, rather than as at rest."""
        ratio, speeds = 2.0 * self.receptance.damping_ratio[-len(self.inverse) :], self.speeds[:, None]
        damping = ratio * np.sqrt(np.maximum(self.inverse, 0.0)) * speeds
        found = 1.0 / (1.0 - self.inverse * speeds**2 + 1j * damping)
        return np.asarray(np.where(self.within[:, None], found, 0.0))

    @property
    def within(self) -> BoolArray:
        """Speeds at which the order is below the highest mode, (S,)."""
        return np.asarray(self.order * self.speeds <= np.sqrt(self.receptance.modes.square.max(initial=0.0)))

    def ports(self, told: Ports, acting: Ports) -> ComplexArray:
        """Return displacements of some ports under unit forces on others, (S, p, q)."""
        by, under = self.by_ports[told], self.by_ports[acting].conj()
        products = (by[:, None] * under).reshape(len(by) * len(under), by.shape[1])
        moving = (self.amplification @ products.T).reshape(len(self.speeds), len(by), len(under))
        return np.asarray(moving + self.within[:, None, None] * self.receptance.left_ports[told][:, acting])

    def modal(self, own: Ports, force: ComplexArray) -> ComplexArray:
        """Return the amplitudes of the modes under forces on q of the ports, (..., S, q): shape (..., S, m)."""
        return np.asarray(self.amplification * (force @ self.by_ports[own].conj()))

    def readings(self, own: Ports, force: ComplexArray) -> ComplexArray:
        """Return the readings under forces on q of the ports, (..., S, q): shape (..., S, o)."""
        left = self.within[:, None] * (force @ self.receptance.left_readings[:, own].T)
        return np.asarray(self.modal(own, force) @ self.by_readings.T + left)


def along(receptance: Receptance, order: float, speeds: FloatArray, sense: float) -> Order:
    """Return the receptances along an order; `sense` is that of the first torque's shaft."""
    square = receptance.modes.square
    elastic = np.flatnonzero(square > 0.0)
    among, root = np.ix_(elastic, elastic), np.sqrt(square[elastic])
    turning = 1j * sense * order * receptance.gyroscopic[among] + receptance.centrifugal[among]
    inertia = (order**2 * np.eye(len(root)) - turning) / np.outer(root, root)
    inverse, shape = eigh(inertia)
    mixed = np.zeros((len(square), len(elastic)), dtype=complex)
    mixed[elastic] = shape / root[:, None]
    return Order(receptance, order, speeds, inverse, mixed)


def spinning_Hz(receptance: Receptance, speeds: FloatArray, highest_Hz: float) -> FloatArray:
    """Return the natural frequencies below a limit at speeds (S,), rad/s: rising, (S, m); NaN where motion grows.

    With gyroscopic moments and centrifugal forces among these modes: whirl forwards and backwards apart.
    """
    square = receptance.modes.square
    own = np.flatnonzero((square > 0.0) & (square < (2.0 * np.pi * highest_Hz) ** 2))
    among, count, found = np.ix_(own, own), len(own), np.full((len(speeds), len(own)), np.nan)
    for place, speed in enumerate(speeds):
        try:
            root = np.linalg.cholesky(np.diag(square[own]) + speed**2 * receptance.centrifugal[among])
        except np.linalg.LinAlgError:
            continue
        # Of root^T q and velocities: skew, so that frequencies are real.
        turning = np.block([[np.zeros((count, count)), root.T], [-root, -speed * receptance.gyroscopic[among]]])
        found[place] = np.linalg.eigvalsh(1j * turning)[count:] / (2.0 * np.pi)
    return found
