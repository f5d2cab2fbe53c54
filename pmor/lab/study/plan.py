"""Plan of a study: its pieces of work and their time; solves nothing."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

from pmor.case import Case
from pmor.case.width import whole_width
from pmor.core.progress import format_time
from pmor.lab.rivals.calculix import calculix_available
from pmor.lab.study.measures import StudyCases, study_cases
from pmor.lab.study.settings import Study
from pmor.pair.model import gear_pair
from pmor.work.cost import FINITE_ELEMENTS, START_S, Plan, compiling_seconds, plan_texts, stages
from pmor.work.sizes import pair_size

# *Measured*, seconds: of conventional full FE, over the elements of both gears to a power; of CalculiX at all of its
# positions, over that; of a cell that is timed; of the pages and pictures.
CONVENTIONAL_S, POWER, PEER, TIMED_S, PAGE_S = 1.4e-5, 1.4, 4.5, 0.5, 5.0


def plan(study: Study) -> Plan:
    """Return the plan of a study."""
    cases = study_cases(study)
    pieces = dict(_pieces(study, cases))
    rows = [f"  {name:<34} about {format_time(seconds)}" for name, seconds in pieces.items()]
    title, said = [f"Study {study.name}: {study.title}"], ["Pieces, each kept when it is finished", *rows]
    solved = [*cases.meshes.values(), *cases.cells.values()]
    seconds = {"study": START_S + PAGE_S + sum(pieces.values())}
    return Plan(lambda: plan_texts(title, said), seconds, compiling_seconds(solved))


def _pieces(study: Study, cases: StudyCases) -> Iterator[tuple[str, float]]:
    """Names of the pieces of work with their seconds."""
    angles = study.grid.angles_per_pitch
    for mesh, case in cases.meshes.items():
        yield f"reference {mesh.label}", _solved(case, angles, trained=False)
    for cell, case in cases.cells.items():
        yield f"cell {cell.label}", _solved(case, angles, trained=cell in study.reduced_cells)
    for cell in study.conventional.solved:
        yield f"conventional {cell.label}", _conventional_seconds(cases.cells[cell])
    if study.peer is not None and cases.peer is not None and calculix_available():
        yield f"peer {study.peer.cell.label}", PEER * _conventional_seconds(cases.peer)
    if study.reduced_cells:
        yield "run times", TIMED_S * len(study.reduced_cells)


def _conventional_seconds(case: Case) -> float:
    """Seconds of full FE without condensation, over the whole width and all sectors."""
    whole = whole_width(case)
    gears = pair_size(whole, gear_pair(whole)).gears
    return CONVENTIONAL_S * (2 / len(gears) * sum(gear.elements * gear.teeth for gear in gears)) ** POWER


def _solved(case: Case, angles: int, trained: bool) -> float:
    """Seconds of the finite elements and the full solves of a grid of angles, and of a reduced model where trained."""
    on_grid = replace(case, compare=replace(case.compare, angles=angles, torques_Nm=(case.torque_Nm,)))
    found = {stage.name: stage.seconds for stage in stages(on_grid)}
    names = (FINITE_ELEMENTS, "comparison", *(["training", "sweep"] if trained else []))
    return sum(found[name] for name in names)
