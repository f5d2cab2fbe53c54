"""Where a solved mesh leaves what its equations stand for: flanks that lift off, coast flanks, moved axes, overloads.

Meshes of gearboxes and sets are held against the same bounds; the numbers themselves are results as they are.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from pmor.case import Case
from pmor.core.arrays import FloatArray
from pmor.core.errors import GeometryError
from pmor.gear.clearance import refuse_interference
from pmor.gear.pair import GearPair
from pmor.line.train import smooth_rows
from pmor.pair.limits import PRESSURE_OVER_MODULUS, hertz_pressure

# Share of the mean transmission error that displacements of second order in the tilt of a hub may have.
SECOND_ORDER = 0.01
# Change of the transverse contact ratio by the moved axes: contact points stay where those of the drawing are.
MOVED_PATH = 0.02
ABOUT = slice(3, 5)


class Bound(NamedTuple):
    """What leaves its bounds: of what kind, how large, and the sentence with value and rule."""

    kind: str
    size: float
    text: str


def mesh_bounds(
    case: Case, pair: GearPair, displacement: FloatArray, ste_mean_um: float | None,
    carrying_face_percent: float | None, pressure_MPa: float | None,
) -> Iterator[Bound]:  # fmt: skip
    """Yield what leaves its bounds in a mesh.

    Parameters
    ----------
    displacement : ndarray, shape (n, 2, 6)
        Of the hubs of pinion and wheel from their places in the drawing, rotations included, in axes of the pair, at
        all positions, mm and rad; NaN where not converged.
    ste_mean_um, carrying_face_percent, pressure_MPa : float or None
        Mean transmission error, share of the face that carries anywhere in the mesh cycle, and largest pressure; None
        where not known.
    """
    if carrying_face_percent is not None and carrying_face_percent < 100.0:
        yield Bound(
            "flanks lift off",
            100.0 - carrying_face_percent,
            f"flanks lift off, {carrying_face_percent:.3g} % of the face carries",
        )
    _, modulus = hertz_pressure(case, pair)
    if pressure_MPa is not None and pressure_MPa > PRESSURE_OVER_MODULUS * modulus:
        yield Bound(
            "real flanks yield", pressure_MPa,
            f"flank pressure {pressure_MPa:.4g} MPa is {100.0 * pressure_MPa / modulus:.2g} % of the modulus, above "
            f"{100.0 * PRESSURE_OVER_MODULUS:g} %: real flanks yield",
        )  # fmt: skip
    displacement = displacement[np.isfinite(displacement).all(axis=(-2, -1))]
    if not len(displacement):
        return
    coast = float(coast_gap_um(pair, displacement).min())
    if coast < 0.0:
        yield Bound(
            "coast flanks would overlap", -coast,
            f"coast flanks would overlap by {-coast:.3g} um, and their contact is left out: widen the backlash",
        )  # fmt: skip
    tilt = float(np.abs(displacement[..., ABOUT]).max())
    second = 0.5e3 * max(pair.pinion.tip_radius, abs(pair.wheel.tip_radius)) * tilt**2
    if ste_mean_um is not None and second > SECOND_ORDER * abs(ste_mean_um):
        yield Bound(
            "small angles", second,
            f"small angles: a hub tilts by {1e3 * tilt:.3g} mrad, at the tips {second:.2g} um of second order, more "
            f"than {100.0 * SECOND_ORDER:g} % of the mean transmission error",
        )  # fmt: skip
    moved = displacement[:, 1, 1] - displacement[:, 0, 1]
    apart = float(moved[np.abs(moved).argmax()])
    change = -apart / math.sin(pair.working_pressure_angle) / pair.pinion.base_pitch
    if abs(change) > MOVED_PATH:
        yield Bound(
            "the centre distance changes", abs(change),
            f"the centre distance changes by {math.copysign(1e3, pair.centre_distance) * apart:.3g} um and the contact "
            f"ratio by {change:.2g}, more than {MOVED_PATH:g}: the path of contact is that of the drawing",
        )  # fmt: skip


def coast_gap_um(pair: GearPair, displacement: FloatArray) -> FloatArray:
    """Return the gap of the coast flanks along their line of action at the pitch point, um, without their deflection.

    Parameters
    ----------
    displacement : ndarray, shape (..., 2, 6)
        As in `mesh_bounds`.
    """
    return np.asarray(1e3 * (pair.backlash + (displacement * smooth_rows(pair, coast=True)).sum(axis=(-2, -1))))


def refuse_moved_axes(pair: GearPair, nearest: float, farthest: float, approach_mm: float) -> None:
    """Raise GeometryError where no pair runs at a centre distance to which errors bring its axes, signed, mm.

    Parameters
    ----------
    approach_mm : float
        Of the flanks under load, by which those that do not carry part.
    """
    parted = 0.5 * approach_mm / math.sin(pair.working_pressure_angle)
    for moved in (nearest, farthest):
        distance = max(moved, min(moved + parted, pair.centre_distance))
        try:
            refuse_interference(replace(pair, centre_distance=distance))
        except GeometryError as error:
            raise GeometryError(f"{abs(moved):.6g} mm, at which no pair runs ({error})") from None
