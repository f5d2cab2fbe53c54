"""Plan of a design: what is searched, on what, and how much work it is; solves nothing."""

from __future__ import annotations

from pmor.case import Case
from pmor.case.width import sections_across
from pmor.core.progress import format_time
from pmor.design.elements import coarse_design
from pmor.design.files import DesignFile
from pmor.design.readings import FINER, FRESH
from pmor.design.search import MOST_SINGLE, first_samples
from pmor.design.settings import Design, Variable
from pmor.gear.pair import GearPair
from pmor.pair.model import gear_pair
from pmor.sets.preview import SWEEP, stages_of_set
from pmor.work.cost import FINITE_ELEMENTS, START_S, stages

# *Measured*, seconds: of a position, and of the sections in contact in it to the second power; of the page.
POSITION_S, SECTIONS_S, PAGE_S = 6e-6, 1.2e-7, 3.0
# *Measured*: sweeps of a set that take as long as a judgement, which places its flanks anew and has their derivatives.
SET_SWEEPS = 3.8
# Share of the finite elements in the whole from which on the first result is found on half as many elements.
COARSE_SHARE = 0.1
# *Measured*: judgements of a descent, of one under a bound more, beside those by which each variable moves constraints;
# fine judgements, in those of the search, as drawn and over scatter.
DESCENT, BOUND, CONSTRAINED, FINE, FINE_SCATTERED = 50, 20, 12, 600, 200


def coarse_first(file: DesignFile) -> DesignFile | None:
    """Return the design on half as many elements where its first result comes from these; None where it does not."""
    share = _element_seconds(file) / _whole_seconds(file)
    return coarse_design(file) if share > COARSE_SHARE else None


def plan(file: DesignFile) -> str:
    """Return the plan of a design."""
    return "\n\n".join("\n".join(lines) for lines in (_searched(file.design, file), _work(file)))


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


def _work(file: DesignFile) -> list[str]:
    design = file.design
    draws = design.scatter.draws if design.scatters else 1
    positions = len(design.load.labels) * design.search.angles * file.pitches * draws
    lines = [
        "Work",
        *(f"  finite elements     {name}: {format_time(_seconds(case))}" for name, case in file.cases.items()),
        f"  a variant           {positions} positions",
        f"  samples, descents   {design.search.samples}, {design.search.descents}; "
        f"{design.pareto.points} points of the front against {design.pareto.against}",
    ]
    judgements, seconds = _judgements(file), _seconds_of_variant(file) * draws
    first = coarse_first(file) or file
    begin = START_S + _element_seconds(first) + _first(file) * _seconds_of_variant(first) * draws
    lines += [
        f"  judgements          about {judgements:,} of a variant, {format_time(judgements * seconds)}",
        f"  first result        after about {format_time(begin)}" + ", on half as many elements" * (first is not file),
    ]
    if file.box is not None:
        lines.append("  for comparison      a search on aligned axes; the gearbox solved anew with the best of both")
    return lines


def seconds(file: DesignFile) -> dict[str, float]:
    """Return the time that commands take with a design, s, by name; all processors share the search."""
    return {"design": _whole_seconds(file)}


def _whole_seconds(file: DesignFile) -> float:
    draws = file.design.scatter.draws if file.design.scatters else 1
    search = _judgements(file) * _seconds_of_variant(file) * draws
    return START_S + _element_seconds(file) + PAGE_S + (1 + (file.box is not None)) * search


def _element_seconds(file: DesignFile) -> float:
    return sum(_seconds(case) for case in file.cases.values())


def _seconds(case: Case) -> float:
    return sum(stage.seconds for stage in stages(case) if stage.name == FINITE_ELEMENTS)


def _judgements(file: DesignFile) -> int:
    """Judgements of a variant in a search, about."""
    design = file.design
    bound = CONSTRAINED * len(design.variables)
    descents = design.search.descents + (len(design.load.labels) if 1 < len(design.load.labels) <= MOST_SINGLE else 0)
    descent = DESCENT + bool(design.constraints) * bound
    fresh = FRESH // (design.scatter.draws if design.scatters else 1) if file.scattered else 0
    trade_offs = design.pareto.points * (BOUND + bound)
    fine = FINE_SCATTERED if design.scatters else FINE
    return design.search.samples + descents * descent + trade_offs + fine + FINER * fresh


def _first(file: DesignFile) -> int:
    """Judgements until the first result, about."""
    design = file.design
    bound = bool(design.constraints) * CONSTRAINED * len(design.variables)
    fine = FINE_SCATTERED if design.scatters else FINE
    return first_samples(design.search) + DESCENT + bound + fine // 10


def _seconds_of_variant(file: DesignFile) -> float:
    """Seconds of one variant under all loads, as drawn."""
    if file.set is not None:
        return SET_SWEEPS * next(stage.seconds for stage in stages_of_set(file.set) if stage.name == SWEEP)
    positions = len(file.design.load.labels) * file.design.search.angles
    cases = ((file.cases[name], file.repeats_after(name)) for name in file.meshes)
    return sum(positions * pitches * _position_seconds(gear_pair(case), case) for case, pitches in cases)


def _position_seconds(pair: GearPair, case: Case) -> float:
    return POSITION_S + SECTIONS_S * (pair.total_contact_ratio * sections_across(case)) ** 2
