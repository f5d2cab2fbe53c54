"""The rows of designs, and of chunks of them: plain data between processes and machines."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from pmor.campaigns.kind import Design
from pmor.campaigns.settings import RELATIONS, AnyRelations, Workers

Row = dict[str, Any]
Status = Literal["ok", "infeasible", "not converged", "lost"]
# In the order of their codes in files.
STATUSES: tuple[Status, ...] = ("ok", "infeasible", "not converged", "lost")
# Under which the file of a design is checked, with its number.
NAME = "design"


@dataclass(frozen=True, kw_only=True)
class Task:
    """All that the designs of a campaign have in common, their kind, base file, rows and store."""

    kind: str
    base_text: str
    relations: AnyRelations
    columns: tuple[str, ...]
    results: tuple[str, ...]
    workers: Workers
    store: str
    store_bytes: float
    fine: bool = False  # Whether the peak-to-peak STE on fine angles is all that is asked for

    @staticmethod
    def from_json(plain: dict[str, Any]) -> Task:
        """Return the task of `dataclasses.asdict`, through JSON."""
        relations: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in plain["relations"].items()}
        given = {"relations": RELATIONS[plain["kind"]](**relations), "workers": Workers(**plain["workers"])}
        return Task(**{**plain, **given, "columns": tuple(plain["columns"]), "results": tuple(plain["results"])})


@dataclass(frozen=True)
class Keys:
    """Keys that every row of a campaign holds: of its designs, and of their results."""

    inputs: tuple[str, ...]
    results: tuple[str, ...]


@dataclass(frozen=True)
class Answer:
    """Rows of the designs of a chunk, in order, the same under each executor, and their processor times, s."""

    rows: tuple[Row, ...]
    seconds: tuple[float, ...]


def plain_row(
    task: Task, number: int, design: Design, status: Status, reason: str,
    results: Mapping[str, float | None] | None = None,
) -> Row:  # fmt: skip
    """Return the row of a design: None for unknown values."""
    found = results or {}
    return {
        "design": number,
        "status": status,
        # One line, without the name under which the case was checked.
        "reason": " ".join(reason.removeprefix(f"{NAME} {number}: ").split()),
        "inputs": {name: design.get(name) for name in task.columns},
        "results": {key: found.get(key) for key in task.results},
    }


def read_answer(data: Any, designs: range, keys: Keys | None = None) -> Answer:
    """Return the answer of designs, counted from 0, of plain data; ValueError where a solver gave none such."""
    rows, seconds = data["rows"], data["seconds"]
    if not (len(rows) == len(seconds) == len(designs)) or not all(map(_is_number, seconds)):
        raise ValueError("no row and no time for each design")
    for number, row in zip(designs, rows, strict=True):
        whole = row["design"] == number + 1 and row["status"] in STATUSES and isinstance(row["reason"], str)
        for name in ("inputs", "results"):
            values = row[name]
            known = keys is None or set(values) == set(getattr(keys, name))
            whole = whole and known and all(value is None or _is_number(value) for value in values.values())
        if not whole:
            raise ValueError(f"no row of design {number + 1}")
    return Answer(tuple(rows), tuple(seconds))


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)
