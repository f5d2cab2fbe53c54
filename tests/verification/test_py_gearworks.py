"""Flanks and data sheet against py_gearworks, a package for solid models of gears: half a GB, an extra of its own.

pip install "pmor-gear[check]"
"""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.gear.tooth import Tooth

pytest.importorskip("py_gearworks", reason='py_gearworks is not installed: pip install "pmor-gear[check]", half a GB')

PLACE = 1e-9  # mm: 1e-6 um


@pytest.mark.parametrize("helix_deg", [0.0, 21.0, -21.0])
def test_flanks_are_those_of_py_gearworks(helix_deg):
    import py_gearworks

    ours = Tooth(27, 4.5, math.radians(20.0), math.radians(helix_deg), 0.231415)
    theirs = py_gearworks.HelicalGear(
        number_of_teeth=27, module=4.5, helix_angle=math.radians(helix_deg), profile_shift=0.231415, height=50.0,
        dedendum_coefficient=1.25, tip_truncation=0.0,
    )  # fmt: skip
    for share in (0.0, 0.4, 1.0):
        curve, transform = theirs.involute_curve_at_z(share)
        points = np.array([transform(curve(s)) for s in np.linspace(0.0, 1.0, 9)])
        # Its tooth is centred on +x, and the flank is the one on the clockwise side.
        radius = np.hypot(points[:, 0], points[:, 1])
        roll = np.array([ours.roll_angle_at(r) for r in radius])
        x, y, _ = ours.flank_point(roll, points[:, 2]).T
        twist = ours.twist_per_length * points[:, 2]
        ahead = np.arctan2(-x, y) - twist
        assert_allclose(radius * (np.arctan2(points[:, 1], points[:, 0]) - twist + ahead), 0.0, rtol=0.0, atol=PLACE)
        assert_allclose(np.hypot(x, y), radius, rtol=0.0, atol=PLACE)
    assert_allclose(radius[-1], ours.tip_radius, rtol=0.0, atol=PLACE)
