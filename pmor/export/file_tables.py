"""Arrays of a results file for tables, with their units, axes and descriptions."""

from __future__ import annotations

from pathlib import Path

from pmor.export.tables import ResultArray
from pmor.storage.results_file import RESULTS_LAYOUT, read_results


def file_entries(path: Path) -> dict[str, ResultArray]:
    """Return the arrays of a results file by their names.

    Raises
    ------
    FileFormatError
        When it is foreign, damaged, or of another version.
    """
    fields = {name: (array, RESULTS_LAYOUT[name]) for name, array in read_results(path).arrays.items()}
    return {name: ResultArray(a, f.unit, tuple(f.dims.split(", ")), f.description) for name, (a, f) in fields.items()}
