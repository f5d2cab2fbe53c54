"""Rolling bearings on the shafts of a gearbox: rows, preload and life where the machine is in equilibrium; no FE."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.core.errors import ConvergenceError, GeometryError
from pmor.machine.loaded import loaded
from pmor.machine.loader import load
from pmor.machine.model import speeds_rpm
from pmor.machine.readings import carried, turning
from tests.support.gearboxes import SMALL, written

BALLS, ROLLERS = (line for line in SMALL.splitlines() if line.startswith(("ball", "roller")))
SPHERE = (
    "spherical_roller = { rollers = 16, roller_diameter_mm = 6.0, effective_length_mm = 5.0, pitch_diameter_mm = 44.0, "
    "contact_angle_deg = 12.0 }"
)
CONES = (
    "roller = { rollers = 14, roller_diameter_mm = 6.0, effective_length_mm = 9.0, pitch_diameter_mm = 44.0, "
    'contact_angle_deg = 14.0, rows = 2, row_spacing_mm = 14.0, arrangement = "back_to_back", axial_preload_N = 400.0 }'
)
SPEED = ("[[loads]]\n", "[[loads]]\nspeed_rpm = 1500.0\n")


def solved(folder, *changes):
    text = SMALL
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    model = load(written(folder, text)).model
    gearbox = loaded(model, model.sections.loads[0])
    found = carried(gearbox, gearbox.solve(), speeds_rpm(model, model.sections.loads[0]))
    return {one["name"]: one for one in found}


def test_rows_add_up_to_what_a_bearing_carries_and_bearings_to_the_force_of_the_mesh(tmp_path):
    """A pair of cones holds thrust; the spherical roller bearing beside it takes its shaft's slope without a moment."""
    found = solved(tmp_path, (BALLS, CONES), (ROLLERS, SPHERE), SPEED)
    for name in ("C", "D"):
        rows = np.array([row["force_N"] for row in found[name]["rows"]])
        assert rows.shape == (2, 3)
        assert_allclose(rows.sum(axis=0), found[name]["force_N"], atol=1e-6)
    on_output = np.array(found["C"]["force_N"]) + found["D"]["force_N"]
    on_input = np.array(found["A"]["force_N"]) + found["B"]["force_N"]
    assert_allclose(on_output, -on_input, atol=1e-6)
    assert np.abs(found["D"]["tilt_mrad"]).max() > 1e-3
    assert found["D"]["moment_Nmm"] == [0.0, 0.0]
    assert np.abs(found["C"]["moment_Nmm"]).max() > 10.0


@pytest.mark.parametrize(("angle", "way"), [(14.0, "negative"), (-14.0, "positive")])
def test_cones_that_all_take_thrust_one_way_let_their_shaft_go_the_other_way(tmp_path, angle, way):
    one_way = CONES[: CONES.index(", rows")].replace("14.0", f"{angle}") + " }"
    with pytest.raises(ConvergenceError, match=f"shaft output, at .* along x: nothing holds it in {way} direction"):
        solved(tmp_path, (BALLS, one_way), (ROLLERS, one_way))


def test_a_preload_stiffens_cones_and_goes_on_both_rows(tmp_path):
    """Both rows carry their preload along the axis, less and more of what the mesh pushes."""
    found, loose = (
        solved(tmp_path, (BALLS, CONES.replace("400.0", force)), (ROLLERS, SPHERE))["C"] for force in ("400.0", "1.0")
    )
    along = [row["force_N"][0] for row in found["rows"]]
    assert along[0] > 0.0 > along[1]
    assert np.abs(found["displacement_um"]).max() < np.abs(loose["displacement_um"]).max()
    assert min(map(abs, along)) > 0.1 * 400.0


def test_a_shaft_on_a_spherical_roller_bearing_alone_tips_over(tmp_path):
    with pytest.raises(GeometryError, match="nothing holds it"):
        solved(tmp_path, (BALLS, SPHERE), ('[[bearings]]\nname = "D"\nshaft = "output"\nat_mm = 70.0\n' + ROLLERS, ""))


def test_life_in_hours_is_that_in_turns_by_the_speed_of_both_rings(tmp_path):
    found, still = solved(tmp_path, SPEED), solved(tmp_path)
    speed = 1500.0 * 19.0 / 29.0
    for name in ("C", "D"):
        assert found[name]["bearing_rpm"] == pytest.approx(-speed)
        life = found[name]["reference_life_1e6"]
        assert found[name]["reference_life_h"] == pytest.approx(1e6 * life / (60.0 * speed))
        assert still[name]["reference_life_1e6"] == pytest.approx(life)
        assert still[name]["reference_life_h"] is None
    rating = solved(tmp_path, SPEED, (ROLLERS, ROLLERS.replace(" }", ", dynamic_rating_N = 5e3 }")))["D"]
    assert rating["dynamic_rating_N"] == 5e3
    assert_allclose(
        rating["reference_life_1e6"] / found["D"]["reference_life_1e6"], (5e3 / found["D"]["dynamic_rating_N"]) ** 4
    )


def test_rings_turn_against_loads_of_the_housing(tmp_path):
    """Of a bearing between two shafts each by its own speed."""
    model = load(written(tmp_path, SMALL)).model
    to_housing, other = (b for b in model.sections.bearings if b.name in "AC")
    assert turning(to_housing, {"input": 1500.0}) == ((True, False), 1500.0)
    assert turning(to_housing, {}) == ((True, False), None)
    between = type(other)(name="E", shaft="input", to="output", at_mm=0.0)
    assert turning(between, {"input": 1500.0, "output": -500.0}) == ((True, True), 2000.0)
    assert turning(between, {"input": 0.0, "output": -500.0}) == ((False, True), 500.0)
    assert math.isclose(turning(between, {"input": 300.0, "output": 300.0})[1], 0.0)
