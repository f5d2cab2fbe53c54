"""The page of a campaign: designs by status, the best of them, and all to look through."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from pmor.campaigns.bands import bands_of
from pmor.campaigns.columns import Columns
from pmor.campaigns.keys import split, unit_of
from pmor.campaigns.kind import PEAKS, Kind
from pmor.campaigns.rows import STATUSES
from pmor.core.arrays import FloatArray
from pmor.report.explorer import Column, Designs
from pmor.report.page import Block, Heading, Warning
from pmor.report.table import Cell, Table
from pmor.results.quantities import Quantity
from pmor.results.verdict import Verdict

# Folder of case files, beside the page.
CASES, CASE_FILE = "cases", re.compile(r"design_\d{6,}(_.*)?\.(toml|csv)")
# Designs that the page lets look through, and those of them with a case file: a megabyte or two each.
MOST_SHOWN, MOST_CASES = 10_000, 1_000
# Lines of tables.
BEST, COMMON_REASONS = 10, 12
NUMBER = re.compile(r"(?<![\w.])[-+]?\d+(\.\d+)?(e[-+]?\d+)?(?!\w)")
ROUND_OFF = 1e-9
# Parts of the names of sections that say nothing to a reader.
UNTOLD = ("modification", "coast_modification", "blank", "shafts", "bearings", "places")
# Ends of keys, such as N_per_mm or kg_m2.
UNITS = re.compile(r"(_(k?N(mm?)?|[mu]?m|mm?[23]|GPa|MPa|mPas|m?rad|deg|rpm|Hz|kg|s2?|percent|per))+$")


def case_file(number: int) -> str:
    """Return the name of the case file of a design."""
    return f"design_{number:06d}.toml"


def linked_designs(result: Columns) -> Sequence[int]:
    """Return the designs, from 0, that get a case file: all that have all their keys, unless they are many."""
    known = np.ones(len(result.codes), dtype=bool)
    for values in result.inputs.values():
        known &= np.isfinite(values)
    return np.flatnonzero(known).tolist() if known.sum() <= MOST_CASES else []


def blocks_of(result: Columns, said: Verdict) -> list[Block | Designs]:
    """Return the blocks of the page, in the order of reading: the verdict first."""
    campaign = result.campaign
    counts = {status: result.count(status) for status in STATUSES}
    blocks: list[Block | Designs] = [said]
    blocks += [Warning(failure) for failure in result.failures[:BEST]]
    if len(result.failures) > BEST:
        blocks.append(Warning(f"{len(result.failures) - BEST} more designs without results: see campaign.csv"))
    varied = ", ".join(variable.name for variable in campaign.variables)
    at = "the largest over the load cases" if campaign.kind.key == "gearbox" else "those at the nominal torque"
    derived = [name for name in campaign.columns if name in campaign.sections.relations.solved]
    follows = f" {', '.join(derived)} follow{'s' * (len(derived) == 1)} from relations." if derived else ""
    blocks += [
        f"{campaign.count} designs of the {campaign.kind.key} {campaign.inputs[1].name}: {counts['ok']} solved, "
        f"{counts['infeasible']} infeasible, {len(result.failed)} failed. From design to design differ: {varied}."
        f"{follows} Every design has finite elements of its own gears, exact line loads and the sweep of its file; "
        f"figures are {at}.",
        Heading("Designs"),
        *_explorer(result),
        _bands(result) or _best(result),
        _reasons(result),
    ]
    return blocks


def label_of(name: str) -> str:
    """Return a key of the case in words, without its unit."""
    section, key = split(name)
    parts = [part for part in section.split(".") if part not in UNTOLD]
    return " ".join(UNITS.sub("", part).replace("_", " ") for part in (*parts, key))


def _explorer(result: Columns) -> list[Block | Designs]:
    step = -(-len(result.codes) // MOST_SHOWN)
    shown = np.arange(0, len(result.codes), step)
    linked = set(linked_designs(result))
    found = [Column(name, label_of(name), unit_of(name, result.campaign.kind.known), values[shown], "input")
             for name, values in result.inputs.items()]  # fmt: skip
    found += [Column(figure.key, figure.symbol, figure.shown_unit, result.results[figure.key][shown], "result")
              for figure in shown_results(result)]  # fmt: skip
    designs = Designs(
        tuple(found), np.array([f"design {i + 1}" for i in shown]),
        np.array([f"{CASES}/{case_file(int(i) + 1)}" if i in linked else "" for i in shown]),
        np.array([result.reasons[i] for i in shown]),
    )  # fmt: skip
    part = f"One design in {step} is shown, from the first on; all are in campaign.csv. " if step > 1 else ""
    file = f"{result.campaign.kind.key} file"
    each = (
        f"The name of a design links to its {file}."
        if linked
        else (f"pmor campaign {result.campaign.inputs[0].name} --case N writes the {file} of design N.")
    )
    return [f"{part}{each}", designs]


def shown_results(result: Columns) -> list[Quantity]:
    """Return the results that differ between designs by more than round-off, the most telling ones first."""
    differing = [key for key, values in result.results.items() if _differs(values)]
    kind = result.campaign.kind
    order = [key for key in kind.first if key in differing] + [key for key in differing if key not in kind.first]
    return [kind.figure(key) for key in order]


def _differs(values: FloatArray) -> bool:
    known = values[np.isfinite(values)]
    return len(known) > 0 and bool(np.ptp(known) > ROUND_OFF * np.abs(known).max())


def _best(result: Columns) -> Table:
    """Designs of the least of the first result, one line each."""
    figures = shown_results(result)[: len(result.campaign.kind.first)]
    if not figures:
        return Table("", (), [])
    ranked = result.judged(figures[0].key)
    order = [int(i) for i in np.argsort(ranked, kind="stable")[:BEST] if np.isfinite(ranked[i])]
    rows: list[list[Cell]] = [
        [i + 1, *(float(column[i]) for column in result.inputs.values()),
         *(float(result.judged(figure.key)[i]) for figure in figures), float(result.results[figures[0].key][i])]
        for i in order
    ]  # fmt: skip
    inputs = [head_of(name, result.campaign.kind) for name in result.inputs]
    results = [_headed(figure.symbol, figure.shown_unit) for figure in figures]
    base = result.campaign.kind.key
    few = _headed(f"{figures[0].symbol}, angles of the {base}", figures[0].shown_unit)
    note = f"Peak-to-peak STE is that on so many angles that it no longer moves; beside it, last, that of the {base}."
    note = note if figures[0].key in PEAKS else ""
    return Table(f"Least {figures[0].symbol}", ("design", *inputs, *results, few), rows, note)


def _bands(result: Columns) -> Table | None:
    """What keys that differ one at a time do to each result, and the key that decides it."""
    found = bands_of(result)
    if not found:
        return None
    rows: list[list[Cell]] = []
    for band in found:
        figure, (low, high) = result.campaign.kind.figure(band.key), band.spans[band.decides]
        head = _headed(figure.symbol, figure.shown_unit)
        rows.append([head, band.base, band.least, band.most, label_of(band.decides), low, high])
    columns = ("result", "base", "lowest", "highest", "decided by", "lowest with it", "highest with it")
    note = "Each key by itself, the others as in the first design: what several do together may be more."
    return Table("Bands, and the key that decides", columns, rows, note)


def head_of(name: str, kind: Kind) -> str:
    """Return a key, or a result, as the head of a column: in words, with its unit."""
    if any(figure.key == name for figure in kind.figures):
        return kind.figure(name).head
    return _headed(label_of(name), unit_of(name, kind.known))


def _headed(label: str, unit: str) -> str:
    return f"{label}, {unit}" if unit else label


def common_reasons(reasons: Sequence[str]) -> list[list[int]]:
    """Return groups of designs whose reasons differ in their numbers alone, from 0, the largest first."""
    found: dict[str, list[int]] = {}
    for i, reason in enumerate(reasons):
        if reason:
            found.setdefault(NUMBER.sub("…", reason), []).append(i)
    return sorted(found.values(), key=len, reverse=True)


def _reasons(result: Columns) -> Table:
    """Why designs have no results, one line for each kind of reason."""
    common = common_reasons(result.reasons)[:COMMON_REASONS]
    rows: list[list[Cell]] = [[len(group), group[0] + 1, result.reasons[group[0]]] for group in common]
    return Table("Why designs have no results", ("designs", "such as design", "which says"), rows)
