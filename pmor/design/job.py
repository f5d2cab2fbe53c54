"""The front door of designs: load a design file, search, write the result."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from pmor.case import Case
from pmor.case.width import meshed_width
from pmor.core.arrays import FloatArray, IntArray
from pmor.core.errors import CaseError
from pmor.design.loader import DesignFile, case_of, load_design, read_design
from pmor.design.output import FILES, design_data, design_text, write_design
from pmor.design.readings import Readings, read_off
from pmor.design.run import Found, run_design, trained_pair
from pmor.gear.condition import Assembly
from pmor.pair.model import refuse_loads
from pmor.work.results import pieces_folder, writing_results
from pmor_online.model import ReducedPair

# Place of a design without a file, in messages.
WHERE = "design"
#: settings of a design file
load = load_design


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
        """The minimised value, shape (V,), um; NaN without a solution."""
        return self.found.variants.objective

    @property
    def best(self) -> int | None:
        """Number of the best variant that keeps all constraints; None if none does."""
        return self.found.best

    @property
    def front(self) -> IntArray:
        """Numbers of the variants on the Pareto front."""
        return self.found.front

    @property
    def data(self) -> Mapping[str, Any]:
        """Figures as plain data: the content of `design.json`."""
        return design_data(self.found, self.read)

    @property
    def failures(self) -> tuple[str, ...]:
        """Variants without a solution and pieces of the search that stopped, and why."""
        return self.found.failures

    def result(self, key: str) -> FloatArray:
        """Return one result, such as ``peak_to_peak_um``, of all variants as drawn, shape (V, T)."""
        return np.asarray(self.found.variants.results[:, :, self.found.design.results.index(key)])

    def assembly(self, variant: int) -> Assembly:
        """Return the assembly of a variant, for `ReducedModel.sweep_conditions`."""
        return self.found.judge.assembly(self.x[variant])

    def write(self, folder: Path | str, *, overwrite: bool = False) -> None:
        """Write `design.h5`, `design.csv`, `design.json`, `design.md`, `report.html` and the pictures.

        Finished pieces are removed; they stay where something failed: the next run takes them over.

        Parameters
        ----------
        folder : Path or str
        overwrite : bool
            Replace files of these names whoever wrote them.

        Raises
        ------
        OutputError
        """
        file, complete = self.found.file, not self.failures
        with writing_results(
            folder, FILES, file.text, inputs=file.inputs, overwrite=overwrite, complete=complete
        ) as out:
            write_design(self.found, self.read, out)

    def __repr__(self) -> str:
        least = "none keeps the constraints" if self.best is None else f"best {self.objective[self.best]:.4g} um"
        return f"<DesignResult of {self.found.file.case.name!r}: {len(self.x)} variants, {least}>"

    def __str__(self) -> str:
        return design_text(self.found, self.read)


def settings_of(case: Case, sections: Mapping[str, Any]) -> DesignFile:
    """Return the settings that a design file with these sections would give.

    Parameters
    ----------
    case : Case
        Base case.
    sections : mapping
        As TOML reads them.

    Raises
    ------
    CaseError
    """
    design = read_design(sections, case, case.name, WHERE)
    return DesignFile(case.name, f"{sections!r}\n{case.text}", design, case_of(design, case, WHERE), ())


def run(
    settings: DesignFile,
    *,
    reduced: ReducedPair | None = None,
    folder: Path | str | None = None,
    overwrite: bool = False,
    executor: Executor | None = None,
    progress: Callable[[int], None] | None = None,
) -> DesignResult:
    """Search flank modifications over ranges, with tolerances.

    Parameters
    ----------
    settings : DesignFile
    reduced : ReducedPair, optional
        Reduced model of the pair, by line loads; by default it is made.
    folder : Path or str, optional
        Of the results: finished pieces are kept there, and taken over by the next run.
    overwrite : bool
        Files in the folder may be replaced later, whoever wrote them; otherwise they are refused before the work.
    executor : concurrent.futures.Executor, optional
        Of threads, for the pieces of work; by default they are done here, one after the other.
    progress : callable, optional
        Called with how many more pieces are there; their number grows with each stage of the search.

    Returns
    -------
    DesignResult
        Of all variants; those without a solution are named in `failures`.

    Raises
    ------
    CaseError
        Where a torque is beyond the range of the contact, or the reduced model does not suffice.
    OutputError
    """
    if reduced is None:
        reduced = trained_pair(settings)
    else:
        _refuse_unfit(settings, reduced)
    with pieces_folder(folder, FILES, inputs=settings.inputs, overwrite=overwrite) as pieces:
        found = run_design(settings, reduced, pieces, executor=executor, progress=progress)
        return DesignResult(found, read_off(found))


def _refuse_unfit(file: DesignFile, reduced: ReducedPair) -> None:
    """Raise CaseError where a model that was trained for another purpose does not suffice."""
    case = reduced.basis.case
    if meshed_width(case) == "half" != meshed_width(file.case):
        raise CaseError(
            f"{file.name}: variables or scatter load the halves of the face differently, and the model has half the "
            'width: write [mesh] width = "whole" and train again'
        )
    if "root_stress_MPa" in file.design.results and reduced.basis.root_stress is None:
        raise CaseError(f"{file.name}: root_stress_MPa: the model holds none: train with [results] root_stress = true")
    refuse_loads(replace(case, online=replace(case.online, torques_Nm=file.design.load.torques_Nm)), reduced.meshed)
