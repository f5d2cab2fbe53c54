"""Chosen variants judged on finer and finer angles, until their results no longer move.

A search compares many variants on few angles, and prefers those whose extremes fall between them. The angles of a
level are among those of the next: extremes on few angles are bounds of those on many, and a variant that is worse on
few angles than the best is on many need not be judged again.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.errors import ConvergenceError
from pmor.design.judge import Judge, Verdict

# Angles per pitch of the pair as drawn at least, and at most; those of scattered pairs, over those of the search.
FEWEST, MOST, DRAWN = 512, 8192, 2
# Change of a result by twice the angles that counts as none: over itself, or over the bound of a constraint where that
# is more (the load of a tip's edge peaks in a fraction of a degree), and besides (um, MPa, N/mm).
SETTLED, NOISE = 3e-3, 1e-3


def judged_finely(judge: Judge, x: FloatArray | None) -> tuple[Verdict, int]:
    """Judge a variant, or what the file has, on finer and finer angles.

    Returns
    -------
    Verdict
    int
        Angles per pitch of the pair as drawn.

    Raises
    ------
    ConvergenceError
        Where a position did not converge, or the results still move on the finest angles.
    """
    design, few, first = judge.design, judge.design.search.angles, _first(judge)
    asked = {
        "peak_to_peak_um",
        design.objective.key,
        design.pareto.against,
        *(c.key for c in design.constraints),
    }
    columns = [k for k, key in enumerate(design.results) if key in asked]
    bounds: dict[str, float] = {c.key: c.at_most for c in design.constraints}
    sizes = np.array([bounds.get(design.results[k], 0.0) for k in columns])
    nominal, angles = _settled(
        judge, first, lambda fine: fine.results(fine.assembly(x)), lambda table: table[:, columns], sizes
    )
    if not design.scatters:
        return judge.verdict_of(x, nominal, nominal[None]), angles
    sizes = np.append([constraint.at_most for constraint in design.constraints], 0.0)
    over, _ = _settled(
        judge, DRAWN * few, lambda fine: fine.scattered(x), lambda table: _value_of(judge, x, table), sizes
    )
    return judge.verdict_of(x, nominal, over), angles


def judged_once(judge: Judge, x: FloatArray) -> tuple[Verdict, int]:
    """Judge a variant on the fewest of the fine angles, as `judged_finely` begins; ConvergenceError as there."""
    few, first = judge.design.search.angles, _first(judge)
    fine = judge.on_angles(first)
    nominal = fine.results(fine.assembly(x))
    over = judge.on_angles(DRAWN * few).scattered(x) if judge.design.scatters else nominal[None]
    if not np.isfinite(over[:, :, 0]).all():
        raise ConvergenceError(f"a position on {first} angles per pitch did not converge", [])
    return judge.verdict_of(x, nominal, over), first


def judged_on_what_is_left(judge: Judge, x: FloatArray | None) -> tuple[Verdict, list[str]]:
    """Judge a variant as `judged_once`, by the positions that converged; say under which torques others did not."""
    fine = judge.on_angles(_first(judge))
    built = fine.assembly(x)
    state = fine.solve(built)
    nominal = fine.results_of(state, built, left=True)
    over = judge.scattered(x, left=True) if judge.design.scatters else nominal[None]
    return judge.verdict_of(x, nominal, over), fine.lost(state)


def _first(judge: Judge) -> int:
    return first_angles(judge.design.search.angles)


def first_angles(few: int, pitches: int = 1) -> int:
    """Return the fewest of the fine angles per pitch, where a file asks for few ones over so many pitches."""
    return few * 2 ** max(0, int(np.ceil(np.log2(FEWEST / (few * pitches)))))


def fine_angles(few: int) -> int:
    """Return how many angles are solved in all until results no longer move, about: a first level and a second one."""
    return 3 * first_angles(few)


def best_finely(judge: Judge, verdicts: Sequence[Verdict]) -> Verdict:
    """Return the best of variants, the best on few angles first, by their objectives on fine angles."""
    best: Verdict | None = None
    for verdict in verdicts:
        if best is not None and not verdict.objective < best.objective:
            break
        finely = judged_finely(judge, verdict.x)[0]
        best = finely if best is None or finely.objective < best.objective else best
    assert best is not None
    return best


def _value_of(judge: Judge, x: FloatArray | None, over: FloatArray) -> FloatArray:
    verdict = judge.verdict_of(x, over[0], over)
    return np.append(verdict.limits, verdict.objective)


def _settled(
    judge: Judge, angles: int, results: Callable[[Judge], FloatArray],
    watched: Callable[[FloatArray], FloatArray], sizes: FloatArray,
) -> tuple[FloatArray, int]:  # fmt: skip
    """Return results on twice and twice as many angles, until those that are watched no longer move.

    `sizes` are those over which changes count as small, where they are larger than the results themselves.
    """
    before: FloatArray | None = None
    while angles <= MOST:
        figures = results(judge.on_angles(angles))
        now = watched(figures)
        if not np.isfinite(now).all():
            raise ConvergenceError(f"a position on {angles} angles per pitch did not converge", [])
        if before is not None and (np.abs(now - before) <= SETTLED * np.maximum(np.abs(now), sizes) + NOISE).all():
            return figures, angles
        before, angles = now, 2 * angles
    raise ConvergenceError(f"the results still move on {angles // 2} angles per pitch", [])
