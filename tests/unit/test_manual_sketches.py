"""Sketches of the manual are those that their program draws."""

import re
from pathlib import Path

from tests.programs import manual_sketches

MANUAL = Path(__file__).parents[2] / "cases" / "manual"


def words_of(path):
    return re.findall(r"<text[^>]*>([^<]*)</text>", path.read_text(encoding="utf-8"))


def test_each_sketch_is_drawn_and_says_what_the_committed_one_says(tmp_path):
    manual_sketches.main(str(tmp_path))
    names = {f"{name}.svg" for name in manual_sketches.FIGURES}
    assert {path.name for path in MANUAL.glob("*.svg")} == names
    for name in names:
        assert words_of(tmp_path / name)
        assert words_of(tmp_path / name) == words_of(MANUAL / name)
