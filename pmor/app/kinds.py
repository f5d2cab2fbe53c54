"""Kinds of files, and what the program does with each: the one table from which commands and Python take it.

Functions are named "module:function" and imported when they are called, so that ``pmor --help`` stays instant.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from contextlib import AbstractContextManager
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any

from pmor.core.errors import CaseError, printable
from pmor.core.threads import processes, threads


@dataclass(frozen=True)
class Kind:
    """A kind of file that describes a machine, or asks a question about one.

    Parameters
    ----------
    words : str
        What a file is taken for.
    command : str
        That answers it.
    sections : tuple of str
        Of a file in TOML: one of them tells the kind. Empty of the kind that is left.
    types : tuple of str
        Names of the classes of what `load` returns.
    load, run, plan : str
        Reads a file; answers it, into a folder where one is given; tells how much work that is. Empty where there is
        none.
    failed : str
        What the failures of a result are.
    """

    words: str
    command: str
    sections: tuple[str, ...]
    types: tuple[str, ...]
    load: str
    run: str
    plan: str
    failed: str = "did not converge"


# In the order in which they are told from each other: what asks about a machine before what describes one.
KINDS: Mapping[str, Kind] = {
    "study": Kind(
        "a study", "study", ("grid", "variant", "rung"), ("Study",), "pmor.lab.study.settings:load",
        "pmor.lab.study.run:run", "",
    ),
    "campaign": Kind(
        "a campaign", "campaign", ("designs",), ("Campaign",), "pmor.campaigns.loader:load", "pmor.campaigns.run:run",
        "pmor.campaigns.plan:plan", "designs have no results",
    ),
    "design": Kind(
        "a design", "design", ("variables",), ("DesignFile",), "pmor.design.loader:load",
        "pmor.design.run:run", "pmor.design.plan:plan",
    ),
    "gearbox": Kind(
        "a gearbox", "run", ("shafts", "bearings"), ("GearboxFile",), "pmor.rexs.files:load_gearbox",
        "pmor.app.machines:run_gearbox", "pmor.machine.plan:plan",
    ),
    "set": Kind(
        "a planetary set or a train of gears", "run", ("sun", "planet", "planets", "ring", "gears"), ("SetFile",),
        "pmor.rexs.files:load_set", "pmor.app.machines:run_set", "pmor.sets.preview:plan",
    ),
    "case": Kind(
        "a case of one pair", "run", (), ("Case",), "pmor.case:load_case", "pmor.app.run:run_case",
        "pmor.app.plan:plan_case", "positions failed",
    ),
}  # fmt: skip


@dataclass(frozen=True)
class Question:
    """A question asked of a case, with files of its own: `run` and `failed` as of a `Kind`.

    Parameters
    ----------
    executor : callable
        Makes one from a number of jobs.
    """

    run: str
    failed: str
    executor: Callable[[int], AbstractContextManager[Executor | None]] = threads


QUESTIONS: Mapping[str, Question] = {
    "dynamics": Question("pmor.dynamics.run:run", "parts of responses are missing", processes),
    "convergence": Question("pmor.lab.convergence.run:run", "meshes did not converge"),
    "stability": Question("pmor.lab.stability.run:run", "variants failed"),
    "reductions": Question("pmor.lab.comparison.run:run", "states did not converge"),
}


def called(place: str) -> Callable[..., Any]:
    """Return the function at "module:function"."""
    module, _, name = place.partition(":")
    found: Callable[..., Any] = getattr(import_module(module), name)
    return found


def kind_of(path: Path) -> str:
    """Return what kind of file it is: a key of `KINDS`.

    Raises
    ------
    CaseError, FileFormatError
        Where it cannot be read.
    """
    from pmor.case.reader import parse_toml, read_text
    from pmor.rexs.model import is_rexs

    if is_rexs(path):
        from pmor.rexs.sets import is_one_set

        return "set" if is_one_set(path) else "gearbox"
    written = parse_toml(read_text(path, "case file"), str(path)).keys()
    return next(name for name, kind in KINDS.items() if not kind.sections or written & set(kind.sections))


def kind_of_settings(settings: object) -> str:
    """Return the kind of what a reader returned; TypeError for anything else."""
    name = type(settings).__name__
    for kind, record in KINDS.items():
        if name in record.types:
            return kind
    raise TypeError(f"{settings!r:.60}: must be the name of a file, or what pmor.load() returned")


def load_as(path: Path, command: str, wanted: str) -> Any:
    """Read a file as the kind that a command takes.

    Raises
    ------
    CaseError, GeometryError, FileFormatError
        As its reader does; with the right command where the file is of another kind.
    """
    # A planetary stage of a REXS file is a set and a gearbox: alone or with its shafts.
    from pmor.rexs.model import is_rexs

    if not (is_rexs(path) and wanted in ("set", "gearbox")):
        _refuse_other_kinds(path, command, wanted)
    return called(KINDS[wanted].load)(path)


def _refuse_other_kinds(path: Path, command: str, wanted: str) -> None:
    kind = kind_of(path)
    untold = kind == "case" and KINDS[wanted].sections  # a case is what nothing tells: readers say what is missing
    if kind != wanted and not untold:
        rule = f"is {KINDS[kind].words}, and pmor {command} takes {KINDS[wanted].words}: use pmor {KINDS[kind].command}"
        raise CaseError(f"{printable(str(path))}: {rule}")
