"""The reduced models that a case compares: their table, and the purpose of each."""

from __future__ import annotations

from pmor.case.models import SHAPES_OF_MODEL
from pmor.report.summary import model_summary
from pmor.report.table import Cell, Table, aligned_lines
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
    found = list[tuple[str, str]]()
    for model in result.models:
        scheme, shapes = model.case.contact.scheme, model.case.reduction.shapes
        known = shapes == SHAPES_OF_MODEL[scheme]
        found.append((scheme, TAKE_FOR[scheme] if known else f"where {shapes} are wanted: the case's own choice"))
    return found


def _row(model: OnlineResult | LostModel) -> list[Cell]:
    s = model_summary(model)
    errors = s["rom_vs_full_ste_max_rel"], s["rom_vs_full_ste_rms_rel"]
    percent = [None if error is None else 100 * error for error in errors]
    times = s["offline_s"], s["online_ms_per_position"], s["full_ms_per_position"]
    return [s["name"], s["shapes"], s["rom_size"], *percent, *times, s["ste_mean_um"], s["ste_peak_to_peak_um"]]
