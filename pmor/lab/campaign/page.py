"""The page of a campaign: what became of the designs, the best of them, and all to look through."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from pmor.lab.campaign.columns import Columns, unit_of
from pmor.lab.campaign.figures import FIGURES
from pmor.lab.campaign.rows import STATUSES
from pmor.lab.campaign.settings import Campaign
from pmor.report.explorer import Column, Designs
from pmor.report.page import Block, Heading, Warning
from pmor.report.table import Cell, Table

# Folder of case files, beside the page.
CASES = "cases"
# Designs that the page lets look through, and those of them with a case file: a megabyte or two each.
MOST_SHOWN, MOST_CASES = 10_000, 1_000
# Lines of tables.
BEST, COMMON_REASONS = 10, 12
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(\.\d+)?(e[-+]?\d+)?(?!\w)")
RANKED = "ste_peak_to_peak_um"


def case_file(number: int) -> str:
    """Return the name of the case file of a design."""
    return f"design_{number:06d}.toml"


def linked_designs(columns: Columns) -> Sequence[int]:
    """Return the designs, from 0, that get a case file: all that have all their keys, unless they are many."""
    known = np.ones(len(columns.status), dtype=bool)
    for values in columns.inputs.values():
        known &= np.isfinite(values)
    return np.flatnonzero(known).tolist() if len(known) <= MOST_CASES else []


def blocks_of(campaign: Campaign, columns: Columns) -> list[Block | Designs]:
    """Return what the page shows, in the order of reading."""
    counts = {status: columns.count(status) for status in STATUSES}
    blocks: list[Block | Designs] = []
    for i in columns.failed[:BEST]:
        blocks.append(Warning(f"design {i + 1}: {columns.reasons[i]}"))
    if len(columns.failed) > BEST:
        blocks.append(Warning(f"{len(columns.failed) - BEST} more designs without results: see campaign.csv"))
    varied = ", ".join(variable.name for variable in campaign.variables)
    derived = [name for name in campaign.columns if name in campaign.relations.solved]
    follows = f" {', '.join(derived)} follow{'s' * (len(derived) == 1)} from relations." if derived else ""
    blocks += [
        f"{campaign.count} designs of the case {campaign.base.name}: {counts['ok']} solved, {counts['infeasible']} "
        f"infeasible, {len(columns.failed)} failed. From design to design differ: {varied}.{follows} Every design has "
        "finite elements of its own gears, exact line loads and the sweep of its case; figures are those at the "
        "nominal torque.",
        Heading("Designs"),
        *_explorer(campaign, columns),
        _best(columns),
        _reasons(columns),
    ]
    return blocks


def _explorer(campaign: Campaign, columns: Columns) -> list[Block | Designs]:
    total = len(columns.status)
    step = -(-total // MOST_SHOWN)
    shown = np.arange(0, total, step)
    labels = {figure.key: figure for figure in FIGURES}
    linked = set(linked_designs(columns))
    found = [Column(name, name.replace(".", " ").replace("_", " "), unit_of(name), values[shown], "input")
             for name, values in columns.inputs.items()]  # fmt: skip
    for key, values in columns.results.items():
        if np.isfinite(values).any():
            unit = labels[key].unit
            found.append(Column(key, labels[key].label, "" if unit == "1" else unit, values[shown], "result"))
    designs = Designs(
        tuple(found), np.array([f"design {i + 1}" for i in shown]),
        np.array([f"{CASES}/{case_file(int(i) + 1)}" if i in linked else "" for i in shown]),
        np.array([columns.reasons[i] for i in shown]),
    )  # fmt: skip
    part = f"One design in {step} is shown, from the first on; all are in campaign.csv. " if step > 1 else ""
    each = "The name of a design leads to its case file." if linked else (
        f"`pmor campaign {campaign.source.name} --case N` writes the case file of design N."
    )
    return [f"{part}{each}", designs]


def _best(columns: Columns) -> Table:
    """Designs of the least peak-to-peak, one line each."""
    values = columns.results.get(RANKED)
    key = RANKED if values is not None else next(iter(columns.results))
    ranked = columns.results[key]
    order = [int(i) for i in np.argsort(ranked, kind="stable")[:BEST] if np.isfinite(ranked[i])]
    labels = {figure.key: f"{figure.label}, {figure.unit}" if figure.unit != "1" else figure.label
              for figure in FIGURES}  # fmt: skip
    shown = [name for name, column in columns.results.items() if np.isfinite(column).any()]
    rows: list[list[Cell]] = [
        [i + 1, *(float(column[i]) for column in columns.inputs.values()),
         *(float(columns.results[name][i]) for name in shown)]
        for i in order
    ]  # fmt: skip
    heads = ("design", *columns.inputs, *(labels[name] for name in shown))
    return Table(f"Least {labels[key]}", heads, rows)


def _reasons(columns: Columns) -> Table:
    """Reasons that differ in their numbers alone are one."""
    found: dict[str, list[int]] = {}
    for i, reason in enumerate(columns.reasons):
        if reason:
            found.setdefault(NUMBER.sub("…", reason), []).append(i)
    common = sorted(found.values(), key=len, reverse=True)[:COMMON_REASONS]
    rows: list[list[Cell]] = [[len(group), group[0] + 1, columns.reasons[group[0]]] for group in common]
    return Table("Why designs have no results", ("designs", "such as design", "which says"), rows)
