"""Schemas say what the reader takes, and files to start from are completed, checked and loaded as they are."""

import json
import re
import tomllib
from pathlib import Path
from urllib.parse import urlparse
from urllib.request import url2pathname

import pytest

from pmor.app.capabilities import load
from pmor.app.cli import main
from pmor.app.records import FILES, STARTS
from pmor.app.start import schema_path, start_text
from tests.programs.json_schemas import text_of
from tests.support.schemas import faults, kind_at_desk

ROOT = Path(__file__).parents[2]
SHIPPED = [*sorted((ROOT / "cases").glob("*.toml")), *sorted((ROOT / "pmor" / "app" / "starts").glob("*.toml"))]
PAIR = '[load]\ntorque_Nm = 100.0\n[pair]\nmodule_mm = 4.0\nface_width_mm = 20.0\n[pinion]\nteeth = 21\n'


@pytest.mark.parametrize("kind", FILES)
def test_the_committed_schema_is_what_the_reader_takes(kind):
    text = schema_path(kind).read_text(encoding="utf-8")
    assert text == text_of(kind), "run: python -m tests.programs.json_schemas"


def test_every_shipped_file_names_its_schema_and_obeys_it():
    for path in SHIPPED:
        text = path.read_text(encoding="utf-8")
        named = path.parent / re.match(r"#:schema (\S+)\n", text)[1]
        kind = kind_at_desk(tomllib.loads(text))
        assert named.resolve() == schema_path(kind), path
        assert faults(text, kind) == [], path


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ("[mesh]\nelements = 3\n", "elements"), ("[mesh]\nprofile_elements = 1\n", "less than"),
        ('[mesh]\nelement = "hex21"\n', "hex21"), ("[wheel]\nbore_radius_mm = 5.0\n", "wheel"),
        ("[pinion.blank]\nmesh = 'a.inp'\nhub_radius_mm = 3.0\n", "blank"),
        ("[online]\ntorques_Nm = [1, 1]\n", "torques"),
        ("[[condition]]\ntorque_Nm = '3'\n", "'3'"), ("[lubricant]\nfriction = 2\n", "2"),
    ],
)  # fmt: skip
def test_a_schema_sees_what_the_reader_refuses(more, words):
    assert faults(PAIR, "pair") == []
    assert words in " ".join(faults(PAIR + more, "pair"))


@pytest.mark.parametrize(
    "more",
    [
        "[wheel.modification]\ntip_relief_um = 3.0\n", '[wheel]\nteeth = 30\nheld = "outside"\n', "[[condition]]\n",
        '[lubricant]\nfriction = 0.1\n[compare]\nlargest_error_percent = "5 %"\nmodels = "line"\n',
    ],
)  # fmt: skip
def test_a_schema_lets_pass_what_the_reader_takes(more):
    assert faults(PAIR + more, "pair") == []


def test_negative_torques_are_of_coast_flanks():
    text = PAIR.replace("100.0", "-100.0") + "[online]\ntorques_Nm = [-100.0, -50.0]\n"
    assert faults(text, "pair") == []


@pytest.mark.parametrize("kind", STARTS)
def test_a_file_to_start_from_is_checked_and_loads_where_the_user_stands(kind, tmp_path, capsys):
    assert main(["new", kind]) == 0
    text = capsys.readouterr().out
    (uri,) = re.findall(r"^#:schema (\S+)", text)
    assert Path(url2pathname(urlparse(uri).path)) == schema_path(kind)
    assert faults(text, kind) == []
    path = tmp_path / "my.toml"
    path.write_text(text, encoding="utf-8")
    load(path)
    values = [line for line in text.splitlines() if " = " in line]
    assert [line for line in values if "#" not in line and not line.endswith("[")] == []


def test_the_manual_begins_with_the_file_to_start_from():
    page = (ROOT / "cases" / "manual" / "ten_minutes.md").read_text(encoding="utf-8")
    shown = page.split("```toml\n# pair.toml\n")[1].split("```")[0]
    assert shown == start_text("pair").partition("\n")[2]


def test_the_command_prints_each_schema_and_says_where_all_are(capsys):
    assert main(["schema", "pair"]) == 0
    assert json.loads(capsys.readouterr().out)["title"] == "pmor: a case of one pair"
    assert main(["schema"]) == 0
    listed = capsys.readouterr().out
    assert all(str(schema_path(kind)) in listed for kind in FILES)
