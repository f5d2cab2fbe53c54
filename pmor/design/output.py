"""Files of a design, its page, and its summary on the screen."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from pmor.design import figures
from pmor.design.figures import WORDS, words_of
from pmor.design.found import AGREE, Found
from pmor.design.in_gearbox import gearbox_data, gearbox_sentences, gearbox_tables
from pmor.design.readings import FRESH, Readings, percentile_95
from pmor.design.search import MOST_SAID
from pmor.design.settings import RESULTS, Design
from pmor.design.variants import stored
from pmor.report.data_files import write_table_csv
from pmor.report.explorer import Column, Designs
from pmor.report.page import Block, Heading, Picture, Warning
from pmor.report.parameter_words import parameter_words
from pmor.report.table import Cell, Table, text_lines
from pmor.storage.design_file import DesignResults, write_design_file
from pmor.work.results import Report

#: files of a result; without a front or scatter some are not written
PICTURES = ("front.png", "contour.png", "torque.png", "ste.png", "sensitivity.png", "scatter.png", "harris.png",
            "face_load.png")  # fmt: skip
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


def write_design(found: Found, read: Readings, out: Path) -> None:
    """Write numbers, pictures and pages."""
    write_design_file(out / "design.h5", _stored(found, read))
    write_table_csv(out / "design.csv", _rows(found))
    title, all_variants = f"Design: {found.design.title}", [Heading("All variants"), _designs(found)]
    data, blocks = design_data(found, read), _blocks(found, read)
    Report("design", data, title, blocks, found.file.case, page_only=all_variants).write(out)


def design_data(found: Found, read: Readings) -> dict[str, Any]:
    """Return the content of `design.json`."""
    design, words = found.design, found.file.words
    return {
        "title": design.title,
        "case": words.name if words.kind == "case" else None,
        "set": words.name if words.kind == "set" else None,
        "minimise": design.objective.minimise,
        "meshes": design.objective.meshes if design.several else None,
        "value": design.objective.value,
        "torques_Nm": design.load.torques_Nm,
        "loads": design.load.labels,
        "weights": found.judge.weights.tolist(),
        "variants": len(found.variants),
        "kept": int(found.kept.sum()),
        "failed": int((~np.isfinite(found.variants.objective)).sum()),
        "first": read.first,
        "coarse": read.coarse,
        "evaluations": dict(found.evaluations),
        "ends_of_halves": [float(end) for end in found.ends],
        "halves_apart": found.apart,
        "seconds": found.seconds,
        "base": {
            **_objective(design, "objective", read.base.objective),
            **_objective(design, "objective_searched", read.base_searched),
            **{key: read.base.results[:, n].tolist() for n, key in enumerate(design.results)},
        },
        "best": None if found.best is None else _entry(found, found.best),
        "pareto": [_entry(found, int(n)) for n in found.front],
        "chosen": {name: _entry(found, n) for name, n in read.chosen.items()},
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
        "failures": [*read.failures, *found.failures],
    }


def design_text(found: Found, read: Readings) -> str:
    """Return the tables for the screen."""
    said = [*([] if read.gearbox is None else gearbox_sentences(read.gearbox)), _count_words(found)]
    said += _waiting(read) or certainty_words(found)
    lines = [f"Design: {found.design.title}", *(f"  {sentence}" for sentence in said)]
    for shown in (*_tables(found, read), *([] if read.gearbox is None else gearbox_tables(read.gearbox))):
        if shown.rows:
            lines += [f"  {shown.title}", *(f"    {line}" for line in text_lines(shown))]
    if found.best is None:
        lines.append("  ! no variant keeps all constraints")
    return "\n".join([*lines, *(f"  ! {sentence}" for sentence in _failures(found, read))])


def _waiting(read: Readings) -> list[str]:
    return ([WAITING] if read.first else []) + ([COARSE] if read.coarse else [])


def _failures(found: Found, read: Readings) -> list[str]:
    """Return what did not converge; of many variants the first ones, and how many more there are."""
    more = len(found.failures) - MOST_SAID
    rest = [f"{more} further ones: design.json"] if more > 0 else []
    return [*read.failures, *found.failures[:MOST_SAID], *rest]


def _entry(found: Found, n: int) -> dict[str, Any]:
    variants, design = found.variants, found.design
    return {
        "variant": n,
        "origin": variants.origin[n],
        "parameters": dict(zip([v.name for v in design.variables], variants.x[n].tolist(), strict=True)),
        **_objective(design, "objective", float(variants.objective[n])),
        "angles_per_pitch": int(found.angles[n]),
        **_objective(design, "objective_searched", float(found.searched[n])),
        **{key: variants.results[n, :, k].tolist() for k, key in enumerate(design.results)},
    }


def _objective(design: Design, key: str, value: float) -> dict[str, float | None]:
    """A value of the objective in its unit; by another key also in um, null where it is none."""
    return {key: value, f"{key}_um": value if design.objective.unit else None}


def _rows(found: Found) -> list[dict[str, Any]]:
    """All variants as rows of a table: peak-to-peak at each torque, the largest of the rest over the torques."""
    variants, design, kept = found.variants, found.design, found.kept
    rows = []
    for n in range(len(variants)):
        row: dict[str, Any] = {"variant": n, "origin": variants.origin[n], "kept": int(kept[n])}
        row |= {v.name: float(x) for v, x in zip(design.variables, variants.x[n], strict=True)}
        row |= {design.objective.column: float(variants.objective[n]), "angles_per_pitch": int(found.angles[n])}
        for k, key in enumerate(design.results):
            if key.endswith(RESULTS[0]):
                for t, load in enumerate(design.load.columns):
                    row[f"{key}_at_{load}"] = float(variants.results[n, t, k])
            else:
                row[f"{key}_max"] = float(variants.results[n, :, k].max())
        rows.append(row)
    return rows


def _stored(found: Found, read: Readings) -> DesignResults:
    whole = stored(found.file, found.variants)
    arrays = dict(whole.arrays) | {
        "front": found.front,
        "angles": found.angles,
        "searched": found.searched,
    }
    names = [f"{name}, {mesh}" for name in read.curves for mesh in found.design.several] or list(read.curves)
    curves = [curve for of_meshes in read.curves.values() for curve in of_meshes]
    if len({curve.shape for curve in curves}) == 1:  # meshes whose teeth differ repeat after other numbers of cycles
        arrays |= {"curves/phi": found.fine.phi, "curves/ste": np.stack(curves)}
    return replace(whole, curves=tuple(names), arrays=arrays)


def _designs(found: Found) -> Designs:
    """Return the block in which a reader filters variants and trades them off."""
    variants, design, load = found.variants, found.design, found.design.load
    order = np.argsort(np.where(found.kept, variants.objective, np.inf), kind="stable")
    shown = np.sort(np.union1d(order[: MOST_ON_PAGE - len(found.front)], found.front))
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
    reasons = np.array([_reason(found, int(n)) for n in shown])
    return Designs(columns, np.array([f"variant {n}" for n in shown]), np.full(len(shown), ""), reasons)


def _reason(found: Found, n: int) -> str:
    if found.kept[n]:
        return ""
    if not np.isfinite(found.variants.objective[n]):
        return "a position did not converge"
    broken = [c for c, value in zip(found.design.constraints, found.variants.limits[n], strict=True)
              if not value <= c.at_most]  # fmt: skip
    return "; ".join(f"{c.key} above {c.at_most:g}" for c in broken)


def _unit(name: str) -> str:
    return parameter_words(name).rstrip("]").partition(" [")[2]


def _blocks(found: Found, read: Readings) -> list[Block]:
    blocks: list[Block] = [_count_words(found), *(_waiting(read) or certainty_words(found))]
    if found.best is None:
        blocks.append(Warning("No variant keeps all constraints."))
    blocks += [Warning(sentence) for sentence in _failures(found, read)]
    if read.first:
        return [*blocks, *_tables(found, read)]
    if read.gearbox is not None:
        face_load = Picture("face_load.png", "Line load over the face, added up over tooth pairs; the whole gearbox "
                            "solved anew with each flank.", figures.face_load_figure(read.gearbox))  # fmt: skip
        blocks = [*gearbox_sentences(read.gearbox), *blocks, *gearbox_tables(read.gearbox), face_load]
    return [*blocks, *_pictures(found, read), *_tables(found, read)]


def _pictures(found: Found, read: Readings) -> list[Block]:
    design, words = found.design, found.file.words
    pictures = [
        ("front.png", "The objective against the other result, and the Pareto front of all variants.",
         figures.front_figure(found)),
        ("contour.png", "The objective of the nominal gears over each two variables, all others as in the best" + (
            "; within the dashed ellipse are 95 % of the gears that are made."
            if any(design.scatter.modifications.get(variable.key) for variable in design.variables) else "."
         ), figures.contour_figure(found, read.contours) if read.contours else None),
        ("torque.png", "Peak-to-peak STE over torque. A design for one torque has its valley there and climbs on both "
         "sides; the best for all of them lies between.",
         figures.torque_figure(found, read.torques_Nm, read.over_torque) if read.over_torque else None),
        ("ste.png", "STE of the nominal gears under each torque.", figures.ste_figure(found, read.curves)),
        ("sensitivity.png", "Sensitivity of the nominal objective, about the best: exact derivatives, also by "
         "parameters that are no variables.",
         figures.sensitivity_figure(read.rates, design.objective) if read.rates else None),
        ("scatter.png", f"{FRESH:,} {words.made} drawn anew, each solved in full.",
         figures.scatter_figure(read.fresh, words_of(design.objective.key), words.made) if read.fresh else None),
        ("harris.png", "Harris's rule for tip relief, written for coupled pairs: twice by how much the STE without "
         "relief differs between single and double contact.",
         figures.harris_figure(read.harris) if read.harris else None),
    ]  # fmt: skip
    return [Picture(name, caption, figure) for name, caption, figure in pictures if figure is not None]


def certainty_words(found: Found) -> list[str]:
    """Return how sure the best is, by the two halves of the search; empty without both."""
    if found.apart is None:
        return []
    unit, few = found.design.objective.unit and f" {found.design.objective.unit}", found.design.search.angles
    first, second = found.ends
    said = (
        f"How sure the best is: descents from either half of the samples, which know nothing of each other, end at "
        f"{first:.4g} and {second:.4g}{unit} on {few} angles, {100.0 * found.apart:.2g} % apart."
    )
    if found.apart > AGREE:
        said += " There may be a better one: raise samples and descents of [search]."
    return [said]


def _count_words(found: Found) -> str:
    design, words = found.design, found.file.words
    names = ", ".join(parameter_words(v.name) for v in design.variables)
    loads = ", ".join(design.load.labels)
    spent = ", ".join(f"{count:,} of {stage}" for stage, count in found.evaluations.items())
    value = {"nominal": "nominal", "expected": "expected over scatter",
             "percentile_95": f"that 95 % of the {words.made} made stay below"}[design.objective.value]  # fmt: skip
    most = int(found.angles.max())
    where = f" on the supports of {' and '.join(design.mesh)} in the gearbox" if design.mesh else ""
    over = {"sum": ", sum over the meshes", "worst": " of the worst mesh"}.get(design.objective.meshes, "")
    over = over if design.several else ""
    where = where if design.set is None else f", all meshes of {words.name} solved at once"
    return (
        f"{len(found.variants):,} variants of {names} under {loads}{where}, {design.search.angles} angles to a pitch; "
        f"those that are chosen on {found.angles[found.eligible].min(initial=most)} to {most}, on which their results "
        f"no longer move; {int(found.kept.sum()):,} of them keep all constraints. Minimised: "
        f"{words_of(design.objective.key)}{over}, {value}, weighted mean over the loads. Judgements: {spent}; "
        f"{found.seconds:.3g} s."
    )


def _tables(found: Found, read: Readings) -> list[Table]:
    design, variants = found.design, found.variants
    names = [parameter_words(v.name) for v in design.variables]
    torques = [f"p-p at {label}, µm" for label in design.load.labels]
    column = design.results.index("peak_to_peak_um")
    against = design.results.index(design.pareto.against)

    def row(label: Cell, n: int) -> list[Cell]:
        return [label, n, *variants.x[n].tolist(), float(found.searched[n]), float(variants.objective[n]),
                *variants.results[n, :, column].tolist(), float(found.against[n])]  # fmt: skip

    goal, words = design.objective, found.file.words
    unit = f", {goal.unit}" if goal.unit else ""
    few = f"objective on {design.search.angles} angles{unit}"
    heads = ("which", "variant", *names, few, f"objective{unit}", *torques, WORDS[design.pareto.against])
    base: list[Cell] = [words.base, None, *[None] * len(names), read.base_searched, read.base.objective,
                        *read.base.results[:, column].tolist(), float(read.base.results[:, against].max())]  # fmt: skip
    front = found.front[:: max(1, -(-len(found.front) // MOST_ROWS))]
    tables = [
        Table("Chosen variants", heads, [base, *(row(name, n) for name, n in read.chosen.items())]),
        Table("Pareto front", heads, [row(variants.origin[n], int(n)) for n in front],
              f"Any variant becomes a {words.kind} file with 'pmor design {found.file.name}.toml --case N'."),
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
