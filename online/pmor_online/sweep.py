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
from pmor.contact.condition import Condition, common_axes
from pmor.contact.equilibrium import round_off_residual
from pmor.contact.flank import KernelScheme, MeshedPair
from pmor.contact.kernel import sweep_reduced
from pmor.contact.position import pairs_in_reach
from pmor.contact.search import clearance
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
    kinematics = reduced.meshed.kinematics(common_axes(conditions))
    reach = pairs_in_reach(reduced.meshed)
    grid = len(loads), len(angles)
    lead, steps, converged = np.zeros(grid), np.zeros(grid, dtype=np.int64), np.zeros(grid, dtype=bool)
    pairs, pair_torque = np.zeros((len(angles), reach), dtype=np.int64), np.zeros((*grid, reach))
    slope = np.full(grid, np.nan)

    def solve(block: slice) -> int:
        whole = lead, steps, converged, slope
        outputs = tuple(np.ascontiguousarray(a[:, block]) for a in whole)
        block_pairs, block_torque = pairs[block], np.ascontiguousarray(pair_torque[:, block])
        _solve_block(reduced, kinematics, angles[block], conditions, tolerance, outputs, block_pairs, block_torque)
        for array, part in zip(whole, outputs, strict=True):
            array[:, block] = part
        pair_torque[:, block] = block_torque
        return len(block_pairs)

    blocks = [slice(i, i + ANGLES_PER_BLOCK) for i in range(0, len(angles), ANGLES_PER_BLOCK)]
    with ThreadPoolExecutor(max_workers=jobs) as pool:
        for done in pool.map(solve, blocks):
            advance(done)
    for i in np.flatnonzero(~converged.all(axis=0)):
        outputs = lead[:, i], steps[:, i], converged[:, i], slope[:, i]
        _solve_again(reduced, float(angles[i]), conditions, outputs, pairs[i], pair_torque[:, i])
    base_radius = reduced.meshed.pair.pinion.base_radius
    ste = np.where(converged, lead, np.nan) * base_radius * 1e3
    share, pair_index = _shares(pairs, pair_torque)
    return SteSweep(
        phi_rad=angles,
        torque_Nm=loads * 1e-3,
        ste_um=ste,
        pair_share=share,
        pair_index=pair_index,
        newton_steps=steps,
        converged=converged,
        seconds=time.perf_counter() - start,
        pitch_rad=reduced.meshed.pair.pitch,
        ste_error_um=1e3 * base_radius * slope if reduced.basis.compliance else None,
    )


def sweep_scheme(meshed: MeshedPair) -> KernelScheme:
    """Return the contact scheme for the kernel with the sweep's own way to the feet of the contact points."""
    scheme = meshed.kernel_scheme
    return (*scheme[:7], FOOT_STEP, *scheme[8:])


def _solve_block(
    reduced: ReducedPair,
    kinematics: FloatArray,
    phi: FloatArray,
    conditions: Sequence[Condition],
    tolerance: float,
    outputs: tuple[np.ndarray, ...],
    pairs: np.ndarray,
    pair_torque: np.ndarray,
) -> None:
    meshed = reduced.meshed
    lead, steps, converged, slope = outputs
    torques = np.array([condition.given_torque for condition in conditions])
    tolerance = max(tolerance, round_off_residual(meshed, float(torques.min())))
    depth = standing_depth(meshed, max(conditions, key=lambda condition: condition.given_torque))
    sweep_reduced(
        phi, torques, meshed.expected_approach(1.0), kinematics, meshed.gears, sweep_scheme(meshed),
        reduced.family, reduced.kernel_compliance, WINDOW_MARGIN, depth, clearance(meshed.scheme), MAX_STEPS, tolerance,
        lead, steps, converged, pairs, pair_torque, slope,
    )  # fmt: skip


def _solve_again(
    reduced: ReducedPair,
    phi: float,
    conditions: Sequence[Condition],
    outputs: tuple[np.ndarray, ...],
    pairs: np.ndarray,
    pair_torque: np.ndarray,
) -> None:
    """Solve an angle by the slow twin, which takes any penalty; fill the torques that the compiled sweep left open."""
    lead, steps, converged, slope = outputs
    compliance = reduced.basis.compliance
    solved = solve_position(reduced.meshed, phi, conditions, reduced.elasticity_at)
    index = solved.position.pair_index
    pairs[: len(index)], pairs[len(index) :] = index, index.min() - 1
    for t, equilibrium in enumerate(solved.equilibria):
        if equilibrium is None:
            continue
        lead[t], steps[t], converged[t] = equilibrium.lead, equilibrium.steps, True
        pair_torque[t], pair_torque[t, : len(index)] = 0.0, equilibrium.pair_torque(len(index))
        if compliance is not None:
            elasticity = reduced.elasticity_at(solved.position)
            slope[t] = discarded_energy_slope(compliance, solved.position, elasticity, equilibrium.contact)


def _shares(pairs: np.ndarray, pair_torque: np.ndarray) -> tuple[FloatArray, np.ndarray]:
    """Carry the torques of the pairs in reach at each angle to a common list of pairs, as fractions."""
    total = pair_torque.sum(axis=2, keepdims=True)
    fractions = np.divide(pair_torque, total, out=np.zeros_like(pair_torque), where=total > 0.0)
    used = np.unique(pairs[(fractions > 0.0).any(axis=0)])
    share = np.zeros((*fractions.shape[:2], len(used)))
    for column, index in enumerate(used):
        share[:, :, column] = np.where(pairs == index, fractions, 0.0).sum(axis=2)
    return share, used
