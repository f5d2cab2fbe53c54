"""All models that a case compares: its own, then the others on the same gears, each with a basis file of its own.

The finite elements of the gears are solved once, whatever the contact. A basis that is there and was made from the very
settings of its model is taken over.
"""

from __future__ import annotations

import logging
import math
import os
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from functools import cache, partial
from pathlib import Path

from pmor.case import Case, other_models
from pmor.core.errors import CaseError, ConvergenceError, FileFormatError, GeometryError, MeshError
from pmor.core.progress import Steps, quietly, stage
from pmor.pair.model import ElasticModel, MeshModel, mesh_model, model_of_solved
from pmor.reduction.basis import Basis
from pmor.storage.basis_file import BASIS_SCHEMA, read_basis, require_made_from
from pmor.storage.gear_store import kept_beside
from pmor.storage.hdf5 import refuse_other_kind
from pmor.work import offline
from pmor.work.kernels import kernels_beside
from pmor.work.online import run_online, with_comparison
from pmor_online.model import reduced_pair
from pmor_online.run import LostModel, OnlineResult

OWN_BASIS = "basis.h5"
_LOG = logging.getLogger("pmor.work")


# A model that is compared beside a case's own: its case and its meshes.
MeshedCase = tuple[Case, MeshModel]


def basis_names(case: Case) -> tuple[str, ...]:
    """Return the names of the basis files of a run: the case's own, and those of the other models."""
    return (OWN_BASIS, *(_basis_name(scheme) for scheme, _ in other_models(case)))


def unfinished(case: Case) -> tuple[str, ...]:
    """Return the names of the folders for unfinished work of a run."""
    return tuple(offline.parts_of(Path(name)).name for name in basis_names(case))


def meshed_models(case: Case) -> tuple[MeshedCase, ...]:
    """Mesh the models that a case compares beside its own.

    Raises
    ------
    CaseError, GeometryError, MeshError
        With the name of the model, when it does not suit the case.
    """
    found = list[MeshedCase]()
    for scheme, model in other_models(case):
        try:
            found.append((model, mesh_model(model)))
        except (CaseError, GeometryError, MeshError) as error:
            raise type(error)(f'[compare] models, "{scheme}": {error}') from None
    return tuple(found)


def run_models(
    case: Case, mesh: MeshModel, solve: Callable[[], ElasticModel], others: Sequence[MeshedCase], folder: Path, *,
    given: bool = False, executor: Executor | None = None, overwrite: bool = False, started: float | None = None,
    progress: Steps = quietly, asked: Callable[[OnlineResult], None] = lambda found: None,
) -> OnlineResult:  # fmt: skip
    """Build or take over the basis of each model, sweep, and compare with full FE of the same contact scheme.

    Parameters
    ----------
    solve : callable
        Gives the finite elements of the case, once. Line loads alone do without: their gears are kept beside the
        folder.
    others : sequence of MeshedCase
        Compared beside it.
    folder : Path
        Of the basis files.
    given : bool
        The case's own basis is in the folder, and is the one to take.
    executor : concurrent.futures.Executor, optional
        Of threads: shares out full solutions and angles.
    overwrite : bool
        Make all bases anew, but one that is given.
    started : float, optional
        ``time.perf_counter()`` before meshing and finite elements, which count to the offline time of each model.
    progress : callable
        Called with the number of positions solved.
    asked : callable
        Given the sweep of the case's own model with all that is read off it, before it is held against full FE.

    Returns
    -------
    OnlineResult
        Of the case, with the others.
    """
    common = 0.0 if started is None else time.perf_counter() - started
    kept = {OWN_BASIS: case} if given or not overwrite else {}
    kept |= {} if overwrite else {_basis_name(other.contact.scheme): other for other, _ in others}
    bases = {name: valid_basis(folder / name, own) for name, own in kept.items()}  # before any work is begun
    gears = kept_beside(folder, overwrite)

    def run(
        case: Case, mesh: MeshModel, solve: Callable[[], ElasticModel], name: str,
        asked: Callable[[OnlineResult], None], ready: Callable[[], object],
    ) -> OnlineResult:  # fmt: skip
        path, basis, found = folder / name, bases.get(name), list[OnlineResult]()
        scheme, lines = case.contact.scheme, case.reduction.shapes == "line_loads"

        def sweep(basis: Basis) -> None:
            # The basis is valid, but sweep and outputs of the case may have changed since.
            ready()
            reduced, size = reduced_pair(replace(basis, case=case)), path.stat().st_size if path.exists() else math.nan
            with stage(f"{scheme}: sweep over angles and torques"):
                found.append(run_online(reduced, path, basis_bytes=size, executor=executor, progress=progress))
            asked(found[0])

        if basis is None:
            began = time.perf_counter() - common
            model = None if lines and not others else solve()
            with stage(offline.training_words(case, model is not None)):
                done = offline.run_offline(
                    case, model, path, executor=executor, resume=not overwrite, overwrite=True, started=began,
                    progress=progress, asked=sweep, mesh=mesh, kept=gears,
                )  # fmt: skip
            reduced = replace(found[0].reduced, basis=done.basis)
            found[0] = replace(found[0], reduced=reduced, basis_mib=path.stat().st_size / 2**20)
        else:
            sweep(basis)
        full = None if lines else solve()
        with stage(f"{scheme}: full FE at {case.compare.angles} unseen angles"):
            return with_comparison(found[0], full, executor, progress)

    found = list[OnlineResult | LostModel]()
    with kernels_beside(case) as (full, trained):
        own = run(case, mesh, solve, OWN_BASIS, asked, lambda: None)
        if others:
            full()
        for other, mesh in others:
            solve = cache(partial(_solved_again, other, mesh, solve))
            try:
                found.append(run(other, mesh, solve, _basis_name(other.contact.scheme), lambda found: None, trained))
            except ConvergenceError as error:  # the others have their results
                found.append(LostModel(other, str(error)))
    return replace(own, others=tuple(found))


def _solved_again(case: Case, mesh: MeshModel, solve: Callable[[], ElasticModel]) -> ElasticModel:
    return model_of_solved(case, mesh, solve())


def valid_basis(path: Path, case: Case) -> Basis | None:
    """Return the basis in a results folder, if there is one made from these very settings; say so if it is not."""
    if not os.path.lexists(path):
        return None
    try:
        basis = read_basis(path)
        require_made_from(path, basis, case)
    except FileFormatError as error:
        refuse_other_kind(path, BASIS_SCHEMA)
        _LOG.info("not used, made anew: %s", error)
        return None
    return basis


def _basis_name(scheme: str) -> str:
    return f"basis_{scheme}.h5"
