"""Equilibria of the reduced pair over angles, each started from its neighbour."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.core.compiling import allocating, compiled, merged
from pmor.core.linear import entries_up_to
from pmor.penalty.kernels.estimate import discarded_energy_slope, discarded_workspace
from pmor.penalty.kernels.loads import empty_loads, list_loads, trimmed, with_space
from pmor.penalty.kernels.newton import Solution, solve_state
from pmor.penalty.kernels.search import search_workspace
from pmor.penalty.kernels.shapes import cubic_weights, gather_active_shapes, shape_slots
from pmor.penalty.kernels.state import Load, Position, Work
from pmor.penalty.kernels.windows import load_windows, place_windows

# Where Newton starts, one after the other until it converges.
FROM_NEIGHBOUR, FROM_NOTHING = range(2)


class Settings(NamedTuple):
    """How a sweep is solved.

    Attributes
    ----------
    recorded : bool
        Amplitudes and loads are kept as well.
    pair_count : int
        Tooth pairs that can touch at most: P.
    approach_rate : float
        Approach of the flanks to expect per torque, mm / (N mm).
    depth : float
        Approach for which windows are cut, mm.
    clearance : float
        Share of the depth that counts as clear.
    tolerance : float
        Of Newton.
    """

    recorded: bool
    pair_count: int
    approach_rate: float
    depth: float
    clearance: float
    max_steps: int
    tolerance: float


class Results(NamedTuple):
    """Results of a sweep over D torques.

    Attributes
    ----------
    advance : ndarray, shape (D, angles)
        rad.
    steps : ndarray of int, shape (D, angles)
    converged : ndarray of bool, shape (D, angles)
    pair : ndarray of int, shape (angles, P)
        Tooth pairs that can touch.
    active_shapes : ndarray of int, shape (angles,)
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

    advance: FloatArray
    steps: IntArray
    converged: BoolArray
    pair: IntArray
    active_shapes: IntArray
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
    advance : ndarray, shape (D,)
        rad.
    amplitude : ndarray, shape (D, P, slots)
    tooth_pair : ndarray of int, shape (P,)
        Its tooth pairs.
    centre : ndarray, shape (P, 2)
        Their kinematic contact in element rows.
    """

    known: BoolArray
    advance: FloatArray
    amplitude: FloatArray
    tooth_pair: IntArray
    centre: FloatArray


@allocating
def place_position(phi, depth, pair, family, pair_count, clearance):
    """Set up a position, for any load.

    Parameters
    ----------
    phi, depth : float
        Pinion angle (rad), and approach for which windows are cut (mm).
    pair : Pair
    family : Family
    pair_count : int
        Tooth pairs that can touch at most.
    clearance : float
        Share of the depth that counts as clear.

    Returns
    -------
    Position
    """
    patches, nodes = place_windows(phi, depth, clearance * depth, pair_count, pair.kinematics, pair.gears, pair.limits)
    columns = pair.gears[0].nodes.shape[1], pair.gears[1].nodes.shape[1]
    active_shapes = gather_active_shapes(columns, pair.kinematics.pitch, patches, nodes, family)
    undeformed = np.zeros((nodes, 3))
    load_windows(patches, pair.gears, pair.deviations, undeformed)
    workspace, size = search_workspace(pair, patches), active_shapes.size
    points, vectors, matrices = len(workspace.points.gap), np.empty((5, size + 1)), np.empty((2, size + 1, size + 1))
    work = Work(
        undeformed=undeformed, nodes=np.empty((nodes, 3)), slope=np.empty((points, size)), free_gap=np.empty(points),
        active=np.empty(points, dtype=np.bool_), target=vectors[0], difference=vectors[1], solution=vectors[2],
        trial=vectors[3], rhs=vectors[4], matrix=matrices[0], factor=matrices[1], workspace=workspace,
    )  # fmt: skip
    return Position(patches, active_shapes, work)


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
    coordinates : ndarray, shape (active_shapes,)
        Filled.
    """
    patches, active_shapes, slots = position.patches, position.active_shapes, neighbour.amplitude.shape[2]
    for j in range(active_shapes.size):
        p, slot = active_shapes.slot[j] // slots, active_shapes.slot[j] % slots
        number = patches.tooth_pair[p] - neighbour.tooth_pair[0]
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
        line = entries_up_to(start, slot - before) - 1
        order = slot - before - start[line]
        source = line - (patches.centre[p, gear] - neighbour.centre[number, gear])
        below = int(np.floor(source))
        weights = cubic_weights(source - below)
        coordinates[j] = 0.0
        for a in range(4):
            coordinates[j] += weights[a] * _line_amplitude(start, below - 1 + a, order, before, amplitude)


@compiled
def _remember_solution(t, position, coordinates, advance, neighbour):
    active_shapes, slots = position.active_shapes, neighbour.amplitude.shape[2]
    neighbour.amplitude[t] = 0.0
    for j in range(active_shapes.size):
        neighbour.amplitude[t, active_shapes.slot[j] // slots, active_shapes.slot[j] % slots] = coordinates[j]
    neighbour.advance[t] = advance


@compiled
def _remember_position(patches, converged, neighbour):
    for t in range(len(converged)):
        neighbour.known[t] = converged[t]
    neighbour.tooth_pair[:] = patches.tooth_pair[0] if patches.pairs > 0 else 0
    for p in range(patches.pairs):
        neighbour.tooth_pair[p] = patches.tooth_pair[p]
        for gear in range(2):
            neighbour.centre[p, gear] = patches.centre[p, gear]


@compiled
def _record_amplitudes(t, i, amplitude, out):
    # Singly: numba takes seconds to compile the errors of arrays of different shapes.
    for p in range(amplitude.shape[1]):
        for slot in range(amplitude.shape[2]):
            out[t, i, p, slot] = amplitude[t, p, slot]


@compiled
def _pair_torques(count, points, out):
    for n in range(count):
        force = points.stiffness[n] * min(points.gap[n], 0.0)
        out[points.pair[n]] += force * points.lever[n]


@allocating
def sweep_reduced(phi, applied_loads, pair, family, compliance, settings, results):
    """Reduced equilibria over angles and torques, each started from its neighbour.

    Parameters
    ----------
    phi : ndarray
        Pinion angles, rad.
    applied_loads : ndarray
        Torques, N mm.
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
    pair_count, count = settings.pair_count, len(applied_loads)
    neighbour = Neighbour(
        known=np.zeros(count, dtype=np.bool_), advance=np.zeros(count),
        amplitude=np.zeros((count, pair_count, shape_slots(family))), tooth_pair=np.zeros(pair_count, dtype=np.int64),
        centre=np.zeros((pair_count, 2)),
    )  # fmt: skip
    loads, filled = empty_loads(16 * count * len(phi) if settings.recorded else 0), 0
    for i in range(len(phi)):
        depth = settings.depth
        while True:
            position = place_position(phi[i], depth, pair, family, pair_count, settings.clearance)
            coordinates = np.zeros(position.active_shapes.size)
            discarded = discarded_workspace(position, pair.gears, compliance)
            if settings.recorded:
                loads = with_space(loads, filled + count * len(position.work.workspace.points.gap))
            end, border = _solve_torques(
                i, applied_loads, pair, family, position, neighbour, coordinates, compliance, discarded, loads, filled,
                settings, results,
            )  # fmt: skip
            if not border:
                break
            depth *= 3.0
        filled = end
    return trimmed(loads, filled)


@compiled
def _solve_torques(
    i, applied_loads, pair, family, position, neighbour, coordinates, compliance, discarded, loads, end, settings,
    results,
):  # fmt: skip
    """Solve a position, number `i`, for all torques; fill the results, and write loads behind the first `end`.

    Returns
    -------
    end : int
        How many loads there are then.
    border : bool
        Contact reaches the border of a window.
    """
    patches, active_shapes, work, border = position.patches, position.active_shapes, position.work, False
    for t in range(len(applied_loads)):
        solution = _solve_from_neighbour(
            t, i, applied_loads, pair, family, position, neighbour, coordinates, settings, results
        )
        border = border or solution.border
        if not solution.converged:
            continue
        if len(compliance[0]) > 0:
            results.slope[t, i] = discarded_energy_slope(
                solution.listed, pair.gears, patches, active_shapes, work, coordinates, compliance, discarded
            )
        if settings.recorded:
            _record_amplitudes(t, i, neighbour.amplitude, results.amplitude)
            results.load_first[t, i] = end
            end = list_loads(solution.listed, pair.gears, patches, work.workspace.points, end, loads)
            results.load_count[t, i] = end - results.load_first[t, i]
    _remember_position(patches, results.converged[:, i], neighbour)
    results.active_shapes[i] = active_shapes.size
    for p in range(settings.pair_count):
        results.pair[i, p] = patches.tooth_pair[p] if p < patches.pairs else neighbour.tooth_pair[0] - 1
    return end, border


@merged
def _solve_from_neighbour(t, i, applied_loads, pair, family, position, neighbour, coordinates, settings, results):
    """Solve for torque number `t` at angle number `i`; fill the results, return the `Solution`.

    Started from the angle before, else from the torque before, else from the undeformed pair.
    """
    torque, touch, radius = applied_loads[t], pair.kinematics.first_touch, pair.gears[0].base_radius
    approach = settings.approach_rate * torque
    scaled = t > 0 and results.converged[t - 1, i]
    solution = Solution(0.0, 0, False, 0, False)
    for start in range(FROM_NEIGHBOUR if neighbour.known[t] or scaled else FROM_NOTHING, FROM_NOTHING + 1):
        if start > FROM_NEIGHBOUR:
            advance = touch + approach / radius
            coordinates[:] = 0.0
        elif neighbour.known[t]:
            advance = neighbour.advance[t]
            carry_along(t, family, position, neighbour, coordinates)
        else:
            advance = touch + (results.advance[t - 1, i] - touch) * torque / applied_loads[t - 1]
            for j in range(len(coordinates)):
                coordinates[j] *= torque / applied_loads[t - 1]
        load = Load(torque, approach)
        solution = solve_state(pair, position, load, coordinates, advance, settings.max_steps, settings.tolerance)
        if solution.converged:
            break
    results.advance[t, i], results.steps[t, i] = solution.advance, solution.steps
    results.converged[t, i] = solution.converged
    results.pair_torque[t, i] = 0.0
    if solution.converged:
        _pair_torques(solution.listed, position.work.workspace.points, results.pair_torque[t, i])
        _remember_solution(t, position, coordinates, solution.advance, neighbour)
    return solution
