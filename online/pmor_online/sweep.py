"""The reduced sweep: one compiled call per block of angles, blocks in parallel; line loads have one of their own.

The mechanics of the reduced pair stand in the code twice, for a reason. The compiled sweep iterates on contact forces:
fast, a few microseconds a step, but the stiffer the penalty, the more steps, until there are too many. What it does not
solve goes to `pmor.penalty.equilibrium` with a reduced elasticity, whose steps do not depend on the penalty, and which
is the one that full FE goes through as well. In the tests that is the slow and obvious twin of the compiled sweep.

Blocks have a fixed size, so that the result does not depend on the number of threads, to the last bit.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import Executor

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.threads import in_order
from pmor.gear.condition import ALIGNED, Assembly, Condition, Misalignment, at_advances, common_build
from pmor.gear.meshed_pair import MeshedPair
from pmor.pair.conditions import nominal_condition
from pmor.penalty.equilibrium import expected_approach, round_off_residual
from pmor.penalty.kernels.loads import Loads, empty_loads, list_loads, trimmed
from pmor.penalty.kernels.shapes import gather_active_shapes, shape_slots
from pmor.penalty.kernels.state import Points
from pmor.penalty.kernels.sweep import Results, Settings, sweep_reduced
from pmor.penalty.kernels.types import Pair
from pmor.penalty.pair import as_penalty
from pmor.penalty.position import Position
from pmor.penalty.search import Contact
from pmor.penalty.solve import WINDOW_MARGIN, solve_position, standing_depth
from pmor.reduction.error_estimate import discarded_energy_slope
from pmor.results.force_law import ForceLaw
from pmor.results.loads import ContactLoads, SweepStates
from pmor.results.sweep import SteSweep
from pmor_online.line_sweep import line_force_law, sections_near, sweep_line_loads
from pmor_online.model import ReducedPair, online_angles

# A block starts cold: long enough that this does not count, short enough to share out between threads.
ANGLES_PER_BLOCK = 25
# The compiled sweep iterates on penalty forces, which costs three or four steps a position, and ever more the stiffer
# the penalty; what takes it longer than this is left to the slow twin, whose steps do not depend on the penalty.
MAX_STEPS = 12
# On the residuals before the last step. Measured on the paper's pair, its STE then differs from one that was solved to
# 1e-9 by 4e-7 at most with 200 angles per pitch, far below the error of any basis. A tighter one costs evaluations (at
# 1e-4 a tenth of the time) and gains nothing: a foot at the edge between two patches decides the largest difference.
TOLERANCE = 3e-4
# Last step to a foot, in elements. Each evaluation goes on from the feet of the one before, so they converge together
# with the deformation, and one look at the surface per point is enough.
FOOT_STEP = 1e-4


def sweep_reduced_pair(
    reduced: ReducedPair,
    phi: FloatArray,
    conditions: Sequence[Condition],
    executor: Executor | None = None,
    tolerance: float = TOLERANCE,
    progress: Callable[[int], None] = lambda n: None,
    recorded: bool = False,
) -> SteSweep:
    """Solve all angles under all conditions with the reduced model.

    Parameters
    ----------
    reduced : ReducedPair
    phi : ndarray, shape (n,)
        Pinion angles, rad; neighbours should be close, each starts from the one before.
    conditions : sequence of Condition
        Torques with the same axes and flanks.
    executor : concurrent.futures.Executor, optional
        Of threads; solves several blocks of angles at a time.
    tolerance : float
        On the relative residuals that are evaluated, before a last step.
    progress : callable
        Called with the number of angles done, for progress.
    recorded : bool
        Keep advance, amplitudes and contact forces of all states too.

    Returns
    -------
    SteSweep
    """
    if reduced.basis.shapes is None:
        return sweep_line_loads(reduced, phi, conditions, executor, progress, recorded)
    start = time.perf_counter()
    found, loads = _solve(reduced, phi, conditions, executor, tolerance, progress, recorded)
    base_radius = reduced.meshed.pair.pinion.base_radius
    advance = np.where(found.converged, found.advance, np.nan)
    share, pair_index = _shares(found.pair, found.pair_torque)
    return SteSweep(
        phi_rad=np.asarray(phi, dtype=float),
        torque_Nm=np.array([condition.torque_Nm for condition in conditions]),
        ste_um=advance * base_radius * 1e3,
        pair_share=share,
        pair_index=pair_index,
        newton_steps=found.steps,
        converged=found.converged,
        seconds=time.perf_counter() - start,
        pitch_rad=reduced.meshed.pair.pitch,
        ste_error_um=1e3 * base_radius * found.slope if reduced.basis.compliance else None,
        states=SweepStates(advance, found.pair, found.amplitude, loads) if loads is not None else None,
    )


def reduced_force_law(
    reduced: ReducedPair,
    phi: FloatArray,
    advances: Sequence[float],
    misalignment: Misalignment = ALIGNED,
    executor: Executor | None = None,
    tolerance: float = TOLERANCE,
    progress: Callable[[int], None] = lambda n: None,
) -> ForceLaw:
    """Find the torque that the contact forces make where the pinion's advance is given: F(phi, advance, axes).

    Parameters
    ----------
    advances : sequence of float
        rad, from where plain flanks on aligned axes touch.
    misalignment : Misalignment
    reduced, phi, executor, tolerance, progress
        As in `sweep_reduced_pair`.

    Returns
    -------
    ForceLaw
    """
    if reduced.basis.shapes is None:
        return line_force_law(reduced, phi, advances, Assembly(misalignment), executor, progress)
    start = time.perf_counter()
    found, _ = _solve(reduced, phi, at_advances(advances, misalignment), executor, tolerance, progress, False)
    pairs = np.unique(found.pair)
    torque = np.zeros((*found.advance.shape, len(pairs)))
    for column, index in enumerate(pairs):
        torque[:, :, column] = np.where(found.pair == index, found.pair_torque, 0.0).sum(axis=2)
    torque[~found.converged] = np.nan
    return ForceLaw(
        phi_rad=np.asarray(phi, dtype=float),
        advance_rad=np.asarray(advances, dtype=float),
        pair_torque_Nm=1e-3 * torque,
        pair_index=pairs,
        newton_steps=found.steps,
        converged=found.converged,
        seconds=time.perf_counter() - start,
    )


def sweep_pair(meshed: MeshedPair, assembly: Assembly) -> Pair:
    """Return the pair for the kernels with the sweep's own way to the feet of the contact points."""
    pair = as_penalty(meshed).for_kernels(assembly)
    return pair._replace(scheme=pair.scheme._replace(foot_step=FOOT_STEP))


def largest_size(reduced: ReducedPair) -> int:
    """Return the largest number of unknowns over a pitch under the nominal torque: amplitudes and the rotation.

    Of line loads: the sections that come within the expected approach.
    """
    condition = nominal_condition(reduced.basis.case)
    angles = online_angles(reduced.meshed.pair.pitch, 50)
    if reduced.basis.shapes is None:
        return sections_near(reduced, angles, condition) + 1
    found, _ = _solve(reduced, angles, [condition], None, TOLERANCE, lambda n: None, False)
    return int(found.active_shapes.max()) + 1


def _solve(
    reduced: ReducedPair, phi: FloatArray, conditions: Sequence[Condition], executor: Executor | None, tolerance: float,
    progress: Callable[[int], None], recorded: bool,
) -> tuple[Results, ContactLoads | None]:  # fmt: skip
    """Solve all angles in blocks, and again by the slow twin what took the compiled sweep too many steps."""
    angles = np.ascontiguousarray(phi, dtype=float)
    settings, applied_loads = _settings(reduced, conditions, tolerance, recorded)
    slots = shape_slots(reduced.family) if recorded else 0
    whole = _no_results(len(applied_loads), len(angles), settings.pair_count, slots)
    pair = sweep_pair(reduced.meshed, common_build(conditions))

    def solve(block: slice) -> tuple[Results, Loads]:
        part = _no_results(len(applied_loads), len(angles[block]), settings.pair_count, slots)
        compliance = reduced.kernel_compliance
        return part, sweep_reduced(angles[block], applied_loads, pair, reduced.family, compliance, settings, part)

    blocks = [slice(i, i + ANGLES_PER_BLOCK) for i in range(0, len(angles), ANGLES_PER_BLOCK)]
    listed: list[Loads] = []
    for block, (part, loads) in zip(blocks, in_order(solve, blocks, executor), strict=True):
        part.load_first[:] += sum(len(before.z) for before in listed)
        for name, values in part._asdict().items():
            getattr(whole, name)[(block,) if name in ("pair", "active_shapes") else (slice(None), block)] = values
        listed.append(loads)
        progress(len(part.pair))
    for i in np.flatnonzero(~whole.converged.all(axis=0)):
        _solve_again(reduced, float(angles[i]), conditions, whole, int(i), listed if recorded else None)
    return whole, _in_order(whole, listed) if recorded else None


def _settings(
    reduced: ReducedPair, conditions: Sequence[Condition], tolerance: float, recorded: bool
) -> tuple[Settings, FloatArray]:
    """How the kernel solves for some conditions, and their torques (N mm) or advances (rad)."""
    meshed, held = as_penalty(reduced.meshed), conditions[0].torque is None
    applied_loads = np.array([condition.advance if held else condition.given_torque for condition in conditions])
    hardest, rate = conditions[int(np.argmax(applied_loads))], meshed.expected_approach(1.0)
    standing, least = standing_depth(meshed, hardest), float(applied_loads.min())
    largest = float(applied_loads.max())
    if held:
        largest -= meshed.kinematics(hardest.misalignment).first_touch
        # Windows that hold something, and round-off of the largest forces, where the flanks may be apart.
        standing += WINDOW_MARGIN * rate
        rate, least = meshed.pair.pinion.base_radius, max(expected_approach(meshed, hardest) / rate, 1.0)
    tolerance, depth = (
        max(tolerance, round_off_residual(meshed, least)),
        WINDOW_MARGIN * rate * max(largest, 0.0),
    )
    return Settings(
        held, recorded, meshed.tooth_pair_count, rate, depth + standing, meshed.clearance(hardest.assembly), MAX_STEPS,
        tolerance,
    ), applied_loads  # fmt: skip


def _no_results(applied_loads: int, angles: int, pair_count: int, slots: int) -> Results:
    grid = applied_loads, angles
    return Results(
        advance=np.zeros(grid),
        steps=np.zeros(grid, dtype=np.int64),
        converged=np.zeros(grid, dtype=bool),
        pair=np.zeros((angles, pair_count), dtype=np.int64),
        active_shapes=np.zeros(angles, dtype=np.int64),
        pair_torque=np.zeros((*grid, pair_count)),
        slope=np.full(grid, np.nan),
        amplitude=np.zeros((*grid, pair_count, slots)),
        load_first=np.zeros(grid, dtype=np.int64),
        load_count=np.zeros(grid, dtype=np.int64),
    )


def _solve_again(
    reduced: ReducedPair, phi: float, conditions: Sequence[Condition], results: Results, i: int,
    listed: list[Loads] | None,
) -> None:  # fmt: skip
    """Solve angle number i, under all conditions, by the slow twin, which takes any penalty."""
    compliance = reduced.basis.compliance
    solved = solve_position(as_penalty(reduced.meshed), phi, conditions, reduced.elasticity_at)
    position, index = solved.position, solved.position.pair_index
    elasticity = reduced.shape_elasticity_at(position)
    results.pair[i, : len(index)], results.pair[i, len(index) :] = index, index.min() - 1
    for t, equilibrium in enumerate(solved.equilibria):
        if equilibrium is None:
            continue
        results.advance[t, i], results.steps[t, i] = equilibrium.advance, equilibrium.steps
        results.converged[t, i] = True
        results.pair_torque[t, i] = 0.0
        results.pair_torque[t, i, : len(index)] = equilibrium.pair_torque(len(index))
        if compliance is not None and conditions[t].advance is None:
            found = discarded_energy_slope(compliance, position, elasticity, equilibrium.contact)
            results.slope[t, i] = found
        if listed is not None:
            results.load_first[t, i] = sum(len(before.z) for before in listed)
            listed.append(_loads_of(position, equilibrium.contact))
            results.load_count[t, i] = len(listed[-1].z)
            results.amplitude[t, i] = _amplitudes_of(reduced, position, equilibrium.contact, results.amplitude[t, i])


def _loads_of(position: Position, contact: Contact) -> Loads:
    points = Points(
        contact.pair, contact.slave, contact.index, contact.weight, contact.gap, contact.stiffness, contact.lever,
        contact.mate_lever, contact.place,
    )  # fmt: skip
    workspace = empty_loads(len(contact.gap))
    count = list_loads(len(contact.gap), position.kernel_pair.gears, position.patches, points, 0, workspace)
    return trimmed(workspace, count)


def _amplitudes_of(reduced: ReducedPair, position: Position, contact: Contact, like: FloatArray) -> FloatArray:
    """Amplitudes with which the active shapes carry contact forces, shape (P, slots)."""
    active_shapes = gather_active_shapes(position.kernel_pair, position.patches, len(position.nodes), reduced.family)
    force, work = contact.nodal_forces(contact.force, len(position.nodes)), np.zeros(active_shapes.size)
    for gear, (low, high) in enumerate(active_shapes.ranges):
        for p in range(len(position.pair_index)):
            window = position.window_slice(p, gear)
            fields = active_shapes.fields[: high - low, 3 * window.start : 3 * window.stop]
            work[low:high] += fields @ force[window].ravel()
    found = np.zeros(like.size)
    found[active_shapes.slot[: active_shapes.size]] = np.linalg.solve(
        active_shapes.gram[: active_shapes.size, : active_shapes.size], work
    )
    return found.reshape(like.shape)


def _in_order(results: Results, listed: list[Loads]) -> ContactLoads:
    """Bring loads into the order of the states, (torques, angles)."""
    count = results.load_count.ravel()
    after = np.cumsum(count)
    shift = np.repeat(results.load_first.ravel() - (after - count), count)
    order = np.arange(len(shift)) + shift
    columns = [np.concatenate(parts)[order] for parts in zip(*listed, strict=True)]
    first = (after - count).reshape(results.load_count.shape)
    return ContactLoads(first, results.load_count, *columns)


def _shares(pairs: np.ndarray, pair_torque: np.ndarray) -> tuple[FloatArray, np.ndarray]:
    """Carry the torques of the pairs that can touch at each angle to a common list of pairs, as fractions."""
    total = pair_torque.sum(axis=2, keepdims=True)
    fractions = np.divide(pair_torque, total, out=np.zeros_like(pair_torque), where=total > 0.0)
    used = np.unique(pairs[(fractions > 0.0).any(axis=0)])
    share = np.zeros((*fractions.shape[:2], len(used)))
    for column, index in enumerate(used):
        share[:, :, column] = np.where(pairs == index, fractions, 0.0).sum(axis=2)
    return share, used
