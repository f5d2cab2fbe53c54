"""From a gear's modification, as in a case file, to the deviation that kernels evaluate."""

from __future__ import annotations

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.gear.kernels.deviation import Deviation
from pmor.gear.modification import AMOUNTS, Modification, Wave
from pmor.gear.profile import Profile
from pmor.gear.tooth import Tooth
from pmor.gear.topography import Topography

MICROMETRE = 1e-3


def kernel_deviation(
    modification: Modification, tooth: Tooth, active: tuple[float, float], face: tuple[float, float]
) -> Deviation:
    """Return a gear's modification in the form that kernels evaluate.

    Parameters
    ----------
    modification : Modification
        Checked (`pmor.pair.modifications`).
    tooth : Tooth
        Of that gear.
    active : float, float
        Roll angles at which its active profile starts and ends, rad (`pmor.gear.pair.GearPair.active_rolls`).
    face : float, float
        Where its face begins and ends along z, from mid width of the pair, mm.
    """
    m, (start, end), tip = modification, active, tooth.tip_roll_angle
    profile = Profile(tooth.base_radius, start, end, tip)
    tip_start, root_end = (profile.relief_roll(m, amount) for amount in ("tip_relief_um", "root_relief_um"))
    tip_start = tip - 1.0 if tip_start is None else tip_start
    root_end = start + 1.0 if root_end is None else root_end
    grid_roll, grid_z, grid = _grid(m.topography)
    return Deviation(
        present=m.present,
        middle_roll=0.5 * (start + end),
        roll_span=end - start,
        middle_z=0.5 * (face[0] + face[1]),
        width=face[1] - face[0],
        **{key.removesuffix("_um"): MICROMETRE * getattr(m, key) for key in AMOUNTS},
        tip_relief_start=tip_start,
        tip_relief_span=tip - tip_start,
        tip_relief_parabolic=m.tip_relief_shape == "parabolic",
        root_relief_end=root_end,
        root_relief_span=root_end - start,
        root_relief_parabolic=m.root_relief_shape == "parabolic",
        end_relief_length=1.0 if m.end_relief_length_mm is None else m.end_relief_length_mm,
        pitch=_pitch(m.pitch_deviations_um),
        angular_pitch=tooth.angular_pitch,
        waves=_waves(m.waves, face[1] - face[0]),
        grid_roll=grid_roll,
        grid_z=grid_z,
        grid=grid,
    )


def _pitch(deviations_um: tuple[float, ...]) -> FloatArray:
    if not any(deviations_um):
        return np.empty(0)
    deviations = np.array(deviations_um)
    return np.asarray(MICROMETRE * (deviations - np.median(deviations)))


def _waves(waves: tuple[Wave, ...], width: float) -> FloatArray:
    rows = [
        (wave.count, MICROMETRE * wave.amplitude_um, *np.radians([wave.phase_deg, wave.helix_phase_deg / width]))
        for wave in waves
    ]
    return np.array(rows, dtype=float).reshape(-1, 4)


def _grid(topography: Topography | None) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Points of a topography, and there its amounts and their slopes, along both directions and mixed."""
    if topography is None:
        return np.empty(0), np.empty(0), np.empty((0, 0, 0, 4))
    roll, z = np.radians(topography.roll_deg), np.array(topography.z_mm)
    amount = MICROMETRE * np.array(topography.grids_um)
    along_roll, along_z = _slopes(roll), _slopes(z)
    layers = amount, along_roll @ amount, amount @ along_z.T, along_roll @ amount @ along_z.T
    return roll, z, np.ascontiguousarray(np.stack(layers, axis=-1))


def _slopes(grid: FloatArray) -> FloatArray:
    """Matrix that gives slopes at the points of a grid.

    Inside, that from neighbour to neighbour: on even grids the slope of the parabola through three points, and on
    uneven ones no swing grows with their unevenness, as the parabola's does. At the ends, the slope of the parabola
    that has the end's secant and its neighbour's slope.
    """
    n = len(grid)
    matrix, inner = np.zeros((n, n)), np.arange(1, n - 1)
    span = grid[2:] - grid[:-2]
    matrix[inner, inner + 1], matrix[inner, inner - 1] = 1.0 / span, -1.0 / span
    for end, inside in ((0, 1), (n - 1, n - 2)):
        secant = np.zeros(n)
        secant[[end, inside]] = np.array([1.0, -1.0]) / (grid[end] - grid[inside])
        matrix[end] = secant if n == 2 else 2.0 * secant - matrix[inside]
    return matrix
