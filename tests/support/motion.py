"""A pair of one degree of freedom, and readings of its branches."""

import numpy as np

from pmor.dynamics.force_law import centre_of
from pmor.dynamics.harmonic_balance import harmonics_of
from pmor.dynamics.oscillator import Oscillator, motion_of, position_under
from pmor.dynamics.stability import monodromy


def along_line_of_action(mass, damping, load):
    """m x'' + c x' + F(psi, x) = f: a pair that is rigid but for its mesh."""
    one = np.ones((1, 1))
    return Oscillator(mass * one, damping * one, 0.0 * one, np.ones(1), np.array([load]))


def state_of(balance, unknowns, speed):
    """Return displacements and velocities at phase 0 of motion that harmonic balance found, (2n,)."""
    oscillator = balance.oscillator
    each = np.array([harmonics_of(force, balance.orders) for force in balance.forces(unknowns)[0]])
    frequency = speed * np.arange(1, balance.orders + 1) / balance.cycles
    moved = motion_of(oscillator, frequency, (each[:, 1::2] - 1j * each[:, 2::2]).T)
    centre = centre_of(balance.law)
    along = balance.by_coordinate(unknowns)[:, 0] - (0.0 if centre is None else centre)
    mean = position_under(oscillator, each[:, 0], along)
    velocity = (1j * frequency[:, None] * moved).real.sum(axis=0)
    return np.concatenate([mean + moved.real.sum(axis=0), velocity])


def monodromies(branch):
    """Return the growth of disturbances over a period at all points of a branch, (points, 2n, 2n)."""
    return np.array([monodromy(branch.balance, point.unknowns, point.speed) for point in branch.points])


def multipliers(balance, unknowns, speed):
    """Return the Floquet multipliers, the largest first, complex, (2n,)."""
    found = np.linalg.eigvals(monodromy(balance, unknowns, speed))
    return found[np.argsort(-np.abs(found))]
