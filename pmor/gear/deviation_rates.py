"""How much the deviation of the flanks changes at each section by each parameter of a modification."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any, Protocol

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.gear.condition import Assembly
from pmor.gear.kernels.deviation import Deviation, deviations_at
from pmor.gear.meshed_pair import MeshedPair
from pmor.gear.modification import AMOUNTS, OVER_WIDTH, RELIEF_PLACES, UNEVEN, Modification
from pmor.gear.profile import profiles


class SectionStates(Protocol):
    """Attributes that `deviation_rates` needs of states of line contact, such as `pmor.results.loads.LineStates`."""

    @property
    def pair(self) -> IntArray: ...  # noqa: D102

    @property
    def z_mm(self) -> FloatArray: ...  # noqa: D102

    @property
    def mirrored(self) -> bool: ...  # noqa: D102

    @property
    def roll_rad(self) -> FloatArray: ...  # noqa: D102

    @property
    def sensitivity(self) -> FloatArray: ...  # noqa: D102


def deviation_rates(
    meshed: MeshedPair, assembly: Assembly, lines: SectionStates, over_width: bool = True, wanted: Collection[str] = ()
) -> dict[str, FloatArray]:
    """Return d deviation / d parameter at all sections, (A, P, S), um per unit, by ``gear.key`` of the case file.

    All amounts that the pair can be built with are included, also those that are 0. Tip, root and end relief are
    included where the case gives their extent. Pitch deviations, waves and topographies are not;
    `LineStates.sensitivity` serves for them.

    Parameters
    ----------
    assembly : Assembly
        The modifications about which to differentiate.
    lines : SectionStates
        Where the sections are.
    over_width : bool
        Whether the mesh holds what differs over the width: not so in plane strain.
    wanted : collection of str
        Parameters to find, by name; empty: all.
    """
    absent = (UNEVEN if lines.mirrored else ()) if over_width else OVER_WIDTH
    by_parameter = {}
    loaded = (lines.sensitivity != 0.0).any(axis=0)
    for gear, (name, deviation, modification) in enumerate(
        zip(("pinion", "wheel"), meshed.deviations(assembly), (assembly.pinion, assembly.wheel), strict=True)
    ):
        points, profile = _points(lines, loaded, gear), profiles(meshed.pair)[gear]
        for key in AMOUNTS:
            extent = _extent(modification, key)
            if key in absent or (extent is None and key in ("end_relief_um", *RELIEF_PLACES)):
                continue
            if not wanted or f"{name}.{key}" in wanted:
                by_parameter[f"{name}.{key}"] = _spread(loaded, _unit(deviation, key, points))
            if extent is None or (wanted and f"{name}.{extent}" not in wanted):
                continue
            if getattr(modification, key) != 0.0:
                rates = _by_extent(deviation, key, points)
                if key in RELIEF_PLACES:
                    rates = rates * profile.roll_rate(RELIEF_PLACES[key][extent], getattr(modification, extent))
                by_parameter[f"{name}.{extent}"] = _spread(loaded, rates)
    return by_parameter


_Points = tuple[FloatArray, FloatArray, np.ndarray]


def _points(lines: SectionStates, loaded: np.ndarray, gear: int) -> _Points:
    """Roll angles, places and teeth of those sections that ever carry."""
    shape = lines.roll_rad.shape[:3]
    z, pair = np.broadcast_to(lines.z_mm, shape), np.broadcast_to(lines.pair[:, :, None], shape)
    # The wheel's teeth count against the pinion's.
    return lines.roll_rad[..., gear][loaded], z[loaded], (pair if gear == 0 else -pair)[loaded]


def _unit(deviation: Deviation, key: str, points: _Points) -> FloatArray:
    """Deviation by one amount of 1 and nothing else: um/um."""
    none, out = np.empty(0), np.empty(len(points[0]))
    amounts: dict[str, Any] = {name.removesuffix("_um"): float(name == key) for name in AMOUNTS}
    nowhere = {"pitch": none, "waves": np.empty((0, 4)), "grid_roll": none, "grid_z": none,
               "grid": np.empty((0, 0, 0, 4))}  # fmt: skip
    deviations_at(deviation._replace(**{"present": True, **nowhere, **amounts}), *points, out)
    return out


def _extent(modification: Modification, amount: str) -> str | None:
    """Key that says how far an amount goes; None of those that need none, or have none."""
    if amount in RELIEF_PLACES:
        return modification.place_of(amount)
    known = amount == "end_relief_um" and modification.end_relief_length_mm is not None
    return "end_relief_length_mm" if known else None


def _by_extent(deviation: Deviation, key: str, points: _Points) -> FloatArray:
    """Derivative by the roll angle at which a relief starts or ends, um/rad, or by the length of an end relief, um/mm.

    Of E x or E x^2, x = (u - s) / (t - s), it is that by x times dx/ds = -(1 - x) / (t - s).
    """
    d, (roll, z, _) = deviation, points
    if key == "end_relief_um":
        inwards = 0.5 * d.width - np.abs(z - d.middle_z)
        return np.where(inwards < d.end_relief_length, 1e3 * d.end_relief * inwards / d.end_relief_length**2, 0.0)
    if key == "tip_relief_um":
        way, amount, parabolic = (roll - d.tip_relief_start) / d.tip_relief_span, -d.tip_relief, d.tip_relief_parabolic
        span = d.tip_relief_span
    else:
        way, amount, parabolic = (d.root_relief_end - roll) / d.root_relief_span, d.root_relief, d.root_relief_parabolic
        span = d.root_relief_span
    slope = 1e3 * amount * (2.0 * way if parabolic else 1.0) * (1.0 - way) / span
    return np.asarray(np.where(way > 0.0, slope, 0.0))


def _spread(loaded: np.ndarray, values: FloatArray) -> FloatArray:
    whole = np.zeros(loaded.shape)
    whole[loaded] = values
    return whole
