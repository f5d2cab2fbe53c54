"""A basis file to damage, and what it holds; what the reader refuses in a file, its schema sees too."""

import shutil
import sys

import pytest

from pmor.case import reader
from tests.support.refusals import contents
from tests.support.schemas import UNSEEN, sees

# Where the reader refuses a value, a key or a section by its dataclass alone; files that a key names are others.
BY_DATACLASS = ("section", "value", "refuse_value", "refuse_unknown", "list_of", "_field", "_changes")


@pytest.fixture
def basis(small_basis_path, tmp_path):
    """A copy to damage."""
    return shutil.copy(small_basis_path, tmp_path / "basis.h5")


@pytest.fixture(scope="module")
def original(small_basis_path):
    return contents(small_basis_path)


@pytest.fixture(autouse=True)
def schemas(request, monkeypatch):
    """Fail a test of a broken file that the reader refused by its dataclasses and no schema sees."""
    unseen, folder = [], request.getfixturevalue("tmp_path") if "tmp_path" in request.fixturenames else None

    class Noted(reader.CaseError):
        def __init__(self, text):
            super().__init__(text)
            frames = [sys._getframe(depth).f_code for depth in (1, 2, 3)]
            callers = [code.co_name for code in frames if code.co_filename == reader.__file__]
            outer = next((name for name in callers if name != "refuse"), "")
            files = list(folder.glob("*.toml"))
            if outer in BY_DATACLASS and files and not any(words in text for words in UNSEEN):
                unseen.extend([] if any(sees(path) for path in files) else [text])

    if folder is not None and "test_broken" in request.module.__name__:
        monkeypatch.setattr(reader, "CaseError", Noted)
    yield
    assert unseen == []
