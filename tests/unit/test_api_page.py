"""The manual's reference of the Python interface is made from the docstrings."""

from pathlib import Path

import pmor
from tests.programs import api_page

SHOWN = (Path(__file__).parents[2] / api_page.PAGE).read_text(encoding="utf-8")


def test_the_page_is_that_of_the_docstrings():
    assert api_page.page() == SHOWN, "make it anew: python -m tests.programs.api_page"


def test_every_public_name_has_its_place_on_the_page():
    assert [name for name in pmor.__all__ if f"\n## {name}\n" not in SHOWN] == ["__version__"]
