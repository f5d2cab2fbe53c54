"""Flank modifications of one gear, in the units and with the names of a case file."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any, Literal, get_args

from pmor.core.ranges import METRES, MILLIMETRES, RADIANS, SHARE, Length, Range, micrometres
from pmor.core.shown import brief
from pmor.core.wording import suggesting
from pmor.gear.topography import Topography

Amount = Annotated[float, micrometres(-1000.0, 1000.0)]
Amounts = Annotated[tuple[float, ...], micrometres(-1000.0, 1000.0, in_order=True)]
RollAngle = Annotated[float, Range(0.0, 180.0, "deg", mistaken_for=(RADIANS,))]
Percent = Annotated[float, Range(1.0, 100.0, "%", mistaken_for=(SHARE,))]
ReliefShape = Literal["linear", "parabolic"]
AmountKey = Literal[
    "tip_relief_um", "root_relief_um", "profile_crowning_um", "profile_slope_um", "helix_crowning_um",
    "helix_slope_um", "end_relief_um", "twist_um",
]  # fmt: skip
ExtentKey = Literal[
    "tip_relief_start_roll_deg", "tip_relief_start_roll_length_mm", "tip_relief_start_diameter_mm",
    "tip_relief_length_mm", "tip_relief_start_percent", "root_relief_end_roll_deg", "root_relief_end_roll_length_mm",
    "root_relief_end_diameter_mm", "root_relief_length_mm", "root_relief_end_percent", "end_relief_length_mm",
]  # fmt: skip
#: amounts, in each of which the deviation is linear; fields of `pmor.gear.kernels.deviation.Deviation` without the unit
AMOUNTS: tuple[AmountKey, ...] = get_args(AmountKey)
OVER_WIDTH: tuple[AmountKey, ...] = ("helix_crowning_um", "helix_slope_um", "end_relief_um", "twist_um")
#: antisymmetric over the face: not possible on half a mesh, of the other sign from the other end
UNEVEN: tuple[AmountKey, ...] = ("helix_slope_um", "twist_um")

#: keys of the place at which a relief starts or ends, by its amount, and what they measure
#: (fields of `pmor.gear.profile.ProfilePoint`)
RELIEF_PLACES: Mapping[str, Mapping[str, str]] = {
    "tip_relief_um": {
        "tip_relief_start_roll_deg": "roll_deg", "tip_relief_start_roll_length_mm": "roll_length_mm",
        "tip_relief_start_diameter_mm": "diameter_mm", "tip_relief_length_mm": "to_tip_mm",
        "tip_relief_start_percent": "percent",
    },
    "root_relief_um": {
        "root_relief_end_roll_deg": "roll_deg", "root_relief_end_roll_length_mm": "roll_length_mm",
        "root_relief_end_diameter_mm": "diameter_mm", "root_relief_length_mm": "from_start_mm",
        "root_relief_end_percent": "percent",
    },
}  # fmt: skip


def other_places(keys: Iterable[str]) -> set[str]:
    """Return the keys that say otherwise what some of the given keys say: where a relief starts or ends."""
    given = set(keys)
    return {key for places in RELIEF_PLACES.values() if given & set(places) for key in places} - given


@brief
@suggesting
@dataclass(frozen=True, kw_only=True)
class Wave:
    """A wave around a gear (list `waves` of a modification), as machine tools leave it: it runs on from tooth to tooth.

    Along the path of contact of any tooth it is amplitude cos(count psi + phase), where psi is the roll angle on the
    first tooth, less the angle from there to the tooth: all teeth in mesh have one psi in a transverse section. Teeth
    count as those of pitch deviations, on coast flanks clockwise.

    Parameters
    ----------
    count : int
        Waves in a revolution of the gear.
    amplitude_um : float
        Half of the height from valley to crest, in um.
    phase_deg : float
        Phase at roll angle 0 of the first tooth, at the gear's own mid width, in degrees of the wave.
    helix_phase_deg : float
        Amount by which the phase grows from the face with the smaller z to the other at the same roll angle, in degrees
        of the wave. 0: crests stand across the face at one roll angle.
    """

    count: Annotated[int, Range(1, 100_000)]
    amplitude_um: Annotated[float, Range(0.0, 100.0, "um", mistaken_for=(MILLIMETRES,), low_excluded=True)]
    phase_deg: Annotated[float, Range(-360.0, 360.0, "deg")] = 0.0
    helix_phase_deg: Annotated[float, Range(-1e6, 1e6, "deg")] = 0.0


@brief
@suggesting
@dataclass(frozen=True, kw_only=True)
class Modification:
    """Deviations of the loaded flanks of one gear (sections `[pinion.modification]` and `[wheel.modification]`).

    Amounts are in um along the transverse line of action, positive removes material. Roll angles are the gear's own.
    All laws continue beyond the active profile. One key says where a relief starts or ends.

    Parameters
    ----------
    tip_relief_um : float
        Amount of tip relief at the tip circle, in um.
    tip_relief_start_roll_deg : float or None
        Roll angle at which tip relief starts, in degrees.
    tip_relief_start_roll_length_mm : float or None
        Or its roll length in mm: on the line of action, from where it touches the base circle.
    tip_relief_start_diameter_mm : float or None
        Or its diameter in mm.
    tip_relief_length_mm : float or None
        Or the length of the relief in mm, on the path of contact from its start to the tip circle.
    tip_relief_start_percent : float or None
        Or its share of the path of contact in per cent, from the start of the gear's active profile (0) to its end
        (100).
    tip_relief_shape : {"linear", "parabolic"}
        How tip relief E grows: with x or with x^2, where x goes from 0 at the start to 1 at the tip circle.
    root_relief_um : float
        Amount of root relief at the start of the active profile, in um.
    root_relief_end_roll_deg : float or None
        Roll angle at which root relief ends, in degrees.
    root_relief_end_roll_length_mm : float or None
        Or its roll length in mm.
    root_relief_end_diameter_mm : float or None
        Or its diameter in mm.
    root_relief_length_mm : float or None
        Or the length of the relief in mm, on the path of contact from the start of the active profile.
    root_relief_end_percent : float or None
        Or its share of the path of contact in per cent, counted as that of tip relief: small near the root.
    root_relief_shape : {"linear", "parabolic"}
        How root relief grows from there towards the root.
    profile_crowning_um : float
        Profile crowning at both ends of the active profile, in um: a parabola, 0 at its middle (in roll angle).
    profile_slope_um : float
        Profile slope from the start of the active profile to its end, in um: a straight line, half of it at the tip,
        minus half at the start.
    helix_crowning_um : float
        Helix crowning at both faces, in um: a parabola, 0 at the gear's own mid width.
    helix_slope_um : float
        Helix slope from face to face, in um: a straight line, half of it at the face with the larger z, minus half at
        the other.
    end_relief_um : float
        End relief at both faces, in um: a straight line to 0 at the length below.
    end_relief_length_mm : float or None
        How far end relief reaches from each face, in mm; needed with `end_relief_um`.
    twist_um : float
        Difference of the helix slope at the end of the active profile from the one at its start, in um: a quarter of
        it in two corners of the active flank, minus that in the others.
    topography : Topography or None
        Amounts on a grid; in a case file a CSV file beside it: z in mm from the gear's own mid width in the first row,
        roll angles in degrees in the first column, amounts in um. Where teeth differ: a list of such files, one for
        each tooth, or one file whose corner says ``tooth`` and whose first column has the number of the tooth, from 1
        on, before the roll angle; teeth follow as those of pitch deviations.
    pitch_deviations_um : tuple of float
        Pitch deviation of each tooth's flank, in um, counter-clockwise, the tooth on the line of centres at pinion
        angle 0 first. They count from their median.
    waves : tuple of Wave
        Waves around the gear.
    """

    tip_relief_um: Amount = 0.0
    tip_relief_start_roll_deg: RollAngle | None = None
    tip_relief_start_roll_length_mm: Length | None = None
    tip_relief_start_diameter_mm: Length | None = None
    tip_relief_length_mm: Length | None = None
    tip_relief_start_percent: Percent | None = None
    tip_relief_shape: ReliefShape = "linear"
    root_relief_um: Amount = 0.0
    root_relief_end_roll_deg: RollAngle | None = None
    root_relief_end_roll_length_mm: Length | None = None
    root_relief_end_diameter_mm: Length | None = None
    root_relief_length_mm: Length | None = None
    root_relief_end_percent: Percent | None = None
    root_relief_shape: ReliefShape = "linear"
    profile_crowning_um: Amount = 0.0
    profile_slope_um: Amount = 0.0
    helix_crowning_um: Amount = 0.0
    helix_slope_um: Amount = 0.0
    end_relief_um: Amount = 0.0
    end_relief_length_mm: Annotated[float, Range(1e-3, 1e5, "mm", mistaken_for=(METRES,))] | None = None
    twist_um: Amount = 0.0
    topography: Topography | None = None
    pitch_deviations_um: Amounts = ()
    waves: tuple[Wave, ...] = ()

    @property
    def present(self) -> bool:
        """Whether any of it deviates from the involute helicoid."""
        return self.topography is not None or any(self._amounts) or bool(self.tooth_keys)

    @property
    def tooth_keys(self) -> tuple[str, ...]:
        """Keys of what differs from tooth to tooth."""
        teeth = self.topography is not None and self.topography.teeth_um
        given = {"pitch_deviations_um": any(self.pitch_deviations_um), "topography": teeth, "waves": self.waves}
        return tuple(key for key, value in given.items() if value)

    @property
    def of_teeth(self) -> Modification:
        """What differs from tooth to tooth, alone."""
        return Modification(**{key: getattr(self, key) for key in self.tooth_keys})

    @property
    def alike(self) -> Modification:
        """What all teeth have: the rest of it."""
        usual: dict[str, Any] = {"pitch_deviations_um": (), "topography": None, "waves": ()}
        return replace(self, **{key: usual[key] for key in self.tooth_keys})

    def repeats_after(self, teeth: int) -> int:
        """Return after how many teeth of so many the flanks repeat; 1 where all are alike."""
        if set(self.tooth_keys) - {"waves"}:
            return teeth
        return math.lcm(1, *(teeth // math.gcd(teeth, wave.count) for wave in self.waves))

    @property
    def mirrored(self) -> bool:
        """Whether both halves of the face are alike."""
        mirrored = self.topography is None or self.topography.mirrored
        even = all(wave.helix_phase_deg == 0.0 for wave in self.waves)
        return mirrored and even and not any(getattr(self, key) for key in UNEVEN)

    def place_of(self, amount: str) -> str | None:
        """Return the key that says how far a relief goes, by the key of its amount; None where none does."""
        return next((key for key in RELIEF_PLACES[amount] if getattr(self, key) is not None), None)

    def changed(self, values: Mapping[str, Any]) -> Modification:
        """Return it with some values changed; keys that said otherwise where a relief starts or ends are left out."""
        return replace(self, **{**dict.fromkeys(other_places(values)), **values})

    @property
    def over_width(self) -> Modification:
        """Terms that vary over the width."""
        return Modification(
            **{key: getattr(self, key) for key in OVER_WIDTH},
            end_relief_length_mm=self.end_relief_length_mm if self.end_relief_um else None,
            topography=None if self.topography is None or self.topography.even else self.topography,
            waves=tuple(wave for wave in self.waves if wave.helix_phase_deg != 0.0),
        )

    @property
    def largest_um(self) -> float:
        """Most that it can deviate on the active flank, or by which teeth can differ."""
        pitch, grid = self.pitch_deviations_um or (0.0,), self.topography.largest_um if self.topography else 0.0
        waves = 2.0 * sum(wave.amplitude_um for wave in self.waves)
        return sum(map(abs, self._amounts)) + grid + max(pitch) - min(pitch) + waves

    @property
    def _amounts(self) -> tuple[float, ...]:
        return tuple(getattr(self, key) for key in AMOUNTS)


UNMODIFIED = Modification()
