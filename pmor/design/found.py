"""All variants of a search: which of them are chosen, and how sure the best is."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.design.files import DesignFile
from pmor.design.judge import Judge
from pmor.design.settings import Design
from pmor.design.variants import Variants, all_kept
from pmor.work.front import pareto_front

# Ends of descents from both halves of the samples that differ by less, over the better one, agree.
AGREE = 5e-3


@dataclass(frozen=True)
class Found:
    """All variants of a search."""

    judge: Judge  # For figures of single variants
    variants: Variants
    # shape (V,): Angles per pitch that results are of, whether they no longer move there, and the objective on those of
    # the search
    angles: IntArray
    settled: BoolArray
    searched: FloatArray
    evaluations: Mapping[str, int]  # Judgements of a variant, by stage; one with derivatives counts as one
    seconds: float  # Of this run, without the finite elements
    failures: tuple[str, ...]
    # Least objective that descents from each half of the samples ended at, on the angles of the search; NaN without one
    ends: tuple[float, float] = (np.nan, np.nan)
    final: bool = True  # Whether variants whose results still move are none to choose

    @property
    def file(self) -> DesignFile:
        """The design file."""
        return self.judge.file

    @property
    def design(self) -> Design:
        """Settings of the search."""
        return self.judge.design

    @property
    def kept(self) -> BoolArray:
        """Whether a variant is known and keeps all constraints, (V,)."""
        return all_kept(self.design, self.variants)

    @property
    def eligible(self) -> BoolArray:
        """Whether a variant may be chosen: it keeps all constraints, on fine angles, (V,)."""
        return np.asarray(self.kept & (self.settled | (not self.final)))

    @property
    def apart(self) -> float | None:
        """By how much the ends of both halves of the search differ, over the better one; None without both."""
        return apart(self.ends)

    @property
    def fine(self) -> Judge:
        """Judge on the most angles that a chosen variant took."""
        return self.judge.on_angles(int(self.angles.max()))

    @property
    def chosen(self) -> dict[str, int]:
        """Numbers of the best variants by name, such as "best at 170 N m"."""
        labels = self.design.load.labels
        numbers = {"best": self.best}
        if self.design.scatters:
            numbers["best without scatter"] = self.best_at(range(len(labels)))
        if len(labels) > 1:
            numbers |= {f"best at {labels[t]}": self.best_at([t]) for t in (0, len(labels) - 1)}
        return {name: n for name, n in numbers.items() if n is not None}

    @property
    def best(self) -> int | None:
        """The best variant that keeps all constraints."""
        value = np.where(self.eligible, self.variants.objective, np.inf)
        return int(value.argmin()) if np.isfinite(value).any() else None

    @property
    def against(self) -> FloatArray:
        """Result weighed against the objective, the largest over the torques, (V,)."""
        return np.asarray(
            self.variants.results[:, :, self.design.results.index(self.design.pareto.against)].max(axis=1)
        )

    @property
    def front(self) -> IntArray:
        """Variants that no other one beats in both, of those that keep all constraints."""
        values = np.stack([self.variants.objective, self.against], axis=1)
        return pareto_front(np.where(self.eligible[:, None], values, np.nan))

    def best_at(self, torques: Sequence[int]) -> int | None:
        """The variant of the least objective as drawn under some of the torques that keeps all constraints."""
        weights = np.array(self.design.load.weights)[list(torques)]
        column = self.design.results.index(self.design.objective.key)
        if not self.eligible.any() or not weights.any():
            return None
        value = self.variants.results[:, list(torques), column] @ weights
        return int(np.where(self.eligible, value, np.inf).argmin())


def apart(ends: tuple[float, float]) -> float | None:
    """Return by how much the least objectives of both halves differ, over the smaller one; None without both."""
    least = min(ends)
    return abs(ends[0] - ends[1]) / least if np.isfinite(sum(ends)) and least > 0.0 else None
