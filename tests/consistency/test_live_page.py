"""The live page in a browser against the same equations in Python, and what a reader meets there.

The page rounds the flanks' compliance to 2^-20 of the largest entry; all else is double precision on both sides.
"""

import json
import tomllib
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.case import load_case
from pmor.case.capability import LIMITS, Limit
from pmor.case.width import case_of_page
from pmor.gear.condition import Condition, Misalignment
from pmor.gear.modification import Modification
from pmor.report.live.section import live_section
from pmor.report.page import page_html
from pmor.report.run_page import run_blocks
from pmor.work.live import live_pair
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.model import online_angles, reduced_pair
from tests.support.chromium import browser
from tests.support.line_pairs import on_columns
from tests.support.page_solver import CASES, STE, condition_of, online_result

pytestmark = pytest.mark.jit
LARGEST_SECTION = 200_000  # measured: 156 kB; pictures come on top
RESULT = "document.getElementById('live').result"
ALIKE = "document.querySelector('#live .same')"
ALIKE_OFF = f"{ALIKE}.checked && {ALIKE}.click()"


@pytest.fixture(scope="module")
def spur():
    return online_result(load_case(CASES / "paper_spur.toml"))


@contextmanager
def opened_page(folder, result, pair):
    """The page of a pair without pictures, open in a browser."""
    path = folder / "report.html"
    path.write_text(page_html("Paper", ["Static part", live_section(result, pair)]), encoding="utf-8")
    with browser() as opened:
        opened.open(path)
        opened.wait_for(f"!!{RESULT}")
        yield opened


@pytest.fixture(scope="module")
def page(spur, tmp_path_factory):
    with opened_page(tmp_path_factory.mktemp("live"), *spur) as opened:
        yield opened


def set_values(opened, values):
    """Write values into number fields and choices, keyed (group, key), and wait for what the page makes of them."""
    # In one go: the page may be about to show what was asked for before.
    script = """%s = null;
    for (const [group, key, value] of %s) {
      const row = document.querySelector(`[data-group="${group}"][data-key="${key}"]`);
      const input = row.querySelector("select, input[type=number]");
      input.value = value;
      input.dispatchEvent(new Event("input"));
    }"""
    opened.evaluate(script % (RESULT, json.dumps([[*name, value] for name, value in values.items()])))
    opened.wait_for(f"!!{RESULT}")


def drawn_values(opened, rng):
    """Random values of all controls of a page, keyed (group, key)."""
    ranges = opened.evaluate("""[...document.querySelectorAll("#live [data-key]")].map(row => {
      const field = row.querySelector("input[type=number]");
      return [row.dataset.group, row.dataset.key, field && Number(field.min), field && Number(field.max)];
    })""")
    shapes = "linear", "parabolic"
    return {
        (group, key): shapes[rng.integers(2)] if low is None else float(rng.uniform(low, high))
        for group, key, low, high in ranges
    }


def compare_settings(opened, result, pair, count):
    """The transmission error of the page is that of Python at random settings."""
    rng = np.random.default_rng(17)
    opened.evaluate(ALIKE_OFF)
    for _ in range(count):
        values = drawn_values(opened, rng)
        set_values(opened, values)
        found = opened.evaluate(f"{RESULT}.ste")
        phi = online_angles(pair.meshed.pair.pitch, len(found))
        expected = sweep_line_loads(pair, phi, [condition_of(values, result.case)]).ste_um[0]
        # With slopes on the flanks the transmission error passes through zero: what counts is the curve's largest.
        scale = np.abs(expected).max()
        assert_allclose(found, expected, rtol=0.0, atol=STE * scale)


def test_the_page_solves_what_python_solves(page, spur):
    compare_settings(page, *spur, 5)
    assert len(page_html("", [live_section(*spur)])) <= LARGEST_SECTION


def test_every_slider_moves_with_the_keyboard_and_changes_the_result(page):
    page.evaluate("document.getElementById('live-reset').click()")
    sliders = page.evaluate("[...document.querySelectorAll('#live .settings input[type=range]')]"
                            ".filter(s => s.offsetParent).map(s => s.id)")  # fmt: skip
    assert len(sliders) == 10
    # Without an amount its start is of no matter.
    set_values(page, {("pinion", "tip_relief_um"): 10.0})
    for slider in sliders:
        before = page.evaluate(f"[{RESULT}.ste, Number(document.getElementById('{slider}').value)]")
        page.evaluate(f"{RESULT} = null; document.getElementById('{slider}').focus()")
        page.press("ArrowRight", 39)
        page.wait_for(f"!!{RESULT}")
        after = page.evaluate(f"[{RESULT}.ste, Number(document.getElementById('{slider}').value)]")
        assert after[1] > before[1], slider
        assert after[0] != before[0], slider


def test_tab_reaches_all_controls(page):
    page.evaluate("document.activeElement.blur(); window.scrollTo(0, 0)")
    wanted = page.evaluate("""[...document.querySelectorAll("#live input, #live select, #live button")]
      .filter(e => e.offsetParent).length""")
    reached = set()
    for _ in range(wanted + 5):
        page.press("Tab", 9)
        reached.add(
            page.evaluate("""(e => [...document.querySelectorAll("#live input, #live select, #live button")]
          .indexOf(e))(document.activeElement)""")
        )
    assert len(reached - {-1}) == wanted


def test_all_controls_have_names(page):
    assert page.nameless("slider", "spinbutton", "combobox", "checkbox", "button", "textbox", "image") == []


def test_the_wheel_follows_the_pinion_only_where_both_are_to_be_alike(page):
    page.evaluate("document.getElementById('live-reset').click()")
    set_values(page, {("pinion", "tip_relief_um"): 12.0})
    amounts = f"{RESULT}.setting.meshes[0].modifications.map(m => m.tip_relief_um)"
    assert page.evaluate(amounts) == [12.0, 12.0]
    page.evaluate(f"{ALIKE}.click()")
    set_values(page, {("pinion", "tip_relief_um"): 8.0})
    assert page.evaluate(amounts) == [8.0, 12.0]


def test_a_torque_beyond_the_sweep_is_marked(page):
    page.evaluate("document.getElementById('live-reset').click()")
    marker = "document.getElementById('live-marker')"
    set_values(page, {("load", "torque_Nm"): 150.0})
    assert page.evaluate(f"{marker}.hidden")
    set_values(page, {("load", "torque_Nm"): 190.0})
    assert not page.evaluate(f"{marker}.hidden")
    assert "30 to 160 N m" in page.evaluate(f"{marker}.textContent")


def test_the_toml_that_it_gives_makes_the_case_that_is_set(page, spur):
    page.evaluate(ALIKE_OFF)
    values = drawn_values(page, np.random.default_rng(3))
    set_values(page, values)
    page.evaluate("document.getElementById('live-toml').click()")
    sections = tomllib.loads(page.evaluate("document.getElementById('live-text').value"))
    given = Condition(
        torque=1e3 * sections["load"]["torque_Nm"], misalignment=Misalignment(**sections["misalignment"]),
        pinion=Modification(**sections["pinion"]["modification"]),
        wheel=Modification(**sections["wheel"]["modification"]),
    )  # fmt: skip
    assert given == condition_of(values, spur[0].case)


def test_nothing_is_fetched_and_nothing_said_on_the_console(page):
    asked = page.named("Network.requestWillBeSent")
    urls = [event["params"]["request"]["url"] for event in asked]
    assert [url for url in urls if not url.startswith(("file:", "data:", "about:"))] == []
    assert len([url for url in urls if url.startswith("file:")]) == 1  # the page itself
    assert page.named("Runtime.consoleAPICalled", "Runtime.exceptionThrown", "Log.entryAdded") == []


def test_a_value_that_is_not_allowed_leaves_no_older_numbers_in_sight(page):
    """It is named with what is allowed, and the TOML of another setting is not given either."""
    page.evaluate("document.getElementById('live-reset').click()")
    numbers = "document.getElementById('live-numbers').children.length"
    page.wait_for(f"!!{RESULT} && {numbers} > 0")
    for value in ("99999", ""):
        page.evaluate(f"""(field => {{ field.value = "{value}"; field.dispatchEvent(new Event("input")); }})(
          document.querySelector('[data-key="in_plane_um"] input[type=number]'))""")
        page.wait_for(f"{numbers} === 0")
        said = page.evaluate("document.getElementById('live-marker').textContent")
        assert "in-plane misalignment" in said
        assert "must be a number from" in said
        page.evaluate("document.getElementById('live-toml').click()")
        assert page.evaluate("document.getElementById('live-text').hidden")
        page.evaluate("document.getElementById('live-reset').click()")
        page.wait_for(f"{numbers} > 0")
        assert page.evaluate("document.getElementById('live-marker').hidden")


@pytest.mark.parametrize(
    ("broken", "said"),
    [("DecompressionStream = undefined", "needs DecompressionStream"),
     ("JSON.parse = text => ({ constants: {}, meshes: [{ bodies: [{ scale: null }] }] })", "could not start (")],
)  # fmt: skip
def test_a_start_that_fails_says_why(spur, tmp_path, broken, said):
    path = tmp_path / "report.html"
    path.write_text(page_html("Paper", [live_section(*spur)]), encoding="utf-8")
    with browser() as opened:
        opened.call("Page.addScriptToEvaluateOnNewDocument", source=broken)
        opened.open(path)
        opened.wait_for(f"document.getElementById('live-missing').textContent.includes({json.dumps(said)})")
        assert opened.evaluate("document.getElementById('live').hidden")
        # The page's policy: no script but its own.
        added = "Object.assign(document.createElement('script'), { textContent: 'window.foreign = true' })"
        assert not opened.evaluate(f"document.body.append({added}), Boolean(window.foreign)")


def test_a_phone_scrolls_it_in_one_direction_alone(page):
    page.fit_a_phone()


def test_without_javascript_a_sentence_stands_for_it(spur, tmp_path):
    path = tmp_path / "report.html"
    path.write_text(page_html("Paper", ["Static part", live_section(*spur)]), encoding="utf-8")
    with browser() as opened:
        opened.call("Emulation.setScriptExecutionDisabled", value=True)
        opened.call("Page.navigate", url=path.as_uri())
        while not opened.named("Page.loadEventFired"):
            opened.call("Page.getFrameTree")
        text = " ".join(
            node["name"]["value"] for node in opened.call("Accessibility.getFullAXTree")["nodes"]
            if node.get("role", {}).get("value") == "StaticText"
        )  # fmt: skip
    assert "needs JavaScript" in text
    assert "Static part" in text
    assert "torque on the pinion" not in text


def test_half_the_width_gets_the_whole_one_for_its_page(spur):
    result, pair = spur
    assert result.reduced.meshed.mirrored
    assert not pair.meshed.mirrored
    assert pair.basis.case.mesh == case_of_page(result.case).mesh
    # Both are solved exactly, on the same sections; measured 2e-9.
    phi = result.sweep.phi_rad[::20]
    ste = sweep_line_loads(on_columns(pair), phi, [Condition(torque=1e3 * result.case.torque_Nm)]).ste_um[0]
    assert_allclose(ste, result.sweep.ste_um[result.nominal, ::20], rtol=1e-7)


def test_pages_of_trained_shapes_and_of_fine_meshes_say_why_there_is_none(small_basis, spur):
    why = live_pair(reduced_pair(small_basis))
    assert "takes line loads" in why
    result, pair = spur
    assert live_section(result, pair)
    assert f"Left out: {why}." in run_blocks(result, [], why)
    fine = replace(result.case, mesh=replace(result.case.mesh, profile_elements=64))
    assert "these have 1161" in live_pair(replace(pair, basis=replace(pair.basis, case=fine)))


def test_the_report_leaves_classical_formulas_out_where_they_do_not_take_the_case(spur, monkeypatch):
    titles = [getattr(block, "title", "") for block in run_blocks(spur[0], [])]
    monkeypatch.setitem(LIMITS, "Case", (Limit(lambda case: True, ("classical",), "no such case"),))
    without = [getattr(block, "title", "") for block in run_blocks(spur[0], [])]
    assert [title for title in titles if title not in without] == ["Classical formulas for the same pair"]


def test_a_case_can_do_without(spur):
    result, pair = spur
    off = replace(result.case, output=replace(result.case.output, live_page=False))
    assert live_pair(replace(pair, basis=replace(pair.basis, case=off))) is None
    assert not any("Change" in getattr(block, "text", "") for block in run_blocks(result, []))
