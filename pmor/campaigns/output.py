"""Files of a campaign, and its summary on the screen.

Results and times are files apart: results are the same bytes for every executor and every time.
"""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from pmor.campaigns.bands import bands_of
from pmor.campaigns.campaign import Campaign
from pmor.campaigns.columns import Columns
from pmor.campaigns.keys import unit_of
from pmor.campaigns.kind import PEAKS, Design
from pmor.campaigns.page import CASE_FILE, CASES, blocks_of, case_file, common_reasons, linked_designs
from pmor.campaigns.rows import STATUSES
from pmor.campaigns.table import designs_of
from pmor.campaigns.verdict import campaign_verdict
from pmor.core.errors import CaseError
from pmor.core.progress import format_time
from pmor.report.data_files import write_summary_json
from pmor.report.page import machine, write_page
from pmor.report.verdict import verdict_text
from pmor.storage.atomic import atomic_path, ensure_folder, refuse_existing
from pmor.storage.campaign_file import NUMBER, STATUS, write_campaign_file
from pmor.storage.results_folder import refuse_in_the_way
from pmor.work.results import writing_results

#: results, made from the campaign file alone
RESULTS = ("campaign.json", "campaign.csv", "campaign.h5")
#: files of a campaign, beside case files
FILES = (*RESULTS, "report.html", "times.json", "times.csv")
DIGITS = 6  # of seconds
COMMON_REASONS = 4  # on the screen


def write_campaign(result: Columns, folder: Path, overwrite: bool = False) -> None:
    """Write results, times, cases and the page; finished chunks are given up."""
    campaign = result.campaign
    with writing_results(folder, FILES, campaign.text, inputs=campaign.inputs, overwrite=overwrite) as out:
        _write_cases(result, out / CASES, overwrite)
        write_summary_json(out / "campaign.json", campaign_data(result))
        write_csv(out / "campaign.csv", result)
        write_hdf5(out / "campaign.h5", result)
        write_summary_json(out / "times.json", _times(result))
        _write_times(out / "times.csv", result)
        write_page(out / "report.html", campaign.sections.title, blocks_of(result, campaign_verdict(result)))


def refuse_changed_cases(campaign: Campaign, folder: Path, overwrite: bool) -> None:
    """Raise OutputError where a case file of an earlier run was changed, or is none of ours."""
    there = {path.name for path in (folder / CASES).glob("*.*")}
    ours = [name for name in sorted(there) if CASE_FILE.fullmatch(name)]
    refuse_in_the_way([folder / CASES / name for name in ours], overwrite, campaign.inputs)


def campaign_data(result: Columns) -> dict[str, Any]:
    """Return the content of `campaign.json`: designs by status, least and largest results, reasons."""
    reasons = Counter(reason for reason in result.reasons if reason)
    peaks = [key for key in PEAKS if key in result.results]
    return {
        "campaign": result.campaign.name,
        "title": result.campaign.sections.title,
        "verdict": campaign_verdict(result).data,
        "n_designs": result.campaign.count,
        **{f"n_{status.replace(' ', '_')}": result.count(status) for status in STATUSES},
        "inputs": list(result.inputs),
        "results": {key: _extremes(result.judged(key)) for key in result.results},
        "bands": [
            {"result": band.key, "base": band.base, "least": band.least, "most": band.most, "decides": band.decides,
             "by_key": {name: list(span) for name, span in band.spans.items()}}
            for band in bands_of(result)
        ],
        "fine_angles": [
            {"design": i + 1, **row["results"], "of_the_case": {key: result.results[key][i] for key in peaks}}
            for i, row in sorted(result.fine.items())
        ],
        "reasons": [{"reason": reason, "designs": n} for reason, n in sorted(reasons.items(), key=lambda r: -r[1])],
    }


def campaign_text(result: Columns) -> str:
    """Return the short summary for the screen: designs by status, the least of each result, failures."""
    effort = result.effort
    counts = ", ".join(f"{result.count(status)} {status}" for status in STATUSES if result.count(status))
    lines = [result.campaign.sections.title, *verdict_text(campaign_verdict(result).data)]
    lines += [f"  {result.campaign.count} designs: {counts}"]
    infeasible = [reason if status == "infeasible" else "" for reason, status in zip(
        result.reasons, result.status, strict=True)]  # fmt: skip
    for group in common_reasons(infeasible)[:COMMON_REASONS]:
        lines.append(f"  infeasible, {len(group)} of them such as design {group[0] + 1}: {infeasible[group[0]]}")
    for key in list(result.results)[:2]:
        found = _extremes(result.judged(key))
        if found["least"] is not None:
            figure, least = result.campaign.kind.figure(key), found["design_of_least"]
            of_file = f"on the angles of its {result.campaign.kind.key}"
            few = f" ({result.results[key][least - 1]:.4g} {of_file})" if key in PEAKS else ""
            lines.append(f"  {figure.symbol}: {found['least']:.4g} to {found['most']:.4g} {figure.unit}, the least of "
                         f"design {least}{few}")  # fmt: skip
    if effort.solving_s:
        lines.append(f"  {format_time(effort.solving_s)} of computing in {format_time(effort.wall_s)}")
    return "\n".join([*lines, *(f"  ! {failure}" for failure in result.failures[:10])])


def write_design(campaign: Campaign, number: int, folder: Path, overwrite: bool = False) -> Path:
    """Write the case file of a design, numbered from 1, into a folder and return its path.

    Raises
    ------
    CaseError
        When there is no such design.
    GeometryError
        When the relations cannot be met.
    OutputError
    """
    if number > campaign.count:
        raise CaseError(
            f"number {number}: {campaign.inputs[0]} has {campaign.count} designs: give one of these numbers"
        )
    design = designs_of(campaign)(number - 1)
    design = campaign.kind.complete(campaign.base_text, design, campaign.sections.relations)
    target = ensure_folder(folder) / f"{campaign.name}_design_{number}.toml"
    texts = _case_texts(campaign, design, number, target.stem)
    for name in texts:
        refuse_existing(target.parent / name, overwrite)
    _write_texts(texts, target.parent, overwrite)
    return target


def _case_texts(campaign: Campaign, design: Design, number: int, stem: str) -> dict[str, str]:
    """Return the files of a design by their names, the one that names the others first."""
    said = ", ".join(f"{name} = {value:g}" for name, value in design.items())
    head = f"# Design {number} of the campaign {campaign.name}: {said}"
    texts = campaign.kind.files(campaign.kind.text(campaign.base_text, design), stem)
    return {f"{stem}{end}": f"{head}\n\n{text}" if end == ".toml" else text for end, text in texts.items()}


def _write_texts(texts: Mapping[str, str], folder: Path, overwrite: bool = False) -> None:
    for name, text in texts.items():
        with atomic_path(folder / name, overwrite) as temporary:
            temporary.write_text(text, encoding="utf-8")


def _write_cases(result: Columns, folder: Path, overwrite: bool) -> None:
    """Write the case files that the page links to; those of another campaign go, unless they were changed."""
    texts: dict[str, str] = {}
    for i in linked_designs(result):
        texts |= _case_texts(result.campaign, result.design(i), i + 1, Path(case_file(i + 1)).stem)
    with writing_results(folder, list(texts), result.campaign.text, overwrite=overwrite, working=()):
        _write_texts(texts, folder)


def _extremes(values: np.ndarray) -> dict[str, Any]:
    if not np.isfinite(values).any():
        return {"least": None, "most": None, "design_of_least": None, "design_of_most": None}
    least, most = int(np.nanargmin(values)), int(np.nanargmax(values))
    return {
        "least": values[least], "most": values[most], "design_of_least": least + 1, "design_of_most": most + 1
    }  # fmt: skip


def write_csv(path: Path, result: Columns) -> None:
    """Write one line per design, one after the other: there may be millions."""
    values = [*((name in result.campaign.whole, column) for name, column in result.inputs.items()),
              *((False, column) for column in result.results.values())]  # fmt: skip
    with atomic_path(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["design", "status", *result.inputs, *result.results, "reason"])
        for i, code in enumerate(result.codes):
            fields = [_field(column[i], whole) for whole, column in values]
            writer.writerow([i + 1, STATUSES[code], *fields, result.reasons[i]])


def _field(value: float, whole: bool) -> str:
    """Shortest text that reads back as the same number; empty for NaN."""
    return "" if np.isnan(value) else repr(int(value) if whole else float(value))


def write_hdf5(path: Path, result: Columns) -> None:
    """Write all columns."""
    units = {f"inputs/{name}": unit_of(name, result.campaign.kind.known) or "1" for name in result.inputs}
    units |= {f"results/{key}": result.campaign.kind.figure(key).unit for key in result.results}
    arrays: dict[str, np.ndarray] = {
        NUMBER: np.arange(1, len(result.codes) + 1), STATUS: result.codes,
        **{f"inputs/{name}": values for name, values in result.inputs.items()},
        **{f"results/{key}": values for key, values in result.results.items()},
    }  # fmt: skip
    campaign = result.campaign
    write_campaign_file(path, campaign.name, campaign.source_text, STATUSES, units, arrays)


def _times(result: Columns) -> dict[str, Any]:
    """Times of this run; designs that an earlier one had solved count among the solved ones alone."""
    effort = result.effort
    available_s = (effort.workers or 0) * effort.wall_s
    return {
        "machine": machine(),
        "n_chunks": effort.n_chunks,
        "n_designs_resumed": effort.resumed,
        "solving_s": float(result.solving_s.sum()),
        "solving_this_run_s": effort.solving_s,
        "wall_s": effort.wall_s,
        "workers": effort.workers,
        "efficiency": effort.solving_s / available_s if available_s else None,
    }


def _write_times(path: Path, result: Columns) -> None:
    lines = [f"{i + 1},{seconds:.{DIGITS}f}\n" for i, seconds in enumerate(result.solving_s)]
    with atomic_path(path) as temporary:
        temporary.write_text("design,processor_s\n" + "".join(lines), encoding="utf-8")
