"""The table of designs: which there are, what follows from relations, and their cases."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure

from pmor.campaigns.bands import bands_of
from pmor.campaigns.columns import Effort
from pmor.campaigns.loader import load
from pmor.campaigns.page import label_of
from pmor.campaigns.relations import case_of, text_of_design, why_infeasible, with_relations
from pmor.campaigns.result import gathered
from pmor.campaigns.rows import Answer
from pmor.campaigns.settings import Relations
from pmor.campaigns.table import designs_of, different_designs
from pmor.case import changed_text, parse_case
from pmor.core.errors import CaseError, GeometryError
from pmor.gear.pair import zero_backlash_centre_distance
from pmor.pair.model import gear_pair
from tests.support.small_case import case_text

BASE = case_text(contact={"scheme": "line"}, reduction=None)
ROUND_OFF = 1e-12


def campaign(folder, text, **files):
    (folder / "base.toml").write_text(BASE)
    for name, content in files.items():
        (folder / f"{name}.csv").write_text(content)
    path = folder / "campaign.toml"
    path.write_text('case = "base.toml"\n[designs]\n' + text)
    found = load(path)
    table = designs_of(found)
    return found, [dict(table(i)) for i in range(found.count)]


def test_a_grid_has_every_value_with_every_other_once(tmp_path):
    _, designs = campaign(tmp_path, 'method = "grid"\npinion.teeth = [19, 20]\n'
                          "pair.module_mm = { from = 3.0, to = 4.0, steps = 3 }\n")  # fmt: skip
    expected = [(z, m) for z in (19, 20) for m in (3.0, 3.5, 4.0)]
    assert [(d["pinion.teeth"], d["pair.module_mm"]) for d in designs] == expected


def test_a_base_case_fits_with_the_centre_distance_of_the_relations_alone(tmp_path):
    """As filed its tips do not reach each other; without the relation it is refused."""
    grid = '[designs]\nmethod = "grid"\npinion.teeth = [19, 20]\n'
    (tmp_path / "base.toml").write_text(changed_text(BASE, {"pair": {"centre_distance_mm": 200.0}}))
    path = tmp_path / "campaign.toml"
    path.write_text(f'case = "base.toml"\n{grid}[relations]\ncentre_distance_mm = 86.5\n')
    found = load(path)
    assert case_of(found.base_text, {}, "one").pair.centre_distance_mm is None
    path.write_text(f'case = "base.toml"\n{grid}')
    with pytest.raises(CaseError, match="base.toml: .*centre_distance_mm = 200.*tip circles touch"):
        load(path)


def test_a_list_takes_one_value_of_each(tmp_path):
    _, designs = campaign(tmp_path, 'method = "list"\npinion.teeth = [19, 20, 20]\npair.module_mm = [3.0, 4.0, 3.0]\n')
    assert [tuple(d.values()) for d in designs] == [(19, 3.0), (20, 4.0), (20, 3.0)]


def test_one_at_a_time_each_further_value_stands_alone_beside_the_first_ones_and_has_its_band(tmp_path):
    found, designs = campaign(tmp_path, 'method = "one_at_a_time"\npinion.teeth = [19, 20, 21]\n'
                              "pair.module_mm = [3.0, 4.0]\n")  # fmt: skip
    assert [tuple(d.values()) for d in designs] == [(19, 3.0), (20, 3.0), (21, 3.0), (19, 4.0)]
    values = np.array([[1.0, 2.0, np.nan, 0.5], [7.0, 7.0, 7.0, 7.0], [3.0, 3.0, 3.0, 9.0]])
    result = SimpleNamespace(campaign=found, results=dict(zip(("a", "same", "b"), values, strict=True)))
    first, second = bands_of(result)
    assert (first.key, first.base, first.least, first.most, first.decides) == ("a", 1.0, 0.5, 2.0, "pinion.teeth")
    assert first.spans == {"pinion.teeth": (1.0, 2.0), "pair.module_mm": (0.5, 1.0)}
    assert (second.key, second.decides) == ("b", "pair.module_mm")


def test_a_key_is_told_in_words_without_its_unit_whatever_that_is():
    names = {
        "bearings.A.axial_N_per_mm": "A axial", "supports.sun_tilt_Nmm_per_rad": "supports sun tilt",
        "dynamics.pinion_inertia_kg_m2": "dynamics pinion inertia", "planets.tangential_um.2": "planets tangential 2",
        "online.angles_per_pitch": "online angles per pitch", "pins.second_z_mm": "pins second z",
        "pinion.modification.tip_relief_start_percent": "pinion tip relief start",
    }  # fmt: skip
    assert {name: label_of(name) for name in names} == names


def test_designs_are_drawn_by_two_of_their_columns(tmp_path):
    found, designs = campaign(tmp_path, 'method = "list"\npinion.teeth = [19, 20]\npair.module_mm = [3.0, 4.0]\n')
    results = dict.fromkeys(found.results, 2.0)
    rows = tuple({"design": n + 1, "inputs": one, "status": "ok", "reason": "", "results": results}
                 for n, one in enumerate(designs))  # fmt: skip
    effort = Effort(n_chunks=1, resumed=0, solving_s=1.0, wall_s=1.0, workers=1)
    result = gathered(found, [Answer(rows, (1.0, 1.0))], effort)
    axes = result.plot(Figure().subplots(), x="pinion.teeth", marker="s")
    np.testing.assert_array_equal(axes.lines[0].get_xdata(), [19.0, 20.0])
    assert (axes.get_xlabel(), axes.lines[0].get_marker()) == ("pinion teeth", "s")
    assert "[µm]" in result.plot().get_ylabel() + result.plot().get_xlabel()
    with pytest.raises(CaseError, match=r"pinion.teth: is no column: did you mean pinion.teeth"):
        result.plot(x="pinion.teth")


def test_a_csv_file_has_a_design_in_each_line_and_its_text_belongs_to_the_campaign(tmp_path):
    text = 'method = "csv"\nfile = "designs.csv"\npair.face_width_mm = 30.0\n'
    found, designs = campaign(tmp_path, text, designs="pinion.teeth,wheel.teeth\n19,40\n\n21,42\n")
    assert designs == [{"pinion.teeth": 19, "wheel.teeth": 40}, {"pinion.teeth": 21, "wheel.teeth": 42}]
    assert case_of(found.base_text, designs[0], "one").pair.face_width_mm == 30.0
    other, _ = campaign(tmp_path, text, designs="pinion.teeth,wheel.teeth\n19,40\n21,43\n")
    assert found.text != other.text


def test_sobol_spreads_designs_over_their_ranges(tmp_path):
    text = ('method = "sobol"\ncount = 64\npinion.teeth = { from = 18, to = 21 }\n'
            "pair.module_mm = { from = 3.0, to = 4.0 }\npair.helix_angle_deg = [0.0, 10.0]\n")  # fmt: skip
    _, designs = campaign(tmp_path, text)
    teeth = [d["pinion.teeth"] for d in designs]
    assert {z: teeth.count(z) for z in teeth} == dict.fromkeys((18, 19, 20, 21), 16)
    assert all(isinstance(z, int) for z in teeth)
    modules = np.array([d["pair.module_mm"] for d in designs])
    # One in each of 64 equal cells: that is Sobol's sequence in one dimension.
    assert sorted(np.floor(64 * (modules - 3.0)).astype(int)) == list(range(64))
    assert [d["pair.helix_angle_deg"] for d in designs].count(10.0) == 32


@pytest.mark.parametrize("solve", ["both", "pinion", "wheel"])
@pytest.mark.parametrize("helix", [0.0, 14.0])
def test_profile_shifts_give_the_centre_distance_without_backlash(solve, helix):
    relations = Relations(centre_distance_mm=86.5, solve=solve)
    design = with_relations(BASE, {"pair.helix_angle_deg": helix, "wheel.teeth": 21}, relations)
    pair = gear_pair(case_of(BASE, design, "one"))
    assert zero_backlash_centre_distance(pair.pinion, pair.wheel) == pytest.approx(86.5, rel=ROUND_OFF)
    assert pair.centre_distance == pytest.approx(86.5, rel=ROUND_OFF)
    shifts = pair.pinion.profile_shift, pair.wheel.profile_shift
    assert {"both": shifts[0] == shifts[1] != 0.0, "pinion": shifts[1] == 0.0, "wheel": shifts[0] == 0.0}[solve]


@pytest.mark.parametrize(
    ("distance", "design", "words"),
    [
        (70.0, {}, "z1 + z2 = 42 at m 4 gives 84 mm; 70 asked, and the base circles' radii alone are 78.93 mm "
         "together: take fewer teeth or a smaller module"),
        (100.0, {"pair.module_mm": 2.25, "wheel.teeth": 32}, "z1 + z2 = 53 at m 2.25 gives 59.62 mm; 100 asked: the "
         "difference takes a profile shift of 17.7, and 3 is the most: take more teeth or a larger module"),
        (84.0, {"pair.module_mm": 4.2, "pair.helix_angle_deg": 20.0}, "z1 + z2 = 42 at m 4.2 under 20 deg gives 93.86 "
         "mm; 84 asked, and the base"),
    ],
)  # fmt: skip
def test_a_centre_distance_that_teeth_and_module_cannot_give_is_refused_with_what_they_give(distance, design, words):
    with pytest.raises(GeometryError) as caught:
        with_relations(BASE, design, Relations(centre_distance_mm=distance))
    assert f"[relations] centre_distance_mm = {distance:g}: {words}" in str(caught.value)


def test_a_reason_names_the_shifts_that_a_centre_distance_made_a_design_take():
    relations = Relations(centre_distance_mm=86.5)
    design = with_relations(BASE, {}, relations)
    assert why_infeasible("no", BASE, design, Relations()) == "no"
    assert why_infeasible("no", BASE, design, relations) == (
        "no ([relations] set x1 = 0.344 and x2 = 0.344: z1 + z2 = 42 at m 4 gives 84 mm; 86.5 asked)"
    )


@pytest.mark.parametrize(
    ("designs", "numbers", "places"),
    [
        ('method = "list"\npinion.teeth = [20, 21, 20, 22, 21]\npair.module_mm = [4.0, 4.0, 4.0, 4.0, 4.5]',
         [0, 1, 3, 4], [0, 1, 0, 2, 3]),
        ('method = "sobol"\ncount = 5\npinion.teeth = { from = 20, to = 21 }', [0, 1], [0, 1, 1, 0, 0]),
        ('method = "sobol"\ncount = 3\npair.module_mm = { from = 3.0, to = 4.0 }', [0, 1, 2], [0, 1, 2]),
        ('method = "grid"\npinion.teeth = [20, 21]', [0, 1], [0, 1]),
    ],
)  # fmt: skip
def test_designs_that_stand_in_the_table_twice_are_found(designs, numbers, places, tmp_path):
    found, _ = campaign(tmp_path, designs)
    assert [array.tolist() for array in different_designs(found)] == [numbers, places]


def test_a_ratio_gives_the_nearest_teeth_or_says_how_far_they_are_off():
    assert with_relations(BASE, {"pinion.teeth": 21}, Relations(ratio=1.5))["wheel.teeth"] == round(1.5 * 21)
    with pytest.raises(GeometryError, match=r"21 and 32 teeth are off by 1.6 %, more than 1 %"):
        with_relations(BASE, {"pinion.teeth": 21}, Relations(ratio=1.5, ratio_tolerance_percent=1.0))


def test_a_wheel_that_the_base_case_does_not_mention_is_like_the_pinion_of_the_design():
    case = case_of(BASE, {"pinion.teeth": 19, "pinion.bore_radius_mm": 18.0, "wheel.teeth": 23}, "one")
    assert (case.pair.wheel.teeth, case.pair.wheel.bore_radius_mm) == (23, 18.0)


def test_a_modification_changes_one_gear_alone():
    case = case_of(BASE, {"pinion.modification.helix_crowning_um": 4.0}, "one")
    assert case.pinion_modification.helix_crowning_um == 4.0
    assert case.wheel_modification.helix_crowning_um == 0.0
    assert case.pair.wheel == case.pair.pinion


def test_the_text_of_a_design_is_a_case_file():
    text = text_of_design(BASE, {"pinion.teeth": 20, "pair.module_mm": math.pi})
    assert parse_case(text, "one", "one").pair.module_mm == math.pi
