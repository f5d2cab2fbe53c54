"""The sweep of line contact with the line loads as unknowns (`pmor.line.kernels.loads`).

Sections are placed, and their flexibility gathered, once for a block of angles; torques and flank deviations cost a
solution each, of as many equations as sections carry load. Blocks have a fixed size and each state starts cold, so that
a result depends neither on the number of threads nor on what else is asked for, to the last bit.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import Executor

import numpy as np

from pmor.core.arrays import FloatArray, IntArray
from pmor.core.threads import in_order
from pmor.gear.condition import Assembly, Condition, common_misalignment
from pmor.line.kernels.loads import LineResults
from pmor.line.kernels.places import Lines
from pmor.line.kernels.pressure import PATCH_FIELDS, line_patches
from pmor.line.layered_pair import place_flanks_of
from pmor.line.pair import LinePair
from pmor.results.loads import ContactLoads, LineStates, SweepStates
from pmor.results.sweep import SteSweep
from pmor_online.model import ReducedPair

# Sections are placed for so many angles at a time: enough to share out, few enough for the flexibilities of helical
# pairs to stay in megabytes.
ANGLES_PER_BLOCK = 50


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
    lines, found = _solve(reduced.lines, phi, conditions, executor, progress, recorded)
    advance = np.where(found.converged, found.advance, np.nan)
    share, pair_index = _shares(lines, found)
    return SteSweep(
        phi_rad=np.asarray(phi, dtype=float), torque_Nm=np.array([condition.torque_Nm for condition in conditions]),
        ste_um=advance * reduced.layered.pair.pinion.base_radius * 1e3, pair_share=share, pair_index=pair_index,
        newton_steps=found.steps, converged=found.converged, seconds=time.perf_counter() - start,
        pitch_rad=reduced.layered.pair.pitch, states=_states(reduced, lines, found, advance) if recorded else None,
        stiffness_N_per_um=_stiffness(reduced, found),
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
) -> tuple[Lines, LineResults]:  # fmt: skip
    """Solve block by block."""
    angles, misalignment = np.ascontiguousarray(phi, dtype=float), common_misalignment(conditions)
    loads = np.array([condition.torque for condition in conditions], dtype=float)
    alike: dict[Assembly, list[int]] = {}
    for number, condition in enumerate(conditions):
        alike.setdefault(condition.assembly, []).append(number)

    def solve(block: slice) -> tuple[Lines, LineResults]:
        placed = pair.place(angles[block], misalignment)
        parts = [
            placed.solve(loads[numbers], False, placed.deviation(assembly), recorded)
            for assembly, numbers in alike.items()
        ]
        found = parts[0] if len(parts) == 1 else _in_order(parts, [n for numbers in alike.values() for n in numbers])
        # Nobody reads the gradients again.
        return placed.lines._replace(gradient=np.empty((0, 0, 0, 0))), found

    blocks = [slice(i, i + ANGLES_PER_BLOCK) for i in range(0, len(angles), ANGLES_PER_BLOCK)]
    solved = []
    for part in in_order(solve, blocks, executor):
        solved.append(part)
        progress(len(part[0].first_pair))
    if len(solved) == 1:
        return solved[0]
    lines = Lines(*(np.concatenate(arrays) for arrays in zip(*(part[0] for part in solved), strict=True)))
    found = LineResults(*(np.concatenate(a, axis=1) for a in zip(*(part[1] for part in solved), strict=True)))
    return lines, found


def _in_order(parts: Sequence[LineResults], numbers: Sequence[int]) -> LineResults:
    """Put results of conditions with other flanks in the order in which these were given."""
    order = np.argsort(numbers)
    joined = LineResults(*(np.concatenate(arrays) for arrays in zip(*parts, strict=True)))
    return LineResults._make(array[order] if array.size else array for array in joined)


def _stiffness(reduced: ReducedPair, found: LineResults) -> FloatArray:
    """Tangent mesh stiffness along the line of action, (D, A), N/um; NaN where not converged."""
    radius = reduced.layered.pair.pinion.base_radius
    return np.asarray(np.where(found.converged, 1e-3 * found.stiffness / radius**2, np.nan))


def levers_of(lines: Lines, found: LineResults) -> FloatArray:
    """Levers of all states, (D, A, N), mm; under a pinion's corner they turn with the advance."""
    further = np.maximum(found.advance[..., None] - lines.corner_advance, 0.0)
    return np.asarray(lines.lever + lines.lever_slope * further)


def _pair_torques(lines: Lines, found: LineResults) -> tuple[FloatArray, IntArray]:
    """Torque on the pinion that each tooth pair carries, (D, A, pairs), N mm, and the pairs that ever do."""
    pairs = lines.first_pair[:, None] + np.arange(found.torque.shape[2])
    used = np.unique(pairs[(found.torque > 0.0).any(axis=0)])
    if len(lines.first_pair) == 1:
        return found.torque[:, :, used - lines.first_pair[0]], used
    torque = np.zeros((*found.advance.shape, len(used)))
    for column, index in enumerate(used):
        torque[:, :, column] = np.where(pairs == index, found.torque, 0.0).sum(axis=2)
    return torque, used


def _shares(lines: Lines, found: LineResults) -> tuple[FloatArray, IntArray]:
    torque, pairs = _pair_torques(lines, found)
    total = torque.sum(axis=2, keepdims=True)
    return np.divide(torque, total, out=np.zeros_like(torque), where=(total > 0.0) & found.converged[..., None]), pairs


def _states(reduced: ReducedPair, lines: Lines, found: LineResults, advance: FloatArray) -> SweepStates:
    z, levers = reduced.layered.sections.z, levers_of(lines, found)
    carried = (found.force > 0.0) & found.converged[..., None]
    _, angle, place = np.nonzero(carried)
    count = carried.sum(axis=2)
    after = np.cumsum(count.ravel()).reshape(count.shape)
    column = place % len(z)
    loads = ContactLoads(
        first=after - count, count=count, pair=lines.first_pair[angle] + place // len(z),
        slave=np.zeros(len(place), dtype=np.int64), column=column, force_N=found.force[carried],
        lever_mm=levers[carried], mate_lever_mm=lines.mate_lever[angle, place], roll_rad=lines.roll[angle, place],
        z_mm=z[column],
    )  # fmt: skip
    pair_count = lines.gap.shape[1] // len(z)
    pairs = lines.first_pair[:, None] + np.arange(pair_count)
    of_lines = _line_states(reduced, lines, found, pairs, levers)
    return SweepStates(advance, pairs, np.zeros((*advance.shape, pair_count, 0)), loads, of_lines)


def _line_states(
    reduced: ReducedPair, lines: Lines, found: LineResults, pairs: IntArray, levers: FloatArray
) -> LineStates:
    meshed, sections = reduced.layered, reduced.layered.sections
    images, radius = 2 if meshed.mirrored else 1, meshed.pair.pinion.base_radius
    grid = *found.force.shape[:2], pairs.shape[1], len(sections.z)
    load = np.where(found.converged[..., None], found.force, 0.0).reshape(grid) / (images * sections.width)
    patches = np.empty((len(load), load[0].size, PATCH_FIELDS))
    line_patches(lines.law.reshape(-1, lines.law.shape[2]), load.reshape(len(load), -1), patches)
    half_width, offset, pressure = np.moveaxis(patches.reshape(*grid, PATCH_FIELDS), -1, 0)
    return LineStates(
        pair=pairs, z_mm=sections.z, width_mm=sections.width, mirrored=meshed.mirrored,
        roll_rad=lines.roll.reshape(*grid[1:], 2), load_N_per_mm=load, half_width_mm=half_width, offset_mm=offset,
        pressure_MPa=pressure, lever_mm=levers.reshape(grid), mate_lever_mm=lines.mate_lever.reshape(grid[1:]),
        sensitivity=radius * found.sensitivity.reshape(grid),
    )  # fmt: skip
