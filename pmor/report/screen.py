"""Summary of a run on the screen, and the table of the reduced models that a case compares."""

from __future__ import annotations

from dataclasses import replace

from pmor.case.models import SHAPES_OF_MODEL
from pmor.report.summary import Row, accuracy_rows, model_summary, summary_rows, summary_text, warnings
from pmor.report.table import Cell, Table, aligned_lines
from pmor.report.verdict import verdict_text
from pmor_online.run import LostModel, OnlineResult

#: purpose of a contact scheme with its own reduction
TAKE_FOR = {
    "paper": "to repeat the paper: shapes of full solves at trained angles, interpolated between them",
    "direct": "for Hermite patches through the mesh: shapes of flank lines, without interpolation",
    "facet": "to see the result of conventional contact elements on this mesh",
    "line": "for all else: exact at any torque, axes and modification, untrained, the fastest",
}
COLUMNS = (
    "model", "shapes", "unknowns", "error max, %", "rms, %", "offline, s", "online, ms", "full FE, ms", "STE mean, µm",
    "p-p, µm",
)  # fmt: skip


def model_table(result: OnlineResult) -> Table:
    """Return a row for each model that a case compares; none where it compares its own alone."""
    positions = result.comparison.full.ste_um.size if result.comparison else 0
    note = (
        f"Error against full FE of the same contact scheme at {positions} unseen positions; times of a position. "
        "Offline counts the finite elements, which are solved once for all."
    )
    return Table("Reduced models beside full FE", COLUMNS, list(map(_row, result.models)), note)


def model_text(result: OnlineResult) -> list[str]:
    """Return the table and the purpose of each model as lines for the screen; none without other models."""
    if not result.models:
        return []
    table = model_table(result)
    columns = [column.replace(",", "").replace("µ", "u") for column in table.columns]
    lines = [*aligned_lines(columns, table.rows), *(f"take {name:<6} {purpose}" for name, purpose in advice(result))]
    return [f"  {table.title}", *(f"    {line}" for line in lines)]


def advice(result: OnlineResult) -> list[tuple[str, str]]:
    """Return name and purpose of each model."""
    purposes = list[tuple[str, str]]()
    for model in result.models:
        scheme, shapes = model.case.contact.scheme, model.case.reduction.shapes
        known = shapes == SHAPES_OF_MODEL[scheme]
        purposes.append((scheme, TAKE_FOR[scheme] if known else f"where {shapes} are wanted: the case's own choice"))
    return purposes


def _row(model: OnlineResult | LostModel) -> list[Cell]:
    s = model_summary(model)
    errors = s["rom_vs_full_ste_max_rel"], s["rom_vs_full_ste_rms_rel"]
    percent = [None if error is None else 100 * error for error in errors]
    times = s["offline_s"], s["online_ms_per_position"], s["full_ms_per_position"]
    return [s["name"], s["shapes"], s["rom_size"], *percent, *times, s["ste_mean_um"], s["ste_peak_to_peak_um"]]


def result_text(result: OnlineResult) -> str:
    """Return the short summary: the case's own model, the others beside it, and warnings."""
    title, *lines = summary_text(result.case.title, _rows(result)).split("\n")
    said = (f"  ! {warning}" for warning in warnings(result))
    return "\n".join([title, *_verdict(result), *lines, *model_text(result), *said])


# Rows that are known once the model is held against full FE, and its file written.
PROOF = ("reduced vs full, max", "reduced vs full, rms", "full FE time", "offline time", "basis")


def asked_text(result: OnlineResult) -> str:
    """Return what was asked for, before it is held against full FE: title, figures of the sweep, warnings."""
    said = (f"  ! {text}" for text in warnings(result))
    return "\n".join([result.case.title, *_verdict(result), *_lines(result, proof=False), *said])


def proof_text(result: OnlineResult) -> str:
    """Return what `asked_text` could not know yet."""
    told = warnings(replace(result, comparison=None, others=()))
    later = (f"  ! {text}" for text in warnings(result) if text not in told)
    return "\n".join([*_lines(result, proof=True), *model_text(result), *later])


def _verdict(result: OnlineResult) -> list[str]:
    return [] if result.verdict is None else verdict_text(result.verdict.data)


def _rows(result: OnlineResult) -> list[Row]:
    return [*summary_rows(result), *accuracy_rows(result)]


def _lines(result: OnlineResult, *, proof: bool) -> list[str]:
    rows = _rows(result)
    lines = summary_text("", rows).split("\n")[1:]
    return [line for line, (label, *_) in zip(lines, rows, strict=True) if (label in PROOF) == proof]
