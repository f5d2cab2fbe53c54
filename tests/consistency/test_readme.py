"""What the README shows is what the program does: every code block runs, or is what the command line takes."""

from __future__ import annotations

import re
import shlex
import shutil
from pathlib import Path

import pytest

import pmor
from pmor.app.cli import main
from pmor.case import parse_case
from tests.programs import command_table

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "README.md").read_text(encoding="utf-8")
FENCED = re.findall(r"```(\w+)\n(.*?)```", TEXT, re.DOTALL)
INDENTED = [line.strip() for line in TEXT.splitlines() if re.match(r" {4}(\S*/)?(python|pmor|\.venv)", line)]


MOST_BYTES = 9_000


def test_the_readme_is_short():
    assert len(TEXT.encode()) <= MOST_BYTES


def blocks(language):
    return [text for name, text in FENCED if name == language]


@pytest.fixture
def checkout(tmp_path, monkeypatch):
    """A folder that looks like the checkout, to write into."""
    shutil.copytree(ROOT / "cases", tmp_path / "cases")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_lines_of_python_run(checkout, capsys):
    (text,) = blocks("python")
    exec(compile(text, "README.md", "exec"), {})
    assert "SweepResult: 200 angles x 50, 100, 150 N m" in capsys.readouterr().out
    assert (checkout / "ste.png").stat().st_size > 10_000


def test_the_smallest_case_is_one():
    (text,) = blocks("toml")
    case = parse_case(text, "smallest", "README.md")
    assert pmor.Case is type(case)


@pytest.mark.slow
def test_the_main_command_prints_what_the_readme_says(checkout, undrawn, capsys):
    """Labels, units and what depends on neither machine nor load; the figures of STE to the digits that are shown."""
    (command,) = [line for line in INDENTED if "pmor run" in line]
    assert main(shlex.split(command.rpartition("&&")[2])[1:]) == 0
    printed = capsys.readouterr().out.splitlines()
    shown = [line.strip() for line in TEXT.splitlines() if line.startswith("      ")]
    assert shown
    # Times, and the round-off by which exact line loads differ from full FE.
    timed = ("online time", "full FE time", "offline time", "reduced vs full")
    for line in shown:
        if not line.startswith(timed):
            assert any(_untimed(line) == _untimed(other) for other in printed), line


def _untimed(line):
    """A line without what differs from run to run: of a model's row, its errors and times."""
    cells = line.split()
    return cells[:3] + cells[-2:] if cells and cells[0] in ("paper", "direct", "line") else cells


def test_what_pages_refer_to_is_there():
    pages = [*ROOT.glob("*.md"), *(ROOT / "cases").rglob("*.md")]
    for page in pages:
        targets = re.findall(r"\]\(([^)#:]+)\)", page.read_text(encoding="utf-8"))
        assert [target for target in targets if not (page.parent / target).exists()] == [], page.name


def test_one_version_stands_in_the_citation_and_above_the_changes():
    assert f"\nversion: {pmor.__version__}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    newest = re.search(r"^## (\S+)", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert newest
    assert newest[1] == pmor.__version__


def test_the_commands_of_the_table_are_those_of_the_program():
    made = command_table.pages()
    assert set(made) >= {ROOT / "README.md"}
    assert [str(page) for page, text in made.items() if page.read_text(encoding="utf-8") != text] == []


def test_the_page_of_the_interface_lists_every_public_name():
    names = [name for name in pmor.__all__ if not name.startswith("_")]
    assert [name for name in names if f"`{name}`" not in (pmor.__doc__ or "")] == []
    assert set(names) <= set(dir(pmor))
    for name in names:
        assert getattr(pmor, name).__doc__, name


def test_an_unknown_name_of_the_interface_is_refused():
    with pytest.raises(AttributeError, match="module 'pmor' has no attribute 'sweep'"):
        pmor.sweep  # noqa: B018
