"""The manual's reference of the Python interface is made from the docstrings."""

from pathlib import Path

import pmor
from tests.programs import api_page
from tests.support.held import held

SHOWN = (Path(__file__).parents[2] / api_page.PAGE).read_text(encoding="utf-8")


def test_the_page_is_that_of_the_docstrings():
    assert api_page.page() == SHOWN, "make it anew: python -m tests.programs.api_page"


def test_every_public_name_has_its_place_on_the_page():
    assert [name for name in pmor.__all__ if f"\n## {name}\n" not in SHOWN] == ["__version__"]


def test_a_notebook_shows_whatever_a_user_holds():
    """Tuples with names aside, which show themselves."""
    kinds = [kind for kind in held() if not issubclass(kind, tuple)]
    assert {kind.__name__ for kind in kinds} > {"SetResult", "MeshView", "ShaftOrder", "StudyResult", "Study"}
    assert [kind.__name__ for kind in kinds if not hasattr(kind, "_repr_html_")] == []
