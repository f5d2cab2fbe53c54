"""Contact pressure on unrolled flanks at one position."""

from __future__ import annotations

import numpy as np
from pmor_online.model import ReducedPair

from pmor.arrays import FloatArray
from pmor.contact.condition import Condition
from pmor.contact.flank import MeshedPair
from pmor.contact.line_contact import line_contact
from pmor.contact.position import Position
from pmor.contact.search import Contact
from pmor.contact.solve import solve_position

Pattern = tuple[str, FloatArray, FloatArray, FloatArray]
Pressure = tuple[FloatArray, FloatArray, FloatArray]

# Points over the profile on which the pressure of exact flanks is drawn.
PROFILE_POINTS = 61


def contact_patterns(reduced: ReducedPair, phi: float, condition: Condition) -> list[Pattern]:
    """Return the pressure of each loaded tooth pair on the active patches of the gear whose points carry it.

    Parameters
    ----------
    reduced : ReducedPair
    phi : float
        Pinion angle, rad.
    condition : Condition

    Returns
    -------
    list of (title, roll angle in deg (n,), width in mm (m,), pressure in MPa (n, m))
        Empty when the position does not converge.
    """
    meshed = reduced.meshed
    pressure_of = {"nodal": _nodal_pressure, "strip": _strip_pressure, "line": _line_pressure}[meshed.scheme.kind]
    solved = solve_position(meshed, phi, [condition], reduced.elasticity_at)
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
        roll, z, pressure = pressure_of(meshed, position, contact, p, slave, mine)
        if meshed.mirrored:
            z, pressure = np.append(z, -z[-2::-1]), np.append(pressure, pressure[:, -2::-1], axis=1)
        title = f"{('Pinion', 'Wheel')[slave]} flank, {100 * torques[p] / condition.given_torque:.0f} % of torque"
        patterns.append((title, np.degrees(roll), z, pressure))
    return patterns


def _nodal_pressure(
    meshed: MeshedPair, position: Position, contact: Contact, p: int, slave: int, mine: np.ndarray
) -> Pressure:
    flank, scheme = (meshed.pinion, meshed.wheel)[slave], meshed.scheme
    roll, z = _points(flank.roll_angle, scheme.lodm_profile), _points(flank.nodes[0, :, 2], scheme.lodm_width)
    first = position.first_row[p, slave] * scheme.lodm_profile
    rows = first + np.arange(position.windows[p, slave, 3] * scheme.lodm_profile + 1)
    pressure = np.zeros((len(rows), len(z)))
    pressure[contact.place[mine, 0], contact.place[mine, 1]] = -scheme.penalty * contact.gap[mine]
    return roll[rows], z, pressure


def _line_pressure(
    meshed: MeshedPair, position: Position, contact: Contact, p: int, slave: int, mine: np.ndarray
) -> Pressure:
    """Hertz's semi-ellipses."""
    found, roll = line_contact(meshed, position, contact), section_roll_angle(meshed, position, contact, slave)
    tooth = (meshed.pair.pinion, meshed.pair.wheel)[slave]
    half_width, centre = found.half_width[mine], roll[mine]
    reach = 1.3 * half_width.max() / (tooth.base_radius * centre.mean())  # an involute's length is r_b u du
    grid = np.linspace(centre.min() - reach, centre.max() + reach, PROFILE_POINTS)
    z = meshed.pinion.nodes[0, :, 2]
    pressure = np.zeros((len(grid), len(z)))
    away = tooth.base_radius * centre * (grid[:, None] - centre) / half_width
    pressure[:, found.column[mine]] = found.peak_pressure[mine] * np.sqrt(np.maximum(1.0 - away**2, 0.0))
    return grid, z, pressure


def _strip_pressure(
    meshed: MeshedPair, position: Position, contact: Contact, p: int, slave: int, mine: np.ndarray
) -> Pressure:
    """Penalty pressure at the Gauss points, with lines between them."""
    roll, column = section_roll_angle(meshed, position, contact, slave)[mine], contact.place[mine, 1]
    value = -meshed.scheme.penalty * contact.gap[mine]
    margin = 0.1 * (roll.max() - roll.min())
    grid = np.linspace(roll.min() - margin, roll.max() + margin, PROFILE_POINTS)
    z = meshed.pinion.nodes[0, :, 2]
    pressure = np.zeros((len(grid), len(z)))
    for k in np.unique(column):
        order = np.argsort(roll[column == k])
        at, height = roll[column == k][order], value[column == k][order]
        pressure[:, k] = np.maximum(np.interp(grid, at, height, left=0.0, right=0.0), 0.0)
    return grid, z, pressure


def section_roll_angle(meshed: MeshedPair, position: Position, contact: Contact, gear: int) -> FloatArray:
    """Return the roll angles of the points of sections on a gear, shape (n,), rad.

    The weights of their nodes reproduce the arc length, and with it the square of the roll angle.
    """
    flank = (meshed.pinion, meshed.wheel)[gear]
    squares = np.empty(len(contact.gap))
    for n in range(len(squares)):
        own = slice(0, 4) if contact.slave[n] == gear else slice(4, 8)
        weights = contact.weight[n, own]
        row = position.first_row[contact.pair[n], gear] + contact.place[n, 0 if own.start == 0 else 2] + np.arange(4)
        direction = weights.sum(axis=0)
        squares[n] = weights @ direction @ flank.roll_angle[np.minimum(row, flank.element_rows)] ** 2
    return np.sqrt(squares)


def _points(nodes: FloatArray, subdivisions: int) -> FloatArray:
    """Positions of the refined points between nodes."""
    return np.interp(np.arange((len(nodes) - 1) * subdivisions + 1) / subdivisions, np.arange(len(nodes)), nodes)
