"""Small motion of a mesh that repeats after several pitches: teeth out of place, eccentric gears, holes, waves.

Over p pitches a mesh has lines k / p of its frequency, orders of the shafts among them. Stiffness k of the mean pitch
couples lines that are p apart: each remainder of k by p is a problem of its own, (1) of `pmor.dynamics.whine.hill`, of
the size that one pitch has. What pitches differ by, r, couples all of them. With M the equations of all remainders,

    (M + r H) f = w,    (1 + r H M^-1) y = w,    f = M^-1 y,                                                        (1)

which is solved for y by conjugate residuals (Eisenstat, Elman, Schultz, SIAM J. Numer. Anal. 20 (1983) 345), all
speeds at once, with products r x sample by sample.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.fft import next_fast_len

from pmor.core.arrays import ComplexArray, FloatArray, IntArray
from pmor.core.errors import ConvergenceError
from pmor.dynamics.whine.hill import MeshCycle, closing, hill, signed

# Of the right-hand side, what is left of it; steps until then, at most.
LEFT, MOST_STEPS = 1e-11, 200
# Of the mean stiffness: pitches that differ by round-off.
ALIKE = 1e-13
# Memory of the speeds that are solved at a time.
MOST_BYTES = 2e8


@dataclass(frozen=True)
class Remainders:
    """Lines by what their number k leaves when divided by the pitches; C remainders of m lines each.

    Parameters
    ----------
    orders : ndarray of int, shape (C, m)
        k, of either sign.
    inverse : ndarray of complex, shape (S, C, m q, m q)
        Of M.
    """

    orders: IntArray
    inverse: ComplexArray

    def add(self, right: ComplexArray, found: ComplexArray) -> None:
        """Write M^-1 of a right-hand side (S, N + 1, q) into what is found of these lines."""
        taken = signed(right, self.orders, 1)
        solved = (self.inverse @ taken.reshape(*self.inverse.shape[:-1], 1)).reshape(taken.shape)
        found[:, abs(self.orders)] = np.where((self.orders < 0)[..., None], solved.conj(), solved)


@dataclass(frozen=True)
class PitchEquations:
    """Equation (1) at S speeds; lines 0 to N = K p of a real motion.

    Parameters
    ----------
    cycle : MeshCycle
    receptance : ndarray of complex, shape (S, N + 1, q, q)
        H at all lines.
    closed_by : ndarray, shape (q, q), optional
        Mean tangent that closes the machine, where it is another one.
    """

    cycle: MeshCycle
    receptance: ComplexArray
    closed_by: FloatArray | None = None

    @property
    def lines(self) -> int:
        """N + 1."""
        return self.receptance.shape[1]

    @cached_property
    def remainders(self) -> tuple[Remainders, ...]:
        """Those of 0 and of 1 to p / 2; others are their conjugates."""
        pitches, most = self.cycle.pitches, (self.lines - 1) // self.cycle.pitches
        whole = pitches * np.arange(-most, most + 1)[None]
        others = np.arange(1, pitches // 2 + 1)[:, None] + pitches * np.arange(-most, most)
        return tuple(self._of(orders) for orders in (whole, others) if orders.size)

    def _of(self, orders: IntArray) -> Remainders:
        varying = self.cycle.beside(orders[0], self.closed_by)
        matrices = closing(varying, signed(self.receptance, orders, 1))
        return Remainders(orders, np.asarray(np.linalg.inv(matrices), dtype=complex))

    @cached_property
    def uneven(self) -> FloatArray:
        """What pitches differ by, r, over samples as products of lines need, (L, q, q); empty where by round-off."""
        harmonics = self.cycle.tangent.copy()
        harmonics[:: self.cycle.pitches] = 0.0
        if np.abs(harmonics).max() <= ALIKE * np.abs(self.cycle.mean).max():
            return np.zeros((0, *self.cycle.mean.shape))
        return _over_time(harmonics[None], _samples(self.lines))[0]

    def solve(self, right: ComplexArray) -> ComplexArray:
        """Return f of (1) for right-hand sides (S, N + 1, q).

        Raises
        ------
        ConvergenceError
        """
        if not len(self.uneven):
            return self._by_remainders(right)

        def coupled(y: ComplexArray) -> ComplexArray:
            moved = np.einsum("snab,snb->sna", self.receptance, self._by_remainders(y))
            return y + _product(self.uneven, moved)

        return self._by_remainders(least_residual(coupled, right))

    def _by_remainders(self, right: ComplexArray) -> ComplexArray:
        found = np.zeros_like(right)
        for one in self.remainders:
            one.add(right, found)
        return found


def over_pitches(cycle: MeshCycle, receptance: ComplexArray, closed_by: FloatArray | None = None) -> ComplexArray:
    """Return the forces f_n on the closed machine at all lines of a cycle of one or several pitches, (S, N + 1, q).

    As `hill`, with receptances at all lines, (S, N + 1, q, q).

    Raises
    ------
    ConvergenceError
    """
    if cycle.pitches == 1:
        return hill(cycle, receptance, closed_by)
    speeds, lines, size = receptance.shape[:3]
    of_a_speed = 16 * (2 * lines * size) ** 2 / cycle.pitches
    step, right = max(int(MOST_BYTES / of_a_speed), 1), cycle.force[None, :lines]
    found = [
        PitchEquations(cycle, receptance[first : first + step], closed_by).solve(
            np.repeat(right, min(step, speeds - first), axis=0)
        ) for first in range(0, speeds, step)
    ]  # fmt: skip
    return np.concatenate(found)


def time_invariant(cycle: MeshCycle) -> ComplexArray:
    """Return the forces f_n of meshes of constant stiffness, by their transmission error at fixed load, (N + 1, P).

    Those of a machine that gives way as the meshes do in the mean.
    """
    by_mean = np.linalg.inv(cycle.mean).astype(complex)
    return np.asarray(over_pitches(cycle, np.broadcast_to(by_mean, (1, len(cycle.force), *by_mean.shape)))[0])


def least_residual(product: Callable[[ComplexArray], ComplexArray], right: ComplexArray) -> ComplexArray:
    """Return y of A y = w for many systems at once, (S, N + 1, q), by generalised conjugate residuals.

    Raises
    ------
    ConvergenceError
        Where some are not solved after `MOST_STEPS`.
    """
    found, left, most = np.zeros_like(right), right.copy(), LEFT * np.sqrt(_dot(right, right))
    directions, products = list[ComplexArray](), list[ComplexArray]()
    for _ in range(MOST_STEPS):
        if (np.sqrt(_dot(left, left)) <= most).all():
            return found
        direction, moved = left, product(left)
        for before, its_own in zip(directions, products, strict=True):
            share = _dot(its_own, moved)[:, None, None]
            direction, moved = direction - share * before, moved - share * its_own
        size = np.sqrt(_dot(moved, moved))[:, None, None]
        size = np.where(size > 0.0, size, 1.0)
        direction, moved = direction / size, moved / size
        step = _dot(moved, left)[:, None, None]
        found, left = found + step * direction, left - step * moved
        directions.append(direction)
        products.append(moved)
    raise ConvergenceError(f"lines over several pitches were not found in {MOST_STEPS} steps", [])


def _dot(one: ComplexArray, other: ComplexArray) -> FloatArray:
    """Real product of motions by their lines, (S,)."""
    return np.asarray(np.einsum("snq,snq->s", one.conj(), other).real)


def _samples(lines: int) -> int:
    """Samples in which a product of lines with a tangent folds back on none of them."""
    return int(next_fast_len(4 * lines, real=True))


def _product(over_time: FloatArray, moved: ComplexArray) -> ComplexArray:
    """Lines of matrices over time (L, q, q) by motion (S, N + 1, q)."""
    samples = len(over_time)
    product = np.einsum("lab,slb->sla", over_time, _over_time(moved, samples))
    return np.asarray(np.fft.rfft(product, axis=1)[:, : moved.shape[1]] / samples)


def _over_time(lines: ComplexArray, samples: int) -> FloatArray:
    """Real signals by their lines (S, K, ...) over so many samples, (S, samples, ...)."""
    return np.asarray(np.fft.irfft(lines * samples, samples, axis=1))
