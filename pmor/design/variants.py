"""Many variants: in arrays, as plain data of finished pieces, in a file meanwhile, and which of them are chosen."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.design.descent import kept
from pmor.design.files import DesignFile
from pmor.design.judge import Judge, Verdict
from pmor.design.settings import Design
from pmor.storage.design_file import DesignResults, write_design_file
from pmor.work.front import pareto_front
from pmor.work.pieces import Result

#: name of the file of all variants that are finished, in the folder of finished pieces
STORE = "variants.h5"
# The file is written anew when there are so many times its variants.
GROWTH = 1.1
# Ends of descents from both halves of the samples that differ by less, over the better one, agree.
AGREE = 5e-3
ARRAYS = ("x", "results", "objective", "limits")


@dataclass(frozen=True)
class Variants:
    """Variants that were judged: V of n variables, T torques, R results, C constraints."""

    x: FloatArray  # shape (V, n)
    results: FloatArray  # shape (V, T, R): Nominal; NaN where a position did not converge
    objective: FloatArray  # shape (V,)
    limits: FloatArray  # shape (V, C)
    # Origin of each: "sample", "aligned axes" (best there), "descent", "trade-off", "nominal" (best without scatter),
    # "170 N m" (best for that load alone)
    origin: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.x)


def as_data(verdicts: Sequence[Verdict], origin: str, evaluations: int) -> Result:
    """Return verdicts of one origin as plain data, with the judgements that they took."""
    return {
        "x": [v.x.tolist() for v in verdicts], "results": [v.results.tolist() for v in verdicts],
        "objective": [v.objective for v in verdicts], "limits": [v.limits.tolist() for v in verdicts],
        "origin": [origin] * len(verdicts), "evaluations": evaluations,
    }  # fmt: skip


def from_data(part: Result, design: Design) -> Variants:
    """Turn the content of a part file into arrays; null is NaN."""
    count, torques = len(part["x"]), len(design.load.labels)
    return Variants(
        np.array(part["x"], dtype=float).reshape(count, len(design.variables)),
        np.array(part["results"], dtype=float).reshape(count, torques, len(design.results)),
        np.array(part["objective"], dtype=float),
        np.array(part["limits"], dtype=float).reshape(count, len(design.constraints)),
        tuple(part["origin"]),
    )


def together(parts: Sequence[Variants]) -> Variants:
    """Return variants one behind the other."""
    arrays = {name: np.concatenate([getattr(part, name) for part in parts]) for name in ARRAYS}
    return Variants(origin=tuple(origin for part in parts for origin in part.origin), **arrays)


class Store:
    """Keeps a file of all variants that are finished, in the folder of finished pieces."""

    def __init__(self, file: DesignFile, folder: Path) -> None:
        self._file, self._path = file, folder / STORE
        self._parts: list[Variants] = []
        self._count = self._written = 0

    def take_over(self, variants: Variants) -> None:
        """Add variants of an earlier run; they are written with the next new ones."""
        self._parts.append(variants)
        self._count += len(variants)

    def add(self, variants: Variants) -> None:
        """Add variants; write the file where it lacks a tenth of them: in all, eleven times their number at most."""
        self.take_over(variants)
        if self._count >= GROWTH * self._written:
            write_design_file(self._path, stored(self._file, together(self._parts)))
            self._written = self._count


def stored(file: DesignFile, variants: Variants) -> DesignResults:
    """Return the content of a file of variants."""
    design = file.design
    origins = tuple(dict.fromkeys(variants.origin))
    low, high = np.array([v.range for v in design.variables]).T
    weight = np.array(design.load.weights)
    arrays = {
        "torque": np.array(design.load.torques_Nm),
        "weight": weight / weight.sum(),
        "lowest": low,
        "highest": high,
        "x": variants.x,
        "results": variants.results,
        "objective": variants.objective,
        "kept": all_kept(design, variants),
        "origin": np.array([origins.index(o) for o in variants.origin], dtype=np.int64),
    }
    if design.constraints:
        arrays["limits"] = variants.limits
    constraints = tuple(f"{c.key} at most {c.at_most:g}" for c in design.constraints)
    return DesignResults(
        file.text, tuple(v.name for v in design.variables), design.results, constraints, origins, (), arrays
    )


def all_kept(design: Design, variants: Variants) -> BoolArray:
    """Return whether variants are known and keep all constraints, (V,)."""
    return np.asarray(kept(design.constraints, variants.limits) & np.isfinite(variants.objective))



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
