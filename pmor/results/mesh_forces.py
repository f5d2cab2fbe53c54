r"""Forces and moments that the mesh exerts on each gear, for its shaft and bearings.

A section's force F along the transverse line of action acts on the wheel in the transverse direction d and on the
pinion against it. Its levers about both axes, m_1 and m_2, tell the direction: with the wheel's axis at (0, a),
m_2 = m_1 + a d_x. So the forces are those of equilibrium to the last digit, at tip corners too, which do not act along
the line of action. On helical flanks there is an axial part: a screw motion along the pinion's own helix, tau of
rotation per length, opens no gap and does no work, so that F_z = -tau M_z; it is F_t tan(beta).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.shown import brief
from pmor.results.loads import ContactLoads


@brief
@dataclass(frozen=True, eq=False)
class MeshForces:
    """Force of the mesh on each gear and its moment about the point of that gear's axis at mid width of the pair.

    Bearings and shafts exert the opposite; the moment about the axis is the torque. Axes: x and y across, the wheel's
    axis at +y, z along the axes; frames do not turn with the gears.

    Attributes
    ----------
    force_N : (n_torques, n_angles, 2, 3)
        On pinion and wheel; along x, y, z.
    moment_Nm : (n_torques, n_angles, 2, 3)
    """

    force_N: FloatArray
    moment_Nm: FloatArray


def mesh_forces(
    loads: ContactLoads, mirrored: bool, base_radius_mm: float, centre_distance_mm: float, twist_rad_per_mm: float
) -> MeshForces:
    """Add up the line loads of each state.

    Parameters
    ----------
    loads : ContactLoads
        Of line contact.
    mirrored : bool
        Whether each stands for its mirror image too.
    base_radius_mm : float
        Of the pinion.
    centre_distance_mm : float
        Axes that are tilted by some micrometres are taken for parallel.
    twist_rad_per_mm : float
        Of the pinion: tan(beta_b) / r_b.
    """
    force, about_pinion = loads.force_N, -loads.lever_mm
    turned = force * about_pinion
    d_x = -(loads.mate_lever_mm + about_pinion) / centre_distance_mm
    d_y = np.sqrt(np.maximum(1.0 - d_x**2, 0.0))
    # From the foot of the perpendicular to the contact, which is at the pinion's radius of its roll angle.
    radius_squared = base_radius_mm**2 * (1.0 + loads.roll_rad[:, 0] ** 2)
    along = np.sqrt(np.maximum(radius_squared - about_pinion**2, 0.0))
    x, y = about_pinion * d_y + along * d_x, along * d_y - about_pinion * d_x
    # Images at -z take each other's moments across the axis away.
    z = 0.0 if mirrored else loads.z_mm
    f_x, f_y, f_z = -force * d_x, -force * d_y, twist_rad_per_mm * turned
    total = _of_states(loads, f_x, f_y, f_z)
    moment = _of_states(loads, y * f_z - z * f_y, z * f_x - x * f_z, -turned)
    on_wheel = np.cross([0.0, centre_distance_mm, 0.0], total) - moment
    return MeshForces(np.stack([total, -total], axis=2), 1e-3 * np.stack([moment, on_wheel], axis=2))


def _of_states(loads: ContactLoads, *components: FloatArray) -> FloatArray:
    """Sums over the points of each state, components along a last axis."""
    count = loads.count.size
    state = np.repeat(np.arange(count), loads.count.ravel())
    sums = np.stack([np.bincount(state, part, count) for part in components], axis=-1)
    return np.asarray(sums.reshape(*loads.count.shape, len(components)), dtype=float)
