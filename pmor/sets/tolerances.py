"""Sets and trains that are drawn within tolerances: each is solved as any other, on the same finite elements."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import fields, replace

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.core.threads import in_order
from pmor.line.several import Workspaces
from pmor.pair.bounds import Bound
from pmor.pair.samples import Samples
from pmor.sets.bounds import set_bounds
from pmor.sets.draws import MadeOfSet, drawn, made_flanks
from pmor.sets.loader import SetFile
from pmor.sets.lost import known
from pmor.sets.plan import with_errors
from pmor.sets.settings import SetSections
from pmor.sets.solution import SetSolution, solve_on

# Of all meshes the largest.
OF_MESHES = ("k_h_beta", "flank_pressure_max_MPa")


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
    made = tuple(made_flanks(file.sections.tolerances, solved))

    def solve(
        sample: tuple[SetSections, MadeOfSet],
    ) -> tuple[Mapping[str, FloatArray], IntArray, list[list[tuple[str, Bound]]]]:
        said, flanks = sample
        errors = with_errors(file.plan, said)
        # On shafts other loads move the hubs too.
        moved = errors.displacement + (solved.plan.displacement - file.plan.displacement)
        plan = replace(solved.plan, displacement=moved, eccentricity=errors.eccentricity, meshes=flanks.meshes)
        found = solve_on(plan, solved.placed, solved.torque_Nm, pitches, workspaces=workspaces)
        left = [list(set_bounds(file, found, torque)) for torque in range(len(solved.torque_Nm))]
        return sampled_figures(found), (~found.converged).sum(axis=1), left

    samples = tuple(zip(sections, made, strict=True))
    figures, lost, left = zip(*in_order(solve, samples, executor), strict=True)
    bounds = tuple(
        tuple((number, *bound) for number, of_sample in enumerate(left) for bound in of_sample[torque])
        for torque in range(len(solved.torque_Nm))
    )
    each = {key: np.array([row[key] for row in figures]) for key in figures[0]}
    rows = tuple(_errors(said) | flanks.errors for said, flanks in samples)
    return Samples("sets", rows, each, np.array(lost), pitches, bounds)


def sampled_figures(solved: SetSolution) -> dict[str, FloatArray]:
    """Return what is told of sets within tolerances, of one of them under each torque, (D,)."""
    found = {"ste_peak_to_peak_um": np.array([known(np.ptp, ste) for ste in solved.ste_um])}
    if solved.plan.planets:
        found["k_gamma"] = solved.k_gamma
    elif paths := [mesh for mesh, beside in enumerate(solved.beside) if len(beside) > 1]:
        found["share_max"] = np.array([known(np.max, share[:, paths]) for share in solved.mesh_share])
    return found | {
        key: np.fmax.reduce([figures[key] for figures in solved.mesh_figures], axis=0) for key in OF_MESHES
    }


def _errors(said: SetSections) -> dict[str, float]:
    """Errors of a set by the keys of its file; of trains those of each gear behind its name."""
    row: dict[str, float] = {}
    for section in (said.planets, said.eccentricity):
        for field in fields(section) if not said.gears else ():
            values = getattr(section, field.name)
            if field.name.endswith(("_um", "_mrad", "planets_deg")) and isinstance(values, tuple):
                row |= {f"{field.name}_{place}": value for place, value in enumerate(values, start=1)}
            elif isinstance(values, float):
                row[field.name] = values
    keys: Sequence[str] = ("timing_mrad", "eccentricity_um", "eccentricity_deg")
    return row | {f"{gear.name}.{key}": getattr(gear, key) for gear in said.gears for key in keys}
