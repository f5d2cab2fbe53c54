"""Files to start from run as they are."""

import pytest

from pmor.app.cli import main
from pmor.app.records import STARTS
from pmor.app.start import start_text


@pytest.mark.slow
@pytest.mark.parametrize("kind", STARTS)
def test_a_file_to_start_from_is_planned_and_runs_as_it_is(kind, tmp_path):
    path = tmp_path / "my.toml"
    path.write_text(start_text(kind), encoding="utf-8")
    assert main(["plan", str(path)]) == 0
    assert main(["run", str(path), "--out", str(tmp_path / "out")]) == 0
    assert (tmp_path / "out" / "report.html").exists()
