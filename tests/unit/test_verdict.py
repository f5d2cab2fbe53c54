"""The verdict: what is worst comes first, what helps is told, and where nothing does that is said."""

from dataclasses import asdict, replace

import pytest

from pmor.dynamics.whine.output import whine_verdict
from pmor.report.markdown import page_markdown
from pmor.report.page import page_html
from pmor.report.verdict import JUDGED, Seen, findings, verdict_blocks, verdict_of, verdict_text
from pmor.results.quantities import TABLE
from pmor.results.verdict import Advice, Change

GOOD = {
    "k_h_beta": 1.02, "ste_peak_to_peak_um": 0.3, "ste_mean_um": 10.0, "tip_edge_load_N_per_mm": 0.0,
    "line_load_max_N_per_mm": 150.0, "tip_edge_percent": 0.0, "effective_contact_ratio": 1.7,
    "carrying_face_percent": 100.0, "end_pressure_ratio": 1.01,
}  # fmt: skip
SKEW = GOOD | {"k_h_beta": 2.9}
LOUD = GOOD | {"ste_peak_to_peak_um": 3.0}
LOUDER = {"ste_peak_to_peak_um": 3.0}
TIPS = Change("pinion.modification", {"tip_relief_um": 7.0})
RELIEF = Advice("Tip relief", "ste_peak_to_peak_um", "", "", 3.1, 0.5, (TIPS,))
SLOPE = Advice(
    "Helix of the pinion", "k_h_beta", "first", "drive", 2.9, 1.03,
    (Change("first: pinion.modification", {"helix_slope_um": -40.9}, {"helix_slope_um": 5.0}),),
    ("Under light it grows from 1.1 to 1.3.",),
)  # fmt: skip
TEXT = (
    "Helix of the pinion takes K_Hβ of first under drive from 2.9 to 1.03: helix_slope_um = -40.9 (now 5) in "
    "[first: pinion.modification]. Under light it grows from 1.1 to 1.3."
)


def test_the_worst_load_and_part_of_each_figure_counts_and_the_worst_figure_comes_first():
    found = findings([Seen("light", "first", LOUD), Seen("drive", "first", SKEW), Seen("drive", "second", GOOD)])
    assert [(one.key, one.load, one.part) for one in found[:2]] == [
        ("k_h_beta", "drive", "first"), ("ste_peak_to_peak_um", "light", "first")
    ]  # fmt: skip
    assert found[0].excess > found[1].excess > 1.0 > found[2].excess


def both(one, first):
    """Flanks that are true, then relief on these."""
    return SLOPE if one.key == "k_h_beta" else RELIEF


def test_a_second_figure_is_bettered_with_the_first_advice_in_the_file_where_it_still_is_not_good():
    found = findings([Seen("", "", SKEW | {"ste_peak_to_peak_um": 30.0})])
    assert [one.key for one in found[:2]] == ["ste_peak_to_peak_um", "k_h_beta"]
    given = []
    verdict = verdict_of(found, lambda one, first: given.append(first) or both(one, first))
    assert given == [None, SLOPE]
    assert (verdict.advice, verdict.then_advice, verdict.then) == (SLOPE, RELIEF, RELIEF.text)
    for other in (replace(RELIEF, before=0.9), replace(RELIEF, changes=SLOPE.changes)):
        assert verdict_of(found, lambda one, first, other=other: other if first else SLOPE).then_advice is None


def test_what_helps_is_told_with_its_keys_and_numbers():
    found = findings([Seen("drive", "first", SKEW)])
    verdict = verdict_of(found, lambda one, first: SLOPE if one.key == "k_h_beta" else None)
    assert verdict.try_first == TEXT
    assert verdict.not_good == "Under drive: K_Hβ 2.9 (first)."
    assert "tip edges stay clear" in verdict.good
    assert verdict.data["advice"] == asdict(SLOPE)


def test_where_nothing_helps_the_next_figure_is_tried_and_that_is_said():
    asked = []

    def nothing(one, first):
        asked.append(one.key)

    verdict = verdict_of(findings([Seen("", "", SKEW | {"ste_peak_to_peak_um": 3.0})]), nothing)
    assert asked == ["k_h_beta", "ste_peak_to_peak_um"]
    assert verdict.advice is None
    for key in asked:
        assert f"o change that was tried betters {TABLE[key].symbol} by a tenth" in verdict.try_first


@pytest.mark.parametrize(("figures", "lost", "said"), [
    (GOOD, (), "Nothing: no figure asks for it."), (SKEW, ("9 of 10 positions failed",), "What did not converge."),
    ({}, (), "Nothing: no figure asks for it."),
])  # fmt: skip
def test_nothing_is_tried_where_all_is_good_or_something_is_lost(figures, lost, said):
    verdict = verdict_of(findings([Seen("", "", figures)]), pytest.fail, lost)
    assert verdict.try_first == said
    assert all(text in verdict.not_good.lower() for text in lost)


def test_planets_that_hardly_carry_are_named():
    planets = [{"name": f"planet {n}", "share_mean": share} for n, share in enumerate((0.49, 0.01, 0.49, 0.01), 1)]
    (one,) = findings([Seen("", "", {"k_gamma": 1.96, "planets": planets})])
    assert "planet 1 carries 49 %" in one.words
    assert "planet 2 and planet 4 1 % and 1 %" in one.words


def test_pages_and_screens_tell_the_same_three_lines():
    data = {"verdict": verdict_of(findings([Seen("", "", SKEW | LOUDER)]), both).data}
    (block,) = verdict_blocks(data)
    page, text, screen = page_html("t", [block]), page_markdown("t", [block]), "\n".join(verdict_text(data["verdict"]))
    for head, sentence in block.lines:
        for told, shown in ((f"<dt>{head}</dt>", page), (f"**{head}:**", text), (f"{head}:", screen)):
            assert told in shown
            assert sentence in shown
    assert verdict_blocks({"verdict": None}) == verdict_text(None) == []


def test_every_figure_that_is_judged_is_in_the_table():
    assert JUDGED.keys() <= TABLE.keys()


def test_motion_is_told_by_its_largest_peak_and_the_micrometre_that_moves_it_most():
    row = {"mesh": "first", "parameter": "pinion.tip_relief_um", "force_N": {"mesh": 3.0, "A": -2.5}}
    slight = row | {"parameter": "pinion.helix_slope_um", "force_N": {"mesh": 9.0, "A": 0.5}}
    peak = {"bearing": "A", "speed_rpm": 2166.0, "force_rms_N": 120.0, "line": "first, harmonic 1"}
    load = {
        "micrometres": [slight, row], "micrometre_targets": {"A, first": 2166.0}, "peaks": [peak],
        "meshes": [{"name": "first", "dynamic_factor": 1.12}],
    }  # fmt: skip
    (told,) = whine_verdict({"loads": [load]})
    assert told.good == "Flanks stay in contact: dynamic factor at most 1.12 (first)."
    assert told.not_good == "Largest peak: 120 N (rms) of A at 2166 rpm, by first, harmonic 1."
    assert told.try_first.startswith("A micrometre more of first, ")
    assert "2.5 N off" in told.try_first
    parted = load | {"meshes": [{"name": "first", "dynamic_factor": 2.5}], "micrometres": []}
    (told,) = whine_verdict({"loads": [parted]})
    assert told.not_good.startswith("Flanks would part: dynamic factor at most 2.5 (first).")
    assert whine_verdict({"loads": []}) == []
