"""Many variants: in arrays, as plain data of finished pieces, and in a file to be read at any time meanwhile."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pmor.core.arrays import BoolArray, FloatArray
from pmor.design.descent import kept
from pmor.design.files import DesignFile
from pmor.design.judge import Verdict
from pmor.design.settings import Design
from pmor.storage.design_file import DesignResults, write_design_file
from pmor.work.pieces import Result

#: name of the file of all variants that are finished, in the folder of finished pieces
STORE = "variants.h5"
# The file is written anew when there are so many times its variants.
GROWTH = 1.1
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
