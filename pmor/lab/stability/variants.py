"""The matrix of variants as data: what each changes in the case, and what its answer is held against."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

from pmor.lab.core.variants import Sections

Against = Literal["start", "base", "finer", "mirror", "neighbours", "full", "nothing"]

# How an answer is held against what it should be, for the report.
REFERENCES = {
    "start": "the same positions, reached from another load",
    "base": "the base case at the same positions, by the scale that mechanics asks for",
    "finer": "the same gears on half again as many elements over the profile, less what that changes in the base case",
    "mirror": "the same pair with the gears exchanged, at the mirrored positions",
    "neighbours": "the mean of the two positions a ten-thousandth of a pitch away",
    "full": "full FE on the same mesh",
    "nothing": "nothing: the variant is expected to be refused",
}
# Two ways to one state agree to what either is solved to, with room for flat directions.
SAME_STATE = 1e-6
# Forces go from the smooth patches to the nodes by bilinear shares (the paper's transfer), which is not quite the
# derivative of the gap: on meshes of this size 1-2 % of the work, and nothing with facets.
MESH_ENERGY = 0.05


@dataclass(frozen=True)
class Variant:
    """One line of the matrix.

    Parameters
    ----------
    name : str
        Unique.
    group : str
        Heading of the report under which it stands.
    about : str
        What it shows, for the report.
    changes : mapping
        New values by section and key of the case.
    against : str
        Key of `REFERENCES`.
    factor : float
        What the STE of the reference is multiplied by.
    tolerance : float
        On the largest difference to the reference over its mean STE.
    places : {"usual", "borders", "ends", "hunting"}
        Where over the pitch: `pmor.lab.stability.places`.
    start_mm : float or None
        How far off the advance of the start is, mm along the line of action; None: the solver's own start.
    rising : tuple of float
        Loads over the nominal one that are solved before it, each from the one before, as a sweep does.
    basis : str or None
        How the reduced basis is made (`pmor.lab.stability.reduced`); None: full FE.
    limit : str
        Part of the warning that the program gives beforehand where this variant is known not to hold.
    energy : float
        Allowed imbalance, relative.
    """

    name: str
    group: str
    about: str
    changes: Sections = field(default_factory=dict)
    against: Against = "start"
    factor: float = 1.0
    tolerance: float = SAME_STATE
    places: str = "usual"
    start_mm: float | None = None
    rising: tuple[float, ...] = ()
    basis: str | None = None
    limit: str = ""
    energy: float = MESH_ENERGY
