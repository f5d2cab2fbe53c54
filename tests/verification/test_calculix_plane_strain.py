"""Line contact in plane strain against CalculiX: whole rings of second-order elements, flanks that resolve the contact.

Elements on the flanks are a quarter of Hertz's half-width, or of the smallest one where a corner carries.

Slow: ``pytest -n 0 -m slow tests/verification/test_calculix_plane_strain.py -s``, one to two minutes each. Measured:
FIGURES
"""

import math
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.case import parse_case
from pmor.contact.condition import Condition
from pmor.contact.line_contact import line_contact
from pmor.contact.solve import solve_position
from pmor.lab.rivals.calculix import PROGRAM, calculix_available
from pmor.pair.model import elastic_model, mesh_model
from tests.calculix_plane import plane_ste_um
from tests.small_case import case_text

PENALTY_N_MM3 = 5e7
PAIRS = {
    "paper": {},
    "unequal": {
        "pair": {"module_mm": 2.5}, "pinion": {"teeth": 17, "profile_shift": 0.3, "bore_radius_mm": 10.0},
        "wheel": {"teeth": 40, "bore_radius_mm": 30.0},
    },
}  # fmt: skip
# Pair, torque per mm of face width (N), where on the path of contact the first pair in mesh is, its share.
INSIDE = [("paper", 5.0, 0.12), ("paper", 5.0, 0.45), ("paper", 5.0, 0.55), ("unequal", 1.5, 0.15)]
# Beyond the path, in rad of the pinion.
CORNERS = [
    (name, torque, end, beyond)
    for name, torques, beyond in (("paper", (5.0, 15.0), 0.003), ("unequal", (1.5, 4.5), 0.004))
    for torque in torques for end in ("entry", "exit")
]  # fmt: skip
