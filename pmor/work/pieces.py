"""Independent pieces of work, each kept in a file when it is finished: interrupted, a run goes on where it stopped."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from pmor.case import Case
from pmor.core.errors import ConvergenceError
from pmor.core.progress import format_time
from pmor.core.threads import in_order
from pmor.core.version import __version__
from pmor.report.data_files import write_summary_json
from pmor.storage.manifest import is_ours
from pmor.storage.results_folder import working_folder

# Name of the folder of finished pieces, beside the results.
PARTS = "parts"
# Raise when the content of a part changes its meaning: older ones are then computed anew.
PART_VERSION = 1

Result = Mapping[str, Any]


@dataclass(frozen=True)
class Piece:
    """A piece of work.

    Parameters
    ----------
    name : str
        Unique; the part file is called after it.
    cases : mapping of str to Case
        That it solves; comments and the like do not count.
    settings : JSON data
        What else it depends on.
    run : callable
        Gives the result as plain data.
    is_whole : callable
        Whether a result that was found is all that there should be, with what it leaves beside the part file.
    """

    name: str
    cases: Mapping[str, Case]
    settings: Any
    run: Callable[[], Result]
    is_whole: Callable[[Result], bool] = lambda result: True

    @property
    def key(self) -> str:
        """SHA-256, in hex, of everything that the result depends on."""
        said = {
            label: {name: value for name, value in asdict(case).items() if name not in ("text", "title")}
            for label, case in self.cases.items()
        }
        content = [PART_VERSION, __version__, self.name, said, self.settings]
        # What a piece is to refuse may be no number.
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


class Announcer:
    """Says which piece is started, and how long the work has been going on.

    Parameters
    ----------
    total : int
        Pieces in all.
    say : callable
        Called with a line of text for each piece.
    """

    def __init__(self, total: int, say: Callable[[str], None]) -> None:
        self._total, self._say, self._done = total, say, 0
        self._begin: float | None = None

    def started(self, piece: Piece) -> None:
        """Announce a piece."""
        if self._begin is None:
            self._begin = time.perf_counter()
            if self._done:
                self._say(f"{self._done} of {self._total} pieces are finished and taken over")
        elapsed = format_time(time.perf_counter() - self._begin)
        self._say(f"[{self._done + 1}/{self._total}] {piece.name} ({elapsed} so far)")

    def finished(self, piece: Piece) -> None:
        """Count a piece that is there."""
        self._done += 1


def run_pieces(
    pieces: Sequence[Piece], folder: Path, executor: Executor | None = None,
    started: Callable[[Piece], None] = lambda piece: None, finished: Callable[[Piece], None] = lambda piece: None,
) -> tuple[dict[str, Result], tuple[str, ...]]:  # fmt: skip
    """Do all pieces of work that are not finished yet.

    Parameters
    ----------
    pieces : sequence of Piece
    folder : Path
        Where finished pieces are kept.
    executor : Executor, optional
        Of threads; None: one piece after the other.
    started, finished : callable
        Called with each piece that is started; with each one that is there, also those taken over.

    Returns
    -------
    results : dict
        By name; missing for those that failed.
    failures : tuple of str
        Pieces that did not converge at all, with the reason.

    Raises
    ------
    OutputError
    """
    working_folder(folder)
    results: dict[str, Result] = {}
    failures: dict[str, str] = {}
    for piece in pieces:
        found = read_part(_file(folder, piece), piece.key)
        if found is not None and piece.is_whole(found):
            results[piece.name] = found
            finished(piece)

    def work(piece: Piece) -> None:
        started(piece)
        try:
            results[piece.name] = write_part(_file(folder, piece), piece.key, piece.run())
        except ConvergenceError as error:
            failures[piece.name] = f"{piece.name}: {error}"

    missing = [piece for piece in pieces if piece.name not in results]
    for piece, _ in zip(missing, in_order(work, missing, executor), strict=True):
        finished(piece)
    return results, tuple(failures[piece.name] for piece in pieces if piece.name in failures)


def read_part(path: Path, key: str) -> dict[str, Any] | None:
    """Return the result in a part file, or None when there is none, one made from other settings, or one edited."""
    if not is_ours(path):
        return None
    try:
        part = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None  # missing, or damaged: it is made anew
    return part["result"] if isinstance(part, dict) and part.get("key") == key else None


def write_part(path: Path, key: str, result: Result) -> dict[str, Any]:
    """Write a part file and return its result as `read_part` would: numbers, lists and null alone.

    Raises
    ------
    OutputError
    """
    write_summary_json(path, {"key": key, "result": result}, overwrite=True)
    found = read_part(path, key)
    assert found is not None
    return found


def file_name(label: str) -> str:
    """Name of a file for a label: letters, digits, and underscores for the rest."""
    return "".join(c if c.isalnum() else "_" for c in label)


def _file(folder: Path, piece: Piece) -> Path:
    return folder / f"{file_name(piece.name)}.json"
