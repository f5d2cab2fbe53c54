"""The manual does what it says: its blocks of TOML, commands and Python run in order, and print what it shows.

A block of TOML names its file in its first line, ``# pair.toml``; without one it is a part of a file. The lines of a
block of ``sh`` are commands of pmor, whose output may go into a file.
Those of ``output`` are among what the block before printed. A comment ``<!-- needs MODULE -->`` before a block leaves
it out where that module is missing. All pages share one folder, in this order. To run them takes a minute and more:
usually they are only read.
"""

import importlib.util
import json
import re
import shlex
import sys
import tomllib
from contextlib import nullcontext, redirect_stdout
from pathlib import Path

import pytest

import pmor
from pmor.app.cli import build_parser, main

MANUAL = Path(__file__).parents[2] / "cases" / "manual"
PAGES = ("ten_minutes.md", "ten_minutes.ipynb", "recipes.md", "results.md")
RUN = ("toml", "sh", "python", "output")

pytestmark = pytest.mark.jit


@pytest.fixture(scope="module")
def desk(tmp_path_factory):
    """A folder beside a checkout's `cases`."""
    folder = tmp_path_factory.mktemp("desk")
    (folder / "cases").symlink_to(MANUAL.parent)
    return folder


def blocks_of(page):
    """Language, text and needed module of each block."""
    text = (MANUAL / page).read_text(encoding="utf-8")
    if page.endswith(".ipynb"):
        cells = [cell for cell in json.loads(text)["cells"] if cell["cell_type"] == "code"]
        return [("python", "".join(cell["source"]), None) for cell in cells]
    found = re.findall(r"(?:<!-- needs (\w+) -->\n)?```(\w+)\n(.*?)```", text, re.DOTALL)
    return [(language, code, needed) for needed, language, code in found if language in RUN]


def run_block(language, code, names, where, printed):
    if language == "toml":
        if named := re.match(r"# (\S+\.toml)\n", code):
            Path(named[1]).write_text(code, encoding="utf-8")
    elif language == "sh":
        for line in code.splitlines():
            command, _, target = line.partition(" > ")
            program, *arguments = shlex.split(command, comments=True) or ["pmor", "info", "--help"]
            assert program == "pmor", line
            into = Path(target).open("w", encoding="utf-8") if target else nullcontext(sys.stdout)
            with into as out, redirect_stdout(out):
                assert main(arguments) == 0, line
    elif language == "python":
        exec(compile(code, where, "exec"), names)
    else:
        lines = {" ".join(line.split()) for line in printed.splitlines()}
        for line in code.splitlines():
            assert " ".join(line.split()) in lines, f"{where}: {line!r} is not among\n{printed}"


@pytest.mark.parametrize("page", PAGES)
def test_every_block_of_a_page_can_be_read(page):
    """TOML, the arguments of commands, Python and the names that it takes from pmor."""
    blocks = blocks_of(page)
    assert blocks
    for language, code, _ in blocks:
        if language == "toml":
            tomllib.loads(code)
        elif language == "sh":
            for line in code.splitlines():
                line = line.partition(" > ")[0]
                build_parser().parse_args(shlex.split(line, comments=True)[1:] or ["info", "pair.toml"])
        elif language == "python":
            compile(code, page, "exec")
            assert [name for name in re.findall(r"\bpmor\.(\w+)", code) if not hasattr(pmor, name)] == []


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES)
def test_every_block_of_a_page_runs(page, desk, monkeypatch, capsys):
    monkeypatch.chdir(desk)
    names, printed = {"__name__": "__main__"}, ""
    for number, (language, code, needed) in enumerate(blocks_of(page), start=1):
        if needed and importlib.util.find_spec(needed) is None:
            continue
        run_block(language, code, names, f"{page}, block {number}", printed)
        printed = capsys.readouterr().out if language != "output" else printed


def test_every_page_is_in_the_table_of_contents():
    contents = (MANUAL / "README.md").read_text(encoding="utf-8")
    pages = {path.name for path in MANUAL.iterdir() if path.suffix in (".md", ".ipynb")} - {"README.md"}
    assert [page for page in sorted(pages) if f"]({page})" not in contents] == []
    assert {page for page in pages if "\n```python" in (MANUAL / page).read_text(encoding="utf-8")} <= set(PAGES)
    assert "](cases/manual/README.md)" in (MANUAL.parents[1] / "README.md").read_text(encoding="utf-8")


def test_every_link_of_the_documents_leads_to_a_file_and_a_heading():
    root, broken = MANUAL.parents[1], list[str]()
    for page in (root / "README.md", MANUAL.parent / "README.md", *MANUAL.glob("*.md")):
        for target, heading in re.findall(r"\]\(([^)#:]*)(?:#([^)]*))?\)", page.read_text(encoding="utf-8")):
            aim = page.parent / target if target else page
            if not aim.exists() or (heading and heading not in headings_of(aim)):
                broken.append(f"{page.name}: {target}#{heading}")
    assert broken == []


def headings_of(page):
    """Anchors of a page as they are made of its headings."""
    lines = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return [re.sub(r"[^\w\- ]", "", line.lower()).replace(" ", "-") for line in lines]
