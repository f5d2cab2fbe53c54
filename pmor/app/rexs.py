"""Cases from gearbox files."""

from __future__ import annotations

import logging
from pathlib import Path

from pmor.case import Case
from pmor.export.rexs.read import import_rexs as read_stage

_LOG = logging.getLogger("pmor.rexs")


def import_rexs(path: Path | str, *, stage: int | None = None) -> Case:
    """Make a case of a cylindrical stage of a gearbox in a REXS file (1.0 to 2.0).

    What was assumed, or not understood, is noted in the log ``pmor``, and in the comments of the case's text.

    Parameters
    ----------
    path : Path or str
        `.rexs`, `.rexsz` or `.rexsj`.
    stage : int, optional
        Number of the stage in the file, where there are several.

    Raises
    ------
    FileFormatError
        When it is no REXS file.
    CaseError, GeometryError
        When there is no such stage, it lacks what a case needs, or its teeth cannot mesh.
    """
    found = read_stage(path, stage)
    for note in found.notes:
        _LOG.info("%s", note)
    return found.case
