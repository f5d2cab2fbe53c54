"""The table of keys in `cases/README.md` says what the schema says."""

import tomllib
from pathlib import Path

import pytest

from pmor.case.loader import parse_case
from tests.programs.key_table import formats, key_tables, keys_in_file, main, with_key_tables

README = Path(__file__).parents[2] / "cases" / "README.md"


def test_the_committed_table_is_what_the_schema_gives():
    text = README.read_text(encoding="utf-8")
    assert text == with_key_tables(text), "run: python -m tests.programs.key_table cases/README.md"


def test_every_key_is_there_with_its_meaning():
    rows = [line.split(" | ") for line in key_tables().splitlines() if line.startswith("| `")]
    sections = [kind for kinds in formats().values() for kind in kinds.values()]
    assert len(rows) == sum(len(keys_in_file(kind)) for kind in sections)
    for key, allowed, default, meaning in rows:
        assert key.startswith("| `")
        assert allowed
        assert default
        assert len(meaning.removesuffix(" |")) > 10, key


def test_its_example_is_a_case():
    text = README.read_text(encoding="utf-8").split("```toml\n")[1].split("```")[0]
    assert set(tomllib.loads(text)) == {"load", "pair", "pinion"}
    assert parse_case(text, "example", "example").pair.wheel.teeth == 21


def test_every_case_file_is_named():
    text = README.read_text(encoding="utf-8")
    assert [path.name for path in README.parent.glob("*.toml") if f"`{path.name}`" not in text] == []


def test_a_text_without_markers_stays_as_it_is(tmp_path):
    target = tmp_path / "README.md"
    target.write_text("nothing to replace")
    with pytest.raises(ValueError, match="lacks the lines"):
        main(target)
    assert target.read_text() == "nothing to replace"
