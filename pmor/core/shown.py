"""Things as Python shows them: in one line, in a notebook, and as a table of pandas."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from html import escape
from typing import TYPE_CHECKING, Any, TypeVar

from pmor.core.errors import ExternalProgramError

if TYPE_CHECKING:
    from pandas import DataFrame

#: arrays or lists of one length by their names
Columns = Mapping[str, Any]
Kind = TypeVar("Kind", bound=type)
LONGEST = 200
LONGEST_VALUE = 40
# Rows of a table in a notebook.
MOST_ROWS = 20
LINE = "border-top: 1px solid currentColor; text-align: right"


def brief(kind: Kind) -> Kind:
    """Let a dataclass show itself in one line: what differs from its defaults, of arrays and lists the size alone."""
    kind.__repr__ = _brief_text  # type: ignore[method-assign, assignment]
    return kind


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


class Tabular:
    """A result that is a table: shown as one in a notebook, and taken over by pandas."""

    def columns(self) -> Columns:
        """All of it by the names of columns."""
        raise NotImplementedError

    def _shown(self) -> Columns:
        """What a notebook shows of it."""
        return self.columns()

    def to_dataframe(self) -> DataFrame:
        """Return the result as a table of pandas, units in the names of its columns.

        Raises
        ------
        ExternalProgramError
            Where pandas is not installed.
        """
        try:
            from pandas import DataFrame
        except ImportError:
            raise ExternalProgramError(
                "to_dataframe: the package pandas is not installed: pip install pandas, or 'pmor-gear[pandas]'"
            ) from None
        return DataFrame(dict(self.columns()))

    def _repr_html_(self) -> str:
        return html_table(repr(self), self._shown())


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
