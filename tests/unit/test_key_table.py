"""The page of keys says what the schema says, and the page of cases what there is."""

import re
import tomllib
from pathlib import Path

from pmor.case.loader import parse_case
from tests.programs.key_table import documented, formats, key_page, keys_in_file

CASES = Path(__file__).parents[2] / "cases"
TEXT = (CASES / "README.md").read_text(encoding="utf-8")


def test_the_committed_page_is_what_the_schema_gives():
    text = (CASES / "manual" / "keys.md").read_text(encoding="utf-8")
    assert text == key_page(), "run: python -m tests.programs.key_table cases/manual/keys.md"


def test_every_key_is_there_with_its_meaning():
    rows = [line.split(" | ") for line in key_page().splitlines() if line.startswith("`") and " | " in line]
    kinds = dict.fromkeys(kind for sections in formats().values() for kind in sections.values())
    assert sum(len(re.findall("`[^`]+`", row[0])) for row in rows) == sum(len(keys_in_file(kind)) for kind in kinds)
    for keys, allowed, default, meaning in rows:
        assert allowed
        assert default
        assert len(meaning) > 8, keys


def test_its_example_is_a_case():
    text = TEXT.split("```toml\n")[1].split("```")[0]
    assert set(tomllib.loads(text)) == {"load", "pair", "pinion"}
    assert parse_case(text, "example", "example").pair.wheel.teeth == 21


def test_every_case_file_is_named():
    assert [path.name for path in CASES.glob("*.toml") if f"`{path.name}`" not in TEXT] == []


# What a key is of, in its name: keys that differ in it alone may share a meaning.
SUBJECT = re.compile(
    "pinion|wheel|sun|ring|planets?|carrier|(profile|helix)_(slope|crowning)|in_plane|out_of_plane|centre_distance|"
    "(tip|root|end)_relief(_start|_end)?|twist|polar|tilting"
)


def test_keys_that_mean_different_things_are_told_apart():
    keys = {}
    for kind in dict.fromkeys(kind for sections in formats().values() for kind in sections.values()):
        meanings = documented(kind)[1]
        for key in keys_in_file(kind):
            keys.setdefault(meanings[key], set()).add(SUBJECT.sub("*", key))
    assert {meaning: names for meaning, names in keys.items() if len(names) > 1} == {}
