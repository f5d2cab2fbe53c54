"""Campaigns, as the Python API and the command give them."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pmor.campaigns.columns import Columns
from pmor.campaigns.loader import load_campaign
from pmor.campaigns.output import FILES, WORKING, campaign_text, gathered, write_campaign, write_case
from pmor.campaigns.relations import with_relations
from pmor.campaigns.rows import STATUSES
from pmor.campaigns.run import Done, local_processes, run_campaign
from pmor.campaigns.settings import Campaign
from pmor.campaigns.store import refuse_foreign_store
from pmor.campaigns.table import designs_of
from pmor.core.arrays import FloatArray
from pmor.core.errors import CaseError
from pmor.core.progress import Progress
from pmor.storage.atomic import ensure_folder, refuse_existing
from pmor.storage.results_folder import results_folder, start_results


@dataclass(frozen=True, repr=False)
class CampaignResult:
    """All designs of a campaign.

    Parameters
    ----------
    done : Done
    columns : Columns
    folder : Path
        Where the files are.
    """

    done: Done
    columns: Columns
    folder: Path

    @property
    def status(self) -> np.ndarray:
        """What became of each design: "ok", "infeasible", "not converged" or "lost", shape (n,)."""
        return np.array(STATUSES)[self.columns.status]

    @property
    def reasons(self) -> tuple[str, ...]:
        """Why a design has no results; empty where it has."""
        return self.columns.reasons

    @property
    def inputs(self) -> dict[str, FloatArray]:
        """Keys of the case, each of shape (n,)."""
        return self.columns.inputs

    @property
    def results(self) -> dict[str, FloatArray]:
        """Results at the nominal torque, each of shape (n,); NaN of designs without."""
        return self.columns.results

    def __repr__(self) -> str:
        return f"<CampaignResult of {self.done.campaign.name!r}: {len(self.columns.status)} designs>"

    def __str__(self) -> str:
        return campaign_text(self.done, self.columns)


def campaign(
    path: Path | str, out: Path | str, executor: Executor | None = None, jobs: int = 1, overwrite: bool = False,
    announce: Callable[[str], None] = lambda text: None,
) -> CampaignResult:  # fmt: skip
    """Solve all designs of a campaign file, and write what `pmor campaign` leaves.

    Parameters
    ----------
    path : Path or str
        Campaign file.
    out : Path or str
        Folder for the results; chunks of designs are kept there until all are solved.
    executor : concurrent.futures.Executor, optional
        Of threads, processes or a cluster: it hands out chunks, and each of its threads has a process of its own that
        solves. The results are the same to the last bit. By default `jobs` processes on this machine.
    jobs : int
        Of those.
    overwrite : bool
        Replace files there, whoever wrote them.
    announce : callable
        Called with a line of text, at the start and every minute.

    Raises
    ------
    CaseError
        When the file asks for something impossible.
    OutputError
    ExternalProgramError
        When the executor does no more work.
    """
    settings, folder = load_campaign(Path(path)), Path(out)
    if executor is not None:
        return CampaignResult(*solve_campaign(settings, folder, executor, None, overwrite, announce), folder)
    with local_processes(jobs) as processes:
        return CampaignResult(*solve_campaign(settings, folder, processes, jobs, overwrite, announce), folder)


def solve_campaign(
    settings: Campaign, folder: Path, executor: Executor, workers: int | None, overwrite: bool,
    announce: Callable[[str], None],
) -> tuple[Done, Columns]:  # fmt: skip
    """Solve a campaign and write all that it leaves; as `campaign`."""
    if settings.store.limit_GiB:
        refuse_foreign_store(Path(settings.store.folder))  # before anything is written
    with results_folder(folder, FILES, WORKING, overwrite, settings.inputs):
        with Progress(settings.count, "designs") as progress:
            done = run_campaign(settings, folder, executor, progress.step, announce)
        columns = gathered(done)
        start_results(folder, settings.text)
        write_campaign(done, columns, workers, folder)
    return done, columns


def write_design(settings: Campaign, number: int, folder: Path, overwrite: bool) -> Path:
    """Write the case file of a design into a folder and return its path.

    Raises
    ------
    CaseError
        When there is no such design.
    GeometryError
        When the relations cannot be met.
    OutputError
    """
    if number > settings.count:
        raise CaseError(f"--case {number}: {settings.source} has {settings.count} designs: give one of these numbers")
    design = with_relations(settings.base_text, designs_of(settings)(number - 1), settings.relations)
    target = ensure_folder(folder) / f"{settings.name}_design_{number}.toml"
    refuse_existing(target, overwrite)
    write_case(settings, design, number, target, overwrite)
    return target
