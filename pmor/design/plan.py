"""Plan of a design: what is searched, on what, and how much work it is; solves nothing."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping

from pmor.case import Case
from pmor.case.tolerances import OF_AXES
from pmor.case.width import sections_across
from pmor.core.progress import format_time
from pmor.design.elements import coarse_design
from pmor.design.files import DesignFile
from pmor.design.fine import FEWEST, first_angles
from pmor.design.measures import order_of
from pmor.design.readings import CONTOUR, FINER, FRESH, MOST_CONTOURED, MOST_PAIRED, TORQUES
from pmor.design.search import MOST_SINGLE, first_samples
from pmor.design.settings import Design, Variable
from pmor.dynamics.whine.hill import FURTHER
from pmor.gear.pair import GearPair
from pmor.machine.plan import LOADS, placed_seconds, stages_of_gearbox
from pmor.pair.model import gear_pair
from pmor.sets.preview import PER_HARMONIC, set_seconds
from pmor.work.cost import START_S, Plan, body_seconds, compiling_seconds, plan_texts, seconds_of

# *Measured*, seconds: of a position, and of the sections in contact in it to the second power; of the page.
POSITION_S, SECTIONS_S, PAGE_S = 6e-6, 1.2e-7, 3.0
# Share of the finite elements in the whole from which on the first result is found on half as many elements.
COARSE_SHARE = 0.1
# *Measured*: steps of a descent, of one by quotients of differences, share of those under a bound more, beside those by
# which each variable moves constraints; variants that are judged on the fewest of fine angles, as drawn, and over
# scatter, where twice as many as those of the search are the fewest.
STEPS, BY_QUOTIENTS, BOUND, CONSTRAINED, FINE, FINE_SCATTERED = 40, 8, 0.5, 12, 45, 90
# *Measured*: times of a draw whose axes are off, which is placed anew, to one whose flanks alone are.
OFF_AXES = 1.5
# Flanks with which the whole gearbox is solved anew; laws of a mesh in motion for each of its flanks.
ANEW, LAWS = 4, 3


def coarse_first(file: DesignFile) -> DesignFile | None:
    """Return the design on half as many elements where its first result comes from these; None where it does not."""
    share = _element_seconds(file) / plan(file).seconds["design"]
    return coarse_design(file) if share > COARSE_SHARE else None


def plan(file: DesignFile) -> Plan:
    """Return the plan of a design; all processors share the search."""
    counts, one = _judgements(file), _seconds_of_variant(file)
    search = sum(counts.values()) * one + _variants(file) * _seconds_in_motion(file)
    seconds = START_S + _element_seconds(file) + search + PAGE_S
    if file.box is not None:
        seconds += _seconds_on_aligned_axes(file, counts, one) + ANEW * _equilibrium_seconds(file)

    def parts() -> Iterator[str]:
        yield from plan_texts(_searched(file.design, file), _work(file, sum(counts.values()), search))

    return Plan(parts, {"design": seconds}, compiling_seconds(file.cases.values()))


def _searched(design: Design, file: DesignFile) -> list[str]:
    load, goal, words = design.load, design.objective, file.words
    over = f", {goal.meshes} over the meshes" if design.several and goal.key == goal.minimise else ""
    weights = ", ".join(f"{label} ({weight:g})" for label, weight in zip(load.labels, load.weights, strict=True))
    lines = [
        f"Design {file.name}: {design.title}",
        f"  {words.kind:<19} {words.name}: {words.title}",
        f"  loads (weights)     {weights}",
        f"  minimised           {goal.key}{over}, {goal.value}, weighted mean over the loads",
        *(f"  constraint          {c.key} at most {c.at_most:g}" for c in design.constraints),
        *(f"  variable            {_words(v)}" for v in design.variables),
    ]
    if file.box is not None:
        lines[2:2] = [
            f"  meshes              {', '.join(file.meshes)}: contact on its supports under each load, the "
            "other meshes under their mean loads",
        ]
    if file.set is not None:
        lines[2:2] = [f"  meshes              {len(file.set.plan.meshes)}, all solved at once for each variant"]
    lines += [f"  assumption          {note}" for note in file.notes]
    return [*lines, f"  scatter             {', '.join(file.scattered)}"] if file.scattered else lines


def _words(variable: Variable) -> str:
    low, high = variable.range
    step = "" if variable.step is None else f" by {variable.step:g}"
    return f"{variable.name} from {low:g} to {high:g}{step}"


def _work(file: DesignFile, judgements: float, search: float) -> list[str]:
    design = file.design
    positions = len(design.load.labels) * design.search.angles * file.pitches
    lines = [
        "Work",
        *(f"  finite elements     {name}: {format_time(body_seconds(case))}" for name, case in file.cases.items()),
        f"  a variant           {positions} positions{f' of {_draws(file)} draws' if design.scatters else ''}",
        f"  samples, descents   {design.search.samples}, {design.search.descents}; "
        f"{design.pareto.points} points of the front against {design.pareto.against}",
    ]
    first = coarse_first(file) or file
    one = _draws(file) * _seconds_of_variant(first) + _seconds_in_motion(first)
    begin = START_S + _element_seconds(first) + _first(file) * one
    lines += [
        f"  judgements          about {round(judgements):,} of a variant as drawn, {format_time(search)}",
        f"  first result        after about {format_time(begin)}" + ", on half as many elements" * (first is not file),
    ]
    if file.box is not None:
        lines.append("  for comparison      a search on aligned axes; the gearbox solved anew with the best of both")
    return lines


def _element_seconds(file: DesignFile) -> float:
    return sum(map(body_seconds, file.cases.values()))


def _draws(file: DesignFile) -> int:
    return file.design.scatter.draws if file.design.scatters else 1


def _descent(file: DesignFile, bounds: bool) -> float:
    """Judgements of a descent: its steps, quotients of figures without derivatives, and what can be made around it."""
    variables = file.design.variables
    steps = STEPS if file.set is not None or _is_exact(file) else BY_QUOTIENTS * (1 + 2 * len(variables))
    bounded = CONSTRAINED * len(variables) * (bounds or bool(file.design.constraints))
    return (1.0 + BOUND * bounds) * steps + bounded + 2 ** sum(variable.step is not None for variable in variables)


def _is_exact(file: DesignFile) -> bool:
    """Whether a mesh by itself has the derivatives of the objective."""
    key = file.design.objective.minimise
    return key == "peak_to_peak_um" or order_of(key) is not None


def _judgements(file: DesignFile) -> dict[str, float]:
    """Judgements of a variant as drawn under all loads in each stage of a search, about."""
    design, loads = file.design, len(file.design.load.labels)
    anew = OFF_AXES if any(getattr(design.scatter, key) for key in OF_AXES) else 1.0
    draws = _draws(file) * (anew if design.scatters else 1.0)
    angles, count = design.search.angles, len(design.variables)
    descents = design.search.descents * draws + (1 < loads <= MOST_SINGLE) + design.scatters
    pairs = math.comb(min(count, MOST_PAIRED), 2)
    chosen = 1 + design.scatters + 2 * (loads > 1)
    fine = FINE * first_angles(angles) / angles + FINE_SCATTERED * draws * design.scatters
    over_torque = TORQUES * max(FEWEST, angles) / (loads * angles) * (1 + chosen)
    return {
        "samples": design.search.samples * draws,
        "descents": descents * _descent(file, bounds=False),
        "trade-offs": design.pareto.points * draws * _descent(file, bounds=True),
        "fine angles": fine,
        "contours": pairs * min(CONTOUR, math.isqrt(MOST_CONTOURED // max(pairs, 1))) ** 2,
        "torques": over_torque if file.box is None else 0.0,
        "drawn anew": FRESH * FINER * (1 + design.scatters) * anew if file.scattered else 0.0,
    }


def _variants(file: DesignFile) -> float:
    """Flanks whose motion is found, about."""
    found = _judgements(file)
    return found["samples"] + found["descents"] + found["trade-offs"] + found["contours"] + FINE


def _first(file: DesignFile) -> float:
    """Judgements until the first result, about."""
    fine = FINE_SCATTERED if file.design.scatters else FINE * first_angles(file.design.search.angles)
    return first_samples(file.design.search) + _descent(file, bounds=False) + fine / FINE


def _seconds_of_variant(file: DesignFile) -> float:
    """Seconds of one variant under all loads, as drawn."""
    positions = len(file.design.load.labels) * file.design.search.angles
    if file.set is not None:
        return positions * file.set.pitches * set_seconds(file.set).position
    cases = ((file.cases[name], file.repeats_after(name)) for name in file.meshes)
    return sum(positions * pitches * position_seconds(gear_pair(case), case) for case, pitches in cases)


def position_seconds(pair: GearPair, case: Case) -> float:
    """Return the time of line contact of a pair in a position."""
    return POSITION_S + SECTIONS_S * (pair.total_contact_ratio * sections_across(case)) ** 2


def _seconds_in_motion(file: DesignFile) -> float:
    """Seconds of the motion of one variant under all loads; 0 where none is asked for."""
    if file.box is None or not file.design.moves:
        return 0.0
    positions = LAWS * PER_HARMONIC * (file.box.model.sections.dynamics.harmonics + FURTHER)
    one = sum(file.repeats_after(name) * placed_seconds(file.box, name) for name in file.meshes)
    return len(file.design.load.labels) * positions * one


def _seconds_on_aligned_axes(file: DesignFile, counts: Mapping[str, float], one: float) -> float:
    """Seconds of a search for the best alone."""
    judged = counts["samples"] + counts["descents"] + counts["fine angles"] / 4
    return judged * one + (counts["samples"] + counts["descents"]) * _seconds_in_motion(file)


def _equilibrium_seconds(file: DesignFile) -> float:
    """Seconds in which the gearbox is solved anew under the loads of a design."""
    assert file.box is not None
    of_gearbox = stages_of_gearbox(file.box)
    every = len(file.box.model.sections.loads)
    return seconds_of(of_gearbox, LOADS.format(every)) * len(file.design.load.labels) / every
