"""Verdicts on the paper's claims."""

from pathlib import Path

from pmor.lab.study.paper import checked_claims, checked_time_claims
from pmor.lab.study.settings import parse_study

STUDY = """
base = "base.toml"
[grid]
cells = ["8@8", "16@4", "64@1"]
[[variant]]
name = "as printed"
cell = "8@8"
contact = { edge_normals = "average" }
[reference]
meshes = [[48, 6, 4], [96, 12, 4]]
"""


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
