"""The results of all pieces of work of a study."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from pmor.lab.study.cells import StudyCases
from pmor.lab.study.settings import Study
from pmor.work.pieces import Result


@dataclass(frozen=True)
class StudyParts:
    """The results of all pieces of work.

    Parameters
    ----------
    study : Study
    cases : StudyCases
    results : mapping of str to Result
        By the name of the piece; missing for those that failed.
    failures : tuple of str
        Pieces that did not converge at all.
    """

    study: Study
    cases: StudyCases
    results: Mapping[str, Result]
    failures: tuple[str, ...]
