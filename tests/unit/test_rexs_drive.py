"""Torque and speed of a REXS gearbox follow from what its file says in another way: power, couplings, fits."""

import math

import pytest

from pmor.rexs.drive import drives, shaft_speeds
from pmor.rexs.joints import is_engaged, shafts_of
from pmor.rexs.stage import find_stage
from tests.support.rexs_file import made, part

# 100 kW at 1,500 rpm, N m.
TORQUE = 1e5 / (2.0 * math.pi * 25.0)


def chain(first, second, joint="coupling", gears=(20.0, 50.0), **words):
    """A motor's shaft 1, joined to shaft 2 with a pinion, which drives shaft 3; loads of the motor and of shaft 3."""
    return made(
        [part(1, "shaft", rotational_speed=1500.0), part(2, "shaft"), part(3, "shaft"), part(20, joint, **words),
         *(part(10 + i, "cylindrical_gear", number_of_teeth=teeth) for i, teeth in enumerate(gears)),
         part(30, "cylindrical_stage"), part(40, "external_load", **first), part(41, "external_load", **second)],
        ("assembly", {"assembly": 1, "part": 40}), ("assembly", {"assembly": 3, "part": 41}),
        ("assembly", {"assembly": 2, "part": 10}), ("assembly", {"assembly": 3, "part": 11}),
        ("side", {"assembly": 20, "inner_part": 1, "outer_part": 2}),
        ("stage", {"stage": 30, "gear_1": 10, "gear_2": 11}),
    )  # fmt: skip


@pytest.mark.parametrize("joint", ["coupling", "switchable_coupling", "feather_key_connection"])
def test_power_over_speed_is_a_torque_that_joints_between_shafts_carry(joint):
    assert TORQUE == pytest.approx(636.6198, rel=1e-6)
    found = find_stage(chain({"power": 100.0, "defines_torque": "true"}, {}, joint), 30, "made")
    assert found.torques_Nm == (pytest.approx(TORQUE),)
    assert found.pinion.number == 10
    assert any("636.62 N m of 100 kW at 1500 rpm" in note for note in found.notes)


def test_a_coupling_that_is_not_engaged_carries_none():
    words = {"is_engaged": ["false", "true"]}
    assert find_stage(chain({"power": 100.0}, {}, "switchable_coupling", **words), 30, "made").torques_Nm == ()
    box = chain({"power": 100.0}, {}, "switchable_coupling", **words)
    box.components[50] = part(50, "gear_unit", gear_shift_index=2.0)
    assert is_engaged(box, box.components[20])
    assert find_stage(box, 30, "made").torques_Nm == (pytest.approx(TORQUE),)


@pytest.mark.parametrize("power", [-250.0, 250.0])
def test_speeds_follow_through_couplings_and_meshes_and_power_has_their_sign(power):
    box = chain({}, {"power": power})
    assert shaft_speeds(box, {}) == pytest.approx({1: 1500.0, 2: 1500.0, 3: -600.0})
    (one,) = (one for one in drives(box, {}) if one.torque_Nm)
    assert one.torque_Nm == pytest.approx(-power * 1e3 * 60.0 / (2.0 * math.pi * 600.0))
    still = chain({}, {"power": power})
    del still.components[1].values["rotational_speed"]
    assert [one.torque_Nm for one in drives(still, {})] == [None, None]
    assert any("no rotational_speed: no torque follows" in one.note for one in drives(still, {}))


@pytest.mark.parametrize(("first", "second", "given"), [
    ({"torque_around_u_axis": 90.0, "defines_torque": "true"}, {"torque_around_u_axis": 225.0}, [90.0, None]),
    ({"torque_around_u_axis": 90.0}, {"torque_around_u_axis": 225.0, "defines_torque": "true"}, [None, 225.0]),
    ({"torque_around_u_axis": 90.0}, {"torque_around_u_axis": 225.0}, [90.0, None]),
    ({"torque_around_u_axis": 90.0}, {}, [90.0, None]),
    ({"torque_around_u_axis": 0.0, "defines_torque": "true"}, {}, [0.0, None]),
    ({"torque_around_u_axis": 0.0}, {"torque_around_u_axis": 225.0}, [None, 225.0]),
], ids=["input", "output", "neither", "one", "none on purpose", "zero"])  # fmt: skip
def test_a_torque_that_is_a_result_is_not_a_second_load(first, second, given):
    found = drives(chain(first, second), {})
    assert [one.torque_Nm for one in found] == given
    results = [load.get("torque_around_u_axis") or None for load in (first, second)]
    assert [one.result_Nm for one in found] == [None if torque is not None else result
                                                for torque, result in zip(given, results, strict=True)]  # fmt: skip


def test_a_load_case_goes_before_what_holds_for_all_of_them():
    box = chain({"torque_around_u_axis": 90.0}, {})
    case = {40: part(40, "external_load", power=100.0), 1: part(1, "shaft", rotational_speed=3000.0)}
    assert [one.torque_Nm for one in drives(box, case)] == [pytest.approx(0.5 * TORQUE), None]


@pytest.mark.parametrize("fit", [
    "cylindrical_interference_fit", "feather_key_connection", "involute_spline_connection", "tapered_interference_fit",
])  # fmt: skip
def test_a_gear_by_a_fit_is_on_its_shaft(fit):
    box = made([part(1, "shaft"), part(10, "cylindrical_gear"), part(20, fit)],
               ("side", {"assembly": 20, "inner_part": 1, "outer_part": 10}))  # fmt: skip
    assert [shaft.number for shaft in shafts_of(box, box.components[10])] == [1]


def test_the_carrier_of_a_planetary_stage_turns_as_by_willis():
    """Sun 20, planet 25, ring 70 that the casing holds: 1 + 70 / 20."""
    box = made(
        [part(1, "shaft", rotational_speed=900.0), part(2, "shaft"), part(3, "shaft"), part(4, "shaft"),
         part(9, "gear_casing"), part(20, "coupling"), part(50, "planetary_stage"),
         *(part(10 + i, kind, number_of_teeth=teeth)
           for i, (kind, teeth) in enumerate((("cylindrical_gear", 20.0), ("cylindrical_gear", 25.0),
                                              ("ring_gear", 70.0)))),
         part(30, "cylindrical_stage"), part(31, "cylindrical_stage")],
        *(("assembly", {"assembly": 1 + i, "part": 10 + i}) for i in range(3)),
        *(("assembly", {"assembly": 50, "part": 30 + i}) for i in range(2)),
        ("planet_carrier_shaft", {"planetary_stage": 50, "shaft": 4}),
        ("side", {"assembly": 20, "inner_part": 3, "outer_part": 9}),
        ("stage", {"stage": 30, "gear_1": 10, "gear_2": 11}), ("stage", {"stage": 31, "gear_1": 11, "gear_2": 12}),
    )  # fmt: skip
    found = shaft_speeds(box, {})
    assert found[4] == pytest.approx(900.0 / 4.5)
    assert found[3] == 0.0
