"""Motion over time, step by step: Runge-Kutta pairs of orders 5 and 4 with dense output.

Dormand & Prince, J. Comput. Appl. Math. 6 (1980) 19; dense output of order 4: Shampine, Math. Comp. 46 (1986) 135. The
force has kinks where flanks part and meet; they show in the error estimate, and steps shrink until they are resolved.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.compiling import allocating, compiled
from pmor.dynamics.kernels.laws import mesh_force

STAGES = 7
# When each stage is taken, and of what slopes it is made; the last row is the step of order 5.
TIMES = np.array([0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0, 1.0])
SLOPES = np.array([
    [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [1 / 5, 0.0, 0.0, 0.0, 0.0, 0.0],
    [3 / 40, 9 / 40, 0.0, 0.0, 0.0, 0.0],
    [44 / 45, -56 / 15, 32 / 9, 0.0, 0.0, 0.0],
    [19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729, 0.0, 0.0],
    [9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656, 0.0],
    [35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84],
])  # fmt: skip
# Step of order 5 less that of order 4.
ERRORS = np.array([71 / 57600, 0.0, -71 / 16695, 71 / 1920, -17253 / 339200, 22 / 525, -1 / 40])
# Powers 1 to 4 of the share of a step that is gone, for the dense output.
DENSE = np.array([
    [1.0, -8048581381 / 2820520608, 8663915743 / 2820520608, -12715105075 / 11282082432],
    [0.0, 0.0, 0.0, 0.0],
    [0.0, 131558114200 / 32700410799, -68118460800 / 10900136933, 87487479700 / 32700410799],
    [0.0, -1754552775 / 470086768, 14199869525 / 1410260304, -10690763975 / 1880347072],
    [0.0, 127303824393 / 49829197408, -318862633887 / 49829197408, 701980252875 / 199316789632],
    [0.0, -282668133 / 205662961, 2019193451 / 616988883, -1453857185 / 822651844],
    [0.0, 40617522 / 29380423, -110615467 / 29380423, 69997945 / 29380423],
])  # fmt: skip
# Steps grow and shrink by so much at most; the next one is to have less than the error allowed.
MOST_GROWTH, LEAST_GROWTH, SAFETY = 5.0, 0.2, 0.9
# Steps shorter than this share of the time between two samples find no force that they could resolve.
LEAST_SHARE = 1e-9

DONE, STUCK = 0, 1


class EquationOfMotion(NamedTuple):
    """Masses that the mesh drives, and the phase of the mesh over time: phase + speed t + rate t^2 / 2."""

    rows: FloatArray  # shape (n, 2n): Accelerations per displacement and velocity, without the mesh
    # shape (n,): Accelerations by the load, and per force of the mesh; displacement along the line of action
    constant: FloatArray
    push: FloatArray
    lever: FloatArray
    phase: float
    speed: float
    rate: float


@compiled
def _slope(law, equation, time, state, slope):
    """Fill the derivative of displacements and velocities by time."""
    n = len(equation.lever)
    along = 0.0
    for i in range(n):
        along += equation.lever[i] * state[i]
    force, _ = mesh_force(law, equation.phase + (equation.speed + 0.5 * equation.rate * time) * time, along)
    for i in range(n):
        total = equation.constant[i] + equation.push[i] * force
        for k in range(2 * n):
            total += equation.rows[i, k] * state[k]
        slope[i], slope[n + i] = state[n + i], total


@compiled
def _try_step(law, equation, time, step, state, slopes, new, tolerance, floor):
    """Fill the state after a step, and its slopes from the second on; return the error over the allowed one."""
    size = len(state)
    for stage in range(1, STAGES):
        for i in range(size):
            total = 0.0
            for k in range(stage):
                total += SLOPES[stage, k] * slopes[k, i]
            new[i] = state[i] + step * total
        _slope(law, equation, time + TIMES[stage] * step, new, slopes[stage])
    worst = 0.0
    for i in range(size):
        error = 0.0
        for k in range(STAGES):
            error += ERRORS[k] * slopes[k, i]
        allowed = tolerance * (max(abs(state[i]), abs(new[i])) + floor[i])
        share = abs(step * error) / allowed
        if not share <= worst:  # NaN too
            worst = share
    return worst


@compiled
def _look(state, slopes, step, share, seen):
    """Fill the state at a share of a step."""
    for i in range(len(state)):
        total = 0.0
        for k in range(STAGES):
            weight = share * (DENSE[k, 0] + share * (DENSE[k, 1] + share * (DENSE[k, 2] + share * DENSE[k, 3])))
            total += weight * slopes[k, i]
        seen[i] = state[i] + step * total


@allocating
def move(law, equation, times, state, step, tolerance, floor, seen):
    """Move on to the last of rising times from time 0.

    Parameters
    ----------
    law : force law
    equation : EquationOfMotion
    times : ndarray, shape (s,)
    state : ndarray, shape (2n,)
        Displacements and velocities; those at the last time in the end.
    step : float
        To begin with.
    tolerance : float
        Of each step, relative to the state and `floor`.
    floor : ndarray, shape (2n,)
    seen : ndarray, shape (s, 2n)
        Filled: the states at these times.

    Returns
    -------
    tuple of (int, float, int)
        DONE, or STUCK where steps became too short, as they do where the law gives no force; the step to go on with;
        the number of steps.
    """
    slopes, new = np.empty((STAGES, len(state))), np.empty(len(state))
    time, index, count = 0.0, 0, 0
    _slope(law, equation, time, state, slopes[0])
    while index < len(times):
        taken = min(step, times[-1] - time)
        error = _try_step(law, equation, time, taken, state, slopes, new, tolerance, floor)
        count += 1
        growth = LEAST_GROWTH
        if error >= 0.0:
            growth = max(LEAST_GROWTH, min(MOST_GROWTH, SAFETY * max(error, 1e-10) ** -0.2))
        if not error <= 1.0:
            step = growth * taken
            if step < LEAST_SHARE * times[-1] / len(times):
                return STUCK, step, count
            continue
        last = taken >= times[-1] - time
        while index < len(times) and (last or times[index] <= time + taken):
            _look(state, slopes, taken, min((times[index] - time) / taken, 1.0), seen[index])
            index += 1
        time += taken
        for i in range(len(state)):
            state[i], slopes[0, i] = new[i], slopes[STAGES - 1, i]
        # A step that was cut at the end says nothing against the longer one.
        step = max(step, growth * taken) if last else growth * taken
    return DONE, step, count
