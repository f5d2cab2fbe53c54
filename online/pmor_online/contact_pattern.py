"""Contact pressure on unrolled flanks at one position, in cells that carry the load to the last newton."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pmor.core.arrays import BoolArray, FloatArray
from pmor.gear.condition import Condition
from pmor.gear.meshed_pair import MeshedPair
from pmor.gear.tooth import Tooth
from pmor.line.full_model import LineState, solve_angle
from pmor.line.layered_pair import LayeredPair
from pmor.penalty.kernels.types import ELEMENT_ROWS, FIRST_ROW
from pmor.penalty.pair import as_penalty
from pmor.penalty.position import Position
from pmor.penalty.search import Contact
from pmor.penalty.solve import solve_position
from pmor.results.load_distribution import largest_pressure
from pmor_online.model import ReducedPair

# Cells over the profile in which the pressure of exact flanks is given, and how far they go beyond the contact.
PROFILE_CELLS, MARGIN = 60, 1.3
# Where contact is inclined: cells over half its width, cells at most, and strips over the width for each section.
CELLS_PER_HALF_WIDTH, MOST_CELLS, STRIPS = 4, 600, 12


@dataclass(frozen=True)
class ContactPattern:
    """Pressure of one tooth pair on the flank of the gear whose points carry it, in n x m cells.

    Parameters
    ----------
    gear : int
        0 pinion, 1 wheel.
    base_radius : float
        Of that gear, mm.
    share : float
        Of the torque, 0 to 1.
    roll_angle : ndarray, shape (n + 1,)
        Edges of the cells along the profile, rising from root to tip, rad.
    width : ndarray, shape (m + 1,)
        Edges of the cells over the face width, from face to face, mm.
    pressure : ndarray, shape (n, m)
        Mean over each cell, MPa.
    largest : float
        Of line contact Hertz's, as `pmor.results.load_distribution.largest_pressure` has it: NaN where a sharp edge
        carries all. Of other models the largest mean over a cell.
    base_helix_angle : float
        rad.
    """

    gear: int
    base_radius: float
    share: float
    roll_angle: FloatArray
    width: FloatArray
    pressure: FloatArray
    largest: float
    base_helix_angle: float = 0.0

    @property
    def at_edge(self) -> bool:
        """Whether cells have more than the largest pressure: those at a sharp edge, where it has no bound."""
        return not float(self.pressure.max()) <= self.largest

    @property
    def force(self) -> FloatArray:
        """Normal force that each cell carries, shape (n, m), N."""
        return self.pressure * _areas(self.base_radius, self.base_helix_angle, self.roll_angle, self.width)


def contact_patterns(reduced: ReducedPair, phi: float, condition: Condition) -> tuple[ContactPattern, ...]:
    """Return the pressure of each loaded tooth pair.

    Parameters
    ----------
    phi : float
        Pinion angle, rad.

    Returns
    -------
    tuple of ContactPattern
        Empty when the position does not converge.
    """
    meshed = reduced.meshed
    if isinstance(meshed, LayeredPair):
        (state,) = solve_angle(meshed, reduced.flank_compliance, phi, [condition]).states
        return () if state is None else tuple(_line_pattern(meshed, state, int(p)) for p in np.unique(state.pair))
    solved = solve_position(as_penalty(meshed), phi, [condition], reduced.elasticity_at)
    equilibrium, position = solved.equilibria[0], solved.position
    if equilibrium is None:
        return ()
    torques = equilibrium.pair_torque(len(position.pair_index))
    shares = torques / torques.sum()
    return tuple(_pattern(meshed, position, equilibrium.contact, int(p), shares[p]) for p in np.flatnonzero(shares))


def _pattern(meshed: MeshedPair, position: Position, contact: Contact, p: int, share: float) -> ContactPattern:
    of_pair = contact.pair == p
    gear = int(2 * np.count_nonzero(contact.slave[of_pair]) > np.count_nonzero(of_pair))
    mine = of_pair & (contact.slave == gear)
    roll, width, force = _nodal_forces(meshed, position, contact, gear, mine)
    # Where points of both gears carry load (two-pass), each side has a part of it.
    force *= contact.force[of_pair].sum() / force.sum()
    found = _on_whole_face(meshed, gear, share, roll, width, force)
    return replace(found, largest=float(found.pressure.max()))


def _on_whole_face(
    meshed: MeshedPair, gear: int, share: float, roll: FloatArray, width: FloatArray, force: FloatArray
) -> ContactPattern:
    """Pressure from the forces in cells, of a half with its image."""
    radius, helix = _tooth(meshed, gear).base_radius, meshed.pair.base_helix_angle
    if meshed.mirrored:  # the forces are those of both halves
        pressure = 0.5 * force / _areas(radius, helix, roll, width)
        width, pressure = np.append(width[:-1], -width[-2::-1]), np.append(pressure, pressure[:, -2::-1], axis=1)
    else:
        pressure = force / _areas(radius, helix, roll, width)
    return ContactPattern(gear, radius, share, roll, width, pressure, np.nan, helix)


def _nodal_forces(
    meshed: MeshedPair, position: Position, contact: Contact, gear: int, mine: BoolArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Edges over the profile, edges over the width, and the force in each cell, about each refined point."""
    flank, scheme, p = (meshed.pinion, meshed.wheel)[gear], as_penalty(meshed).scheme, contact.pair[mine][0]
    roll, z = _points(flank.roll_angle, scheme.lodm_profile), _points(flank.nodes[0, :, 2], scheme.lodm_width)
    window = position.windows[p, gear]
    first = window[FIRST_ROW] * scheme.lodm_profile
    rows = window[ELEMENT_ROWS] * scheme.lodm_profile + 1
    force = np.zeros((rows, len(z)))
    np.add.at(force, (contact.place[mine, 0], contact.place[mine, 1]), contact.force[mine])
    if meshed.pair.overlap_ratio > 0.0:  # each section has its own slave: the forces of the mate's points are added
        others = (contact.pair == p) & (contact.slave != gear)
        weight, place = contact.weight[others, 4:], contact.place[others, 2:]
        share = np.einsum("nad,nd->na", weight, weight.sum(axis=1))  # of the element's four nodes
        along = np.rint((place[:, 0] + share[:, 2] + share[:, 3]) * scheme.lodm_profile).astype(int)
        across = np.rint((place[:, 1] + share[:, 1] + share[:, 3]) * scheme.lodm_width).astype(int)
        np.add.at(force, (along, across), contact.force[others])
    return np.sqrt(_edges(roll**2)[first : first + rows + 1]), _edges(z), force


def _line_pattern(meshed: LayeredPair, state: LineState, pair: int) -> ContactPattern:
    """Pattern of Hertz's semi-ellipses on the pinion; where contact is inclined each section's load lies along it.

    At a tip corner the ellipse has the length of contact, which there is carried more towards the corner.
    """
    mine, sections, tooth = state.pair == pair, meshed.sections, meshed.pair.pinion
    half_width, offset, pressure = state.patches()[mine].T
    section, roll, load = state.section[mine], state.roll[mine, 0], state.force[mine]
    inclined = tooth.twist_per_length != 0.0
    strips = STRIPS if inclined else 1
    width = np.repeat(sections.width / strips, strips)
    across = meshed.pair.common_face[0] + np.concatenate([[0.0], np.cumsum(width)])
    places = 0.5 * (across[1:] + across[:-1]).reshape(-1, strips)[section]
    rolls = _inclined(sections.z[section], roll, places, tooth) if inclined else roll[:, None]
    arc = 0.5 * tooth.base_radius * rolls**2 + offset[:, None]
    half_length = MARGIN * half_width.max()
    low, high = max(arc.min() - half_length, 0.0), arc.max() + half_length
    least = int(CELLS_PER_HALF_WIDTH * (high - low) / np.median(half_width))
    edges = np.linspace(low, high, max(PROFILE_CELLS, min(MOST_CELLS, least) if inclined else 0) + 1)
    x = np.clip((edges[:, None, None] - arc) / half_width[:, None], -1.0, 1.0)
    below = (x * np.sqrt(1.0 - x**2) + np.arcsin(x)) / np.pi  # part of the load below an edge, less one half
    force = np.zeros((len(edges) - 1, len(sections.z), strips))
    force[:, section] = np.diff(below, axis=0) * (load / strips)[:, None]
    force *= load.sum() / force.sum() / np.cos(meshed.pair.base_helix_angle)  # loads are in the transverse plane
    share = float(state.torque[mine].sum() / state.torque.sum())
    roll_edges = np.sqrt(2.0 * edges / tooth.base_radius)
    found = _on_whole_face(meshed, 0, share, roll_edges, across, force.reshape(len(force), -1))
    return replace(found, largest=float(largest_pressure(pressure, 0)))


def _inclined(z: FloatArray, roll: FloatArray, places: FloatArray, tooth: Tooth) -> FloatArray:
    """Roll angles of an inclined line of contact at some places over the width, shape as they, from those of sections.

    They grow evenly over the width, beyond the outermost sections too, up to where the flank ends.
    """
    order = np.argsort(z)
    first, last = order[0], order[-1]
    beyond = np.minimum(places - z[first], 0.0) + np.maximum(places - z[last], 0.0)
    rolls = np.interp(places, z[order], roll[order]) + tooth.twist_per_length * beyond
    return np.clip(rolls, tooth.form_roll_angle, tooth.tip_roll_angle)


def _tooth(meshed: MeshedPair, gear: int) -> Tooth:
    return (meshed.pair.pinion, meshed.pair.wheel)[gear]


def _areas(base_radius: float, base_helix_angle: float, roll_angle: FloatArray, width: FloatArray) -> FloatArray:
    """Areas of cells (n, m) between edges, mm^2; the arc length of an involute is r_b u^2 / 2."""
    return 0.5 * base_radius / np.cos(base_helix_angle) * np.outer(np.diff(roll_angle**2), np.diff(width))


def _points(nodes: FloatArray, subdivisions: int) -> FloatArray:
    """Positions of the refined points between nodes."""
    return np.interp(np.arange((len(nodes) - 1) * subdivisions + 1) / subdivisions, np.arange(len(nodes)), nodes)


def _edges(points: FloatArray) -> FloatArray:
    """Edges (n + 1,) of cells about points (n,): halfway between neighbours, and the outer points themselves."""
    return np.concatenate([points[:1], 0.5 * (points[1:] + points[:-1]), points[-1:]])
