"""HTML from templates."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from pmor.report.style import data_uri
from pmor.report.table import format_cell

if TYPE_CHECKING:
    from jinja2 import Template


def html_template(name: str) -> Template:
    """Return a template of `pmor/report/templates`; values are escaped."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("pmor.report"), autoescape=True, undefined=StrictUndefined, trim_blocks=True,
        lstrip_blocks=True, keep_trailing_newline=True,
    )  # fmt: skip
    environment.filters.update(format_cell=format_cell, data_uri=data_uri, json_text=_json_text)
    return environment.get_template(name)


def _json_text(data: object) -> str:
    """Data for a script: no tag ends or begins in it."""
    text = json.dumps(data, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c")
