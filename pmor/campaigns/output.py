"""Everything that a campaign leaves in its folder, and the summary on the screen.

Results and times are files apart: the first are the same bytes whoever solved which design, and when.
"""

from __future__ import annotations

import csv
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np

from pmor.campaigns.chunks import PARTS
from pmor.campaigns.columns import Columns, columns_of, unit_of
from pmor.campaigns.figures import BY_KEY
from pmor.campaigns.page import CASES, blocks_of, case_file, linked_designs
from pmor.campaigns.relations import text_of_design
from pmor.campaigns.rows import STATUSES
from pmor.campaigns.run import Done
from pmor.campaigns.settings import Campaign
from pmor.core.progress import format_time
from pmor.report.data_files import write_summary_json
from pmor.report.page import write_page
from pmor.report.provenance import machine
from pmor.storage.atomic import atomic_path
from pmor.storage.campaign_file import NUMBER, STATUS, CampaignFile, write_campaign_file
from pmor.storage.results_folder import remove_working_folder, working_folder

#: results, which are made from the campaign file alone
RESULTS = ("campaign.json", "campaign.csv", "campaign.h5")
#: what `write_campaign` may leave, beside case files
FILES = (*RESULTS, "report.html", "times.json", "times.csv")
WORKING = (PARTS, CASES)
DIGITS = 6  # of seconds


def gathered(done: Done) -> Columns:
    """Return all designs of a campaign that is done."""
    return columns_of(done.campaign, (answer for _, answer in done.files.finished(done.chunks)))


def write_campaign(done: Done, columns: Columns, workers: int | None, out: Path) -> None:
    """Write results, times, cases and the page; finished chunks are given up.

    Parameters
    ----------
    done : Done
    columns : Columns
    workers : int or None
        Processes that solved; None where that is not known.
    out : Path

    Raises
    ------
    OutputError
    """
    campaign = done.campaign
    write_summary_json(out / "campaign.json", campaign_data(campaign, columns))
    write_csv(out / "campaign.csv", campaign, columns)
    write_hdf5(out / "campaign.h5", campaign, columns)
    _write_cases(out, campaign, columns)
    write_summary_json(out / "times.json", _times(done, columns, workers))
    _write_times(out / "times.csv", columns)
    write_page(out / "report.html", campaign.title, blocks_of(campaign, columns))
    remove_working_folder(out / PARTS)


def campaign_data(campaign: Campaign, columns: Columns) -> dict[str, Any]:
    """Return the content of `campaign.json`: how many designs there are of each kind, and how good they get."""
    reasons = Counter(reason for reason in columns.reasons if reason)
    return {
        "campaign": campaign.name,
        "title": campaign.title,
        "n_designs": campaign.count,
        **{f"n_{status.replace(' ', '_')}": columns.count(status) for status in STATUSES},
        "inputs": list(columns.inputs),
        "results": {key: _extremes(values) for key, values in columns.results.items()},
        "reasons": [{"reason": reason, "designs": n} for reason, n in sorted(reasons.items(), key=lambda r: -r[1])],
    }


def campaign_text(done: Done, columns: Columns) -> str:
    """Return the short summary for the screen: how many designs, the least of each result, what failed."""
    campaign = done.campaign
    counts = ", ".join(f"{columns.count(status)} {status}" for status in STATUSES if columns.count(status))
    lines = [campaign.title, f"  {campaign.count} designs: {counts}"]
    for key in list(columns.results)[:2]:
        found = _extremes(columns.results[key])
        if found["least"] is not None:
            figure = BY_KEY[key]
            lines.append(f"  {figure.label}: {found['least']:.4g} to {found['most']:.4g} {figure.unit}, the least of "
                         f"design {found['design_of_least']}")  # fmt: skip
    if done.solving_s:
        lines.append(f"  {format_time(done.solving_s)} of computing in {format_time(done.wall_s)}")
    return "\n".join([*lines, *(f"  ! design {i + 1}: {columns.reasons[i]}" for i in columns.failed[:10])])


def write_case(campaign: Campaign, design: dict[str, Any], number: int, path: Path, overwrite: bool = False) -> None:
    """Write the case file of a design.

    Parameters
    ----------
    campaign : Campaign
    design : dict
        With what follows from relations.
    number : int
        Of the design, from 1.
    path : Path
    overwrite : bool
        As in `pmor.storage.atomic.atomic_path`.

    Raises
    ------
    OutputError
    """
    said = ", ".join(f"{name} = {value:g}" for name, value in design.items())
    text = f"# Design {number} of the campaign {campaign.name}: {said}\n\n{text_of_design(campaign.base_text, design)}"
    with atomic_path(path, overwrite) as temporary:
        temporary.write_text(text, encoding="utf-8")


def _write_cases(out: Path, campaign: Campaign, columns: Columns) -> None:
    folder = working_folder(out / CASES, anew=True)
    for i in linked_designs(columns):
        design = {name: int(values[i]) if name in campaign.whole else float(values[i])
                  for name, values in columns.inputs.items()}  # fmt: skip
        write_case(campaign, design, i + 1, folder / case_file(i + 1))


def _extremes(values: np.ndarray) -> dict[str, Any]:
    if not np.isfinite(values).any():
        return {"least": None, "most": None, "design_of_least": None, "design_of_most": None}
    least, most = int(np.nanargmin(values)), int(np.nanargmax(values))
    return {
        "least": values[least], "most": values[most], "design_of_least": least + 1, "design_of_most": most + 1
    }  # fmt: skip


def write_csv(path: Path, campaign: Campaign, columns: Columns) -> None:
    """Write one line per design, one after the other: there may be millions."""
    values = [*((name in campaign.whole, column) for name, column in columns.inputs.items()),
              *((False, column) for column in columns.results.values())]  # fmt: skip
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["design", "status", *columns.inputs, *columns.results, "reason"])
        for i, code in enumerate(columns.status):
            fields = [_field(column[i], whole) for whole, column in values]
            writer.writerow([i + 1, STATUSES[code], *fields, columns.reasons[i]])


def _field(value: float, whole: bool) -> str:
    """Shortest text that reads back as the same number; empty for NaN."""
    return "" if np.isnan(value) else repr(int(value) if whole else float(value))


def write_hdf5(path: Path, campaign: Campaign, columns: Columns) -> None:
    """Write all columns."""
    units = {f"inputs/{name}": unit_of(name) or "1" for name in columns.inputs}
    units |= {f"results/{key}": BY_KEY[key].unit for key in columns.results}
    arrays: dict[str, np.ndarray] = {
        NUMBER: np.arange(1, campaign.count + 1), STATUS: columns.status,
        **{f"inputs/{name}": values for name, values in columns.inputs.items()},
        **{f"results/{key}": values for key, values in columns.results.items()},
    }  # fmt: skip
    write_campaign_file(path, CampaignFile(campaign.name, campaign.source_text, STATUSES, units, arrays))


def _times(done: Done, columns: Columns, workers: int | None) -> dict[str, Any]:
    """Times of this run; designs that an earlier one had solved count among the solved ones alone."""
    return {
        "machine": machine(),
        "n_chunks": len(done.chunks),
        "n_designs_resumed": done.resumed,
        "solving_s": float(columns.solving_s.sum()),
        "solving_this_run_s": done.solving_s,
        "wall_s": done.wall_s,
        "workers": workers,
        "efficiency": done.solving_s / (workers * done.wall_s) if workers and done.wall_s else None,
    }


def _write_times(path: Path, columns: Columns) -> None:
    lines = [f"{i + 1},{seconds:.{DIGITS}f}\n" for i, seconds in enumerate(columns.solving_s)]
    with atomic_path(path) as temporary:
        temporary.write_text("design,processor_s\n" + "".join(lines), encoding="utf-8")
