"""Sets and gearboxes solved, once or over torques and variants; REXS files are beside those of their results."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from pmor.case.capability import why_not
from pmor.machine.loader import GearboxFile
from pmor.machine.result import GearboxResult
from pmor.machine.run import run as solve_gearbox
from pmor.rexs.document import save
from pmor.rexs.write_gearbox import gearbox_rexs
from pmor.rexs.write_set import set_rexs
from pmor.sets.loader import SetFile
from pmor.sets.result import SetResult
from pmor.sets.run import run as solve_set


def run_set(file: SetFile, **options: Any) -> SetResult:
    """Solve a set as `pmor.sets.run.run`; its result leaves `set.rexs` where REXS has words for it."""
    return with_rexs(solve_set(file, **options))


def run_gearbox(file: GearboxFile, **options: Any) -> GearboxResult:
    """Solve a gearbox as `pmor.machine.run.run`; its result leaves `gearbox.rexs` where REXS has words for it."""
    return with_rexs(solve_gearbox(file, **options))


def with_rexs(found: Any) -> Any:
    """Return a result that leaves a REXS file where REXS has words for the machine."""
    name, write = ("set.rexs", _set_rexs) if isinstance(found, SetResult) else ("gearbox.rexs", _gearbox_rexs)
    return found if why_not(found.file, "rexs") else replace(found, beside={name: write})


def _set_rexs(result: SetResult, path: Path) -> None:
    save(path, True, lambda date: set_rexs(result.file, result.solution, date))


def _gearbox_rexs(result: GearboxResult, path: Path) -> None:
    save(path, True, lambda date: gearbox_rexs(result.file, result.loads, result.data["loads"], date))
