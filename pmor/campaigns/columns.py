"""The rows of a campaign's chunks as columns, one design after the other."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Annotated, get_args, get_origin

import numpy as np

from pmor.campaigns.relations import split
from pmor.campaigns.rows import STATUSES, Answer, Status
from pmor.campaigns.settings import Campaign
from pmor.case.loader import SECTIONS
from pmor.case.reader import keys_of
from pmor.core.arrays import FloatArray, IntArray
from pmor.core.ranges import Range


@dataclass(frozen=True)
class Columns:
    """All designs of a campaign.

    Parameters
    ----------
    status : ndarray of int, shape (n,)
        Place in `pmor.campaigns.rows.STATUSES`.
    reasons : tuple of str
        Why a design has no results; empty where it has.
    inputs, results : dict of ndarrays, shape (n,)
        NaN where a design has no such value.
    solving_s : ndarray, shape (n,)
        Processor time.
    """

    status: IntArray
    reasons: tuple[str, ...]
    inputs: dict[str, FloatArray]
    results: dict[str, FloatArray]
    solving_s: FloatArray

    def count(self, status: Status) -> int:
        """Return how many designs have a status."""
        return int((self.status == STATUSES.index(status)).sum())

    @property
    def failed(self) -> IntArray:
        """Designs, from 0, that could be made but have no results."""
        return np.flatnonzero(self.status >= STATUSES.index("not converged"))


def columns_of(campaign: Campaign, answers: Iterable[Answer]) -> Columns:
    """Return the columns of all designs, whose answers come in order.

    Raises
    ------
    ValueError
        When there are more or fewer.
    """
    total = campaign.count

    def empty() -> FloatArray:
        return np.full(total, np.nan)

    inputs, results = {name: empty() for name in campaign.columns}, {key: empty() for key in campaign.results}
    status, seconds, reasons, i = np.empty(total, dtype=np.int64), empty(), list[str](), 0
    shared: dict[str, str] = {}
    for answer in answers:
        for row, taken in zip(answer.rows, answer.seconds, strict=True):
            if row["design"] != i + 1:
                raise ValueError(f"design {row['design']} stands where {i + 1} belongs")
            status[i], seconds[i] = STATUSES.index(row["status"]), taken
            reasons.append(shared.setdefault(row["reason"], row["reason"]))
            for values, known in ((inputs, row["inputs"]), (results, row["results"])):
                for key, value in known.items():
                    if value is not None:
                        values[key][i] = value
            i += 1
    if i != total:
        raise ValueError(f"{i} designs are there, not {total}")
    return Columns(status, tuple(reasons), inputs, results, seconds)


def unit_of(name: str) -> str:
    """Return the unit of a key of the case; empty where it has none."""
    section, key = split(name)
    hint = keys_of(SECTIONS[section])[key]
    for kind in (hint, *get_args(hint)):
        if get_origin(kind) is Annotated:
            return next((allowed.unit for allowed in get_args(kind) if isinstance(allowed, Range)), "")
    return ""
