"""Reduced models: trained, read from files, compared with full FE."""

from __future__ import annotations

import time
from collections.abc import Sequence
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

from pmor.app.full import FullModel, full_model
from pmor.app.model import ReducedModel
from pmor.app.records import KINDS, kind_of_settings
from pmor.case import Case
from pmor.core.errors import CaseError
from pmor.core.progress import Steps, quietly, stage
from pmor.core.threads import refuse_processes
from pmor.core.wording import suggesting
from pmor.storage.atomic import ensure_writable, refuse_existing
from pmor.storage.basis_file import read_model, require_made_from
from pmor.storage.gear_store import kept_beside
from pmor.storage.results_folder import refuse_foreign_folder, refuse_in_the_way
from pmor.work.cost import meshed_within_memory, refuse_large_basis
from pmor.work.offline import OfflineSummary, parts_of, run_offline, trained_on, training_words
from pmor_online.compare import Comparison, compare_models

if TYPE_CHECKING:
    from pmor.app.machine_model import MachineModel
    from pmor.machine.loader import GearboxFile
    from pmor.sets.loader import SetFile


@overload
def train(
    case: Case, full: FullModel | None = None, *, file: Path | str | None = None, resume: bool = False,
    overwrite: bool = False, executor: Executor | None = None, progress: Steps = quietly,
) -> ReducedModel: ...  # fmt: skip
@overload
def train(
    case: SetFile | GearboxFile, *, executor: Executor | None = None, progress: Steps = quietly
) -> MachineModel: ...
@suggesting
def train(
    case: Any, full: FullModel | None = None, *, file: Path | str | None = None, resume: bool = False,
    overwrite: bool = False, executor: Executor | None = None, progress: Steps = quietly,
) -> Any:  # fmt: skip
    """Solve full FE over the training of a case and reduce it; of a machine the finite elements of all its gears.

    Parameters
    ----------
    case : Case, SetFile or GearboxFile
        A machine has no file of its own, and nothing to resume: `pmor.run` keeps its gears beside a folder.
    full : FullModel, optional
        Of a case with the same pair, mesh and contact scheme, where there is one already.
    file : Path or str, optional
        Basis file to write, as `pmor offline` does. Full solutions are kept beside it until then, for `resume`.
    resume : bool
        Take over the full solutions that an interrupted training of this file has left.
    overwrite : bool
        Replace the file.
    executor : concurrent.futures.Executor, optional
        Of threads: shares out the full solutions; the result is the same to the last bit.
    progress : callable
        Called with the number of full solutions done.

    Returns
    -------
    ReducedModel or MachineModel
        ``failures`` of the first name the full solutions that did not converge.

    Raises
    ------
    CaseError, GeometryError, MeshError
        As `full_model`.
    ConvergenceError
        When no full solution converged.
    OutputError
        When the file exists and may not be replaced, or cannot be written.
    """
    if not isinstance(case, Case):
        return _machine(case, (full, file, resume or None), executor, progress)
    if file is not None:
        train_file(case, Path(file), full=full, resume=resume, overwrite=overwrite, executor=executor,
                   progress=progress)  # fmt: skip
        return load_model(file)
    if resume:
        raise CaseError("resume = True: takes a file beside which full solutions are kept: pass file as well")
    refuse_processes(executor)
    mesh = full.elastic.mesh if full else meshed_within_memory(case)
    trained = trained_on(case, full.elastic if full else None, executor, progress, mesh)
    return ReducedModel(trained.basis, trained.force)


def _machine(file: Any, of_pairs: Sequence[Any], executor: Executor | None, progress: Steps) -> MachineModel:
    from pmor.app.machine_model import train_machine

    kind = kind_of_settings(file)
    if kind not in ("set", "gearbox"):
        raise CaseError(f"{file.name}: is {KINDS[kind].words}, and no machine: use pmor.run")
    if any(one is not None for one in of_pairs):
        raise CaseError(f"{file.name}: full, file and resume are of pairs: pmor.run keeps gears beside its folder")
    return train_machine(file, executor, progress)


def train_file(
    case: Case, path: Path, *, full: FullModel | None = None, resume: bool = False, overwrite: bool = False,
    executor: Executor | None = None, progress: Steps = quietly, inputs: Sequence[Path] = (),
) -> OfflineSummary:  # fmt: skip
    """Train a case and write its basis file; parameters as of `train`, and files that are not replaced at any rate."""
    started = time.perf_counter()
    # Before the work, not after it.
    refuse_processes(executor)
    refuse_existing(path, overwrite)
    refuse_in_the_way([path], overwrite, inputs)
    mesh = full.elastic.mesh if full else meshed_within_memory(case)
    ensure_writable(path.parent)
    refuse_foreign_folder(parts_of(path))
    with stage(training_words(case, full is not None)):
        return run_offline(
            case, full.elastic if full else None, path, executor=executor, resume=resume, overwrite=overwrite,
            started=started, progress=progress, mesh=mesh, kept=kept_beside(path, overwrite, make=False),
        )  # fmt: skip


@suggesting
def load_model(path: Path | str, *, case: Case | None = None) -> ReducedModel:
    """Read a model that `ReducedModel.save`, `train` or `pmor offline` has written.

    Parameters
    ----------
    case : Case, optional
        Whose sweep to ask for, rather than that of the case in the file: of the same pair, mesh and training.

    Raises
    ------
    FileFormatError
        When the file is foreign, damaged, of another version, or made from another pair, mesh or training.
    CaseError
        When a sweep would take more memory than there is.
    """
    source = Path(path).absolute()
    refuse_large_basis(source)
    basis, force, size = read_model(source)
    if case is not None:
        require_made_from(source, basis, case)
        basis = replace(basis, case=case)
    return ReducedModel(basis, force, source, size)


@suggesting
def compare(
    model: ReducedModel, full: FullModel | None = None, *, executor: Executor | None = None, progress: Steps = quietly
) -> Comparison:
    """Compare a reduced model with full FE at unseen angles, as many as its case says.

    Parameters
    ----------
    full : FullModel, optional
        Made anew by default.
    executor : concurrent.futures.Executor, optional
        Of threads: shares out the angles.
    progress : callable
        Called with the number of angles done.
    """
    refuse_processes(executor)
    elastic = (full or full_model(model.case)).elastic
    return compare_models(model.reduced, elastic, lambda: progress(1), executor)
