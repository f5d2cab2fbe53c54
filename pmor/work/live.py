"""The pair that the live page solves, on the whole width."""

from __future__ import annotations

from pmor.case.capability import why_not
from pmor.case.live_page import asks_for_live_page, takes_whole_width
from pmor.case.width import whole_width
from pmor.pair.model import elastic_model, mesh_model
from pmor_offline.gather import make_basis
from pmor_online.model import ReducedPair, reduced_pair


def live_pair(reduced: ReducedPair) -> ReducedPair | str | None:
    """Return the pair that the live page of a reduced pair solves.

    Where half the width stands for the whole, the finite elements of the whole are solved.

    Returns
    -------
    ReducedPair, str or None
        Of line loads; or the reason for its absence; None where none is asked for.
    """
    case = reduced.basis.case
    if not asks_for_live_page(case):
        return None
    if why := why_not(case, "page"):
        return why
    if reduced.layered.hubs is not None or reduced.flank_compliance.support is not None:
        return "the page solves solid gears on rigid hubs alone"
    if not takes_whole_width(case):
        return reduced
    whole = whole_width(case)
    basis, _ = make_basis(whole, elastic_model(whole, mesh_model(whole)), ())
    return reduced_pair(basis)
