"""A public planetary stage in REXS: members, planets, load and supports are the file's; what it lacks is said."""

import re
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor
from pmor.body.beam import Beam, CircularSection, ShaftMaterial
from pmor.core.errors import CaseError
from pmor.export.rexs.model import RIGID, RIGID_TILT
from pmor.sets.loader import is_set, load
from pmor.sets.rexs import Seat, flexibility

PLANETS = Path(__file__).parents[3] / "shared" / "rexs" / "FVA_Planetary_stage_-_Minus_gearing_1.1.rexs"
beside = pytest.mark.skipif(not PLANETS.is_file(), reason="the public REXS files are not beside the project")


def changed(folder, *changes):
    """The file with some of its text replaced."""
    text = PLANETS.read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = folder / "changed.rexs"
    path.write_text(text)
    return path


@beside
def test_the_planetary_stage_is_read_as_it_is_filed():
    file = load(PLANETS)
    said, plan = file.sections, file.plan
    assert (said.load.torque_Nm, said.load.on, said.load.held) == (pytest.approx(1591.549), "sun", "ring")
    assert said.load.speed_rpm == 1500.0
    assert [said.members[name]["teeth"] for name in ("sun", "planet", "ring")] == [17, 22, 61]
    assert said.members["ring"]["shaper"] == {"teeth": 23, "addendum": 1.25, "tip_radius_mm": 0.0}
    assert said.members["planet"]["rack_tip_radius"] == 0.25
    assert (said.members["pair"]["module_mm"], said.members["pair"]["face_width_mm"]) == (4.0, 50.0)
    assert (said.members["sun"]["bore_radius_mm"], said.members["planet"]["bore_radius_mm"]) == (17.0, 29.0)
    assert len(plan.planets) == 3
    assert_allclose([np.hypot(plan.bodies[n].x, plan.bodies[n].y) for n in plan.planets], 78.0, rtol=1e-12)


@beside
def test_teeth_that_would_not_run_as_filed_are_named_with_what_was_changed():
    file = load(PLANETS)
    (change,) = file.changed
    assert re.search(r"ring_gear 58 .*shortened to 0.93: .* its tip cuts 0.0125 mm into its mate's fillet", change)
    assert file.sections.members["ring"]["addendum"] == 0.93
    assert any("no tip_diameter: addendum 1 assumed" in note for note in file.notes)
    assert change not in file.notes


@beside
def test_sun_and_pins_stand_on_their_shafts_and_bearings():
    """The sun overhangs 50 mm on a span of 52.5 mm, d 34; pins of d 43.2 are clamped 16.5 mm beside their bearings."""
    supports = load(PLANETS).sections.supports
    modulus, shear, kappa = 210e3, 210e3 / 2.6, 6 * 1.3 / (7 + 6 * 0.3)
    area, second = np.pi * 34.0**2 / 4.0, np.pi * 34.0**4 / 64.0
    bends = 50.0**2 * (52.5 + 50.0) / (3.0 * modulus * second)
    shears = (50.0 + 50.0**2 / 52.5) / (kappa * shear * area)
    assert_allclose(supports.sun_radial_N_per_mm, 1.0 / (bends + shears), rtol=1e-6)
    area, second = np.pi * 43.2**2 / 4.0, np.pi * 43.2**4 / 64.0
    # Two equal forces: no slope in the middle, moment of the clamp F a (L - a) / L.
    span, a = 58.0, 16.5
    clamp = a * (span - a) / span
    bends = (clamp * a**2 / 2.0 - a**3 / 6.0) / (modulus * second)
    assert_allclose(supports.planet_radial_N_per_mm, 2.0 / (bends + a / (kappa * shear * area)), rtol=1e-6)


def test_a_shaft_that_nothing_holds_has_no_flexibility():
    beam = Beam(np.array([0.0, 50.0, 100.0]), [CircularSection(30.0)] * 2, ShaftMaterial(210e3, 0.3))
    assert flexibility(beam, [Seat(0.0, RIGID, 0.0)], [50.0]) is None
    clamped = flexibility(beam, [Seat(0.0, RIGID, RIGID_TILT)], [50.0, 100.0])
    assert clamped[0, 1] == pytest.approx(clamped[1, 0])
    assert clamped[1, 1] > clamped[0, 1] > clamped[0, 0] > 0.0


@beside
def test_a_load_in_the_other_sense_sees_the_planets_from_the_other_end(tmp_path):
    """One planet one place of 78 off its third of the turn."""
    step = 2.0 * np.pi / 78.0
    y, z = 78.0 * np.sin(2.0 * np.pi / 3.0 + step), 78.0 * np.cos(2.0 * np.pi / 3.0 + step)
    moved = ("67.54998149518622", repr(float(y))), ("-38.999999999999986", repr(float(z)))
    file = load(changed(tmp_path, *moved))
    whole = load(changed(tmp_path, *moved, (">1591.5494309189535<", ">-1591.5494309189535<")))
    # A turn from vertical to +y is clockwise seen from +x.
    assert_allclose(file.sections.planets.positions_deg, [0.0, 120.0, 240.0 - 360.0 / 78.0], atol=1e-6)
    assert_allclose(whole.sections.planets.positions_deg, [0.0, 120.0 + 360.0 / 78.0, 240.0], atol=1e-6)


@beside
@pytest.mark.parametrize(("change", "words"), [
    ((">1591.5494309189535<", ">0.0<"), "enters at no member"),
    (('type="switchable_coupling"', 'type="clutch"'), "no member held"),
    (('type="planetary_stage"', 'type="stage_of_planets"'), "has no planetary stage"),
], ids=["no torque", "nothing held", "no stage"])  # fmt: skip
def test_a_file_that_does_not_say_enough_is_refused(change, words, tmp_path):
    with pytest.raises(CaseError, match=words):
        load(changed(tmp_path, change))


@beside
def test_a_plan_has_gears_meshes_cost_and_assumptions():
    assert is_set(PLANETS)
    text = pmor.plan_set(PLANETS)
    for words in ("planet 3", "3 x 22/61 teeth", "finite elements, sun-planet", "in all", "! ring_gear 58"):
        assert words in text
