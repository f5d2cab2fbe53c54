"""Run a campaign: missing chunks go to an executor, and each is kept as soon as it is back."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path

from pmor.campaigns.campaign import Campaign
from pmor.campaigns.chunks import Chunk, ChunkFiles, chunks_of, expected_cost, key_of_campaign
from pmor.campaigns.columns import Effort
from pmor.campaigns.fine import judged_finely
from pmor.campaigns.kind import ANGLES, PEAKS
from pmor.campaigns.output import FILES, refuse_changed_cases
from pmor.campaigns.result import CampaignResult, gathered
from pmor.campaigns.rows import Answer, Keys, Row, Task
from pmor.campaigns.submit import submit_all
from pmor.campaigns.supervise import LocalProcesses, Order, lost_answer, solve_order
from pmor.campaigns.table import designs_of, different_designs
from pmor.core.progress import format_time
from pmor.storage.gear_store import Store, open_store, refuse_foreign_store, remove_unfinished
from pmor.work.pace import Pace
from pmor.work.results import pieces_folder

LOG = logging.getLogger("pmor")
# Least time between two lines of the log.
SAY_EVERY_S = 60.0


def run(
    campaign: Campaign, *, folder: Path | str | None = None, executor: Executor | None = None,
    progress: Callable[[int], None] | None = None, overwrite: bool = False,
) -> CampaignResult:  # fmt: skip
    """Solve all designs of a campaign that are not solved yet; the log "pmor" tells how far it has come.

    `folder`, `executor`, `progress` and `overwrite` are as in `pmor.app.capabilities`; by default one process on this
    machine solves.

    Raises
    ------
    OutputError
    ExternalProgramError
        When the executor does no more work.
    """
    store = campaign.sections.store
    if store.limit_GiB:
        refuse_foreign_store(Path(store.folder))  # before anything is written
    with pieces_folder(folder, FILES, inputs=campaign.inputs, overwrite=overwrite) as parts:
        if folder is not None:
            refuse_changed_cases(campaign, Path(folder), overwrite)
        if executor is not None:
            return _solved(campaign, parts, executor, progress or (lambda count: None))
        with LocalProcesses(1) as processes:
            return _solved(campaign, parts, processes, progress or (lambda count: None))


def task_of(campaign: Campaign, store: Store) -> Task:
    """Return all that the designs of a campaign have in common."""
    said = campaign.sections
    return Task(
        kind=campaign.kind.key, base_text=campaign.base_text, relations=said.relations, columns=campaign.columns,
        results=campaign.results, workers=said.workers, store=str(store.folder), store_bytes=store.limit_bytes,
    )  # fmt: skip


def _solved(campaign: Campaign, parts: Path, executor: Executor, progress: Callable[[int], None]) -> CampaignResult:
    table = designs_of(campaign)
    numbers, places = different_designs(campaign)
    one = expected_cost(campaign, table).seconds
    chunks = chunks_of(len(numbers), one)
    store = campaign.sections.store
    kept = open_store(Path(store.folder), store.limit_GiB)
    task = task_of(campaign, kept)
    files = ChunkFiles(parts, key_of_campaign(campaign), chunks, Keys(campaign.columns, campaign.results))
    files.begin(campaign.name)
    known = {chunk.number for chunk, _ in files.finished()}
    missing = {chunk.number: chunk for chunk in chunks if chunk.number not in known}
    resumed = len(numbers) - sum(chunk.count for chunk in missing.values())
    told = format_time(one * len(numbers))
    LOG.info("%d designs in %d chunks, about %s of one core", len(numbers), len(chunks), told)
    if len(numbers) < campaign.count:
        LOG.info("%d designs stand in the table before: each is solved once", campaign.count - len(numbers))
    pace = Pace("designs", len(numbers), resumed, every_s=SAY_EVERY_S)
    progress(campaign.count - len(numbers) + resumed)
    solving = 0.0

    def order_of(chunk: Chunk) -> Order:
        return Order(task, tuple((place + 1, table(int(numbers[place]))) for place in chunk.designs), chunk.number)

    def keep(order: Order, answer: Answer) -> None:
        nonlocal solving
        chunk = missing[order.chunk]
        files.write(chunk, answer)
        solving += sum(answer.seconds)
        progress(chunk.count)
        pace.step(chunk.count)
        pace.tell()

    started = time.perf_counter()
    try:
        submit_all(executor, solve_order, map(order_of, missing.values()), keep, lost_answer)
    finally:
        remove_unfinished(kept)
    effort = Effort(
        n_chunks=len(chunks), resumed=resumed, solving_s=solving, wall_s=time.perf_counter() - started,
        workers=executor.jobs if isinstance(executor, LocalProcesses) else None,
    )  # fmt: skip
    result = gathered(campaign, (answer for _, answer in files.finished()), effort, places)
    fine = replace(task, fine=True, results=(*PEAKS, ANGLES))

    def solve_finely(asked: Sequence[int]) -> list[Row]:
        rows: dict[int, Row] = {}
        first = {i: int(numbers[places[i]]) for i in asked}
        orders = (Order(fine, ((i + 1, table(i)),), i) for i in sorted(set(first.values())))
        submit_all(executor, solve_order, orders, lambda order, a: rows.update({order.chunk: a.rows[0]}), lost_answer)
        # Numbers of designs are for people: they count from 1.
        return [{**rows[first[i]], "design": i + 1} for i in asked]

    LOG.info("the best designs are judged again on fine angles")
    return judged_finely(result, solve_finely)
