"""Contact pressure on unrolled flanks at one position."""

from __future__ import annotations

import numpy as np

from online.model import ReducedPair
from pmor.contact.solve import solve_position
from pmor.gear.conventions import FloatArray

Pattern = tuple[str, FloatArray, FloatArray, FloatArray]


def contact_patterns(reduced: ReducedPair, phi: float, torque: float) -> list[Pattern]:
    """Return the pressure of each loaded tooth pair on the active patches of the gear whose points carry it.

    Parameters
    ----------
    reduced : ReducedPair
    phi : float
        Pinion angle, rad.
    torque : float
        N mm.

    Returns
    -------
    list of (title, roll angle in deg (n,), width in mm (m,), pressure in MPa (n, m))
        Empty when the position does not converge.
    """
    meshed, scheme = reduced.meshed, reduced.meshed.scheme
    solved = solve_position(meshed, phi, [torque], reduced.elasticity_at)
    equilibrium, position = solved.equilibria[0], solved.position
    if equilibrium is None:
        return []
    contact, patterns = equilibrium.contact, []
    torques = equilibrium.pair_torque(len(position.pair_index))
    for p in range(len(position.pair_index)):
        pinion_points = np.count_nonzero((contact.pair == p) & (contact.slave == 0))
        slave = 0 if pinion_points >= np.count_nonzero((contact.pair == p) & (contact.slave == 1)) else 1
        mine = (contact.pair == p) & (contact.slave == slave)
        if not mine.any():
            continue
        flank = (meshed.pinion, meshed.wheel)[slave]
        roll, z = _points(flank.roll_angle, scheme.lodm_profile), _points(flank.nodes[0, :, 2], scheme.lodm_width)
        first = position.first_row[p, slave] * scheme.lodm_profile
        rows = first + np.arange(position.windows[p, slave, 3] * scheme.lodm_profile + 1)
        pressure = np.zeros((len(rows), len(z)))
        pressure[contact.place[mine, 0], contact.place[mine, 1]] = -scheme.penalty * contact.gap[mine]
        if meshed.mirrored:
            z, pressure = np.append(z, -z[-2::-1]), np.append(pressure, pressure[:, -2::-1], axis=1)
        title = f"{('Pinion', 'Wheel')[slave]} flank, {100 * torques[p] / torque:.0f} % of torque"
        patterns.append((title, np.degrees(roll[rows]), z, pressure))
    return patterns


def _points(nodes: FloatArray, subdivisions: int) -> FloatArray:
    """Positions of the refined points between nodes."""
    return np.interp(np.arange((len(nodes) - 1) * subdivisions + 1) / subdivisions, np.arange(len(nodes)), nodes)
