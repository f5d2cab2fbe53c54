"""Full FE of loaded pairs on coarse meshes."""

import numpy as np
import pytest

from pmor.case import parse_case
from pmor.gear.condition import PLAIN, Condition
from pmor.pair.model import elastic_model, mesh_model
from pmor.penalty.elasticity import full_elasticity
from pmor.penalty.equilibrium import solve_equilibrium
from pmor.penalty.position import active_patches
from pmor.penalty.search import search_contact
from tests.support.gear_models import body, gear_pair, meshed_pair, tooth
from tests.support.small_case import case_text

TORQUE = 1e5  # N mm, the paper pair's nominal load
NEWTON = 1e-9  # relative residual at which the solver stops
SAME_STATE = 1e-8  # relative; the same equilibrium, reached on two ways
DEPTH = 0.15  # mm, for windows with room to spare

PAIRS = {
    "paper": gear_pair(tooth(21), tooth(21)),
    "unequal": gear_pair(tooth(17, 0.4), tooth(31, 0.1)),
    "unequal, wide": gear_pair(tooth(23), tooth(17, 0.2), extra_distance=0.3),
}
SMALL = (6, 2)
every_pair = pytest.mark.parametrize("pair", PAIRS.values(), ids=PAIRS.keys())


class Model:
    """Full FE of a pair with a coarse mesh."""

    def __init__(self, pair, mesh=SMALL, **scheme):
        self.pair, self.meshed = pair, meshed_pair(pair, *mesh, **scheme)
        self.bodies = body(pair.pinion, *mesh), body(pair.wheel, *mesh)
        self.base_radius = pair.pinion.base_radius

    def elasticity(self, position):
        return full_elasticity(*self.bodies, position)

    def phi(self, share):
        """Pinion angle at a share of the pitch after a pair has come into mesh."""
        return self.pair.roll_position_range[0] + share * self.pair.pitch

    def solve(self, phi, torque=TORQUE, **options):
        position = active_patches(self.meshed, phi, DEPTH)
        elasticity, condition = self.elasticity(position), Condition(torque=torque)
        return position, elasticity, solve_equilibrium(self.meshed, position, elasticity, condition, **options)

    def ste_um(self, phi, torque=TORQUE, **options):
        return self.solve(phi, torque, **options)[2].advance * self.base_radius * 1e3


def rigid_advance(meshed, phi, assembly=PLAIN):
    """Advance at which the undeformed flanks just touch, rad."""
    position, advance = active_patches(meshed, phi, 0.05 + assembly.spread, assembly), 0.0
    for _ in range(50):
        gap = search_contact(meshed, position, np.zeros_like(position.nodes), advance).smallest_gap
        advance += gap / meshed.pair.pinion.base_radius
        if abs(gap) < 1e-11:
            return advance
    raise AssertionError("the rigid flanks did not meet")


def line_model(elements, width, **sections):
    """Full FE of the small case with line contact on another mesh."""
    changed = {"mesh": {"profile_elements": elements, "width_elements": width}, "contact": None} | sections
    case = parse_case(case_text(**changed), "line", "line case")
    return elastic_model(case, mesh_model(case))
