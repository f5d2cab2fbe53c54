"""Bending of blanks against plate theory, and stresses in a free surface against eigenvalues of the tensor."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.core.errors import CaseError
from pmor.pair.limits import LARGEST_DEFLECTION, RIM_DEFLECTION, refuse_bent_blank
from pmor.pair.model import gear_pair
from pmor_online.root_stress import _measures
from tests.support.small_case import case_with

BORE = 20.0


def helical(torque):
    load = {"torques_Nm": [torque]}
    return case_with(
        load={"torque_Nm": torque}, offline=load, online=load, compare=load, mesh={"width": "whole"},
        pair={"helix_angle_deg": 25.0, "face_width_mm": 4.0},
    )  # fmt: skip


def test_a_blank_bends_as_a_plate_under_the_axial_force():
    """D = E t^3 / 12 (1 - nu^2) of steel, 4 mm thick, between bore and tip."""
    pair = gear_pair(helical(100.0))
    plate, overhang = 210e3 * 4.0**3 / (12.0 * 0.91), pair.pinion.tip_radius - BORE
    force = LARGEST_DEFLECTION * 4.0 * plate / (RIM_DEFLECTION * overhang**2)
    torque = 1e-3 * force * pair.pinion.base_radius / math.tan(pair.base_helix_angle)
    refuse_bent_blank(helical(0.999 * torque), pair, (BORE, BORE))
    with pytest.raises(CaseError, match="would bend"):
        refuse_bent_blank(helical(1.001 * torque), pair, (BORE, BORE))


def test_largest_principal_and_von_mises_stress_are_those_of_the_tensor(rng):
    stress = rng.normal(size=(3, 2, 4, 5, 3))
    tensor = np.zeros((*stress.shape[:-1], 3, 3))
    tensor[..., 0, 0], tensor[..., 1, 1] = stress[..., 0], stress[..., 1]
    tensor[..., 0, 1] = tensor[..., 1, 0] = stress[..., 2]
    low, middle, high = np.moveaxis(np.linalg.eigvalsh(tensor), -1, 0)
    principal, mises = _measures(stress)
    assert_allclose(principal, high, rtol=0.0, atol=1e-12)
    assert_allclose(mises**2, 0.5 * ((high - low) ** 2 + (high - middle) ** 2 + (middle - low) ** 2), rtol=1e-12)
