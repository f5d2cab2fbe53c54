"""Couplings between shafts carry torque: a shaft that is cut and joined again is the shaft as it was."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.core.errors import CaseError
from pmor.machine.loader import load
from pmor.machine.model import loaded, pinion_torques, speeds_rpm
from pmor.machine.readings import bearing_data
from pmor.machine.settings import Bearing
from tests.support.gearboxes import SMALL, fva_box, written

STIFFNESSES = "radial_N_per_mm", "axial_N_per_mm", "tilt_Nmm_per_rad", "torsion_Nmm_per_rad"
# The middle shaft turns against the input.
CARRIED_NM = -500.0 * 51 / 27
# Round-off of the equations of the whole box, whose springs differ by 1e11, of the largest displacement.
ROUND_OFF = 1e-5


def cut(sections, place, **joint):
    """The two-stage box with its middle shaft in two, joined at a place between its gears."""
    (shaft,) = (one for one in sections.shafts if one.name == "mid")
    first, second, third = shaft.sections
    left = replace(shaft, sections=(first, second, replace(third, length_mm=place - 105.0)))
    right = replace(shaft, name="right", start_mm=shaft.start_mm + place,
                    sections=(replace(third, length_mm=270.0 - place),))  # fmt: skip

    def moved(one):
        return replace(one, shaft="right", at_mm=one.at_mm - place) if one.shaft == "mid" and one.at_mm > place else one

    return replace(
        sections, shafts=(sections.shafts[0], left, right, sections.shafts[2]),
        bearings=(*map(moved, sections.bearings), Bearing(name="joint", shaft="mid", to="right", at_mm=place, **joint)),
        meshes=tuple(replace(mesh, pinion=moved(mesh.pinion), wheel=moved(mesh.wheel)) for mesh in sections.meshes),
    )  # fmt: skip


def solved(model):
    gearbox = loaded(model, model.sections.loads[0])
    return gearbox, gearbox.solve()


def test_a_shaft_that_is_cut_and_joined_again_bends_twists_and_turns_as_before():
    whole = fva_box(5e5, 5e5, 1e8).model
    parted = replace(whole, sections=cut(whole.sections, 130.0, **dict.fromkeys(STIFFNESSES, "rigid")))
    (one, first), (two, second) = solved(whole), solved(parted)
    for mesh, other in zip(one.meshes, two.meshes, strict=True):
        for hub, there in zip(mesh.hubs, other.hubs, strict=True):
            assert_allclose(second.displacement[there : there + 6], first.displacement[hub : hub + 6],
                            atol=ROUND_OFF * np.abs(first.displacement).max())  # fmt: skip
    load = replace(parted.sections.loads[0], speed_rpm=900.0)
    assert pinion_torques(parted, load) == pytest.approx(pinion_torques(whole, load))
    assert speeds_rpm(parted, load)["right"] == pytest.approx(speeds_rpm(whole, load)["mid"])
    entry = bearing_data(type("Solved", (), {"gearbox": two, "equilibrium": second}))[-1]
    assert entry["torque_Nm"] == pytest.approx(CARRIED_NM, rel=1e-6)


def test_a_coupling_of_a_torsional_stiffness_twists_by_the_torque_over_it():
    whole = fva_box(5e5, 5e5, 1e8).model
    joint = dict.fromkeys(STIFFNESSES, "rigid")
    gearbox, stiff = solved(replace(whole, sections=cut(whole.sections, 130.0, **joint)))
    _, soft = solved(replace(whole, sections=cut(whole.sections, 130.0, **joint | {"torsion_Nmm_per_rad": 1e7})))
    row = gearbox.bearings[-1].rows[3]
    assert abs(row @ stiff.displacement) < 1e-9
    assert row @ soft.displacement == pytest.approx(1e3 * CARRIED_NM / 1e7, rel=1e-6)


@pytest.mark.parametrize(("keys", "words"), [
    ('torsion_Nmm_per_rad = "rigid"\n', 'couples two shafts: name the other one in to, or write torque_Nm = "balance"'),
    ('torsion_Nmm_per_rad = 1e6\nball = { balls = 9, ball_diameter_mm = 9.0, pitch_diameter_mm = 44.0 }\n',
     "a bearing has one kind"),
], ids=["to the housing", "with balls"])  # fmt: skip
def test_what_is_no_coupling_is_refused(tmp_path, keys, words):
    plain = SMALL.replace("axial_N_per_mm = 1e5\nradial_N_per_mm = 2e5\n", "", 1)
    with pytest.raises(CaseError, match=words):
        load(written(tmp_path, plain.replace("at_mm = 10.0\n", f"at_mm = 10.0\n{keys}", 1)))
