"""Full finite elements of a gear pair, in Python."""

from __future__ import annotations

from collections.abc import Iterable
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import cached_property
from html import escape

from pmor.app.asked import asked_sweep, takes_whole_width
from pmor.app.result import SweepResult
from pmor.case import Case
from pmor.case.width import whole_width
from pmor.core.arrays import FloatArray
from pmor.core.progress import Steps, quietly
from pmor.core.wording import suggesting
from pmor.gear.condition import Misalignment
from pmor.gear.modification import Modification
from pmor.line.unloaded import with_unloaded
from pmor.pair.model import ElasticModel
from pmor.pair.sweep import sweep_ste
from pmor.work.cost import meshed_within_memory
from pmor.work.offline import solved_bodies

# Sections to whose memory a state of full FE comes.
STATE_SECTIONS = 4


@dataclass(frozen=True, eq=False, repr=False)
class FullModel:
    """Full finite-element contact of a pair: the truth of its mesh, milliseconds to seconds per position.

    Parameters
    ----------
    elastic : ElasticModel
        Meshes, and the compliance of both gears.
    """

    case: Case
    elastic: ElasticModel

    @cached_property
    def whole(self) -> FullModel:
        """The model on the whole width, where half of it stands for both halves: made when it is first asked for."""
        return full_model(whole_width(self.case))

    @suggesting
    def sweep(
        self, torques_Nm: float | Iterable[float] | None = None, angles: int | FloatArray | None = None, *,
        misalignment: Misalignment | None = None, executor: Executor | None = None, progress: Steps = quietly,
        pinion: Modification | None = None, wheel: Modification | None = None
    ) -> SweepResult:  # fmt: skip
        """Solve full contact over angles and torques; see `ReducedModel.sweep`."""
        meshed = self.elastic.mesh.meshed
        asked = asked_sweep(self.case, meshed, torques_Nm, angles, misalignment, (pinion, wheel), STATE_SECTIONS)
        elastic = (self.whole if takes_whole_width(asked.case, self.case) else self).elastic
        meshed, solve = elastic.mesh.meshed, elastic.elasticity_at
        sweep = sweep_ste(meshed, solve, asked.phi, asked.conditions, lambda: progress(1), executor)
        swept = with_unloaded(sweep, meshed, asked.conditions)
        return SweepResult(swept, meshed.pair, flank=self.case.flank, holes=self.case.pair.holes)

    def _repr_html_(self) -> str:
        return f"<p>{escape(repr(self))}</p>{self.case._repr_html_()}"

    def __repr__(self) -> str:
        return f"<FullModel of {self.case!r}>"


@suggesting
def full_model(case: Case) -> FullModel:
    """Mesh both gears and solve for the compliance of their flanks.

    Raises
    ------
    CaseError, GeometryError, MeshError
        When there is no such gear, pair or mesh, or the load is beyond it.
    """
    return FullModel(case, solved_bodies(case, meshed_within_memory(case)))
