"""Positions without a solution: how many under each torque, why, and what to do."""

from __future__ import annotations

from collections.abc import Sequence

from pmor.core.arrays import BoolArray
from pmor.line.hertz import TOO_WIDE

OVERLOADED = f"the torque {TOO_WIDE}"
NOT_FOUND = "which sections carry was not found: another number of angles moves the positions"


def left_out(name: str, lost: BoolArray, reasons: Sequence[str]) -> str:
    """Return the sentence for positions (A,) that are lost under the torque of a name."""
    count = f"{int(lost.sum())} of {len(lost)} positions did not converge"
    return f"{name}: {count} and are left out, and orders with them: {'; '.join(reasons)}"


def lost_of_pair(names: Sequence[str], converged: BoolArray, overloaded: BoolArray) -> list[str]:
    """Return a sentence for each torque of a pair under which positions have no solution.

    Parameters
    ----------
    names : sequence of str
        Of the torques.
    converged, overloaded : ndarray of bool, shape (D, A)
        States that have a solution, and those without that overload a section.
    """
    found = []
    for name, lost, wide in zip(names, ~converged, overloaded, strict=True):
        if lost.any():
            reasons = [OVERLOADED] * bool((lost & wide).any()) + [NOT_FOUND] * bool((lost & ~wide).any())
            found.append(left_out(name, lost, reasons))
    return found
