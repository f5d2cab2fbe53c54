"""Receptances along an order: at frequencies that go with the speed.

Along the order r the frequency is r W, W the speed, and modes with their gyroscopic moments

    diag(s) - (r W)^2 + i r W^2 G = diag(s) - W^2 B,    B = r^2 - i r G,

are one Hermitian problem for all speeds: its eigenvalues are the squares of the speeds at which the order meets a mode,
exactly and forwards and backwards whirl apart.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import eigh

from pmor.core.arrays import BoolArray, ComplexArray, FloatArray
from pmor.dynamics.whine.modal import Receptance


@dataclass(frozen=True)
class Order:
    """Receptances along an order at S speeds, by m modes that spin.

    Parameters
    ----------
    order : float
        Frequency over that of the first torque's shaft.
    speeds : ndarray, shape (S,)
        rad/s.
    resonance : ndarray, shape (m,)
        Speed at which the order meets each mode, rad/s.
    mixed : ndarray of complex, shape (m', m)
        Modes by those at rest, m' with rotations that nothing holds.
    """

    receptance: Receptance
    order: float
    speeds: FloatArray
    resonance: FloatArray
    mixed: ComplexArray

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
        ratio = 2.0 * self.receptance.damping_ratio[-len(self.resonance) :]
        stiff = self.resonance**2 - self.speeds[:, None] ** 2
        found = 1.0 / (stiff + 1j * ratio * self.resonance * self.speeds[:, None])
        return np.asarray(np.where(self.within[:, None], found, 0.0))

    @property
    def within(self) -> BoolArray:
        """Speeds at which the order is below the highest mode, (S,)."""
        return np.asarray(self.order * self.speeds <= np.sqrt(self.receptance.modes.square.max()))

    def ports(self, own: slice) -> ComplexArray:
        """Return the receptance of q of the ports, (S, q, q)."""
        by = self.by_ports[own]
        products = (by[:, None] * by.conj()).reshape(-1, by.shape[1])
        moving = (self.amplification @ products.T).reshape(-1, len(by), len(by))
        return np.asarray(moving + self.within[:, None, None] * self.receptance.left_ports[own, own])

    def modal(self, own: slice, force: ComplexArray) -> ComplexArray:
        """Return the amplitudes of the modes under forces on q of the ports, (..., S, q): shape (..., S, m)."""
        return np.asarray(self.amplification * (force @ self.by_ports[own].conj()))

    def readings(self, own: slice, force: ComplexArray) -> ComplexArray:
        """Return the readings under forces on q of the ports, (..., S, q): shape (..., S, o)."""
        left = self.within[:, None] * (force @ self.receptance.left_readings[:, own].T)
        return np.asarray(self.modal(own, force) @ self.by_readings.T + left)


def along(receptance: Receptance, order: float, speeds: FloatArray, sense: float) -> Order:
    """Return the receptances along an order; `sense` is that of the first torque's shaft."""
    square = receptance.modes.square
    elastic = np.flatnonzero(square > 0.0)
    gyroscopic = receptance.gyroscopic[np.ix_(elastic, elastic)]
    inertia = order**2 * np.eye(len(elastic)) - 1j * sense * order * gyroscopic
    found, shape = eigh(np.diag(square[elastic]).astype(complex), inertia)
    mixed = np.zeros((len(square), len(elastic)), dtype=complex)
    mixed[elastic] = shape
    return Order(receptance, order, speeds, np.sqrt(found), mixed)
