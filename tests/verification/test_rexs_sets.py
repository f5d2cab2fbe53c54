"""A public planetary stage in REXS: members, planets, load and supports are the file's; what it lacks is said."""

import re
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor
from pmor.app.records import kind_of
from pmor.body.beam import Beam, BeamSeat, CircularSection, ShaftMaterial, seated_beam
from pmor.case.capability import why_not
from pmor.core.errors import CaseError
from pmor.rexs.files import load_set as load
from pmor.rexs.set_supports import RexsSupports
from pmor.rexs.write_set import set_rexs
from pmor.sets.loader import parse_set
from tests.support.small_sets import SMALL_CHAIN, SMALL_SET

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
    assert re.search(r"ring_gear 58 .*shortened to 0.94, k = -0.06: .* its tip cuts 0.0125 mm into its mate's", change)
    assert file.sections.members["ring"]["addendum"] == 0.94  # 76 nm are less than rounding leaves
    assert any("no tip_diameter: addendum 1 assumed" in note for note in file.notes)
    assert change not in file.notes


@beside
def test_sun_and_pins_stand_on_their_shafts_and_bearings():
    """The sun overhangs 50 mm on a span of 52.5 mm, d 34; pins of d 43.2 are clamped 16.5 mm beside their bearings.

    The carrier's cheek overhangs 21 mm on a span of 50 mm, d 80 and 60, and its webs are as stiff as rigid ones.
    """
    said = load(PLANETS).sections
    supports, pins, carrier = said.supports, said.pins, said.carrier
    modulus, shear, kappa = 210e3, 210e3 / 2.6, 6 * 1.3 / (7 + 6 * 0.3)
    area, second = np.pi * 34.0**2 / 4.0, np.pi * 34.0**4 / 64.0
    bends = 50.0**2 * (52.5 + 50.0) / (3.0 * modulus * second)
    shears = (50.0 + 50.0**2 / 52.5) / (kappa * shear * area)
    assert_allclose(supports.sun_radial_N_per_mm, 1.0 / (bends + shears), rtol=1e-6)
    area, second = np.pi * 43.2**2 / 4.0, np.pi * 43.2**4 / 64.0
    assert (pins.diameter_mm, pins.inner_mm, pins.length_mm, pins.middle_mm) == (43.2, 0.0, 58.0, 0.0)
    assert (pins.ends, pins.cheeks, pins.youngs_modulus_GPa) == ("clamped", "both", 210.0)
    assert [(bearing.at_mm, bearing.radial_N_per_mm) for bearing in pins.bearings] == [
        (-12.5, "rigid"),
        (12.5, "rigid"),
    ]
    assert supports.planet_radial_N_per_mm == carrier.windup_Nmm_per_rad == "rigid"
    # Slope of the cheek under a moment there, and the deflection that goes with it.
    second = np.pi * (80.0**4 - 60.0**4) / 64.0
    area, ratio = np.pi * (80.0**2 - 60.0**2) / 4.0, (60.0 / 80.0) ** 2
    kappa = 6 * 1.3 * (1 + ratio) ** 2 / ((7 + 6 * 0.3) * (1 + ratio) ** 2 + (20 + 12 * 0.3) * ratio)
    slope = (50.0 / 3.0 + 21.0) / (modulus * second) + 1.0 / (50.0 * kappa * shear * area)
    both = (21.0 * 50.0 / 3.0 + 21.0**2 / 2.0) / (modulus * second) + 21.0 / (50.0 * kappa * shear * area)
    across = 21.0**2 * (50.0 + 21.0) / (3.0 * modulus * second) + (21.0 + 21.0**2 / 50.0) / (kappa * shear * area)
    # Spur planets, 29 mm beyond the cheek.
    assert carrier.tilt_Nmm_per_rad == "rigid"
    assert_allclose(carrier.radial_N_per_mm, 1.0 / (across + 2.0 * 29.0 * both + 29.0**2 * slope), rtol=1e-6)
    helical = RexsSupports(None, PLANETS, [], -1, True).on_bearings(np.array([[across, both], [both, slope]]), 29.0)
    assert_allclose(helical["tilt_Nmm_per_rad"], 1.0 / slope, rtol=1e-6)
    assert_allclose(helical["bearings_at_mm"], 29.0 + both / slope, rtol=1e-6)
    assert_allclose(helical["radial_N_per_mm"], 1.0 / (across - both**2 / slope), rtol=1e-6)


@beside
def test_what_a_pin_in_a_file_has_beyond_a_uniform_one_is_its_stiffness_across(tmp_path):
    """Two bearings by their stiffness beside a pin that one end alone holds rigidly."""
    soft = changed(tmp_path, ('<attribute id="bending_stiffness" unit="N mm / rad">1.0E20<',
                              '<attribute id="bending_stiffness" unit="N mm / rad">1.0E9<'))  # fmt: skip
    said = load(soft)
    assert said.sections.pins is None
    assert 1e6 < said.sections.supports.planet_radial_N_per_mm < 2e7
    assert any("its tilt is left out" in note for note in said.notes)


def test_a_shaft_that_nothing_holds_has_no_flexibility():
    beam = Beam(np.array([0.0, 50.0, 100.0]), [CircularSection(30.0)] * 2, ShaftMaterial(210e3, 0.3))
    assert seated_beam(beam, [BeamSeat(0.0, np.inf, 0.0)], [50.0]) is None
    rigid = seated_beam(beam, [BeamSeat(0.0, np.inf, np.inf)], [50.0, 100.0])
    springs = seated_beam(beam, [BeamSeat(0.0, 1e13, 1e16)], [50.0, 100.0])
    for found, expected in zip(springs, rigid, strict=True):
        assert_allclose(found, expected, rtol=1e-6, atol=1e-6)
    assert_allclose(rigid.carried, [[1.0, 50.0], [0.0, 1.0], [1.0, 100.0], [0.0, 1.0]], rtol=1e-9, atol=1e-12)


@pytest.mark.slow
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
    assert kind_of(PLANETS) == "set"
    text = pmor.plan(PLANETS)
    for words in ("planet 3", "3 x 22/61 teeth", "finite elements, sun-planet", "in all", "! ring_gear 58"):
        assert words in text


@pytest.mark.parametrize("change", [
    ("[mesh]", '[supports]\nsun_radial_N_per_mm = "free"\nplanet_radial_N_per_mm = 4e5\n[mesh]'),
    ("torque_Nm = 300.0", 'torque_Nm = -1200.0\non = "carrier"\nheld = "ring"'),
    ("torque_Nm = 300.0", 'torque_Nm = 900.0\non = "ring"\nheld = "sun"\nspeed_rpm = 100.0'),
    ("count = 3\ntangential_um = [10.0, ", "count = 4\nmissing = [2]\ntangential_um = [10.0, 3.0, "),
    ("[mesh]", "[pins]\ndiameter_mm = 30.0\ninner_mm = 9.0\nlength_mm = 36.0\nends = \"supported\"\n"
     "bearings = [{at_mm = 2.0, tilt_Nmm_per_rad = 1e9}]\n[mesh]"),
    ("count = 3", "count = 3\npositions_deg = [170.0, 290.0, 50.0]"),
    ("bore_radius_mm = 18.0\n[ring]", "bore_radius_mm = 27.0\n[ring]\ntooth_thickness_allowance_um = [-60.0, -50.0]"),
], ids=["springs", "carrier", "sun held", "a planet missing", "supported pins", "turned", "thin rim"])  # fmt: skip
def test_a_set_goes_out_and_comes_back_as_it_is(change, tmp_path):
    """What it stands on, how it is loaded, where its pins are."""
    assert change[0] in SMALL_SET
    file = parse_set(SMALL_SET.replace(*change), "small", "small")
    (tmp_path / "small.rexs").write_bytes(set_rexs(file, None, "2026-01-01T00:00:00+00:00"))
    back = load(tmp_path / "small.rexs")
    assert back.sections.load == file.sections.load
    assert back.changed == ()
    assert [case.pair for case in back.cases.values()] == [case.pair for case in file.cases.values()]
    for name in ("free", "compliance", "displacement", "load"):
        expected = getattr(file.plan, name)
        assert_allclose(getattr(back.plan, name), expected, rtol=1e-8, atol=1e-12 * np.abs(expected).max())


def test_flanks_that_lean_towards_one_end_do_so_from_whichever_end_their_mesh_is_seen(tmp_path):
    """REXS counts slopes of all flanks from the datum face, here at +z: positive where less is left at -z."""
    leaning = {"sun.modification": (6.0, -2.0), "planet.modification": (5.0, 1.0),
               "planet.coast_modification": (5.0, 1.0), "ring.coast_modification": (-3.0, 4.0)}  # fmt: skip
    text = SMALL_SET + "".join(
        f"[{flank}]\nhelix_slope_um = {slope}\ntwist_um = {twist}\nend_relief_um = 2.0\nend_relief_length_mm = 1.5\n"
        for flank, (slope, twist) in leaning.items()
    )
    file = parse_set(text, "small", "small")
    out = set_rexs(file, None, "2026-01-01T00:00:00+00:00")
    (tmp_path / "small.rexs").write_bytes(out)
    slopes = [float(value) for value in re.findall(r'id="helix_slope"[^>]*>([^<]*)<', out.decode())]
    assert_allclose(slopes, [-6e-3, -6e-3, 3e-3, *[-5e-3] * 6], rtol=1e-9)  # sun twice, ring, planets
    for case, back in zip(file.cases.values(), load(tmp_path / "small.rexs").cases.values(), strict=True):
        for name in ("pinion_modification", "wheel_modification"):
            expected, found = getattr(case, name), getattr(back, name)
            for key in ("helix_slope_um", "twist_um", "end_relief_um"):
                assert getattr(found, key) == pytest.approx(getattr(expected, key), rel=1e-9), (name, key)


@pytest.mark.parametrize(("text", "words"), [
    (SMALL_CHAIN.replace("torque_Nm", "eccentricity_um = 5.0\ntorque_Nm", 1), "gears that are centred"),
    (SMALL_SET.replace("torque_Nm = 300.0", "torque_Nm = -300.0"), "counter-clockwise: give it the other sign"),
    (f"{SMALL_SET}[supports]\nring_radial_N_per_mm = 1e5\n", "across their axes alone: leave the others out"),
    (f"{SMALL_SET}[carrier]\nradial_N_per_mm = 1e5\n", "leave \\[carrier\\] out"),
    (f"{SMALL_SET}[eccentricity]\nsun_um = 5.0\n", "leave \\[eccentricity\\] out"),
    (SMALL_SET.replace("[planet]", "[planet]\nface_width_mm = 18.0\nface_offset_mm = 1.0"),
     "alike from both ends: leave out face_offset_mm"),
    (SMALL_SET.replace("rim_thickness_mm = 12.0",
                       "rim_thickness_mm = 12.0\nheld = {lugs = 4, lug_deg = 10.0}"), "leave held and seats out"),
], ids=["train", "clockwise", "ring", "carrier", "eccentric", "one way", "lugs"])  # fmt: skip
def test_what_rexs_has_no_words_for_is_told_with_what_to_do(text, words):
    assert re.search(words, why_not(parse_set(text, "small", "small"), "rexs"))
