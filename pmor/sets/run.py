"""The front door of sets: a set file in, its result out."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from pathlib import Path

import numpy as np

from pmor.core.progress import quietly
from pmor.sets.loader import SetFile
from pmor.sets.model import build_train
from pmor.sets.output import FILES, SAMPLE_FILES
from pmor.sets.result import SetResult
from pmor.sets.solution import solve_set
from pmor.sets.tolerances import solve_samples
from pmor.work.results import pieces_folder


def run(
    file: SetFile, *, folder: Path | str | None = None, overwrite: bool = False, executor: Executor | None = None,
    progress: Callable[[int], None] | None = None,
) -> SetResult:  # fmt: skip
    """Solve a set over a mesh cycle under all its torques; those with positions not converged are in `failures`.

    Parameters
    ----------
    folder, overwrite, executor, progress
        As in `pmor.app.capabilities`; members are solved one after the other, whatever the executor.

    Raises
    ------
    CaseError, GeometryError, MeshError, OutputError
    """
    step, plan = progress or quietly, file.plan
    with pieces_folder(folder, (*FILES, *SAMPLE_FILES), inputs=file.inputs, overwrite=overwrite):
        train = build_train(file.cases, plan.bodies, plan.meshes, plan.free, plan.compliance)
        step(1)
        amounts = sorted({plan.nominal_Nm, *file.sections.sweep.torques_Nm})
        torques = np.array(amounts) * plan.torque_Nm / plan.nominal_Nm
        solved = solve_set(plan, train, torques, file.sections.sweep.angles_per_pitch, file.pitches)
        samples = solve_samples(file, solved)
        step(1)
    failures = tuple(
        f"{amount:g} N m: {int((~row).sum())} of {len(row)} positions did not converge"
        for amount, row in zip(amounts, solved.converged, strict=True)
        if not row.all()
    )
    if samples is not None:
        failures += tuple(
            f"{amount:g} N m: {count} of {len(samples.sections)} sets within tolerances did not converge: left out"
            for amount, count in zip(amounts, samples.missing, strict=True)
            if count
        )
    return SetResult(file, solved, samples, failures)
