"""Parts of a campaign of a million designs on a thousand cores, measured: what `cases/results/campaign/scale.md` is of.

    python -m tests.programs.scale > parts.json

Nothing is solved but a handful of designs: all else goes through the code of a campaign with answers made up. Times are
of the processor, which other work on the machine does not change much.
"""

from __future__ import annotations

import json
import pickle
import queue
import resource
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, Future
from dataclasses import replace
from pathlib import Path
from typing import Any

from pmor.campaigns.campaign import Campaign
from pmor.campaigns.chunks import LEAST_S, MOST_CHUNKS, Chunk, ChunkFiles, chunks_of, key_of_campaign
from pmor.campaigns.columns import Effort
from pmor.campaigns.loader import load
from pmor.campaigns.output import write_csv, write_hdf5
from pmor.campaigns.result import gathered
from pmor.campaigns.rows import Answer, plain_row
from pmor.campaigns.run import task_of
from pmor.campaigns.submit import submit_all
from pmor.campaigns.supervise import LocalProcesses, Order, solve_order
from pmor.campaigns.table import designs_of
from pmor.storage.gear_store import Store, entries, open_store

DESIGNS = 1_000_000
# Of short tasks through the submission, and of files of chunks, that are tried.
TASKS, FILES = 1_000_000, 400
# Designs that are solved.
SOLVED = 12


class FakeExecutor(Executor):
    """Answers at once, from another thread, as the futures of a cluster are answered.

    Attributes
    ----------
    most : int
        Pieces of work that it had at a time.
    """

    def __init__(self) -> None:
        self.most = self._now = 0
        self._given: queue.SimpleQueue[tuple[Future[Any], Any] | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._answer)
        self._thread.start()

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Take a piece of work; its answer is what it was given."""
        future: Future[Any] = Future()
        self._now += 1
        self.most = max(self.most, self._now)
        self._given.put((future, args[0]))
        return future

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """End the thread."""
        self._given.put(None)
        self._thread.join()

    def _answer(self) -> None:
        while (taken := self._given.get()) is not None:
            self._now -= 1
            taken[0].set_result(taken[1])


def simulate(tasks: int) -> dict[str, float]:
    """Send short tasks through the submission: seconds each, how many at a time, growth of memory."""
    before, kept = _peak_bytes(), 0

    def keep(item: int, answer: int) -> None:
        nonlocal kept
        kept += answer == item

    started = time.process_time()
    with FakeExecutor() as executor:
        submit_all(executor, _nothing, iter(range(1, tasks + 1)), keep, lambda item, reason: item)
    seconds = time.process_time() - started
    return {"kept": kept, "s_per_task": seconds / tasks, "in_flight": executor.most,
            "growth_bytes": _peak_bytes() - before}  # fmt: skip


def _nothing(item: int) -> int:
    return item


def measure(folder: Path) -> dict[str, float]:
    """Measure the parts of a campaign in a folder that is given up afterwards."""
    campaign = _campaign(folder)
    found = {f"simulated_{key}": value for key, value in simulate(TASKS).items()}
    found |= _solving(campaign, folder)
    found |= _files(campaign, folder)
    return found | _gathering(campaign, folder)


def _campaign(folder: Path) -> Campaign:
    (folder / "base.toml").write_text(
        "[load]\ntorque_Nm = 100.0\n[pair]\nmodule_mm = 4.0\nface_width_mm = 20.0\n"
        "[pinion]\nteeth = 21\nbore_radius_mm = 20.0\n", encoding="utf-8",
    )  # fmt: skip
    path = folder / "scale.toml"
    path.write_text(
        f'case = "base.toml"\n[designs]\nmethod = "sobol"\ncount = {DESIGNS}\n'
        "pinion.teeth = { from = 19, to = 30 }\nwheel.teeth = { from = 30, to = 60 }\n"
        "pair.module_mm = { from = 3.0, to = 4.0 }\npair.helix_angle_deg = { from = 0.0, to = 25.0 }\n"
        "pair.face_width_mm = { from = 15.0, to = 40.0 }\n", encoding="utf-8",
    )  # fmt: skip
    return load(path)


def _solving(campaign: Campaign, folder: Path) -> dict[str, float]:
    """Solve a few designs as a campaign does: time and memory of a solving process, and what the store keeps."""
    started = time.process_time()
    table = designs_of(campaign)
    table_s, store = time.process_time() - started, open_store(folder / "store", 1.0)
    step = campaign.count // SOLVED
    order = Order(task_of(campaign, store), tuple((i + 1, table(i)) for i in range(0, SOLVED * step, step)), 0)
    with LocalProcesses(1) as executor:
        answer = executor.submit(solve_order, order).result()
    seconds = [s for row, s in zip(answer.rows, answer.seconds, strict=True) if row["status"] == "ok"]
    sizes = [path.stat().st_size for path in entries(store.folder)]
    again = solve_order(replace(order, designs=order.designs[:1]))
    assert again.rows[0] == answer.rows[0]
    return {
        "table_s": table_s, "design_s": sum(seconds) / len(seconds), "n_solved": len(seconds),
        "solver_peak_bytes": resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss * 1024,
        "entry_bytes": sum(sizes) / len(sizes), "entries_per_design": len(sizes) / len(seconds),
        "order_bytes": len(pickle.dumps(replace(order, designs=order.designs[:1]))),
        "design_bytes": (len(pickle.dumps(order)) - len(pickle.dumps(replace(order, designs=()))))
        / len(order.designs),
    }  # fmt: skip


def _made_up(campaign: Campaign, chunk: Chunk) -> Answer:
    task = task_of(campaign, Store(Path(), 0.0))
    values = {name: 1.0 / 3.0 + i for i, name in enumerate(campaign.columns)}
    figures = dict.fromkeys(campaign.results, 12.345678901234567)
    rows = (plain_row(task, i + 1, values, "ok", "", figures) for i in chunk.designs)
    return Answer(tuple(rows), (1.0,) * chunk.count)


def _files(campaign: Campaign, folder: Path) -> dict[str, float]:
    """Write and read files of chunks as large as a million designs make them."""
    size = -(-DESIGNS // MOST_CHUNKS)
    chunks = [Chunk(k, k * size, size) for k in range(FILES)]
    files = ChunkFiles(folder / "parts", key_of_campaign(campaign), chunks)
    files.begin(campaign.name)
    started = time.process_time()
    for chunk in chunks:
        files.write(chunk, _made_up(campaign, chunk))
    written = time.process_time()
    found = sum(1 for _ in files.finished())
    read = time.process_time()
    assert found == FILES
    size_bytes = sum(path.stat().st_size for path in (folder / "parts").rglob("chunk_*.json")) / FILES
    return {"chunk_write_s": (written - started) / FILES, "chunk_read_s": (read - written) / FILES,
            "chunk_bytes": size_bytes}  # fmt: skip


def _gathering(campaign: Campaign, folder: Path) -> dict[str, float]:
    """Gather a tenth of the designs into columns and files."""
    part = replace(campaign, count=DESIGNS // 10)

    def answers() -> Iterator[Answer]:
        return (_made_up(part, chunk) for chunk in chunks_of(part.count, LEAST_S / 50))

    started = time.process_time()
    result = gathered(part, answers(), Effort(n_chunks=0, resumed=0, solving_s=0.0, wall_s=0.0, workers=None))
    gathered_s = time.process_time() - started
    write_csv(folder / "campaign.csv", result)
    write_hdf5(folder / "campaign.h5", result)
    h5_bytes, numbers = 10.0 * (folder / "campaign.h5").stat().st_size, len(part.columns) + len(part.results) + 3
    return {
        "gather_s": 10.0 * gathered_s, "write_s": 10.0 * (time.process_time() - started - gathered_s),
        "csv_bytes": 10.0 * (folder / "campaign.csv").stat().st_size,
        "h5_bytes": h5_bytes,
        # Columns, and the file that is made in memory, twice while it is closed.
        "gather_bytes": 8.0 * numbers * DESIGNS + 2.0 * h5_bytes,
    }  # fmt: skip


def _peak_bytes() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024


def main() -> None:
    """Measure, and write the parts as JSON."""
    with tempfile.TemporaryDirectory() as scratch:
        json.dump(measure(Path(scratch)), sys.stdout, indent=2)


if __name__ == "__main__":
    main()
