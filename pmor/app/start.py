"""Files to start from, and the schemas by which an editor completes and checks files: `starts`, `schemas` here.

A start file names its schema, and the file that it starts from, beside itself. Where the user stands both are named by
their whole paths, so that it is completed and runs as it is.
"""

from __future__ import annotations

import json
import re
from pathlib import Path

from pmor.app.records import FILES, KINDS

HERE = Path(__file__).resolve().parent
SCHEMA = re.compile(r"^#:schema \.\./schemas/(\w+)\.json$", re.MULTILINE)
BASE = re.compile(r'^(case|set|gearbox) = "(\w+\.toml)"', re.MULTILINE)


def schema_path(kind: str) -> Path:
    """Return the JSON Schema of a kind of file, one of `FILES`."""
    return HERE / "schemas" / f"{kind}.json"


def schema_text(kind: str | None) -> str:
    """Return the JSON Schema of a kind of file; without one, all kinds with their files."""
    if kind is not None:
        return schema_path(kind).read_text(encoding="utf-8")
    width = max(map(len, FILES))
    words = (KINDS["case" if name == "pair" else name].words for name in FILES)
    lines = [f"{name:{width}}  {schema_path(name)}  {said}" for name, said in zip(FILES, words, strict=True)]
    return "\n".join([*lines, "", "The first line of a file names its schema: #:schema PATH", ""])


def start_text(kind: str) -> str:
    """Return a file to start from, of a kind of `pmor.app.records.STARTS`."""
    text = (HERE / "starts" / f"{kind}.toml").read_text(encoding="utf-8")
    text = SCHEMA.sub(lambda found: f"#:schema {schema_path(found[1]).as_uri()}", text)

    def whole(found: re.Match[str]) -> str:
        return f"{found[1]} = {json.dumps((HERE / 'starts' / found[2]).as_posix(), ensure_ascii=False)}"

    return BASE.sub(whole, text)
