"""Run the matrix of a case: independent variants, several at a time; a variant that fails never stops the others."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from pmor.case import Case
from pmor.case.capability import refuse_beyond
from pmor.core.errors import CaseError
from pmor.lab.core.measures import fitted_exponent
from pmor.lab.core.models import ModelStore
from pmor.lab.stability.contact_variants import PENALTY_EXPONENTS, PENALTY_LIMIT, STIFF_EXPONENT, penalty_name
from pmor.lab.stability.matrix import base_case, matrix
from pmor.lab.stability.measure import Entry, entry_of, measure
from pmor.lab.stability.result import FILES, PenaltyLaw, Stability
from pmor.lab.stability.variants import Variant
from pmor.work.pieces import Piece, run_pieces
from pmor.work.results import pieces_folder

# Distance of the fitted exponent from -1: at 1e6 N/mm3 the width of contact still changes a little with the penalty.
EXPONENT_TOLERANCE = 0.05
# Differences to the limit below this share of it are those of the solver.
SOLVER_SHARE = 1e-9


def run(
    case: Case, *, only: str = "", folder: Path | str | None = None, overwrite: bool = False,
    executor: Executor | None = None, progress: Callable[[int], None] | None = None,
) -> Stability:  # fmt: skip
    """Run the variants of a case, or those with the text `only` in name or group.

    Parameters
    ----------
    folder, overwrite, executor, progress
        As in `pmor.app.capabilities`; the executor is one of threads.

    Raises
    ------
    CaseError
        When no variant has the text, and for rings.
    """
    refuse_beyond(case, "stability")
    started, base, store = time.perf_counter(), base_case(case), ModelStore()
    variants = matrix(base, only)
    if not variants:
        raise CaseError(f"only = {only!r}: no variant has this in its name or group; leave it out to run them all")

    def work(variant: Variant) -> dict[str, Any]:
        return asdict(measure(variant, base, store))

    pieces = [Piece(v.name, {"base": base}, asdict(v), partial(work, v)) for v in variants]
    with pieces_folder(folder, FILES, overwrite=overwrite) as parts:
        results, _ = run_pieces(pieces, parts, executor=executor, progress=progress, what="variants")
    entries_of = {piece.name: entry_of(results[piece.name]) for piece in pieces}
    law = penalty_law(entries_of)
    entries = *entries_of.values(), *([_law_entry(law)] if law else [])
    return Stability(case, base, entries, law, time.perf_counter() - started)


def penalty_law(by_name: Mapping[str, Entry]) -> PenaltyLaw | None:
    """Fit how the STE comes to its limit; None when the penalties were not run, or did not converge."""
    penalties = [10.0**exponent for exponent in PENALTY_EXPONENTS]
    entries = [by_name.get(name) for name in (*map(penalty_name, penalties), PENALTY_LIMIT)]
    curves = [entry.ste_um for entry in entries if entry is not None and entry.converged]
    if len(curves) < len(entries):
        return None
    ste = np.array(curves)
    limit = float(np.median(ste[-1]))
    above = np.median(ste[:-1] - ste[-1], axis=1).tolist()
    stiff = [(penalty, difference) for penalty, difference in zip(penalties, above, strict=True)
             if penalty >= 10.0**STIFF_EXPONENT and difference > SOLVER_SHARE * limit]  # fmt: skip
    exponent = fitted_exponent([p for p, _ in stiff], [d for _, d in stiff])
    return PenaltyLaw(tuple(penalties), tuple(above), limit, exponent)


def _law_entry(law: PenaltyLaw) -> Entry:
    off = abs(law.exponent + 1.0)
    return Entry(
        "STE falls as 1/k", "Penalty", "law of a series spring", converged=True,
        difference_rel=off if math.isfinite(off) else None, ste_mean_um=law.limit_um, ok=off <= EXPONENT_TOLERANCE,
        note=f"STE above its penalty-free limit falls as k^{law.exponent:.3f} from 1e{STIFF_EXPONENT} N/mm3 on",
    )  # fmt: skip
