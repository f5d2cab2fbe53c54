"""Files of any name that a system allows: bytes that are no UTF-8, control characters, line breaks."""

import os
import xml.dom.minidom
import zipfile

import pytest

import pmor
from pmor.app.cli import main
from tests.support.small_case import case_text
from tests.support.stored_files import results_in

NAME = os.fsdecode(b"caf\xe9 \a\x1b[31m two\nlines\r.toml")
CASE = case_text(
    contact={"scheme": "line"}, reduction=None, results={"root_stress": False, "maps": False}, compare={"angles": 1},
    output={"plots": False, "live_page": False}, mesh={"width": "plane_strain"},
)  # fmt: skip


@pytest.fixture
def case_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / NAME).write_text(CASE)
    return NAME


@pytest.mark.slow
def test_a_case_of_any_file_name_is_run_and_exported(case_file, undrawn, tmp_path, capsys):
    assert main(["run", case_file]) == 0
    (folder,) = (tmp_path / "out").iterdir()
    assert {"summary.json", "report.html", "results.h5"} <= results_in(folder)
    stem = case_file.removesuffix(".toml")
    assert main(["offline", case_file, "-o", f"{stem}.h5"]) == 0
    for to, ending in (("csv", "_tables"), ("rexs", ".rexs"), ("fmu", ".fmu")):
        assert main(["export", f"{stem}.h5", "--to", to]) == 0
        assert (tmp_path / f"{stem}{ending}").exists()
    assert main(["export", f"{stem}.rexs", "--to", "case", "-o", "again.toml"]) == 0
    assert capsys.readouterr().out.replace("\n", "").isprintable()

    xml.dom.minidom.parseString((tmp_path / f"{stem}.rexs").read_bytes())
    with zipfile.ZipFile(tmp_path / f"{stem}.fmu") as unit:
        xml.dom.minidom.parseString(unit.read("modelDescription.xml"))
    for table in (tmp_path / f"{stem}_tables").glob("*.csv"):
        first, second, *_ = table.read_bytes().split(b"\n")
        assert (first[:2], second[:2]) == (b"# ", b"# ")
    assert pmor.load_case("again.toml").pair == pmor.load_case(case_file).pair
