"""Flank modifications designed, as the Python API gives them."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from pmor.case import Case
from pmor.case.width import meshed_width
from pmor.core.arrays import FloatArray, IntArray
from pmor.core.errors import CaseError, ConvergenceError
from pmor.design.loader import DesignFile, case_of, read_design
from pmor.design.output import design_data, design_text
from pmor.design.readings import Readings, read_off
from pmor.design.run import Found, run_design
from pmor.gear.condition import Assembly
from pmor.pair.model import refuse_loads
from pmor_online.model import ReducedPair

# What messages call a design that no file holds.
WHERE = "design"


@dataclass(frozen=True, repr=False)
class DesignResult:
    """Variants of the flank modifications of a pair: V of n variables under T torques.

    Parameters
    ----------
    found : Found
    read : Readings
    """

    found: Found
    read: Readings

    @property
    def x(self) -> FloatArray:
        """Values of the variables, shape (V, n), each in its unit."""
        return self.found.variants.x

    @property
    def objective(self) -> FloatArray:
        """What was minimised, shape (V,), um."""
        return self.found.variants.objective

    @property
    def best(self) -> int | None:
        """Number of the best variant that keeps all constraints; None where none does."""
        return self.found.best

    @property
    def front(self) -> IntArray:
        """Numbers of the variants that no other one beats."""
        return self.found.front

    @property
    def data(self) -> Mapping[str, Any]:
        """Figures as plain data: the content of `design.json`."""
        return design_data(self.found, self.read)

    def result(self, key: str) -> FloatArray:
        """Return one result, such as ``peak_to_peak_um``, of all variants as drawn, shape (V, T)."""
        return np.asarray(self.found.variants.results[:, :, self.found.design.results.index(key)])

    def assembly(self, variant: int) -> Assembly:
        """Return how the pair of a variant is built, for `ReducedModel.sweep_conditions`."""
        return self.found.judge.assembly(self.x[variant])

    def __repr__(self) -> str:
        least = "none keeps the constraints" if self.best is None else f"best {self.objective[self.best]:.4g} um"
        return f"<DesignResult of {self.found.file.case.name!r}: {len(self.x)} variants, {least}>"

    def __str__(self) -> str:
        return design_text(self.found, self.read)


def search(
    case: Case, reduced: ReducedPair, jobs: int, announce: Callable[[str], None], settings: dict[str, Any]
) -> DesignResult:
    """Search for modifications; see `pmor.app.model.ReducedModel.design`."""
    design = read_design(settings, case, case.name, WHERE)
    wanted = case_of(design, case, WHERE)
    if meshed_width(case) == "half" != meshed_width(wanted):
        raise CaseError(
            f"{WHERE}: variables or scatter load the halves of the face differently, and the model has half the width: "
            'write [mesh] width = "whole" and train again'
        )
    if "root_stress_MPa" in design.results and reduced.basis.root_stress is None:
        raise CaseError(f"{WHERE}: root_stress_MPa: the model holds none: train with [results] root_stress = true")
    refuse_loads(replace(case, online=replace(case.online, torques_Nm=design.load.torques_Nm)), reduced.meshed)
    file = DesignFile(case.name, "", design, wanted, ())
    with tempfile.TemporaryDirectory() as folder:
        found = run_design(file, reduced, Path(folder), jobs, announce)
    if found.failures:
        raise ConvergenceError(f"{len(found.failures)} did not converge, first: {found.failures[0]}", [])
    return DesignResult(found, read_off(found))
