"""The live page of a case: whether the page can solve the case itself, and on which mesh."""

from __future__ import annotations

from pmor.case.schema import Case
from pmor.case.width import mirrors_at_mid_width

# Nodes of a flank beyond which its compliance takes more of a page than all else: 8 x 8 quadratic elements have 289.
MOST_NODES = 600


def asks_for_live_page(case: Case) -> bool:
    """Return whether a case asks for a page that solves it."""
    return case.output.report and case.output.live_page


def why_not_live(case: Case) -> str:
    """Return the reason why a page cannot solve a case itself; empty where it can."""
    mesh = case.mesh
    if case.contact.kind != "line":
        return 'the page solves line contact alone: write [contact] scheme = "line"'
    across = 1 if mesh.width == "plane_strain" else mesh.width_elements
    nodes = (mesh.profile_intervals + 1) * (mesh.order * across + 1)
    if nodes > MOST_NODES:
        return f"the compliance of {nodes} nodes on each flank is too much for a page, which takes {MOST_NODES}"
    return ""


def takes_whole_width(case: Case) -> bool:
    """Return whether the finite elements of the whole width are solved for the page alone.

    Half of it cannot represent differences between the halves, such as tilted axes and sloped flanks.
    """
    asked = asks_for_live_page(case) and not why_not_live(case)
    return asked and case.mesh.width != "plane_strain" and mirrors_at_mid_width(case)
