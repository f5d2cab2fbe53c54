"""A pair's working geometry is checked as it stands, whichever way its axes come in."""

from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest

import pmor
from pmor.app.cli import main
from pmor.campaigns.loader import load
from pmor.campaigns.run import task_of
from pmor.campaigns.solve import row_of
from pmor.campaigns.table import designs_of
from pmor.case import parse_case
from pmor.core.errors import GeometryError
from pmor.gear.clearance import refuse_working_geometry, section_distance
from pmor.gear.condition import Misalignment
from pmor.gear.pair import GearPair, zero_backlash_centre_distance
from pmor.gear.tooth import Tooth
from pmor.pair.model import gear_pair
from pmor.storage.gear_store import Store
from tests.support.small_case import case_text
from tests.support.small_design import DESIGN

# Axes out of place, of teeth of a module, and why they do not mesh.
AXES = {
    "jammed": (4.0, {"centre_distance_um": -900.0}, "the teeth jam below"),
    "jammed at a face": (4.0, {"in_plane_um": 1000.0}, "the teeth jam below"),
    "too far apart": (0.5, {"centre_distance_um": 900.0}, "contact ratio 0.132 is below 1"),
    "out of reach": (0.5, {"centre_distance_um": 1000.0}, "tips do not reach the mate's flank"),
}
GEARBOX = Path(__file__).parents[2] / "cases" / "gearbox.rexs"


def spur_pair(module):
    tooth = Tooth(21, module, 0.3490658503988659)
    return GearPair(tooth, tooth, 20.0, zero_backlash_centre_distance(tooth, tooth))


def sections_of(module, **changes):
    """Sections of the small case in line contact, with teeth of a module."""
    torque = 25.0 * module
    scaled = {"pair": {"module_mm": module}, "pinion": {"bore_radius_mm": 5.0 * module}, "load": {"torque_Nm": torque},
              "compare": {"torques_Nm": [torque]}, "online": {"torques_Nm": [torque]}}  # fmt: skip
    mesh = {"profile_elements": 5, "width_elements": 2, "width": "whole"}
    return {**scaled, "mesh": mesh, "contact": {"scheme": "line"}, "reduction": None, "offline": None} | changes


def deviated(module, **axes):
    """The small case with teeth of a module and a section [misalignment]."""
    return case_text(**sections_of(module, misalignment=axes))


@cache
def solved(module):
    return pmor.train(parse_case(deviated(module), "small", "small case")).basis


def model_of(module, axes=None):
    """A reduced model, of a case whose axes are out of place."""
    basis = solved(module)
    return pmor.ReducedModel(replace(basis, case=replace(basis.case, misalignment=Misalignment(**axes or {}))))


# --- the check -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("module", "axes", "reason"), [*AXES.values(), (4.0, {"centre_distance_um": float("nan")}, "tips do not reach")]
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


def by_section(tmp_path, module, axes):
    gear_pair(parse_case(deviated(module, **axes), "small", "small case"))


def by_keywords(tmp_path, module, axes):
    pmor.full_model(pmor.change_case(parse_case(deviated(module), "small", "small case"), misalignment=axes))


def by_condition(tmp_path, module, axes):
    keys = "\n".join(f"{name} = {value}" for name, value in axes.items())
    text = deviated(module) + f'\n[[condition]]\nname = "out of place"\n{keys}\n'
    gear_pair(parse_case(text, "small", "small case"))


def by_training(tmp_path, module, axes):
    trained = {"contact": {"scheme": "direct"}, "offline": {name: [value, 0.0] for name, value in axes.items()}}
    gear_pair(parse_case(case_text(**sections_of(module, **trained)), "small", "small case"))


def by_sweep(tmp_path, module, axes):
    model_of(module).sweep([10.0], 4, misalignment=Misalignment(**axes))


def by_root_stress(tmp_path, module, axes):
    model_of(module).root_stress([10.0], 4, misalignment=Misalignment(**axes))


def by_assembly(tmp_path, module, axes):
    model_of(module).sweep_conditions([pmor.Assembly(Misalignment(**axes))], [10.0], 4)


def by_harris_map(tmp_path, module, axes):
    model_of(module, axes).harris_map([10.0], 4)


def by_report(tmp_path, module, axes):
    model_of(module, axes).report(tmp_path / "out", compare=False)


def by_export_to_fmu(tmp_path, module, axes):
    model_of(module, axes).export(tmp_path / "out", "fmu")


def by_export_to_rexs(tmp_path, module, axes):
    model_of(module, axes).export(tmp_path / "out", "rexs")


def by_export_to_csv(tmp_path, module, axes):
    model_of(module, axes).export(tmp_path / "out", "csv")


def by_design(tmp_path, module, axes):
    (tmp_path / "small.toml").write_text(deviated(module, **axes))
    (tmp_path / "relief.toml").write_text(DESIGN)
    pmor.run_design(tmp_path / "relief.toml", tmp_path / "out")


def by_design_of_a_model(tmp_path, module, axes):
    ranges = {"tip_relief_um": [0.0, 9.0], "tip_relief_start_roll_deg": [25.0, 30.0]}
    model_of(module, axes).design(variables=[{"key": key, "range": values} for key, values in ranges.items()])


def by_scatter(tmp_path, module, axes):
    (tmp_path / "small.toml").write_text(deviated(module))
    scatter = "\n".join(f"{name} = {min(abs(value), 200.0)}" for name, value in axes.items())
    (tmp_path / "relief.toml").write_text(DESIGN + f"[scatter]\n{scatter}\ndraws = 64\n")
    pmor.run_design(tmp_path / "relief.toml", tmp_path / "out")


def by_motion(tmp_path, module, axes):
    case = parse_case(deviated(module), "small", "small case")
    pmor.run_dynamics(replace(case, misalignment=Misalignment(**axes)), tmp_path / "out")


def by_motion_of_a_model(tmp_path, module, axes):
    model_of(module, axes).dynamics(torques_Nm=[10.0], run_cycles=0)


def by_campaign(tmp_path, module, axes):
    """A design that cannot be made is a row with the reason."""
    (tmp_path / "small.toml").write_text(deviated(module))
    keys = "\n".join(f"misalignment.{name} = [{value}, 0.0]" for name, value in axes.items())
    (tmp_path / "many.toml").write_text(f'case = "small.toml"\n[designs]\nmethod = "grid"\n{keys}\n')
    campaign = load(tmp_path / "many.toml")
    store = Store(tmp_path / "store", 0.0)
    row = row_of(task_of(campaign, store), 1, designs_of(campaign)(0), store)
    assert row["status"] == "infeasible"
    assert set(row["results"].values()) == {None}
    raise GeometryError(row["reason"])


WAYS = (
    by_section, by_keywords, by_condition, by_training, by_sweep, by_root_stress, by_assembly, by_harris_map, by_report,
    by_export_to_fmu, by_export_to_rexs, by_export_to_csv, by_design, by_design_of_a_model, by_scatter, by_motion,
    by_motion_of_a_model, by_campaign,
)  # fmt: skip


@pytest.mark.parametrize("name", AXES)
@pytest.mark.parametrize("way", WAYS, ids=lambda way: way.__name__)
def test_every_way_in_refuses_axes_on_which_a_pair_does_not_mesh(way, name, tmp_path):
    module, axes, reason = AXES[name]
    if way is by_scatter:  # draws lie on both sides of the drawing
        reason = "jam|below 1|do not reach"
    with pytest.raises(GeometryError, match=reason):
        way(tmp_path, module, axes)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("distance", "words"), [("95.5", "contact ratio 0.588 is below 1"), ("99", "tip circles touch"),
                            ("1e9", "must be between")]
)  # fmt: skip
def test_a_gearbox_whose_gears_do_not_mesh_at_its_centre_distance_is_refused_by_its_name(distance, words, tmp_path):
    told, said = (f'"center_distance" unit="mm">{value}<' for value in (distance, "91.5"))
    text = GEARBOX.read_text()
    assert said in text
    (tmp_path / "gears.rexs").write_text(text.replace(said, told))
    with pytest.raises(pmor.PmorError, match=f"gears.rexs: .*{words}"):
        pmor.import_rexs(tmp_path / "gears.rexs")


@pytest.mark.parametrize("distance", ["60", "-91.5"])
@pytest.mark.parametrize("placed", [True, False])
def test_gears_that_jam_at_their_centre_distance_stand_at_that_of_their_axes_or_without_backlash_and_say_so(
    distance, placed, tmp_path, caplog
):
    text = GEARBOX.read_text().replace('"center_distance" unit="mm">91.5<', f'"center_distance" unit="mm">{distance}<')
    (tmp_path / "gears.rexs").write_text(text if placed else text.replace('id="support_vector"', 'id="part_number"'))
    with caplog.at_level("INFO", logger="pmor"):
        case = pmor.import_rexs(tmp_path / "gears.rexs")
    assert f"center_distance = {distance} mm: too small for the profile shifts 0.3 and 0.2" in caplog.text
    assert ("that of the axes taken, 91.5 mm" in caplog.text) == placed
    assert case.pair.centre_distance_mm == (91.5 if placed else None)
    assert (gear_pair(case).backlash > 0.0) == placed


TRAINED = {"lab stability", "lab reductions"}  # Of penalty contact


@pytest.mark.parametrize("command", ["run", "plan", "compare", "lab convergence", "dynamics", *sorted(TRAINED)])
def test_commands_refuse_them_in_one_line_and_leave_nothing(command, tmp_path, capsys):
    path, out = tmp_path / "near.toml", tmp_path / "out"
    module, axes, reason = AXES["jammed"]
    trained = case_text(offline={"centre_distance_um": [axes["centre_distance_um"], 0.0]})
    path.write_text(trained if command in TRAINED else deviated(module, **axes))
    folder = [] if command == "plan" else ["--out", str(out)]
    assert main([*command.split(), str(path), *folder]) == 2
    error = capsys.readouterr().err
    assert reason in error
    assert error.count("\n") == 1
    assert not out.exists()


@pytest.mark.parametrize(
    ("allowance_mm", "nearer_um", "jams"), [(0.0, 50.0, False), (-0.01, 50.0, True), (-0.2, 250.0, False)]
)
def test_teeth_whose_allowances_are_given_have_no_other_backlash_to_use_up(allowance_mm, nearer_um, jams):
    gears = [Tooth(z, 4.0, 0.3490658503988659, thickness_allowance=allowance_mm) for z in (21, 33)]
    pair = GearPair(*gears, 20.0, zero_backlash_centre_distance(*gears))
    misalignment = Misalignment(centre_distance_um=-nearer_um)
    if jams:
        with pytest.raises(GeometryError, match="the teeth jam"):
            refuse_working_geometry(pair, [misalignment])
    else:
        refuse_working_geometry(pair, [misalignment])
