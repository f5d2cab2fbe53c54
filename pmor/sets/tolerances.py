"""Sets that are drawn within tolerances: each sample is solved as any other set, on the same finite elements.

Percentiles come from solutions, not from derivatives: the mesh load factor is a largest value over planets, has a kink
where two of them are equal, and planets lift off; a sample takes milliseconds.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, fields, replace

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.core.threads import in_order
from pmor.line.several import Workspaces
from pmor.pair.bounds import Bound
from pmor.sets.bounds import set_bounds
from pmor.sets.draws import drawn
from pmor.sets.loader import SetFile
from pmor.sets.lost import known
from pmor.sets.plan import with_errors
from pmor.sets.settings import SetSections
from pmor.sets.solution import SetSolution, solve_on


@dataclass(frozen=True, eq=False)
class Samples:
    """Sets drawn within tolerances, under D torques.

    Parameters
    ----------
    sections : tuple of SetSections
        Each sample as a set file says it.
    k_gamma, ste_peak_to_peak_um : ndarray, shape (n, D)
        Of the positions that have a solution; NaN where none has.
    lost : ndarray of int, shape (n, D)
        Positions without a solution.
    pitches : int
        Mesh cycles over which each sample is solved.
    bounds : tuple of tuple of (int, str, Bound)
        Under each torque the samples that leave their bounds, by number, with place and bound.
    """

    sections: tuple[SetSections, ...]
    k_gamma: FloatArray
    ste_peak_to_peak_um: FloatArray
    lost: IntArray
    pitches: int
    bounds: tuple[tuple[tuple[int, str, Bound], ...], ...]

    @property
    def missing(self) -> IntArray:
        """Number of samples without a result under each torque, (D,)."""
        return np.asarray(np.isnan(self.ste_peak_to_peak_um).sum(axis=0))

    @property
    def incomplete(self) -> IntArray:
        """Number of samples under each torque that have positions with and without a solution, (D,)."""
        return np.asarray((self.lost > 0).sum(axis=0)) - self.missing


def solve_samples(
    file: SetFile, solved: SetSolution, executor: Executor | None = None, pitches: int = 1
) -> Samples | None:
    """Solve all sets that the tolerances of a file draw, under the torques of its solution; None without tolerances.

    Parameters
    ----------
    executor : concurrent.futures.Executor, optional
        Of threads: shares out the samples, whose results do not depend on it.
    pitches : int
        Mesh cycles until what stands still in the housing of a gearbox stands as before.
    """
    if file.sections.tolerances is None:
        return None
    pitches = math.lcm(file.sample_pitches, pitches)
    sections, workspaces = tuple(drawn(file.sections)), Workspaces(solved.placed.blocks)

    def solve(said: SetSections) -> tuple[FloatArray, list[float], IntArray, list[list[tuple[str, Bound]]]]:
        errors = with_errors(file.plan, said)
        # On shafts other loads move the hubs too.
        moved = errors.displacement + (solved.plan.displacement - file.plan.displacement)
        plan = replace(solved.plan, displacement=moved, eccentricity=errors.eccentricity)
        found = solve_on(plan, solved.placed, solved.torque_Nm, pitches, workspaces=workspaces)
        left = [list(set_bounds(file, found, torque)) for torque in range(len(solved.torque_Nm))]
        return found.k_gamma, [known(np.ptp, ste) for ste in found.ste_um], (~found.converged).sum(axis=1), left

    k_gamma, peak_to_peak, lost, left = zip(*in_order(solve, sections, executor), strict=True)
    bounds = tuple(
        tuple((number, *bound) for number, of_sample in enumerate(left) for bound in of_sample[torque])
        for torque in range(len(solved.torque_Nm))
    )
    return Samples(sections, np.array(k_gamma), np.array(peak_to_peak), np.array(lost), pitches, bounds)


def lost_samples(samples: Samples, torques_Nm: Sequence[float]) -> tuple[str, ...]:
    """Return a sentence under each torque on samples that lack some of their positions, and on those that lack all."""
    found, whole = list[str](), len(samples.sections)
    for torque, some, none in zip(torques_Nm, samples.incomplete, samples.missing, strict=True):
        if some:
            rule = "have positions that did not converge: their figures are of the others"
            found.append(f"{torque:g} N m: {some} of {whole} sets within tolerances {rule}")
        if none:
            found.append(f"{torque:g} N m: {none} of {whole} sets within tolerances did not converge: left out")
    return tuple(found)


def sample_bounds(samples: Samples, torques_Nm: Sequence[float]) -> tuple[str, ...]:
    """Return what samples leave under each torque: how many of them, and the worst one."""
    found = []
    for torque, left in zip(torques_Nm, samples.bounds, strict=True):
        for kind in dict.fromkeys(bound.kind for *_, bound in left):
            those = [one for one in left if one[2].kind == kind]
            number, place, worst = max(those, key=lambda one: one[2].size)
            count = len({sample for sample, *_ in those})
            found.append(
                f"{torque:g} N m, {count} of {len(samples.sections)} sets within tolerances: {kind}; the worst is "
                f"sample {number}, {place}: {worst.text}"
            )
    return tuple(found)


def sample_rows(samples: Samples, torques_Nm: FloatArray) -> list[dict[str, float]]:
    """Return a row for each sample: its errors by the keys of a set file, and its results under each torque."""
    rows = []
    for number, said in enumerate(samples.sections):
        row: dict[str, float] = {"sample": number}
        for section in (said.planets, said.eccentricity):
            for field in fields(section):
                values = getattr(section, field.name)
                if field.name.endswith(("_um", "_mrad", "planets_deg")) and isinstance(values, tuple):
                    row |= {f"{field.name}_{place}": value for place, value in enumerate(values, start=1)}
                elif isinstance(values, float):
                    row[field.name] = values
        for place, torque in enumerate(torques_Nm.tolist()):
            row[f"k_gamma_{torque:g}_Nm"] = float(samples.k_gamma[number, place])
            row[f"ste_peak_to_peak_um_{torque:g}_Nm"] = float(samples.ste_peak_to_peak_um[number, place])
            if samples.lost.any():
                row[f"lost_positions_{torque:g}_Nm"] = float(samples.lost[number, place])
        rows.append(row)
    return rows
