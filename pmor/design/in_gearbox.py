"""Designed flanks judged by the whole gearbox solved anew with them: figures, plain data, sentences and tables."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.errors import ConvergenceError
from pmor.core.threads import in_order
from pmor.design.elements import Elements, in_motion
from pmor.design.files import on_flanks
from pmor.design.judge import Judge
from pmor.design.settings import Variable
from pmor.design.solvers import Built
from pmor.design.variants import Found
from pmor.machine.coupled import MEAN_ANGLES, solve_load
from pmor.machine.fit import Helix, level
from pmor.report.parameter_words import parameter_words
from pmor.report.table import Cell, Table
from pmor.results.quantities import TABLE
from pmor_online.model import with_flanks

CASE, ALIGNED, BEST = "flanks of the case", "best for aligned axes", "best for the gearbox"
LEVEL_ALIGNED, LEVEL = "load levelled on aligned axes", "load levelled in the gearbox"
# Flanks that know nothing of the gearbox, and those that take its place.
COMPARED = ((ALIGNED, BEST), (LEVEL_ALIGNED, LEVEL))
# Results of flanks beside each other, and their words.
RESULTS = {"peak_to_peak_um": "mean peak-to-peak STE", "k_h_beta": "largest K_Hβ"}


@dataclass(frozen=True)
class JudgedFlank:
    """Flanks judged by the gearbox that is solved anew with them: L loads, R results, A angles, S sections."""

    name: str
    built: Built
    results: FloatArray  # shape (L, R)
    # By mesh, shape (L, S): Added up over tooth pairs, mean over the angles that converged
    face_load_N_per_mm: Mapping[str, FloatArray]
    lost: tuple[str, ...]  # Loads under which positions did not converge, and why


@dataclass(frozen=True)
class InGearbox:
    """What the gearbox makes of the flanks of the cases, of those that were found, and of those for aligned axes."""

    elements: Elements
    helices: Mapping[str, Helix]  # That level the load, by mesh
    flanks: tuple[JudgedFlank, ...]
    weights: FloatArray  # shape (L,)
    angles: int  # To a mesh cycle
    searched: FloatArray | None  # shape (L, R): Results of the best in the search
    failures: tuple[str, ...]  # Flanks with which the gearbox has no equilibrium, or positions did not converge

    def over_loads(self, flank: JudgedFlank, key: str) -> float:
        """Return the largest K_Hbeta of flanks over the loads, or the weighted mean of another result."""
        values = flank.results[:, self.elements.file.design.results.index(key)]
        return float(values.max() if key == "k_h_beta" else values @ self.weights)

    def moved(self, key: str) -> float | None:
        """Return by how much a result of the best in the search is off, over itself, under any load."""
        best = next((flank for flank in self.flanks if flank.name == BEST), None)
        if best is None or self.searched is None:
            return None
        column = self.elements.file.design.results.index(key)
        return float(np.abs(self.searched[:, column] / best.results[:, column] - 1.0).max())

    def ratio(self, key: str, names: tuple[str, str]) -> float | None:
        """Return a result of flanks over that of others, by their names; None without both."""
        by_name = {flank.name: flank for flank in self.flanks}
        if not by_name.keys() >= set(names):
            return None
        one, other = (self.over_loads(by_name[name], key) for name in names)
        return one / other


def judged_by_the_gearbox(outcome: Found, aligned: Found, executor: Executor | None = None) -> InGearbox:
    """Return the gearbox solved anew with the best of a search on its supports, and of one on aligned axes."""
    elements, base = outcome.judge.elements, outcome.judge.base
    flanks, helices = {CASE: base}, dict[str, dict[str, Helix]]()
    for name, one in ((ALIGNED, aligned), (BEST, outcome)):
        if one.best is not None:
            flanks[name] = one.judge.assembly(one.variants.x[one.best])
    for label, held in ((LEVEL, False), (LEVEL_ALIGNED, True)):
        helices[label] = {n: level(elements.pairs[n], elements.meshes(n), held) for n in elements.file.meshes}
    for label in (LEVEL_ALIGNED, LEVEL):
        pairs = zip(base.flanks, helices[label].values(), strict=True)
        flanks[label] = Built(tuple(replace(flank, pinion=helix.on(flank.pinion)) for flank, helix in pairs))
    judged, failures = list[JudgedFlank](), list[str]()
    for answer in in_order(lambda item: _judged(outcome, *item), flanks.items(), executor):
        if isinstance(answer, str):
            failures.append(answer)
        elif answer is not None:
            judged.append(answer)
            failures += [f"in the gearbox, {answer.name}, {sentence}" for sentence in answer.lost]
    searched = None if outcome.best is None else outcome.variants.results[outcome.best]
    angles = outcome.fine.design.search.angles
    return InGearbox(elements, helices[LEVEL], tuple(judged), outcome.judge.weights, angles, searched, tuple(failures))


def _judged(outcome: Found, name: str, built: Built) -> JudgedFlank | str | None:
    """Return flanks judged, or why not; None of those that level the load and leave a mesh without contact."""
    elements = outcome.judge.elements
    try:
        if name != CASE:
            elements = in_motion(solved_anew(elements, built))
    except ConvergenceError as error:
        return None if name in (LEVEL, LEVEL_ALIGNED) else f"in the gearbox, {name}: {error}"
    judge = Judge(elements, outcome.fine.design)
    states = judge.solve(built)
    loads = {
        solver.name: state.load_N_per_mm.sum(axis=(1, 2)) / np.maximum(state.converged.sum(axis=1), 1)[:, None]
        for solver, state in zip(judge.solvers, states, strict=True)
    }
    return JudgedFlank(name, built, judge.results_of(states, built, left=True), loads, tuple(judge.lost(states)))


def solved_anew(elements: Elements, built: Built) -> Elements:
    """Return the gearbox solved anew under each load with flanks of the meshes that are designed.

    Raises
    ------
    ConvergenceError
    """
    assert elements.file.box is not None
    flanks = dict(zip(elements.file.meshes, built.flanks, strict=True))
    pairs = {**elements.pairs, **{name: with_flanks(elements.pairs[name], one) for name, one in flanks.items()}}
    model = elements.file.box.model
    loads = tuple(solve_load(model, load.load, pairs, MEAN_ANGLES, load.gearbox) for load in elements.loads)
    return replace(elements, pairs=pairs, loads=loads)


def gearbox_data(box: InGearbox) -> dict[str, Any]:
    """Return the entry `gearbox` of `design.json`; slope and crowning that level the load stand alone of one mesh."""
    design, meshes = box.elements.file.design, box.elements.file.meshes
    amounts = {name: helix._asdict() for name, helix in box.helices.items()}
    single = amounts[meshes[0]] if len(meshes) == 1 else dict.fromkeys(Helix._fields)
    return {
        "file": design.gearbox,
        "mesh": meshes[0] if len(meshes) == 1 else None,
        "meshes": meshes,
        **{f"helix_{key}": value for key, value in single.items()},
        "helices": amounts,
        "torques_Nm": {name: [1e-3 * mesh.torque for mesh in box.elements.meshes(name)] for name in meshes},
        "flanks": [
            {
                "name": flank.name,
                "parameters": {v.name: _value(box, v, flank.built) for v in design.variables},
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
    sentences = []
    for name, helix in box.helices.items():
        way = "" if box.elements.meshes(name)[0].meshing.frame.along > 0.0 else "-"
        which = f" of {name}" if len(box.helices) > 1 else ""
        sentences.append(
            f"To level the load the gearbox asks for a helix slope of {helix.slope_um:.2f} µm and a helix crowning of "
            f"{helix.crowning_um:.2f} µm on the pinion{which}, beside those of its case; z of the case is along {way}x "
            "of the gearbox."
        )
    for one, other in COMPARED:
        ratios = {words: box.ratio(key, (one, other)) for key, words in RESULTS.items()}
        known = [f"{ratio:.3f} in {words}" for words, ratio in ratios.items() if ratio is not None]
        if known:
            sentences.append(f"Solved anew in the gearbox, '{one}' over '{other}': {', '.join(known)}.")
    return sentences


def gearbox_tables(box: InGearbox) -> list[Table]:
    """Return flanks beside each other, over all loads and load by load."""
    design = box.elements.file.design
    keys, variables, labels = design.results, design.variables, design.load.labels
    pressure = keys.index("pressure_MPa")
    rows: list[list[Cell]] = [
        [flank.name, *(_value(box, v, flank.built) for v in variables),
         *(box.over_loads(flank, key) for key in RESULTS), float(flank.results[:, pressure].max())]
        for flank in box.flanks
    ]  # fmt: skip
    rows += [
        [f"{one} over {other}", *[None] * len(variables), *(box.ratio(key, (one, other)) for key in RESULTS), None]
        for one, other in COMPARED
    ]
    heads = (
        "flanks", *(parameter_words(v.name) for v in variables),
        "mean p-p, µm", "largest K_Hβ", TABLE["flank_pressure_max_MPa"].head,
    )  # fmt: skip
    note = (
        "The whole gearbox solved anew with these flanks, all other meshes as they are; mean by the weights of the "
        f"loads, on {box.angles} angles to a pitch."
    )
    moved = [f"{words} by {100.0 * change:.2g} %" for key, words in RESULTS.items()
             if (change := box.moved(key)) is not None]  # fmt: skip
    if moved:
        note += f" The search, on supports with the flanks of the case, was off for the best: {', '.join(moved)}."
    shown = {key: word for end, word in (("peak_to_peak_um", "p-p"), ("k_h_beta", "K_Hβ"))
             for key in keys if key.rpartition(".")[2] == end}  # fmt: skip
    by_load: list[list[Cell]] = [
        [flank.name, *(float(value) for key in shown for value in flank.results[:, keys.index(key)])]
        for flank in box.flanks
    ]
    words = [
        f"{word}{f' of {mesh}' if mesh else ''} at {label}{', µm' if word == 'p-p' else ''}"
        for key, word in shown.items() for mesh in [key.rpartition(".")[0]] for label in labels
    ]  # fmt: skip
    return [
        Table("In the gearbox", heads, rows, note),
        Table("In the gearbox, load by load", ("flanks", *words), by_load),
        Table("Assumptions", ("what the gearbox file does not say, and what was taken",),
              [[note] for note in box.elements.file.notes]),
    ]  # fmt: skip


def _value(box: InGearbox, variable: Variable, built: Built) -> float | None:
    """Return the value of a variable on flanks that need not be a variant."""
    file = box.elements.file
    flank = on_flanks(variable, file.flanks)[0]
    value = getattr(getattr(built.flanks[file.meshes.index(flank.case)], flank.gear), variable.key)
    return None if value is None else float(value)
