"""From the cells of a study to cases, and the results of all its pieces of work."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from pmor.case import Case, changed_text, load_case, parse_case, text_of, without_models
from pmor.lab.core.variants import Sections, merged
from pmor.lab.study.settings import Cell, ReferenceMesh, Study
from pmor.work.pieces import Result


@dataclass(frozen=True)
class StudyCases:
    """All cases of a study, checked before anything runs."""

    cells: Mapping[Cell, Case]
    meshes: Mapping[ReferenceMesh, Case]  # The reference's family
    peer: Case | None  # Of the independent solver


@dataclass(frozen=True)
class StudyParts:
    """The results of all pieces of work."""

    study: Study
    cases: StudyCases
    results: Mapping[str, Result]  # By the name of the piece; missing for those that failed
    failures: tuple[str, ...]  # Pieces that did not converge at all


def study_cases(study: Study) -> StudyCases:
    """Make the cases of a study; `CaseError` when the base case, or a cell's change of it, is refused."""
    base = text_of(without_models(load_case(study.base)))

    def case(cell: Cell, changes: Sections) -> Case:
        text = changed_text(base, merged(study.changes_of(cell), changes))
        return parse_case(text, cell.label, f"{study.where}: cell {cell.label}")

    return StudyCases(
        cells={cell: case(cell, {}) for cell in study.cells},
        meshes={m: case(Cell(m.n_profile, m.lodm), {"mesh": {"width_elements": m.n_width}}) for m in study.meshes},
        peer=case(study.peer.cell, study.peer.changes) if study.peer is not None else None,
    )
