"""Static equilibrium of the pair under a pinion torque, the wheel held: semismooth Newton with a guarded step.

One solver for the full and the reduced model. The potential energy is elastic energy + penalty energy - torque work;
the line search demands that a step lowers it or lowers the residual. Close to the solution the two are equivalent, but
the paper's force transfer is not exactly the derivative of the refined gap, so the residual has the last word.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from pmor.contact.elasticity import Elasticity
from pmor.contact.flank import MeshedPair
from pmor.contact.position import Position
from pmor.contact.search import Contact, search_contact
from pmor.errors import ConvergenceError
from pmor.gear.conventions import FloatArray

# Gaps are differences of coordinates, some hundred operations behind the nodes, and a hundredth of the approach.
ROUND_OFF_FACTOR = 200.0
# The points' errors are independent and mostly cancel; measured between 1 and 3 where Newton stalls.
PENETRATION_FACTOR = 10.0


@dataclass(frozen=True)
class Equilibrium:
    """A converged state.

    Parameters
    ----------
    lead : float
        Rotation of the pinion ahead of its kinematic position, rad.
    coordinates : ndarray
        Of the elastic model.
    contact : Contact
    steps : int
        Newton steps taken.
    history : tuple of (force residual, torque residual)
        Relative, before each step and at the end.
    """

    lead: float
    coordinates: FloatArray
    contact: Contact
    steps: int
    history: tuple[tuple[float, float], ...]

    def scaled_start(self, factor: float) -> tuple[FloatArray, float]:
        """Return coordinates and lead to start from at `factor` times the torque."""
        return self.coordinates * factor, self.lead * factor

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
    lead: float
    coordinates: FloatArray
    contact: Contact
    potential: float
    force_residual: float
    torque_residual: float


def solve_equilibrium(
    meshed: MeshedPair,
    position: Position,
    elasticity: Elasticity,
    torque: float,
    start: tuple[FloatArray, float] | None = None,
    max_steps: int = 40,
    tolerance: float = 1e-9,
) -> Equilibrium:
    """Solve for the elastic coordinates and the pinion rotation.

    Parameters
    ----------
    meshed : MeshedPair
    position : Position
    elasticity : Elasticity
    torque : float
        On the pinion, N mm, positive.
    start : (ndarray, float), optional
        Elastic coordinates and lead (rad) to start from; by default the undeformed pair at the expected approach.
    max_steps : int
    tolerance : float
        On the relative residuals: forces in the energy norm, and torque.

    Returns
    -------
    Equilibrium

    Raises
    ------
    ConvergenceError
        With the residual history, when the tolerance is not reached or nothing touches.
    """
    base_radius = meshed.pair.pinion.base_radius
    approach = meshed.expected_approach(torque)

    def evaluate(coordinates: FloatArray, lead: float) -> _State:
        return _evaluate(meshed, position, elasticity, torque, coordinates, lead)

    state = evaluate(*(start or (elasticity.zero(), approach / base_radius)))
    history: list[tuple[float, float]] = []
    for step in range(max_steps + 1):
        history.append((state.force_residual, state.torque_residual))
        if max(history[-1]) <= max(tolerance, round_off_residual(meshed, torque, state.contact)):
            return Equilibrium(state.lead, state.coordinates, state.contact, step, tuple(history))
        if len(state.contact.gap) > 0:
            state = _damped_step(elasticity, state, torque, evaluate)
            continue
        if not math.isfinite(state.contact.smallest_gap):
            raise ConvergenceError(f"no flank faces its mate at phi = {position.phi:.6g} rad", history)
        state = evaluate(state.coordinates, state.lead + (state.contact.smallest_gap + approach) / base_radius)
    raise ConvergenceError(
        f"no equilibrium at phi = {position.phi:.6g} rad, torque = {torque * 1e-3:.6g} N m after {max_steps} Newton "
        f"steps (residuals: force {history[-1][0]:.2g}, torque {history[-1][1]:.2g})",
        history,
    )


def round_off_residual(meshed: MeshedPair, torque: float, contact: Contact | None = None) -> float:
    """Return the relative residual below which forces are round-off of the coordinates.

    Parameters
    ----------
    meshed : MeshedPair
    torque : float
        N mm.
    contact : Contact, optional
        State that carries it: forces are the penalty times penetrations, and stiff penalties make these small.
    """
    coordinate_error = np.finfo(float).eps * meshed.pair.centre_distance
    residual = ROUND_OFF_FACTOR * coordinate_error / meshed.expected_approach(torque)
    if contact is None or not contact.force.any():
        return float(residual)
    penetration = -float(contact.force @ contact.gap) / float(contact.force.sum())
    return float(max(residual, PENETRATION_FACTOR * coordinate_error / penetration))


def _evaluate(
    meshed: MeshedPair,
    position: Position,
    elasticity: Elasticity,
    torque: float,
    coordinates: FloatArray,
    lead: float,
) -> _State:
    contact = search_contact(meshed, position, elasticity.displacement(coordinates), lead)
    force = contact.force
    target = elasticity.coordinates_of(contact, force)
    norm = elasticity.energy_norm(target)
    # A basis without shapes, or with none on the loaded patches, has nothing to balance: penalty alone.
    scale = max(norm, elasticity.energy_norm(coordinates))
    residual = elasticity.energy_norm(target - coordinates) / scale if scale > 0.0 else 0.0
    potential = 0.5 * elasticity.energy_norm(coordinates) ** 2 - 0.5 * float(force @ contact.gap) - torque * lead
    return _State(lead, coordinates, contact, potential, residual, abs(float(force @ contact.lever) + torque) / torque)


def _damped_step(
    elasticity: Elasticity, state: _State, torque: float, evaluate: Callable[[FloatArray, float], _State]
) -> _State:
    contact = state.contact
    elastic = contact.gap_change(elasticity.displacement(state.coordinates))
    coordinates, rotation = elasticity.newton_step(contact, contact.gap - elastic, torque)
    size = 1.0
    for _ in range(12):
        trial = evaluate(state.coordinates + size * (coordinates - state.coordinates), state.lead + size * rotation)
        # A step that loses contact altogether is no progress, however low its potential.
        touching = len(trial.contact.gap) > 0
        if touching and (_worst(trial) < _worst(state) or trial.potential < state.potential):
            break
        size *= 0.5
    return trial


def _worst(state: _State) -> float:
    return max(state.force_residual, state.torque_residual)
