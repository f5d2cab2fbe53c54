"""Campaigns of sets: what follows from relations, and which designs cannot be made, before anything is meshed."""

import math
import tomllib

import pytest

import pmor.sets.reader as reader_module
from pmor.campaigns.chunks import INFEASIBLE_S, expected_cost
from pmor.campaigns.loader import load
from pmor.campaigns.plan import plan, why_not
from pmor.campaigns.run import task_of
from pmor.campaigns.set_relations import text_of_design, with_kept_sums, with_relations
from pmor.campaigns.settings import SetRelations
from pmor.campaigns.solve import row_of
from pmor.campaigns.table import designs_of
from pmor.core.errors import CaseError, GeometryError
from pmor.gear.pair import zero_backlash_centre_distance
from pmor.sets.kinematics import member_speeds
from pmor.sets.loader import parse_set
from pmor.sets.preview import pairs_of
from pmor.storage.gear_store import Store
from tests.support.small_set_campaign import BASE, DESIGNS, RELATIONS, STEPPED, written

ROUND_OFF = 1e-12
# Profile shifts are rounded to so many modules.
SHIFTS = 1e-11


@pytest.mark.parametrize("relations", [{"solve": "sun"}, {"solve": "ring"}, {"centre_distance_mm": 75.0}])
@pytest.mark.parametrize("helix", [0.0, 14.0])
def test_profile_shifts_leave_no_backlash_in_either_mesh_at_one_distance(relations, helix):
    """20 + 17 and 55 - 17 teeth have no distance in common without shifts."""
    design = {"sun.teeth": 20, "ring.teeth": 55, "planet.profile_shift": 0.1, "pair.helix_angle_deg": helix}
    found = with_relations(BASE, design, SetRelations(planet_teeth_fewer=0, **relations))
    assert found["planet.teeth"] == 17
    pairs = pairs_of(parse_set(text_of_design(BASE, found), "set", "set"))
    tight = [abs(zero_backlash_centre_distance(pair.pinion, pair.wheel)) for pair in pairs.values()]
    assert tight[0] == pytest.approx(tight[1], rel=SHIFTS)
    assert tight[0] == pytest.approx(relations.get("centre_distance_mm", tight[1]), rel=SHIFTS)
    assert {name for name in found if name.endswith("profile_shift") and found[name]} >= {"planet.profile_shift"}


@pytest.mark.parametrize("relations", [{"solve": "sun"}, {"centre_distance_mm": 75.2}])
def test_stepped_planets_mesh_without_backlash_at_one_distance_too(relations):
    """18 + 20 teeth of module 4 and 54 - 16 of module 3.95."""
    found = with_relations(STEPPED, {}, SetRelations(**relations, ratio=4.75, ratio_tolerance_percent=1e-9))
    pairs = pairs_of(parse_set(text_of_design(STEPPED, found), "set", "set"))
    tight = [abs(zero_backlash_centre_distance(pair.pinion, pair.wheel)) for pair in pairs.values()]
    assert tight == pytest.approx([relations.get("centre_distance_mm", 0.5 * 38 * 3.95)] * 2, rel=SHIFTS)


def test_a_base_set_that_fits_by_relations_alone_is_taken(tmp_path):
    path = written(tmp_path)
    (tmp_path / "set.toml").write_text(BASE.replace("teeth = 54", "teeth = 55"))
    assert load(path).count == 4
    path.write_text(DESIGNS)
    with pytest.raises(GeometryError, match="set.toml"):
        load(path)


def test_a_ring_that_leaves_a_planet_no_teeth_is_refused():
    for sun in (20, 30, 54):
        with pytest.raises(GeometryError, match=f"sun and ring of {sun} and 20 teeth leave a planet none"):
            with_relations(BASE, {"sun.teeth": sun, "ring.teeth": 20}, SetRelations(planet_teeth_fewer=0, solve="sun"))


def test_module_and_bores_follow_from_the_diameter_of_the_ring():
    said = SetRelations(ring_diameter_mm=250.0, bore_share=0.4)
    found = with_relations(BASE, {"pair.helix_angle_deg": 12.0, "ring.teeth": 60, "sun.teeth": 21}, said)
    transverse = found["pair.module_mm"] / math.cos(math.radians(12.0))
    assert 60 * transverse == pytest.approx(250.0, rel=ROUND_OFF)
    assert found["sun.bore_radius_mm"] == pytest.approx(0.4 * 0.5 * 21 * transverse, rel=ROUND_OFF)
    assert found["planet.bore_radius_mm"] == pytest.approx(0.4 * 0.5 * 18 * transverse, rel=ROUND_OFF)


@pytest.mark.parametrize(
    ("on", "held"), [(on, held) for on in member_speeds((18, 54), "sun", "ring", 1.0) for held in
                     ("sun", "ring", "carrier") if held != on]
)  # fmt: skip
def test_the_ratio_is_that_of_the_driven_member_whichever_drives(on, held):
    """With 18 and 54 teeth sun, ring and carrier turn as 18 s + 54 r = 72 c says."""
    ratios = {("sun", "ring"): 4.0, ("sun", "carrier"): 3.0, ("ring", "sun"): 4.0 / 3.0, ("ring", "carrier"): 1.0 / 3.0,
              ("carrier", "ring"): 0.25, ("carrier", "sun"): 0.75}  # fmt: skip
    base = BASE.replace("torque_Nm = 300.0", f'torque_Nm = 300.0\non = "{on}"\nheld = "{held}"')
    exact = SetRelations(ratio=ratios[on, held], ratio_tolerance_percent=1e-9)
    assert with_relations(base, {}, exact) == {}
    with pytest.raises(GeometryError, match="19 and 54 teeth of sun and ring give .* off by .* take other teeth"):
        with_relations(base, {"sun.teeth": 19}, exact)


def test_the_text_of_a_design_is_a_set_file_with_sections_inside_kept():
    base = BASE + "[sun.modification]\ntip_relief_um = 4.0\n[planet.blank]\nrim_thickness_mm = 9.0\n"
    design = {"sun.modification.helix_crowning_um": 3.0, "planets.count": 4, "mesh.width_elements": 4}
    text = text_of_design(base, design)
    found = tomllib.loads(text)
    assert found["sun"] == tomllib.loads(base)["sun"] | {
        "modification": {"tip_relief_um": 4.0, "helix_crowning_um": 3.0}
    }
    assert found["planet"] == tomllib.loads(base)["planet"]
    assert (found["planets"]["count"], found["mesh"]["width_elements"]) == (4, 4)


PINS = """[pins]
diameter_mm = 24.0
length_mm = 50.0
bearings = [{ at_mm = -9.0, radial_N_per_mm = 1e5 }, { at_mm = 9.0, radial_N_per_mm = 1e5 }]
"""


def test_numbers_and_sections_in_lists_differ_by_their_places(tmp_path):
    path = written(tmp_path, 'set = "set.toml"\n[designs]\nmethod = "list"\nplanets.tangential_um.2 = [5.0, -5.0]\n'
                   "pins.bearings.2.at_mm = [8.0, 7.0]\n")  # fmt: skip
    base = BASE.replace("count = 3\n", "count = 3\ntangential_um = [1.0, 0.0, 0.0]\n") + PINS
    (tmp_path / "set.toml").write_text(base)
    campaign = load(path)
    text = tomllib.loads(campaign.kind.text(campaign.base_text, designs_of(campaign)(1)))
    assert text["planets"]["tangential_um"] == [1.0, -5.0, 0.0]
    assert [bearing["at_mm"] for bearing in text["pins"]["bearings"]] == [-9.0, 7.0]
    (tmp_path / "set.toml").write_text(BASE + PINS)
    campaign = load(path)
    assert "tangential_um" in base
    assert "the base file lists 0 there" in why_not(campaign, 0, designs_of(campaign)(0))
    path.write_text(path.read_text().replace("bearings.2", "bearings.3"))
    with pytest.raises(CaseError, match=r"pins.bearings.3: no section of a set"):
        load(path)
    path.write_text(path.read_text().replace("pins.bearings.3.at_mm = [8.0, 7.0]", "planets.count.1 = [1, 2]"))
    with pytest.raises(CaseError, match=r"planets.count"):
        load(path)


def test_shifts_that_keep_their_sums_keep_axes_and_backlash_of_both_meshes():
    """Involutes mesh by the sum of their shifts (ISO 21771, 6.2)."""
    design = {"planet.profile_shift": 0.15}
    found = design | with_kept_sums(BASE, design)
    before, after = (pairs_of(parse_set(text, "set", "set")) for text in (BASE, text_of_design(BASE, found)))
    for name in before:
        assert after[name].backlash == pytest.approx(before[name].backlash, abs=ROUND_OFF)
        assert after[name].centre_distance == before[name].centre_distance
        tight = [zero_backlash_centre_distance(pair[name].pinion, pair[name].wheel) for pair in (before, after)]
        assert tight[1] == pytest.approx(tight[0], rel=ROUND_OFF)
    assert found["sun.profile_shift"] != 0.0


REFUSED = {
    "ratio": ("ratio = 5.0", "[relations] ratio = 5: 18 and 54 teeth"),
    "assembly": ("", "cannot be assembled: teeth of sun and ring add up to 73, which is no multiple of 3"),
    "neighbours": ("", "neighbours are 72 mm apart, and their tip circles are 80 mm wide"),
    "distances": ("", "apart, planet and ring"),
}  # fmt: skip
CHANGES = {"ratio": {}, "assembly": {"ring.teeth": 55}, "neighbours": {"planets.count": 6},
           "distances": {"planet.teeth": 17}}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_a_design_is_refused_by_its_condition_in_plan_and_row_alike(name, tmp_path, monkeypatch):
    relations, words = REFUSED[name]
    variables = "".join(f"{key} = [{value}, {value + 12}]\n" for key, value in CHANGES[name].items())
    text = DESIGNS.split("sun.teeth")[0] + (variables or "sun.teeth = [18, 30]\n") + f"[relations]\n{relations}\n"
    campaign = load(written(tmp_path, text))
    if name in ("ratio", "assembly"):  # what costs geometry is not asked

        def asked(*arguments):
            raise AssertionError("tooth numbers suffice")

        monkeypatch.setattr(reader_module, "gear_pair", asked)
    design, store = designs_of(campaign)(0), Store(tmp_path, 0.0)
    row = row_of(task_of(campaign, store), 1, design, store)
    assert row["status"] == "infeasible"
    assert words in row["reason"]
    assert row["reason"] == " ".join(why_not(campaign, 0, design).split())


def test_the_time_of_a_campaign_counts_the_few_sets_that_can_be_made(tmp_path):
    """One ring of 600 has the ratio: 18 and 54 teeth."""
    text = DESIGNS.split("sun.teeth")[0] + "ring.teeth = { from = 50, to = 649, steps = 600 }\n"
    campaign = load(written(tmp_path, f"{text}[relations]\nratio = 4.0\nratio_tolerance_percent = 0.1\n"))
    text = campaign.kind.text(campaign.base_text, {"ring.teeth": 54})
    one = campaign.kind.cost(text, "design", campaign.results)
    expected = one.solved + sum(one.elements.values()) + 599 * INFEASIBLE_S
    found = expected_cost(campaign, designs_of(campaign))
    assert [600 * found.seconds, found.finely, 600 * found.share] == pytest.approx([expected, one.finely, 1])


def test_a_plan_tells_what_follows_and_how_many_sets_cannot_be_made(tmp_path):
    lines = plan(
        load(written(tmp_path, DESIGNS + RELATIONS + "ratio = 3.85\nratio_tolerance_percent = 4.0\n"))
    ).text.splitlines()
    assert "  4 designs of the set set.toml, grid" in lines
    assert (
        "  planet.teeth, sun.bore_radius_mm, planet.bore_radius_mm, sun.profile_shift: from [relations] ratio = 3.85, "
        'ratio_tolerance_percent = 4.0, planet_teeth_fewer = 0, bore_share = 0.5, solve = "sun"'
    ) in lines
    assert "  2 of 4 designs can be made" in lines
    assert any(line.startswith("  1, such as design 2: [relations] ratio = 3.85: 18 and 55 teeth") for line in lines)
    assert any("such as design 3: [planets] planet 2 at 120 deg: cannot be assembled" in line for line in lines)
