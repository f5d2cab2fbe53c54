"""Run a campaign: chunks that are not there yet go to an executor, and each is kept as soon as it is back."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from pmor.campaigns.chunks import PARTS, Chunk, ChunkFiles, chunks_of, expected_seconds
from pmor.campaigns.rows import Answer, Task
from pmor.campaigns.settings import Campaign
from pmor.campaigns.store import open_store
from pmor.campaigns.submit import submit_all
from pmor.campaigns.supervise import Order, closing_solvers, lost_answer, solve_order
from pmor.campaigns.table import designs_of
from pmor.core.progress import format_time

# Seconds between lines on progress, where there is no bar.
SAY_EVERY_S = 60.0


@dataclass(frozen=True)
class Done:
    """A campaign whose chunks are all there.

    Parameters
    ----------
    campaign : Campaign
    chunks : tuple of Chunk
    files : ChunkFiles
    resumed : int
        Designs that an earlier run had solved.
    wall_s : float
        Of this run, from the first chunk that was handed out to the last one that came back.
    solving_s : float
        Processor time of this run's designs.
    """

    campaign: Campaign
    chunks: tuple[Chunk, ...]
    files: ChunkFiles
    resumed: int
    wall_s: float
    solving_s: float


@contextmanager
def local_processes(jobs: int) -> Iterator[Executor]:
    """Give an executor of so many processes: threads, each with one that solves."""
    with ThreadPoolExecutor(max_workers=jobs, thread_name_prefix="campaign") as executor:
        try:
            yield executor
        finally:
            with closing_solvers():
                executor.shutdown(wait=True, cancel_futures=True)


def run_campaign(
    campaign: Campaign, out: Path, executor: Executor, progress: Callable[[int], None] = lambda count: None,
    announce: Callable[[str], None] = lambda text: None,
) -> Done:  # fmt: skip
    """Solve all designs of a campaign that are not solved yet.

    Parameters
    ----------
    campaign : Campaign
    out : Path
        Folder of the results, where finished chunks are kept until these are written.
    executor : concurrent.futures.Executor
        The results do not depend on it.
    progress : callable
        Called with a number of designs that are there, for progress.
    announce : callable
        Called with a line of text, at the start and every now and then.

    Raises
    ------
    OutputError
    ExternalProgramError
        When the executor does no more work.
    """
    table = designs_of(campaign)
    chunks = chunks_of(campaign.count, expected_seconds(campaign, table))
    store = open_store(Path(campaign.store.folder), campaign.store.limit_GiB)
    files, task = ChunkFiles(out / PARTS, campaign), _task(campaign)
    files.begin(chunks, campaign)
    known = {chunk.number for chunk, _ in files.finished(chunks)}
    missing = [chunk for chunk in chunks if chunk.number not in known]
    resumed = campaign.count - sum(chunk.count for chunk in missing)
    pace = _Pace(campaign.count, resumed, announce)
    progress(resumed)
    announce(f"{campaign.count} designs in {len(chunks)} chunks, {resumed} of them solved before")

    def order_of(chunk: Chunk) -> Order:
        # Design numbers are for people: they count from 1.
        designs = tuple((i + 1, table(i)) for i in chunk.designs)
        return Order(task, campaign.workers, str(store.folder), store.limit_bytes, designs, chunk.number)

    by_number: dict[int, Chunk] = {chunk.number: chunk for chunk in missing}
    solving = 0.0

    def keep(order: Order, answer: Answer) -> None:
        nonlocal solving
        chunk = by_number[order.chunk]
        files.write(chunk, answer)
        solving += sum(answer.seconds)
        progress(chunk.count)
        pace.step(chunk.count)

    started = time.perf_counter()
    submit_all(executor, solve_order, map(order_of, missing), keep, lost_answer)
    return Done(campaign, tuple(chunks), files, resumed, time.perf_counter() - started, solving)


def _task(campaign: Campaign) -> Task:
    return Task(campaign.base_text, campaign.relations, campaign.columns, campaign.results)


class _Pace:
    """Says every now and then how many designs are solved, how fast, and how long it will take."""

    def __init__(self, total: int, done: int, announce: Callable[[str], None]) -> None:
        self._total, self._before, self._done, self._announce = total, done, done, announce
        self._started = self._said = time.perf_counter()

    def step(self, count: int) -> None:
        self._done += count
        now = time.perf_counter()
        if now - self._said < SAY_EVERY_S:
            return
        self._said = now
        rate = (self._done - self._before) / (now - self._started)
        left = format_time((self._total - self._done) / rate)
        self._announce(f"{self._done} of {self._total} designs, {rate:.3g} per second, {left} left")
