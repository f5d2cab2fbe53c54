"""Contact pressure on the unrolled pinion flank at one position."""

from __future__ import annotations

import math

import numpy as np

from online.model import ReducedPair
from pmor.contact.solve import solve_position
from pmor.gear.conventions import FloatArray

Pattern = tuple[str, FloatArray, FloatArray, FloatArray]


def contact_patterns(reduced: ReducedPair, phi: float, torque: float) -> list[Pattern]:
    """Return the pressure of each loaded tooth pair on the pinion's active patches.

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
    roll, z = _points(meshed.pinion.roll_angle, scheme.lodm_profile), _points(
        meshed.pinion.nodes[0, :, 2], scheme.lodm_width
    )
    for p, index in enumerate(position.pair_index):
        mine = contact.pair == p
        if not mine.any():
            continue
        first = position.first_row[p, 0] * scheme.lodm_profile
        rows = first + np.arange(position.windows[p, 0, 3] * scheme.lodm_profile + 1)
        pressure = np.zeros((len(rows), len(z)))
        pressure[contact.place[mine, 0], contact.place[mine, 1]] = -scheme.penalty * contact.gap[mine]
        share = equilibrium.pair_torque(len(position.pair_index))[p] / torque
        place = math.degrees(phi + index * meshed.pair.pitch)
        title = f"Tooth pair at roll position {place:.1f}°, {100 * share:.0f} % of the torque"
        patterns.append((title, np.degrees(roll[rows]), z, pressure))
    return patterns


def _points(nodes: FloatArray, subdivisions: int) -> FloatArray:
    """Positions of the refined points between nodes."""
    return np.interp(np.arange((len(nodes) - 1) * subdivisions + 1) / subdivisions, np.arange(len(nodes)), nodes)
