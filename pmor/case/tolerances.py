"""Section of a case file for the errors within which pairs are drawn: `[tolerances]`."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Annotated, Protocol

from pmor.core.ranges import Range, micrometres

Amount = Annotated[float, micrometres(0.0, 1000.0)]
#: of each flank, and of the axes, in the order in which they are drawn
OF_FLANKS = ("profile_slope_um", "profile_crowning_um", "helix_slope_um", "helix_crowning_um", "pitch_deviations_um")
OF_AXES = ("in_plane_um", "out_of_plane_um", "centre_distance_um")
# Of those, what loads the width unevenly, and what varies over it.
GRADE = "flank_tolerance_class"
UNEVEN = ("helix_slope_um", *OF_AXES[:2], GRADE)
OVER_WIDTH = ("helix_crowning_um", *UNEVEN)
Grade = Annotated[int, Range(1, 11)]
WavesPerPitch = Annotated[tuple[float, ...], Range(1.0, 50.0)]


@dataclass(frozen=True, kw_only=True)
class PairTolerances:
    """Standard deviations of the errors of a pair (section `[tolerances]`), normal and independent.

    They are about the flanks and axes of the case; both gears scatter independently. Each sample is a pair of its own,
    solved as any other: percentiles of the peak-to-peak transmission error, of K_Hbeta and pressure come out.

    Parameters
    ----------
    profile_slope_um, profile_crowning_um, helix_slope_um, helix_crowning_um : float
        Standard deviation of the amount of this name.
    pitch_deviations_um : float
        Standard deviation of each tooth's flank. Samples are then solved over a turn of the larger gear.
    in_plane_um, out_of_plane_um, centre_distance_um : float
        Standard deviation of the place of the wheel's axis.
    flank_tolerance_class : int or None
        Flank tolerance class of ISO 1328-1:2013 to which both gears are made, besides: each drawn gear has the largest
        deviations of pitch, slopes and form that the class allows, f_pT, F_pT, f_HalphaT, f_HbetaT, f_falphaT and
        f_fbetaT, not rounded, in a random pattern. Pitch and slopes differ from tooth to tooth; samples are solved over
        a turn of the larger gear.
    waves_per_pitch : tuple of float
        Deviations of form of that class: waves to a pitch, of which whole numbers around each gear are taken, with one
        amplitude and random phases, also along the face. Without: no deviations of form.
    samples : int
        Pairs that are drawn.
    seed : int
        Seed of the draws: the same one draws the same pairs.
    """

    profile_slope_um: Amount = 0.0
    profile_crowning_um: Amount = 0.0
    helix_slope_um: Amount = 0.0
    helix_crowning_um: Amount = 0.0
    pitch_deviations_um: Amount = 0.0
    in_plane_um: Amount = 0.0
    out_of_plane_um: Amount = 0.0
    centre_distance_um: Amount = 0.0
    flank_tolerance_class: Grade | None = None
    waves_per_pitch: WavesPerPitch = ()
    samples: Annotated[int, Range(8, 100_000)] = 200
    seed: Annotated[int, Range(0, 1_000_000)] = 0

    def scattering(self, keys: tuple[str, ...] = (*OF_FLANKS, *OF_AXES, GRADE)) -> list[str]:
        """Keys of what scatters, of those that are asked for."""
        given = asdict(self)
        return [key for key in keys if given[key]]

    @property
    def of_teeth(self) -> bool:
        """Whether teeth of a gear come to differ."""
        return bool(self.scattering((*OF_FLANKS[-1:], GRADE)))


class MadeToGrade(Protocol):
    """Tolerances with a class to which gears are made."""

    @property
    def flank_tolerance_class(self) -> int | None: ...  # noqa: D102

    @property
    def waves_per_pitch(self) -> tuple[float, ...]: ...  # noqa: D102


def refused_waves(sizes: MadeToGrade, angles: int) -> str:
    """Return why form cannot be drawn with so many angles to a pitch, and what to do; empty where it can."""
    if not sizes.waves_per_pitch:
        return ""
    if sizes.flank_tolerance_class is None:
        return "is the form of gears made to a class: write flank_tolerance_class, or leave it out"
    least = math.floor(2.0 * max(sizes.waves_per_pitch)) + 1
    if angles < least:
        return f"waves are missed by {angles} angles to a pitch: raise angles_per_pitch to {least} at least"
    return ""
