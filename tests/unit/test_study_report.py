"""Verdicts on the paper's claims, and the two forms of the report."""

import math
from pathlib import Path

import pytest
from matplotlib.figure import Figure
from numpy.testing import assert_allclose

from pmor.lab.study.claims import checked_claims, checked_time_claims, paper_ratios
from pmor.lab.study.loader import parse_study
from pmor.lab.study.report import Heading, Picture, Warning, study_html, study_markdown, write_study_report
from pmor.lab.study.settings import Cell, PaperRatio
from pmor.report.report import Table

STUDY = """
base = "base.toml"
[grid]
cells = ["8@8", "16@4", "64@1"]
[[variant]]
name = "as printed"
cell = "8@8"
contact = { edge_normals = "average" }
[reference]
members = [[48, 6, 4], [96, 12, 4]]
"""
ROUND_OFF = 1e-12


def row(cell, model="condensed", ms=1.0, error=0.1):
    n, lodm = map(int, cell.split()[0].split("@"))
    keys = ("shape_error_um", "ripple_um", "mean_error_um", "peak_to_peak_error_um")
    variant = cell.partition(" ")[2] or None
    return dict.fromkeys(keys, error) | {
        "cell": cell, "model": model, "n_profile": n, "lodm": lodm, "detail": n * lodm, "variant": variant,
        "ms_per_position": ms,
    }  # fmt: skip


def verdicts(*rows):
    study = parse_study(STUDY, "s", "s.toml", Path())
    return {claim["name"]: claim["confirmed"] for claim in checked_claims(rows, study)}


def test_quality_is_judged_against_64_elements():
    names = "quality_8@8", "quality_16@4", "quality_8@8 as printed"
    bad, good, fine = row("8@8", error=0.21), row("16@4", error=0.19), row("64@1", error=0.1)
    assert verdicts(bad, good, fine, row("8@8 as printed", error=0.3)) == dict.fromkeys(names, True)
    worse, better = row("16@4", error=0.21), row("8@8", error=0.19)
    assert verdicts(better, worse, fine) == {"quality_8@8": False, "quality_16@4": False}


def test_one_bad_measure_spoils_the_quality():
    rippled = row("16@4", error=0.1) | {"ripple_um": 0.3}
    assert verdicts(rippled, row("64@1")) == {"quality_16@4": False}


def test_without_the_yardstick_there_is_no_verdict():
    assert verdicts(row("8@8"), row("16@4")) == {}


def test_refinement_must_be_cheaper_at_every_level_of_detail():
    rows = [row("8@8", ms=1.0), row("16@4", ms=2.0), row("64@1", ms=8.0), row("8@4", ms=1.0), row("16@2", ms=1.5)]
    (claim,) = checked_time_claims(rows)
    assert claim["confirmed"]
    assert claim["measured"] == {"time_ratio_16@2_to_8@4": 1.5, "time_ratio_64@1_to_8@8": 8.0}
    (claim,) = checked_time_claims([*rows[:-1], row("16@2", ms=0.9)])
    assert not claim["confirmed"]
    assert checked_time_claims([row("8@8"), row("8@4")]) == []  # nothing of equal detail
    assert checked_time_claims([row("8@8", ms=None), row("16@4")]) == []


def test_ratios_of_the_paper_stand_beside_ours():
    ratio = PaperRatio(cell=Cell(64, 1), to=Cell(8, 8), value=5.5, kind="above")
    rows = [row("64@1", ms=9.0), row("8@8", ms=3.0), row("64@1", "reduced", ms=None), row("8@8", "reduced")]
    (found,) = paper_ratios(rows, [ratio])
    assert (found["cell"], found["to"], found["paper"]) == ("64@1", "8@8", 5.5)
    assert_allclose(found["time_ratio_condensed"], 3.0, rtol=ROUND_OFF)
    assert found["time_ratio_reduced"] is None
    assert found["time_ratio_conventional"] is None


def blocks():
    figure = Figure(figsize=(1, 1))
    figure.add_subplot().plot([0, 1])
    return [
        Heading("Run <times>"),
        Warning("cell 8@1 did not converge"),
        "One position is one angle.",
        Table("Seconds", ("cell", "s|ms"), [("8@1", 0.25), ("64@1", math.nan)], "of the machine below"),
        Picture("cost.png", "Cost & error", figure),
    ]


def test_both_forms_say_the_same():
    html, markdown = study_html("Study", blocks()), study_markdown("Study", blocks())
    assert "<h2>Run &lt;times&gt;</h2>" in html
    assert "Cost &amp; error" in html
    assert html.count("<img ") == 1
    assert "data:image/png;base64," in html
    assert markdown.startswith("# Study\n\n## Run <times>\n\n> **Warning:** cell 8@1")
    assert "| cell | s\\|ms |\n| --- | --- |\n| 8@1 | 0.25 |\n| 64@1 | – |\n\nof the machine below" in markdown
    assert "![Cost & error](cost.png)" in markdown
    for text in ("One position is one angle.", "0.25", "of the machine below"):
        assert text in html
        assert text in markdown


def test_report_files_replace_old_ones_only_when_complete(tmp_path):
    write_study_report(tmp_path, "Study", blocks())
    before = (tmp_path / "report.html").read_text()
    with pytest.raises(AttributeError):
        write_study_report(tmp_path, "Study", [Picture("x.png", "no figure", None)])
    assert (tmp_path / "report.html").read_text() == before
    assert sorted(path.name for path in tmp_path.iterdir()) == ["report.html", "study.md"]
