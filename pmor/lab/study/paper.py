"""Claims of Cosco et al. (ISMA 2016), checked on a study."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pmor.lab.study.settings import Cell, Study
from pmor.report.page import Block, Heading
from pmor.report.table import Columns, table

Row = dict[str, Any]

# The paper's own yardstick is its finest mesh without refinement.
YARDSTICK = Cell(64, 1)
# A cell is as good as another when its errors are at most this many times as large.
AS_GOOD = 2.0
JUDGED = ("shape_error_um", "ripple_um")
SHOWN = (*JUDGED, "mean_error_um", "peak_to_peak_error_um")
MODELS = ("conventional", "condensed", "reduced")


def checked_claims(rows: Sequence[Row], study: Study) -> list[Row]:
    """Check the claims about quality that the study's cells allow to check.

    Each has `name`, `claim`, `criterion`, `confirmed`, the cell's numbers in `measured`, and those of the cell
    that it is held against in `yardstick`.
    """
    by_cell = {row["cell"]: row for row in rows if row["model"] == "condensed"}
    fine = by_cell.get(YARDSTICK.label)
    if fine is None:
        return []
    # Whether the paper says that this cell is as good as the yardstick.
    claimed = {(8, 8): False, (16, 4): True}
    return [
        _quality(cell, by_cell[cell.label], fine, claimed[cell.n_profile, cell.lodm])
        for cell in study.cells
        if cell not in study.ladder_cells and cell.label in by_cell and (cell.n_profile, cell.lodm) in claimed
    ]


def checked_time_claims(rows: Sequence[Row]) -> list[Row]:
    """Check, for each model, that refinement costs less than remeshing; keys as in `checked_claims`, no yardstick."""
    claims = (_refinement_is_cheaper(rows, model) for model in MODELS)
    return [claim for claim in claims if claim is not None]


def _quality(cell: Cell, row: Row, fine: Row, claimed: bool) -> Row:
    scheme = f", {cell.variant}" if cell.variant else ", our scheme"
    claim = (
        f"{cell.n_profile} elements at LoDM {cell.lodm} reach the quality of 64 elements at LoDM 1{scheme}"
        if claimed
        else f"{cell.n_profile} elements are not enough, even at LoDM {cell.lodm}{scheme}"
    )
    as_good = all(row[key] <= AS_GOOD * fine[key] for key in JUDGED)
    return {
        "name": f"quality_{cell.label}",
        "claim": claim,
        "criterion": f"as good as {YARDSTICK.label}: shape error and noise at most {AS_GOOD:g} times as large",
        "confirmed": as_good == claimed,
        "measured": {key: row[key] for key in SHOWN},
        "yardstick": {key: fine[key] for key in SHOWN},
    }


def _refinement_is_cheaper(rows: Sequence[Row], model: str) -> Row | None:
    """At every level of detail: fewer elements and more LoDM take less time per position."""
    times = {
        (row["detail"], row["n_profile"]): row["ms_per_position"]
        for row in rows
        if row["model"] == model and row["variant"] is None and row["ms_per_position"] is not None
    }
    ratios: dict[str, float] = {}
    for detail in sorted({detail for detail, _ in times}):
        sizes = [n for d, n in times if d == detail]
        few, many = min(sizes), max(sizes)
        if few < many:
            ratio = times[detail, many] / times[detail, few]
            ratios[f"time_ratio_{many}@{detail // many}_to_{few}@{detail // few}"] = ratio
    if not ratios:
        return None
    return {
        "name": f"refinement_is_cheaper_{model}",
        "claim": f"LoDM costs less than remeshing at equal detail: {model} model",
        "criterion": "at each level of detail the most elements take longer than the fewest",
        "confirmed": all(ratio > 1.0 for ratio in ratios.values()),
        "measured": ratios,
    }


def claim_blocks(claims: Sequence[Row]) -> list[Block]:
    """Return the table of verdicts; nothing without claims."""
    columns: Columns = {
        "claim": "claim",
        "verdict": lambda claim: "confirmed" if claim["confirmed"] else "not confirmed",
        "criterion": "criterion",
        "measured": _measured,
    }
    return [Heading("The paper's claims, checked"), table("Claims", columns, claims)] if claims else []


def _measured(claim: Row) -> str:
    """Write each number with its name in words, beside that of the yardstick."""
    texts = []
    for key, value in claim["measured"].items():
        name, unit = (key[:-3], " (µm)") if key.endswith("_um") else (key.removeprefix("time_ratio_"), "")
        held = claim.get("yardstick", {}).get(key)
        against = "" if held is None else f" against {held:.3g}"
        texts.append(f"{name.replace('_', ' ')}{unit} {value:.3g}{against}")
    return "; ".join(texts)
