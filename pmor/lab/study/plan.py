"""Plan of a study: its pieces of work and their time; solves nothing."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from pmor.case import Case
from pmor.core.progress import format_time
from pmor.lab.study.measures import study_cases
from pmor.lab.study.settings import Study
from pmor.work.cost import FINITE_ELEMENTS, START_S, stages

# *Measured*, seconds: of conventional full FE, over the number of elements of the cell along the profile, and refined
# points, to the second power; of the pages and pictures.
CONVENTIONAL_S, PAGE_S = 0.1, 5.0


def plan(study: Study) -> str:
    """Return the plan of a study."""
    rows = [f"  {name:<34} about {format_time(seconds)}" for name, seconds in _pieces(study)]
    return "\n".join([f"Study {study.name}: {study.title}", "", "Pieces, each kept when it is finished", *rows])


def seconds(study: Study) -> dict[str, float]:
    """Return the time that commands take with a study, s, by name."""
    return {"study": START_S + PAGE_S + sum(seconds for _, seconds in _pieces(study))}


def _pieces(study: Study) -> Iterator[tuple[str, float]]:
    """Names of the pieces of work with their seconds."""
    cases, angles = study_cases(study), study.grid.angles_per_pitch
    for mesh, case in cases.meshes.items():
        yield f"reference {mesh.label}", _solved(case, angles, trained=False)
    for cell, case in cases.cells.items():
        yield f"cell {cell.label}", _solved(case, angles, trained=cell in study.reduced_cells)
    for cell in study.conventional.solved:
        yield f"conventional {cell.label}", CONVENTIONAL_S * (cell.n_profile * cell.lodm) ** 2


def _solved(case: Case, angles: int, trained: bool) -> float:
    """Seconds of the finite elements and the full solves of a grid of angles, and of a reduced model where trained."""
    on_grid = replace(case, compare=replace(case.compare, angles=angles, torques_Nm=(case.torque_Nm,)))
    found = {stage.name: stage.seconds for stage in stages(on_grid)}
    names = (FINITE_ELEMENTS, "comparison", *(["training", "sweep"] if trained else []))
    return sum(found[name] for name in names)
