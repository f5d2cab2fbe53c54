"""Reference of the Python interface as one page, from the docstrings of all public names.

    python -m tests.programs.api_page [FILE]

writes it to `cases/manual/api.md`, or a file.
"""

from __future__ import annotations

import inspect
import re
import sys
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import pmor

PAGE = "cases/manual/api.md"
INTRODUCTION = """# Python reference

`python -m tests.programs.api_page` makes this page from the docstrings; `help(pmor.train)` shows the same. Units in
names are those of the values. Names without one are in mm, N, MPa or rad."""


class _Plain(str):
    """An annotation that is shown as it is written."""

    def __repr__(self) -> str:
        return str(self)


def page() -> str:
    """Return the page."""
    sections = re.split(r"\n\n(?=Units in names)", inspect.getdoc(pmor) or "")[0]
    parts = [INTRODUCTION, _contents(sections)]
    for name in sorted(pmor.__all__, key=str.lower):
        if not name.startswith("_"):
            parts += _of(name, getattr(pmor, name))
    return "\n\n".join(parts) + "\n"


def _contents(text: str) -> str:
    """The list of names by theme from the package's docstring, with links."""
    themes = text.split("\nCases\n", 1)[1]
    linked = re.sub(r"`(\w+)`", lambda found: _linked(found[1]), "Cases\n" + themes)
    rows = re.findall(r"^(\S[^\n]*)\n((?:    [^\n]*\n?)+)", linked, re.MULTILINE)
    return "\n".join(f"* **{theme}**: {' '.join(words.split())}" for theme, words in rows)


def _linked(name: str) -> str:
    return f"[`{name}`](#{name.lower()})" if name in pmor.__all__ else f"`{name}`"


def _of(name: str, item: Any) -> Iterator[str]:
    yield f"## {name}"
    if not inspect.isclass(item):
        yield _block(f"pmor.{name}{_signature(item)}", item)
        return
    if issubclass(item, Exception):
        yield inspect.getdoc(item) or ""
        return
    yield _block(f"class pmor.{name}", item)
    stored = {field.name for field in fields(item)} if is_dataclass(item) else set()
    public = [(key, value) for key, value in vars(item).items() if not key.startswith("_") and key not in stored]
    rows = [(key, value) for key, value in public if isinstance(value, property) or hasattr(value, "attrname")]
    if rows:
        yield "\n".join(
            ["| property | |", "| --- | --- |", *(f"| `{key}` | {_first_line(value)} |" for key, value in rows)]
        )
    for key, value in public:
        if inspect.isfunction(value) or isinstance(value, staticmethod | classmethod):
            yield f"### {name}.{key}"
            yield _block(f"{name}.{key}{_signature(getattr(item, key))}", value)


def _block(head: str, item: Any) -> str:
    return f"```text\n{head}\n\n{inspect.getdoc(item) or ''}\n```"


def _first_line(item: Any) -> str:
    text = inspect.getdoc(item) or ""
    return text.split("\n\n", 1)[0].replace("\n", " ").replace("|", "\\|")


def _signature(function: Any) -> str:
    """Return the signature, a parameter a line where it is long."""
    signature = inspect.signature(function)
    shown = [_shown(parameter) for parameter in signature.parameters.values() if parameter.name != "self"]
    answer = signature.return_annotation
    tail = "" if answer is signature.empty else f" -> {answer}"
    short = str(signature.replace(parameters=shown, return_annotation=inspect.Signature.empty)) + tail
    if len(short) < 90:
        return short
    lines = [str(parameter) for parameter in shown]
    first = next((n for n, parameter in enumerate(shown) if parameter.kind is parameter.KEYWORD_ONLY), None)
    if first is not None:
        lines.insert(first, "*")
    return "(\n    " + ",\n    ".join(lines) + "\n)" + tail


def _shown(parameter: inspect.Parameter) -> inspect.Parameter:
    """Return a parameter with its annotation as it is written, and functions by their names."""
    annotation, default = parameter.annotation, parameter.default
    if annotation is not parameter.empty:
        parameter = parameter.replace(annotation=_Plain(annotation))
    return parameter.replace(default=_Plain(default.__name__)) if inspect.isfunction(default) else parameter


def main(path: str = PAGE) -> None:
    """Write the page."""
    Path(path).write_text(page(), encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
