"""The live page of a case: whether it is asked for, and on which mesh it solves the case."""

from __future__ import annotations

from dataclasses import replace

from pmor.case.capability import why_not
from pmor.case.schema import Case
from pmor.case.width import mirrors_at_mid_width, whole_width


def asks_for_live_page(case: Case) -> bool:
    """Return whether a case asks for a page that solves it."""
    return case.output.report and case.output.live_page


def takes_whole_width(case: Case) -> bool:
    """Return whether the finite elements of the whole width are solved for the page alone.

    Half of it cannot represent differences between the halves, such as tilted axes and sloped flanks.
    """
    asked = asks_for_live_page(case) and not why_not(case, "page")
    return asked and case.mesh.width != "plane_strain" and mirrors_at_mid_width(case)


def case_of_page(case: Case) -> Case:
    """Return the case whose finite elements the page takes: of the whole width, without error bar and stress."""
    return whole_width(replace(case.without_stress(), mesh=replace(case.mesh, error_bar=False)))
