"""Equilibria at one pinion angle, of whichever contact."""

from typing import Any

import numpy as np

from pmor.line.full_model import solve_angle
from pmor.line.layered_pair import LayeredPair
from pmor.penalty.solve import solve_position


def states_at(model, phi, conditions) -> tuple[Any, ...]:
    """States of full FE at an angle (rad) under conditions; None where not converged."""
    meshed = model.mesh.meshed
    if isinstance(meshed, LayeredPair):
        return solve_angle(meshed, model.elasticity_at, phi, conditions).states
    return solve_position(meshed, phi, conditions, model.elasticity_at).equilibria


def forces(state, columns):
    """Forces of a state over the columns or sections (n,), and the torque that they make on the pinion, N and N mm."""
    contact = getattr(state, "contact", state)
    section = contact.place[:, 1] if hasattr(contact, "place") else contact.section
    return np.bincount(section, contact.force, minlength=columns), float(-contact.force @ contact.lever)
