"""What the gearbox makes of designed flanks: plain data, sentences and tables."""

from __future__ import annotations

from typing import Any

from pmor.design.settings import Variable
from pmor.design.supports import COMPARED, InGearbox
from pmor.gear.condition import Assembly
from pmor.report.parameter_words import parameter_words
from pmor.report.table import Cell, Table

# Results of flanks beside each other, and their words.
RESULTS = {"peak_to_peak_um": "mean peak-to-peak STE", "k_h_beta": "largest K_Hβ"}


def gearbox_data(box: InGearbox) -> dict[str, Any]:
    """Return the entry `gearbox` of `design.json`."""
    design = box.supports.file.design
    return {
        "file": design.gearbox,
        "mesh": design.mesh,
        "helix_slope_um": box.helix.slope_um,
        "helix_crowning_um": box.helix.crowning_um,
        "flanks": [
            {
                "name": flank.name,
                "parameters": {v.name: _value(v, flank.assembly) for v in design.variables},
                **{key: flank.results[:, k].tolist() for k, key in enumerate(design.results)},
            }
            for flank in box.flanks
        ],
        "searched_off": {key: box.moved(key) for key in RESULTS},
        "ratios": [
            {"of": one, "over": other, **{key: box.ratio(key, (one, other)) for key in RESULTS}}
            for one, other in COMPARED
        ],
    }


def gearbox_sentences(box: InGearbox) -> list[str]:
    """Return what the gearbox asks for, and how a design for aligned axes fares in it."""
    way = "" if box.supports.meshes[0].meshing.frame.along > 0.0 else "-"
    slope, crowning = box.helix
    found = [
        f"To level the load the gearbox asks for a helix slope of {slope:.2f} µm and a helix crowning of "
        f"{crowning:.2f} µm on the pinion, beside those of its case; z of the case is along {way}x of the gearbox."
    ]
    for one, other in COMPARED:
        ratios = {words: box.ratio(key, (one, other)) for key, words in RESULTS.items()}
        known = [f"{ratio:.3f} in {words}" for words, ratio in ratios.items() if ratio is not None]
        if known:
            found.append(f"Solved anew in the gearbox, '{one}' over '{other}': {', '.join(known)}.")
    return found


def gearbox_tables(box: InGearbox) -> list[Table]:
    """Return flanks beside each other, over all loads and load by load."""
    design = box.supports.file.design
    keys, variables, labels = design.results, design.variables, design.load.labels
    pressure = keys.index("pressure_MPa")
    rows: list[list[Cell]] = [
        [flank.name, *(_value(v, flank.assembly) for v in variables), *(box.over_loads(flank, key) for key in RESULTS),
         float(flank.results[:, pressure].max())]
        for flank in box.flanks
    ]  # fmt: skip
    rows += [
        [f"{one} over {other}", *[None] * len(variables), *(box.ratio(key, (one, other)) for key in RESULTS), None]
        for one, other in COMPARED
    ]
    heads = ("flanks", *(parameter_words(v.name) for v in variables), "mean p-p, µm", "largest K_Hβ", "pressure, MPa")
    note = (
        "The whole gearbox solved anew with these flanks, all other meshes as they are; mean by the weights of the "
        f"loads, on {box.flanks[0].ste_um.shape[1]} angles to a pitch."
    )
    moved = [f"{words} by {100.0 * change:.2g} %" for key, words in RESULTS.items()
             if (change := box.moved(key)) is not None]  # fmt: skip
    if moved:
        note += f" The search, on supports with the flanks of the case, was off for the best: {', '.join(moved)}."
    by_load: list[list[Cell]] = [
        [flank.name, *(float(value) for key in RESULTS for value in flank.results[:, keys.index(key)])]
        for flank in box.flanks
    ]
    words = [f"{word} at {label}{unit}" for word, unit in (("p-p", ", µm"), ("K_Hβ", "")) for label in labels]
    notes = () if box.supports.file.box is None else box.supports.file.box.notes
    return [
        Table("In the gearbox", heads, rows, note),
        Table("In the gearbox, load by load", ("flanks", *words), by_load),
        Table("Assumptions", ("what the gearbox file does not say, and what was taken",), [[one] for one in notes]),
    ]


def _value(variable: Variable, assembly: Assembly) -> float | None:
    """Return the value of a variable on flanks that need not be a variant."""
    value = getattr(getattr(assembly, variable.gears[0]), variable.key)
    return None if value is None else float(value)
