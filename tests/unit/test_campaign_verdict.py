"""The verdict on a campaign: which designs hold the limits, which key decides, which design to take."""

import json

import numpy as np
import pytest

from pmor.campaigns.columns import Effort
from pmor.campaigns.loader import load
from pmor.campaigns.output import campaign_text
from pmor.campaigns.result import gathered
from pmor.campaigns.rows import Answer
from pmor.campaigns.verdict import campaign_verdict, explained
from tests.support.small_case import case_text

COUNT = 24
TEXT = f"""
case = "base.toml"
[designs]
method = "sobol"
count = {COUNT}
pair.face_width_mm = {{ from = 15.0, to = 38.0 }}
pinion.profile_shift = {{ from = -0.1, to = 0.1 }}
"""
EFFORT = Effort(n_chunks=1, resumed=0, solving_s=0.0, wall_s=0.0, workers=None)


@pytest.fixture(scope="module")
def campaign(tmp_path_factory):
    folder = tmp_path_factory.mktemp("campaign")
    (folder / "base.toml").write_text(case_text(contact={"scheme": "line"}, reduction=None))
    (folder / "campaign.toml").write_text(TEXT)
    return load(folder / "campaign.toml")


def solved(campaign, figures, status="ok"):
    """The campaign with figures of our own: from the number of a design to its results."""
    widths, shifts = np.linspace(15.0, 38.0, COUNT), 0.1 * (-1.0) ** np.arange(COUNT)
    rows = [
        {
            "design": i + 1, "status": status, "reason": "",
            "inputs": {"pair.face_width_mm": widths[i], "pinion.profile_shift": shifts[i]},
            "results": dict.fromkeys(campaign.results) | figures(i),
        }
        for i in range(COUNT)
    ]  # fmt: skip
    return gathered(campaign, [Answer(tuple(rows), (0.0,) * COUNT)], EFFORT)


def test_a_campaign_tells_how_many_hold_what_decides_and_which_one_to_take(campaign):
    result = solved(campaign, lambda i: {
        "ste_mean_um": 10.0, "ste_peak_to_peak_um": 0.3 + 0.1 * i, "k_h_beta": 1.5 if i == 0 else 1.1,
    })  # fmt: skip
    said = campaign_verdict(result)
    # 0.3 + 0.1 i below a tenth of 10: i of 0 to 6, the first of which has a K_Hbeta beyond 1.3.
    assert said.good == "6 of 24 solved designs are within all limits."
    assert "STE p-p is beyond its limit in 17; K_Hβ is beyond its limit in 1" in said.not_good
    assert "STE p-p spreads most, 0.3 to 2.6 µm: pair face width decides, with" in said.not_good
    assert said.try_first.startswith("Design 2, STE p-p 0.4 µm, the least of those within the limits: pair.face_")
    assert said.try_first.endswith("pmor campaign campaign.toml --case 2 writes it.")
    for _, sentence in said.lines:
        assert sentence in campaign_text(result)
    json.dumps(said.data, allow_nan=False)


def test_where_no_design_holds_the_nearest_one_is_told_and_without_results_that(campaign):
    said = campaign_verdict(solved(campaign, lambda i: {"k_h_beta": 1.4 + abs(i - 7)}))
    assert said.good == "No limit holds in all designs."
    assert said.not_good.startswith("No design is within all limits; K_Hβ is beyond its limit in all")
    assert said.try_first.startswith("Design 8 is nearest to the limits, furthest beyond that of K_Hβ.")
    said = campaign_verdict(solved(campaign, lambda i: {}, "infeasible"))
    assert (said.good, said.not_good) == ("No design has results.", "24 infeasible.")
    said = campaign_verdict(solved(campaign, lambda i: {"mass_kg": 1.0}))
    assert said.good == "None of the results is judged by a limit."


def test_a_key_explains_the_variance_that_is_its_own_and_chance_none(rng):
    x, y = rng.uniform(size=(2, 4000))
    # Variances of 4 (x - 1/2)^2 and of y: 16/180 and 1/12.
    assert explained(x, 4.0 * (x - 0.5) ** 2 + y) == pytest.approx(16 / 180 / (16 / 180 + 1 / 12), abs=0.06)
    assert explained(rng.uniform(size=4000), y) < 0.01
    assert explained(x[:4], y[:4]) == explained(np.full(50, 2.0), y[:50]) == 0.0
