"""The pair that the live page solves: on the whole width, whatever half of it stands for elsewhere."""

from __future__ import annotations

from pmor.case import Case
from pmor.case.width import mirrors_at_mid_width, whole_width
from pmor.pair.model import elastic_model, mesh_model
from pmor_offline.gather import make_basis
from pmor_online.model import ReducedPair, reduced_pair

# Nodes of a flank beyond which its compliance takes more of a page than all else: 8 x 8 quadratic elements have 289.
MOST_NODES = 600


def live_pair(reduced: ReducedPair) -> ReducedPair | str | None:
    """Return the pair that the live page of a reduced pair solves.

    Half the width knows nothing of what is unlike on its two sides, tilted axes and sloped flanks: where it stands for
    the whole, the finite elements of the whole width are solved.

    Parameters
    ----------
    reduced : ReducedPair

    Returns
    -------
    ReducedPair, str or None
        Of line loads; or why there is none; None where none is asked for.
    """
    case = reduced.basis.case
    if not (case.output.report and case.output.live_page):
        return None
    if why := why_not_live(case):
        return why
    if not reduced.meshed.mirrored:
        return reduced
    whole = whole_width(case)
    basis, _ = make_basis(whole, elastic_model(whole, mesh_model(whole)), ())
    return reduced_pair(basis)


def why_not_live(case: Case) -> str:
    """Say why a page cannot solve a case itself; nothing where it can."""
    mesh = case.mesh
    if case.contact.kind != "line" or case.reduction.shapes != "line_loads":
        return 'this model has shapes of its own; the page solves line loads alone (scheme "line", "line_loads")'
    across = 1 if mesh.width == "plane_strain" else mesh.width_elements
    nodes = (mesh.profile_intervals + 1) * (mesh.order * across + 1)
    if nodes > MOST_NODES:
        return f"the compliance of {nodes} nodes on each flank is too much for a page, which takes {MOST_NODES}"
    return ""


def whole_width_solved(case: Case) -> bool:
    """Return whether the finite elements of the whole width are solved for the page alone."""
    asked = case.output.report and case.output.live_page and not why_not_live(case)
    return asked and case.mesh.width != "plane_strain" and mirrors_at_mid_width(case)
