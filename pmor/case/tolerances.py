"""Section of a case file for the errors within which pairs are drawn: `[tolerances]`."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Annotated

from pmor.core.ranges import Range, micrometres

Amount = Annotated[float, micrometres(0.0, 1000.0)]
#: of each flank, and of the axes, in the order in which they are drawn
OF_FLANKS = ("profile_slope_um", "profile_crowning_um", "helix_slope_um", "helix_crowning_um", "pitch_deviations_um")
OF_AXES = ("in_plane_um", "out_of_plane_um", "centre_distance_um")
# Of those, what loads the width unevenly, and what varies over it.
UNEVEN, OVER_WIDTH = ("helix_slope_um", *OF_AXES[:2]), ("helix_slope_um", "helix_crowning_um", *OF_AXES[:2])


@dataclass(frozen=True, kw_only=True)
class PairTolerances:
    """Standard deviations of the errors of a pair (section `[tolerances]`), normal and independent.

    They are about the flanks and axes of the case; both gears scatter independently. Each sample is a pair of its own,
    solved as any other: percentiles of the peak-to-peak transmission error, of K_Hbeta and pressure come out.

    Parameters
    ----------
    profile_slope_um, profile_crowning_um, helix_slope_um, helix_crowning_um : float
        Of these amounts.
    pitch_deviations_um : float
        Of each tooth's flank. Samples are then solved over a turn of the larger gear.
    in_plane_um, out_of_plane_um, centre_distance_um : float
        Of the axes.
    samples : int
        Pairs that are drawn.
    seed : int
        Of the draws: the same one draws the same pairs.
    """

    profile_slope_um: Amount = 0.0
    profile_crowning_um: Amount = 0.0
    helix_slope_um: Amount = 0.0
    helix_crowning_um: Amount = 0.0
    pitch_deviations_um: Amount = 0.0
    in_plane_um: Amount = 0.0
    out_of_plane_um: Amount = 0.0
    centre_distance_um: Amount = 0.0
    samples: Annotated[int, Range(8, 100_000)] = 200
    seed: Annotated[int, Range(0, 1_000_000)] = 0

    def scattering(self, keys: tuple[str, ...] = (*OF_FLANKS, *OF_AXES)) -> list[str]:
        """Keys of what scatters, of those that are asked for."""
        given = asdict(self)
        return [key for key in keys if given[key] > 0.0]
