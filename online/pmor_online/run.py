"""The online stage of a case: its sweep and the results."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, field

from pmor.case import Case, model_names
from pmor.line.unloaded import with_unloaded
from pmor.pair.conditions import conditions_of
from pmor.pair.samples import Samples, lost_samples
from pmor.results.root_stress import RootStress, WebCycles
from pmor.results.sweep import SteSweep
from pmor.results.verdict import Verdict
from pmor_online.compare import Comparison, disagreement, failed_positions, training_failures
from pmor_online.conditions import ConditionSweep
from pmor_online.mesh_error import with_mesh_error
from pmor_online.model import ReducedPair, sweep_angles
from pmor_online.readings import Readings, can_record
from pmor_online.root_cycle import root_stress_and_cycles
from pmor_online.sweep import sweep_reduced_pair
from pmor_online.web_stress import web_stress


@dataclass(frozen=True)
class LostModel:
    """A model that a case compares and that has no basis, since no full solve of its training converged.

    Parameters
    ----------
    case : Case
        Of the model.
    """

    case: Case
    reason: str

    @property
    def failures(self) -> tuple[str, ...]:
        """The reason, as the only one."""
        return (self.reason,)


@dataclass(frozen=True)
class OnlineResult:
    """Results of the online stage.

    Parameters
    ----------
    sweep : SteSweep
        Of the reduced model, at the case's online angles and torques.
    comparison : Comparison or None
        None when it was not asked for.
    basis_mib : float
        Size of the basis file.
    parallel : bool
        Whether angles were shared out between threads.
    conditions : tuple of ConditionSweep
        Of the reduced model, under the conditions that the case lists.
    basis_name : str
        Of the basis file.
    others : tuple of OnlineResult or LostModel
        Models that the case compares beside its own, in its order.
    readings : Readings or None
        Derived results of a sweep of line loads; None of other models, and of sweeps too long to keep.
    root_stress : RootStress or None
        None where the basis has no root stress.
    root_stress_causes : mapping
        Largest root stress at the nominal torque without modifications and misalignment
        (`pmor_online.root_stress.root_stress_causes`); empty where there are none.
    web_stress : two dict of str to WebCycle
        Of pinion and wheel; empty where the basis has no stress on webs.
    samples : Samples or None
        Pairs within the tolerances of the case.
    verdict : Verdict or None
        What is good, what is not, and what to try first.
    """

    reduced: ReducedPair
    sweep: SteSweep
    comparison: Comparison | None
    basis_mib: float
    parallel: bool = False
    conditions: tuple[ConditionSweep, ...] = ()
    basis_name: str = "basis.h5"
    others: tuple[OnlineResult | LostModel, ...] = ()
    readings: Readings | None = None
    root_stress: RootStress | None = None
    root_stress_causes: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    web_stress: tuple[WebCycles, WebCycles] = field(default_factory=lambda: ({}, {}))
    samples: Samples | None = None
    verdict: Verdict | None = None

    @property
    def case(self) -> Case:
        """The case."""
        return self.reduced.basis.case

    @property
    def models(self) -> tuple[OnlineResult | LostModel, ...]:
        """All models that the case compares, this one among them, in its order; none where there is no other."""
        if not self.others:
            return ()
        names = model_names(self.case)
        return tuple(sorted((self, *self.others), key=lambda model: names.index(model.case.contact.scheme)))

    @property
    def all_failures(self) -> tuple[str, ...]:
        """Failures of all models, those of the others with their names."""
        named = (
            f"{other.case.contact.scheme}: {text}"
            for other in self.others
            for text in (other.failures if isinstance(other, LostModel) else other.all_failures)
        )
        return (*self.failures, *self.disagreement, *named)

    @property
    def disagreement(self) -> tuple[str, ...]:
        """The position at which the models differ most, where that is by more than the case allows."""
        bound = self.case.compare.largest_error_percent
        return () if self.comparison is None else tuple(disagreement(self.comparison, bound))

    @property
    def nominal(self) -> int:
        """Index of the nominal torque in the sweep."""
        return self.case.online.torques_Nm.index(self.case.torque_Nm)

    @property
    def failures(self) -> tuple[str, ...]:
        """Positions that did not converge: of the training, of the sweep, of the comparison."""
        found = training_failures(self.reduced.basis.training) + failed_positions(self.sweep, "reduced model")
        for listed in self.conditions:
            found += failed_positions(listed.sweep, f"reduced model, condition {listed.name}")
        if self.comparison is not None:
            found += failed_positions(self.comparison.full, "full FE")
            found += failed_positions(self.comparison.reduced, "reduced model, unseen angle")
        if self.samples is not None:
            found += lost_samples(self.samples, self.case.online.torques_Nm)
        return tuple(found)


def sweep_case(
    reduced: ReducedPair, executor: Executor | None = None, progress: Callable[[int], None] = lambda n: None
) -> SteSweep:
    """Sweep over the angles and torques that a case asks for.

    Parameters
    ----------
    executor : concurrent.futures.Executor, optional
        Shares out blocks of angles between threads.
    progress : callable
        Called with the number of angles done, for progress.

    Returns
    -------
    SteSweep
        It keeps its states where results are read off them.
    """
    case = reduced.basis.case
    phi = sweep_angles(case)
    conditions = conditions_of(case, case.online.torques_Nm)
    recorded = can_record(reduced.meshed, case, len(phi), len(conditions))
    sweep_reduced_pair(reduced, phi[:1], conditions, recorded=recorded)  # compiles: run times are those of warm code
    sweep = sweep_reduced_pair(reduced, phi, conditions, executor=executor, progress=progress, recorded=recorded)
    return with_mesh_error(with_unloaded(sweep, reduced.meshed, conditions), reduced, conditions)


def root_stress_of_case(reduced: ReducedPair, executor: Executor | None = None) -> RootStress | None:
    """Find the root stress over the angles and torques that a case asks for; None where the basis has none.

    Parameters
    ----------
    executor : concurrent.futures.Executor, optional
        As in `sweep_case`.
    """
    case = reduced.basis.case
    return root_stress_and_cycles(reduced, sweep_angles(case), conditions_of(case, case.online.torques_Nm), executor)


def web_stress_of_case(reduced: ReducedPair, executor: Executor | None = None) -> tuple[WebCycles, WebCycles]:
    """Find the stress on webs over the angles and torques that a case asks for; empty where the basis has none.

    Parameters
    ----------
    executor : concurrent.futures.Executor, optional
        As in `sweep_case`.
    """
    case = reduced.basis.case
    return web_stress(reduced, sweep_angles(case), conditions_of(case, case.online.torques_Nm), executor)
