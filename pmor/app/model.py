"""The reduced model of a gear pair: sweeps, capabilities, files, and comparison with full finite elements."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from functools import cached_property
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pmor.app.asked import (
    asked_case,
    asked_sweep,
    check_assembly,
    checked_assemblies,
    listed,
    listed_assemblies,
    listed_within_memory,
    loaded_flank,
    negated,
    positions,
    refuse_beyond_training,
    seen_from,
    takes_whole_width,
    with_assembly,
)
from pmor.app.cases import in_keywords
from pmor.app.export import export_model, export_sweep
from pmor.app.full import FullModel
from pmor.app.result import ConditionsResult, SweepResult
from pmor.app.run import RunResult, run_models_of, sweep_model
from pmor.case import Case, change_case
from pmor.case.width import whole_width
from pmor.core.arrays import FloatArray
from pmor.core.errors import CaseError, OutputError
from pmor.core.progress import Steps, quietly
from pmor.core.wording import suggesting
from pmor.gear.condition import Assembly, Misalignment
from pmor.gear.modification import Modification
from pmor.line.unloaded import with_unloaded
from pmor.pair.model import refuse_loads
from pmor.reduction.basis import Basis
from pmor.results.root_stress import RootStress
from pmor.storage.atomic import ensure_folder
from pmor.storage.basis_file import write_basis
from pmor.work.cost import meshed_within_memory
from pmor.work.offline import trained_on
from pmor_online.compare import training_failures
from pmor_online.conditions import sweep_assemblies
from pmor_online.mesh_error import with_mesh_error
from pmor_online.model import ReducedPair, reduced_pair
from pmor_online.other_flank import other_flank_pair
from pmor_online.readings import can_record
from pmor_online.root_cycle import root_stress_and_cycles
from pmor_online.sweep import largest_size, sweep_reduced_pair

if TYPE_CHECKING:
    from pmor.design.result import DesignResult
    from pmor.dynamics.result import DynamicsResult


@dataclass(frozen=True, eq=False, repr=False)
class ReducedModel:
    """A trained model of a pair: full FE to hundredths of a per cent, in hundredths of a millisecond per position.

    Parameters
    ----------
    force : ndarray, shape (M, T, 2, f), or None
        Nodal forces of the training, N, which a file keeps beside the basis.
    source : Path or None
        File that the model was read from. It may have changed since: the model is in memory.
    source_bytes : int
        Its size when it was read.
    """

    basis: Basis
    force: FloatArray | None = None
    source: Path | None = None
    source_bytes: int = 0

    @property
    def case(self) -> Case:
        """The case of the training."""
        return self.basis.case

    @property
    def failures(self) -> tuple[str, ...]:
        """Full solutions of the training that did not converge, in words."""
        return tuple(training_failures(self.basis.training))

    @cached_property
    def reduced(self) -> ReducedPair:
        """The basis made ready to answer."""
        return reduced_pair(self.basis)

    @cached_property
    def whole(self) -> ReducedModel:
        """The model on the whole width, where half of it stands for both halves: made when it is first asked for."""
        case = whole_width(self.case)
        trained = trained_on(case, None, mesh=meshed_within_memory(case))
        return ReducedModel(trained.basis, trained.force)

    @cached_property
    def size(self) -> int:
        """Largest number of unknowns of a position."""
        return largest_size(self.reduced)

    @suggesting
    def sweep(
        self, torques_Nm: float | Iterable[float] | None = None, angles: int | FloatArray | None = None, *,
        misalignment: Misalignment | None = None, extrapolate: bool = False, executor: Executor | None = None,
        progress: Steps = quietly, pinion: Modification | None = None, wheel: Modification | None = None
    ) -> SweepResult:  # fmt: skip
        """Solve for the static transmission error over angles and torques.

        Axes or flanks that load the halves of the face differently are answered by the model of the `whole` width.

        Parameters
        ----------
        torques_Nm : float or iterable of float, optional
            Pinion torques, N m; those of the case by default. Negative ones load the coast flanks: the result counts
            as in a case of these, torques as amounts, angles and transmission error clockwise.
        angles : int or ndarray, optional
            Number of pinion angles per pitch, or the angles themselves in rad; by default the number of the case.
        misalignment : Misalignment, optional
            Position of the wheel's axis; that of the case by default.
        extrapolate : bool
            Allow states beyond the training, where only the error bar tells the accuracy.
        executor : concurrent.futures.Executor, optional
            Shares out the angles between threads; the result is the same to the last bit.
        progress : callable
            Called with the number of angles done.
        pinion, wheel : Modification, optional
            Of the flanks that carry; those of the case by default.

        Raises
        ------
        CaseError
            When torques or axes are beyond the training, modifications do not lie on the flanks, or a load is beyond
            the range of the contact scheme.
        """
        model, torques_Nm = self._loaded_by(torques_Nm)
        if model is not self:
            return model.sweep(torques_Nm, angles, misalignment=misalignment, extrapolate=extrapolate,
                               executor=executor, progress=progress, pinion=pinion, wheel=wheel)  # fmt: skip
        meshed = self.reduced.meshed
        asked = asked_sweep(self.case, meshed, torques_Nm, angles, misalignment, (pinion, wheel))
        refuse_beyond_training(self.case, asked.case, extrapolate)
        reduced = self._wide_enough(asked.case)
        meshed, phi, conditions = reduced.meshed, asked.phi, asked.conditions
        recorded = can_record(meshed, asked.case, len(phi), len(conditions))
        sweep = sweep_reduced_pair(reduced, phi, conditions, executor=executor, progress=progress, recorded=recorded)
        sweep = with_mesh_error(with_unloaded(sweep, meshed, conditions), reduced, conditions)
        return SweepResult(sweep, meshed.pair, reduced, conditions[0].assembly, self.case.flank, self.case.pair.holes)

    @suggesting
    def harris_map(
        self, torques_Nm: float | Iterable[float] | None = None, angles: int | None = None, *,
        executor: Executor | None = None,
    ) -> SweepResult:  # fmt: skip
        """Sweep over the torques of the Harris map, those of the case by default; see `sweep`."""
        torques = self.case.results.harris_torques_Nm if torques_Nm is None else torques_Nm
        if torques_Nm is None and self.case.flank == "coast":
            torques = negated(torques)
        return self.sweep(torques, angles, executor=executor)

    @suggesting
    def sweep_conditions(
        self, assemblies: Assembly | Iterable[Assembly] | Mapping[str, Assembly],
        torques_Nm: float | Iterable[float] | None = None,
        angles: int | FloatArray | None = None, *, extrapolate: bool = False, executor: Executor | None = None,
        progress: Steps = quietly
    ) -> ConditionsResult:  # fmt: skip
        """Sweep several assemblies of the pair, with other axes and other flanks: thousands of them in one call.

        Parameters
        ----------
        assemblies : Assembly, or iterable of Assembly, or mapping of str to Assembly
            By the names that tables call them, or without. Axes and modifications of both flanks, complete: the default
            of each is as drawn, whatever the case says. A `Misalignment` stands for an assembly of plain flanks.
        torques_Nm, angles, extrapolate, executor
            As in `sweep`, the same for all.
        progress : callable
            Called with the number of angles done, counted for each assembly.

        Raises
        ------
        CaseError
            As `sweep`, with the number of the assembly, from 0.
        """
        if isinstance(assemblies, Mapping):
            found = self.sweep_conditions(assemblies.values(), torques_Nm, angles, extrapolate=extrapolate,
                                          executor=executor, progress=progress)  # fmt: skip
            return replace(found, names=tuple(assemblies))
        model, torques_Nm = self._loaded_by(torques_Nm)
        if model is not self:
            return model.sweep_conditions(assemblies, torques_Nm, angles, extrapolate=extrapolate, executor=executor,
                                          progress=progress)  # fmt: skip
        meshed, assemblies = self.reduced.meshed, listed_assemblies(assemblies)
        torques_Nm = listed_within_memory(self.case, meshed, torques_Nm, angles, assemblies=len(assemblies))
        asked = asked_case(self.case, meshed.pair, torques_Nm, angles, None, (None, None))
        given = checked_assemblies(self.case, assemblies)
        built = tuple(seen_from(self.case, one) for one in given)
        asked = replace(asked, conditions=tuple(listed(asked, n, one) for n, one in enumerate(built)))
        check_assembly(asked, self.case, meshed.pair)
        if self.case.reduction.trained:
            for one in built:
                refuse_beyond_training(self.case, with_assembly(asked, one), extrapolate)
        refuse_loads(asked, meshed)
        phi, torques = positions(asked, meshed, angles), asked.online.torques_Nm
        sweeps = sweep_assemblies(self._wide_enough(asked), phi, built, [torques] * len(built), executor, progress)
        flank = self.case.flank
        return ConditionsResult(
            given, tuple(SweepResult(sweep, meshed.pair, flank=flank, holes=self.case.pair.holes) for sweep in sweeps)
        )

    def dynamics(
        self, *, folder: Path | str | None = None, executor: Executor | None = None,
        progress: Callable[[int], None] | None = None, **settings: Any
    ) -> DynamicsResult:  # fmt: skip
        """Find the motion over the speed: frequency response, folds, run-up and run-down under each torque.

        Parameters
        ----------
        folder, executor, progress
            As in `pmor.dynamics.solution.run`: an executor of processes.
        **settings
            Keys of the section `[dynamics]` of a case, such as ``torques_Nm=[100.0], damping_ratio=0.03``; those of
            the case by default.

        Returns
        -------
        DynamicsResult
            Torques without a response are named in its `failures`.

        Raises
        ------
        CaseError
            Where a setting is none, or the model has no line loads.
        ConvergenceError
            Where no torque has a force law.
        """
        from pmor.dynamics.run import run

        with in_keywords():
            asked = change_case(self.case, dynamics=settings) if settings else self.case
        return run(asked, reduced=self.reduced, folder=folder, executor=executor, progress=progress)

    def design(
        self, *, folder: Path | str | None = None, executor: Executor | None = None,
        progress: Callable[[int], None] | None = None, **settings: Any
    ) -> DesignResult:  # fmt: skip
        """Search for flank modifications over ranges, with tolerances, as `pmor design` does.

        Parameters
        ----------
        folder, executor, progress
            As in `pmor.design.run.run`: an executor of threads.
        **settings
            Sections of a design file as mappings: ``variables=[{"key": "tip_relief_um", "range": [0.0, 40.0]}]``,
            ``load``, ``objective``, ``constraints``, ``scatter``, ``search``, ``pareto``.

        Returns
        -------
        DesignResult
            Variants without a solution are named in its `failures`.

        Raises
        ------
        CaseError
            Where a setting is none, or the model does not suffice for it.
        """
        from pmor.design.loader import settings_of
        from pmor.design.run import run

        with in_keywords():
            file = settings_of(self.case, settings)
        reduced = self._wide_enough(file.cases[self.case.name])
        return run(file, reduced=reduced, folder=folder, executor=executor, progress=progress)

    @suggesting
    def root_stress(
        self, torques_Nm: float | Iterable[float] | None = None, angles: int | FloatArray | None = None, *,
        misalignment: Misalignment | None = None, executor: Executor | None = None, pinion: Modification | None = None,
        wheel: Modification | None = None
    ) -> RootStress:  # fmt: skip
        """Find the stress along both root fillets of all loaded teeth, over angles and torques.

        Parameters
        ----------
        torques_Nm, angles, axes, executor, pinion, wheel
            As in `sweep`.

        Returns
        -------
        RootStress
            The largest on each side of each loaded tooth, that of each point of the fillets over the cycle, and the
            range over the load cycle of each tooth, where the angles cover what repeats.

        Raises
        ------
        CaseError
            As `sweep`, and when the model holds no root stress.
        """
        model, torques_Nm = self._loaded_by(torques_Nm)
        if model is not self:
            return model.root_stress(torques_Nm, angles, misalignment=misalignment, executor=executor, pinion=pinion,
                                     wheel=wheel)  # fmt: skip
        meshed = self.reduced.meshed
        sections = meshed.tooth_pair_count * meshed.pinion.nodes.shape[1]
        asked = asked_sweep(self.case, meshed, torques_Nm, angles, misalignment, (pinion, wheel), sections)
        found = root_stress_and_cycles(self._wide_enough(asked.case), asked.phi, asked.conditions, executor)
        if found is None:
            raise CaseError(
                "the model holds no root stress: train one of a case with scheme='line' and root_stress=True, for "
                "coast flanks over the whole width with a negative torque_Nm of the case"
            )
        return found

    def _wide_enough(self, asked: Case) -> ReducedPair:
        return (self.whole if takes_whole_width(asked, self.case) else self).reduced

    @cached_property
    def _other_flank(self) -> ReducedModel:
        return replace(self, basis=other_flank_pair(self.reduced).basis)

    def _loaded_by(self, torques_Nm: Any) -> tuple[ReducedModel, Any]:
        """Return the model of the flanks that torques load, and the torques, listed."""
        flank, listed_torques = loaded_flank(self.case, torques_Nm)
        return self if flank == self.case.flank else self._other_flank, listed_torques

    @suggesting
    def save(self, path: Path | str, *, overwrite: bool = False) -> None:
        """Write the model to an HDF5 file, whole or not at all.

        Raises
        ------
        OutputError
            When the file exists and may not be replaced, or cannot be written.
        """
        target = Path(path)
        if self.force is None:
            raise OutputError(f"{target}: the model has no forces of its training: save one of train() or load_model()")
        ensure_folder(target.parent)
        write_basis(target, self.basis, self.force, overwrite)

    @suggesting
    def export(self, path: Path | str, to: str, *, torque_Nm: float | None = None, overwrite: bool = False) -> None:
        """Write the model in the format of another program, as `pmor.export_file` does of a basis file.

        Parameters
        ----------
        path : Path or str
            File to write, or folder for tables.
        to : str
            A format of `pmor export --help` that takes a basis; tables, ``"csv"``, are of the sweep of the case.
        torque_Nm, overwrite
            As in `pmor.export_file`.

        Raises
        ------
        CaseError
            When the model is none for this format.
        OutputError
            When the target is there and may not be replaced, or cannot be written.
        """
        target = Path(path)
        if to == "csv":
            swept = self.sweep()
            export_sweep(swept.sweep, swept.pair, f"case {self.case.name}", target, overwrite)
            return
        export_model(self.reduced, to, target, overwrite, torque_Nm)

    @suggesting
    def report(
        self, folder: Path | str, *, compare: bool = True, full: FullModel | None = None, overwrite: bool = False,
        executor: Executor | None = None, progress: Steps = quietly, inputs: Sequence[Path] = (),
        asked: Callable[[RunResult], None] | None = None,
    ) -> RunResult:  # fmt: skip
        """Write what `pmor run` leaves: tables, pictures, the report page and the model, as the case asks for them.

        Parameters
        ----------
        folder : Path or str
            Made unless it is there.
        compare : bool
            Compare with full FE, and with the other models that the case lists; without, it is `pmor online`, and the
            model is left there only if it has no file yet.
        full : FullModel, optional
            To compare with; made anew by default.
        overwrite, executor, progress, inputs, asked
            As in `pmor.run_case`.

        Raises
        ------
        OutputError
            When somebody else's file is in the way, or the folder cannot be written to.
        """
        if compare:
            elastic = full.elastic if full else None
            return run_models_of(
                self.case, Path(folder), self._save, elastic, True, overwrite, executor, progress, asked=asked
            )
        kept = [*inputs, *([self.source] if self.source else [])]
        return sweep_model(
            self.reduced, (self.source, self.source_bytes) if self.source else self._save, Path(folder),
            overwrite=overwrite, executor=executor, progress=progress, inputs=kept, asked=asked,
        )  # fmt: skip

    def _save(self, path: Path) -> None:
        self.save(path, overwrite=True)

    def _repr_html_(self) -> str:
        return f"<p>{escape(repr(self))}</p>{self.case._repr_html_()}"

    def __repr__(self) -> str:
        return f"<ReducedModel, {self.size} unknowns at most, of {self.case!r}>"
