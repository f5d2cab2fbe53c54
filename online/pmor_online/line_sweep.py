"""The sweep of line contact with the line loads as unknowns (`pmor.line.kernels.loads`).

Sections are placed, and their flexibility gathered, once for a block of angles; torques and flank deviations cost a
solution each, of as many equations as sections carry load. Blocks have a fixed size and each state starts cold, so that
a result depends neither on the number of threads nor on other conditions of the call, to the last bit.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import Executor

import numpy as np

from pmor.core.arrays import BoolArray, FloatArray, IntArray
from pmor.core.threads import in_order
from pmor.gear.condition import Assembly, Condition, common_misalignment
from pmor.line.kernels.places import Lines
from pmor.line.kernels.pressure import PATCH_FIELDS, line_patches
from pmor.line.kernels.types import LineResults
from pmor.line.layered_pair import LayeredPair, place_flanks_of
from pmor.line.pair import LinePair, joined_results
from pmor.results.loads import ContactLoads, LineStates, SweepStates
from pmor.results.sweep import SteSweep
from pmor_online.model import ReducedPair

# Sections are placed for so many angles at a time: enough to share out, few enough for the flexibilities of helical
# pairs to stay in megabytes.
ANGLES_PER_BLOCK = 50
# Forces of sections that are held at a time in a block, unless all are recorded.
FORCES_AT_A_TIME = 2_000_000
NO_SENSITIVITY: FloatArray = np.empty(0)


def sweep_line_loads(
    reduced: ReducedPair, phi: FloatArray, conditions: Sequence[Condition], executor: Executor | None = None,
    progress: Callable[[int], None] = lambda n: None, recorded: bool = False,
) -> SteSweep:  # fmt: skip
    """Solve all angles under all conditions.

    Parameters
    ----------
    reduced : ReducedPair
        Of line loads.
    phi : ndarray, shape (n,)
        Pinion angles, rad, in any order.
    conditions : sequence of Condition
        Torques with the same axes; flanks may differ.
    executor : concurrent.futures.Executor, optional
        Of threads; solves several blocks of angles at a time.
    progress : callable
        Called with the number of angles done, for progress.
    recorded : bool
        Keep advances and line loads of all states too.
    """
    start = time.perf_counter()
    lines, found, wide = _solve(reduced.lines, phi, conditions, executor, progress, recorded)
    found = found._replace(converged=found.converged & ~wide, torque=np.where(wide[..., None], 0.0, found.torque))
    advance = np.where(found.converged, found.advance, np.nan)
    share, pair_index = load_shares(lines.first_pair[:, None] + np.arange(found.torque.shape[2]), found.torque)
    return SteSweep(
        phi_rad=np.asarray(phi, dtype=float), torque_Nm=np.array([condition.torque_Nm for condition in conditions]),
        ste_um=advance * reduced.layered.pair.pinion.base_radius * 1e3, pair_share=share, pair_index=pair_index,
        newton_steps=found.steps, converged=found.converged, seconds=time.perf_counter() - start,
        pitch_rad=reduced.layered.pair.pitch, states=_states(reduced, lines, found, advance) if recorded else None,
        stiffness_N_per_um=_stiffness(reduced, found), overloaded=wide,
    )  # fmt: skip


def sections_near(reduced: ReducedPair, phi: FloatArray, condition: Condition) -> int:
    """Return how many sections, at most over the angles, come within the approach that a torque makes expect."""
    layered = reduced.layered
    places = place_flanks_of(layered, phi, condition.assembly.misalignment)
    gap = places.gap
    near = gap - gap.min(axis=1, keepdims=True) < reduced.layered.expected_approach(condition.torque)
    return int(near.sum(axis=1).max())


def _solve(
    pair: LinePair, phi: FloatArray, conditions: Sequence[Condition], executor: Executor | None,
    progress: Callable[[int], None], recorded: bool,
) -> tuple[Lines, LineResults, BoolArray]:  # fmt: skip
    """Solve block by block; return sections, results, and in which states a section is overloaded."""
    angles, misalignment = np.ascontiguousarray(phi, dtype=float), common_misalignment(conditions)
    loads = np.array([condition.torque for condition in conditions], dtype=float)
    alike: dict[Assembly, list[int]] = {}
    for number, condition in enumerate(conditions):
        alike.setdefault(condition.assembly, []).append(number)

    def solve(block: slice) -> tuple[Lines, LineResults, BoolArray]:
        placed = pair.place(angles[block], misalignment)
        most, parts, wide = max(1, FORCES_AT_A_TIME // placed.lines.gap.size), list[LineResults](), list[BoolArray]()
        for assembly, numbers in alike.items():
            deviation = placed.deviation(assembly)
            for first in range(0, len(numbers), most):
                found = placed.solve(loads[numbers[first : first + most]], False, deviation, recorded)
                wide.append(placed.width_limit.exceeded(found.force))
                parts.append(found if recorded else found._replace(force=found.force[:, :0].copy()))
        order = [n for numbers in alike.values() for n in numbers]
        found = parts[0] if len(parts) == 1 else _in_order(parts, order)
        return _kept(placed.lines, recorded), found, np.concatenate(wide)[np.argsort(order)]

    blocks = [slice(i, i + ANGLES_PER_BLOCK) for i in range(0, len(angles), ANGLES_PER_BLOCK)]
    solved = []
    for part in in_order(solve, blocks, executor):
        solved.append(part)
        progress(len(part[0].first_pair))
    if len(solved) == 1:
        return solved[0]
    lines = Lines(*(np.concatenate(arrays) for arrays in zip(*(part[0] for part in solved), strict=True)))
    found = joined_results([part[1] for part in solved])
    return lines, found, np.concatenate([part[2] for part in solved], axis=1)


def _kept(lines: Lines, recorded: bool) -> Lines:
    """Sections without the arrays that results do not need: they are most of the memory of a long sweep."""
    if recorded:
        return lines._replace(gradient=np.empty((0, 0, 0, 0)))
    return Lines._make(array[:0].copy() for array in lines)._replace(first_pair=lines.first_pair)


def _in_order(parts: Sequence[LineResults], numbers: Sequence[int]) -> LineResults:
    """Put results of conditions with other flanks in the order in which these were given."""
    order = np.argsort(numbers)
    joined = joined_results(parts, axis=0)
    return LineResults._make(array[order] if array.size else array for array in joined)


def _stiffness(reduced: ReducedPair, found: LineResults) -> FloatArray:
    """Tangent mesh stiffness along the line of action, (D, A), N/um; NaN where not converged."""
    radius = reduced.layered.pair.pinion.base_radius
    return np.asarray(np.where(found.converged, 1e-3 * found.stiffness[..., 0, 0] / radius**2, np.nan))


def levers_of(lines: Lines, advance: FloatArray) -> FloatArray:
    """Levers of all states at advances (D, A), rad: (D, A, N), mm; under a pinion's corner they turn with these."""
    further = np.maximum(advance[..., None] - lines.corner_advance, 0.0)
    return np.asarray(lines.lever + lines.lever_slope * further)


def load_shares(pairs: IntArray, torque: FloatArray) -> tuple[FloatArray, IntArray]:
    """Return the share of each tooth pair in the torque, (D, A, P), and the P pairs that ever carry.

    Parameters
    ----------
    pairs : ndarray of int, shape (A, p)
        Tooth pairs that can touch at each angle.
    torque : ndarray, shape (D, A, p)
        That each of them carries; 0 where not converged.
    """
    total = torque.sum(axis=2, keepdims=True)
    fractions = np.divide(torque, total, out=np.zeros_like(torque), where=total > 0.0)
    used = np.unique(pairs[(fractions > 0.0).any(axis=0)])
    if len(pairs) == 1:
        return fractions[:, :, used - pairs[0, 0]], used
    share = np.zeros((*torque.shape[:2], len(used)))
    for column, index in enumerate(used):
        share[:, :, column] = np.where(pairs == index, fractions, 0.0).sum(axis=2)
    return share, used


def contact_loads(
    lines: Lines, z: FloatArray, levers: FloatArray, force: FloatArray, converged: BoolArray
) -> ContactLoads:
    """Return the forces of a mesh as results have them.

    Parameters
    ----------
    z : ndarray, shape (S,)
        Of its sections, mm.
    levers : ndarray, shape (D, A, N)
        As `levers_of` gives them.
    force : ndarray, shape (D, A, N)
        N.
    converged : ndarray of bool, shape (D, A)
        Other states carry nothing.
    """
    carried = (force > 0.0) & converged[..., None]
    _, angle, place = np.nonzero(carried)
    count = carried.sum(axis=2)
    after = np.cumsum(count.ravel()).reshape(count.shape)
    column = place % len(z)
    return ContactLoads(
        first=after - count, count=count, pair=lines.first_pair[angle] + place // len(z),
        slave=np.zeros(len(place), dtype=np.int64), column=column, force_N=force[carried],
        lever_mm=levers[carried], mate_lever_mm=lines.mate_lever[angle, place], roll_rad=lines.roll[angle, place],
        z_mm=z[column],
    )  # fmt: skip


def _states(reduced: ReducedPair, lines: Lines, found: LineResults, advance: FloatArray) -> SweepStates:
    z, levers = reduced.layered.sections.z, levers_of(lines, found.advance)
    loads = contact_loads(lines, z, levers, found.force, found.converged)
    pair_count = lines.gap.shape[1] // len(z)
    pairs = lines.first_pair[:, None] + np.arange(pair_count)
    radius = reduced.layered.pair.pinion.base_radius
    of_lines = line_states_of(
        reduced.layered, lines, found.force, found.converged, pairs, levers, radius * found.sensitivity
    )
    return SweepStates(advance, pairs, np.zeros((*advance.shape, pair_count, 0)), loads, of_lines)


def loads_and_patches(
    law: FloatArray, force: FloatArray, converged: BoolArray, width: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return line loads (N/mm, 0 where not converged), (D, A, P, S), and patches of contact, (D, A, P, S, 3).

    Laws are (A, N, 12), forces (D, A, N); `width` is that of the S sections with their images, mm; patches are those of
    `line_patches`.
    """
    load = np.where(converged[..., None], force, 0.0).reshape(*converged.shape, -1, len(width)) / width
    patches = np.empty((len(load), load[0].size, PATCH_FIELDS))
    line_patches(law.reshape(-1, law.shape[2]), load.reshape(len(load), -1), patches)
    return load, patches.reshape(*load.shape, PATCH_FIELDS)


def line_states_of(
    meshed: LayeredPair, lines: Lines, force: FloatArray, converged: BoolArray, pairs: IntArray, levers: FloatArray,
    sensitivity: FloatArray = NO_SENSITIVITY,
) -> LineStates:  # fmt: skip
    """Return the line contact of a mesh as results have it.

    Parameters
    ----------
    force : ndarray, shape (D, A, N)
        Of its sections, N.
    pairs : ndarray of int, shape (A, P)
        Tooth pairs that can touch.
    levers, sensitivity : ndarray, shape (D, A, N)
        As `levers_of` gives them; as `LineStates` has it.
    """
    sections = meshed.sections
    load, patches = loads_and_patches(lines.law, force, converged, meshed.width)
    (half_width, offset, pressure), grid = np.moveaxis(patches, -1, 0), load.shape
    return LineStates(
        pair=pairs, z_mm=sections.z, width_mm=sections.width, mirrored=meshed.mirrored, converged=converged,
        roll_rad=lines.roll.reshape(*grid[1:], 2), load_N_per_mm=load, half_width_mm=half_width, offset_mm=offset,
        pressure_MPa=pressure, lever_mm=levers.reshape(grid), mate_lever_mm=lines.mate_lever.reshape(grid[1:]),
        sensitivity=sensitivity.reshape(grid) if sensitivity.size else sensitivity,
    )  # fmt: skip
