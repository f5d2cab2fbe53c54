"""Bearings with clearance that make no sense are refused with a remedy; extreme ones are solved, or said to have no
equilibrium."""

from contextlib import nullcontext

import numpy as np
import pytest

from pmor.core.errors import CaseError, ConvergenceError, GeometryError
from pmor.machine.coupled import solve_load
from pmor.machine.left_out import left_out
from pmor.machine.loaded import loaded
from pmor.machine.loader import load
from pmor.machine.run import run
from pmor.sets.run import train_of
from tests.support.set_gearboxes import TWO_STAGES, bearing, written_reducer
from tests.verification.test_carrier_turn import (
    GRAVITY,
    ON_SPRINGS,
    STIFFNESS,
    carrier_bearing,
    heavy,
    loads_of,
    unbalance,
)  # fmt: skip

LOOSE = {"clearance_mm": 0.05}
SPRING = f"radial_N_per_mm = {STIFFNESS}"
SUN = bearing("A", "sun", 50.0, 1e4)
ROLLER = "roller = { rollers = 15, roller_diameter_mm = 10.0, effective_length_mm = 12.0, pitch_diameter_mm = 60.0 }"


def across(**keys):
    """A load beside the torque."""
    (key, value), *_ = keys.items()
    name, axis = ("moments", "y_Nm") if key == "moment" else ("forces", "x_N")
    one = f'{name} = [{{ shaft = "carrier", at_mm = 40.0, {axis} = {value} }}]\n'
    return heavy(axial_clearance_mm=0.2, **LOOSE).replace("torques = [", one + "torques = [", 1)


def mass(kg):
    return heavy(**LOOSE) + f'[[masses]]\nname = "flywheel"\nshaft = "carrier"\nat_mm = 40.0\nmass_kg = {kg}\n'


@pytest.mark.parametrize(
    ("text", "error", "words"),
    [
        (heavy(clearance_mm=-0.1), CaseError, "raise it"),
        (heavy(clearance_mm="nan"), CaseError, "finite"),
        (heavy(clearance_mm=6.0), CaseError, "lower it"),
        (heavy(**LOOSE).replace(SPRING, 'radial_N_per_mm = "rigid"'), CaseError, "give radial_N_per_mm"),
        (heavy(**LOOSE).replace(SPRING, 'radial_N_per_mm = "free"', 1), CaseError, "give radial_N_per_mm"),
        (heavy(axial_clearance_mm=0.1).replace("= 1e5", '= "free"'), CaseError, "give axial_N_per_mm"),
        (heavy(**LOOSE).replace(f"{SPRING}\naxial_N_per_mm = 1e5", ROLLER, 1), CaseError, "inner geometry"),
        (heavy(**LOOSE).replace(carrier_bearing("C", 55.0, **LOOSE), ""), GeometryError, "add a bearing"),
        (heavy(loads_of("forces", "sun", 10.0, 1.0, 0.0, turns='"yes"')), CaseError, "true or false"),
        (heavy(loads_of("forces", "planet", 10.0, 1.0, 0.0)), CaseError, "no such shaft"),
        (heavy(loads_of("moments", "sun", 61.0, 1.0, 0.0)), CaseError, "lengthen the shaft"),
        (heavy() + unbalance("sun", 10.0, -1.0, 0.0), CaseError, "unbalance_kg_mm"),
        (heavy().replace("speed_rpm = 1000.0", "") + unbalance("sun", 10.0, 5.0, 0.0), CaseError, "add speed_rpm"),
    ],
)
def test_clearances_and_loads_that_make_no_sense_are_refused(tmp_path, text, error, words):
    with pytest.raises(error, match=words):
        model = load(written_reducer(tmp_path, text, ON_SPRINGS)).model
        solve_load(model, model.sections.loads[0], {}, 1)


def test_loads_that_no_few_turns_of_a_carrier_bring_back_are_refused_or_left_out(tmp_path):
    on_pinion = loads_of("forces", "out", 20.0, 1.0, 0.0)
    file = load(written_reducer(tmp_path, TWO_STAGES.replace("torques = [", on_pinion + "torques = [")))
    with pytest.raises(CaseError, match="carrier of a set.*those on out do neither"):
        run(file)
    text = TWO_STAGES + unbalance("out", 20.0, 1.0, 0.0) + unbalance("sun", 20.0, 1.0, 0.0).replace("beside", "other")
    file = load(written_reducer(tmp_path, text))
    said = dict(left_out(file))
    assert "does not come back within 20 turns" in said["unbalance of beside, drive"]
    assert "unbalance of other, drive" not in said
    assert [one.shaft for one in loaded(file.model, file.model.sections.loads[0]).turning] == ["sun"]


@pytest.fixture(scope="module")
def train(tmp_path_factory):
    return train_of(load(written_reducer(tmp_path_factory.mktemp("train"), heavy(), ON_SPRINGS)).model.sets["stage"])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "solved"),
    [
        (heavy(**LOOSE).replace("-900.0", "900.0"), True),
        (heavy(**LOOSE).replace(GRAVITY, ""), True),
        (heavy(clearance_mm=1e-15), True),
        (heavy(axial_clearance_mm=1.0), True),
        (heavy(clearance_mm=0.3), True),
        (across(moment=1e3), True),
        (across(force=5e4), True),
        (mass(0.0), True),
        (heavy().replace(SUN, SUN + "clearance_mm = 0.3\n"), True),
        (heavy(loads_of("forces", "sun", 10.0, 0.0, 0.0), **LOOSE), True),
        (heavy(loads_of("forces", "carrier", 40.0, 2e4, 0.0), **LOOSE), True),
        (heavy(**LOOSE) + unbalance("sun", 10.0, 1.0, 10.0), True),
        (heavy().replace("speed_rpm = 1000.0", "speed_rpm = 0.0") + unbalance("sun", 10.0, 1e9, 0.0), True),
        (heavy(loads_of("forces", "carrier", 40.0, 1e9, 0.0), **LOOSE), False),
        (heavy(**LOOSE) + unbalance("sun", 10.0, 1e9, 0.0), False),
        (across(moment=1e6), False),
        (mass(1e6), False),
        (heavy(clearance_mm=5.0), False),
    ],
)
def test_extreme_clearances_and_loads_are_solved_or_have_no_equilibrium(tmp_path, train, text, solved):
    model = load(written_reducer(tmp_path, text, ON_SPRINGS)).model
    said = nullcontext() if solved else pytest.raises(ConvergenceError, match="lower what bends its shafts")
    with said:
        found = solve_load(model, model.sections.loads[0], {}, 4, trains={"stage": train}).sets[0]
        assert found.solution.converged.all()
        assert found.turn is None or (found.turn.converged.all() and np.isfinite(found.turn.bearing_force).all())
