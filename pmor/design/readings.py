"""Readings of a finished search: chosen variants, their curves, their scatter, their sensitivities."""

from __future__ import annotations

import math
from collections.abc import Mapping
from concurrent.futures import Executor
from contextlib import nullcontext
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from pmor.case import Case
from pmor.core.arrays import FloatArray
from pmor.core.errors import ConvergenceError
from pmor.core.progress import stage
from pmor.core.threads import in_order
from pmor.design.fine import FEWEST, judged_finely, judged_on_what_is_left
from pmor.design.harris import HarrisRule, harris_rule, obeys
from pmor.design.in_gearbox import InGearbox, judged_by_the_gearbox
from pmor.design.judge import Judge, Verdict, nominal
from pmor.design.variables import SEED, limits
from pmor.design.variants import Found

# Pairs that are drawn anew to see how chosen variants stand scatter: other ones than those of the search, as many as
# a Sobol sequence is even for.
FRESH, FRESH_SEED = 512, SEED + 1
# Their angles, over those of the search.
FINER = 2
# Most points along each axis of a contour, and in all of them; most variables drawn in pairs.
CONTOUR, MOST_CONTOURED, MOST_PAIRED = 25, 1250, 4
# Torques of the curves over torque, and how far below and above the design's they go.
TORQUES, BELOW, ABOVE = 33, 0.5, 1.2


@dataclass(frozen=True)
class Readings:
    """Content of a page beside the variants."""

    base: Verdict  # The flanks of the file, by the same objective as the variants
    base_searched: float  # Its objective on the angles of the search
    chosen: Mapping[str, int]  # Numbers of chosen variants by name: "best", "best without scatter", "best at 170 N m"
    # Their STE, um, after that of the base: of each mesh that is solved by itself, (T, A)
    curves: Mapping[str, tuple[FloatArray, ...]]
    # Derivative of the nominal objective at the best by each parameter of the modifications; empty without a best
    rates: Mapping[str, float]
    # shape (m,): Objective of fresh draws of chosen variants, full solutions; empty without scatter
    fresh: Mapping[str, FloatArray]
    harris: tuple[HarrisRule, ...]  # Under each torque, of spur pairs whose tip relief is designed
    contours: tuple[Contour, ...]
    # Torques (m,), N m, and peak-to-peak STE over them (m,), um, of the file's flanks and of chosen variants
    torques_Nm: FloatArray
    over_torque: Mapping[str, FloatArray]
    failures: tuple[str, ...]  # Readings that did not converge
    gearbox: InGearbox | None = None  # Of a mesh of a gearbox
    first: bool = False  # Of the first result, while the search goes on: tables alone
    coarse: bool = False  # On half as many elements, while those of the search are solved


@dataclass(frozen=True)
class Contour:
    """The nominal objective over two variables about the best."""

    first: int
    second: int
    along: FloatArray  # shape (m,): Values of the first
    across: FloatArray  # shape (m,): Values of the second
    objective: FloatArray  # shape (m, m): Rows over the second


def read_first(outcome: Found) -> Readings:
    """Read off what the first result shows."""
    failures, nothing = list[str](), np.zeros(0)
    base, searched = _of_base(outcome, failures)
    chosen = {} if outcome.best is None else {"best": outcome.best}
    fine = outcome.fine
    curves = {outcome.file.words.base: _curves(fine, None)}
    return Readings(base, searched, chosen, curves, {}, {}, (), (), nothing, {}, tuple(failures), first=True)


def read_off(outcome: Found, executor: Executor | None = None) -> Readings:
    """Read all of it off a search; threads share out what is solved for it."""
    judge, x, chosen = outcome.fine, outcome.variants.x, outcome.chosen
    curves = {outcome.file.words.base: _curves(judge, None)}
    curves |= {name: _curves(judge, x[n]) for name, n in chosen.items()}
    best = outcome.best
    robust = {name: x[n] for name, n in chosen.items() if name in ("best", "best without scatter")}
    with stage(f"{FRESH} {outcome.file.words.made} drawn anew") if outcome.file.scattered else nullcontext():
        fresh = _fresh(outcome.judge, robust, executor)
    made = outcome.file.words.made
    failures = [f"{name}: {lost} of {len(values)} {made} drawn anew did not converge"
                for name, values in fresh.items() if (lost := int(np.isnan(values).sum()))]  # fmt: skip
    base, searched = _of_base(outcome, failures)
    return Readings(
        base=base,
        base_searched=searched,
        chosen=chosen,
        curves=curves,
        rates={} if best is None else judge.objective_rates(x[best]),
        fresh=fresh,
        harris=_harris(outcome, failures, executor),
        contours=_contours(outcome, executor),
        torques_Nm=(torques := _torques(outcome)),
        over_torque=_over_torque(outcome, torques, executor),
        failures=tuple(failures),
    )


def _curves(judge: Judge, x: FloatArray | None) -> tuple[FloatArray, ...]:
    return tuple(state.ste_um for state in judge.solve(judge.assembly(x)))


def _of_base(outcome: Found, failures: list[str]) -> tuple[Verdict, float]:
    """Return the verdict on the flanks of the file, judged as the variants that are chosen, and as in the search.

    Of the positions that converged; which ones did not is added to the failures.
    """
    name, judge = outcome.file.words.base, outcome.judge
    try:
        verdict = judged_finely(judge, None)[0]
    except ConvergenceError as error:
        verdict, lost = judged_on_what_is_left(judge, None)
        failures += [f"{name}, {sentence}" for sentence in lost] or [f"{name}: {error}"]
    few = judge.lost(judge.solve(judge.base))
    failures += [f"{name}, on the angles of the search, {sentence}" for sentence in few]
    return verdict, judge.verdict(None, left=True).objective


def with_gearbox(read: Readings, outcome: Found, aligned: Found, executor: Executor | None) -> Readings:
    """Return readings with what the gearbox makes of the best of a search on its supports, and of one without them."""
    box = judged_by_the_gearbox(outcome, aligned, executor)
    further = (*(f"on aligned axes: {sentence}" for sentence in aligned.failures), *box.failures)
    return replace(read, gearbox=box, failures=read.failures + further)


def _fresh(judge: Judge, chosen: Mapping[str, FloatArray], executor: Executor | None) -> dict[str, FloatArray]:
    draws, fine = judge.drawn(FRESH, FRESH_SEED), judge.on_angles(FINER * judge.design.search.angles)
    if not draws:
        return {}

    def objectives(x: FloatArray) -> FloatArray:
        return np.array(list(in_order(lambda draw: fine.objective_of(x, [draw])[0], draws, executor)))

    return {name: objectives(x) for name, x in chosen.items()}


def _contours(outcome: Found, executor: Executor | None) -> tuple[Contour, ...]:
    if outcome.best is None or len(outcome.design.variables) < 2:
        return ()
    design, best = outcome.design, outcome.variants.x[outcome.best]
    judge, key = outcome.judge.alike(nominal(design)), design.objective.key
    low, high = limits(design.variables)
    pairs = list(combinations(range(min(len(design.variables), MOST_PAIRED)), 2))
    count = min(CONTOUR, int(math.sqrt(MOST_CONTOURED / len(pairs))))
    contours = []
    for first, second in pairs:
        along, across = (np.linspace(low[n], high[n], count) for n in (first, second))
        x = np.tile(best, (count * count, 1))
        x[:, first], x[:, second] = np.tile(along, count), np.repeat(across, count)
        values = in_order(lambda one: judge.figure(key, judge.assembly(one)) @ judge.weights, x, executor)
        contours.append(Contour(first, second, along, across, np.array(list(values)).reshape(count, count)))
    return tuple(contours)


def _torques(outcome: Found) -> FloatArray:
    """Torques of the curves over torque; none on supports that go with the loads."""
    torques = np.array(outcome.design.load.torques_Nm)
    if outcome.judge.moving_supports:
        return np.zeros(0)
    return np.linspace(BELOW * torques.min(), ABOVE * torques.max(), TORQUES)


def _over_torque(outcome: Found, torques: FloatArray, executor: Executor | None) -> dict[str, FloatArray]:
    if not len(torques):
        return {}
    judge = outcome.judge.at_torques(torques).on_angles(max(FEWEST, outcome.design.search.angles))
    flanks: dict[str, FloatArray | None] = {outcome.file.words.base: None}
    flanks |= {name: outcome.variants.x[n] for name, n in outcome.chosen.items()}
    curves = in_order(lambda x: judge.figure("peak_to_peak_um", judge.assembly(x)), flanks.values(), executor)
    return dict(zip(flanks, curves, strict=True))


def _harris(outcome: Found, failures: list[str], executor: Executor | None) -> tuple[HarrisRule, ...]:
    judge, design = outcome.judge, outcome.design
    relieved = {gear for v in design.variables if v.key == "tip_relief_um" for gear in v.gears}
    if not isinstance(outcome.file.source, Case) or relieved != {"pinion", "wheel"}:
        return ()
    (reduced,) = judge.elements.pairs.values()
    if not obeys(reduced.meshed.pair):
        return ()

    def rule(torque: float) -> HarrisRule | str:
        try:
            return harris_rule(reduced, torque)
        except ConvergenceError as error:
            return str(error)

    rules = list(in_order(rule, design.load.torques_Nm, executor))
    failures += [one for one in rules if isinstance(one, str)]
    return tuple(one for one in rules if not isinstance(one, str))


def percentile_95(values: FloatArray) -> float:
    """Return the 95th percentile of values."""
    return float(np.percentile(values, 95.0))
