"""Force laws of a mesh by displacement, F(psi, x): named tuples, each with a kernel of its own.

Whatever is compiled for a law takes it as an argument and calls `mesh_force`; numba compiles it once per kind of law. A
law returns NaN where it knows nothing: no solver takes that for a force.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import types
from numba.extending import overload

from pmor.arrays import FloatArray
from pmor.contact.kernels.compiling import compiled


class VaryingStiffness(NamedTuple):
    """A spring whose stiffness varies over the cycle and that cannot pull: (1 + variation cos psi) stiffness max(x, 0).

    Attributes
    ----------
    stiffness : float
        Mean.
    variation : float
        Amplitude over the mean.
    pulls : bool
        Whether the spring pulls too: then the oscillator is linear, Mathieu's.
    """

    stiffness: float
    variation: float
    pulls: bool


class ForceTable(NamedTuple):
    """A force law between knots over phase and displacement, periodic in the phase.

    The knots over the displacement are those of s = sqrt((x - touch) / reach): they crowd where contact begins, and the
    force, which rises there like x / (A - ln x), has a slope over s that is zero and continuous.

    Attributes
    ----------
    touch : ndarray, shape (A, 2)
        Displacement at which flanks first touch at the phases 2 pi a / A, and its derivative by the phase.
    reach : float
        Largest displacement beyond `touch` that the table knows.
    knots : ndarray, shape (A, L, 4)
        Force, its derivatives by phase, by s, and by both.
    backlash : float
        Displacement from where the working flanks of the drawing touch to where their backs do; infinite for none.
    """

    touch: FloatArray
    reach: float
    knots: FloatArray
    backlash: float


@compiled
def _varying_stiffness(law, phase, x):
    if x <= 0.0 and not law.pulls:
        return 0.0, 0.0
    stiffness = law.stiffness * (1.0 + law.variation * np.cos(phase))
    return stiffness * x, stiffness


@compiled
def _hermite(t):
    """Cubics of values and slopes at both ends of an interval of length 1."""
    return (1.0 + 2.0 * t) * (1.0 - t) ** 2, t * (1.0 - t) ** 2, t * t * (3.0 - 2.0 * t), t * t * (t - 1.0)


@compiled
def _hermite_slopes(t):
    return 6.0 * t * (t - 1.0), (1.0 - t) * (1.0 - 3.0 * t), 6.0 * t * (1.0 - t), t * (3.0 * t - 2.0)


@compiled
def _flank_force(law, phase, x):
    """Force of the flanks on one side, and its derivative by the displacement."""
    phases, leads = law.knots.shape[0], law.knots.shape[1]
    step, pace = 2.0 * np.pi / phases, 1.0 / (leads - 1)
    place = phase / step
    floor = np.floor(place)
    one = int(floor) % phases
    two = (one + 1) % phases
    a, b, c, d = _hermite(place - floor)
    low, high = law.touch[one], law.touch[two]
    beyond = x - (a * low[0] + c * high[0] + step * (b * low[1] + d * high[1]))
    if beyond <= 0.0:
        return 0.0, 0.0
    s = np.sqrt(beyond / law.reach)
    if not s <= 1.0:
        return np.nan, np.nan
    row = min(int(s / pace), leads - 2)
    t = s / pace - row
    over, slopes = _hermite(t), _hermite_slopes(t)
    force = slope = 0.0
    for k in range(2):
        low, high = law.knots[one, row + k], law.knots[two, row + k]
        value = a * low[0] + c * high[0] + step * (b * low[1] + d * high[1])
        rate = pace * (a * low[2] + c * high[2] + step * (b * low[3] + d * high[3]))
        force += over[2 * k] * value + over[2 * k + 1] * rate
        slope += slopes[2 * k] * value + slopes[2 * k + 1] * rate
    return force, slope / (2.0 * pace * s * law.reach)


@compiled
def _tabulated(law, phase, x):
    """Working flanks, and their mirror images beyond the backlash.

    At phase 0 a tooth is centred on the line of centres: mirrored there, the back flanks are working flanks that run
    the other way, from the same place.
    """
    if x > -0.5 * law.backlash:
        return _flank_force(law, phase, x)
    force, slope = _flank_force(law, -phase, -x - law.backlash)
    return -force, slope


_KERNELS = {VaryingStiffness: _varying_stiffness, ForceTable: _tabulated}


def mesh_force(law, phase, x):
    """Return the force of a law and its derivative by the displacement; NaN where the law knows nothing."""
    return _KERNELS[type(law)](law, phase, x)


@overload(mesh_force)
def _compiled_mesh_force(law, phase, x):
    if isinstance(law, types.NamedTuple | types.NamedUniTuple) and law.instance_class in _KERNELS:
        kernel = _KERNELS[law.instance_class]
        return lambda law, phase, x: kernel(law, phase, x)
    return None


@compiled
def mesh_forces(law, phase, x, force, slope):
    """Fill the forces and their derivatives at phases and displacements."""
    for i in range(len(phase)):
        force[i], slope[i] = mesh_force(law, phase[i], x[i])
