"""What the mesh costs: line contact on finer and finer bodies, of linear and of quadratic elements."""

import numpy as np
import pytest

from pmor.case import parse_case
from pmor.gear.condition import Condition
from pmor.pair.model import elastic_model, mesh_model
from pmor_offline.train import train
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.model import reduced_pair
from tests.support.small_case import case_text

UNEQUAL = {
    "pair": {"module_mm": 2.5}, "pinion": {"teeth": 17, "profile_shift": 0.3, "bore_radius_mm": 10.0},
    "wheel": {"teeth": 40, "bore_radius_mm": 30.0},
}  # fmt: skip


def transmission_error(gears, **mesh):
    """STE over a pitch, um."""
    text = case_text(**gears, mesh=mesh, contact={"scheme": "line"}, reduction={"shapes": "line_loads"})
    case = parse_case(text, "mesh", "mesh case")
    reduced = reduced_pair(train(case, elastic_model(case, mesh_model(case))).basis)
    phi = np.linspace(0.0, reduced.meshed.pair.pitch, 32, endpoint=False)
    return sweep_line_loads(reduced, phi, [Condition(torque=1e5)]).ste_um[0]


@pytest.mark.parametrize("gears", [{}, UNEQUAL], ids=["paper", "unequal"])
def test_quadratic_elements_need_half_as_many_for_a_third_of_the_error(gears):
    """In plane strain, at every angle: eight quadratic elements have the nodes of sixteen linear ones."""
    fine, eight, sixteen, linear = (
        transmission_error(gears, width="plane_strain", profile_elements=n, element=element)
        for element, n in (("hex20", 24), ("hex20", 8), ("hex20", 16), ("hex8i", 16))
    )
    error = {name: np.abs(ste / fine - 1.0).max() for name, ste in (("8", eight), ("16", sixteen), ("linear", linear))}
    # Measured, paper and unequal: 9e-4 and 1.5e-3, 2e-4 and 4e-4, linear 5e-3 and 5e-3.
    assert error["8"] < 1.5e-3
    assert error["16"] < 8e-4
    assert error["8"] < 0.35 * error["linear"]
