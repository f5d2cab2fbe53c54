"""Sets and gearboxes made and changed in Python are those of files with the same sections, checks included."""

import tomllib

import pytest

import pmor
from pmor.core.errors import CaseError
from pmor.machine.settings import Shaft, ShaftSection
from tests.support.gearboxes import SMALL, SMALL_CASE
from tests.support.small_sets import SMALL_SET, written_set

SET = tomllib.loads(SMALL_SET)


@pytest.fixture(scope="module")
def box():
    """Sections of the small gearbox, those of its case inside."""
    document, case = tomllib.loads(SMALL), tomllib.loads(SMALL_CASE)
    (mesh,) = document["meshes"]
    del mesh["case"], case["load"]
    for gear in ("pinion", "wheel"):
        mesh[gear] |= case.pop(gear)
    mesh |= case
    return document


def test_a_set_of_sections_is_that_of_its_file_and_so_is_one_that_changed(tmp_path):
    made, read = pmor.make("small", **SET), pmor.load(written_set(tmp_path, SMALL_SET))
    assert (made.sections, made.cases) == (read.sections, read.cases)
    assert pmor.plan(made) == pmor.plan(read)
    load, relief = {"torque_Nm": 50.0}, {"profile_crowning_um": 5.0}
    changed = pmor.change(read, load=load, sun={"modification": relief}, planets={"tangential_um": None})
    assert changed.sections.members["sun"] == {**SET["sun"], "modification": relief}
    assert changed.sections.planets.tangential_um == ()
    document = SET | {"load": SET["load"] | load, "sun": SET["sun"] | {"modification": relief}}
    document["planets"] = {key: value for key, value in SET["planets"].items() if key != "tangential_um"}
    assert changed.cases == pmor.make("small", **document).cases


def test_sections_with_names_change_by_them_and_dataclasses_are_sections(box):
    made = pmor.make("box", **box)
    output = next(shaft for shaft in made.model.sections.shafts if shaft.name == "output")
    changed = pmor.change(made, shafts={"output": {"density_kg_m3": 7000.0}}, loads={"drive": {"speed_rpm": 100.0}})
    assert changed.model.shafts["output"].density_kg_m3 == 7000.0
    assert [load.speed_rpm for load in changed.model.sections.loads if load.name == "drive"] == [100.0]
    thick = Shaft(name="output", at_mm=output.at_mm, sections=(ShaftSection(length_mm=output.length, outer_mm=60.0),))
    others = [shaft for shaft in box["shafts"] if shaft["name"] != "output"]
    assert pmor.change(made, shafts=[*others, thick]).model.shafts["output"] == thick
    assert list(pmor.make("box", **box | {"shafts": [*others, thick]}).cases) == ["mesh"]


def test_what_a_file_refuses_is_refused_in_the_words_of_python(box):
    made = pmor.make("box", **box)
    with pytest.raises(CaseError, match=r"box: shafts: outptu: no section has this name: did you mean output"):
        pmor.change(made, shafts={"outptu": {"start_mm": 1.0}})
    with pytest.raises(CaseError, match=r'"pair.toml"}: there is no folder to look for it in: write its whole path'):
        pmor.change(made, meshes={"mesh": {"case": "pair.toml"}})
    with pytest.raises(CaseError, match="load={'torque_Nm': 0}"):
        pmor.make("set", **SET | {"load": {"torque_Nm": 0}})
    with pytest.raises(CaseError, match=r"machine: is a design, which names a machine: write a file"):
        pmor.make(variables={})
