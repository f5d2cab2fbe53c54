"""Summary of a run on the screen."""

from __future__ import annotations

from dataclasses import replace

from pmor.report.models import model_text
from pmor.report.summary import Row, accuracy_rows, summary_rows, summary_text, warnings
from pmor_online.run import OnlineResult


def result_text(result: OnlineResult) -> str:
    """Return the short summary: the case's own model, the others beside it, and warnings."""
    text = summary_text(result.case.title, _rows(result))
    return "\n".join([text, *model_text(result), *(f"  ! {warning}" for warning in warnings(result))])


# Rows that are known once the model is held against full FE, and its file written.
PROOF = ("reduced vs full, max", "reduced vs full, rms", "full FE time", "offline time", "basis")


def asked_text(result: OnlineResult) -> str:
    """Return what was asked for, before it is held against full FE: title, figures of the sweep, warnings."""
    return "\n".join([result.case.title, *_lines(result, proof=False), *(f"  ! {text}" for text in warnings(result))])


def proof_text(result: OnlineResult) -> str:
    """Return what `asked_text` could not know yet."""
    told = warnings(replace(result, comparison=None, others=()))
    later = (f"  ! {text}" for text in warnings(result) if text not in told)
    return "\n".join([*_lines(result, proof=True), *model_text(result), *later])


def _rows(result: OnlineResult) -> list[Row]:
    return [*summary_rows(result), *accuracy_rows(result)]


def _lines(result: OnlineResult, *, proof: bool) -> list[str]:
    rows = _rows(result)
    lines = summary_text("", rows).split("\n")[1:]
    return [line for line, (label, *_) in zip(lines, rows, strict=True) if (label in PROOF) == proof]
