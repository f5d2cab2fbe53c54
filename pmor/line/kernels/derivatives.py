"""Derivatives of figures of line loads by the deviations of the flanks (`pmor.line.kernels.loads`, eq. 2)."""

from __future__ import annotations

from pmor.core.compiling import allocating
from pmor.core.linear import copy_vector, eliminate, solve_upper
from pmor.line.kernels.loads import fill_equations
from pmor.line.kernels.movements import place_at, solve_held, take_stiffness
from pmor.line.kernels.starts import set_free
from pmor.line.kernels.workspace import new_workspace


@allocating
def differentiate_lines(
    lines, rows, meshes, compliance, flexibility, deviation, states, by_movement, by_force, by_deviation
):
    """Fill the derivatives of a figure of movements and forces by the deviation of each section, under fixed loads.

    Parameters
    ----------
    lines, rows, meshes, compliance, flexibility, deviation
        As in `solve_lines`.
    states : LineResults
        Converged ones; others get derivatives of 0. Their stiffness is filled from the solution itself.
    by_movement : ndarray, shape (D, A, K)
        Derivatives of the figure in each state by its movements.
    by_force : ndarray, shape (D, A, N) or (0, 0, 0)
        By its forces.
    by_deviation : ndarray, shape (D, A, N)
        Filled, per mm.
    """
    size, count = rows.shape[1:]
    workspace = new_workspace(size, count)
    adjoint, step, matrix = workspace.loaded, workspace.step, workspace.matrix
    for i in range(len(lines.first_pair)):
        set_free(lines, i, deviation, workspace)
        for d in range(len(states.converged)):
            rates, force = by_deviation[d, i], states.force[d, i]
            rates[:] = 0.0
            if not states.converged[d, i]:
                continue
            for n in range(size):
                workspace.carries[n] = force[n] > 0.0
            place_at(lines, i, rows, meshes, states.movement[d, i], workspace)
            carried = fill_equations(lines, rows, meshes, compliance, flexibility, i, force, workspace)
            last = carried + count
            for a in range(last):
                matrix[a, last] = by_force[d, i, workspace.active[a]] if a < carried and len(by_force) > 0 else 0.0
            eliminate(matrix, carried, last, last + 1)
            take_stiffness(carried, workspace)
            if states.stiffness.size > 0:
                for k in range(count):
                    copy_vector(workspace.stiffness[k], states.stiffness[d, i, k])
            for k in range(count):
                step[k] = -by_movement[d, i, k] - matrix[carried + k, last]
            solve_held(workspace.stiffness, step, workspace.loose)
            for a in range(carried):
                adjoint[a] = matrix[a, last]
                for k in range(count):
                    adjoint[a] -= step[k] * matrix[a, carried + k]
            solve_upper(matrix, carried, adjoint)
            for a in range(carried):
                rates[workspace.active[a]] = -adjoint[a]
