"""The designs of a campaign: a column for each key and each result, a value for each design."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from pmor.campaigns.campaign import Campaign
from pmor.campaigns.kind import PEAKS
from pmor.campaigns.rows import STATUSES, Row, Status
from pmor.core.arrays import FloatArray, IntArray


@dataclass(frozen=True, kw_only=True)
class Effort:
    """Work that a campaign took.

    Parameters
    ----------
    resumed : int
        Number of designs that an earlier run had solved.
    solving_s : float
        Processor time of the designs of this run.
    wall_s : float
        From the first chunk handed out to the last one back.
    workers : int or None
        Number of processes; None where the executor does not tell.
    """

    n_chunks: int
    resumed: int
    solving_s: float
    wall_s: float
    workers: int | None


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Columns:
    """All designs of a campaign, n of them.

    Parameters
    ----------
    codes : ndarray of int, shape (n,)
        Place of the status in `pmor.campaigns.rows.STATUSES`.
    reasons : tuple of str
        Why a design has no results; empty where it has.
    inputs : dict of ndarrays, shape (n,)
        Keys of the base file; NaN where a design has no such value.
    results : dict of ndarrays, shape (n,)
        At the nominal torque; NaN of designs without.
    solving_s : ndarray, shape (n,)
        Processor time of each design.
    fine : dict of int to row
        Rows of designs, counted from 0, that were judged again on fine angles.
    """

    campaign: Campaign
    codes: IntArray
    reasons: tuple[str, ...]
    inputs: dict[str, FloatArray]
    results: dict[str, FloatArray]
    solving_s: FloatArray
    effort: Effort
    fine: Mapping[int, Row] = field(default_factory=dict)

    @property
    def status(self) -> np.ndarray:
        """Status of each design: "ok", "infeasible", "not converged" or "lost", shape (n,)."""
        return np.array(STATUSES)[self.codes]

    @property
    def failed(self) -> IntArray:
        """Feasible designs without results, counted from 0."""
        return np.flatnonzero(self.codes >= STATUSES.index("not converged"))

    @property
    def failures(self) -> tuple[str, ...]:
        """Designs without results, or without those on fine angles, and why."""
        lost = [f"design {i + 1}: {self.reasons[i]}" for i in self.failed]
        fine = (row for row in self.fine.values() if row["status"] != "ok")
        return (*lost, *(f"design {row['design']}, on fine angles: {row['reason']}" for row in fine))

    def judged(self, key: str) -> FloatArray:
        """Return a result of all designs, those on fine angles where there are any, shape (n,)."""
        values = self.results[key].copy()
        for i, row in self.fine.items() if key in PEAKS else ():
            values[i] = np.nan if row["results"][key] is None else row["results"][key]
        return values

    def count(self, status: Status) -> int:
        """Return the number of designs with a status."""
        return int((self.codes == STATUSES.index(status)).sum())

    def design(self, i: int) -> dict[str, int | float]:
        """Return the keys of design `i`, counted from 0."""
        return {name: int(values[i]) if name in self.campaign.whole else float(values[i])
                for name, values in self.inputs.items()}  # fmt: skip
