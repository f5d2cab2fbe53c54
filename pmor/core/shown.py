"""Things as Python shows them: in one line, and in a notebook."""

from __future__ import annotations

import json
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import MISSING, fields, is_dataclass
from html import escape
from typing import Any, TypeVar

#: arrays or lists of one length by their names
Columns = Mapping[str, Any]
Kind = TypeVar("Kind", bound=type)
LONGEST = 200
LONGEST_VALUE = 40
# Rows of a table in a notebook.
MOST_ROWS = 20
LINE = "border-top: 1px solid currentColor; text-align: right"


def brief(kind: Kind) -> Kind:
    """Let a dataclass show itself in one line: what differs from its defaults, of arrays and lists the size alone.

    A notebook shows the same as a table, or the summary on the screen where it has one.
    """
    kind.__repr__ = _brief_text  # type: ignore[method-assign, assignment]
    return in_notebooks(kind)


def in_notebooks(kind: Kind) -> Kind:
    """Let a notebook show a dataclass by its summary on the screen, else by its fields; unless it has its own way."""
    if not hasattr(kind, "_repr_html_"):
        kind._repr_html_ = _html  # type: ignore[attr-defined]
    return kind


def _html(thing: Any) -> str:
    if type(thing).__str__ is not object.__str__:
        return f"<pre>{escape(str(thing))}</pre>"
    values = {item.name: getattr(thing, item.name) for item in fields(thing)}
    shown = {name: value if isinstance(value, str) else _brief_value(value) for name, value in values.items()}
    return html_table(type(thing).__name__, {"": list(shown), "value": list(shown.values())})


def _brief_text(thing: Any) -> str:
    shown = [f"{item.name}={_brief_value(value)}" for item in fields(thing)
            if not _is_default(value := getattr(thing, item.name), item.default)]  # fmt: skip
    text = f"{type(thing).__name__}({', '.join(shown)})"
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 4]}...)"


def _is_default(value: Any, default: Any) -> bool:
    return default is not MISSING and (value is default or (type(value) is type(default) and bool(value == default)))


def _brief_value(value: Any) -> str:
    if hasattr(value, "shape"):
        return f"<{' x '.join(map(str, value.shape)) or 'one'}>"
    if is_dataclass(value) and type(value).__repr__ is not _brief_text:
        return f"<{type(value).__name__}>"
    text = repr(value) if not isinstance(value, tuple | list | dict) or len(value) <= LONGEST_VALUE else "..."
    if len(text) <= LONGEST_VALUE or is_dataclass(value):
        return text
    listed = hasattr(value, "__len__") and not isinstance(value, str)
    return f"<{len(value)}>" if listed else f"{text[:LONGEST_VALUE]}..."


class Written:
    """Settings with a `name`, read from a `text`: a notebook shows the keys that are written."""

    def _repr_html_(self: Any) -> str:
        try:
            keys = dict(keys_of(tomllib.loads(self.text)))
        except tomllib.TOMLDecodeError:  # of a file of another program, or of several
            keys = {}
        caption = f"<{type(self).__name__} {self.name!r}>"
        return html_table(caption, {"key": list(keys), "value": list(keys.values())} if keys else {})


def keys_of(document: Mapping[str, Any], above: str = "") -> Iterator[tuple[str, str]]:
    """Yield the keys of a document and their values as text; sections in a list by their names, or numbers."""
    for key, value in document.items():
        place = f"{above}{key}"
        if isinstance(value, dict):
            yield from keys_of(value, f"{place}.")
        elif isinstance(value, list) and value and all(isinstance(item, dict) for item in value):
            for number, item in enumerate(value, start=1):
                yield from keys_of(item, f"{place}[{item.get('name', number)}].")
        else:
            yield place, json.dumps(value, ensure_ascii=False, default=str)


def html_table(caption: str, columns: Columns) -> str:
    """Return a table of HTML, its first rows at most."""
    heads = "".join(f"<th>{escape(name)}</th>" for name in columns)
    values = list(columns.values())
    count = len(values[0]) if values else 0
    rows = [
        "<tr>" + "".join(f'<td style="{LINE}">{escape(_cell(column[i]))}</td>' for column in values) + "</tr>"
        for i in range(min(count, MOST_ROWS))
    ]
    more = f"<p>{count - MOST_ROWS} more rows</p>" if count > MOST_ROWS else ""
    return f"<p>{escape(caption)}</p><table><thead><tr>{heads}</tr></thead><tbody>{''.join(rows)}</tbody></table>{more}"


def _cell(value: Any) -> str:
    value = value.item() if hasattr(value, "item") else value
    if value is None or value != value:
        return "–"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
