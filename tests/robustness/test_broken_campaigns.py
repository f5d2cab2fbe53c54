"""Broken campaign files: one line that names the place, the value and the remedy, exit code 2, nothing left behind."""

import sys
from types import ModuleType, SimpleNamespace

import pytest

from tests.support.refusals import refused
from tests.support.small_case import case_text
from tests.support.small_set_campaign import STEPPED
from tests.support.small_sets import SMALL_CHAIN, SMALL_SET

GRID = '[designs]\nmethod = "grid"\n'
TEETH = "pinion.teeth = [19, 20]\n"
BASE = 'case = "base.toml"\n'
SET = 'set = "set.toml"\n' + GRID

# name: (the file, what the message must hold)
BROKEN = {
    "nested too deeply": ("case = " + "[" * 100_000, ["not valid TOML", "nested too deeply"]),
    "no base case": (GRID + TEETH, ["case: is missing"]),
    "base case that is not there": ('case = "bse.toml"\n' + GRID + TEETH, ["bse.toml", "base.toml"]),
    "misspelt section": (BASE + "[designss]\n", ["designss", "did you mean designs?"]),
    "designs as a value": (BASE + "designs = 4\n", ["designs", "write [designs]"]),
    "no designs": (BASE, ["[designs] method: is missing"]),
    "nothing differs": (BASE + GRID + "pinion.teeth = 20\n", ["nothing differs", "pinion.teeth = [19, 20, 21]"]),
    "unknown method": (BASE + '[designs]\nmethod = "random"\n' + TEETH, ['method = "random"', "valid are"]),
    "section that no case has": (BASE + GRID + "gear.teeth = [19, 20]\n", ["gear: no section of a case", "valid are"]),
    "misspelt key": (BASE + GRID + "pinion.teth = [19, 20]\n", ["pinion.teth", "did you mean teeth?"]),
    "half a tooth": (BASE + GRID + "pinion.teeth = [19, 20.5]\n", ["pinion.teeth = 20.5", "whole number"]),
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
    "unknown result": (BASE + GRID + TEETH + '[results]\nkeys = ["ste_peak"]\n', ['"ste_peak"', "unknown"]),
    "store in a folder of other things": (
        BASE + GRID + TEETH + '[store]\nfolder = "taken"\n', ["taken", "holds other things"],
    ),
    "a set beside a case": (BASE + 'set = "set.toml"\n' + GRID + "sun.teeth = [18, 20]\n", ["case: unknown key"]),
    "a sun of a train": (
        'set = "chain.toml"\n' + GRID + "sun.teeth = [18, 20]\n", ["sun: no section of a set", "valid are"],
    ),
    "relations of a train": (
        'set = "chain.toml"\n' + GRID + "input.teeth = [18, 20]\n[relations]\nratio = 3.0\n",
        ["[relations]", "is of planetary sets", "chain.toml"],
    ),
    "a result of planets of a train": (
        'set = "chain.toml"\n' + GRID + 'input.teeth = [18, 20]\n[results]\nkeys = ["k_gamma"]\n',
        ['"k_gamma"', "is none of this set"],
    ),
    "a base set that cannot be": ('set = "none.toml"\n' + GRID + "sun.teeth = [18, 20]\n", ["none.toml", "assembled"]),
    "gear that no set has": (SET + "pinion.teeth = [18, 20]\n", ["pinion: no section of a set", "valid are"]),
    "errors of pins from design to design": (
        SET + "planets.radial_um = [1.0, 2.0]\n", ["nothing differs", "sun.teeth"],
    ),
    "coaxial teeth of stepped planets": (
        'set = "stepped.toml"\n' + GRID + "sun.teeth = [18, 21]\n[relations]\nplanet_teeth_fewer = 0\n",
        ["planet_teeth_fewer", "planets with one gear"],
    ),
    "module beside the diameter that it follows from": (
        SET + "pair.module_mm = [4.0, 5.0]\n[relations]\nring_diameter_mm = 200.0\n", ["module_mm", "follows from"],
    ),
    "centre distance beside shifts that make it": (
        SET + 'pair.centre_distance_mm = [72.0, 73.0]\n[relations]\nsolve = "sun"\n',
        ["centre_distance_mm", "is fixed in"],
    ),
    "one shift beside both": (
        SET + 'sun.teeth = [18, 20]\n[relations]\nsolve = "ring"\ncentre_distance_mm = 73.0\n', ["leave it out"],
    ),
    "penalty": (BASE + GRID + TEETH + 'contact.scheme = "direct"\n', ["flank_lines", '[contact] scheme = "line"']),
}  # fmt: skip
TABLES = {
    "long.csv": "pinion.teeth\n" + "1" * 200_000 + "\n",
    "key.csv": "pinion.teth\n19\n",
    "short.csv": "pinion.teeth,pair.module_mm\n19,4.0\n20\n",
    "word.csv": "pinion.teeth\nmany\n",
    "empty.csv": "pinion.teeth\n",
}


@pytest.mark.parametrize("name", BROKEN)
def test_broken_campaigns_are_refused_in_one_line_and_leave_nothing(name, tmp_path, monkeypatch):
    text, words = BROKEN[name]
    (tmp_path / "taken").mkdir()
    files = {"base.toml": case_text(contact={"scheme": "line"}, reduction=None), "campaign.toml": text,
             "set.toml": SMALL_SET, "none.toml": SMALL_SET.replace("teeth = 54", "teeth = 55"),
             "chain.toml": SMALL_CHAIN, "stepped.toml": STEPPED.replace("3.95", "4.0"),
             "taken/thesis.txt": "mine", **TABLES}  # fmt: skip
    for file, content in files.items():
        (tmp_path / file).write_text(content)
    monkeypatch.chdir(tmp_path)
    refused("campaign", "campaign.toml", "--out", "out", words=words)
    assert {str(path.relative_to(tmp_path)) for path in tmp_path.rglob("*") if path.is_file()} == set(files)
    assert not (tmp_path / "out").exists()


@pytest.fixture
def two_designs(tmp_path):
    """The file of a campaign of two designs."""
    (tmp_path / "base.toml").write_text(case_text(contact={"scheme": "line"}, reduction=None))
    path = tmp_path / "campaign.toml"
    path.write_text(BASE + GRID + TEETH)
    return path


def test_a_campaign_that_is_not_there_is_refused(tmp_path):
    refused("campaign", tmp_path / "no.toml", words=["no such campaign file"])


def test_a_case_beyond_the_designs_is_refused(two_designs, tmp_path):
    refused("campaign", two_designs, "--case", "3", "--out", tmp_path / "out", words=["has 2 designs"])
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("address", "installed", "words"),
    [
        ("tcp://127.0.0.1:8786", False, "pip install 'pmor-gear[cluster]'"),
        ("none.json", True, "no such scheduler file"),
        ("tcp://nowhere:port", True, "no scheduler answers"),
    ],
)
def test_a_cluster_that_is_not_there_is_told_of_in_one_line(
    address, installed, words, two_designs, tmp_path, monkeypatch
):
    if installed:
        pytest.importorskip("distributed")
    else:
        monkeypatch.setitem(sys.modules, "distributed", None)
    refused("campaign", two_designs, "--dask", address, "--out", tmp_path / "out", words=[words])
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("address", ["tls://127.0.0.1:9", "scheduler.json"])
def test_an_address_of_tls_takes_certificates(two_designs, tmp_path, monkeypatch, address):
    """Dask's own client waits for half a minute in a thread of its own, and ends in a traceback."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scheduler.json").write_text('{"address": "tls://127.0.0.1:9"}')
    distributed, comm = ModuleType("distributed"), ModuleType("distributed.comm")
    distributed.Client = lambda *arguments, **options: pytest.fail("asked for")
    distributed.Security = lambda: SimpleNamespace(get_connection_args=lambda role: {"ssl_context": None})
    comm.get_address_host_port = lambda address: ("127.0.0.1", 9)
    monkeypatch.setitem(sys.modules, "distributed", distributed)
    monkeypatch.setitem(sys.modules, "distributed.comm", comm)
    refused("campaign", two_designs, "--dask", address, "--out", tmp_path / "out", words=["takes certificates"])


@pytest.mark.parametrize("content", ["", "{}", "[]", "not a scheduler"])
def test_a_file_that_is_no_scheduler_file_is_refused(two_designs, tmp_path, monkeypatch, content):
    (tmp_path / "scheduler.json").write_text(content)
    distributed, comm = ModuleType("distributed"), ModuleType("distributed.comm")
    distributed.Client = distributed.Security = comm.get_address_host_port = None
    monkeypatch.setitem(sys.modules, "distributed", distributed)
    monkeypatch.setitem(sys.modules, "distributed.comm", comm)
    file = tmp_path / "scheduler.json"
    refused("campaign", two_designs, "--dask", file, "--out", tmp_path / "out", words=["is no scheduler file"])
