"""What each point of a flank sees while it rolls through the mesh: the largest over the cycle.

A section touches each roll angle once in a cycle. What it carries there is known at the positions of the sweep and is
interpolated between them; the largest of the positions themselves stays in the cell that it is in.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pmor.arrays import FloatArray
from pmor.results.load_distribution import line_states, over_the_whole_face
from pmor.results.sweep import SteSweep

# Roll angles at which a flank is looked at, from one end of its active profile to the other.
PROFILE_POINTS = 101


@dataclass(frozen=True)
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
    """Return what a gear's flank sees at one of the torques of a recorded sweep.

    Parameters
    ----------
    sweep : SteSweep
        Over one pitch or several; of several, whose teeth may differ, the largest.
    torque_index : int
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
    pitch = np.floor((sweep.phi_rad - sweep.phi_rad[0]) / sweep.pitch_rad + 1e-9)
    for number in np.unique(pitch):
        part = pitch == number
        seen = _seen(roll, lines.roll_rad[part, ..., gear], values[:, part])
        with np.errstate(invalid="ignore"):  # NaN is kept
            largest = np.maximum(largest, seen)
    z, whole = over_the_whole_face(lines, largest)
    return FlankMap(gear, float(sweep.torque_Nm[d]), roll, z, *whole)


def _seen(roll: FloatArray, at: FloatArray, values: FloatArray) -> FloatArray:
    """Values (3, R, S) at roll angles from those (3, A, P, S) of sections that meet at others (A, P, S)."""
    found = np.zeros((len(values), len(roll), at.shape[2]))
    step = roll[1] - roll[0]
    for section in range(at.shape[2]):
        u, of_section = at[..., section].ravel(), values[..., section].reshape(len(values), -1)
        order = np.argsort(u, kind="stable")
        cell = np.rint((u - roll[0]) / step).astype(int)
        inside = (cell >= 0) & (cell < len(roll)) & (of_section[0] > 0.0)
        for k, row in enumerate(of_section):
            found[k, :, section] = np.interp(roll, u[order], row[order])
            with np.errstate(invalid="ignore"):  # NaN is kept
                np.maximum.at(found[k, :, section], cell[inside], row[inside])
    return found
