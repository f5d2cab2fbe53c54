"""Summary of a run on the screen."""

from __future__ import annotations

from pmor.report.models import model_text
from pmor.report.summary import summary_rows, summary_text, warnings
from pmor_online.run import OnlineResult


def result_text(result: OnlineResult) -> str:
    """Return the short summary: the case's own model, the others beside it, and warnings."""
    text = summary_text(result.case.title, summary_rows(result))
    return "\n".join([text, *model_text(result), *(f"  ! {warning}" for warning in warnings(result))])
