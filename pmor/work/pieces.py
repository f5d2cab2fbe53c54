"""Independent pieces of work, each kept in a file when it is finished: an interrupted run goes on where it stopped."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, Future, as_completed
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from pmor.case import Case
from pmor.core.errors import ConvergenceError
from pmor.core.threads import executor_errors
from pmor.core.version import __version__
from pmor.report.data_files import write_summary_json
from pmor.storage.manifest import is_ours
from pmor.storage.results_folder import working_folder
from pmor.work.pace import Beat, Pace

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
        Unique; names the part file.
    cases : mapping of str to Case
        Cases that it solves; comments and titles do not count.
    settings : JSON data
        Everything else that the result depends on.
    run : callable
        Gives the result as plain data.
    is_whole : callable
        Takes a result of an earlier run; whether it is complete, files beside the part file included.
    keep : callable
        Called here with a new result, once its part file is written.
    """

    name: str
    cases: Mapping[str, Case]
    settings: Any
    run: Callable[[], Result]
    is_whole: Callable[[Result], bool] = lambda result: True
    keep: Callable[[Result], None] = lambda result: None

    @property
    def key(self) -> str:
        """SHA-256, in hex, of everything that the result depends on."""
        contents = {
            label: {name: value for name, value in asdict(case).items() if name not in ("text", "title")}
            for label, case in self.cases.items()
        }
        content = [PART_VERSION, __version__, self.name, contents, self.settings]
        # Settings that a piece is to refuse may hold NaN.
        return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def run_pieces(
    pieces: Sequence[Piece], folder: Path, *, executor: Executor | None = None,
    progress: Callable[[int], None] | None = None, what: str = "pieces", beat: Beat | None = None,
) -> tuple[dict[str, Result], tuple[str, ...]]:  # fmt: skip
    """Do all pieces of work that are not finished yet; progress goes to the log "pmor".

    OutputError where one cannot be kept.

    Parameters
    ----------
    folder : Path
        Of finished pieces.
    executor : concurrent.futures.Executor, optional
        Of processes where all pieces can be pickled, or of threads; None: one piece after the other, here.
    progress : callable, optional
        Called with how many more pieces are there, first with those of an earlier run.
    what : str
        The pieces in the plural, for the log.
    beat : Beat, optional
        Of the log, where pieces are done again and again.

    Returns
    -------
    results : dict
        By name; missing for those that failed.
    failures : tuple of str
        Pieces that did not converge at all, with the reason.
    """
    working_folder(folder)
    results: dict[str, Result] = {}
    failures: dict[str, str] = {}
    step = progress or (lambda count: None)
    for piece in pieces:
        found = read_part(_file(folder, piece), piece.key)
        if found is not None and piece.is_whole(found):
            results[piece.name] = found
    if results:
        step(len(results))
    pace = Pace(what, len(pieces), len(results), beat=beat)

    missing = [piece for piece in pieces if piece.name not in results]
    for piece, answer in _answers(missing, executor, pace):
        if isinstance(answer, ConvergenceError):
            failures[piece.name] = f"{piece.name}: {answer}"
        else:
            results[piece.name] = write_part(_file(folder, piece), piece.key, answer)
            piece.keep(results[piece.name])
        step(1)
    return results, tuple(failures[piece.name] for piece in pieces if piece.name in failures)


def read_part(path: Path, key: str) -> dict[str, Any] | None:
    """Return the result in a part file, or None when there is none, one made from other settings, or one edited."""
    if not is_ours(path):
        return None
    try:
        part = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None  # missing, or damaged: it is made anew
    whole = isinstance(part, dict) and part.get("key") == key and isinstance(part.get("result"), dict)
    return part["result"] if whole else None


def write_part(path: Path, key: str, result: Result) -> dict[str, Any]:
    """Write a part file and return its result as `read_part` would: numbers, lists and null alone.

    OutputError where that fails.
    """
    write_summary_json(path, {"key": key, "result": result}, overwrite=True, indent=None)
    found = read_part(path, key)
    assert found is not None
    return found


def file_name(label: str) -> str:
    """Name of a file for a label: letters, digits, and underscores for the rest."""
    return "".join(c if c.isalnum() else "_" for c in label)


def _answers(
    pieces: Sequence[Piece], executor: Executor | None, pace: Pace
) -> Iterator[tuple[Piece, Result | ConvergenceError]]:
    """Yield results, or the reason for none, as they come; an error in one piece stops those that have not begun."""
    if executor is None:
        for piece in pieces:
            pace.tell(piece.name)
            yield piece, _attempt(piece.run)
            pace.step()
        return
    futures = dict[Future[Result | ConvergenceError], Piece]()
    try:
        for piece in pieces:
            with executor_errors(executor, piece.run):
                futures[executor.submit(_attempt, piece.run)] = piece
        for future in as_completed(futures):
            pace.step()
            pace.tell()
            with executor_errors(executor, _attempt):
                answer = future.result()
            yield futures[future], answer
    finally:
        for future in futures:
            future.cancel()


def _attempt(run: Callable[[], Result]) -> Result | ConvergenceError:
    try:
        return run()
    except ConvergenceError as error:
        return error
    except np.linalg.LinAlgError as error:
        return ConvergenceError(f"singular equations ({error})", [])


def _file(folder: Path, piece: Piece) -> Path:
    return folder / f"{file_name(piece.name)}.json"
