"""Flanks as made: the tolerances of a class, and random flanks of gears that use them up.

Source: ISO 1328-1:2013, clause 5: tolerances of class 5, each next class larger by the root of 2.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.gear.modification import Modification, Wave
from pmor.gear.pair import GearPair
from pmor.gear.tooth import Tooth
from pmor.gear.topography import Topography

# Class to which the tolerances are given.
BASIC_GRADE = 5
# Rounds in which the shares of both parts of pitch deviations are found; they converge by a factor of 3 each.
ROUNDS = 60
# Points along a profile or over a face at which form is read.
POINTS = 65


class FlankTolerances(NamedTuple):
    """Largest deviations of the flanks of a gear, um.

    Attributes
    ----------
    single_pitch, total_pitch : float
        f_pT, of each pitch, and F_pT, of the sums of pitches, along the reference circle.
    profile_slope, profile_form, helix_slope, helix_form : float
        f_HalphaT, f_falphaT, f_HbetaT, f_fbetaT.
    """

    single_pitch: float
    total_pitch: float
    profile_slope: float
    profile_form: float
    helix_slope: float
    helix_form: float


def flank_tolerances(module: float, diameter: float, face_width: float, grade: int) -> FlankTolerances:
    """Return the tolerances of a flank tolerance class, not rounded, um: ISO 1328-1:2013, 5.3.

    Parameters
    ----------
    module, diameter, face_width : float
        Normal module, reference diameter and face width, mm.
    grade : int
        Flank tolerance class, 1 to 11.
    """
    m, d, root, broad = module, diameter, math.sqrt(diameter), math.sqrt(face_width)
    basic = (
        0.001 * d + 0.4 * m + 5.0, 0.002 * d + 0.55 * root + 0.7 * m + 12.0, 0.4 * m + 0.001 * d + 4.0, 0.55 * m + 5.0,
        0.05 * root + 0.35 * broad + 4.0, 0.07 * root + 0.45 * broad + 4.0,
    )  # fmt: skip
    return FlankTolerances(*(math.sqrt(2.0) ** (grade - BASIC_GRADE) * value for value in basic))


@dataclass(frozen=True)
class NominalFlank:
    """A flank that is made: its tooth, roll angles of its active profile, rad, its face width, mm."""

    tooth: Tooth
    active: tuple[float, float]
    face_width: float

    @property
    def teeth(self) -> int:
        """Number of teeth."""
        return abs(self.tooth.teeth)

    def tolerances(self, grade: int) -> FlankTolerances:
        """Tolerances of a class, um."""
        return flank_tolerances(self.tooth.module, 2.0 * abs(self.tooth.reference_radius), self.face_width, grade)


def nominal_flanks(pair: GearPair) -> tuple[NominalFlank, NominalFlank]:
    """Return the flanks of both gears that mesh."""
    pinion, wheel = (
        NominalFlank(tooth, active, face[1] - face[0])
        for tooth, active, face in zip((pair.pinion, pair.wheel), pair.active_rolls, pair.faces, strict=True)
    )
    return pinion, wheel


@dataclass(frozen=True)
class MadeFlank:
    """Deviations of the flanks of one gear.

    Parameters
    ----------
    pitch_um, profile_slope_um, helix_slope_um : ndarray, shape (teeth,)
        Of each tooth: its place, counted as `Modification.pitch_deviations_um`, and its slopes.
    waves : tuple of Wave
        Its form.
    """

    pitch_um: FloatArray
    profile_slope_um: FloatArray
    helix_slope_um: FloatArray
    waves: tuple[Wave, ...]

    @property
    def reversed(self) -> MadeFlank:
        """Its teeth in the opposite order, the first one first."""
        pitch, profile, helix = (
            np.roll(values[::-1], 1) for values in (self.pitch_um, self.profile_slope_um, self.helix_slope_um)
        )
        return MadeFlank(pitch, profile, helix, self.waves)

    def errors(self) -> dict[str, float]:
        """Return all numbers by keys of a table."""
        of_teeth = {"pitch_deviations_um": self.pitch_um, "profile_slope_um": self.profile_slope_um,
                    "helix_slope_um": self.helix_slope_um}  # fmt: skip
        found = {f"{key}_{tooth}": float(v) for key, own in of_teeth.items() for tooth, v in enumerate(own, start=1)}
        for wave in self.waves:
            found |= {f"wave_{wave.count}_{key}": getattr(wave, key)
                      for key in ("amplitude_um", "phase_deg", "helix_phase_deg")}  # fmt: skip
        return found


def draw_flank(
    flank: NominalFlank, grade: int, waves_per_pitch: Sequence[float], rng: np.random.Generator
) -> MadeFlank:
    """Draw the flanks of a gear that has the largest deviations of its class, each in a random pattern.

    Pitch deviations are one wave around the gear and one number for each tooth, together as large as f_pT and F_pT
    allow; slopes of the tooth with the largest one are f_HalphaT and f_HbetaT. Form is a sum of waves of one amplitude,
    their phases random: as large as both f_falphaT and f_fbetaT allow.

    Parameters
    ----------
    waves_per_pitch : sequence of float
        Waves to a pitch of the gear, of which whole numbers around it are taken; empty: no deviation of form.
    """
    allowed = flank.tolerances(grade)
    # Of the reference circle, and deviations count along the line of action.
    pitch = math.cos(flank.tooth.transverse_pressure_angle) * _pitches(flank.teeth, allowed, rng)
    profile, helix = (
        _scaled(rng.standard_normal(flank.teeth), most) for most in (allowed.profile_slope, allowed.helix_slope)
    )
    counts = dict.fromkeys(max(round(per_pitch * flank.teeth), 1) for per_pitch in waves_per_pitch)
    shape = [
        Wave(count=count, amplitude_um=1.0, phase_deg=float(phase), helix_phase_deg=float(along))
        for count, (phase, along) in zip(counts, rng.uniform(-360.0, 360.0, (len(counts), 2)), strict=True)
    ]
    limits = zip((allowed.profile_form, allowed.helix_form), form_um(flank, shape), strict=True)
    most = min((limit / own for limit, own in limits if own > 0.0), default=0.0)
    return MadeFlank(pitch, profile, helix, tuple(replace(wave, amplitude_um=float(most)) for wave in shape))


def form_um(flank: NominalFlank, waves: Sequence[Wave]) -> tuple[float, float]:
    """Return the deviations of form of waves, f_falpha at mid width and f_fbeta at mid profile, of the worst tooth, um.

    From crest to valley about the straight line of least squares.
    """
    (start, end), teeth = flank.active, np.arange(flank.teeth)[:, None]
    way = np.linspace(-0.5, 0.5, POINTS)

    def largest(u: FloatArray, z: FloatArray) -> float:
        found = np.zeros((flank.teeth, POINTS))
        for wave in waves:
            psi = u - teeth * flank.tooth.angular_pitch
            phase = np.radians(wave.phase_deg + wave.helix_phase_deg * z)
            found += wave.amplitude_um * np.cos(wave.count * psi + phase)
        level, slope = found.mean(axis=1), found @ way / (way @ way)
        return float(np.ptp(found - level[:, None] - slope[:, None] * way, axis=1).max())

    middle = np.zeros(POINTS)
    return largest(0.5 * (start + end) + (end - start) * way, middle), largest(middle + 0.5 * (start + end), way)


def with_made(modification: Modification, made: MadeFlank, flank: NominalFlank) -> Modification:
    """Return the flanks of a case with those deviations on top; topographies keep their points."""
    (start, end), half = flank.active, 0.5 * flank.face_width
    # Slopes go on beyond the active profile.
    beyond = sorted((2.0 * start - end, 2.0 * end - start))
    none = ((0.0, 0.0), (0.0, 0.0))
    grid = modification.topography or Topography(tuple(np.degrees(beyond).tolist()), (-half, half), none)
    along = (np.radians(grid.roll_deg) - 0.5 * (start + end)) / (end - start)
    across = np.array(grid.z_mm) / flank.face_width
    own = np.resize(np.array(grid.grids_um), (flank.teeth, len(along), len(across)))
    slopes = made.profile_slope_um[:, None, None] * along[:, None] + made.helix_slope_um[:, None, None] * across
    teeth = tuple(tuple(map(tuple, rows)) for rows in (own + slopes).tolist())
    given = np.array(modification.pitch_deviations_um or (0.0,) * flank.teeth)
    return replace(
        modification, pitch_deviations_um=tuple((given + made.pitch_um).tolist()),
        waves=modification.waves + made.waves, topography=replace(grid, amount_um=teeth[0], teeth_um=teeth),
    )  # fmt: skip


def _pitches(teeth: int, allowed: FlankTolerances, rng: np.random.Generator) -> FloatArray:
    """Places of teeth about a wave around the gear, um."""
    lap = np.cos(2.0 * np.pi * np.arange(teeth) / teeth + rng.uniform(0.0, 2.0 * np.pi))
    own, found = rng.standard_normal(teeth), np.zeros(teeth)
    for _ in range(ROUNDS):
        found = lap + own
        lap *= allowed.total_pitch / np.ptp(found)
        own *= allowed.single_pitch / np.abs(found - np.roll(found, 1)).max()
    # Of few teeth the wave alone takes up single pitches: the total stays below its limit.
    found = lap + own
    single, total = np.abs(found - np.roll(found, 1)).max(), np.ptp(found)
    return np.asarray(found * min(allowed.single_pitch / single, allowed.total_pitch / total))


def _scaled(values: FloatArray, largest: float) -> FloatArray:
    return np.asarray(values * (largest / np.abs(values).max()))
