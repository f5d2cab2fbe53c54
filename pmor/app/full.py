"""Full finite elements of a gear pair, in Python."""

from __future__ import annotations

import logging
from collections.abc import Iterable
from concurrent.futures import Executor
from dataclasses import dataclass

from pmor.app.asked import asked_case, positions
from pmor.app.result import SweepResult
from pmor.case import Case
from pmor.core.arrays import FloatArray
from pmor.core.progress import Steps, quietly
from pmor.gear.condition import Misalignment
from pmor.gear.modification import Modification
from pmor.line.unloaded import with_unloaded
from pmor.pair.conditions import conditions_of
from pmor.pair.limits import range_warnings
from pmor.pair.model import ElasticModel, MeshModel, approach_estimate, elastic_model, refuse_loads
from pmor.pair.sweep import sweep_ste
from pmor.work.cost import meshed_within_memory

_LOG = logging.getLogger("pmor")


@dataclass(frozen=True, eq=False, repr=False)
class FullModel:
    """Full finite-element contact of a pair: the truth of its mesh, milliseconds to seconds per position.

    Parameters
    ----------
    case : Case
    elastic : ElasticModel
        Meshes, and the compliance of both gears.
    """

    case: Case
    elastic: ElasticModel

    def sweep(
        self, torques_Nm: Iterable[float] | None = None, angles: int | FloatArray | None = None, *,
        misalignment: Misalignment | None = None, executor: Executor | None = None, progress: Steps = quietly,
        pinion: Modification | None = None, wheel: Modification | None = None
    ) -> SweepResult:  # fmt: skip
        """Solve full contact over angles and torques; see `ReducedModel.sweep`."""
        meshed = self.elastic.mesh.meshed
        case = asked_case(self.case, meshed.pair, torques_Nm, angles, misalignment, (pinion, wheel))
        refuse_loads(case, meshed)
        conditions, phi = conditions_of(case, case.online.torques_Nm), positions(case, meshed, angles)
        sweep = sweep_ste(meshed, self.elastic.elasticity_at, phi, conditions, lambda: progress(1), executor)
        return SweepResult(with_unloaded(sweep, meshed, conditions), meshed.pair)

    def __repr__(self) -> str:
        return f"<FullModel of {self.case!r}>"


def full_model(case: Case) -> FullModel:
    """Mesh both gears and solve for the compliance of their flanks.

    Raises
    ------
    CaseError, GeometryError, MeshError
        When there is no such gear, pair or mesh, or the load is beyond it.
    """
    return FullModel(case, solve_bodies(case, meshed_within_memory(case)))


def solve_bodies(case: Case, mesh: MeshModel) -> ElasticModel:
    """Solve for the compliance of the flanks of meshed gears; the log warns of an unusual pair."""
    pair = mesh.meshed.pair
    for warning in range_warnings(case, pair, approach_estimate(case, pair)):
        _LOG.warning("%s", warning)
    return elastic_model(case, mesh)
