"""Bearings of pins and of shafts know the same kinds: stiffness, inner geometry, sizes of a catalogue."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.body.bearing import AnyBearing
from pmor.body.bearing_estimate import CatalogueBearing
from pmor.body.roller_bearing import RollerBearing
from pmor.body.rolling_bearing import RADIAL
from pmor.core.errors import CaseError
from pmor.machine.loader import load
from pmor.sets.loader import parse_set
from tests.support.gearboxes import SMALL, written
from tests.support.small_sets import SMALL_SET

ROLLERS = RollerBearing(12, 7.0, 9.0, 42.0)
ROLLER = "roller = { rollers = 12, roller_diameter_mm = 7.0, effective_length_mm = 9.0, pitch_diameter_mm = 42.0 }"
NEEDLES = CatalogueBearing("needle", 36.0, 50.0, width_mm=20.0)
CATALOGUE = 'catalogue = { kind = "needle", bore_mm = 36.0, outer_mm = 50.0, width_mm = 20.0 }'
BALLS = "ball = { balls = 9, ball_diameter_mm = 9.0, pitch_diameter_mm = 44.0 }"


SPHERICAL = f"spherical_{ROLLER}".replace("9.0", "6.0").replace(" }", ", contact_angle_deg = 12.0 }")


def on_pins(bearings):
    pins = f"[pins]\ndiameter_mm = 30.0\nlength_mm = 36.0\nbearings = [{bearings}]\n[mesh]"
    return parse_set(SMALL_SET.replace("[mesh]", pins), "small", "small")


def test_inner_geometry_is_linear_about_its_load():
    bearing = AnyBearing(roller=ROLLERS).linear(2000.0)
    moved, step = brentq_of(2000.0), 1e-7
    ahead, back = (ROLLERS.state(RADIAL * (moved + way)).force[1] for way in (step, -step))
    assert bearing.inner is None
    assert bearing.radial_N_per_mm == pytest.approx((ahead - back) / (2.0 * step), rel=1e-5)


def brentq_of(load):
    """Displacement under a load, by bisection."""
    low, high = 0.0, 1.0
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if ROLLERS.state(RADIAL * middle).force[1] < load else (low, middle)
    return low


def test_planets_on_bearings_of_any_kind_are_those_on_springs_under_the_same_load():
    """300 N m over three meshes, 18 teeth of 4 mm: two meshes pull at a planet, and two bearings share them."""
    share = 2.0 * (300e3 / 3.0 / 36.0) / 2.0
    rollers, needles = AnyBearing(roller=ROLLERS).linear(share), NEEDLES.radial_N_per_mm(share)
    springs = on_pins(
        f"{{at_mm = -8.0, radial_N_per_mm = {rollers.radial_N_per_mm}, "
        f"tilt_Nmm_per_rad = {rollers.tilt_Nmm_per_rad}}}, "
        f"{{at_mm = 8.0, radial_N_per_mm = {needles}}}"
    )
    kinds = on_pins(f"{{at_mm = -8.0, {ROLLER}}}, {{at_mm = 8.0, {CATALOGUE}}}")
    size = np.abs(springs.plan.compliance).max()
    assert_allclose(kinds.plan.compliance, springs.plan.compliance, rtol=1e-6, atol=1e-9 * size)


def test_a_bearing_of_a_catalogue_on_a_shaft_is_as_stiff_as_estimated_and_said_so(tmp_path):
    text = SMALL.replace("axial_N_per_mm = 1e5\nradial_N_per_mm = 2e5", f"axial_N_per_mm = 1e5\n{CATALOGUE}")
    file = load(written(tmp_path, text))
    bearing = file.model.sections.bearings[0]
    (note,) = file.notes
    load_N = float(note.split(" N/mm across under ")[1].split()[0])
    assert bearing.radial_N_per_mm == pytest.approx(NEEDLES.radial_N_per_mm(load_N), rel=5e-3)
    assert (bearing.axial_N_per_mm, bearing.catalogue) == (1e5, None)
    assert "needle bearing, bore 36 mm" in note


@pytest.mark.parametrize(("keys", "words"), [
    (f"{ROLLER}, {BALLS}", "ball, roller: a bearing has one kind"),
    (f"{CATALOGUE}, radial_N_per_mm = 1e5", "catalogue, radial_N_per_mm: a bearing has one kind"),
    (CATALOGUE.replace("50.0", "30.0"), "catalogue: outer_mm = 30: must be above bore_mm = 36"),
    (ROLLER.replace(" }", ", contact_angle_deg = 12.0 }"), "contact_angle_deg = 12: pins take bearings without one"),
    (BALLS.replace("9, ball", "30, ball"), "the balls overlap"),
    (ROLLER.replace(" }", ", rows = 2, row_spacing_mm = 5.0 }"), "rows overlap: their elements take 9 mm"),
    (f"{ROLLER} }}, {{ at_mm = 8.0, {BALLS}", "their elements overlap"),
    (ROLLER.replace(" }", ', arrangement = "face_to_face" }'), "is of two rows: write rows = 2, and not 1"),
    (ROLLER.replace(" }", ', arrangement = "back_to_back", rows = 2, row_spacing_mm = 12.0 }'), "that take thrust"),
    (ROLLER.replace(" }", ", axial_preload_N = 300.0 }"), "a bearing without contact angle has none"),
    (ROLLER.replace(" }", ", contact_angle_deg = 12.0, axial_preload_N = 3.0, axial_preload_mm = 0.1 }"), "same"),
    (f"spherical_{ROLLER}", "both rows overlap: their middles are 0 mm apart"),
    (SPHERICAL.replace(" }", ", profile_radius_mm = 40.0 }"), "at most the radius of the sphere .*, 24.97 mm"),
    (SPHERICAL, "a single one lets the planet tip over"),
])  # fmt: skip
def test_a_bearing_on_a_pin_that_is_none_is_refused(keys, words):
    with pytest.raises(CaseError, match=words):
        on_pins(f"{{at_mm = 0.0, {keys}}}")
