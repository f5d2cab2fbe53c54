"""The plan of a campaign says what the campaign will say, before anything is solved."""

import pytest

import pmor
from pmor.app.cli import main
from pmor.campaigns.loader import load
from tests.support.small_campaign import written
from tests.support.small_case import case_text

GRID = """case = "base.toml"
[designs]
method = "grid"
pair.module_mm = [2.25, 4.0, 4.1]
wheel.teeth = [21, 22, 32]
[relations]
centre_distance_mm = 86.5
"""


@pytest.fixture
def path(tmp_path):
    (tmp_path / "base.toml").write_text(case_text(contact={"scheme": "line"}, reduction=None))
    (tmp_path / "many.toml").write_text(GRID)
    return tmp_path / "many.toml"


def test_a_plan_counts_designs_and_says_by_which_relation_they_cannot_be_made(path, capsys):
    assert main(["plan", str(path)]) == 0
    text = capsys.readouterr().out
    assert text == f"{pmor.plan(path)}\n" == f"{pmor.plan(load(path))}\n"
    lines = text.splitlines()
    assert lines[:4] == [
        "Campaign many: many", "  9 designs of the case base.toml, grid", "  pair.module_mm  2.25, 4, 4.1",
        "  wheel.teeth     21, 22, 32",
    ]  # fmt: skip
    assert "  pinion.profile_shift, wheel.profile_shift: from [relations] centre_distance_mm = 86.5" in lines
    counted = next(line for line in lines if line.endswith("designs can be made"))
    none = 9 - int(counted.split()[0])
    reasons = [line for line in lines if ", such as design " in line]
    assert sum(int(line.split(",")[0]) for line in reasons) == none >= 5
    assert any("z1 + z2 = 42 at m 2.25 gives 47.25 mm; 86.5 asked: the difference takes" in line for line in reasons)
    assert any("z1 + z2 = 53 at m 4 gives 106 mm; 86.5 asked, and the base circles" in line for line in reasons)
    assert sorted(file.name for file in path.parent.iterdir()) == ["base.toml", "many.toml"]


@pytest.mark.slow
def test_a_plan_judges_as_the_campaign_does(tmp_path):
    """A third or so of the designs are infeasible by their geometry."""
    from pmor.campaigns.plan import why_not
    from pmor.campaigns.run import task_of
    from pmor.campaigns.solve import row_of
    from pmor.campaigns.table import designs_of
    from pmor.storage.gear_store import Store

    campaign = load(written(tmp_path, ""))
    table, store = designs_of(campaign), Store(tmp_path, 0.0)
    planned = [why_not(campaign, i, table(i)) for i in range(campaign.count)]
    infeasible = [i for i, reason in enumerate(planned) if reason]
    assert 5 < len(infeasible) < 30
    for i in infeasible:
        row = row_of(task_of(campaign, store), i + 1, table(i), store)
        assert (row["status"], row["reason"]) == ("infeasible", " ".join(planned[i].split()))
