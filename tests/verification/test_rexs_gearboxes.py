"""Public gearboxes in REXS: from the file to shafts, bearings, meshes and loads; what they lack is said."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.machine.loaded import loaded
from pmor.machine.mesh_force import f_beta_um
from pmor.machine.model import pinion_senses, set_torques, speeds_rpm
from pmor.rexs.files import load_gearbox as load

SHARED = Path(__file__).parents[3] / "shared" / "rexs"
TWO_STAGES, THREE_STAGES, PLANETS = (
    SHARED / name
    for name in (
        "FVA-Industriegetriebe_2stufig_1-4.rexs", "SEW_3-stage_cylindrical_gearbox_1.0.rexs",
        "FVA_Planetary_stage_-_Minus_gearing_1.1.rexs",
    )
)  # fmt: skip
pytestmark = pytest.mark.skipif(not SHARED.is_dir(), reason="the public REXS files are not beside the project")


def test_the_two_stage_box_is_read_as_it_is_filed():
    file = load(TWO_STAGES)
    said = file.model.sections
    assert [len(part) for part in (said.shafts, said.bearings, said.meshes, said.loads)] == [3, 6, 2, 4]
    assert [shaft.start_mm for shaft in said.shafts] == [-70.0, -25.0, 90.0]
    assert [(mesh.pinion.at_mm, mesh.wheel.at_mm) for mesh in said.meshes] == [(117.0, 72.0), (180.0, 65.0)]
    assert [load.torques[0].torque_Nm for load in said.loads] == [567.0, 345.0, 456.0, 789.0]
    assert [load.speed_rpm for load in said.loads] == [543.0, 3456.0, 1234.0, 789.0]
    assert said.loads[0].forces[0].y_N == 456.0
    needle = next(bearing for bearing in said.bearings if "K 50x58x25" in bearing.name)
    assert (needle.to, needle.tilt_Nmm_per_rad) == (said.shafts[2].name, "rigid")
    assert any("neither stiffness nor inner geometry" in note for note in file.notes)


def test_the_two_stage_box_as_filed_deflects_as_calculated_independently():
    """Point forces, 500 N m and no others: F_beta of both meshes, rigid bearings, three of them held against tilt."""
    model = load(TWO_STAGES).model
    rigid = tuple(replace(bearing, radial_N_per_mm="rigid") for bearing in model.sections.bearings)
    model = replace(model, sections=replace(model.sections, bearings=rigid))
    gearbox = loaded(model, model.sections.loads[0])
    torque = np.flatnonzero(gearbox.load)
    gearbox.load[torque] = np.where(np.abs(gearbox.load[torque]) > 1e5, 5e5, 0.0)
    found = gearbox.solve()
    turned = [
        np.array([np.kron(np.eye(2), mesh.frame.axes.T) @ found.displacement[hub : hub + 6] for hub in mesh.hubs])
        for mesh in gearbox.meshes
    ]
    values = [m.frame.along * f_beta_um(m.pair, moved) for m, moved in zip(gearbox.meshes, turned, strict=True)]
    assert_allclose(values, [0.044, 0.988], rtol=0.005, atol=6e-4)


def test_faces_that_are_not_centred_lie_where_the_file_has_them():
    file = load(THREE_STAGES)
    senses = pinion_senses(file.model, file.model.sections.loads[0])
    # Its name is the stage's own; the two other stages have one name together.
    assert list(file.cases) == ["Stirnradstufe", "stage_37", "stage_55"]
    offset = file.cases["Stirnradstufe"].pair.pinion.face_offset_mm
    assert offset == pytest.approx(-2.5 * senses["Stirnradstufe"])
    assert [len(file.model.sections.bearings), len(file.model.sections.meshes)] == [9, 3]
    assert any("refers to no elastic constants: steel assumed" in note for note in file.notes)


@pytest.mark.slow
def test_a_planetary_stage_stands_on_the_shafts_of_its_sun_and_its_carrier():
    model = load(PLANETS).model
    said, (one,) = model.sections, model.sections.sets
    assert [shaft.name.split()[0] for shaft in said.shafts] == ["Steg", "Sonnenwelle"]
    assert [(bearing.shaft.split()[0], bearing.at_mm) for bearing in said.bearings] == [
        ("Sonnenwelle", 75.0), ("Sonnenwelle", 127.5), ("Steg", 25.0), ("Steg", 75.0),
    ]  # fmt: skip
    assert {name: place.at_mm for name, place in one.members.items()} == {"sun": 25.0, "carrier": 96.0}
    assert (one.ring, model.sets[one.name].teeth, model.sets[one.name].held) == ("housing", (17, 61), "ring")
    assert_allclose(set_torques(model, said.loads[0])[one.name], 1591.5494309, rtol=1e-9)
    speeds = speeds_rpm(model, said.loads[0])
    assert_allclose(sorted(speeds.values()), [1500.0 * 17 / 78, 1500.0], rtol=1e-9)
