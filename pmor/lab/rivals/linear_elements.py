"""What the other solvers do not take over: quadratic elements."""

from __future__ import annotations

from pmor.case import Case
from pmor.errors import CaseError


def refuse_quadratic_elements(case: Case, solver: str) -> None:
    """Refuse a case whose elements are quadratic.

    Raises
    ------
    CaseError
    """
    if case.mesh.order > 1:
        raise CaseError(
            f'case {case.name}: [mesh] element = "{case.mesh.element}": {solver} takes forces at all nodes of a flank, '
            'which quadratic elements have not got: choose "hex8i"'
        )
