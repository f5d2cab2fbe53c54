"""A figure from elsewhere beside ours."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Check:
    """A figure from elsewhere beside ours.

    Parameters
    ----------
    unit : str
        ``1`` for pure numbers.
    source : str
        Standard, paper, program, or how an exact result is found.
    tolerance : float
        Relative difference that digits and method of the source allow.
    """

    quantity: str
    unit: str
    theirs: float
    ours: float
    source: str
    tolerance: float

    @property
    def difference(self) -> float:
        """Ours over theirs, less 1."""
        return self.ours / self.theirs - 1.0

    @property
    def holds(self) -> bool:
        """Whether the difference is within the tolerance; a NaN is not."""
        return abs(self.difference) <= self.tolerance
