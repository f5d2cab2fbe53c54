"""The pair that the live page solves, on the whole width."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from functools import partial

from pmor.case import Case
from pmor.case.capability import why_not
from pmor.case.width import asks_for_live_page, case_of_page, takes_whole_width
from pmor.core.copies import in_a_copy
from pmor.core.progress import stage
from pmor.reduction.basis import Basis
from pmor.storage.gear_store import KeptGear, not_kept
from pmor_offline.gears import line_basis
from pmor_online.model import ReducedPair, reduced_pair

# Squared elements over the profile times those over the width of finite elements that are solved beside others: these
# take 0.3 GiB at most.
MOST_BESIDE = 1000


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
    if not takes_whole_width(case):
        return reduced
    return reduced_pair(reduced.basis.whole or _solved_whole(case, not_kept))


@contextmanager
def whole_width_beside(case: Case, kept: KeptGear = not_kept) -> Iterator[Callable[[Basis], Basis]]:
    """Solve for the basis of the whole width, where the live page takes it, from gears that are kept.

    Small ones are solved in a copy of this process, where one may be made, while this one goes on.

    Yields
    ------
    with_whole : callable
        Returns a basis of the case with that of the whole width beside it.
    """
    if not takes_whole_width(case):
        yield lambda basis: basis
        return
    solve = partial(_solved_whole, case, kept)
    small = case.mesh.profile_elements**2 * case.mesh.width_elements <= MOST_BESIDE
    with in_a_copy(solve) if small else nullcontext(solve) as found:
        yield lambda basis: basis if basis.whole else replace(basis, whole=found())


def _solved_whole(case: Case, kept: KeptGear) -> Basis:
    with stage("finite elements of the whole width, for the live page"):
        return line_basis(case_of_page(case), kept)
