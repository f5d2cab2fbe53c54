"""Keys of machines in motion that gearboxes and planetary sets have in common."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Annotated, Literal, NoReturn

import numpy as np

from pmor.core import ranges
from pmor.core.arrays import FloatArray
from pmor.gear.inertia import Inertia

InertiaValue = Annotated[float, ranges.Range(0.0, 1e12, "kg m2")]
# Lowest and highest speed over the largest of the loads, where no range is given.
USUAL_RANGE = 0.02, 1.2


@dataclass(frozen=True, kw_only=True)
class Body:
    """A rigid body that moves with a shaft or a member.

    Parameters
    ----------
    mass_kg : float
        Its mass.
    polar_inertia_kg_m2, tilting_inertia_kg_m2 : float
        About the axis, and about an axis across it through its middle.
    """

    mass_kg: Annotated[float, ranges.Range(0.0, 1e9, "kg")] = 0.0
    polar_inertia_kg_m2: InertiaValue = 0.0
    tilting_inertia_kg_m2: InertiaValue = 0.0

    @property
    def inertia(self) -> Inertia:
        """All of it."""
        return Inertia(self.mass_kg, self.polar_inertia_kg_m2, self.tilting_inertia_kg_m2)


@dataclass(frozen=True, kw_only=True)
class Motion:
    """A gearbox or a planetary set in motion (section `[dynamics]`, of `pmor dynamics`).

    Parameters
    ----------
    speed_range_rpm : (float, float) or None
        Lowest and highest speed of the shaft of the first torque, of a set of the member that the torque is on,
        whichever way it turns. Without it from a fiftieth to six fifths of the largest `speed_rpm` of the loads.
    speeds : int
        Number of speeds, evenly spaced.
    harmonics : int
        Harmonics of each mesh that are told, of a set of the sun's.
    highest_frequency_Hz : float
        Lines above it are left out; shafts bend as they do up to there, and modes go to twice as much.
    damping_ratio : float
        Damping ratio of each mode. Peaks are inverse to it, and no calculation gives it; gearboxes are found between
        0.01 and 0.07.
    mesh_stiffness : {"varying", "mean"}
        "varying" over the mesh cycle; "mean" is the usual simplification, which stands beside it anyway.
    motion : {"linear", "nonlinear"}
        "linear": small motion, flanks stay in contact. "nonlinear", of gearboxes: besides, motion of flanks that part,
        of meshes of two gears whose least force is not above zero in the linear answer.
    loads : tuple of str
        Names of the loads about which motion is found, of a set its torques as in "100 N m"; all without it.
    """

    speed_range_rpm: Annotated[tuple[float, ...], ranges.Range(1e-3, 1e7, "rpm", in_order=True)] | None = None
    speeds: Annotated[int, ranges.Range(2, 100_000)] = 400
    harmonics: Annotated[int, ranges.Range(1, 20)] = 6
    highest_frequency_Hz: Annotated[float, ranges.Range(1.0, 1e5, "Hz")] = 10_000.0
    damping_ratio: Annotated[float, ranges.Range(0.0, 0.5, low_excluded=True)] = 0.02
    mesh_stiffness: Literal["varying", "mean"] = "varying"
    motion: Literal["linear", "nonlinear"] = "linear"
    loads: tuple[str, ...] = ()

    def over(self, speeds_rpm: Iterable[float | None]) -> FloatArray | None:
        """Return the speeds that are asked for, rpm; None where neither `[dynamics]` nor a load says any."""
        largest = max((abs(speed or 0.0) for speed in speeds_rpm), default=0.0)
        if self.speed_range_rpm is None and not largest:
            return None
        low, high = self.speed_range_rpm or (USUAL_RANGE[0] * largest, USUAL_RANGE[1] * largest)
        return np.linspace(low, high, self.speeds)


# What polar inertia may be above twice the tilting one: digits of data sheets.
ROUNDED = 0.01


def check_bodies(bodies: Iterable[tuple[str, Inertia]], refuse: Callable[[str, str], NoReturn]) -> None:
    """Refuse bodies by their places whose polar inertia is above that of a thin disc."""
    for place, inertia in bodies:
        polar, tilting = inertia.polar_kg_m2, inertia.tilting_kg_m2
        if polar > 2.0 * (1.0 + ROUNDED) * tilting:
            refuse(
                f"{place}: polar_inertia_kg_m2 = {polar:g}",
                f"must be at most twice tilting_inertia_kg_m2, {tilting:g}, as no body has more and a thin disc so "
                f"much: give tilting_inertia_kg_m2, of a thin disc {0.5 * polar:g}",
            )


def check_motion(said: Motion, refuse: Callable[[str, str], NoReturn]) -> None:
    """Refuse a range of speeds without two ends."""
    limits = said.speed_range_rpm
    if limits is not None and (len(limits) != 2 or limits[0] >= limits[1]):
        rule = "must be the lowest and the highest speed: write both, as in [100.0, 3000.0]"
        refuse(f"[dynamics] speed_range_rpm = {list(limits)}", rule)
