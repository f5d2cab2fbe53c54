"""Thin slices in motion: the effect of the coupling between teeth, and between sections of a tooth.

Programs for gear design take teeth for thin slices without coupling, neither to other teeth nor over the width. In line
loads both couplings are terms of the compliance: here they are zero, and each tooth keeps all of its own.
"""

from __future__ import annotations

from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from pmor.body.flank_compliance import FlankCompliance
from pmor.case import Case
from pmor.core.arrays import FloatArray
from pmor.core.errors import CaseError, ConvergenceError
from pmor.dynamics.force_law import PHASES, forces_at, static_displacement
from pmor.dynamics.gear_model import gear_model
from pmor.dynamics.harmonic_balance import rms
from pmor.dynamics.law import cycles_of, force_law
from pmor.dynamics.measure import HZ, Data, Task, at_rest, needed_harmonics, speeds_of
from pmor.dynamics.quantities import UM
from pmor.dynamics.response import response
from pmor.dynamics.solution import reduced_of, task_of
from pmor_online.model import ReducedPair

# Light damping, and one at which the coupled pair hardly jumps any more.
DAMPING_RATIOS = 0.02, 0.05
# Points of the mesh cycle at which the stiffness is kept.
CYCLE = 128


def run_slices(case: Case, *, reduced: ReducedPair | None = None, executor: Executor | None = None) -> list[Data]:
    """Return stiffness, folds and response under each torque of `[dynamics]`, with the coupling and without.

    `executor` shares out the force laws; see `pmor.dynamics.force_table.tabulate`.

    Raises
    ------
    CaseError, ConvergenceError
        As `pmor.dynamics.law.force_law`, and where a table does not bear a torque.
    """
    reduced = reduced or reduced_of(case)
    if cycles_of(case, reduced.meshed.pair) > 1:
        raise CaseError(
            f"case {case.name}: motion does not repeat with the mesh, and has no branches to compare: leave out "
            "pitch_deviations_um, waves, a topography of each tooth, holes and lugs"
        )
    model = gear_model(case, reduced.meshed.pair)
    compliance = without_neighbours(reduced.flank_compliance)
    sliced = SlicedPair(replace(reduced.basis, compliance=compliance), reduced.meshed)
    laws = {name: force_law(case, pair, executor)[0] for name, pair in (("coupled", reduced), ("slices", sliced))}
    return [
        {"torque_Nm": torque, **{kind: _of(task_of(case, model, law, torque)) for kind, law in laws.items()}}
        for torque in case.dynamics.torques_Nm
    ]


@dataclass(frozen=True)
class SlicedPair(ReducedPair):
    """A reduced pair without coupling between sections."""

    @cached_property
    def section_compliance(self) -> tuple[FloatArray, FloatArray]:
        """Compliance of the sections, each by itself as compliant as under one line load on all of them."""
        width, sections = self.layered.sections.width, np.arange(len(self.layered.sections.width))
        pinion, wheel = super().section_compliance
        alone = np.zeros_like(pinion), np.zeros_like(wheel)
        for compliance, between in zip(alone, (pinion, wheel), strict=True):
            compliance[:, sections, sections] = np.einsum("astij,t->asij", between, width) / width[:, None, None]
        return alone


def without_neighbours(compliance: FlankCompliance) -> FlankCompliance:
    """Return a compliance of flanks without the terms between teeth."""
    pinion, wheel = compliance.gears
    return replace(compliance, gears=(pinion[:1], wheel[:1]))


def _of(task: Task) -> Data:
    rest = at_rest(task)
    phase = np.asarray(2.0 * np.pi / PHASES * np.arange(PHASES), dtype=float)
    static = static_displacement(task.law, float(rest.oscillator.load[0]), phase, rest.interval)
    stiffness = 1e-3 * forces_at(task.law, phase, static)[1]
    return {
        "natural_frequency_Hz": float(HZ * rest.natural),
        "mesh_stiffness_mean_N_per_um": float(stiffness.mean()),
        "mesh_stiffness_min_N_per_um": float(stiffness.min()),
        "mesh_stiffness_max_N_per_um": float(stiffness.max()),
        "mesh_stiffness_N_per_um": stiffness[:: PHASES // CYCLE].tolist(),
        "responses": [_damped(replace(task, damping_ratio=ratio, mesh_damping=None)) for ratio in DAMPING_RATIOS],
    }


def _damped(task: Task) -> Data:
    rest = at_rest(task)
    limits = speeds_of(task, rest)
    try:
        solved = response(rest.oscillator, task.law, limits, needed_harmonics(rest, limits))
    except ConvergenceError as error:
        return {"damping_ratio": task.damping_ratio, "folds": [], "branch": [], "lost": [str(error)]}
    main = solved.branches[0]
    return {
        "damping_ratio": task.damping_ratio,
        "folds": [{"mesh_frequency_Hz": float(HZ * f.point.speed), "kind": f.kind} for f in solved.folds],
        "branch": [
            {"mesh_frequency_Hz": float(HZ * point.speed), "stable": bool(stable), "dte_rms_um": float(UM * size)}
            for point, stable, size in zip(main.points, solved.stable[0], rms(main.unknowns), strict=True)
        ],
        "lost": list(solved.lost),
    }
