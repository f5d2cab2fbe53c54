"""Broken campaign files: one line that names the place, the value and the remedy, exit code 2, nothing left behind."""

import sys

import pytest

from pmor.app.cli import main
from tests.support.small_case import case_text

GRID = '[designs]\nmethod = "grid"\n'
TEETH = "pinion.teeth = [19, 20]\n"
BASE = 'case = "base.toml"\n'

# name: (the file, what the message must hold)
BROKEN = {
    "no TOML": ("case = ", ["not valid TOML"]),
    "nested too deeply": ("case = " + "[" * 100_000, ["not valid TOML", "correct"]),
    "names nested too deeply": ("[" + ".".join("a" * 3000) + "]\n", ["not valid TOML", "nested too deeply"]),
    "no base case": (GRID + TEETH, ["case: is missing"]),
    "base case that is not there": ('case = "bse.toml"\n' + GRID + TEETH, ["bse.toml", "base.toml"]),
    "base case as a number": ("case = 3\n" + GRID + TEETH, ["case = 3", "in quotes"]),
    "misspelt section": (BASE + "[designss]\n", ["designss", "did you mean designs?"]),
    "designs as a value": (BASE + "designs = 4\n", ["designs", "write [designs]"]),
    "no designs": (BASE, ["[designs] method: is missing"]),
    "nothing differs": (BASE + GRID + "pinion.teeth = 20\n", ["nothing differs", "pinion.teeth = [19, 20, 21]"]),
    "unknown method": (BASE + '[designs]\nmethod = "random"\n' + TEETH, ['method = "random"', "valid are"]),
    "section that no case has": (BASE + GRID + "gear.teeth = [19, 20]\n", ["gear: no section of a case", "valid are"]),
    "misspelt key": (BASE + GRID + "pinion.teth = [19, 20]\n", ["pinion.teth", "did you mean teeth?"]),
    "half a tooth": (BASE + GRID + "pinion.teeth = [19, 20.5]\n", ["pinion.teeth = 20.5", "whole number"]),
    "three teeth": (BASE + GRID + "pinion.teeth = [3, 20]\n", ["pinion.teeth = 3", "between 6 and 1000"]),
    "teeth as text": (BASE + GRID + 'pinion.teeth = ["19", "20"]\n', ["pinion.teeth", "only numbers may differ"]),
    "no values": (BASE + GRID + "pinion.teeth = []\n", ["pinion.teeth = []", "at least one value"]),
    "a value twice": (BASE + GRID + "pinion.teeth = [19, 20, 19]\n", ["a value twice"]),
    "lists of unequal length": (
        BASE + '[designs]\nmethod = "list"\n' + TEETH + "pair.module_mm = [4.0, 4.1, 4.2]\n",
        ["pinion.teeth", "2 values", "pair.module_mm has 3"],
    ),
    "range without steps": (
        BASE + GRID + "pair.module_mm = { from = 3.0, to = 4.0 }\n", ["pair.module_mm", "steps = 3"],
    ),
    "range backwards": (
        BASE + GRID + "pair.module_mm = { from = 4.0, to = 3.0, steps = 3 }\n", ["from = 4 must be below to = 3"],
    ),
    "range of one step": (BASE + GRID + "pair.module_mm = { from = 3.0, to = 4.0, steps = 1 }\n", ["steps = 1"]),
    "Sobol without a count": (BASE + '[designs]\nmethod = "sobol"\n' + TEETH, ["count: is missing"]),
    "count of a grid": (BASE + GRID + "count = 8\n" + TEETH, ["count", 'method = "sobol"', "remove it"]),
    "steps of Sobol's sequence": (
        BASE + '[designs]\nmethod = "sobol"\ncount = 8\npair.module_mm = { from = 3.0, to = 4.0, steps = 3 }\n',
        ["pair.module_mm", "{ from = 10.0, to = 20.0 }"],
    ),
    "more designs than anybody solves": (
        BASE + GRID + "pair.module_mm = { from = 3.0, to = 4.0, steps = 9000 }\n"
        "pair.face_width_mm = { from = 10.0, to = 40.0, steps = 9000 }\n",
        ["81000000 designs", "10000000 at most"],
    ),
    "table that is not there": (BASE + '[designs]\nmethod = "csv"\nfile = "no.csv"\n', ["no.csv", "no such CSV file"]),
    "table with an unknown key": (BASE + '[designs]\nmethod = "csv"\nfile = "key.csv"\n', ["key.csv", "pinion.teth"]),
    "table that is none": (BASE + '[designs]\nmethod = "csv"\nfile = "long.csv"\n', ["long.csv", "field limit"]),
    "table with a short line": (BASE + '[designs]\nmethod = "csv"\nfile = "short.csv"\n', ["line 3", "has 1 values"]),
    "table with a word": (BASE + '[designs]\nmethod = "csv"\nfile = "word.csv"\n', ["line 2", "pinion.teeth", "many"]),
    "table without designs": (BASE + '[designs]\nmethod = "csv"\nfile = "empty.csv"\n', ["line 1", "add them"]),
    "ratio beside the wheel's teeth": (
        BASE + GRID + TEETH + "wheel.teeth = [30, 31]\n[relations]\nratio = 1.5\n", ["wheel.teeth", "follows from"],
    ),
    "centre distance beside the shift that it takes": (
        BASE + GRID + TEETH + "pinion.profile_shift = [0.0, 0.1]\n[relations]\ncentre_distance_mm = 84.0\n",
        ["pinion.profile_shift", "follows from [relations]"],
    ),
    "negative centre distance": (
        BASE + GRID + TEETH + "[relations]\ncentre_distance_mm = -84.0\n", ["centre_distance_mm = -84.0", "mm"],
    ),
    "misspelt relation": (BASE + GRID + TEETH + "[relations]\nratios = 2.0\n", ["ratios", "did you mean ratio?"]),
    "unknown result": (BASE + GRID + TEETH + '[results]\nkeys = ["ste_peak"]\n', ['"ste_peak"', "unknown"]),
    "no time at all": (BASE + GRID + TEETH + "[workers]\ntime_limit_s = 0\n", ["time_limit_s = 0", "between 0.1"]),
    "store of less than nothing": (BASE + GRID + TEETH + "[store]\nlimit_GiB = -1.0\n", ["limit_GiB = -1.0"]),
    "store in a folder of other things": (
        BASE + GRID + TEETH + '[store]\nfolder = "taken"\n', ["taken", "holds other things"],
    ),
    "penalty contact": (BASE + GRID + TEETH + 'contact.scheme = "direct"\n', ['"direct"', 'contact.scheme = "line"']),
    "fixed value out of range": (BASE + GRID + TEETH + "pair.module_mm = 400.0\n", ["pair.module_mm = 400.0"]),
}  # fmt: skip
TABLES = {
    "long.csv": "pinion.teeth\n" + "1" * 200_000 + "\n",
    "key.csv": "pinion.teth\n19\n",
    "short.csv": "pinion.teeth,pair.module_mm\n19,4.0\n20\n",
    "word.csv": "pinion.teeth\nmany\n",
    "empty.csv": "pinion.teeth\n",
}


@pytest.mark.parametrize("name", BROKEN)
def test_broken_campaigns_are_refused_in_one_line_and_leave_nothing(name, tmp_path, capsys, monkeypatch):
    text, words = BROKEN[name]
    (tmp_path / "taken").mkdir()
    files = {"base.toml": case_text(contact={"scheme": "line"}, reduction=None), "campaign.toml": text,
             "taken/thesis.txt": "mine", **TABLES}  # fmt: skip
    for file, content in files.items():
        (tmp_path / file).write_text(content)
    monkeypatch.chdir(tmp_path)
    assert main(["campaign", "campaign.toml", "--out", "out"]) == 2
    error = capsys.readouterr().err
    assert error.startswith("pmor: error: ")
    assert len(error.splitlines()) == 1
    for word in words:
        assert word in error
    assert {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file()} == set(files)
    assert not (tmp_path / "out").exists()


def test_a_campaign_that_is_not_there_is_refused(tmp_path, capsys):
    assert main(["campaign", str(tmp_path / "no.toml")]) == 2
    assert "no such campaign file" in capsys.readouterr().err


def test_a_case_beyond_the_designs_is_refused(tmp_path, capsys):
    (tmp_path / "base.toml").write_text(case_text(contact={"scheme": "line"}, reduction=None))
    path = tmp_path / "campaign.toml"
    path.write_text(BASE + GRID + TEETH)
    assert main(["campaign", str(path), "--case", "3", "--out", str(tmp_path / "out")]) == 2
    assert "has 2 designs" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("address", "installed", "words"),
    [
        ("tcp://127.0.0.1:8786", False, "pip install 'pmor-gear[cluster]'"),
        ("none.json", True, "no such scheduler file"),
        ("tcp://nowhere:port", True, "no scheduler answers"),
    ],
)
def test_a_cluster_that_is_not_there_is_told_of_in_one_line(address, installed, words, tmp_path, capsys, monkeypatch):
    if installed:
        pytest.importorskip("distributed")
    else:
        monkeypatch.setitem(sys.modules, "distributed", None)
    (tmp_path / "base.toml").write_text(case_text(contact={"scheme": "line"}, reduction=None))
    path = tmp_path / "campaign.toml"
    path.write_text(BASE + GRID + TEETH)
    assert main(["campaign", str(path), "--dask", address, "--out", str(tmp_path / "out")]) == 2
    error = capsys.readouterr().err
    assert words in error
    assert len(error.splitlines()) == 1
    assert not (tmp_path / "out").exists()
