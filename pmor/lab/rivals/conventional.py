"""The conventional way to static contact: both whole gears in one sparse system, factored anew in every Newton step.

A general finite-element code solves contact so; the condensed and the reduced model are compared with it. It
solves the same discrete problem as the condensed model (`pmor.penalty.solve`), from the stiffness itself: with x the
displacements of all nodes and, last, the pinion's rotation times its base radius, p = k max(-g, 0) the point forces,
B = dg/dx the gradient of the gaps and t the torque over the base radius in the last row,

    K x - B^T p(x) = t,        (K + B^T k B) dx = t + B^T p - K x.

The equations of a gear are in the frame of its tooth 0, contact is evaluated in the frame of each tooth.
"""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from pmor.case import Case
from pmor.core.arrays import FloatArray
from pmor.core.errors import CaseError, ConvergenceError
from pmor.fe.assembly import degrees_of_freedom
from pmor.fe.whole_gear import assemble_arc, factorise
from pmor.gear.condition import Condition
from pmor.line.layered_pair import LayeredPair
from pmor.pair.model import MeshModel, per_gear
from pmor.penalty.equilibrium import round_off_residual
from pmor.penalty.pair import PenaltyPair, as_penalty
from pmor.penalty.position import Position, active_patches
from pmor.penalty.search import Contact, search_contact
from pmor.penalty.solve import window_depth


@dataclass(frozen=True)
class ConventionalPair:
    """Both whole gears, bores fixed, in one sparse stiffness matrix."""

    meshed: PenaltyPair
    # shape (n, n): Nodes in the order of elimination, x y z node by node, pinion first; the last row and column, of the
    # pinion's rotation, are empty. N/mm
    stiffness: sp.csc_array
    # shape (3 x flank nodes, n): For each tooth of pinion and wheel, counter-clockwise from the one on +y: times the
    # unknowns, displacement of its flank's nodes in its frame
    flanks: tuple[list[sp.csr_array], list[sp.csr_array]]
    assembly_seconds: float  # Wall time, ordering included, s

    @property
    def unknowns(self) -> int:
        """Number of unknowns: displacements and the pinion's rotation."""
        return int(self.stiffness.shape[0])


@dataclass(frozen=True)
class ConventionalSolution:
    """A converged state."""

    advance: float  # Rotation of the pinion ahead of its kinematic position, rad
    ste_um: float  # The same along the line of action, um
    steps: int  # Newton steps taken within the last windows
    factorisations: int  # Sparse factorisations: the Newton steps, with those in windows that turned out too small
    # Wall time of the factorisations, and of everything, s
    factor_seconds: float
    seconds: float
    history: tuple[tuple[float, float], ...]  # Relative, before each step and at the end


@dataclass(frozen=True)
class _State:
    x: FloatArray
    contact: Contact
    gradient: sp.csr_array
    residual: FloatArray
    potential: float
    force_residual: float
    torque_residual: float

    @property
    def worst(self) -> float:
        return max(self.force_residual, self.torque_residual)


@dataclass(frozen=True)
class _Problem:
    """Equilibrium under one torque within the windows of one position.

    `windows`, shape (3 n, unknowns), gives the displacement of the window nodes in the frames of their teeth.
    """

    pair: ConventionalPair
    position: Position
    windows: sp.csr_array
    torque: float

    @property
    def base_radius(self) -> float:
        return self.pair.meshed.pair.pinion.base_radius

    def evaluate(self, x: FloatArray) -> _State:
        displacement = (self.windows @ x).reshape(-1, 3)
        contact = search_contact(self.pair.meshed, self.position, displacement, x[-1] / self.base_radius)
        gradient = self.gap_gradient(contact, len(x))
        elastic, pushed = self.pair.stiffness @ x, gradient.T @ contact.force
        load = self.torque / self.base_radius
        residual = pushed - elastic
        residual[-1] += load
        scale = max(np.linalg.norm(pushed[:-1]), np.linalg.norm(elastic[:-1]))
        force_residual = float(np.linalg.norm(residual[:-1]) / scale) if scale > 0.0 else 0.0
        potential = 0.5 * float(x @ elastic) - 0.5 * float(contact.force @ contact.gap) - load * float(x[-1])
        return _State(x, contact, gradient, residual, potential, force_residual, abs(float(residual[-1])) / load)

    def gap_gradient(self, contact: Contact, size: int) -> sp.csr_array:
        """Derivative of the gaps by all unknowns, shape (points, size)."""
        columns = 3 * contact.index[:, :, None] + np.arange(3)
        rows = np.broadcast_to(np.arange(len(columns))[:, None, None], columns.shape)
        entries = contact.weight.ravel(), (rows.ravel(), columns.ravel())
        by_nodes = sp.coo_array(entries, shape=(len(columns), self.windows.shape[0])).tocsr()
        by_advance = sp.csr_array((contact.lever / self.base_radius)[:, None])
        return (by_nodes @ self.windows + sp.hstack([sp.csr_array((len(columns), size - 1)), by_advance])).tocsr()


def conventional_pair(case: Case, mesh: MeshModel) -> ConventionalPair:
    """Assemble both whole gears of a case.

    Raises
    ------
    CaseError
        With line contact, whose closed form takes the place of part of the mesh's compliance.
    MeshError
        When the mesh does not span the whole face width.
    """
    if isinstance(mesh.meshed, LayeredPair):
        raise CaseError(
            f'case {case.name}: [contact] scheme = "line": conventional full FE has no surface layer to take out: '
            'choose "direct", "paper" or "facet"'
        )
    start = time.perf_counter()
    (pinion, on_pinion), (wheel, on_wheel) = per_gear(
        case,
        mesh,
        lambda sector, gear: assemble_arc(
            sector, gear.youngs_modulus_GPa * 1e3, gear.poisson_ratio, case.mesh.element, sector.teeth
        ),
    )
    stiffness = sp.block_diag([pinion, wheel, sp.csc_array((1, 1))], format="csc")
    flanks = [
        [sp.csr_array((flank.data, first + flank.indices, flank.indptr), shape=(flank.shape[0], stiffness.shape[0]))
         for flank in teeth]
        for first, teeth in ((0, on_pinion), (pinion.shape[0], on_wheel))
    ]  # fmt: skip
    return ConventionalPair(as_penalty(mesh.meshed), stiffness, (flanks[0], flanks[1]), time.perf_counter() - start)


def solve_conventional(
    pair: ConventionalPair, phi: float, condition: Condition, max_steps: int = 40, tolerance: float = 1e-9
) -> ConventionalSolution:
    """Solve for the equilibrium at one pinion angle (rad), from the undeformed pair at the expected approach.

    `tolerance` is on the relative residuals: nodal forces, and torque.

    Raises
    ------
    ConvergenceError
        With the residual history, when the tolerance is not reached or nothing touches.
    """
    start, meshed, torque = time.perf_counter(), pair.meshed, condition.torque
    tolerance = max(tolerance, round_off_residual(meshed, torque))
    depth = window_depth(meshed, condition)
    factor_seconds: list[float] = []
    while True:
        problem = _problem(pair, active_patches(meshed, phi, depth, condition.assembly), torque)
        state, history = _newton(problem, max_steps, tolerance, factor_seconds)
        if not state.contact.touches_border:
            break
        depth *= 3.0  # as in `pmor.penalty.solve`
    ste = float(state.x[-1])
    return ConventionalSolution(
        ste / problem.base_radius, ste * 1e3, len(history) - 1, len(factor_seconds), sum(factor_seconds),
        time.perf_counter() - start, tuple(history),
    )  # fmt: skip


def _newton(
    problem: _Problem, max_steps: int, tolerance: float, factor_seconds: list[float]
) -> tuple[_State, list[tuple[float, float]]]:
    """Iterate to equilibrium; append the time of each factorisation to `factor_seconds`."""
    meshed, phi = problem.pair.meshed, problem.position.phi
    approach = meshed.expected_approach(problem.torque)
    x = np.zeros(problem.pair.unknowns)
    x[-1] = approach
    state = problem.evaluate(x)
    history: list[tuple[float, float]] = []
    for _ in range(max_steps + 1):
        history.append((state.force_residual, state.torque_residual))
        if state.worst <= tolerance:
            return state, history
        if len(state.contact.gap) > 0:
            state = _damped_step(problem, state, factor_seconds)
            continue
        if not math.isfinite(state.contact.smallest_gap):
            raise ConvergenceError(f"no flank faces its mate at phi = {phi:.6g} rad", history)
        x = state.x.copy()
        x[-1] += state.contact.smallest_gap + approach
        state = problem.evaluate(x)
    raise ConvergenceError(
        f"no equilibrium of whole gears at phi = {phi:.6g} rad, torque = {problem.torque * 1e-3:.6g} N m after "
        f"{max_steps} Newton steps (residuals: force {history[-1][0]:.2g}, torque {history[-1][1]:.2g})",
        history,
    )


def _damped_step(problem: _Problem, state: _State, factor_seconds: list[float]) -> _State:
    """Factor the tangent and go as far as the residual or the potential falls, as `pmor.penalty.equilibrium` does."""
    penalty = sp.diags_array(state.contact.stiffness)
    tangent = problem.pair.stiffness + state.gradient.T @ penalty @ state.gradient
    start = time.perf_counter()
    factor = factorise(tangent.tocsc())
    factor_seconds.append(time.perf_counter() - start)
    step = factor.solve(state.residual)
    size = 1.0
    for _ in range(12):
        trial = problem.evaluate(state.x + size * step)
        touching = len(trial.contact.gap) > 0
        if touching and (trial.worst < state.worst or trial.potential < state.potential):
            break
        size *= 0.5
    return trial


def _problem(pair: ConventionalPair, position: Position, torque: float) -> _Problem:
    """Find the nodes of a position's windows on the teeth of the whole gears."""
    windows = [sp.csr_array((0, pair.unknowns))]
    for p, index in enumerate(position.pair_index):
        # The wheel's teeth are numbered against its own counter-clockwise sense.
        for gear, tooth in ((0, int(index)), (1, -int(index))):
            flank = pair.flanks[gear][tooth % len(pair.flanks[gear])]
            windows.append(flank[degrees_of_freedom(position.flank_nodes[p][gear])])
    return _Problem(pair, position, sp.vstack(windows, format="csr"), torque)
