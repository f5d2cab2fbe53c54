"""The oscillator of gear dynamics: x'' + 2 zeta x' + (1 + 0.2 cos wt) max(x, 0) = 1, by the code of the gears.

Figures of two independent codes, harmonic balance and integration over time, to four digits; limits of instability by
Hill's determinant.
"""

from __future__ import annotations

import numpy as np

from pmor.dynamics.continuation import Branch, Follower, Point, first_point, follower, trace
from pmor.dynamics.harmonic_balance import Balance, rest, rms, solve_at
from pmor.dynamics.kernels.laws import VaryingStiffness
from pmor.dynamics.oscillator import Oscillator
from pmor.dynamics.response import HARMONICS
from pmor.dynamics.stability import doublings, monodromy
from pmor.validation.check import Check

BENCHMARK = VaryingStiffness(stiffness=1.0, variation=0.2, pulls=False)
#: given to four digits by codes that differ from each other by less
DIGITS = 2e-3
# Damping ratio: speeds of the jumps on run-up and run-down, largest rms.
FOLDS = {0.05: (0.9069, 0.8344, 1.4769), 0.02: (0.8954, 0.592, 3.623)}
# Rms at speeds of a run-up, damping ratio 0.05.
RUN_UP = {1.2: 0.298824, 1.0: 0.925288}
# Limits of the parametric instability without contact loss, damping ratio 0.02.
UNSTABLE = 2.08995, 1.90679


def followed(
    zeta: float, law: VaryingStiffness = BENCHMARK, limits: tuple[float, float] = (0.55, 1.4)
) -> tuple[Branch, Follower]:  # fmt: skip
    """Return the motion of the oscillator between two speeds, and what follows it."""
    one = np.ones((1, 1))
    oscillator = Oscillator(one, 2.0 * zeta * one, 0.0 * one, np.ones(1), np.array([1.0]))
    balance = Balance(oscillator, law, cycles=1, harmonics=HARMONICS)
    start = solve_at(balance, limits[1], rest(balance))
    follow = follower(balance, start, limits[1])
    return trace(follow, first_point(follow, start, limits[1], upwards=False), limits), follow


def largest(branch: Branch, follow: Follower) -> Point:
    """Return the point of a branch at which the root mean square of its motion is largest."""
    size = rms(branch.unknowns)
    top = int(size.argmax())

    def growth(point: Point) -> float:
        return float(point.unknowns[1:] @ point.tangent[1:-1])

    for i in (top - 1, top):
        if 0 <= i < len(size) - 1 and growth(branch.points[i]) * growth(branch.points[i + 1]) < 0.0:
            return follow.refine(branch.points[i], follow.length(branch.points[i], branch.points[i + 1]), growth)
    return branch.points[top]


def benchmark() -> list[Check]:
    """Return the checks of the pair in motion."""
    checks, source = [], "independent harmonic balance and time integration"
    for zeta, (up, down, size) in FOLDS.items():
        branch, follow = followed(zeta)
        speeds = {fold.kind: float(fold.point.speed) for fold in branch.folds}
        top = float(rms(largest(branch, follow).unknowns))
        words = f"damping ratio {zeta:g}"
        checks += [
            Check(f"jump on run-up over natural frequency, {words}", "1", up, speeds["run_up"], source, DIGITS),
            Check(f"jump on run-down over natural frequency, {words}", "1", down, speeds["run_down"], source, DIGITS),
            Check(f"largest rms, {words}", "1", size, top, source, DIGITS),
        ]
    branch, _ = followed(0.05)
    for speed, size in RUN_UP.items():
        near = branch.points[int(np.abs(branch.speed - speed).argmin())].unknowns
        ours = float(rms(solve_at(branch.balance, speed, near)))
        words = f"rms at {speed:g} of the natural frequency, damping ratio 0.05"
        checks.append(Check(words, "1", size, ours, source, DIGITS))
    limits = 1.7, 2.3
    branch, follow = followed(0.02, BENCHMARK._replace(pulls=True), limits)
    growth = np.array([monodromy(branch.balance, point.unknowns, point.speed) for point in branch.points])
    ours_of = [float(point.speed) for point in doublings(branch, follow, growth, limits, [])]
    words = "limit of parametric instability, damping ratio 0.02"
    return checks + [
        Check(f"{end} {words}", "1", theirs, ours, "Hill's determinant", 1e-5)
        for end, theirs, ours in zip(("upper", "lower"), UNSTABLE, ours_of, strict=True)
    ]  # fmt: skip
