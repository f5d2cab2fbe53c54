"""Sets of gears with holes, whose teeth differ on both flanks: against pairs, and what symmetry says over cycles."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor
import pmor.body.elastic_gear
import pmor.body.on_blank
import pmor.pair.blank
from pmor.pair.conditions import nominal_condition
from pmor.pair.model import elastic_model, mesh_model
from pmor.sets.model import SetBody, SetMesh, build_train
from pmor.sets.solution import solve_set
from pmor_offline.train import train
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.model import reduced_pair
from tests.support.small_sets import MODULE, SMALL_CHAIN, SMALL_SET, line_case, rotations, written_set

ANGLES, PLANET = 4, 18
# Newton's method of two equal states.
SOLVED = 1e-8
BLANK = "[planet.blank]\nrim_thickness_mm = 4.0\nweb_thickness_mm = 6.0\nhub_radius_mm = 17.0\n"


@pytest.fixture(scope="module", autouse=True)
def few_harmonics():
    """Identities hold with as few harmonics as the web begins with, and fewer of those that feel holes."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pmor.body.on_blank, "LEFT_OUT", np.inf)
        patch.setattr(pmor.pair.blank, "FELT", 30.0)
        yield


def of_holes(count=4, first_deg=9.0, radius=2.5):
    return f"holes = {{count = {count}, radius_mm = {radius}, on_radius_mm = 22.0, first_deg = {first_deg!r}}}\n"


def solved(folder, holes, *changes):
    """The small set, of planets on a web with holes: all mesh cycles until all is as before."""
    text = SMALL_SET.replace("torques_Nm = [100.0]", "").replace("[10.0, 0.0, 0.0]", "[0.0, 0.0, 0.0]")
    text = text.replace("[planet]\nteeth = 18\nbore_radius_mm = 18.0", "[planet]\nteeth = 18\nbore_radius_mm = 12.0")
    text = text.replace("_pitch = 6", f"_pitch = {ANGLES}").replace("width_elements = 2", "width_elements = 1")
    for change in changes:
        text = text.replace(*change)
    found = pmor.run(written_set(folder, f"{text}[results]\nroot_stress = false\n{BLANK}{holes}"))
    assert not found.failures
    return found


@pytest.fixture(scope="module")
def four(tmp_path_factory):
    return solved(tmp_path_factory.mktemp("four"), of_holes())


@pytest.mark.slow
def test_all_is_as_before_when_holes_stand_to_the_teeth_as_before(four):
    """18 teeth and 4 holes repeat after 9 pitches; planets alike to sun and ring carry alike at any angle."""
    assert four.data["pitches"] == PLANET // math.gcd(PLANET, 4)
    assert_allclose(four.planet_share, 1.0 / 3.0, rtol=SOLVED)
    ste = four.ste_um[0]
    assert np.ptp(ste.reshape(-1, ANGLES), axis=0).max() > 1e-4 * ste.mean()
    again = solve_set(four.file.plan, four.solution.train, four.solution.torque_Nm, ANGLES, 2 * four.solution.pitches)
    assert_allclose(again.ste_um[0], np.tile(ste, 2), rtol=SOLVED)


def test_holes_of_the_first_planet_are_drawn_where_the_file_has_them(four):
    planet = four.file.plan.bodies[2]
    (axes,) = four.plot_set().axes
    middles = [
        patch.get_xy()[:-1].mean(axis=0) for patch in axes.patches if patch.get_facecolor()[:3] == (1.0, 1.0, 1.0)
    ]
    assert len(middles) == 3 * 4
    angle = np.radians(9.0)
    expected = [planet.x - 22.0 * np.sin(angle), planet.y + 22.0 * np.cos(angle)]
    assert_allclose(middles[0], expected, atol=0.01)  # mean of the points of an outline


def test_holes_turned_by_a_tooth_shift_all_by_a_pitch(four, tmp_path):
    turned = solved(tmp_path, of_holes(4, 9.0 + 360.0 / PLANET)).ste_um[0]
    # Planets turn clockwise where the sun turns counter-clockwise.
    assert_allclose(turned, np.roll(four.ste_um[0], ANGLES), rtol=SOLVED)
    assert np.abs(turned - four.ste_um[0]).max() > 1e-4 * turned.mean()


def test_holes_of_planets_count_from_where_the_pin_lies_outwards(four, tmp_path):
    """Planets that are all turned about the sun by its pitch take their holes along."""
    turned = solved(tmp_path, of_holes(), ("count = 3", "count = 3\npositions_deg = [20, 140, 260]"))
    assert_allclose(turned.ste_um, four.ste_um, rtol=SOLVED)


@pytest.mark.parametrize("which", [pytest.param(0, marks=pytest.mark.slow), 1])
def test_a_single_mesh_is_the_pair_with_holes(which):
    """Wherever the gears stand to the y axis, which holes of gears on fixed axes count from."""
    teeth, first, bend_deg, cycles = (18, 18), 23.0, 50.0, 6

    def case(first_deg):
        holes = {"count": 3, "radius_mm": 2.5, "on_radius_mm": 22.0, "first_deg": first_deg}
        blank = {"rim_thickness_mm": 4.0, "web_thickness_mm": 6.0, "hub_radius_mm": 17.0, "holes": holes}
        gears = [{"teeth": count, "bore_radius_mm": 12.0} for count in teeth]
        gears[which]["blank"] = blank
        return line_case(*gears, mesh={"profile_elements": 3, "width_elements": 1})

    bend, distance = math.radians(bend_deg), 0.5 * MODULE * sum(teeth)
    bodies = [SetBody("pinion", "pinion", 0.0, 0.0),
              SetBody("wheel", "wheel", -distance * math.sin(bend), distance * math.cos(bend))]  # fmt: skip
    # A pair counts from its line of centres; gears turn on until the pinion's first tooth stands there.
    cases = {"mesh": case((first, first + 180.0 + 2.0 * bend_deg)[which])}
    built = build_train(cases, bodies, [SetMesh("mesh", 0, 1)], rotations(2, held=(1,)), np.zeros((12, 12)))
    pair = built.meshes[0].pair.meshed.pair
    phi = pair.pitch * np.arange(cycles * ANGLES) / ANGLES
    found = built.place((phi - built.meshes[0].start) / built.meshes[0].rate).solve(np.array([[1e5]]))
    own = case(first)
    reduced = reduced_pair(train(own, elastic_model(own, mesh_model(own))).basis)
    expected = sweep_line_loads(reduced, phi, [nominal_condition(own)]).ste_um[0]
    assert_allclose(1e3 * pair.pinion.base_radius * found.movement[0, :, 0], expected, rtol=SOLVED)
    assert np.ptp(expected.reshape(-1, ANGLES), axis=0).max() > 1e-4 * expected.mean()


def of_an_idler(folder, helix, web):
    """Load cycles of an idler between equal gears; 24 teeth are their own image across the line of centres.

    It takes each mesh to the other; of helical gears half a turn about an axis across does so.
    """
    distance = float(0.5 * MODULE * (21 + 24) / np.cos(np.radians(helix)))
    text = SMALL_CHAIN.replace("[0.0, 92.0]", f"[0.0, {distance!r}]").replace(
        "[88.0, 92.0]", f"[0.0, {2.0 * distance!r}]"
    )
    text = text.replace("[output]\nteeth = 19\nbore_radius_mm = 19.0", "[output]\nteeth = 21\nbore_radius_mm = 21.0")
    text = text.replace("teeth = 25\nbore_radius_mm = 25.0", "teeth = 24\nbore_radius_mm = 14.0")
    text = text.replace("[pair]", f"[pair]\nhelix_angle_deg = {helix}").replace("_pitch = 6", f"_pitch = {ANGLES}")
    text = text.replace("width_elements = 2", "width_elements = 1")
    text += "[idler.blank]\nrim_thickness_mm = 4.0\nweb_thickness_mm = 6.0\nhub_radius_mm = 20.0\n"
    cycle = pmor.run(written_set(folder, f"{text}{web}\n")).solution.root_stress[1].cycle
    return [cycle.range_MPa[0].T, cycle.most_MPa[0].T, cycle.least_MPa[0].T]


@pytest.mark.parametrize("helix", [0.0, pytest.param(12.0, marks=pytest.mark.slow)])
def test_an_idler_with_holes_between_equal_gears_is_stressed_alike_on_both_flanks(helix, tmp_path):
    holes = "holes = {count = 4, radius_mm = 5.0, on_radius_mm = 29.5, first_deg = 0.0}"
    for one, other in of_an_idler(tmp_path, helix, holes):
        assert len(one) == 6
        assert_allclose(np.sort(one), np.sort(other), rtol=1e-6)
        assert np.ptp(one) > 1e-3 * np.abs(one).mean()


@pytest.mark.slow
def test_a_web_beside_the_middle_of_a_helical_idler_stresses_the_one_flank_as_one_on_the_other_side_the_other(tmp_path):
    ahead, behind = (of_an_idler(tmp_path, 12.0, f"web_offset_mm = {side}") for side in (4.0, -4.0))
    for values, turned in zip(ahead, behind, strict=True):
        assert_allclose(values, turned[::-1], rtol=1e-6)
        assert np.abs(values[0] - values[1]).max() > 1e-3 * np.abs(values).mean()
