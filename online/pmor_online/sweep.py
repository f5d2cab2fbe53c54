"""The reduced sweep: one compiled call per block of angles, blocks in parallel.

The same mechanics as `pmor.pair.sweep.sweep_ste` with a reduced elasticity, which is its slow and obvious twin in the
tests. Blocks have a fixed size, so that the result does not depend on the number of threads, to the last bit.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from pmor.arrays import FloatArray
from pmor.contact.condition import Axes, Condition, common_axes
from pmor.contact.equilibrium import round_off_residual
from pmor.contact.flank import MeshedPair
from pmor.contact.kernels.sweep import Results, Settings, sweep_reduced
from pmor.contact.kernels.types import Pair
from pmor.contact.position import pairs_in_reach
from pmor.contact.solve import WINDOW_MARGIN, solve_position, standing_depth
from pmor.reduction.error_estimate import discarded_energy_slope
from pmor.results.sweep import SteSweep
from pmor_online.model import ReducedPair

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
    jobs: int = 1,
    tolerance: float = TOLERANCE,
    advance: Callable[[int], None] = lambda n: None,
) -> SteSweep:
    """Solve all angles under all conditions with the reduced model.

    Parameters
    ----------
    reduced : ReducedPair
    phi : ndarray, shape (n,)
        Pinion angles, rad; neighbours should be close, each starts from the one before.
    conditions : sequence of Condition
        Torques with the same axes.
    jobs : int
        Threads.
    tolerance : float
        On the relative residuals that are evaluated, before a last step.
    advance : callable
        Called with the number of angles done, for progress.

    Returns
    -------
    SteSweep
    """
    start = time.perf_counter()
    angles, loads = np.ascontiguousarray(phi, dtype=float), np.array([c.given_torque for c in conditions])
    whole = _no_results(len(loads), len(angles), pairs_in_reach(reduced.meshed))

    def solve(block: slice) -> int:
        part = _no_results(len(loads), len(angles[block]), whole.pair.shape[1])
        _solve_block(reduced, angles[block], conditions, tolerance, part)
        for name, values in part._asdict().items():
            where = (block,) if name == "pair" else (slice(None), block)
            getattr(whole, name)[where] = values
        return len(part.pair)

    blocks = [slice(i, i + ANGLES_PER_BLOCK) for i in range(0, len(angles), ANGLES_PER_BLOCK)]
    with ThreadPoolExecutor(max_workers=jobs) as pool:
        for done in pool.map(solve, blocks):
            advance(done)
    for i in np.flatnonzero(~whole.converged.all(axis=0)):
        _solve_again(reduced, float(angles[i]), conditions, whole, int(i))
    base_radius = reduced.meshed.pair.pinion.base_radius
    share, pair_index = _shares(whole.pair, whole.pair_torque)
    return SteSweep(
        phi_rad=angles,
        torque_Nm=loads * 1e-3,
        ste_um=np.where(whole.converged, whole.lead, np.nan) * base_radius * 1e3,
        pair_share=share,
        pair_index=pair_index,
        newton_steps=whole.steps,
        converged=whole.converged,
        seconds=time.perf_counter() - start,
        pitch_rad=reduced.meshed.pair.pitch,
        ste_error_um=1e3 * base_radius * whole.slope if reduced.basis.compliance else None,
    )


def sweep_pair(meshed: MeshedPair, axes: Axes) -> Pair:
    """Return the pair for the kernels with the sweep's own way to the feet of the contact points."""
    pair = meshed.for_kernels(axes)
    return pair._replace(scheme=pair.scheme._replace(foot_step=FOOT_STEP))


def _no_results(torques: int, angles: int, reach: int) -> Results:
    grid = torques, angles
    return Results(
        lead=np.zeros(grid),
        steps=np.zeros(grid, dtype=np.int64),
        converged=np.zeros(grid, dtype=bool),
        pair=np.zeros((angles, reach), dtype=np.int64),
        pair_torque=np.zeros((*grid, reach)),
        slope=np.full(grid, np.nan),
    )


def _solve_block(
    reduced: ReducedPair, phi: FloatArray, conditions: Sequence[Condition], tolerance: float, results: Results
) -> None:
    meshed, torques = reduced.meshed, np.array([condition.given_torque for condition in conditions])
    settings = Settings(
        reachable=results.pair.shape[1],
        approach_rate=meshed.expected_approach(1.0),
        margin=WINDOW_MARGIN,
        standing_depth=standing_depth(meshed, max(conditions, key=lambda condition: condition.given_torque)),
        clearance=meshed.scheme.clearance,
        max_steps=MAX_STEPS,
        tolerance=max(tolerance, round_off_residual(meshed, float(torques.min()))),
    )
    pair = sweep_pair(meshed, common_axes(conditions))
    sweep_reduced(phi, torques, pair, reduced.family, reduced.kernel_compliance, settings, results)


def _solve_again(
    reduced: ReducedPair, phi: float, conditions: Sequence[Condition], results: Results, i: int
) -> None:
    """Solve angle number i, under all conditions, by the slow twin, which takes any penalty."""
    compliance = reduced.basis.compliance
    solved = solve_position(reduced.meshed, phi, conditions, reduced.elasticity_at)
    index = solved.position.pair_index
    elasticity = reduced.elasticity_at(solved.position) if compliance is not None else None
    results.pair[i, : len(index)], results.pair[i, len(index) :] = index, index.min() - 1
    for t, equilibrium in enumerate(solved.equilibria):
        if equilibrium is None:
            continue
        results.lead[t, i], results.steps[t, i] = equilibrium.lead, equilibrium.steps
        results.converged[t, i] = True
        results.pair_torque[t, i] = 0.0
        results.pair_torque[t, i, : len(index)] = equilibrium.pair_torque(len(index))
        if compliance is not None and elasticity is not None:
            found = discarded_energy_slope(compliance, solved.position, elasticity, equilibrium.contact)
            results.slope[t, i] = found


def _shares(pairs: np.ndarray, pair_torque: np.ndarray) -> tuple[FloatArray, np.ndarray]:
    """Carry the torques of the pairs in reach at each angle to a common list of pairs, as fractions."""
    total = pair_torque.sum(axis=2, keepdims=True)
    fractions = np.divide(pair_torque, total, out=np.zeros_like(pair_torque), where=total > 0.0)
    used = np.unique(pairs[(fractions > 0.0).any(axis=0)])
    share = np.zeros((*fractions.shape[:2], len(used)))
    for column, index in enumerate(used):
        share[:, :, column] = np.where(pairs == index, fractions, 0.0).sum(axis=2)
    return share, used
