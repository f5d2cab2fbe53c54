"""The reduced sweep: one compiled call per block of angles, blocks in parallel; line loads have one of their own.

Blocks have a fixed size, so that the result does not depend on the number of threads, to the last bit.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import Executor

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.threads import in_order
from pmor.gear.condition import Assembly, Condition, common_build
from pmor.gear.meshed_pair import MeshedPair
from pmor.pair.conditions import nominal_condition
from pmor.penalty.equilibrium import round_off_residual
from pmor.penalty.kernels.loads import Loads
from pmor.penalty.kernels.shapes import shape_slots
from pmor.penalty.kernels.sweep import Results, Settings, sweep_reduced
from pmor.penalty.kernels.types import Pair
from pmor.penalty.pair import as_penalty
from pmor.penalty.solve import WINDOW_MARGIN, solve_position, standing_depth
from pmor.results.loads import ContactLoads, SweepStates
from pmor.results.sweep import SteSweep
from pmor_online.line_sweep import load_shares, sections_near, sweep_line_loads
from pmor_online.model import ReducedPair, online_angles

# A block starts cold: long enough that this does not count, short enough to share out between threads.
ANGLES_PER_BLOCK = 25
# The kernel iterates on penalty forces: three or four steps are usual, and ever more the stiffer the penalty. Positions
# that take it longer are solved by Newton on the geometry.
MAX_STEPS = 12
# On the residuals before the last step. Measured on the paper's pair, its STE then differs from one that was solved to
# 1e-9 by 4e-7 at most with 200 angles per pitch, far below the error of any basis. A tighter one costs evaluations (at
# 1e-4 a tenth of the time) and gains nothing: a foot at the edge between two patches decides the largest difference.
TOLERANCE = 3e-4
# Last step to a foot, in elements. Each evaluation goes on from the feet of the one before, so they converge together
# with the deformation, and one look at the surface per point is enough.
FOOT_STEP = 1e-4


def sweep_reduced_pair(
    reduced: ReducedPair, phi: FloatArray, conditions: Sequence[Condition], executor: Executor | None = None,
    tolerance: float = TOLERANCE, progress: Callable[[int], None] = lambda n: None, recorded: bool = False,
) -> SteSweep:  # fmt: skip
    """Solve all angles under all conditions with the reduced model.

    Parameters
    ----------
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
    """
    if reduced.basis.shapes is None:
        return sweep_line_loads(reduced, phi, conditions, executor, progress, recorded)
    start = time.perf_counter()
    found, loads = _solve(reduced, phi, conditions, executor, tolerance, progress, recorded)
    base_radius = reduced.meshed.pair.pinion.base_radius
    advance = np.where(found.converged, found.advance, np.nan)
    share, pair_index = load_shares(found.pair, found.pair_torque)
    return SteSweep(
        phi_rad=np.asarray(phi, dtype=float), torque_Nm=np.array([condition.torque_Nm for condition in conditions]),
        ste_um=advance * base_radius * 1e3, pair_share=share, pair_index=pair_index, newton_steps=found.steps,
        converged=found.converged, seconds=time.perf_counter() - start, pitch_rad=reduced.meshed.pair.pitch,
        ste_error_um=1e3 * base_radius * found.slope if reduced.basis.compliance else None,
        states=SweepStates(advance, found.pair, found.amplitude, loads) if loads is not None else None,
    )  # fmt: skip


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
    """Solve all angles in blocks."""
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
        _solve_stiff(reduced, float(angles[i]), conditions, whole, int(i))
    return whole, _in_order(whole, listed) if recorded else None


def _solve_stiff(reduced: ReducedPair, phi: float, conditions: Sequence[Condition], results: Results, i: int) -> None:
    """Solve angle number `i` by Newton on the geometry, which takes any penalty; error bars and loads stay empty."""
    solved = solve_position(as_penalty(reduced.meshed), phi, conditions, reduced.shape_elasticity_at)
    index = solved.position.pair_index
    results.pair[i, : len(index)], results.pair[i, len(index) :] = index, index.min() - 1
    for t, equilibrium in enumerate(solved.equilibria):
        if equilibrium is not None:
            results.advance[t, i], results.steps[t, i] = equilibrium.advance, equilibrium.steps
            results.converged[t, i], results.pair_torque[t, i] = True, 0.0
            results.pair_torque[t, i, : len(index)] = equilibrium.pair_torque(len(index))


def _settings(
    reduced: ReducedPair, conditions: Sequence[Condition], tolerance: float, recorded: bool
) -> tuple[Settings, FloatArray]:
    """How the kernel solves for some conditions, and their torques, N mm."""
    meshed = as_penalty(reduced.meshed)
    torques = np.array([condition.torque for condition in conditions])
    hardest, rate = conditions[int(np.argmax(torques))], meshed.expected_approach(1.0)
    depth = WINDOW_MARGIN * rate * torques.max() + standing_depth(meshed, hardest)
    tolerance = max(tolerance, round_off_residual(meshed, float(torques.min())))
    clearance = meshed.clearance(hardest.assembly)
    return Settings(recorded, meshed.tooth_pair_count, rate, depth, clearance, MAX_STEPS, tolerance), torques


def _no_results(applied_loads: int, angles: int, pair_count: int, slots: int) -> Results:
    grid = applied_loads, angles
    return Results(
        advance=np.zeros(grid), steps=np.zeros(grid, dtype=np.int64), converged=np.zeros(grid, dtype=bool),
        pair=np.zeros((angles, pair_count), dtype=np.int64), active_shapes=np.zeros(angles, dtype=np.int64),
        pair_torque=np.zeros((*grid, pair_count)), slope=np.full(grid, np.nan),
        amplitude=np.zeros((*grid, pair_count, slots)), load_first=np.zeros(grid, dtype=np.int64),
        load_count=np.zeros(grid, dtype=np.int64),
    )  # fmt: skip


def _in_order(results: Results, listed: list[Loads]) -> ContactLoads:
    """Bring loads into the order of the states, (torques, angles)."""
    count = results.load_count.ravel()
    after = np.cumsum(count)
    shift = np.repeat(results.load_first.ravel() - (after - count), count)
    order = np.arange(len(shift)) + shift
    columns = [np.concatenate(parts)[order] for parts in zip(*listed, strict=True)]
    first = (after - count).reshape(results.load_count.shape)
    return ContactLoads(first, results.load_count, *columns)
