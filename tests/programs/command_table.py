"""Tables of commands in README.md and of their Python calls, from the records of the program.

    python -m tests.programs.command_table

writes them between the heads of the tables and the next empty line, in every page that has such a table.
"""

from __future__ import annotations

from pathlib import Path

from pmor.app.records import COMMANDS, usage

ROOT = Path(__file__).parents[2]


def tables() -> dict[str, str]:
    """Return the rows of each table by its head."""
    return {
        "| command | does |\n|---|---|\n": "".join(
            f"| `{usage(name)}` | {c.words} |\n" for name, c in COMMANDS.items()
        ),
        "| command | Python |\n| --- | --- |\n": "".join(
            f"| `{usage(name).partition(' [')[0]}` | `{c.python}` |\n" for name, c in COMMANDS.items() if c.python
        ),
    }


def pages() -> dict[Path, str]:
    """Return the pages that have such a table, and their text made anew."""
    texts = {}
    for page in [ROOT / "README.md", *sorted((ROOT / "cases").rglob("*.md"))]:
        text = page.read_text(encoding="utf-8")
        for head, rows in tables().items():
            before, found, after = text.partition(head)
            if found:
                texts[page] = text = before + head + rows + "\n" + after.partition("\n\n")[2]
    return texts


if __name__ == "__main__":
    for page, text in pages().items():
        page.write_text(text, encoding="utf-8")
