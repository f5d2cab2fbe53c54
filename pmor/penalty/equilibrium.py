"""Static equilibrium of the pair under a torque on the pinion: Newton on the geometry, guarded.

The wheel is held. A step solves the unilateral contact problem linearised about the present geometry: which points
carry load is settled on the linearised gaps of all points that penetrate or nearly do. The geometry alone is left to
iterate: a stiff penalty costs no more steps than a soft one. Residual *forces* are no guide: the penalty times errors
of the gap, they are off by orders of magnitude where forces are right to a per mille. The measure is the correction of
the next step in the energy norm: the error itself, whatever the penalty.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from pmor.core.arrays import FloatArray
from pmor.core.errors import ConvergenceError
from pmor.gear.condition import Condition
from pmor.penalty.elasticity import Elasticity
from pmor.penalty.kernels.search import search_workspace
from pmor.penalty.pair import PenaltyPair
from pmor.penalty.position import Position
from pmor.penalty.search import Contact, search_contact

# Gaps are differences of coordinates, some hundred operations behind the nodes, and a hundredth of the approach.
ROUND_OFF_FACTOR = 200.0
# Points count as near when they penetrate with the pinion ahead by this share of the approach at a start, and by that
# share of the last correction later: the geometry's error, which is second order in it, must not hide a point that
# carries load; but at the edges of a flank the area of a point changes with it.
NEARBY, NEARER = 0.1, 0.03
# Below this correction the nearby points of a first look are searched again, as close as the correction says.
CLOSE = 1e-3
# Of the linear contact problem: rounds without progress before points change sides singly, and rounds in all.
PIVOT_PATIENCE, MOST_PIVOTS = 3, 20
# Shares of the penalty by which it is softened and hardened again where that does not end, and the smallest.
SOFTER, HARDER, SOFTEST = 1e-2, 10.0, 1e-9
HALVINGS = 8
# Penetration of a start, over the expected approach, above which it is turned back.
DEEP = 3.0
# Corrections that fall by less than this factor fall linearly; the last ones, so many, then say where they advance.
SLOW, MEMORY = 0.03, 4
# Under extreme loads corrections fall linearly, and end in round-off of the deformation: this is enough then.
LINEAR = 1e-8
# A step is good when its correction is below one of the last ones, so many: the area of a point at the edge of a flank
# changes with its foot, which the linearised problem leaves out, and corrections need not fall at every step. They may
# not grow by more than this factor, though.
PATIENCE, MOST_GROWTH = 3, 10.0


@dataclass(frozen=True)
class Equilibrium:
    """A converged state.

    Parameters
    ----------
    advance : float
        Rotation of the pinion ahead of its kinematic position, rad.
    coordinates : ndarray
        Of the elastic model.
    steps : int
        Newton steps taken.
    history : tuple of (correction of the coordinates, correction of the advance)
        Relative, before each step and at the end.
    """

    advance: float
    coordinates: FloatArray
    contact: Contact
    steps: int
    history: tuple[tuple[float, float], ...]

    def scaled_start(self, factor: float, touch: float) -> tuple[FloatArray, float]:
        """Return coordinates and advance to start from at `factor` times the torque; plain flanks touch at `touch`."""
        return self.coordinates * factor, touch + (self.advance - touch) * factor

    def pair_torque(self, n_pairs: int) -> FloatArray:
        """Return the torque on the pinion that each tooth pair carries, shape (n_pairs,), N mm."""
        contact = self.contact
        torque = np.bincount(contact.pair, weights=-contact.force * contact.lever, minlength=n_pairs)
        return np.asarray(torque, dtype=float)

    @property
    def wheel_torque(self) -> float:
        """Torque of the contact forces on the wheel, N mm."""
        return float(self.contact.force @ self.contact.mate_lever)


@dataclass(frozen=True)
class _State:
    """A state, and how far the linearised contact problem about it says that it is from equilibrium."""

    advance: float
    coordinates: FloatArray
    contact: Contact  # points that carry load in the linearised problem, with its gaps
    correction: FloatArray  # of the coordinates
    rotation: float  # correction of the advance, rad
    error: tuple[float, float]  # both corrections over solution and approach; infinite without contact
    smallest_gap: float  # mm; infinite where no flank faces its mate


Evaluate = Callable[[FloatArray, float, float], _State]
# Coordinates, rotation and gaps of a linearised contact problem.
_Linear = tuple[FloatArray, float, FloatArray]


def solve_equilibrium(
    meshed: PenaltyPair, position: Position, elasticity: Elasticity, condition: Condition,
    start: tuple[FloatArray, float] | None = None, max_steps: int = 40, tolerance: float = 1e-9, remember: bool = False,
) -> Equilibrium:  # fmt: skip
    """Solve for the elastic coordinates and the pinion's advance.

    Parameters
    ----------
    condition : Condition
        With the axes and flanks of the position.
    start : (ndarray, float), optional
        Elastic coordinates and advance (rad) to start from; by default the undeformed pair at the expected approach.
    tolerance : float
        On the relative corrections of the coordinates (energy norm) and of the advance.
    remember : bool
        Look for each point on the patch where it was found in the step before. Normals jump a little from patch to
        patch, so that a point at their border can go to and fro between them for ever; on either side of it there is
        an equilibrium.

    Raises
    ------
    ConvergenceError
        With the history of corrections, when the tolerance is not reached, or nothing touches.
    """
    base_radius, torque = meshed.pair.pinion.base_radius, condition.torque
    tolerance = max(tolerance, round_off_residual(meshed, torque))
    closing = meshed.expected_closing(torque, position.assembly.misalignment)
    approach = closing + expected_penetration(meshed, torque)
    workspace = search_workspace(position.kernel_pair, position.patches) if remember else None
    search = partial(search_contact, meshed, position, workspace=workspace)

    def evaluate(coordinates: FloatArray, advance: float, depth: float) -> _State:
        return _evaluate(search, meshed, elasticity, torque, approach, coordinates, advance, depth)

    touch = position.kernel_pair.kinematics.first_touch
    coordinates, advance = start or (elasticity.zero(), touch + approach / base_radius)
    state = evaluate(coordinates, advance, NEARBY * approach)
    if state.smallest_gap < -DEEP * approach:
        # So deep inside each other the flanks' nearest points say nothing: begin where they should be.
        advance = state.advance + (state.smallest_gap + approach) / base_radius
        state = evaluate(state.coordinates, advance, NEARBY * approach)
    state = _closer(state, evaluate, approach)
    history: list[tuple[float, float]] = []
    passed: list[_State] = []
    for step in range(max_steps + 1):
        history.append(state.error)
        linear = bool(passed) and max(state.error) > 0.1 * max(passed[-1].error)
        if max(state.error) <= (max(tolerance, LINEAR) if linear else tolerance):
            return Equilibrium(state.advance, state.coordinates, state.contact, step, tuple(history))
        if math.isfinite(state.error[1]):
            target = _extrapolated(passed, state)
            passed = [*passed[1 - MEMORY :], state]
            limit = min(max(max(s.error) for s in passed[-PATIENCE:]), MOST_GROWTH * max(state.error))
            state = _guarded_step(state, target, limit, evaluate, approach)
            continue
        if not math.isfinite(state.smallest_gap):
            raise ConvergenceError(f"no flank faces its mate at phi = {position.phi:.6g} rad", history)
        advance = state.advance + (state.smallest_gap + approach) / base_radius
        state = evaluate(state.coordinates, advance, NEARBY * approach)
    raise ConvergenceError(
        f"no equilibrium at phi = {position.phi:.6g} rad, {condition.load_text} after {max_steps} Newton steps "
        f"(last corrections: deformation {history[-1][0]:.2g}, advance {history[-1][1]:.2g})",
        history,
    )


def round_off_residual(meshed: PenaltyPair, torque: float) -> float:
    """Return the relative error below which a state under a pinion torque (N mm) is round-off of the coordinates."""
    coordinate_error = np.finfo(float).eps * meshed.pair.centre_distance
    return float(ROUND_OFF_FACTOR * coordinate_error / meshed.expected_approach(torque))


def expected_penetration(meshed: PenaltyPair, torque: float) -> float:
    """Return by how much flanks penetrate under the penalty where one tooth pair carries a torque (N mm), mm.

    A bed of stiffness k takes up a load per width of ``4/3 k d sqrt(2 rho d)`` when a cylinder of relative radius rho
    penetrates it by d; rho is that at the pitch point.
    """
    pair = meshed.pair
    load = torque / pair.pinion.base_radius / pair.common_width
    return float((0.75 * load / (meshed.scheme.penalty * math.sqrt(2.0 * pair.pitch_point_radius))) ** (2.0 / 3.0))


def _evaluate(
    search: Callable[..., Contact], meshed: PenaltyPair, elasticity: Elasticity, torque: float, approach: float,
    coordinates: FloatArray, advance: float, depth: float,
) -> _State:  # fmt: skip
    """Solve the contact problem linearised about a state, with all points that penetrate `depth` (mm) further ahead."""
    base_radius = meshed.pair.pinion.base_radius
    displacement = elasticity.displacement(coordinates)
    ahead = depth / base_radius
    contact = search(displacement, advance + ahead)
    smallest_gap = contact.smallest_gap + ahead * base_radius
    present = contact.gap - contact.lever * ahead
    free = present - contact.gap_change(displacement)
    round_off = np.finfo(float).eps * meshed.pair.centre_distance
    if not len(contact.gap):
        return _State(advance, coordinates, contact, elasticity.zero(), 0.0, (math.inf, math.inf), smallest_gap)

    def solve(active: np.ndarray, hardness: float) -> _Linear:
        points = _select(contact, active)
        points = replace(points, stiffness=hardness * points.stiffness)
        try:
            solution, rotation = elasticity.newton_step(points, free[active], torque)
        except np.linalg.LinAlgError as error:
            raise ConvergenceError(f"the equations of contact have no solution: {error}", []) from None
        gap = free + contact.gap_change(elasticity.displacement(solution)) + contact.lever * rotation
        return solution, rotation, gap

    active, (solution, rotation, gap) = _unilateral(solve, present, round_off)
    active = active & (gap < 0.0)
    carrying = replace(_select(contact, active), gap=gap[active])
    correction = solution - coordinates
    norm = elasticity.energy_norm(solution)
    error = elasticity.energy_norm(correction) / norm if norm > 0.0 else 0.0
    return _State(advance, coordinates, carrying, correction, rotation, (error, abs(rotation) * base_radius / approach),
                  smallest_gap)  # fmt: skip


def _unilateral(
    solve: Callable[[np.ndarray, float], _Linear], present: FloatArray, round_off: float
) -> tuple[np.ndarray, _Linear]:
    """Solve a linear contact problem: the points that carry load penetrate, the others do not.

    Under a stiff penalty, and with more points than nodes, the points that carry are hard to tell from those that just
    do not. Then the problem is first solved with a softer penalty, which is hardened step by step. Gaps `present` say
    which points to begin with; those below `round_off` have no sign.
    """
    start = present < 0.0 if (present < 0.0).any() else present <= present.min()
    active, linear, done = _pivot(solve, start, 1.0, round_off)
    hardness = 1.0
    while not done and hardness > SOFTEST:
        hardness *= SOFTER
        active, linear, done = _pivot(solve, start, hardness, round_off)
    while hardness < 1.0:
        hardness = min(1.0, hardness * HARDER)
        active, linear, _ = _pivot(solve, active, hardness, round_off)
    return active, linear


def _pivot(
    solve: Callable[[np.ndarray, float], _Linear], active: np.ndarray, hardness: float, round_off: float
) -> tuple[np.ndarray, _Linear, bool]:
    """Let points on the wrong side change sides until there are none; return those that carry load, and if it ended.

    All change at once while that lowers their number, else one does (Portugal, Judice & Vicente, Math. Comp. 63 (1994)
    625).
    """
    fewest, patience = len(active) + 1, PIVOT_PATIENCE
    for _ in range(MOST_PIVOTS):
        linear = solve(active, hardness)
        wrong = np.where(active, linear[2] > round_off, linear[2] < -round_off)
        count = int(wrong.sum())
        if count < fewest:
            fewest, patience = count, PIVOT_PATIENCE
        elif patience > 0:
            patience -= 1
        else:
            wrong[: np.flatnonzero(wrong)[-1]] = False
        # Without any point there would be nothing to solve.
        if count == 0 or not (active ^ wrong).any():
            return active, linear, count == 0
        active = active ^ wrong
    return active ^ wrong, linear, False  # the points that the last solution belongs to


def _closer(state: _State, evaluate: Evaluate, approach: float) -> _State:
    """Look again at a state that is better than was expected, at the points that are near by its own measure."""
    while 0.0 < max(state.error) < CLOSE:
        closer = evaluate(state.coordinates, state.advance, NEARBY * max(state.error) * approach)
        if max(closer.error) > 0.5 * max(state.error):
            break
        state = closer
    return state


def _extrapolated(passed: list[_State], state: _State) -> tuple[FloatArray, float]:
    """Return where to go from a state: where its correction says, or further along the last ones when these die slowly.

    The linearised problem leaves out how forces turn with the flanks. Under ordinary loads that is little, and the
    corrections fall by orders of magnitude; under extreme ones they fall by a constant factor, which Anderson's
    mixing of the last few removes (J. ACM 12 (1965) 547).
    """
    if not passed or max(state.error) < SLOW * max(passed[-1].error):
        return state.coordinates + state.correction, state.advance + state.rotation
    chain = [*passed, state]
    corrections = np.array([np.append(s.correction, 0.0) for s in chain])
    change = np.diff(corrections, axis=0)
    share = np.linalg.lstsq(change.T, corrections[-1], rcond=1e-8)[0]
    targets = np.array([np.append(s.coordinates + s.correction, s.advance + s.rotation) for s in chain])
    target = targets[-1] - share @ np.diff(targets, axis=0)
    return target[:-1], float(target[-1])


def _guarded_step(
    state: _State, target: tuple[FloatArray, float], limit: float, evaluate: Evaluate, approach: float
) -> _State:
    """Go to the target, or as far towards it as the next correction stays below a limit."""
    worst = min(max(state.error), 1.0)
    step, rotation = target[0] - state.coordinates, target[1] - state.advance
    near = NEARER * worst * approach
    # A whole step may fail because it lost points that carry load; then it is looked at again with all points as near
    # as the correction was large. That is not done at once, because points at the edge of a flank change with it.
    halves = [(0.5**i, near) for i in range(1, HALVINGS)]
    for size, depth in ((1.0, near), (1.0, min(worst, NEARBY) * approach), *halves):
        trial = evaluate(state.coordinates + size * step, state.advance + size * rotation, depth)
        if max(trial.error) < limit:
            break
    return trial


def _select(contact: Contact, chosen: np.ndarray) -> Contact:
    """Return some of the points."""
    fields = ("pair", "slave", "index", "weight", "gap", "stiffness", "lever", "mate_lever", "place")
    return replace(contact, **{name: getattr(contact, name)[chosen] for name in fields})
