"""Designs in chunks: each a piece of work of a second or more, and a file when it is done."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pmor.campaigns.relations import case_of, with_relations
from pmor.campaigns.rows import Answer, Row
from pmor.campaigns.settings import Campaign
from pmor.campaigns.store import key_of
from pmor.campaigns.table import Design
from pmor.case.coarser import coarser
from pmor.core.errors import PmorError
from pmor.report.data_files import write_summary_json
from pmor.storage.manifest import Contents, listed, origin_in
from pmor.storage.results_folder import working_folder
from pmor.work.cost import FINITE_ELEMENTS, stages

# Campaign that the chunks are of.
PLAN = "plan.json"
# Seconds of work in a chunk, by the model of cost, which holds within a factor of two. The smallest designs, as cheap
# as loading the libraries, take a third of the estimate: a chunk is a second at least.
LEAST_S = 4.0
# Each chunk is a file until the end, and passes through one process.
MOST_CHUNKS = 20_000
# Designs whose cost is estimated, for the mean.
SAMPLE = 24
INFEASIBLE_S = 0.01
# Files in a folder, each with a line in its manifest.
PER_FOLDER = 500
SWEEP = "sweep"


@dataclass(frozen=True)
class Chunk:
    """Designs one after the other.

    Parameters
    ----------
    number : int
        From 0.
    first, count : int
        First design, from 0, and how many.
    """

    number: int
    first: int
    count: int

    @property
    def designs(self) -> range:
        """Their numbers, from 0."""
        return range(self.first, self.first + self.count)


def expected_seconds(campaign: Campaign, table: Callable[[int], Design]) -> float:
    """Return the mean time of a design by the model of cost, from a sample."""
    places = np.unique(np.linspace(0, campaign.count - 1, SAMPLE, dtype=int))
    return float(np.mean([_seconds(campaign, table(int(place))) for place in places]))


def _seconds(campaign: Campaign, design: Design) -> float:
    try:
        case = case_of(
            campaign.base_text, with_relations(campaign.base_text, design, campaign.sections.relations), "design"
        )
        coarse = coarser(case)
        own = {stage.name: stage.seconds for stage in stages(case)}
        elements = own[FINITE_ELEMENTS]
        if coarse is not None:
            elements += sum(stage.seconds for stage in stages(coarse) if stage.name == FINITE_ELEMENTS)
        return elements + own[SWEEP]
    except PmorError:
        return INFEASIBLE_S


def chunks_of(count: int, seconds: float) -> list[Chunk]:
    """Part designs into chunks.

    Parameters
    ----------
    count : int
        Of designs.
    seconds : float
        That one takes.
    """
    size = max(math.ceil(LEAST_S / seconds), math.ceil(count / MOST_CHUNKS))
    return [Chunk(k, first, min(size, count - first)) for k, first in enumerate(range(0, count, size))]


class ChunkFiles:
    """Files of finished chunks, under deterministic names; files of others, or of another campaign, do not count.

    Parameters
    ----------
    folder : Path
    campaign : Campaign
    """

    def __init__(self, folder: Path, campaign: Campaign) -> None:
        self._folder = working_folder(folder)
        c = campaign
        self._key = key_of(c.text, c.variables, c.results)
        self._manifests: dict[Path, dict[str, Contents]] = {}
        self._ready: set[Path] = set()

    def begin(self, chunks: Sequence[Chunk], campaign: Campaign) -> None:
        """Write the plan: which campaign is being solved.

        Raises
        ------
        OutputError
        """
        plan = {"campaign": campaign.name, "chunks": len(chunks), "designs": campaign.count, "key": self._key}
        write_summary_json(self._folder / PLAN, plan, overwrite=True)

    @staticmethod
    def known(folder: Path, key: str) -> tuple[int, list[Row]]:
        """Return how many chunks of a campaign there are in a folder, and all their rows."""
        rows, count = list[Row](), 0
        for part in sorted(path for path in folder.iterdir() if path.is_dir()):
            for name, contents in sorted(listed(part).items()):
                data = _content(part / name, contents)
                if data is not None and data.get("key") == key:
                    rows += data["rows"]
                    count += 1
        return count, rows

    def read(self, chunk: Chunk) -> Answer | None:
        """Return the answer of a chunk that is finished."""
        path = self._path(chunk)
        if path.parent not in self._manifests:
            self._manifests[path.parent] = listed(path.parent)
        return self._read(path, chunk, self._manifests[path.parent].get(path.name, {}))

    def write(self, chunk: Chunk, answer: Answer) -> None:
        """Keep the answer of a chunk.

        Raises
        ------
        OutputError
        """
        path = self._path(chunk)
        if path.parent not in self._ready:
            self._ready.add(working_folder(path.parent))
        data = {"key": self._key, "first": chunk.first, "rows": answer.rows, "seconds": answer.seconds}
        write_summary_json(path, data, overwrite=True)

    def finished(self, chunks: Sequence[Chunk]) -> Iterator[tuple[Chunk, Answer]]:
        """Yield the chunks that are finished, in order."""
        self._manifests.clear()
        for chunk in chunks:
            answer = self.read(chunk)
            if answer is not None:
                yield chunk, answer

    def _path(self, chunk: Chunk) -> Path:
        return self._folder / f"{chunk.number // PER_FOLDER:04d}" / f"chunk_{chunk.number:06d}.json"

    def _read(self, path: Path, chunk: Chunk, contents: Contents) -> Answer | None:
        data = _content(path, contents)
        if data is None:
            return None
        fits = (data["key"], data["first"], len(data["rows"])) == (self._key, chunk.first, chunk.count)
        return Answer(tuple(data["rows"]), tuple(data["seconds"])) if fits else None


def _content(path: Path, contents: Contents) -> dict[str, Any] | None:
    """What is in a file of a chunk; None where there is none as this program wrote it."""
    if origin_in(contents, path) is None:
        return None
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None  # it is made anew
    return data if isinstance(data, dict) else None
