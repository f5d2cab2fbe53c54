"""Files of a design, its page, and its summary on the screen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from pmor.design import figures
from pmor.design.figures import WORDS, words_of
from pmor.design.in_gearbox import gearbox_data, gearbox_sentences, gearbox_tables
from pmor.design.readings import FRESH, Readings, percentile_95
from pmor.design.search import MOST_SAID
from pmor.design.settings import RESULTS, Design
from pmor.design.variants import AGREE, Found, stored
from pmor.report.data_files import write_table_csv
from pmor.report.explorer import Column, Designs
from pmor.report.page import Block, Heading, Picture, Warning
from pmor.report.parameter_words import parameter_words
from pmor.report.table import Cell, Table, text_lines
from pmor.report.verdict import sentence_of, verdict_text
from pmor.results.verdict import Verdict, digits
from pmor.storage.design_file import DesignResults, write_design_file
from pmor.work.results import Report

#: files of a result; without a front or scatter some are not written
PICTURES = ("front.svg", "contour.svg", "torque.svg", "ste.svg", "sensitivity.svg", "scatter.svg", "harris.svg",
            "face_load.svg")  # fmt: skip
FILES = ("design.h5", "design.csv", "design.json", "design.md", "report.html", *PICTURES)
# Of the first result.
WAITING = "The first result: the search goes on, and this page is replaced at its end."
COARSE = (
    "It is of half as many elements over profile and width: the finite elements of the search itself are being solved."
)
# Most rows of a table of the front.
MOST_ROWS = 12
# Variants that a page carries: more make it slow, and the CSV has them all.
MOST_ON_PAGE = 10_000


def write_design(outcome: Found, read: Readings, out: Path) -> None:
    """Write numbers, pictures and pages."""
    write_design_file(out / "design.h5", _stored(outcome, read))
    write_table_csv(out / "design.csv", _rows(outcome))
    title, all_variants = f"Design: {outcome.design.title}", [Heading("All variants"), _designs(outcome)]
    data, blocks = design_data(outcome, read), _blocks(outcome, read)
    Report("design", data, title, blocks, outcome.file.case, page_only=all_variants).write(out)


def design_data(outcome: Found, read: Readings) -> dict[str, Any]:
    """Return the content of `design.json`."""
    design, words = outcome.design, outcome.file.words
    return {
        "title": design.title,
        "case": outcome.file.case.name if outcome.file.case is not None else None,
        "set": words.name if words.kind == "set" else None,
        "minimise": design.objective.minimise,
        "meshes": design.objective.meshes if design.several else None,
        "value": design.objective.value,
        "torques_Nm": design.load.torques_Nm,
        "loads": design.load.labels,
        "weights": outcome.judge.weights.tolist(),
        "variants": len(outcome.variants),
        "kept": int(outcome.kept.sum()),
        "failed": int((~np.isfinite(outcome.variants.objective)).sum()),
        "first": read.first,
        "coarse": read.coarse,
        "evaluations": dict(outcome.evaluations),
        "ends_of_halves": [float(end) for end in outcome.ends],
        "halves_apart": outcome.apart,
        "seconds": outcome.seconds,
        "base": {
            **_objective(design, "objective", read.base.objective),
            **_objective(design, "objective_searched", read.base_searched),
            **{key: read.base.results[:, n].tolist() for n, key in enumerate(design.results)},
        },
        "best": None if outcome.best is None else _entry(outcome, outcome.best),
        "pareto": [_entry(outcome, int(n)) for n in outcome.front],
        "chosen": {name: _entry(outcome, n) for name, n in read.chosen.items()},
        "fresh_draws": {
            name: {
                "draws": len(values),
                **_objective(design, "mean", float(values.mean())),
                **_objective(design, "percentile_95", percentile_95(values)),
            }
            for name, values in read.fresh.items()
        },
        "harris": [{"torque_Nm": h.torque_Nm, "rule_um": h.rule_um, "found_um": h.found_um} for h in read.harris],
        "gearbox": None if read.gearbox is None else gearbox_data(read.gearbox),
        "failures": [*read.failures, *outcome.failures],
    }


def design_text(outcome: Found, read: Readings) -> str:
    """Return the tables for the screen."""
    sentences = [*([] if read.gearbox is None else gearbox_sentences(read.gearbox)), _count_words(outcome)]
    sentences += _waiting(read) or certainty_words(outcome)
    lines = [f"Design: {outcome.design.title}", *verdict_text(design_verdict(outcome, read).data)]
    lines += [f"  {sentence}" for sentence in sentences]
    for shown in (*_tables(outcome, read), *([] if read.gearbox is None else gearbox_tables(read.gearbox))):
        if shown.rows:
            lines += [f"  {shown.title}", *(f"    {line}" for line in text_lines(shown))]
    if outcome.best is None:
        lines.append("  ! no variant keeps all constraints")
    return "\n".join([*lines, *(f"  ! {sentence}" for sentence in _failures(outcome, read))])


def design_verdict(outcome: Found, read: Readings) -> Verdict:
    """Return what the search found, what leaves doubts, and how the best becomes a file."""
    design, goal = outcome.design, outcome.design.objective
    doubts, unit = [], goal.unit and f" {goal.unit}"
    if outcome.apart is not None and outcome.apart > AGREE:
        doubts.append(f"both halves of the search end {100.0 * outcome.apart:.2g} % apart: raise samples and descents")
    if outcome.best is None:
        return Verdict("Nothing was found.", "; ".join(["No variant keeps all constraints", *doubts]) + ".",
                       "Wider ranges of [[variables]], or weaker [[constraints]].")  # fmt: skip
    x, best = outcome.variants.x[outcome.best], float(outcome.variants.objective[outcome.best])
    ends = [v.name for v, value in zip(design.variables, x, strict=True) if value in v.range]
    if ends:
        doubts.append(f"at the end of the range of {', '.join(ends)}: a wider one may have a better variant")
    said = "; ".join(doubts) or "no doubt is left: the best stands at no end of a range"
    values = ", ".join(f"{v.name} = {value:g}" for v, value in zip(design.variables, x, strict=True))
    base = digits(read.base.objective) if np.isfinite(read.base.objective) else "what did not converge"
    return Verdict(
        f"{words_of(goal.key)}, mean over the loads: from {base} to {digits(best)}{unit}.",
        sentence_of(said),
        f"{values}: pmor design {outcome.file.name}.toml --case {outcome.best} writes the file.",
    )


def _waiting(read: Readings) -> list[str]:
    return ([WAITING] if read.first else []) + ([COARSE] if read.coarse else [])


def _failures(outcome: Found, read: Readings) -> list[str]:
    """Return what did not converge; of many variants the first ones, and how many more there are."""
    more = len(outcome.failures) - MOST_SAID
    rest = [f"{more} further ones: design.json"] if more > 0 else []
    return [*read.failures, *outcome.failures[:MOST_SAID], *rest]


def _entry(outcome: Found, n: int) -> dict[str, Any]:
    variants, design = outcome.variants, outcome.design
    return {
        "variant": n,
        "origin": variants.origin[n],
        "parameters": dict(zip([v.name for v in design.variables], variants.x[n].tolist(), strict=True)),
        **_objective(design, "objective", float(variants.objective[n])),
        "angles_per_pitch": int(outcome.angles[n]),
        **_objective(design, "objective_searched", float(outcome.searched[n])),
        **{key: variants.results[n, :, k].tolist() for k, key in enumerate(design.results)},
    }


def _objective(design: Design, key: str, value: float) -> dict[str, float | None]:
    """A value of the objective in its unit; by another key also in um, null where it is none."""
    return {key: value, f"{key}_um": value if design.objective.unit else None}


def _rows(outcome: Found) -> list[dict[str, Any]]:
    """All variants as rows of a table: peak-to-peak at each torque, the largest of the rest over the torques."""
    variants, design, kept = outcome.variants, outcome.design, outcome.kept
    rows = []
    for n in range(len(variants)):
        row: dict[str, Any] = {"variant": n, "origin": variants.origin[n], "kept": int(kept[n])}
        row |= {v.name: float(x) for v, x in zip(design.variables, variants.x[n], strict=True)}
        row |= {design.objective.column: float(variants.objective[n]), "angles_per_pitch": int(outcome.angles[n])}
        for k, key in enumerate(design.results):
            if key.endswith(RESULTS[0]):
                for t, load in enumerate(design.load.columns):
                    row[f"{key}_at_{load}"] = float(variants.results[n, t, k])
            else:
                row[f"{key}_max"] = float(variants.results[n, :, k].max())
        rows.append(row)
    return rows


def _stored(outcome: Found, read: Readings) -> DesignResults:
    whole = stored(outcome.file, outcome.variants)
    arrays = dict(whole.arrays) | {
        "front": outcome.front,
        "angles": outcome.angles,
        "searched": outcome.searched,
    }
    names = [f"{name}, {mesh}" for name in read.curves for mesh in outcome.design.several] or list(read.curves)
    curves = [curve for of_meshes in read.curves.values() for curve in of_meshes]
    if len({curve.shape for curve in curves}) == 1:  # meshes whose teeth differ repeat after other numbers of cycles
        arrays |= {"curves/phi": outcome.fine.phi, "curves/ste": np.stack(curves)}
    return replace(whole, curves=tuple(names), arrays=arrays)


def _designs(outcome: Found) -> Designs:
    """Return the block in which a reader filters variants and trades them off."""
    variants, design, load = outcome.variants, outcome.design, outcome.design.load
    order = np.argsort(np.where(outcome.kept, variants.objective, np.inf), kind="stable")
    shown = np.sort(np.union1d(order[: MOST_ON_PAGE - len(outcome.front)], outcome.front))
    columns = [Column(v.name, parameter_words(v.name).partition(" [")[0], _unit(v.name), variants.x[shown, n], "input")
               for n, v in enumerate(design.variables)]  # fmt: skip
    goal = design.objective
    columns.append(Column(goal.column, "Objective", goal.unit, variants.objective[shown], "result"))
    for k, key in enumerate(design.results):
        label, _, unit = words_of(key).rstrip("]").partition(" [")
        unit = "" if unit == "-" else unit
        if key.endswith(RESULTS[0]):
            mesh = key.removesuffix(RESULTS[0]).replace(".", ": ")
            columns += [Column(f"{key}_at_{column}", f"{mesh}Peak-to-peak at {label}", unit,
                               variants.results[shown, t, k], "result")
                        for t, (column, label) in enumerate(zip(load.columns, load.labels, strict=True))]  # fmt: skip
        else:
            columns.append(Column(f"{key}_max", label, unit, variants.results[shown, :, k].max(axis=1), "result"))
    columns.append(Column("origin", "Origin", "", np.array([variants.origin[n] for n in shown]), "input"))
    reasons = np.array([_reason(outcome, int(n)) for n in shown])
    return Designs(columns, np.array([f"variant {n}" for n in shown]), np.full(len(shown), ""), reasons)


def _reason(outcome: Found, n: int) -> str:
    if outcome.kept[n]:
        return ""
    if not np.isfinite(outcome.variants.objective[n]):
        return "a position did not converge"
    broken = [c for c, value in zip(outcome.design.constraints, outcome.variants.limits[n], strict=True)
              if not value <= c.at_most]  # fmt: skip
    return "; ".join(f"{c.key} above {c.at_most:g}" for c in broken)


def _unit(name: str) -> str:
    return parameter_words(name).rstrip("]").partition(" [")[2]


def _blocks(outcome: Found, read: Readings) -> list[Block]:
    blocks: list[Block] = [design_verdict(outcome, read), _count_words(outcome)]
    blocks += _waiting(read) or certainty_words(outcome)
    if outcome.best is None:
        blocks.append(Warning("No variant keeps all constraints."))
    blocks += [Warning(sentence) for sentence in _failures(outcome, read)]
    if read.first:
        return [*blocks, *_tables(outcome, read)]
    if read.gearbox is not None:
        face_load = Picture("face_load.svg", "Line load over the face, added up over tooth pairs; the whole gearbox "
                            "solved anew with each flank.", figures.face_load_figure(read.gearbox))  # fmt: skip
        blocks[1:1] = gearbox_sentences(read.gearbox)
        blocks = [*blocks, *gearbox_tables(read.gearbox), face_load]
    return [*blocks, *_pictures(outcome, read), *_tables(outcome, read)]


def _pictures(outcome: Found, read: Readings) -> list[Block]:
    design, words = outcome.design, outcome.file.words
    pictures = [
        ("front.svg", "The objective against the other result, and the Pareto front of all variants.",
         figures.front_figure(outcome)),
        ("contour.svg", "The objective of the nominal gears over each two variables, all others as in the best" + (
            "; within the dashed ellipse are 95 % of the gears that are made."
            if any(design.scatter.modifications.get(variable.key) for variable in design.variables) else "."
         ), figures.contour_figure(outcome, read.contours) if read.contours else None),
        ("torque.svg", "Peak-to-peak STE over torque. A design for one torque has its valley there and climbs on both "
         "sides; the best for all of them lies between.",
         figures.torque_figure(outcome, read.torques_Nm, read.over_torque) if read.over_torque else None),
        ("ste.svg", "STE of the nominal gears under each torque.", figures.ste_figure(outcome, read.curves)),
        ("sensitivity.svg", "Sensitivity of the nominal objective, about the best: exact derivatives, also by "
         "parameters that are no variables.",
         figures.sensitivity_figure(read.rates, design.objective) if read.rates else None),
        ("scatter.svg", f"{FRESH:,} {words.made} drawn anew, each solved in full.",
         figures.scatter_figure(read.fresh, words_of(design.objective.key), words.made) if read.fresh else None),
        ("harris.svg", "Harris's rule for tip relief, written for coupled pairs: twice by how much the STE without "
         "relief differs between single and double contact.",
         figures.harris_figure(read.harris) if read.harris else None),
    ]  # fmt: skip
    return [Picture(name, caption, figure) for name, caption, figure in pictures if figure is not None]


def certainty_words(outcome: Found) -> list[str]:
    """Return how sure the best is, by the two halves of the search; empty without both."""
    if outcome.apart is None:
        return []
    unit, few = outcome.design.objective.unit and f" {outcome.design.objective.unit}", outcome.design.search.angles
    first, second = outcome.ends
    text = (
        f"How sure the best is: descents from two independent halves of the samples end at "
        f"{first:.4g} and {second:.4g}{unit} on {few} angles, {100.0 * outcome.apart:.2g} % apart."
    )
    if outcome.apart > AGREE:
        text += " There may be a better one: raise samples and descents of [search]."
    return [text]


def _count_words(outcome: Found) -> str:
    design, words = outcome.design, outcome.file.words
    names = ", ".join(parameter_words(v.name) for v in design.variables)
    loads = ", ".join(design.load.labels)
    spent = ", ".join(f"{count:,} of {stage}" for stage, count in outcome.evaluations.items())
    value = {"nominal": "nominal", "expected": "expected over scatter",
             "percentile_95": f"that 95 % of the {words.made} made stay below"}[design.objective.value]  # fmt: skip
    most = int(outcome.angles.max())
    where = f" on the supports of {' and '.join(design.mesh)} in the gearbox" if design.mesh else ""
    over = {"sum": ", sum over the meshes", "worst": " of the worst mesh"}.get(design.objective.meshes, "")
    over = over if design.several else ""
    where = where if design.set is None else f", all meshes of {words.name} solved at once"
    return (
        f"{len(outcome.variants):,} variants of {names} under {loads}{where}, "
        f"{design.search.angles} angles to a pitch; "
        f"those that are chosen on {outcome.angles[outcome.eligible].min(initial=most)} to {most}, on which their "
        f"results no longer move; {int(outcome.kept.sum()):,} of them keep all constraints. Minimised: "
        f"{words_of(design.objective.key)}{over}, {value}, weighted mean over the loads. Judgements: {spent}; "
        f"{outcome.seconds:.3g} s."
    )


def _tables(outcome: Found, read: Readings) -> list[Table]:
    design, variants = outcome.design, outcome.variants
    names = [parameter_words(v.name) for v in design.variables]
    torques = [f"p-p at {label}, µm" for label in design.load.labels]
    column = design.results.index("peak_to_peak_um")
    against = design.results.index(design.pareto.against)

    def row(label: Cell, n: int) -> list[Cell]:
        return [label, n, *variants.x[n].tolist(), float(outcome.searched[n]), float(variants.objective[n]),
                *variants.results[n, :, column].tolist(), float(outcome.against[n])]  # fmt: skip

    goal, words = design.objective, outcome.file.words
    unit = f", {goal.unit}" if goal.unit else ""
    few = f"objective on {design.search.angles} angles{unit}"
    heads = ("which", "variant", *names, few, f"objective{unit}", *torques, WORDS[design.pareto.against])
    base: list[Cell] = [words.base, None, *[None] * len(names), read.base_searched, read.base.objective,
                        *read.base.results[:, column].tolist(), float(read.base.results[:, against].max())]  # fmt: skip
    front = outcome.front[:: max(1, -(-len(outcome.front) // MOST_ROWS))]
    tables = [
        Table("Chosen variants", heads, [base, *(row(name, n) for name, n in read.chosen.items())]),
        Table("Pareto front", heads, [row(variants.origin[n], int(n)) for n in front],
              f"Any variant becomes a {words.kind} file with 'pmor design {outcome.file.name}.toml --case N'."),
    ]  # fmt: skip
    if read.fresh:
        heads = ("which", f"{words.made} drawn anew", f"mean{unit}", f"95 % stay below{unit}")
        rows: list[Sequence[Cell]] = [
            [name, len(v), float(v.mean()), percentile_95(v)] for name, v in read.fresh.items()
        ]
        tables.append(Table("Over scatter", heads, rows))
    if read.harris:
        heads = ("torque, N m", "by the rule, µm", "least p-p at, µm", "difference, %")
        tables.append(Table("Tip relief from the highest point of single contact", heads,
                            [[h.torque_Nm, h.rule_um, h.found_um, 100.0 * (h.found_um / h.rule_um - 1.0)]
                             for h in read.harris]))  # fmt: skip
    return tables
