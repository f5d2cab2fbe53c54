"""Periodic motion by harmonic balance, the mesh force found by alternating between frequency and time.

The mesh acts in one direction, so that the equations of all degrees of freedom come down to one per harmonic of the
displacement x along the line of action: with x = sum of x_k exp(i k psi / p) over the period of p mesh cycles,

    d(k w / p) x_k + F_k(x) = f_k,                                                                               (1)

d the dynamic stiffness that the mesh feels (`oscillator`), F_k the harmonics of F(psi, x(psi)), w the mesh frequency.
A machine, which is held in all its modes, is solved by receptances, x_k + H(k w / p) (F_k(x) - f_k) = c_k, c_k its
coordinates under the mean load: modes may move fewer coordinates than there are. The unknowns are real: mean, then
cosine and sine of each harmonic (Cameron & Griffin, J. Appl. Mech. 56 (1989) 149).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from pmor.core.arrays import BoolArray, ComplexArray, FloatArray
from pmor.core.errors import ConvergenceError
from pmor.dynamics.force_law import ForceLaw, MachineLaw, centre_of, coordinate_forces, forces_at, samples_of
from pmor.dynamics.oscillator import Oscillator, mesh_receptance_of, static_stiffness_of

# Samples per mesh cycle. Where flanks part between two of them the force has a kink: at 320 samples that alone made
# folds of 2e-4 of the frequency at the sharp tip of a resonance of 2 % damping.
SAMPLES = 2048
MAX_STEPS = 40
# Of the unknowns, relative to the displacement under the mean load.
TOLERANCE = 1e-10
# Displacements between which the one under the mean load is looked for, and how often the interval is halved.
SMALLEST, LARGEST, BISECTIONS = 1e-9, 1e9, 60


@dataclass(frozen=True)
class Balance:
    """The equations of harmonic balance of an oscillator under a force law.

    Unknowns are those of one coordinate of the mesh after the other.
    """

    oscillator: Oscillator
    law: ForceLaw
    cycles: int  # Mesh cycles p after which the motion repeats
    harmonics: int  # Of a mesh cycle: there are p times as many unknown harmonics
    # shape (n,): Forces on the mesh beside its load, by harmonics
    further: FloatArray | None = None

    @property
    def orders(self) -> int:
        """Number of harmonics of the whole period."""
        return self.cycles * self.harmonics

    @property
    def coordinates(self) -> int:
        """Number of coordinates of the mesh, r."""
        return len(self.oscillator.rows)

    @property
    def size(self) -> int:
        """Number of unknowns, means included."""
        return self.coordinates * (2 * self.orders + 1)

    @cached_property
    def phase(self) -> FloatArray:
        """Phases of the mesh at which forces are evaluated, over the whole period."""
        samples = samples_of(self.law, SAMPLES)
        return np.asarray(2.0 * np.pi / samples * np.arange(samples * self.cycles), dtype=float)

    @cached_property
    def at_rest(self) -> tuple[FloatArray, FloatArray]:
        """Static stiffness (1, 1) and force (1,) that the mesh of a pair feels."""
        return static_stiffness_of(self.oscillator)

    def by_coordinate(self, unknowns: FloatArray) -> FloatArray:
        """Unknowns, (r, 2 orders + 1)."""
        return unknowns.reshape(self.coordinates, -1)

    def displacement(self, unknowns: FloatArray) -> FloatArray:
        """Displacement at `phase`, (r, s)."""
        samples, each = len(self.phase), self.by_coordinate(unknowns)
        spectrum = np.zeros((len(each), samples // 2 + 1), dtype=complex)
        spectrum[:, 1 : self.orders + 1] = 0.5 * samples * (each[:, 1::2] - 1j * each[:, 2::2])
        spectrum[:, 0] = samples * each[:, 0]
        return np.fft.irfft(spectrum, samples)

    def forces(self, unknowns: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Mesh forces at `phase`, (r, s), and their derivatives by the displacement, (r, r, s)."""
        return coordinate_forces(self.law, self.phase, self.displacement(unknowns))

    def residual(self, unknowns: FloatArray, speed: float) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Residual of (1) at a mesh frequency, its derivatives by the unknowns, and by the frequency.

        ConvergenceError where the displacement leaves the range of the law.
        """
        force, slope = self.forces(unknowns)
        if not np.isfinite(force).all():
            raise ConvergenceError(f"at mesh frequency {in_Hz(speed)} the motion leaves the range of the force law")
        products = np.block([[product_rows(harmonics_of(part, 2 * self.orders)) for part in row] for row in slope])
        harmonics = np.concatenate([harmonics_of(part, self.orders) for part in force])
        if self.further is not None:
            harmonics -= self.further
        law, order = self.law, np.arange(1, self.orders + 1) / self.cycles
        if isinstance(law, MachineLaw):
            receptance, rate = mesh_receptance_of(self.oscillator, np.append(0.0, order) * speed)
            beside = unknowns.copy()
            self.by_coordinate(beside)[:, 0] -= law.centre
            self.by_coordinate(harmonics)[:, 0] -= law.load
            rate[1:] *= order[:, None, None]
            return (
                beside + self._times(receptance, harmonics), np.eye(self.size) + self._times(receptance, products),
                self._times(rate, harmonics),
            )  # fmt: skip
        receptance, rate = mesh_receptance_of(self.oscillator, order * speed)
        stiffness, force_at_rest = self.at_rest
        dynamic, still = 1.0 / receptance, np.zeros((1, 1, 1))
        linear = np.concatenate([stiffness[None], dynamic])
        rates = np.concatenate([still, -order[:, None, None] * dynamic**2 * rate])
        harmonics[0] -= force_at_rest[0]
        residual = self._times(linear, unknowns) + harmonics
        return residual, self._times(linear, np.eye(self.size)) + products, self._times(rates, unknowns)

    def _times(self, matrices: ComplexArray, harmonics: FloatArray) -> FloatArray:
        """Product of a matrix for each harmonic, (orders + 1, r, r), with coordinates, (size, ...)."""
        each = harmonics.reshape(self.coordinates, 2 * self.orders + 1, -1)
        turned = (matrices[1:] @ (each[:, 1::2] - 1j * each[:, 2::2]).transpose(1, 0, 2)).transpose(1, 0, 2)
        found = np.empty_like(each)
        found[:, 0] = matrices[0].real @ each[:, 0]
        found[:, 1::2], found[:, 2::2] = turned.real, -turned.imag
        return np.asarray(found.reshape(harmonics.shape))


def in_Hz(speed: float) -> str:
    """Return an angular frequency as messages give it."""
    return f"{speed / (2.0 * np.pi):.6g} Hz"


def solution_of(matrix: FloatArray, right: FloatArray) -> FloatArray:
    """Return the solution of linear equations; ConvergenceError where it is not unique and finite."""
    try:
        solution = np.linalg.solve(matrix, right)
    except np.linalg.LinAlgError:
        solution = np.full_like(right, np.nan)
    if not np.isfinite(solution).all():
        raise ConvergenceError("the linearised equations of motion are singular")
    return np.asarray(solution)


def harmonics_of(values: FloatArray, orders: int) -> FloatArray:
    """Return mean, cosine and sine of the harmonics of values at even steps over a period, (2 orders + 1,)."""
    spectrum = np.fft.rfft(values)[: orders + 1] * (2.0 / len(values))
    harmonics = np.empty(2 * orders + 1)
    harmonics[0], harmonics[1::2], harmonics[2::2] = 0.5 * spectrum[0].real, spectrum[1:].real, -spectrum[1:].imag
    return harmonics


def product_rows(factor: FloatArray) -> FloatArray:
    """Return the matrix that multiplies a function with `factor`, both by mean, cosines and sines.

    The factor, (4 orders + 1,), has twice the orders of the function: products of cosines and sines go that far.
    """
    orders = (len(factor) - 1) // 4
    cosine, sine = factor[1::2], factor[2::2]
    c, s = np.append(2.0 * factor[0], cosine), np.append(0.0, sine)
    k, m = np.meshgrid(np.arange(1, orders + 1), np.arange(1, orders + 1), indexing="ij")
    apart, together, ahead = np.abs(k - m), k + m, np.sign(k - m)
    rows = np.empty((2 * orders + 1, 2 * orders + 1))
    rows[0, 0], rows[0, 1::2], rows[0, 2::2] = factor[0], 0.5 * cosine[:orders], 0.5 * sine[:orders]
    rows[1::2, 0], rows[2::2, 0] = cosine[:orders], sine[:orders]
    rows[1::2, 1::2], rows[1::2, 2::2] = 0.5 * (c[together] + c[apart]), 0.5 * (s[together] - ahead * s[apart])
    rows[2::2, 1::2], rows[2::2, 2::2] = 0.5 * (s[together] + ahead * s[apart]), 0.5 * (c[apart] - c[together])
    return rows


def fourier_rows(angle: FloatArray, orders: int) -> FloatArray:
    """Return mean, cosine and sine of the harmonics at angles, (n, 2 orders + 1)."""
    argument = angle[:, None] * np.arange(1, orders + 1)
    rows = np.ones((len(angle), 2 * orders + 1))
    rows[:, 1::2], rows[:, 2::2] = np.cos(argument), np.sin(argument)
    return rows


def solve_at(balance: Balance, speed: float, start: FloatArray) -> FloatArray:
    """Find periodic motion at a mesh frequency by guarded Newton steps, or raise ConvergenceError."""
    unknowns, history = start.copy(), []
    residual, matrix, _ = balance.residual(unknowns, speed)
    for _ in range(MAX_STEPS):
        step = solution_of(matrix, -residual)
        norm, share = float(np.linalg.norm(residual)), 1.0
        while True:
            try:
                trial, matrix, _ = balance.residual(unknowns + share * step, speed)
            except ConvergenceError:
                trial = np.full_like(residual, np.inf)
            if np.linalg.norm(trial) < norm or share < 1e-3:
                break
            share *= 0.5
        if not np.isfinite(trial).all():
            break
        unknowns, residual = unknowns + share * step, trial
        history.append((norm,))
        if share * np.linalg.norm(step) <= TOLERANCE * np.linalg.norm(unknowns):
            return unknowns
    raise ConvergenceError(f"no periodic motion found at mesh frequency {in_Hz(speed)}", history)


def rest(balance: Balance) -> FloatArray:
    """Return a start: the mean displacement at which the mean of the force over the cycle bears the load."""
    phase, start = balance.phase, np.zeros(balance.size)
    centre = centre_of(balance.law)
    if centre is not None:
        balance.by_coordinate(start)[:, 0] = centre
        return start

    def mean_force(x: FloatArray) -> FloatArray:
        return np.asarray(forces_at(balance.law, phase, np.repeat(x, len(phase)))[0].mean(keepdims=True))

    start[0] = _bearing(balance, mean_force, 1)[0]
    return start


def without_harmonic(balance: Balance, order: int) -> Balance:
    """Return the equations of a mesh of one coordinate without a harmonic of its force at rest under the mean load."""
    at_rest = forces_at(balance.law, balance.phase, np.full(len(balance.phase), rest(balance)[0]))[0]
    further = np.zeros(balance.size)
    own = slice(2 * balance.cycles * order - 1, 2 * balance.cycles * order + 1)
    further[own] = harmonics_of(at_rest, balance.orders)[own]
    return replace(balance, further=further)


def quasi_static(balance: Balance) -> FloatArray:
    """Return a start at low frequencies: the displacement at which the force at each phase bears the load."""
    phase = balance.phase
    if centre_of(balance.law) is not None:
        return rest(balance)
    return harmonics_of(_bearing(balance, lambda x: forces_at(balance.law, phase, x)[0], len(phase)), balance.orders)


def _bearing(balance: Balance, force: Callable[[FloatArray], FloatArray], count: int) -> FloatArray:
    """Displacements (count,) at which a force that rises with them bears the load."""
    stiffness, load = (float(part.item()) for part in balance.at_rest)

    def short(x: FloatArray) -> BoolArray:
        # Beyond the range of the law, where the force is no number, is too far.
        return np.asarray(force(x) + stiffness * x < load)

    low, high = np.zeros(count), np.full(count, SMALLEST)
    while (further := short(high) & (high < LARGEST)).any():
        high = np.where(further, 2.0 * high, high)
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        below = short(middle)
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return low


def rms(unknowns: FloatArray) -> FloatArray:
    """Root mean square of the motion about its mean, of unknowns (..., n) of one coordinate."""
    return np.asarray(np.sqrt(0.5 * (unknowns[..., 1:] ** 2).sum(axis=-1)))
