"""Blanks of sun and planets: a web as wide as the face is the bored gear, lighter ones give way on both flanks."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor
from pmor.case.blank import BlankCase
from tests.support.small_sets import SMALL_CHAIN, SMALL_SET, written_set

LIGHT = "rim_thickness_mm = {rim}\nweb_thickness_mm = {web}\nhub_radius_mm = 20.0\n"


def solved(folder, rim=4.0, web=6.0, member="planet", more="", errors="0.0, 0.0, 0.0", sides=""):
    """The small set, of planets alike, with a blank below the teeth of a member."""
    text = SMALL_SET.replace("[10.0, 0.0, 0.0]", f"[{errors}]").replace("torques_Nm = [100.0]", "")
    text = text.replace("bore_radius_mm = 18.0", "bore_radius_mm = 12.0").replace("[sweep]", f"{sides}[sweep]")
    if web:
        text += f"[{member}.blank]\n{LIGHT.format(rim=rim, web=web)}{more}"
    found = pmor.gear_set(written_set(folder, text))
    assert not found.failures
    return found


@pytest.fixture(scope="module")
def bored(tmp_path_factory):
    return solved(tmp_path_factory.mktemp("bored"), web=0.0)


@pytest.mark.parametrize("member", ["sun", "planet"])
def test_a_web_as_wide_as_the_face_is_the_bored_gear(member, bored, tmp_path):
    found = solved(tmp_path, web=20.0, member=member)
    assert_allclose(found.ste_um, bored.ste_um, rtol=1e-9)
    assert_allclose(found.planet_share, bored.planet_share, rtol=1e-9)


def test_harmonics_below_an_interface_are_the_elements_of_bored_planets(bored, tmp_path, monkeypatch):
    """The bore, and both flanks of a planet between sun and ring; rows of elements differ."""
    monkeypatch.setattr(BlankCase, "fills", lambda self, width: False)
    found = solved(tmp_path, web=20.0)
    assert_allclose(found.ste_um, bored.ste_um, rtol=2e-3)
    assert (found.ste_um != bored.ste_um).any()


def test_lighter_planets_give_way_more_and_sun_and_ring_the_more_together(bored, tmp_path):
    means = [bored.ste_um.mean()]
    for rim, web in ((6.0, 10.0), (4.0, 6.0), (4.0, 3.0)):
        means.append(solved(tmp_path, rim=rim, web=web).ste_um.mean())
    assert (np.diff(means) > 0.0).all()
    assert means[-1] > 1.1 * means[0]


@pytest.mark.slow
def test_a_web_beside_the_middle_takes_the_whole_width_of_all_meshes(tmp_path):
    """A web ahead of the middle and one behind it are images of each other, as spur planets are."""
    ahead, behind = (solved(tmp_path, more=f"web_offset_mm = {side}\n").ste_um for side in (4.0, -4.0))
    assert_allclose(ahead, behind, rtol=1e-8)


@pytest.mark.parametrize(("helix", "angles"), [(0.0, 12), pytest.param(15.0, 48, marks=pytest.mark.slow)])
def test_a_light_idler_between_equal_gears_bends_alike_on_both_sides(helix, angles, tmp_path):
    distance = float(92.0 / np.cos(np.radians(helix)))
    text = SMALL_CHAIN.replace("[0.0, 92.0]", f"[0.0, {distance!r}]").replace(
        "[88.0, 92.0]", f"[0.0, {2 * distance!r}]"
    )
    text = text.replace("[output]\nteeth = 19\nbore_radius_mm = 19.0", "[output]\nteeth = 21\nbore_radius_mm = 21.0")
    text = text.replace("[pair]", f"[pair]\nhelix_angle_deg = {helix}").replace("= 6\n[mesh]", f"= {angles}\n[mesh]")
    text = text.replace("bore_radius_mm = 25.0", "bore_radius_mm = 12.0")
    text += f"[idler.blank]\n{LIGHT.format(rim=4.0, web=5.0)}"
    first, idler, last = (gear.cycle for gear in pmor.gear_set(written_set(tmp_path, text)).solution.root_stress)
    assert_allclose(*idler.range_MPa[0, 0], rtol=2e-3)
    assert_allclose(*idler.most_MPa[0, 0], rtol=1e-2)
    assert_allclose(last.range_MPa, first.range_MPa, rtol=5e-3)
