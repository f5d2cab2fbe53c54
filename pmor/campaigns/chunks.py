"""Designs in chunks: each a piece of work of a second or more, and a file when it is done."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import NamedTuple

import numpy as np

from pmor.campaigns.campaign import Campaign
from pmor.campaigns.kind import Cost, Design
from pmor.campaigns.rows import NAME, Answer, Keys, read_answer
from pmor.core.errors import FileFormatError, PmorError
from pmor.report.data_files import write_summary_json
from pmor.storage.content_key import key_of
from pmor.storage.manifest import Contents, listed, origin_in
from pmor.storage.results_folder import working_folder

# Campaign that the chunks are of.
PLAN = "plan.json"
# Seconds of work in a chunk, by the model of cost, which holds within a factor of two. The smallest designs, as cheap
# as loading the libraries, take a third of the estimate: a chunk is a second at least.
LEAST_S = 4.0
# Each chunk is a file until the end, and passes through one process.
MOST_CHUNKS = 20_000
# Designs that can be made whose cost is estimated, for the mean; designs that are looked at for them, in any order.
SAMPLE, MOST_LOOKED = 24, 1_000
INFEASIBLE_S = 3e-3
# Files in a folder, each with a line in its manifest.
PER_FOLDER = 500
# What reading a file brings that is not as this program wrote it.
MALFORMED = (OSError, ValueError, KeyError, TypeError, AttributeError, RecursionError)


@dataclass(frozen=True)
class Chunk:
    """Designs one after the other, of those that differ: number of the chunk, place of its first design, how many."""

    number: int
    first: int
    count: int

    @property
    def designs(self) -> range:
        """Their places among those that differ (`pmor.campaigns.table.different_designs`), from 0."""
        return range(self.first, self.first + self.count)


class Expected(NamedTuple):
    """Means of a sample of designs in which some can be made: of all, s, of those on fine angles; share of these."""

    seconds: float
    finely: float
    share: float


def expected_cost(campaign: Campaign, table: Callable[[int], Design]) -> Expected:
    """Return what a design of a campaign takes by the model of cost."""
    kind, text, feasible, infeasible = campaign.kind, campaign.base_text, list[Cost](), 0
    elements = dict[str, float]()  # each is solved once
    places = np.unique(np.linspace(0, campaign.count - 1, MOST_LOOKED, dtype=int))
    for place in np.random.default_rng(0).permutation(places).tolist():
        try:
            complete = kind.complete(text, table(place), campaign.sections.relations)
            feasible.append(kind.cost(kind.text(text, complete), NAME, campaign.results))
            elements |= feasible[-1].elements
        except PmorError:
            infeasible += 1
        if len(feasible) == SAMPLE:
            break
    solved, finely = (sum(getattr(one, name) for one in feasible) for name in ("solved", "finely"))
    looked_at = len(feasible) + infeasible
    mean = (solved + sum(elements.values()) + INFEASIBLE_S * infeasible) / looked_at
    return Expected(mean, finely / max(len(feasible), 1), len(feasible) / looked_at)


def chunks_of(count: int, seconds: float) -> list[Chunk]:
    """Part so many designs, each of so many seconds, into chunks."""
    size = max(math.ceil(LEAST_S / seconds), math.ceil(count / MOST_CHUNKS))
    return [Chunk(k, first, min(size, count - first)) for k, first in enumerate(range(0, count, size))]


class ChunkFiles:
    """Files of finished chunks, by number.

    Files of others, of another `key_of_campaign`, or with other `keys` than its rows do not count.
    """

    def __init__(self, folder: Path, key: str, chunks: Sequence[Chunk], keys: Keys | None = None) -> None:
        self._folder, self._key, self._chunks, self._keys = folder, key, chunks, keys
        self._ready: set[Path] = set()

    def begin(self, name: str) -> None:
        """Write the plan: the campaign that is being solved, by its name."""
        working_folder(self._folder)
        chunks = [(chunk.first, chunk.count) for chunk in self._chunks]
        plan = {"campaign": name, "key": self._key, "chunks": chunks}
        write_summary_json(self._folder / PLAN, plan, overwrite=True)

    def write(self, chunk: Chunk, answer: Answer) -> None:
        """Keep the answer of a chunk."""
        path = self._path(chunk)
        if path.parent not in self._ready:
            self._ready.add(working_folder(path.parent))
        data = {"key": self._key, "first": chunk.first, "rows": answer.rows, "seconds": answer.seconds}
        write_summary_json(path, data, overwrite=True)

    def finished(self) -> Iterator[tuple[Chunk, Answer]]:
        """Yield the chunks that are finished, in order."""
        for folder, chunks in groupby(self._chunks, lambda chunk: self._path(chunk).parent):
            manifest = listed(folder)
            for chunk in chunks:
                answer = self._read(chunk, manifest)
                if answer is not None:
                    yield chunk, answer

    def _path(self, chunk: Chunk) -> Path:
        return self._folder / f"{chunk.number // PER_FOLDER:04d}" / f"chunk_{chunk.number:06d}.json"

    def _read(self, chunk: Chunk, manifest: Mapping[str, Contents]) -> Answer | None:
        """Return the answer of a chunk; None where there is none as this program wrote it."""
        path = self._path(chunk)
        if origin_in(manifest.get(path.name, {}), path) is None:
            return None
        try:
            data = json.loads(path.read_text(encoding="utf-8"))
            fits = (data["key"], data["first"]) == (self._key, chunk.first)
            return read_answer(data, chunk.designs, self._keys) if fits else None
        except MALFORMED:
            return None  # it is made anew


def key_of_campaign(campaign: Campaign) -> str:
    """Return the digest of all that the rows of a campaign depend on."""
    return key_of(campaign.text)


def planned_files(folder: Path) -> tuple[str, ChunkFiles, Sequence[Chunk]]:
    """Return name of the campaign, files and chunks of a folder; FileFormatError for a plan of another version."""
    try:
        plan = json.loads((folder / PLAN).read_text(encoding="utf-8"))
        chunks = [Chunk(k, int(first), int(count)) for k, (first, count) in enumerate(plan["chunks"])]
        if not isinstance(plan["campaign"], str) or any(min(chunk.first, chunk.count) < 0 for chunk in chunks):
            raise ValueError("no plan of chunks")
        return plan["campaign"], ChunkFiles(folder, plan["key"], chunks), chunks
    except MALFORMED:
        raise FileFormatError(f"{folder / PLAN}: is of another version: remove the folder {folder}") from None
