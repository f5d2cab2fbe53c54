"""Slips of the first hours in Python: each is refused in one line that says what to type."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import pmor

BASE = {
    "teeth": 21, "bore_radius_mm": 20.0, "module_mm": 4.0, "face_width_mm": 20.0, "torque_Nm": 100.0,
    "mesh": {"profile_elements": 4, "width_elements": 2, "error_bar": False}, "online": {"angles_per_pitch": 4},
}  # fmt: skip
RELIEF = {"tip_relief_um": 20.0, "tip_relief_start_roll_deg": 25.0}
SLIPS = {
    "a torque for torques": (lambda case, model: model.sweep(torque_Nm=100), "did you mean torques_Nm?"),
    "angles in degrees": (lambda case, model: model.sweep(100, [0, 5, 10, 15]), "write angles=numpy.radians(angles)"),
    "a number of angles with a point": (lambda case, model: model.sweep(100, angles=200.0), "write 200"),
    "a flank that is a built pair": (
        lambda case, model: model.sweep(pinion=pmor.Assembly()), "must be a Modification: write Modification(tip_",
    ),
    "a flank as a mapping": (lambda case, model: model.sweep(pinion=RELIEF), "write Modification(tip_relief_um=20.0, "),
    "a tilt as a number": (lambda case, model: model.sweep(misalignment=5), "write Misalignment(in_plane_um=...)"),
    "a modification of no gear": (
        lambda case, model: model.sweep_conditions([pmor.Modification(**RELIEF)]),
        "write Assembly(pinion=m), Assembly(wheel=m) or, of both gears, Assembly(pinion=m, wheel=m)",
    ),
    "an amount without its unit": (lambda case, model: pmor.Modification(tip_relief=20), "did you mean tip_relief_um?"),
    "a misspelt key": (lambda case, model: pmor.make_case(**BASE, modul_mm=4), "did you mean module_mm?"),
    "a part of a key": (lambda case, model: pmor.change_case(case, pair={"helix": 8}), "did you mean helix_angle_deg?"),
    "a misspelt section": (lambda case, model: pmor.make_case(**BASE, pinions={}), "did you mean pinion?"),
    "a value for a section": (
        lambda case, model: pmor.make_case(**(BASE | {"mesh": 8})), "write mesh={'profile_elements': ...}",
    ),
    "a missing key": (lambda case, model: pmor.make_case(teeth=21), "pass torque_Nm=..."),
    "a key of both gears": (
        lambda case, model: pmor.change_case(case, tip_relief_um=5),
        "write pinion={'modification': {'tip_relief_um': ...}} or wheel={",
    ),
    "radians": (lambda case, model: pmor.change_case(case, pressure_angle_deg=0.349), "write 20.0"),
    "a number for a switch": (lambda case, model: pmor.change_case(case, root_stress=1), "must be True or False"),
    "a rule on two sections": (
        lambda case, model: pmor.change_case(case, shapes="pod"),
        "write shapes=\"line_loads\", or a penalty scheme such as contact={'scheme': \"direct\"}",
    ),
    "a file that is there": (lambda case, model: model.save(__file__), "pass overwrite=True"),
    "a file for its case": (lambda case, model: pmor.train("pair.toml"), "pass pmor.load_case('pair.toml')"),
    "a file for its model": (lambda case, model: pmor.compare(Path("a.h5")), "pass pmor.load_model('a.h5')"),
    "a list for a file": (lambda case, model: pmor.load_case(["pair.toml"]), "takes the name of a file: write it"),
    "bytes for a file": (lambda case, model: pmor.info(b"a.h5"), "takes the name of a file: write it as text"),
    "a number for a file": (lambda case, model: pmor.run(3), "takes the name of a file, or what its reader"),
    "nothing for a case": (lambda case, model: pmor.train(None), "takes a case: pass pmor.load_case(...)"),
    "a name that no file has": (lambda case, model: pmor.load_model("a\0b"), "holds a null byte: check the path"),
    "one mapping for a list": (
        lambda case, model: model.design(variables={"key": "tip_relief_um", "range": [0, 9]}),
        "pass variables=[{...}, ...]",
    ),
    "a setting of another name": (lambda case, model: model.dynamics(damping=0.1), "did you mean damping_ratio"),
}  # fmt: skip


@pytest.fixture(scope="module")
def case():
    return pmor.make_case("small", **BASE)


@pytest.fixture(scope="module")
def model(case):
    return pmor.train(case)


@pytest.mark.parametrize(("slip", "typed"), SLIPS.values(), ids=SLIPS)
def test_a_slip_is_refused_with_what_to_type(slip, typed, case, model):
    with pytest.raises((pmor.PmorError, TypeError), match=re.escape(typed)) as refused:
        slip(case, model)
    message = str(refused.value)
    assert "\n" not in message
    assert not re.search(r" --\w|\[\w+\] \w+|\b(true|false)\b", message), "options and sections are no Python"
