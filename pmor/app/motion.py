"""The pair in motion, as the Python API gives it."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from pmor.case import Case, change_case
from pmor.core.arrays import FloatArray
from pmor.core.errors import ConvergenceError
from pmor.dynamics.figures import motion_figure, response_figure, waterfall_figure
from pmor.dynamics.measure import Data
from pmor.dynamics.output import dynamics_data, dynamics_text
from pmor.dynamics.rating import rated
from pmor.dynamics.run import Dynamics, refuse_other_models, run_dynamics
from pmor.report.data_files import write_summary_json
from pmor_online.model import ReducedPair

if TYPE_CHECKING:
    from matplotlib.figure import Figure


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
        """Where motion jumps, for each torque: mesh frequency, transmission error, and in which direction of speed."""
        return tuple(tuple(response["folds"]) for response in self.found.responses)

    def plot_response(self) -> Figure:
        """Transmission error and dynamic factor over the mesh frequency."""
        found = self.found
        factors = [rated(found.case, found.pair, found.model.mass, response) for response in found.responses]
        return response_figure(found.responses, factors)

    def plot_waterfall(self) -> Figure | None:
        """Orders along the run-up; None where there is none."""
        return waterfall_figure(self.found.responses)

    def plot_motion(self) -> Figure | None:
        """The largest stable motion of each torque, in the phase plane and over the mesh cycle."""
        return motion_figure(self.found.responses)

    def to_json(self, path: Path | str, overwrite: bool = False) -> None:
        """Write what `pmor dynamics` leaves as `dynamics.json`.

        Raises
        ------
        OutputError
        """
        write_summary_json(Path(path), self.data, overwrite)

    def _numbers(self, key: str) -> FloatArray:
        return np.array([response[key] for response in self.found.responses])

    def __repr__(self) -> str:
        count = sum(len(folds) for folds in self.folds)
        torques = ", ".join(f"{torque:g}" for torque in self.torque_Nm)
        return f"<DynamicsResult of {self.found.case.name!r}: {torques} N m, {count} folds>"

    def __str__(self) -> str:
        return dynamics_text(self.found)


def respond(
    case: Case, reduced: ReducedPair, jobs: int, announce: Callable[[str], None], settings: dict[str, Any]
) -> DynamicsResult:
    """Solve for the motion of a pair; see `pmor.app.model.ReducedModel.dynamics`."""
    asked = change_case(case, dynamics=settings) if settings else case
    refuse_other_models(asked)
    with tempfile.TemporaryDirectory() as folder:
        found = run_dynamics(asked, reduced, Path(folder), jobs, announce)
    if found.failures:
        raise ConvergenceError(f"{len(found.failures)} torques have no response, first: {found.failures[0]}", [])
    return DynamicsResult(found)
