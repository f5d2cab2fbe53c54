"""The front door of motion: load a case, run it, write the result."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from pmor.case import Case, load_case, text_of
from pmor.core.arrays import FloatArray
from pmor.dynamics.figures import motion_figure, response_figure, waterfall_figure
from pmor.dynamics.measure import Data
from pmor.dynamics.output import FILES, dynamics_data, dynamics_report, dynamics_text
from pmor.dynamics.rating import rated
from pmor.dynamics.run import Dynamics, reduced_of, refuse_other_models, run_dynamics
from pmor.report.data_files import write_summary_json
from pmor.work.results import pieces_folder, writing_results
from pmor_online.model import ReducedPair

if TYPE_CHECKING:
    from matplotlib.figure import Figure

#: settings of a case file, with its section `[dynamics]`
load = load_case


@dataclass(frozen=True, repr=False)
class DynamicsResult:
    """Responses of a pair over its speed, one per torque.

    Parameters
    ----------
    found : Dynamics
    """

    found: Dynamics

    @property
    def data(self) -> Data:
        """All of it as plain data: the content of `dynamics.json`."""
        return dynamics_data(self.found)

    @property
    def torque_Nm(self) -> FloatArray:
        """Mean torques, shape (T,), N m."""
        return self._numbers("torque_Nm")

    @property
    def natural_frequency_Hz(self) -> FloatArray:
        """Natural frequencies with the mean mesh stiffness, shape (T,), Hz."""
        return self._numbers("natural_frequency_Hz")

    @property
    def folds(self) -> tuple[tuple[Data, ...], ...]:
        """Jumps of motion, for each torque: mesh frequency, transmission error, and the direction of speed."""
        return tuple(tuple(response["folds"]) for response in self.found.responses)

    @property
    def failures(self) -> tuple[str, ...]:
        """Torques without a response, or a part of it, and why; empty when all are there."""
        return self.found.failures

    def plot_response(self) -> Figure:
        """Transmission error and dynamic factor over the mesh frequency."""
        found = self.found
        factors = [rated(found.case, found.pair, found.model.mass, response) for response in found.responses]
        return response_figure(found.responses, factors)

    def plot_waterfall(self) -> Figure | None:
        """Orders along the run-up; None without a run."""
        return waterfall_figure(self.found.responses)

    def plot_motion(self) -> Figure | None:
        """The largest stable motion of each torque, in the phase plane and over the mesh cycle."""
        return motion_figure(self.found.responses)

    def to_json(self, path: Path | str, overwrite: bool = False) -> None:
        """Write the content of `dynamics.json`.

        Raises
        ------
        OutputError
        """
        write_summary_json(Path(path), self.data, overwrite)

    def write(self, folder: Path | str, *, overwrite: bool = False) -> None:
        """Write `dynamics.json`, `dynamics.md`, `report.html` and the pictures; remove finished pieces.

        Pieces stay where something failed: the next run takes them over.

        Parameters
        ----------
        folder : Path or str
        overwrite : bool
            Replace files of these names whoever wrote them.

        Raises
        ------
        OutputError
        """
        text, complete = text_of(self.found.case), not self.failures
        with writing_results(folder, FILES, text, overwrite=overwrite, complete=complete) as out:
            dynamics_report(self.found).write(out)

    def _numbers(self, key: str) -> FloatArray:
        return np.array([response[key] for response in self.found.responses])

    def __repr__(self) -> str:
        count = sum(len(folds) for folds in self.folds)
        torques = ", ".join(f"{torque:g}" for torque in self.torque_Nm)
        return f"<DynamicsResult of {self.found.case.name!r}: {torques} N m, {count} folds>"

    def __str__(self) -> str:
        return dynamics_text(self.found)


def run(
    settings: Case,
    *,
    reduced: ReducedPair | None = None,
    folder: Path | str | None = None,
    overwrite: bool = False,
    executor: Executor | None = None,
    progress: Callable[[int], None] | None = None,
) -> DynamicsResult:
    """Find the motion of the pair of a case over its speed, under each torque.

    Parameters
    ----------
    settings : Case
    reduced : ReducedPair, optional
        Reduced model of the pair, by line loads; by default it is made.
    folder : Path or str, optional
        Of the results: finished pieces are kept there, and taken over by the next run.
    overwrite : bool
        Files in the folder may be replaced later, whoever wrote them; otherwise they are refused before the work.
    executor : concurrent.futures.Executor, optional
        Of processes, for the pieces of work; by default they are done here, one after the other.
    progress : callable, optional
        Called with how many more pieces are there.

    Returns
    -------
    DynamicsResult
        Of all torques that have a response; the others are named in `failures`.

    Raises
    ------
    CaseError
        Where the case has no line loads, or a torque is beyond the range of its contact.
    ConvergenceError
        Where no torque has a force law.
    OutputError
    """
    refuse_other_models(settings)
    reduced = reduced or reduced_of(settings)
    with pieces_folder(folder, FILES, overwrite=overwrite) as pieces:
        return DynamicsResult(run_dynamics(settings, reduced, pieces, executor=executor, progress=progress))
