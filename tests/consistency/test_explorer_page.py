"""Designs on a page in a browser against the same questions put to numpy, and what a reader meets there."""

import itertools
import json
import re
import time
from dataclasses import replace

import numpy as np
import pytest

from pmor.report.explorer import Column, Designs
from pmor.report.page import Heading, page_html
from tests.support.chromium import browser
from tests.support.stored_files import rows_of

NASTY = "</script><script>document.title = 'broken'</script>\"'&<!--"
ROOT = "document.querySelector('.explorer')"
STATE = f"{ROOT}.explorer"
DRAWN = "await new Promise(done => requestAnimationFrame(() => setTimeout(done, 0)));"


def designs(n, rng, infeasible=0.2):
    """Inputs of few and of many values, a category, and three results, NaN where a design is infeasible."""
    bad = rng.random(n) < infeasible
    inputs = {
        "teeth": np.round(rng.uniform(17, 60, n)), "relief_um": rng.uniform(0, 40, n),
        "material": rng.choice(["C45", "20MnCr5", NASTY], n),
    }  # fmt: skip
    results = {
        "ste_um": np.round(rng.uniform(0.2, 5, n), 1), "pressure_MPa": rng.uniform(900, 1500, n),
        "mass_kg": rng.uniform(1e-3, 1, n),
    }  # fmt: skip
    columns = [Column(key, key.split("_")[0], "", values, "input") for key, values in inputs.items()]
    for key, values in results.items():
        columns.append(Column(key, *key.split("_"), np.where(bad, np.nan, values), "result"))
    return Designs(
        columns, np.array([f"design {i}" for i in range(n)]),
        np.array([f"cases/{i}/report.html" if i % 2 else "" for i in range(n)]),
        np.where(bad, rng.choice(["teeth are pointed", NASTY], n), ""),
    )  # fmt: skip


def carried(column):
    """Values as the page has them."""
    return column.values if column.values.dtype.kind == "U" else np.array([float(f"{v:.7g}") for v in column.values])


def shown_by_numpy(data, filters, infeasible=False):
    keep = np.full(len(data.names), True) if infeasible else data.reasons == ""
    for column in data.columns:
        if column.key in filters:
            low, high = filters[column.key]
            # Comparisons with NaN are false.
            keep &= (carried(column) >= low) & (carried(column) <= high)
    return np.flatnonzero(keep).tolist()


def front_by_pairs(data, rows, keys, signs):
    """Each against each other: the slow twin of the page's."""
    values = np.stack([s * carried(c) for k, s in zip(keys, signs, strict=True) for c in data.columns if c.key == k])
    rows = [i for i in rows if data.reasons[i] == "" and np.isfinite(values[:, i]).all()]
    at = values[:, rows]
    bettered = [((at <= at[:, [k]]).all(axis=0) & (at < at[:, [k]]).any(axis=0)).any() for k in range(len(rows))]
    return [i for i, worse in zip(rows, bettered, strict=True) if not worse]


@pytest.fixture(scope="module")
def opened():
    with browser() as tab:
        yield tab


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("explorer")


def show(opened, folder, data):
    path = folder / "page.html"
    path.write_text(page_html("Designs", [Heading("Explore"), data]), encoding="utf-8")
    opened.events.clear()
    opened.open(path)
    opened.wait_for(f"{STATE}.listed")
    return opened


def act(opened, script):
    """Do something on the page, and wait until it is drawn and the table is up to date."""
    opened.evaluate(f"(async () => {{ const root = {ROOT}; {script}; {DRAWN} }})()")
    opened.wait_for(f"{STATE}.listed")


def set_bounds(opened, filters):
    """Type bounds into the fields; infinities leave them empty."""
    written = {k: ["" if np.isinf(bound) else repr(float(bound)) for bound in ends] for k, ends in filters.items()}
    act(opened, f"""
      root.querySelector(".clear").click();
      {DRAWN}
      for (const [key, bounds] of Object.entries({json.dumps(written)})) {{
        root.querySelectorAll(`[data-key="${{key}}"] input`).forEach((field, k) => {{
          field.value = bounds[k];
          field.dispatchEvent(new Event("input"));
        }});
      }}""")  # fmt: skip


def choose(opened, selector, values):
    act(
        opened,
        f"""root.querySelectorAll("{selector}").forEach((select, k) => {{
      select.value = {json.dumps(values)}[k];
      select.dispatchEvent(new Event("input"));
    }})""",
    )


def said_and_asked(opened):
    """What came on the console, and what was fetched beside the page itself."""
    said = opened.named("Runtime.consoleAPICalled", "Runtime.exceptionThrown", "Log.entryAdded")
    urls = [event["params"]["request"]["url"] for event in opened.named("Network.requestWillBeSent")]
    return said, [url for url in urls if not url.endswith("/page.html")]


def mouse(opened, steps):
    for kind, x, y, button in steps:
        opened.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button=button, buttons=int(button != "none"),
                    clickCount=1)  # fmt: skip
    opened.evaluate(f"(async () => {{ {DRAWN} }})()")


def corner(opened, selector):
    script = f"""(() => {{
      const canvas = document.querySelector("{selector}");
      canvas.scrollIntoView({{ block: "center" }});
      const {{ left, top }} = canvas.getBoundingClientRect();
      return [left, top];
    }})()"""
    return opened.evaluate(script)


@pytest.fixture(scope="module")
def data():
    return designs(600, np.random.default_rng(19))


@pytest.fixture
def page(opened, folder, data):
    return show(opened, folder, data)


def test_filters_let_through_what_numpy_does(page, data, rng):
    numbers = [c for c in data.columns if c.values.dtype.kind != "U"]
    for _ in range(20):
        filters = {}
        for column in rng.choice(numbers, 3, replace=False):
            # Bounds at values that occur, as the page shows them, and open ones.
            ends = np.sort(rng.choice(carried(column)[np.isfinite(column.values)], 2))
            filters[column.key] = np.where(rng.random(2) < 0.2, (-np.inf, np.inf), ends).tolist()
        set_bounds(page, filters)
        expected = shown_by_numpy(data, filters)
        assert page.evaluate(f"{STATE}.rows") == expected
        assert page.evaluate(f"{ROOT}.querySelector('.count').textContent") == (
            f"{len(expected)} of 600 designs, {(data.reasons != '').sum()} infeasible hidden"
        )
    assert said_and_asked(page) == ([], [])


def test_infeasible_designs_come_on_demand_and_only_where_a_filter_does_not_need_what_they_lack(page, data):
    act(page, "root.querySelector('.infeasible input').click()")
    assert page.evaluate(f"{STATE}.rows") == list(range(600))
    set_bounds(page, {"teeth": (20, 30)})
    assert page.evaluate(f"{STATE}.rows") == shown_by_numpy(data, {"teeth": (20, 30)}, infeasible=True)
    set_bounds(page, {"ste_um": (-np.inf, 1e9)})
    assert page.evaluate(f"{STATE}.rows") == shown_by_numpy(data, {})
    listed = page.evaluate(f"[...{ROOT}.querySelectorAll('.reasons tbody tr')].map(row => row.children[1].textContent)")
    assert sum(map(int, listed)) == (data.reasons != "").sum()


def test_levels_of_a_category_are_kept_by_their_boxes(page, data):
    act(page, "root.querySelectorAll('.levels input')[1].click()")
    material = data.columns[2].values
    levels = np.unique(material)
    kept = np.isin(material, levels[[0, 2]]) & (data.reasons == "")
    assert page.evaluate(f"{STATE}.rows") == np.flatnonzero(kept).tolist()
    act(page, "root.querySelectorAll('.levels input')[1].click()")
    assert page.evaluate(f"{STATE}.filters[2]") is None


def test_the_front_is_what_comparing_each_with_each_finds(page, data):
    keys = [column.key for column in data.columns]
    for first, second in itertools.combinations(("ste_um", "pressure_MPa", "mass_kg"), 2):
        for signs in itertools.product((1, -1), repeat=2):
            values = [keys.index(first), signs[0], keys.index(second), signs[1]]
            choose(page, ".explorer .objectives select", [str(value) for value in values])
            expected = front_by_pairs(data, shown_by_numpy(data, {}), (first, second), signs)
            assert sorted(page.evaluate(f"{STATE}.front")) == expected
    # Within filters, with infeasible designs on show.
    act(page, "root.querySelector('.infeasible input').click()")
    filters = {"teeth": (20, 40), "mass_kg": (0.5, np.inf)}
    set_bounds(page, filters)
    choose(page, ".explorer .objectives select", [str(keys.index("ste_um")), "1", str(keys.index("pressure_MPa")), "1"])
    rows = shown_by_numpy(data, filters, infeasible=True)
    assert sorted(page.evaluate(f"{STATE}.front")) == front_by_pairs(data, rows, ("ste_um", "pressure_MPa"), (1, 1))


def test_all_designs_within_the_filters_are_listed_and_sorted_by_any_column(page, data):
    act(page, "")
    names = f"[...{ROOT}.querySelectorAll('.all tbody th')].map(cell => cell.textContent)"
    rows = page.evaluate(f"{STATE}.rows")
    assert page.evaluate(names) == [str(data.names[i]) for i in rows[:100]]
    pressure = carried(data.columns[4])
    for descending in (False, True):
        act(page, "root.querySelectorAll('.all thead button')[5].click()")
        ordered = sorted(rows, key=lambda i: (np.isnan(pressure[i]), -pressure[i] if descending else pressure[i]))
        assert page.evaluate(names) == [str(data.names[i]) for i in ordered[:100]]
    said = page.evaluate(f"{ROOT}.querySelector('.all-count').textContent")
    assert said.startswith("The first 100 in this order of ")
    act(page, "root.querySelector('.more').click()")
    assert len(page.evaluate(names)) == min(len(rows), 1000)
    act(page, "root.querySelectorAll('.all thead button')[0].click()")


def test_the_front_is_sorted_by_its_headers_and_links_to_the_cases(page, data):
    front = page.evaluate(f"{STATE}.front")
    names = f"[...{ROOT}.querySelectorAll('.front tbody th')].map(cell => cell.textContent)"
    pressure = carried(data.columns[4])
    for descending in (False, True):
        act(page, "root.querySelectorAll('.front thead button')[2].click()")
        ordered = sorted(front, key=lambda i: pressure[i], reverse=descending)
        assert page.evaluate(names) == [data.names[i] for i in ordered]
    links = page.evaluate(f"[...{ROOT}.querySelectorAll('.front tbody a')].map(link => link.getAttribute('href'))")
    assert links == [data.links[i] for i in ordered if data.links[i]]


def test_a_range_is_dragged_moved_and_dropped(page, data):
    left, top = corner(page, ".lines .top")
    axis = page.evaluate(f"{ROOT}.querySelector('.lines .top').clientWidth") and left + 28
    low, high = carried(data.columns[0]).min(), carried(data.columns[0]).max()
    press = [("mouseMoved", axis, top + 200, "none"), ("mousePressed", axis, top + 200, "left")]
    mouse(page, [*press, ("mouseMoved", axis, top + 320, "left"), ("mouseReleased", axis, top + 320, "left")])
    found = page.evaluate(f"{STATE}.filters[0]")
    # The axis goes from 124 to 388 pixels; bounds are rounded to less than a 500th of it.
    expected = [low + (high - low) * (388 - y) / 264 for y in (320, 200)]
    assert np.abs(np.subtract([found["low"], found["high"]], expected)).max() < (high - low) / 250
    fields = page.evaluate(f"[...{ROOT}.querySelectorAll('[data-key=teeth] input')].map(field => Number(field.value))")
    assert fields == [found["low"], found["high"]]
    assert page.evaluate(f"{STATE}.rows") == shown_by_numpy(data, {"teeth": fields})
    press = [("mousePressed", axis, top + 260, "left")]
    mouse(page, [*press, ("mouseMoved", axis, top + 60, "left"), ("mouseReleased", axis, top + 60, "left")])
    moved = page.evaluate(f"{STATE}.filters[0]")
    assert moved["high"] is None  # as JSON has no infinity: at the end of the axis it is open
    assert abs((high - moved["low"]) - (found["high"] - found["low"])) < (high - low) / 250
    mouse(page, [("mousePressed", axis, top + 370, "left"), ("mouseReleased", axis, top + 370, "left")])
    assert page.evaluate(f"{STATE}.filters[0]") is None


def test_keys_alone_set_a_bound(page, data):
    page.evaluate(f"{ROOT}.querySelector('.download').focus()")
    for _ in range(40):
        if page.evaluate("document.activeElement.ariaLabel") == "ste, µm: most":
            break
        page.press("Tab", 9)
    page.call("Input.insertText", text="1.5")
    page.evaluate(f"(async () => {{ {DRAWN} }})()")
    assert page.evaluate(f"{STATE}.rows") == shown_by_numpy(data, {"ste_um": (-np.inf, 1.5)})


def test_the_file_it_saves_has_the_rows_within_the_filters(page, data, tmp_path):
    filters = {"relief_um": (10, 20)}
    set_bounds(page, filters)
    page.call("Page.setDownloadBehavior", behavior="allow", downloadPath=str(tmp_path))
    page.evaluate(f"{ROOT}.querySelector('.download').click()")
    until = time.monotonic() + 60.0
    while not (tmp_path / "designs.csv").exists():
        assert time.monotonic() < until
        time.sleep(0.02)
    rows = rows_of(tmp_path / "designs.csv")
    expected = shown_by_numpy(data, filters)
    assert [row["name"] for row in rows] == data.names[expected].tolist()
    for column in data.columns:
        values = carried(column)[expected]
        found = [row[column.key] for row in rows]
        assert found == values.tolist() if values.dtype.kind == "U" else list(map(float, found)) == values.tolist()


def changed(data, **columns):
    return replace(data, columns=[replace(c, values=columns.get(c.key, c.values)) for c in data.columns])


def extremes():
    few = designs(5, np.random.default_rng(1), infeasible=0.0)
    none = np.full(5, np.nan)
    one = Designs([replace(c, values=c.values[:1]) for c in few.columns], few.names[:1], few.links[:1], few.reasons[:1])
    huge = changed(few, ste_um=np.array([1e-300, -1e300, 1e300, np.inf, 5.0]), mass_kg=np.full(5, 1e7) + np.arange(5))
    return {
        "one design": one,
        "no design": Designs([replace(c, values=c.values[:0]) for c in few.columns], *[few.names[:0]] * 3),
        "all infeasible": replace(
            changed(few, ste_um=none, pressure_MPa=none, mass_kg=none), reasons=np.full(5, "pointed")
        ),
        "a column without values": changed(few, ste_um=none),
        "equal values": changed(few, ste_um=np.zeros(5), pressure_MPa=np.full(5, -1200.0)),
        "far apart and close": huge,
        "one column": Designs(few.columns[:1], few.names, few.links, few.reasons),
        "categories alone": Designs(few.columns[2:3], few.names, few.links, few.reasons),
        "many levels": changed(few, material=np.array(list("abcde")) + np.array(["x" * 200] * 5)),
        "nasty texts": Designs(
            [replace(c, key=c.key + NASTY, label=NASTY, unit=NASTY) for c in few.columns], np.full(5, NASTY),
            np.full(5, "a%3Cb.html"), np.array(["", NASTY, "", "", ""]),
        ),
    }  # fmt: skip


@pytest.mark.parametrize("name", extremes())
def test_extremes_are_shown_without_a_word_on_the_console(opened, folder, name):
    data = extremes()[name]
    page = show(opened, folder, data)
    n, bad = len(data.names), int((data.reasons != "").sum())
    hidden = f", {bad} infeasible hidden" if bad else ""
    assert page.evaluate(f"{ROOT}.querySelector('.count').textContent") == f"{n - bad} of {n} designs{hidden}"
    # Everything that can be chosen, in turn.
    act(
        page,
        f"""
      root.querySelector(".infeasible input").click();
      for (const select of root.querySelectorAll("select")) {{
        for (const option of select.options) {{
          select.value = option.value;
          select.dispatchEvent(new Event("input"));
          {DRAWN}
        }}
      }}
      const top = root.querySelector(".scatter .top");
      top.dispatchEvent(new KeyboardEvent("keydown", {{ key: "ArrowRight" }}));""",
    )
    assert page.evaluate(f"{STATE}.rows.length") == n
    assert page.evaluate("document.title") == "Designs"
    assert page.evaluate("document.querySelectorAll('script').length") == 2
    assert said_and_asked(page) == ([], [])
    if name == "nasty texts":
        assert page.evaluate(f"{ROOT}.querySelector('.front tbody th').textContent") == NASTY
        assert page.evaluate(f"{ROOT}.querySelector('.reasons tbody th').textContent") == NASTY


def test_a_phone_scrolls_it_in_one_direction_alone(page):
    page.fit_a_phone()
    # Nor does it before canvases that were wider are drawn anew.
    page.evaluate("document.body.style.width = '900px'")
    page.wait_for("document.querySelector('.scatter canvas').clientWidth > 390")
    narrowed = "(() => { document.body.style.width = ''; return document.documentElement.scrollWidth; })()"
    assert page.evaluate(narrowed) <= 390


def test_every_control_says_what_it_is(page):
    assert page.nameless("button", "checkbox", "combobox", "spinbutton", "image") == []


def test_the_section_needs_nothing_beside_the_page(data):
    assert not re.search(r"https?:|src=|@import|url\(", page_html("Designs", [data]))


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"names": np.array(["a"])}, "1 names, but 3 links"),
        ({"links": np.array(["", "https://example.org/", ""])}, "'https://example.org/' leaves the folder"),
        ({"links": np.array(["", "java\nscript:alert(1)", ""])}, "leaves the folder"),
        ({"links": np.array(["", "\\\\host\\case", ""])}, "leaves the folder"),
        ({"links": np.array(["", "cases/../../x", ""])}, "leaves the folder"),
        ({"links": np.array(["", "%2e%2e/x", ""])}, "leaves the folder"),
        ({"columns": []}, "designs need columns"),
    ],
)
def test_what_the_page_cannot_show_is_refused(changes, said):
    with pytest.raises(ValueError, match=said):
        replace(designs(3, np.random.default_rng(1)), **changes)


@pytest.mark.parametrize("bad", [{"kind": "output"}, {"values": np.ones((2, 2))}, {"values": np.array([None])}])
def test_a_column_of_another_kind_is_refused(bad):
    with pytest.raises(ValueError, match="column 'teeth'"):
        replace(Column("teeth", "teeth", "", np.ones(2), "input"), **bad)
