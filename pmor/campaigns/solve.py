"""One design: from the keys that it changes to its row of the table."""

from __future__ import annotations

from pmor.campaigns.kind import Design
from pmor.campaigns.kinds import KINDS
from pmor.campaigns.rows import NAME, Row, Task, plain_row
from pmor.core.errors import CaseError, ConvergenceError, GeometryError, InsufficientMemoryError, MeshError
from pmor.storage.gear_store import Store


def row_of(task: Task, number: int, design: Design, store: Store) -> Row:
    """Solve a design, numbered from 1; return its row, plain data, always the same for the same design."""
    kind, name, complete = KINDS[task.kind], f"{NAME} {number}", dict(design)
    try:
        complete = kind.complete(task.base_text, design, task.relations)
        text = kind.text(task.base_text, complete)
        if task.fine:
            return plain_row(task, number, complete, "ok", "", kind.peaks(text, name, store))
        solved = kind.solve(text, name, store, task.results)
    except InsufficientMemoryError as error:
        reason = str(error)
        if task.workers.memory_GiB is not None:
            reason = reason.replace("ulimit -d", "[workers] memory_GiB")
        return plain_row(task, number, complete, "lost", reason)
    except (CaseError, GeometryError, MeshError) as error:
        reason = kind.why(str(error), task.base_text, complete, task.relations)
        return plain_row(task, number, complete, "infeasible", reason)
    except ConvergenceError as error:
        return plain_row(task, number, complete, "not converged", str(error))
    if solved.failure:  # a cycle with gaps is no result to compare designs by
        return plain_row(task, number, complete, "not converged", solved.failure)
    return plain_row(task, number, complete, "ok", "", solved.results)
