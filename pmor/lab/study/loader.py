"""Read a study file: TOML -> `Study`; `pmor.case` checks the changes of its cells."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from pmor.case.reader import Reader, parse_toml, read_text, sections_in
from pmor.core.errors import CaseError, printable
from pmor.lab.study.settings import Study, quick_study


def load(path: Path | str, *, quick: bool = False) -> Study:
    """Read and check a study file, or its short variant; its base case is looked for beside it.

    Raises
    ------
    CaseError
        One line with file, section, key, rule and remedy.
    """
    path = Path(path)
    study = parse_study(read_text(path, "study file"), printable(path.stem), str(path), path.parent)
    return quick_study(study) if quick else study


def parse_study(text: str, name: str, where: str, folder: Path) -> Study:
    """Check the TOML text of a study file, called `where` in messages; the base case is looked for in `folder`."""
    reader = Reader(where, sections_in(Study))
    given = {"name": name, "where": where, "changes": {}}
    study = reader.section(parse_toml(text, where), Study, filled={"title": name}, given=given)
    study = replace(study, base=folder / study.base)
    _check_together(study)
    return study


def _check_together(study: Study) -> None:
    """Raise `CaseError` where values that are fine alone do not go together."""

    def refuse(place: str, rule: str) -> None:
        raise CaseError(f"{study.where}: {place}: {rule}")

    if not study.reduced_cells and study.reference is not None:
        refuse("[grid] cells", "is missing: add 'cells = ...' there")
    if study.reduced_cells and study.reference is None:
        refuse("[reference] meshes", "is missing: add 'meshes = ...' there")
    if not study.cells:
        refuse("[[variant]]", "is missing: add one, or [grid] cells with a [reference]")
    for section, family in (("reference", study.reference), ("quick", study.quick)):
        sizes = [(m.n_profile, m.n_width) for m in family.meshes] if family is not None else [(1, 1), (2, 1)]
        finer = all(a[0] < b[0] and a[1] <= b[1] for a, b in zip(sizes[:-1], sizes[1:], strict=True))
        if len(sizes) not in (2, 3) or not finer:
            refuse(f"[{section}] meshes", "must be two or three meshes, from coarse to fine over the profile")
    varied = study.cells[len(study.grid.cells) :]
    if len(set(varied)) < len(varied):
        refuse("[variant], [rung] name", "two variants of a cell have the same name: rename one")
    grid = set(study.grid.cells)
    for cell in study.conventional.solved:
        if cell not in grid:
            rule = "is not among the [grid] cells: add it there or remove it here"
            refuse(f"[conventional] solved: {cell.label}", rule)
