"""What the coupling of the teeth through their body does to motion: the same pair with every tooth and section alone.

Programs for gear design take teeth for thin slices that know neither each other nor their neighbours over the width. In
the line loads both couplings are terms of the compliance: here they are left out, and each tooth keeps all of its own,
that of its blank included. Where one pair of teeth carries, an even load bends it as before; where two carry, neither
feels the other, and the mesh is stiffer.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from pmor.body.flank_compliance import FlankCompliance
from pmor.core.arrays import FloatArray
from pmor.core.errors import ConvergenceError
from pmor.dynamics.force_law import forces_at
from pmor.dynamics.harmonic_balance import rms
from pmor.dynamics.measure import HZ, Data, Task, at_rest, needed_harmonics, speeds_of
from pmor.dynamics.operating import PHASES, static_displacement
from pmor.dynamics.quantities import UM
from pmor.dynamics.response import response
from pmor_online.model import ReducedPair

#: part of the work on a torque, beside those of `measure`
SLICES = "slices"
# Of light damping and of that at which the coupled pair hardly jumps any more.
DAMPING_RATIOS = 0.02, 0.05
# Points of the mesh cycle at which the stiffness is kept.
CYCLE = 128


@dataclass(frozen=True)
class SlicedPair(ReducedPair):
    """A reduced pair whose sections know nothing of each other."""

    @cached_property
    def section_compliance(self) -> tuple[FloatArray, FloatArray]:
        """Compliance of the sections, each by itself."""
        width = self.meshed.sections.width
        pinion, wheel = super().section_compliance
        alone = sections_alone(pinion, width)
        return alone, alone if wheel is pinion else sections_alone(wheel, width)


def sliced(reduced: ReducedPair) -> SlicedPair:
    """Return a reduced pair of line loads whose teeth and sections are alone."""
    compliance = without_neighbours(reduced.flank_compliance)
    return SlicedPair(replace(reduced.basis, compliance=compliance), reduced.meshed)


def without_neighbours(compliance: FlankCompliance) -> FlankCompliance:
    """Return a compliance of flanks by which a tooth moves under its own load alone."""
    pinion, wheel = compliance.gears
    alone = pinion[:1]
    return FlankCompliance((alone, alone if wheel is pinion else wheel[:1]), compliance.components)


def sections_alone(between: FloatArray, width: FloatArray) -> FloatArray:
    """Return a compliance of sections, each by itself as compliant as under one line load on all of them.

    Parameters
    ----------
    between : ndarray, shape (neighbours + 1, S, S, n, n)
        See `pmor.body.section_compliance`.
    width : ndarray, shape (S,)
    """
    diagonal = np.einsum("astij,t->asij", between, width) / width[:, None, None]
    alone = np.zeros_like(between)
    alone[:, np.arange(len(width)), np.arange(len(width))] = diagonal
    return alone


def compared(coupled: Task, alone: Task) -> Data:
    """Return stiffness, folds and response of a pair under a torque, with coupling and without.

    Raises
    ------
    ConvergenceError
        Where a table does not bear the torque.
    """
    return {"torque_Nm": coupled.torque_Nm, "coupled": _of(coupled), "slices": _of(alone)}


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
        found = response(rest.oscillator, task.law, limits, needed_harmonics(rest, limits))
    except ConvergenceError as error:
        return {"damping_ratio": task.damping_ratio, "folds": [], "branch": [], "lost": [str(error)]}
    main = found.branches[0]
    return {
        "damping_ratio": task.damping_ratio,
        "folds": [{"mesh_frequency_Hz": float(HZ * f.point.speed), "kind": f.kind} for f in found.folds],
        "branch": [
            {"mesh_frequency_Hz": float(HZ * point.speed), "stable": bool(stable), "dte_rms_um": float(UM * size)}
            for point, stable, size in zip(main.points, found.stable[0], rms(main.unknowns), strict=True)
        ],
        "lost": list(found.lost),
    }
