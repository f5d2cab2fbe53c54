"""A pair's working geometry is checked as it stands, whichever way its axes come in."""

from dataclasses import replace

import pytest

import pmor
from pmor.app.cli import main
from pmor.case import parse_case
from pmor.core.errors import GeometryError
from pmor.gear.condition import Misalignment
from pmor.gear.pair import GearPair, zero_backlash_centre_distance
from pmor.gear.tooth import Tooth
from pmor.gear.working import refuse_working_geometry, section_distance
from pmor.pair.model import gear_pair
from tests.support.line_pairs import small_pair
from tests.support.small_case import case_text
from tests.support.small_design import CASE, DESIGN

JAMMED, APART = -900.0, 900.0
REASONS = {JAMMED: "the teeth jam below", APART: "contact ratio 0.132 is below 1"}


def spur_pair(module):
    tooth = Tooth(21, module, 0.3490658503988659)
    return GearPair(tooth, tooth, 20.0, zero_backlash_centre_distance(tooth, tooth))


def deviated(**axes):
    """The small case in line contact with a section [misalignment]."""
    return case_text(contact={"scheme": "line"}, reduction=None, misalignment=axes)


# --- the check -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("module", "axes", "reason"),
    [
        (4.0, {"centre_distance_um": JAMMED}, "the teeth jam below"),
        (4.0, {"in_plane_um": 1000.0}, "the teeth jam below"),
        (0.5, {"centre_distance_um": 900.0}, "contact ratio 0.132 is below 1"),
        (0.5, {"centre_distance_um": 1000.0}, "tips do not reach the mate's flank"),
        (4.0, {"centre_distance_um": float("nan")}, "tips do not reach"),
    ],
)
def test_axes_on_which_a_pair_does_not_mesh_are_refused_with_the_reason(module, axes, reason):
    with pytest.raises(GeometryError, match=reason) as caught:
        refuse_working_geometry(spur_pair(module), [Misalignment(**axes)])
    ((name, value),) = axes.items()
    assert f"{name} = {value:g}" in str(caught.value)


def test_teeth_use_up_the_allowances_of_their_thickness_before_they_jam():
    """ISO/TR 10064-2 for m = 4, a = 84: j_bn = 0.148 mm, so 216 um of centre distance at 20 deg."""
    refuse_working_geometry(spur_pair(4.0), [Misalignment(centre_distance_um=-215.0)])
    with pytest.raises(GeometryError, match="jam"):
        refuse_working_geometry(spur_pair(4.0), [Misalignment(centre_distance_um=-218.0)])


def test_an_axis_that_is_tilted_in_its_plane_is_farther_at_one_face_and_nearer_at_the_other():
    pair, tilted = spur_pair(4.0), Misalignment(in_plane_um=200.0, centre_distance_um=50.0)
    distances = [section_distance(pair, tilted, z) for z in (-10.0, 0.0, 10.0)]
    assert distances == pytest.approx([83.95, 84.05, 84.15], abs=1e-12)


# --- all ways in ----------------------------------------------------------------------------------------------------


def by_section(tmp_path):
    gear_pair(parse_case(deviated(centre_distance_um=JAMMED), "small", "small case"))


def by_condition(tmp_path):
    text = deviated() + f'\n[[condition]]\nname = "near"\ncentre_distance_um = {JAMMED}\n'
    gear_pair(parse_case(text, "small", "small case"))


def by_training(tmp_path):
    text = case_text(offline={"centre_distance_um": [JAMMED, 0.0]})
    gear_pair(parse_case(text, "small", "small case"))


def by_sweep(tmp_path):
    pmor.ReducedModel(small_pair().basis).sweep([100.0], 4, misalignment=Misalignment(centre_distance_um=JAMMED))


def by_assembly(tmp_path):
    model = pmor.ReducedModel(small_pair().basis)
    model.sweep_conditions([pmor.Assembly(Misalignment(centre_distance_um=JAMMED))], [100.0], 4)


def by_scatter(tmp_path):
    (tmp_path / "small.toml").write_text(CASE)
    (tmp_path / "relief.toml").write_text(DESIGN + "[scatter]\ncentre_distance_um = 200.0\ndraws = 64\n")
    pmor.run_design(tmp_path / "relief.toml", tmp_path / "out")


def by_motion(tmp_path):
    case = parse_case(deviated(), "small", "small case")
    pmor.run_dynamics(replace(case, misalignment=Misalignment(centre_distance_um=JAMMED)), tmp_path / "out")


WAYS = by_section, by_condition, by_training, by_sweep, by_assembly, by_scatter, by_motion


@pytest.mark.parametrize("way", WAYS, ids=lambda way: way.__name__)
def test_every_way_in_refuses_axes_on_which_the_teeth_jam(way, tmp_path):
    with pytest.raises(GeometryError, match=REASONS[JAMMED]):
        way(tmp_path)
    assert not (tmp_path / "out").exists()


TRAINED = {"stability", "reductions"}  # Of penalty contact


@pytest.mark.parametrize("command", ["run", "plan", "compare", "convergence", "dynamics", *sorted(TRAINED)])
def test_commands_refuse_them_in_one_line_and_leave_nothing(command, tmp_path, capsys):
    path, out = tmp_path / "near.toml", tmp_path / "out"
    trained = case_text(offline={"centre_distance_um": [JAMMED, 0.0]})
    path.write_text(trained if command in TRAINED else deviated(centre_distance_um=JAMMED))
    folder = [] if command == "plan" else ["--out", str(out)]
    assert main([command, str(path), *folder]) == 2
    error = capsys.readouterr().err
    assert REASONS[JAMMED] in error
    assert error.count("\n") == 1
    assert not out.exists()
