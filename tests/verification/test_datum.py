"""The transmission error counts from plain involutes on aligned axes, whatever the axes and the faces."""

import math
from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor

PITCH = 2.0 * math.pi / 21
ANGLES = PITCH * np.linspace(0.0, 1.0, 9)
TILT_UM = 40.0


@cache
def model(helix_deg=0.0, wheel_width=20.0, wheel_offset=0.0):
    wheel = {"teeth": 21, "bore_radius_mm": 20.0, "face_width_mm": wheel_width, "face_offset_mm": wheel_offset}
    case = pmor.make_case(
        teeth=21, bore_radius_mm=20.0, module_mm=4.0, face_width_mm=20.0, torque_Nm=100.0, scheme="line",
        profile_elements=5, width_elements=4, width="whole", results={"root_stress": False},
        pair={"helix_angle_deg": helix_deg}, wheel=wheel,
    )  # fmt: skip
    return pmor.train(case)


def swept(pair, misalignment=None, torque=100.0):
    return pair.sweep([torque], ANGLES, misalignment=misalignment)


def opening_um(z):
    """Gap by which the plane of the axes opens spur flanks at z, by the centre distance that they have there."""
    gears = model().reduced.meshed.pair
    base, distance = gears.pinion.base_radius + gears.wheel.base_radius, gears.centre_distance

    def involute_gap(at):
        return math.sqrt(at**2 - base**2) - base * math.acos(base / at)

    return 1e3 * (involute_gap(distance + 1e-3 * TILT_UM * z / 20.0) - involute_gap(distance))


@pytest.mark.parametrize("helix_deg", [0.0, 20.0])
def test_plain_flanks_on_aligned_axes_touch_at_zero(helix_deg):
    assert np.array_equal(swept(model(helix_deg)).unloaded_um, np.zeros(len(ANGLES)))


@pytest.mark.parametrize(
    ("width", "offset"),
    [(20.0, 0.0), (10.0, 5.0), *(pytest.param(10.0, offset, marks=pytest.mark.slow) for offset in (0.0, -5.0))],
)
def test_first_touch_is_at_the_end_of_the_common_face(width, offset):
    """The axes are farther apart at the face with the larger z: flanks touch at the other end."""
    sweep = swept(model(0.0, width, offset), pmor.Misalignment(in_plane_um=TILT_UM)).sweep
    low = offset - 0.5 * width
    sections = model(0.0, width, offset).reduced.layered.sections.z
    # Sections are columns of nodes, or Gauss points a little inside of the face.
    assert abs(sections[0] - low) < 0.6
    assert_allclose(sweep.unloaded_um, opening_um(sections[0]), rtol=0.0, atol=1e-6)
    assert_allclose(sweep.first_touch_um, opening_um(sections[0]), rtol=0.0, atol=1e-6)


def test_a_narrow_wheel_aside_advances_by_what_the_axes_are_apart_there():
    """Offset by 5 mm the same tilt opens the gap as a larger centre distance does: 3.4 um."""
    tilt = pmor.Misalignment(in_plane_um=TILT_UM)
    centred, aside = model(0.0, 10.0), model(0.0, 10.0, 5.0)
    # Load that moves towards a face finds the pinion a little softer or stiffer: 0.22 um.
    by_tilt = [swept(pair, tilt).ste_um[0] - swept(pair).ste_um[0] for pair in (centred, aside)]
    assert_allclose(by_tilt[1] - by_tilt[0], opening_um(5.0) - opening_um(0.0), rtol=0.0, atol=0.3)
    assert opening_um(5.0) > 3.0


def test_under_ever_less_load_the_transmission_error_is_that_without():
    """Flanks are spur ones; helical ones touch between sections too (`test_line_loads`)."""
    tilt = pmor.Misalignment(in_plane_um=15.0, out_of_plane_um=-20.0, centre_distance_um=10.0)
    light = swept(model(), tilt, 1e-4)
    assert_allclose(light.ste_um[0], light.unloaded_um, rtol=0.0, atol=0.02)
