"""Run the matrix of a case: independent variants, some at a time; a variant that fails never stops the others."""

from __future__ import annotations

import math
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from pmor.case import Case
from pmor.lab.core.measures import fitted_exponent
from pmor.lab.core.models import ModelStore
from pmor.lab.stability.contact_variants import PENALTY_EXPONENTS, PENALTY_LIMIT, STIFF_EXPONENT, penalty_name
from pmor.lab.stability.matrix import base_case, matrix
from pmor.lab.stability.measure import Entry, entry_of, measure
from pmor.lab.stability.variants import Variant
from pmor.work.pieces import PARTS, Piece, run_pieces

# Distance of the fitted exponent from -1: at 1e6 N/mm3 the strip of contact still changes a little with the penalty.
EXPONENT_TOLERANCE = 0.05
# Differences to the limit below this share of it are what the solver leaves.
SOLVER_SHARE = 1e-9


@dataclass(frozen=True)
class PenaltyLaw:
    """How the STE comes to its limit as the penalty grows.

    Parameters
    ----------
    penalty : tuple of float
        N/mm^3.
    above_limit_um : tuple of float
        STE minus its penalty-free limit, median over the positions, um: where a tip corner or a single point carries
        the load, which points carry goes on changing up to a higher penalty.
    limit_um : float
        STE without penalty, median over the positions, um.
    exponent : float
        Fitted over the stiff ones, down to what the solver leaves; -1 is the law of a series spring.
    """

    penalty: tuple[float, ...]
    above_limit_um: tuple[float, ...]
    limit_um: float
    exponent: float


@dataclass(frozen=True)
class Stability:
    """What the matrix of a case gave.

    Parameters
    ----------
    case : Case
        As it was given.
    base : Case
        That the variants change.
    entries : tuple of Entry
    law : PenaltyLaw or None
        None when the penalties were not run, or did not converge.
    """

    case: Case
    base: Case
    entries: tuple[Entry, ...]
    law: PenaltyLaw | None

    @property
    def failed(self) -> tuple[Entry, ...]:
        """Entries that are neither ok nor explained."""
        return tuple(entry for entry in self.entries if not (entry.ok or entry.explained))


def run_matrix(
    case: Case, out: Path, jobs: int = 1, only: str = "", progress: Callable[[int], None] | None = None
) -> Stability:
    """Run the variants of a case.

    Parameters
    ----------
    case : Case
    out : Path
        Folder of the results, where finished variants are kept until these are written.
    jobs : int
        Variants at a time, in threads.
    only : str
        Run the variants whose name or group has this text in it.
    progress : callable
        Called with how many more variants are there.
    """
    base, store = base_case(case), ModelStore()

    def work(variant: Variant) -> dict[str, Any]:
        return asdict(measure(variant, base, store))

    pieces = [Piece(v.name, {"base": base}, asdict(v), partial(work, v)) for v in wanted_variants(base, only)]
    with ThreadPoolExecutor(max_workers=jobs) as pool:
        results, _ = run_pieces(pieces, out / PARTS, executor=pool, progress=progress, what="variants")
    found = {name: entry_of(result) for name, result in results.items()}
    law = _penalty_law(found)
    entries = [found[piece.name] for piece in pieces]
    return Stability(case, base, (*entries, *([_law_entry(law)] if law else [])), law)


def wanted_variants(base: Case, only: str) -> list[Variant]:
    """Return the variants of a base case whose name or group has a text in it."""
    return [v for v in matrix(base) if only.lower() in f"{v.group} {v.name}".lower()]


def number_of_variants(case: Case, only: str = "") -> int:
    """Return how many variants `run_matrix` will run."""
    return len(wanted_variants(base_case(case), only))


def _penalty_law(found: dict[str, Entry]) -> PenaltyLaw | None:
    penalties = [10.0**exponent for exponent in PENALTY_EXPONENTS]
    entries = [found.get(name) for name in (*map(penalty_name, penalties), PENALTY_LIMIT)]
    curves = [entry.ste_um for entry in entries if entry is not None and entry.converged]
    if len(curves) < len(entries):
        return None
    ste = np.array(curves)
    limit = float(np.median(ste[-1]))
    above = np.median(ste[:-1] - ste[-1], axis=1).tolist()
    stiff = [
        (penalty, difference)
        for penalty, difference in zip(penalties, above, strict=True)
        if penalty >= 10.0**STIFF_EXPONENT and difference > SOLVER_SHARE * limit
    ]
    exponent = fitted_exponent([p for p, _ in stiff], [d for _, d in stiff])
    return PenaltyLaw(tuple(penalties), tuple(above), limit, exponent)


def _law_entry(law: PenaltyLaw) -> Entry:
    off = abs(law.exponent + 1.0)
    ok = off <= EXPONENT_TOLERANCE
    note = f"STE above its penalty-free limit falls as k^{law.exponent:.3f} from 1e{STIFF_EXPONENT} N/mm3 on"
    return Entry(
        "STE falls as 1/k", "Penalty", "law of a series spring", True, None, None,
        off if math.isfinite(off) else None, None, None, law.limit_um, None, 0.0, ok, False, note,
    )  # fmt: skip
