"""A variant of a design as a case file."""

from __future__ import annotations

from pathlib import Path

from pmor.case import change_case, load_case, text_of
from pmor.core.errors import CaseError, OutputError
from pmor.design.loader import DesignFile
from pmor.design.variables import assembly_at
from pmor.storage.atomic import atomic_path
from pmor.storage.design_file import read_design_file
from pmor.storage.results_folder import results_folder


def write_variant(file: DesignFile, folder: Path, number: int, *, overwrite: bool = False) -> Path:
    """Write the case file of a variant into the folder of its results, and return its path.

    Raises
    ------
    CaseError, OutputError, FileFormatError
        When there is no such variant, or the results are those of another design.
    """
    path = folder / f"variant_{number}.toml"
    text = _text(file, folder / "design.h5", number)
    with results_folder(folder, (path.name,), (), overwrite, file.inputs), atomic_path(path, True) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return path


def _text(file: DesignFile, results: Path, number: int) -> str:
    if not results.exists():
        raise OutputError(f"{results}: there are no results yet: run pmor.run_design first")
    found = read_design_file(results)
    if found.text != file.text:
        raise OutputError(f"{results}: was made from another design file or case: run pmor.run_design first")
    count = len(found.arrays["x"])
    if number >= count:
        raise CaseError(f"variant {number}: variants are 0 to {count - 1}: choose one of them")
    base = load_case(file.inputs[1]) if file.box is None else file.box.cases[file.mesh]
    assembly = assembly_at(file.base, file.design.variables, found.arrays["x"][number])
    sections = {"pinion.modification": assembly.pinion, "wheel.modification": assembly.wheel}
    changes = {name: {k: v for k, v in vars(m).items() if v is not None} for name, m in sections.items()}
    changed = change_case(base, title=f"{base.title}, variant {number} of {file.design.title}", **changes)
    return f"# Variant {number} of the design {file.name}.\n\n{text_of(changed)}"
