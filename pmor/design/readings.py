"""Readings of a finished search: chosen variants, their curves, their scatter, their sensitivities."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.errors import ConvergenceError
from pmor.design.harris import HarrisRule, harris_rule, obeys
from pmor.design.judge import Judge
from pmor.design.pair_judge import PairJudge
from pmor.design.search import Found
from pmor.design.supports import InGearbox, Supports, judged_by_the_gearbox
from pmor.design.variables import SEED

# Pairs that are drawn anew to see how chosen variants stand scatter: other ones than those of the search.
FRESH, FRESH_SEED = 1000, SEED + 1
# Their angles, over those of the search.
FINER = 4


@dataclass(frozen=True)
class Readings:
    """Content of a page beside the variants."""

    base: FloatArray  # shape (T, R): Results of the case as it is
    chosen: Mapping[str, int]  # Numbers of chosen variants by name: "best", "best without scatter", "best at 170 N m"
    curves: Mapping[str, FloatArray]  # shape (T, A): Their STE, um, after that of the base
    # Derivative of the nominal objective at the best by each parameter of the modifications; empty without a best
    rates: Mapping[str, float]
    # shape (m,): Objective of fresh draws of chosen variants, full solutions; empty without scatter
    fresh: Mapping[str, FloatArray]
    harris: tuple[HarrisRule, ...]  # Under each torque, of spur pairs whose tip relief is designed
    failures: tuple[str, ...]  # Readings that did not converge
    gearbox: InGearbox | None = None  # Of a mesh of a gearbox


def read_off(found: Found) -> Readings:
    """Read all of it off a search."""
    judge, x, chosen = found.fine, found.variants.x, found.chosen
    curves = {found.file.words.base: judge.solve(judge.base).ste_um}
    curves |= {name: judge.solve(judge.assembly(x[n])).ste_um for name, n in chosen.items()}
    best = found.best
    fresh = _fresh(found.judge, {name: x[n] for name, n in chosen.items() if name in ("best", "best without scatter")})
    made = found.file.words.made
    failures = [f"{name}: {lost} of {len(values)} {made} drawn anew did not converge"
                for name, values in fresh.items() if (lost := int(np.isnan(values).sum()))]  # fmt: skip
    return Readings(
        base=judge.results(judge.base),
        chosen=chosen,
        curves=curves,
        rates={} if best is None else judge.objective_rates(x[best]),
        fresh=fresh,
        harris=_harris(found, failures),
        failures=tuple(failures),
    )


def with_gearbox(
    read: Readings, supports: Supports, found: Found, aligned: Found, executor: Executor | None
) -> Readings:
    """Return readings with what the gearbox makes of the best of a search on its supports, and of one without them."""
    box = judged_by_the_gearbox(supports, found, aligned, executor)
    further = (*(f"on aligned axes: {sentence}" for sentence in aligned.failures), *box.failures)
    return replace(read, gearbox=box, failures=read.failures + further)


def _fresh(judge: Judge[Any, Any], chosen: Mapping[str, FloatArray]) -> dict[str, FloatArray]:
    draws, fine = judge.drawn(FRESH, FRESH_SEED), judge.on_angles(FINER * judge.design.search.angles)
    if not draws:
        return {}
    return {name: fine.objective_of(x, draws) for name, x in chosen.items()}


def _harris(found: Found, failures: list[str]) -> tuple[HarrisRule, ...]:
    judge, design = found.judge, found.design
    relieved = {gear for v in design.variables if v.key == "tip_relief_um" for gear in v.gears}
    if not isinstance(judge, PairJudge) or judge.moving_supports or relieved != {"pinion", "wheel"}:
        return ()
    if not obeys(judge.reduced.meshed.pair):
        return ()
    rules = []
    for torque in design.load.torques_Nm:
        try:
            rules.append(harris_rule(judge.reduced, torque))
        except ConvergenceError as error:
            failures.append(str(error))
    return tuple(rules)


def percentile_95(values: FloatArray) -> float:
    """Return the 95th percentile of values."""
    return float(np.percentile(values, 95.0))
