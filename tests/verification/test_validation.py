"""Published figures, exact results and those of other programs (`pmor.validation`): each row, and the page."""

import math
from functools import cache
from pathlib import Path

import pytest

from pmor.app.cli import main
from pmor.validation import page
from pmor.validation.check import Check

pytestmark = pytest.mark.jit
SHOWN = Path(__file__).parents[2] / "cases" / "manual" / "validation.md"
SLOW = {"public pairs", "motion"}  # 17 s of finite elements, 3 s of motion
THEMES = [pytest.param(theme, marks=pytest.mark.slow) if theme in SLOW else theme for theme in page.THEMES]


@cache
def rows(theme):
    return page.THEMES[theme]()


@pytest.mark.parametrize("theme", THEMES)
def test_our_figures_are_those_of_standards_papers_and_other_programs(theme):
    assert rows(theme)
    assert [(check.quantity, check.theirs, check.ours) for check in rows(theme) if not check.holds] == []


@pytest.mark.parametrize("theme", THEMES)
def test_the_page_of_the_manual_shows_each_figure_as_it_is_now(theme):
    lines = SHOWN.read_text(encoding="utf-8").split("### All figures")[1].splitlines()
    shown = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines if line.startswith("| ")][2:]
    checks = rows(theme)
    first = [row[0] for row in shown].index(checks[0].quantity)
    shown = shown[first : first + len(checks)]
    assert [[row[i] for i in (0, 1, 2, 5, 6)] for row in shown] == [
        [check.quantity, check.unit, *(str(page.COLUMNS[key](check)) for key in ("theirs", "allowed, %", "source"))]
        for check in checks
    ]
    # Digits that are shown, and the last ones of another processor.
    assert [row[0] for row, check in zip(shown, checks, strict=True)
            if not math.isclose(float(row[3]), check.ours, rel_tol=6e-4)] == []  # fmt: skip


@pytest.mark.parametrize("ours", [1.02, math.nan])
def test_a_figure_too_far_from_its_source_is_named_and_ends_with_2(ours, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(page, "THEMES", {"made up": lambda: [Check("length", "mm", 1.0, ours, "made up", 0.01)]})
    assert main(["lab", "validation", "-o", str(tmp_path / "validation.md")]) == 2
    assert "1 figures are too far from their source: length" in capsys.readouterr().err
