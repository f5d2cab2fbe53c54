"""Equilibria of the reduced pair over angles, each started from its neighbour."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pmor.arrays import BoolArray, FloatArray, IntArray
from pmor.contact.kernels.compiling import allocating, compiled, merged
from pmor.contact.kernels.estimate import discarded_energy_slope
from pmor.contact.kernels.loads import empty_loads, list_loads, trimmed, with_room
from pmor.contact.kernels.newton import Solution, solve_state
from pmor.contact.kernels.search import search_room
from pmor.contact.kernels.shapes import cubic_weights, gather_members, member_slots
from pmor.contact.kernels.state import Drive, Position, Work
from pmor.contact.kernels.windows import load_windows, place_windows


class Settings(NamedTuple):
    """How a sweep is solved.

    Attributes
    ----------
    held : bool
        The pinion's leads are given, not torques.
    recorded : bool
        Amplitudes and loads are kept as well.
    reachable : int
        Tooth pairs that can be in reach at most: P.
    approach_rate : float
        Approach of the flanks to expect per torque, mm / (N mm), or per lead, mm / rad.
    depth : float
        Approach for which windows are cut, mm.
    clearance : float
        Share of the depth that counts as clear.
    max_steps : int
    tolerance : float
        Of Newton.
    """

    held: bool
    recorded: bool
    reachable: int
    approach_rate: float
    depth: float
    clearance: float
    max_steps: int
    tolerance: float


class Results(NamedTuple):
    """What a sweep over D torques or leads gives; filled by it.

    Attributes
    ----------
    lead : ndarray, shape (D, angles)
        rad.
    steps : ndarray of int, shape (D, angles)
    converged : ndarray of bool, shape (D, angles)
    pair : ndarray of int, shape (angles, P)
        Tooth pairs in reach.
    members : ndarray of int, shape (angles,)
        How many shapes are.
    pair_torque : ndarray, shape (D, angles, P)
        Torque on the pinion that each of them carries, N mm; 0 beyond their number.
    slope : ndarray, shape (D, angles)
        Of `discarded_energy_slope`, rad; left alone where there is none.
    amplitude : ndarray, shape (D, angles, P, slots)
        Of the shapes of each pair, where that is recorded.
    load_first, load_count : ndarray of int, shape (D, angles)
        Where the loads of a state are among the `Loads`, where these are recorded.
    """

    lead: FloatArray
    steps: IntArray
    converged: BoolArray
    pair: IntArray
    members: IntArray
    pair_torque: FloatArray
    slope: FloatArray
    amplitude: FloatArray
    load_first: IntArray
    load_count: IntArray


class Neighbour(NamedTuple):
    """The position before, from which the next one starts.

    Attributes
    ----------
    known : ndarray of bool, shape (D,)
        Whether it converged.
    lead : ndarray, shape (D,)
        rad.
    amplitude : ndarray, shape (D, P, slots)
    tooth_pair : ndarray of int, shape (P,)
        Its tooth pairs.
    centre : ndarray, shape (P, 2)
        Their kinematic contact in element rows.
    """

    known: BoolArray
    lead: FloatArray
    amplitude: FloatArray
    tooth_pair: IntArray
    centre: FloatArray


@allocating
def place_position(phi, depth, pair, family, reachable, clearance):
    """Set up all that one position needs, whatever drives it.

    Parameters
    ----------
    phi, depth : float
        Pinion angle (rad), and approach for which windows are cut (mm).
    pair : Pair
    family : Family
    reachable : int
        Tooth pairs that can be in reach at most.
    clearance : float
        Share of the depth that counts as clear.

    Returns
    -------
    Position
    """
    reach, nodes = place_windows(phi, depth, clearance * depth, reachable, pair.kinematics, pair.gears)
    members = gather_members(pair, reach, nodes, family)
    undeformed = np.zeros((nodes, 3))
    if not pair.scheme.exact:
        load_windows(reach, pair.gears, pair.deviations, undeformed)
    room, size = search_room(pair, reach), members.size
    points, vectors, matrices = len(room.points.gap), np.empty((5, size + 1)), np.empty((2, size + 1, size + 1))
    work = Work(
        undeformed, np.empty((nodes, 3)), np.empty((points, size)), np.empty(points), np.empty(points, dtype=np.bool_),
        vectors[0], vectors[1], vectors[2], vectors[3], vectors[4], matrices[0], matrices[1], room,
    )  # fmt: skip
    return Position(reach, members, work)


@compiled
def _line_amplitude(start, line, order, before, amplitude):
    """Amplitude of the shape number `order` of a line; 0 beyond the flank and where the line has no such shape."""
    if line < 0 or line >= len(start) - 1 or start[line] + order >= start[line + 1]:
        return 0.0
    return amplitude[before + start[line] + order]


@compiled
def carry_along(t, family, position, neighbour, coordinates):
    """Start from the neighbour's amplitudes number `t`, carried along with the contact where lines have them.

    Parameters
    ----------
    t : int
    family : Family
    position : Position
        To start.
    neighbour : Neighbour
    coordinates : ndarray, shape (members,)
        Filled.
    """
    reach, members, slots = position.reach, position.members, neighbour.amplitude.shape[2]
    for j in range(members.size):
        p, slot = members.slot[j] // slots, members.slot[j] % slots
        number = reach.tooth_pair[p] - neighbour.tooth_pair[0]
        if number < 0 or number >= neighbour.amplitude.shape[1]:
            coordinates[j] = 0.0
            continue
        amplitude = neighbour.amplitude[t, number]
        if not family.by_line:
            coordinates[j] = amplitude[slot]
            continue
        pinion_slots = family.lines[0].displacement.shape[1]
        gear, before = (0, 0) if slot < pinion_slots else (1, pinion_slots)
        start = family.lines[gear].start
        line = np.searchsorted(start, slot - before, side="right") - 1
        order = slot - before - start[line]
        source = line - (reach.centre[p, gear] - neighbour.centre[number, gear])
        below = int(np.floor(source))
        weights = cubic_weights(source - below)
        coordinates[j] = 0.0
        for a in range(4):
            coordinates[j] += weights[a] * _line_amplitude(start, below - 1 + a, order, before, amplitude)


@compiled
def _remember_solution(t, position, coordinates, lead, neighbour):
    members, slots = position.members, neighbour.amplitude.shape[2]
    neighbour.amplitude[t] = 0.0
    for j in range(members.size):
        neighbour.amplitude[t, members.slot[j] // slots, members.slot[j] % slots] = coordinates[j]
    neighbour.lead[t] = lead


@compiled
def _remember_position(reach, converged, neighbour):
    for t in range(len(converged)):
        neighbour.known[t] = converged[t]
    neighbour.tooth_pair[:] = reach.tooth_pair[0] if reach.pairs > 0 else 0
    for p in range(reach.pairs):
        neighbour.tooth_pair[p] = reach.tooth_pair[p]
        for gear in range(2):
            neighbour.centre[p, gear] = reach.centre[p, gear]


@compiled
def _record_amplitudes(t, i, amplitude, out):
    # Singly: numba takes seconds to compile what could go wrong between arrays of different shapes.
    for p in range(amplitude.shape[1]):
        for slot in range(amplitude.shape[2]):
            out[t, i, p, slot] = amplitude[t, p, slot]


@compiled
def _pair_torques(count, points, out):
    for n in range(count):
        force = points.stiffness[n] * min(points.gap[n], 0.0)
        out[points.pair[n]] += force * points.lever[n]


@allocating
def sweep_reduced(phi, drives, pair, family, compliance, settings, results):
    """Reduced equilibria over angles and torques, or leads, each started from its neighbour.

    Parameters
    ----------
    phi : ndarray
        Pinion angles, rad.
    drives : ndarray
        Torques, N mm, or leads, rad.
    pair : Pair
    family : Family
    compliance : two ndarrays
        See `discarded_energy_slope`; of length 0 when that is not asked for.
    settings : Settings
    results : Results
        Filled.

    Returns
    -------
    Loads
        Of all states that converged, if they are recorded.
    """
    reachable, count = settings.reachable, len(drives)
    neighbour = Neighbour(
        np.zeros(count, dtype=np.bool_), np.zeros(count), np.zeros((count, reachable, member_slots(family))),
        np.zeros(reachable, dtype=np.int64), np.zeros((reachable, 2)),
    )  # fmt: skip
    loads, filled = empty_loads(16 * count * len(phi) if settings.recorded else 0), 0
    for i in range(len(phi)):
        depth = settings.depth
        while True:
            position = place_position(phi[i], depth, pair, family, reachable, settings.clearance)
            border, coordinates, end = False, np.zeros(position.members.size), filled
            for t in range(count):
                solution = _solve_from_neighbour(
                    t, i, drives, pair, family, position, neighbour, coordinates, settings, results
                )
                border = border or solution.border
                if not solution.converged:
                    continue
                if len(compliance[0]) > 0:
                    results.slope[t, i] = discarded_energy_slope(
                        solution.listed, pair, position, coordinates, compliance
                    )
                if settings.recorded:
                    _record_amplitudes(t, i, neighbour.amplitude, results.amplitude)
                    loads = with_room(loads, end + solution.listed)
                    results.load_first[t, i] = end
                    end = list_loads(
                        solution.listed, pair.gears, position.reach, position.work.room.points, end, loads
                    )
                    results.load_count[t, i] = end - results.load_first[t, i]
            reach = position.reach
            _remember_position(reach, results.converged[:, i], neighbour)
            if not border:
                break
            depth *= 3.0
        filled = end
        results.members[i] = position.members.size
        for p in range(reachable):
            results.pair[i, p] = reach.tooth_pair[p] if p < reach.pairs else neighbour.tooth_pair[0] - 1
    return trimmed(loads, filled)


@merged
def _solve_from_neighbour(t, i, drives, pair, family, position, neighbour, coordinates, settings, results):
    """Solve for torque or lead number `t` at angle number `i`; fill the results, return the `Solution`.

    Started from the angle before, else from the torque or lead before, else from the undeformed pair.
    """
    held = settings.held
    drive = Drive(0.0 if held else drives[t], settings.approach_rate * drives[t], held)
    scaled = t > 0 and results.converged[t - 1, i]
    solution = Solution(0.0, 0, False, 0, False)
    for cold in range(0 if neighbour.known[t] or scaled else 1, 2):
        if cold == 1:
            lead = drive.approach / pair.gears[0].base_radius
            coordinates[:] = 0.0
        elif neighbour.known[t]:
            lead = neighbour.lead[t]
            carry_along(t, family, position, neighbour, coordinates)
        else:
            before = 1.0 if held else drives[t - 1]
            ahead = 1.0 if held else drives[t]
            lead = results.lead[t - 1, i] * ahead / before
            for j in range(len(coordinates)):
                coordinates[j] *= ahead / before
        if held:
            lead = drives[t]
        solution = solve_state(pair, position, drive, coordinates, lead, settings.max_steps, settings.tolerance)
        if solution.converged:
            break
    results.lead[t, i], results.steps[t, i] = solution.lead, solution.steps
    results.converged[t, i] = solution.converged
    results.pair_torque[t, i] = 0.0
    if solution.converged:
        _pair_torques(solution.listed, position.work.room.points, results.pair_torque[t, i])
        _remember_solution(t, position, coordinates, solution.lead, neighbour)
    return solution
