"""The HTML page, the CSV and JSON files, and the lines on the screen."""

import base64
import csv
import hashlib
import json
import math
import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from matplotlib.figure import Figure
from numpy.testing import assert_array_equal

import pmor.report.page
from pmor.report.chart import panels
from pmor.report.data_files import write_ste_csv, write_summary_json
from pmor.report.explorer import Column, Designs
from pmor.report.markdown import page_markdown, write_markdown
from pmor.report.page import Heading, Picture, Warning, page_html, write_page
from pmor.report.style import data_uri, picture_bytes
from pmor.report.summary import summary_text
from pmor.report.table import Table, format_cell
from tests.support.sweeps import made_up_sweep

NASTY = '<script>alert("a & b")</script>'
VOID_TAGS = {"meta", "img", "br", "hr", "link", "input"}


class Page(HTMLParser):
    """Collects text, attributes and whether the tags balance."""

    def __init__(self, html):
        super().__init__()
        self.open, self.tags, self.attributes, self.text = [], [], [], []
        self.feed(html)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes += [(tag, name, value) for name, value in attrs]
        if tag not in VOID_TAGS:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


def figure():
    result = Figure(figsize=(1, 1))
    result.add_subplot().plot([0, 1])
    return result


def blocks():
    return [
        Warning(NASTY),
        Heading(NASTY),
        NASTY,
        Table(NASTY, ("Quantity", NASTY, "Note"), [("STE mean", 7.934567, "at 100 N m"), (NASTY, None, NASTY)], NASTY),
        Picture("a.png", NASTY, figure()),
        Table("Settings", ("key", "value", "source"), [("gears.module_mm", 4.0, "case file"), ("E", 1e6, "default")]),
    ]


def page(*added, title="Paper pair"):
    return page_html(title, [*blocks(), *added])


def sweep():
    share = [[[1.0, 0.0], [0.0, 0.0]], [[0.7, 0.3], [0.1, 0.9]]]
    found = made_up_sweep([[1.0 / 3.0, math.nan], [2.5, 1e-17]], (30.0, 100.0), share, first_pair=-1)
    return replace(found, newton_steps=np.array([[4, 50], [5, 6]]))


def test_page_parses_and_its_tags_balance_and_head_what_they_say():
    found = Page(page())
    assert not found.open
    assert found.tags.count("table") == 2
    assert found.tags.count("img") == 1
    assert found.attributes.count(("th", "scope", "col")) == 6
    assert found.attributes.count(("th", "scope", "row")) == 4
    text = "|".join(t.strip() for t in found.text if t.strip())
    assert "gears.module_mm|4|case file|E|1000000|default" in text


def test_page_is_self_contained():
    found = Page(page())
    assert not {"script", "link", "iframe", "object"} & set(found.tags)
    references = [value for _, name, value in found.attributes if name in ("src", "href", "srcset", "data")]
    assert references
    assert all(value.startswith("data:image/png;base64,") for value in references)
    assert "url(" not in page()
    assert "@import" not in page()


def test_scripts_run_by_their_hashes_alone_and_nothing_is_fetched():
    column = Column("ste_um", "STE", "um", np.ones(1), "result")
    designs = Designs([column], np.array(["a"]), np.array([""]), np.array([""]))
    for added, count in (([], 0), ([designs], 1)):
        html = page(*added)
        (policy,) = re.findall(r'http-equiv="Content-Security-Policy" content="([^"]*)"', html)
        rules = dict(rule.strip().split(" ", 1) for rule in policy.split(";"))
        assert rules["default-src"] == "'none'"
        scripts = re.findall("<script>(.*?)</script>", html, re.DOTALL)
        hashes = {f"'sha256-{base64.b64encode(hashlib.sha256(s.encode()).digest()).decode()}'" for s in scripts}
        assert len(hashes) == count
        assert set(rules["script-src"].split()) == (hashes or {"'none'"})


def test_page_is_fit_for_phones():
    found = Page(page())
    assert ("meta", "name", "viewport") in found.attributes
    # Tables that are wider than 390 px scroll in a box of their own, each of them; keys reach the box too.
    boxes = [value for tag, name, value in found.attributes if (tag, name) == ("div", "class")]
    assert boxes == ["scroll wordy", "scroll"], "rows with a sentence become lists"
    assert len(boxes) == found.tags.count("table")
    assert found.attributes.count(("div", "tabindex", "0")) == found.tags.count("table")
    box = re.search(r"\.scroll \{(.*?)\}", page(), re.DOTALL)
    assert "overflow-x: auto" in box[1]
    assert len(re.findall(r'class="scroll[^>]*>\s*<table>', page())) == found.tags.count("table")


def test_all_text_is_escaped_but_shown():
    html = page(title=NASTY)
    assert "<script" not in html
    # title element and h1, warning, heading, paragraph; table title, column, first cell, cell, note; caption
    assert "".join(Page(html).text).count(NASTY) == 11
    quoted = [name for _, name, value in Page(html).attributes if value == NASTY]
    assert sorted(quoted) == ["alt", "aria-label", "data-name", "data-name"]


def test_a_folded_table_shows_its_title_until_it_is_opened():
    folded = Table("Sensitivities", ("parameter", "mean"), [("tip relief", 0.3)], "Derivatives.", folded=True)
    found = re.search(r"<details>(.*?)</details>", page(folded), re.DOTALL)[1]
    assert "<summary>Sensitivities</summary>" in found
    assert "tip relief" in found
    assert "Derivatives." in found
    assert "details::details-content" in page(folded), "print opens it"


def test_empty_tables_leave_no_headings_behind():
    assert "Classical formulas" not in page(Table("Classical formulas", ("Method",), []))


def test_a_row_with_a_missing_cell_is_refused():
    with pytest.raises(ValueError, match="table 'Errors': row .* does not have 2 cells"):
        Table("Errors", ("Model", "ms"), [("full FE",)])


def test_page_replaces_the_old_one_only_when_complete(tmp_path):
    target = tmp_path / "report.html"
    write_page(target, "Paper pair", blocks())
    before = target.read_text(encoding="utf-8")
    with pytest.raises(AttributeError):
        write_page(target, "Paper pair", [Picture("a.png", "no figure", None)])
    assert target.read_text(encoding="utf-8") == before
    assert [p.name for p in tmp_path.iterdir()] == ["report.html"]


def test_markdown_says_the_same_and_refers_to_the_pictures(tmp_path):
    write_markdown(
        tmp_path / "study.md",
        "Study",
        [
            Heading("Run <times>"),
            Warning("cell 8@1 did not converge"),
            "One position is one angle.",
            Table("Seconds", ("cell", "s|ms"), [("8@1", 0.25), ("64@1", math.nan)], "of the machine below"),
            Table("Nothing was found", ("cell",), []),
            Picture("cost.png", "Cost & error", figure()),
        ],
    )
    assert (tmp_path / "study.md").read_text(encoding="utf-8") == (
        "# Study\n\n## Run &lt;times>\n\n> **Warning:** cell 8@1 did not converge\n\nOne position is one angle.\n\n"
        "### Seconds\n\n| cell | s\\|ms |\n| --- | --- |\n| 8@1 | 0.25 |\n| 64@1 | – |\n\nof the machine below\n\n"
        "![Cost & error](cost.png)\n\n*Cost & error*\n"
    )


def test_names_in_markdown_are_no_markup():
    """A tag, an entity or a link that is a name is shown as it was written."""
    name = '<img src=x onerror="f()"> &lt; [a](http://b) <!-- > 5 < 6 & 7'
    shown = page_markdown(name, [Heading(name), Warning(name), name, Table(name, (name,), [(name,)], name)])
    for markup in ("<img", " &lt; [", "](", "<!--"):
        assert markup not in shown, markup
    assert shown.count("&lt;img") == 8
    assert "5 < 6 & 7" in shown


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (None, "–"),
        (float("nan"), "–"),
        (7.934567, "7.935"),
        (0.000123456, "0.0001235"),
        (123456.7, "123457"),
        (2.5e9, "2.5e+09"),
        (True, "yes"),
        (21, "21"),
        ("hex8i", "hex8i"),
    ],
)
def test_cells_read_as_an_engineer_writes_them(value, text):
    assert format_cell(value) == text


def test_csv_round_trip_is_exact(tmp_path):
    original = sweep()
    write_ste_csv(tmp_path / "ste.csv", original)
    with open(tmp_path / "ste.csv", newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0]) == [
        "phi_rad", "torque_Nm", "ste_um", "ste_error_estimate_um", "converged", "newton_steps", "unloaded_ste_um",
        "ste_mesh_error_estimate_um", "share_pair_-1", "share_pair_0",
    ]  # fmt: skip

    def column(name):
        return np.array([float(row[name]) if row[name] else np.nan for row in rows]).reshape(2, 2)

    assert_array_equal(column("ste_um"), original.ste_um)
    assert np.isnan(column("ste_error_estimate_um")).all(), "a sweep without error bars leaves the column empty"
    assert_array_equal(column("phi_rad")[0], original.phi_rad)
    assert_array_equal(column("torque_Nm")[:, 0], original.torque_Nm)
    assert_array_equal(column("converged"), original.converged)
    assert_array_equal(column("newton_steps"), original.newton_steps)
    assert_array_equal(column("share_pair_0"), original.pair_share[..., 1])


def test_json_is_plain_sorted_and_null_where_there_is_no_number(tmp_path):
    target = tmp_path / "summary.json"
    summary = {
        "ste_mean_um": np.array([7.9, np.nan]),
        "n_profile": np.int64(16),
        "ok": np.bool_(True),
        "basis_mib": float("inf"),
        "offline_s": None,
        "case": "paper",
        "nested": {"lodm": (4, 4)},
    }
    write_summary_json(target, summary)
    text = target.read_text(encoding="utf-8")
    back = json.loads(text, parse_constant=lambda name: pytest.fail(f"{name} is not JSON"))
    assert list(back) == sorted(summary)
    assert back == {
        "basis_mib": None,
        "case": "paper",
        "n_profile": 16,
        "nested": {"lodm": [4, 4]},
        "offline_s": None,
        "ok": True,
        "ste_mean_um": [7.9, None],
    }
    write_summary_json(target, dict(reversed(summary.items())))
    assert target.read_text(encoding="utf-8") == text


@pytest.mark.parametrize(
    ("bad", "where"), [({"a": [1, {"b": 1j}]}, r"summary\.a\[1\]\.b"), ({"a": {1: 2}}, r"summary\.a: keys")]
)
def test_json_refuses_what_it_cannot_hold_and_names_the_place(tmp_path, bad, where):
    with pytest.raises(TypeError, match=where):
        write_summary_json(tmp_path / "s.json", bad)
    assert not list(tmp_path.iterdir())


def test_screen_summary_is_aligned():
    lines = summary_text("Paper pair", [("STE mean", 7.9345, "um", ""), ("Run time", 0.41, "ms", "per position")])
    title, first, second = lines.splitlines()
    assert title == "Paper pair"
    assert first.index("7.9") + len("7.934") == second.index("0.41") + len("0.41")
    assert second.endswith("per position")
    assert summary_text("nothing", []) == "nothing"


def test_a_picture_of_matplotlib_is_drawn_once_for_its_file_and_for_the_page(monkeypatch):
    drawn, content = [], picture_bytes(figure(), "png")
    monkeypatch.setattr(pmor.report.page, "picture_bytes", lambda figure, kind: drawn.append(kind) or content)
    picture = Picture("a.png", "a", figure())
    assert picture.content("png") == content
    assert page_html("Pair", [picture]).count(data_uri(content, "png")) == 1
    assert drawn == ["png"]


def test_a_chart_stands_in_the_page_as_it_is_and_needs_no_matplotlib(monkeypatch):
    monkeypatch.setattr(pmor.report.page, "picture_bytes", None)
    with panels(2, 8.0, 4.0, ylabel="<y> [µm]") as (chart, both):
        for axes in both:
            axes.plot([0.0, 1.0], [1.0, np.nan], label="a & b")
    page = page_html("Pair", [Picture("a.svg", "a", chart)])
    assert page.count("&lt;y&gt;") == 2, "a panel each"
    assert page.count("<svg") == 5, "two panels with their clips, and the key"
    assert Picture("a.svg", "a", chart).content("svg").startswith(b"<?xml")
