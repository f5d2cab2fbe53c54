"""Receptances along an order: at frequencies that go with the speed.

Along the order r the frequency is r W, W the speed, and modes with their gyroscopic moments

    diag(s) - (r W)^2 + i r W^2 G = diag(s) - W^2 B,    B = r^2 - i r G,

are one Hermitian problem for all speeds: its eigenvalues are the squares of the speeds at which the order meets a mode,
exactly and forwards and backwards whirl apart.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from pmor.core.arrays import ComplexArray, FloatArray
from pmor.dynamics.whine.modal import Receptance


@dataclass(frozen=True)
class Order:
    """Receptances along an order, by m modes that spin.

    Parameters
    ----------
    order : float
        Frequency over that of the first torque's shaft.
    speed : ndarray, shape (m,)
        At which the order meets each mode, rad/s.
    mixed : ndarray of complex, shape (m', m)
        Modes by those at rest, m' with rotations that nothing holds.
    """

    receptance: Receptance
    order: float
    speed: FloatArray
    mixed: ComplexArray

    @property
    def by_ports(self) -> ComplexArray:
        """Participation of the ports, (p, m)."""
        return np.asarray(self.receptance.ports @ self.mixed)

    @property
    def by_readings(self) -> ComplexArray:
        """Readings of each mode, (o, m)."""
        return np.asarray(self.receptance.readings @ self.mixed)

    def amplification(self, speeds: FloatArray) -> ComplexArray:
        """Return the answer of each mode to a unit of its load at speeds (S,), rad/s, shape (S, m)."""
        ratio = 2.0 * self.receptance.damping_ratio[: len(self.speed)]
        damping = ratio * self.speed * speeds[:, None]
        return np.asarray(1.0 / (self.speed**2 - speeds[:, None] ** 2 + 1j * damping))

    def ports(self, speeds: FloatArray, own: slice) -> ComplexArray:
        """Return the receptance of some ports at speeds (S,), shape (S, q, q)."""
        by = self.by_ports[own]
        found = np.einsum("am,sm,bm->sab", by, self.amplification(speeds), by.conj(), optimize=True)
        return np.asarray(self._within(speeds)[:, None, None] * (found + self.receptance.left_ports[own, own]))

    def modal(self, speeds: FloatArray, own: slice, force: ComplexArray) -> ComplexArray:
        """Return the amplitudes of the modes under forces on some ports, (S, q): shape (S, m)."""
        return np.asarray(self.amplification(speeds) * (force @ self.by_ports[own].conj()))

    def readings(self, speeds: FloatArray, own: slice, force: ComplexArray) -> ComplexArray:
        """Return the readings under forces on some ports at speeds (S,), shape (S, o)."""
        left = force @ self.receptance.left_readings[:, own].T
        found = self.modal(speeds, own, force) @ self.by_readings.T + left
        return np.asarray(self._within(speeds)[:, None] * found)

    def _within(self, speeds: FloatArray) -> FloatArray:
        """1 up to the highest mode; beyond it nothing moves, rather than as at rest."""
        return np.where(self.order * speeds <= np.sqrt(self.receptance.modes.square.max()), 1.0, 0.0)


def along(receptance: Receptance, order: float, sense: float) -> Order:
    """Return the receptances along an order; `sense` is that of the first torque's shaft."""
    square = receptance.modes.square
    elastic = np.flatnonzero(square > 0.0)
    gyroscopic = receptance.gyroscopic[np.ix_(elastic, elastic)]
    inertia = order**2 * np.eye(len(elastic)) - 1j * sense * order * gyroscopic
    speed, shape = eigh(np.diag(square[elastic]).astype(complex), inertia)
    mixed = np.zeros((len(square), len(elastic)), dtype=complex)
    mixed[elastic] = shape
    return Order(receptance, order, np.sqrt(speed), mixed)
