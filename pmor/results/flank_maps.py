"""Largest values at each point of a flank over the mesh cycle.

As a tooth pair rolls on, each of its sections moves over the flanks: up the pinion's and down the wheel's, but for tip
corners, which meet the mate's flank twice. The path of a section is followed in steps shorter than a cell of the map,
straight between the positions of the sweep, and each cell keeps the largest value.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pmor.core.arrays import BoolArray, FloatArray
from pmor.core.shown import brief
from pmor.results.load_distribution import line_states, over_the_whole_face
from pmor.results.sweep import SteSweep

# Roll angles at which a flank is looked at, from one end of its active profile to the other.
PROFILE_POINTS = 101


@brief
@dataclass(frozen=True, eq=False)
class FlankMap:
    """Largest values over the mesh cycle on a gear's active flank, R roll angles x Z places over the face.

    Attributes
    ----------
    gear : int
        0 pinion, 1 wheel.
    torque_Nm : float
        On the pinion.
    roll_rad : (R,)
        From the start of the active profile to its end.
    z_mm : (Z,)
        Over the common face, from mid width.
    load_N_per_mm, half_width_mm, pressure_MPa : (R, Z)
        Line load, half-width of contact, largest pressure; 0 where the flank is not touched. The pressure is NaN where
        a sharp edge, its own or the mate's, is in contact: it has no bound there.
    """

    gear: int
    torque_Nm: float
    roll_rad: FloatArray
    z_mm: FloatArray
    load_N_per_mm: FloatArray
    half_width_mm: FloatArray
    pressure_MPa: FloatArray

    @property
    def contact_share(self) -> float:
        """Share of the active flank that is touched, by arc length and width."""
        # The arc of an involute grows with the square of the roll angle.
        area = np.outer(np.diff(cell_edges(self.roll_rad**2)), np.diff(cell_edges(self.z_mm)))
        return float(area[self.load_N_per_mm > 0.0].sum() / area.sum())


def cell_edges(points: FloatArray) -> FloatArray:
    """Return the edges (n + 1,) of cells about points (n,): halfway between neighbours, and the outer points."""
    if len(points) == 1:
        return np.array([points[0] - 0.5, points[0] + 0.5])
    return np.concatenate([points[:1], 0.5 * (points[1:] + points[:-1]), points[-1:]])


def flank_map(
    sweep: SteSweep, torque_index: int, gear: int, active_rad: tuple[float, float], points: int = PROFILE_POINTS
) -> FlankMap:
    """Return the largest values over a gear's flank at one torque of a recorded sweep.

    Parameters
    ----------
    sweep : SteSweep
        Over one pitch or several; of several, whose teeth may differ, the largest.
    gear : int
        0 pinion, 1 wheel.
    active_rad : float, float
        Roll angles at which its active profile starts and ends.
    points : int
        Over the profile.
    """
    lines, d = line_states(sweep), torque_index
    roll = np.linspace(*active_rad, points)
    values = np.stack([lines.load_N_per_mm[d], lines.half_width_mm[d], lines.pressure_MPa[d]])
    values = np.where(sweep.converged[d][:, None, None], values, 0.0)
    largest = np.zeros((3, points, len(lines.z_mm)))
    # As the sweep goes on, a pair that has left its end comes in again at its start, so many pitches on.
    tooth = (lines.pair % sweep.pitches).ravel()
    way = np.lexsort(((sweep.phi_rad[:, None] + lines.pair * sweep.pitch_rad).ravel(), tooth))
    at = lines.roll_rad[..., gear].reshape(len(way), -1)[way]
    _follow(roll, at, values.reshape(3, len(way), -1)[:, way], np.diff(tooth[way]) == 0, largest)
    z, whole = over_the_whole_face(lines, largest)
    return FlankMap(gear, float(sweep.torque_Nm[d]), roll, z, *whole)


def _follow(roll: FloatArray, at: FloatArray, values: FloatArray, joined: BoolArray, largest: FloatArray) -> None:
    """Take values (3, n, S) at roll angles (n, S) into the cells (3, R, S) of a map.

    They are met one after the other, as far as neighbours are `joined`, (n - 1,).
    """
    step, loaded = roll[1] - roll[0], values[0] > 0.0
    moved = np.diff(at, axis=0)[joined]
    near = (loaded[1:] | loaded[:-1])[joined]
    if not near.any():
        return
    count = int(np.ceil(np.abs(moved[near]).max() / abs(step))) + 1
    shares = np.arange(count)[:, None, None] / count
    place = at[:-1][joined] + shares * moved
    # From 0 to a value at a sharp edge, which is none, there is no straight line.
    with np.errstate(invalid="ignore"):
        between = values[:, None, :-1][:, :, joined] + shares * np.diff(values, axis=1)[:, None, joined]
        cell = np.rint((place - roll[0]) / step).astype(int)
        inside = (cell >= 0) & (cell < len(roll)) & (between[0] > 0.0)
        _, _, section = np.nonzero(inside)
        for kind in range(len(values)):
            np.maximum.at(largest[kind], (cell[inside], section), between[kind][inside])
