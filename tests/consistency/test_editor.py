"""taplo, which editors of TOML have inside, checks and completes files by their schemas; skipped without it."""

import shutil
import subprocess

import pytest

from pmor.app.records import STARTS
from pmor.app.start import start_text

TAPLO = shutil.which("taplo")
pytestmark = pytest.mark.skipif(TAPLO is None, reason="taplo is not installed")


def checked(folder, text):
    (folder / "my.toml").write_text(text, encoding="utf-8")
    done = subprocess.run(
        [TAPLO, "lint", "my.toml"], cwd=folder, capture_output=True, text=True, check=False, timeout=60
    )
    return done.returncode, done.stderr


@pytest.mark.parametrize("kind", STARTS)
def test_an_editor_checks_a_file_to_start_from(kind, tmp_path):
    text = start_text(kind)
    assert checked(tmp_path, text)[0] == 0
    head, _, rest = text.partition("\n")
    code, errors = checked(tmp_path, f"{head}\nno_key_of_any_file = 1\n{rest}")
    assert code == 1
    assert "no_key_of_any_file" in errors
