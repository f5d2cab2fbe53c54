"""Laws of a basis, verified against full FE of its own case.

Shapes are displacements of force fields, so that everything about a basis follows from forces and the compliance C of
full FE: U = C F, the energy products F^T U, active shapes that store unit energy each by itself. Where a basis holds no
forces (shapes at roll positions), those behind a displacement u of the loaded flank are found from it, f = C^-1 u.
Beyond these identities the basis must reproduce its training states within its error bar, and the error bar must be of
the size of the error at unseen states.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from pmor.body.elastic_gear import ElasticGear
from pmor.body.flank_compliance import solved_gear_of
from pmor.core.arrays import FloatArray
from pmor.gear.condition import Condition
from pmor.pair.conditions import condition_at, training_values
from pmor.pair.model import ElasticModel
from pmor.penalty.elasticity import full_elasticity
from pmor.penalty.pair import as_penalty
from pmor.penalty.position import active_patches
from pmor.penalty.solve import window_depth
from pmor.reduction.basis import Basis
from pmor.reduction.contact_shapes import ContactShapes, shapes_of
from pmor.reduction.flank_lines import FlankLineShapes, gear_lines
from pmor.work.states import SMALLEST_ERROR_UM, States, solve_states
from pmor_online.errors import estimate_errors
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.model import reduced_pair

Bodies = tuple[ElasticGear, ElasticGear]

# Of all random choices: equal files have equal checks.
SEED = 20160919
ANGLES = 3
TRAINING_STATES = 10
UNSEEN_STATES = 5
# Residual to which states are solved again: that of the training.
TOLERANCE = 1e-9

# Two ways to round the same products.
ROUND_OFF = 1e-9
STORED = 1e-10
# Shapes that are nearly dependent cost digits in the factorisation of their Gram matrix.
ORTHONORMAL = 1e-6
# Energies in directions of a compliance below this fraction of the largest are round-off.
LEAST_COMPLIANCE = 1e-14
# How far the true error may be from its estimate at trained states, and at others; without an estimate, its bound.
COVERED = 5.0
OF_THE_SIZE = 10.0
WITHOUT_ESTIMATE = 5e-4
SOLVED_STE = 1e-6
# Line loads against full FE, which is solved to 1e-9.
EXACT = 1e-8


@dataclass(frozen=True)
class Check:
    """One law: a basis obeys it where `value` is at most `limit`.

    Parameters
    ----------
    value, limit : float
        Without unit; NaN is never within the limit.
    meaning : str
        Of the value.
    """

    name: str
    value: float
    limit: float
    meaning: str

    @property
    def ok(self) -> bool:
        """Whether the law is obeyed."""
        return self.value <= self.limit


def verify_basis(basis: Basis, model: ElasticModel, progress: Callable[[], None] = lambda: None) -> tuple[Check, ...]:
    """Verify a basis against full FE.

    Parameters
    ----------
    model : ElasticModel
        Of the case that the basis was made from.
    progress : callable
        Called after each full solve, for progress; there are `UNSEEN_STATES`.

    Returns
    -------
    tuple of Check
        Without those that the basis has no data for: training states of static modes, the error estimate of a case
        that asks for none.
    """
    bodies = model.pinion, model.wheel
    checks: list[Check] = []
    if basis.shapes is not None:
        checks += [*_consistency(basis.shapes, bodies), _orthonormality(basis, model)]
    if basis.compliance is not None:
        checks.append(_stored_compliance(basis, bodies))
    if basis.training.converged.any():
        checks.append(_training_states(basis))
    if basis.shapes is None:
        checks.append(_exact_states(basis, model, progress))
    elif basis.compliance is not None:
        checks.append(_unseen_states(basis, model, progress))
    return tuple(checks)


def checks_text(checks: Sequence[Check]) -> str:
    """Return a table for the screen."""
    lines = [
        f"  {'ok' if c.ok else 'FAILED':<7} {c.name:<18} {c.value:<9.2g} at most {c.limit:<8.2g} {c.meaning}"
        for c in checks
    ]
    return "\n".join(["Laws of a basis, against full FE of its case", *lines])


def _consistency(shapes: FlankLineShapes | ContactShapes, bodies: Bodies) -> tuple[Check, Check]:
    """U = C F, and the Gram matrices are F^T U."""
    if isinstance(shapes, ContactShapes):
        again = _positions_again(shapes, bodies)
        found = [(shapes.displacement, again.displacement, shapes.gram, again.gram)]
    else:
        lines = [gear_lines(body, g.start, g.force) for g, body in zip(shapes.gears, bodies, strict=True)]
        found = [
            (g.displacement, new.displacement, g.gram, new.gram) for g, new in zip(shapes.gears, lines, strict=True)
        ]
    moved = max(_difference(u, new_u) for u, new_u, _, _ in found)
    work = max(_difference(gram, new_gram) for _, _, gram, new_gram in found)
    return (
        Check("displacements", moved, ROUND_OFF, "relative; shapes against compliance times forces, U = C F"),
        Check("energy products", work, ROUND_OFF, "relative; Gram matrices against forces times displacements, F^T U"),
    )


def _positions_again(shapes: ContactShapes, bodies: Bodies) -> ContactShapes:
    """Build the family anew from the forces behind its displacements of the loaded flanks."""
    positions, count = shapes.displacement.shape[:2]
    size = shapes.displacement.shape[-1]
    force = np.zeros((positions, count, 2, size))
    for gear, body in enumerate(bodies):
        own = shapes.displacement[:, :, gear, shapes.neighbours].reshape(-1, size)
        force[:, :, gear] = _forces_behind(body.tooth_compliance(0), own.T).T.reshape(positions, count, size)
    interpolation = "cubic" if shapes.stencil == 4 else "linear"
    return shapes_of(bodies, shapes.roll_position, shapes.angles_per_pitch, force, interpolation)


def _orthonormality(basis: Basis, model: ElasticModel) -> Check:
    """Unit coordinates of the reduced elasticity store the energy 1/2 each, and none together: U^T C^-1 U = I."""
    reduced, rng = reduced_pair(basis), np.random.default_rng(SEED)
    meshed = reduced.meshed
    largest = Condition(torque=1e3 * basis.case.offline.torques_Nm[-1], misalignment=basis.case.misalignment)
    depth = window_depth(as_penalty(meshed), largest)
    if isinstance(basis.shapes, ContactShapes):
        # Their forces may go beyond the windows, but not beyond the flanks.
        depth = meshed.pair.pinion.base_radius
    worst = 0.0
    for phi in meshed.pair.pitch * rng.random(ANGLES):
        position = active_patches(as_penalty(meshed), float(phi), depth, largest.assembly)
        compliance = full_elasticity(model.pinion, model.wheel, position).compliance
        active_shapes = reduced.shape_elasticity_at(position).basis.reshape(len(compliance), -1)
        energy = active_shapes.T @ _forces_behind(compliance, active_shapes)
        worst = max(worst, float(np.abs(energy - np.eye(len(energy))).max(initial=0.0)))
    return Check(
        "orthonormality", worst, ORTHONORMAL, f"energies and cross energies of active_shapes at {ANGLES} angles"
    )


def _stored_compliance(basis: Basis, bodies: Bodies) -> Check:
    stored = basis.compliance
    assert stored is not None
    expected = (solved_gear_of(body, stored.components).compliance for body in bodies)
    value = max(_difference(old, new) for old, new in zip(stored.gears, expected, strict=True))
    return Check("compliance", value, STORED, "relative; that of the flanks against full FE")


def _training_states(basis: Basis) -> Check:
    """Some states of the training, which the error bar must cover."""
    training, rng = basis.training, np.random.default_rng(SEED)
    states = np.argwhere(training.converged)
    states = states[np.sort(rng.permutation(len(states))[:TRAINING_STATES])]
    conditions = [training.conditions[i][t] for t, i in states]
    ste, estimate = estimate_errors(basis, training.phi[states[:, 1]], conditions, TOLERANCE)
    trained = training.ste_um[states[:, 0], states[:, 1]]
    if basis.compliance is None:
        covered, bar = WITHOUT_ESTIMATE * trained, f"{100.0 * WITHOUT_ESTIMATE:g} % of the STE"
    else:
        covered, bar = COVERED * np.abs(estimate) + SOLVED_STE * trained, f"{COVERED:g} error bars"
    difference = np.abs(ste - trained)
    largest = 100.0 * float(np.max(difference / trained))
    return Check(
        "training states", float(np.max(difference / covered)), 1.0,
        f"error over {bar} at {len(states)} trained states; largest error {largest:.2g} %",
    )  # fmt: skip


def _unseen_states(basis: Basis, model: ElasticModel, progress: Callable[[], None]) -> Check:
    """Estimate against truth at states drawn at random from the ranges of the training."""
    phi, conditions, truth = _random_states(basis, model, progress)
    ste, estimate = estimate_errors(basis, phi, conditions, TOLERANCE)
    solved = np.isfinite(truth)
    true, estimated = np.abs(truth - ste)[solved], np.abs(estimate)[solved]
    value = float(np.max(_factors(estimated, true), initial=1.0))
    largest = ", ".join(f"{np.max(error, initial=0.0):.2g}" for error in (estimated, true))
    return Check(
        "unseen states", value, OF_THE_SIZE,
        f"factor between error bar and error where that is above {SMALLEST_ERROR_UM:g} um, at {solved.sum()} states; "
        f"largest of each {largest} um",
    )  # fmt: skip


def _exact_states(basis: Basis, model: ElasticModel, progress: Callable[[], None]) -> Check:
    """Line loads against full FE at random states: the reduction is exact but for round-off."""
    phi, conditions, truth = _random_states(basis, model, progress)
    reduced = reduced_pair(basis)
    found = [sweep_line_loads(reduced, phi[i : i + 1], [condition]) for i, condition in enumerate(conditions)]
    ste = np.array([sweep.ste_um[0, 0] for sweep in found])
    solved = np.isfinite(truth)
    value = float(np.max(np.abs(ste / truth - 1.0)[solved], initial=0.0))
    return Check("unseen states", value, EXACT, f"relative; STE against full FE at {solved.sum()} states")


def _random_states(
    basis: Basis, model: ElasticModel, progress: Callable[[], None]
) -> tuple[FloatArray, list[Condition], FloatArray]:
    """Angles and conditions from the ranges of the training, with the STE of full FE: NaN where not converged."""
    offline, pair, rng = basis.case.offline, model.mesh.meshed.pair, np.random.default_rng(SEED)
    ranges = training_values(offline)
    draws = rng.random((UNSEEN_STATES, 1 + len(ranges)))
    low, high = np.array([r[0] for r in ranges]), np.array([r[-1] for r in ranges])
    phi = pair.meshing_range[0] + pair.pitch * draws[:, 0]
    conditions = [condition_at(state) for state in low + draws[:, 1:] * (high - low)]
    states = States(phi, tuple(conditions))
    return phi, conditions, solve_states(model.mesh.meshed, model.elasticity_at, states, progress=progress)


def _factors(estimated: FloatArray, true: FloatArray) -> FloatArray:
    """Factors between estimates and errors, either way, without errors below the resolution."""
    counted = ~(true <= SMALLEST_ERROR_UM)  # a reduced state that did not converge is NaN, and counts
    with np.errstate(divide="ignore"):
        ratio = estimated[counted] / true[counted]
        return np.asarray(np.where(np.isnan(ratio), np.inf, np.maximum(ratio, 1.0 / ratio)))


def _forces_behind(compliance: FloatArray, displacement: FloatArray) -> FloatArray:
    """Forces behind displacements (n, m); zero where held nodes make the compliance singular."""
    import scipy.linalg as la

    factor, pivots, rank, _ = la.lapack.dpstrf(compliance, tol=LEAST_COMPLIANCE * compliance.diagonal().max(), lower=1)
    kept, lower = pivots[:rank] - 1, factor[:rank, :rank]
    force = np.zeros_like(displacement)
    force[kept] = la.cho_solve((lower, True), displacement[kept])
    return force


def _difference(found: FloatArray, expected: FloatArray) -> float:
    """Largest difference over the largest value."""
    return float(np.abs(found - expected).max() / np.abs(expected).max())
