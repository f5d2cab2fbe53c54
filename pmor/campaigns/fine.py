"""Designs of the least and the largest peak-to-peak STE, judged again on fine angles: see `pmor.design.fine`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from pmor.campaigns.kind import PEAKS
from pmor.campaigns.result import CampaignResult
from pmor.campaigns.rows import Row

# Designs with the least value of each result, and most of them in all.
BEST, MOST_DESIGNS = 10, 100


def judged_finely(result: CampaignResult, solve: Callable[[Sequence[int]], Sequence[Row]]) -> CampaignResult:
    """Return a result whose least and largest peak-to-peak STE are those on fine angles.

    `solve` gives the rows of designs, counted from 0, with the results of `pmor.campaigns.peaks`.
    """
    while len(result.fine) < MOST_DESIGNS:
        missing = sorted(set(_extreme(result)) - set(result.fine))
        if not missing:
            break
        result = replace(result, fine={**result.fine, **dict(zip(missing, solve(missing), strict=True))})
    return result


def _extreme(result: CampaignResult) -> list[int]:
    found: list[int] = []
    for key in PEAKS:
        if key in result.results:
            values = result.judged(key)
            order = [int(i) for i in np.argsort(values, kind="stable") if np.isfinite(values[i])]
            found += [*order[:BEST], *order[-1:]]
    return found
