"""A ring that is held at lugs: equal pieces of its outside, at rest or on springs, and nothing between them.

On the outside the displacement of a ring is known by its amplitudes e of harmonics over the angle and polynomials g_b
over the width, with twisted teeth too,

    e_nb = 1/b int U_n(z) g_b(z) e^(-i n tau z) dz,    u(theta, z) = sum_n U_n(z) e^(i n (theta - tau z)).           (1)

With all of them held it is cyclic. Lugs hold some sums of them, those with Legendre's polynomials P_a over each lug,

    sum_n e_nb e^(i n alpha) i^a j_a(n w / 2) = 0,                                                                 (2)

alpha the middle of the lug, w its angle, j_a spherical Bessel functions. What else they are is that of least energy:
with k the ring's stiffness on them and r the forces on them while all of them are held, e = G r with

    G = N (N^H k N)^-1 N^H,                                                                                        (3)

N all amplitudes that lugs allow. G is symmetric and not negative. A lug on a seat that gives way evenly over its area,
by the compliance c in all, is no constraint: with P_a over the lug and P_b over the width, each sum of (2) is

    -c / ((2 a + 1) (2 b + 1)) times the force on it.                                                           (4)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from pmor.core.arrays import ComplexArray, FloatArray, IntArray
from pmor.fe.blank_section import Amplitudes, Loads
from pmor.fe.element import tributary_widths

# Degree of the polynomials over the width, and of those over a lug as far as the harmonics tell them: so many harmonics
# to each.
ACROSS, ALONG, TO_A_POLYNOMIAL = 2, 3, 1.5
# Harmonics of rigid motions, in which the stiffness is singular without lugs.
RIGID = 1


@dataclass(frozen=True)
class Lugs:
    """Equal lugs on the outside of a ring.

    Parameters
    ----------
    radius : float
        Of the outside, mm.
    z : (float, float)
        Faces of the ring, mm; 0 is the upper one of half a ring.
    middles : ndarray, shape (l,)
        Of all lugs, from the middle of tooth 0, rad.
    repeats : int
        How often they repeat around the axis.
    arc : float
        Angle of a lug, rad.
    mirrored : bool
        Half of the width stands for the whole.
    largest : int
        Harmonics go from minus it to it.
    teeth : int
        Harmonics that differ by multiples of it feel each other.
    gives : (float, float)
        Compliance of the seat of each lug, radially and along the surface, mm/N; infinity of what is not held.
    """

    radius: float
    z: tuple[float, float]
    middles: FloatArray
    repeats: int
    arc: float
    mirrored: bool
    largest: int
    teeth: int
    gives: tuple[float, float] = (0.0, 0.0)

    @property
    def parts(self) -> IntArray:
        """Direction of each amplitude of a harmonic, (c,): 0 radial, 1 around, 2 along the axis."""
        return np.array([part for part, _ in self._degrees])

    @property
    def _degrees(self) -> list[tuple[int, int]]:
        even, odd = range(0, ACROSS + 1, 2), range(1, ACROSS + 1, 2)
        degrees = [even, even, odd] if self.mirrored else [range(ACROSS + 1)] * 3
        return [(part, degree) for part in range(3) for degree in degrees[part]]

    def loads(self, twist: float) -> tuple[Loads]:
        """Return unit loads on the outside that work on e_nb: of amplitudes whose circumferential part is over i."""

        def at(z: FloatArray, n: FloatArray) -> Amplitudes:
            low, high = self.z
            middle = high if self.mirrored else 0.5 * (low + high)
            share = tributary_widths(z, 2) / (high - low)
            unit_loads = np.zeros((3 * len(z), len(self.parts)))
            for place, (part, degree) in enumerate(self._degrees):
                polynomial = np.polynomial.Legendre.basis(degree)((z - middle) / (middle - low))
                unit_loads[part::3, place] = share * polynomial
            return unit_loads * np.exp(1j * twist * n * z.repeat(3)[:, None]) if twist else unit_loads

        return (Loads(self.radius, len(self.parts), at),)

    @property
    def _along(self) -> IntArray:
        """Degrees of the polynomials over a lug, (d,)."""
        told = self.arc * (2 * self.largest + 1) / (2.0 * np.pi * TO_A_POLYNOMIAL)
        return np.arange(1 + min(ALONG, max(0, int(told) - 1)))

    def held(self) -> ComplexArray:
        """Return what lugs hold, sums of all amplitudes from harmonic -largest on: equation (2), (h, (2 N + 1) c)."""
        from scipy.special import spherical_jn  # loads for a sixth of a second, and few gears are held at lugs

        n, size = np.arange(-self.largest, self.largest + 1), len(self.parts)
        degrees, middles = self._along[:, None], self.middles[:, None]
        over = 1j**degrees * spherical_jn(degrees, np.abs(0.5 * n * self.arc)) * np.sign(n) ** degrees
        sums = np.exp(1j * n * middles)[:, None, :] * np.where(n == 0, degrees == 0, over)
        return np.asarray(np.kron(sums.reshape(-1, len(n)), np.eye(size)))

    def seats(self) -> FloatArray:
        """Return the compliance of the seats to each sum of equation (2), (h,), mm/N: equation (4)."""
        own = [self.gives[min(part, 1)] / (2 * degree + 1) for part, degree in self._degrees]
        return np.kron(np.ones(len(self.middles)), np.kron(1.0 / (2 * self._along + 1), own))

    def eased(self, stiffness: ComplexArray, forces: ComplexArray) -> ComplexArray:
        """Return how amplitudes move under forces on them while the seats of the lugs are at rest: equation (3).

        Parameters
        ----------
        stiffness : ndarray, shape (2 N + 1, c, 2 N + 1, c)
            k.
        forces : ndarray, shape ((2 N + 1) c, m)
        """
        size, harmonics = len(self.parts), np.arange(-self.largest, self.largest + 1)
        rigid = np.flatnonzero(np.abs(harmonics).repeat(size) <= RIGID)
        springs = np.zeros(len(harmonics) * size)
        springs[rigid] = np.abs(stiffness[0, 0, 0, 0]) / (1.0 + self.largest)
        # On these springs it is not singular; they are then taken away again, as the lugs are added.
        seats = self.seats()
        to = np.hstack([np.eye(len(springs))[:, rigid], self.held()[np.isfinite(seats)].conj().T])
        moved, by = (_on_springs(stiffness, springs, self.teeth, loads) for loads in (forces, to))
        slack = np.zeros(to.shape[1])
        slack[: len(rigid)], slack[len(rigid) :] = 1.0 / springs[rigid], -seats[np.isfinite(seats)]
        reactions = la.solve(np.diag(slack) - to.conj().T @ by, to.conj().T @ moved, assume_a="her")
        return np.asarray(moved + by @ reactions)


def _on_springs(stiffness: ComplexArray, springs: FloatArray, teeth: int, forces: ComplexArray) -> ComplexArray:
    """Displacement of amplitudes: those of harmonics that differ by multiples of the number of teeth together."""
    harmonics, size = stiffness.shape[:2]
    displacement = np.empty_like(forces)
    for h in range(min(teeth, harmonics)):
        own = np.arange(h, harmonics, teeth)
        place = (own[:, None] * size + np.arange(size)).ravel()
        block = stiffness[own][:, :, own].reshape(len(place), -1) + np.diag(springs[place])
        displacement[place] = la.solve(block, forces[place], assume_a="her", check_finite=False)
    return displacement
