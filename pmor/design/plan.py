"""Plan of a design: what is searched, on what, and how much work it is; solves nothing."""

from __future__ import annotations

from pathlib import Path

from pmor.case import Case
from pmor.case.reader import parse_toml, read_text
from pmor.core.progress import format_time
from pmor.design.files import DesignFile, PairDesign, SetDesign
from pmor.design.settings import Design, Variable
from pmor.work.cost import FINITE_ELEMENTS, stages

VARIABLES = "variables"


def is_design(path: Path) -> bool:
    """Return whether a file has variables of a design; CaseError when it cannot be read."""
    return VARIABLES in parse_toml(read_text(path, "case file"), str(path))


def plan(file: DesignFile) -> str:
    """Return the plan of a design."""
    return "\n\n".join("\n".join(lines) for lines in (_searched(file.design, file), _work(file)))


def _searched(design: Design, file: DesignFile) -> list[str]:
    load, goal, words = design.load, design.objective, file.words
    weights = ", ".join(f"{label} ({weight:g})" for label, weight in zip(load.labels, load.weights, strict=True))
    lines = [
        f"Design {file.name}: {design.title}",
        f"  {words.kind:<19} {words.name}: {words.title}",
        f"  loads (weights)     {weights}",
        f"  minimised           {goal.minimise}, {goal.value}, weighted mean over the loads",
        *(f"  constraint          {c.result} at most {c.at_most:g}" for c in design.constraints),
        *(f"  variable            {_words(v)}" for v in design.variables),
    ]
    if isinstance(file, PairDesign) and file.box is not None:
        lines[2:2] = [
            f"  gearbox             {file.box.name}: mesh {file.mesh}, contact on its supports under each load, the "
            "other meshes under their mean loads",
        ]
    if isinstance(file, SetDesign):
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
    if isinstance(file, PairDesign) and file.box is not None:
        lines.append("  for comparison      a search on aligned axes; the gearbox solved anew with the best of both")
    return lines


def _seconds(case: Case) -> float:
    return sum(stage.seconds for stage in stages(case) if stage.name == FINITE_ELEMENTS)
