"""The pair that the live page solves, on the whole width."""

from __future__ import annotations

from dataclasses import replace

from pmor.case.capability import why_not
from pmor.case.width import asks_for_live_page, case_of_page, takes_whole_width
from pmor.core.progress import stage
from pmor.reduction.basis import Basis
from pmor.storage.gear_store import KeptGear, not_kept
from pmor_offline.gears import line_basis
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
    if reduced.layered.hubs is not None:
        return "the page solves gears on rigid hubs alone"
    whole = with_whole_width(reduced.basis).whole
    return reduced if whole is None else reduced_pair(whole)


def with_whole_width(basis: Basis, kept: KeptGear = not_kept) -> Basis:
    """Return a basis with that of the whole width beside it, where the live page takes it, from gears that are kept."""
    if basis.whole is not None or not takes_whole_width(basis.case):
        return basis
    whole = case_of_page(basis.case)
    with stage("finite elements of the whole width, for the live page"):
        return replace(basis, whole=line_basis(whole, kept))
