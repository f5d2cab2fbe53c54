"""Pairs, sets and trains that are drawn within tolerances, each solved as any other: their results under each torque.

Percentiles come from solutions, not from derivatives: largest values over teeth and planets have kinks where two of
them are equal, and planets lift off; a sample takes milliseconds.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.pair.bounds import Bound

# Percentiles of machines within tolerances.
PERCENT = (5.0, 50.0, 95.0, 99.0)
#: what sets leave of their bounds under a torque: the number of the sample, place and bound
SampleBounds = tuple[tuple[int, str, Bound], ...]


@dataclass(frozen=True, eq=False)
class Samples:
    """Machines drawn within tolerances, under D torques.

    Parameters
    ----------
    made : str
        What they are, in words: "sets".
    errors : tuple of dict
        Of each sample, by the keys of a file.
    figures : mapping of str to ndarray, shape (n, D)
        By keys of `pmor.results.quantities`, of the positions that have a solution; NaN where none has.
    lost : ndarray of int, shape (n, D)
        Positions without a solution.
    pitches : int
        Mesh cycles over which each sample is solved.
    bounds : tuple of SampleBounds
        Of each torque.
    """

    made: str
    errors: tuple[dict[str, float], ...]
    figures: Mapping[str, FloatArray]
    lost: IntArray
    pitches: int
    bounds: tuple[SampleBounds, ...] = ()

    @property
    def missing(self) -> IntArray:
        """Number of samples without a result under each torque, (D,)."""
        return np.asarray(np.isnan(self.figures["ste_peak_to_peak_um"]).sum(axis=0))

    @property
    def incomplete(self) -> IntArray:
        """Number of samples under each torque that have positions with and without a solution, (D,)."""
        return np.asarray((self.lost > 0).sum(axis=0)) - self.missing


def lost_samples(samples: Samples, torques_Nm: Sequence[float]) -> tuple[str, ...]:
    """Return a sentence under each torque on samples that lack some of their positions, and on those that lack all."""
    found, whole = list[str](), f"{len(samples.errors)} {samples.made} within tolerances"
    for torque, some, none in zip(torques_Nm, samples.incomplete, samples.missing, strict=True):
        if some:
            rule = "have positions that did not converge: their figures are of the others"
            found.append(f"{torque:g} N m: {some} of {whole} {rule}")
        if none:
            found.append(f"{torque:g} N m: {none} of {whole} did not converge: left out")
    return tuple(found)


def sample_bounds(samples: Samples, torques_Nm: Sequence[float]) -> tuple[str, ...]:
    """Return what samples leave under each torque: how many of them, and the worst one."""
    found = []
    for torque, left in zip(torques_Nm, samples.bounds, strict=True):
        for kind in dict.fromkeys(bound.kind for *_, bound in left):
            those = [row for row in left if row[2].kind == kind]
            number, place, worst = max(those, key=lambda row: row[2].size)
            count = len({sample for sample, *_ in those})
            found.append(
                f"{torque:g} N m, {count} of {len(samples.errors)} {samples.made} within tolerances: {kind}; the worst "
                f"is sample {number}, {place}: {worst.text}"
            )
    return tuple(found)


def sample_rows(samples: Samples, torques_Nm: Iterable[float]) -> list[dict[str, float]]:
    """Return a row for each sample: its errors by the keys of a file, and its results under each torque."""
    rows = []
    for number, errors in enumerate(samples.errors):
        row: dict[str, float] = {"sample": number, **errors}
        for place, torque in enumerate(torques_Nm):
            row |= {f"{key}_{torque:g}_Nm": float(values[number, place]) for key, values in samples.figures.items()}
            if samples.lost.any():
                row[f"lost_positions_{torque:g}_Nm"] = float(samples.lost[number, place])
        rows.append(row)
    return rows


def sample_data(
    samples: Samples, as_filed: Mapping[str, Sequence[float] | FloatArray], torques_Nm: Sequence[float]
) -> dict[str, Any]:
    """Return percentiles under each torque as plain data, beside figures of the machine without tolerances, (D,)."""
    rows = []
    for number, torque in enumerate(torques_Nm):
        row: dict[str, Any] = {"torque_Nm": torque, "missing": int(samples.missing[number]),
                               "incomplete": int(samples.incomplete[number])}  # fmt: skip
        for key, values in samples.figures.items():
            there = values[:, number][np.isfinite(values[:, number])]
            found = np.percentile(there, PERCENT).tolist() if len(there) else [None] * len(PERCENT)
            filed = float(as_filed[key][number])
            row[key] = {"as_filed": filed if np.isfinite(filed) else None,
                        "mean": float(np.mean(there)) if len(there) else None}  # fmt: skip
            row[key] |= {f"percentile_{percent:g}": value for percent, value in zip(PERCENT, found, strict=True)}
        rows.append(row)
    return {"samples": len(samples.errors), "pitches": samples.pitches, "torques": rows}
