"""Coordinates of planets that stand still as the carrier turns: multi-blade (Coleman & Feingold, NACA TN 3844, 1957).

A value x_n of planet n, which is at psi_n + W t, is put together from as many as there are planets,

    x_n = p_0 + p_c cos(psi_n + W t) + p_s sin(psi_n + W t) + what is even less alike from planet to planet,         (1)

x = B(t) p, B' = W B S. What is the same for all planets goes with the axis, cos and sin with motion across it, and
the rest, as + - + - of four planets, moves no central member. Equations in p have constants where planets are equal
and evenly spaced, three at least, whatever central members stand on.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import null_space

from pmor.core.arrays import ComplexArray, FloatArray
from pmor.sets.plan import LEAST_PLANETS, evenly_spaced

# Families of modes: what is alike in all planets, goes as cos and sin, and the rest.
FAMILIES = ("rotational", "translational", "planet")
# Orders of the carrier's turn at which a line of the meshes arrives in the housing.
SIDEBANDS = (-1, 0, 1)


@dataclass(frozen=True)
class Blades:
    """Planets around their carrier.

    Parameters
    ----------
    directions : ndarray, shape (N,)
        psi_n, rad.
    carried : bool
        Whether all is seen from the carrier, each planet by itself: S = 0. That has constants with any planets where
        what central members stand on is alike all around.
    """

    directions: FloatArray
    carried: bool = False

    @property
    def count(self) -> int:
        """N."""
        return len(self.directions)

    @property
    def even(self) -> bool:
        """Whether planets are enough and evenly spaced: (1) has constants."""
        return evenly_spaced(self.directions)

    @property
    def alone(self) -> bool:
        """Whether coordinates are those of each planet by itself."""
        return self.carried or self.count < LEAST_PLANETS

    @cached_property
    def matrix(self) -> FloatArray:
        """B at time 0, (N, N); of less than three planets each one by itself."""
        if self.alone:
            return np.eye(self.count)
        first = np.column_stack([np.ones(self.count), np.cos(self.directions), np.sin(self.directions)])
        return np.column_stack([first, null_space(first.T)])

    def at(self, angle: float) -> FloatArray:
        """B at an angle W t, (N, N)."""
        return np.asarray(sum(np.exp(1j * order * angle) * part for order, part in self.by_order.items()).real)

    @cached_property
    def turning(self) -> FloatArray:
        """S, (N, N)."""
        found = np.zeros((self.count, self.count))
        if not self.alone:
            found[1, 2], found[2, 1] = 1.0, -1.0
        return found

    @cached_property
    def by_order(self) -> dict[int, ComplexArray]:
        """Parts of B that go with exp(i j W t), by j, (N, N)."""
        found = {order: np.zeros((self.count, self.count), dtype=complex) for order in SIDEBANDS}
        if self.alone:
            found[0] += self.matrix
            return found
        found[0][:, [0, *range(3, self.count)]] = self.matrix[:, [0, *range(3, self.count)]]
        around = np.exp(1j * self.directions)
        found[1][:, 1:3] = 0.5 * np.outer(around, [1.0, -1j])
        found[-1] = found[1].conj()
        return found

    @cached_property
    def family(self) -> tuple[int, ...]:
        """Family of each coordinate p, by its number."""
        if self.alone:
            return (0,) * self.count
        return (0, 1, 1) + (2,) * (self.count - LEAST_PLANETS)
