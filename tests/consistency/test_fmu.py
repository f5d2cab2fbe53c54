"""The unit for co-simulation is the force law that it was made from, and says where that ends."""

import dataclasses
import shutil
import zipfile
from functools import cache

import numpy as np
import pytest

import pmor
from pmor.core.errors import CaseError, ConvergenceError
from pmor.dynamics.fmu.law import mesh_law
from pmor.dynamics.fmu.write import write_fmu
from pmor.gear.condition import Assembly, Misalignment
from pmor.pair.conditions import assembly_of
from pmor.pair.model import gear_pair
from pmor_online.mesh_force import mesh_force_of
from tests.support.small_case import case_with

pytestmark = pytest.mark.jit  # thousands of states
COARSE = 1e-3  # of the largest force; a unit's own table is ten times finer, and takes ten times as long


@cache
def small_pair(**pair):
    mesh = {"profile_elements": 5, "width_elements": 2, "width": "whole"}
    case = case_with(
        mesh=mesh, contact={"scheme": "line"}, reduction={"shapes": "line_loads"}, pair=pair,
        **{"pinion.modification": {"tip_relief_um": 10.0, "tip_relief_start_roll_deg": 25.0}},
    )  # fmt: skip
    return pmor.train(case).reduced


@cache
def small_law():
    return mesh_law(small_pair(centre_distance_mm=84.02), tolerance=COARSE)


class Unit:
    """A unit in a folder, simulated by fmpy."""

    def __init__(self, path, folder):
        fmi2 = pytest.importorskip("fmpy.fmi2", reason="units for co-simulation are simulated by fmpy")
        fmpy = pytest.importorskip("fmpy")
        if not shutil.which("cc") and not shutil.which("gcc"):
            pytest.skip("no C compiler: the unit has no binary")
        self.description = fmpy.read_model_description(str(path))
        self.messages = []
        self.number = {v.name: v.valueReference for v in self.description.modelVariables}
        self.unit = fmi2.FMU2Slave(
            guid=self.description.guid, unzipDirectory=fmpy.extract(str(path), str(folder)),
            modelIdentifier=self.description.coSimulation.modelIdentifier, instanceName="mesh",
        )  # fmt: skip
        self.callbacks = fmi2.fmi2CallbackFunctions()
        self.callbacks.logger = fmi2.fmi2CallbackLoggerTYPE(lambda *said: self.messages.append(said[4].decode()))
        self.callbacks.allocateMemory = fmi2.fmi2CallbackAllocateMemoryTYPE(fmi2.calloc)
        self.callbacks.freeMemory = fmi2.fmi2CallbackFreeMemoryTYPE(fmi2.free)
        self.unit.instantiate(callbacks=self.callbacks)
        self.unit.setupExperiment()
        self.unit.enterInitializationMode()
        self.unit.exitInitializationMode()

    def step(self, **inputs):
        self.unit.setReal([self.number[name] for name in inputs], [float(v) for v in inputs.values()])
        self.unit.doStep(0.0, 1e-3)

    def __getitem__(self, name):
        return self.unit.getReal([self.number[name]])[0]

    def at(self, pair, angle, displacement, **axis):
        """Set the gears at a kinematic pinion angle (rad) and a displacement along the line of action (mm)."""
        one, two = pair.pinion.base_radius, pair.wheel.base_radius
        self.step(phi1=angle + displacement / one, phi2=-angle * one / two, **({"axis_x": 0.0, "axis_y": 0.0} | axis))


@pytest.fixture
def unit(tmp_path):
    write_fmu(small_law(), tmp_path / "mesh.fmu")
    return Unit(tmp_path / "mesh.fmu", tmp_path / "unit")


def forces(reduced, angle, displacements, assembly=None):
    force = mesh_force_of(reduced, assembly or assembly_of(reduced.basis.case))
    return force(2.0 * np.pi * angle / reduced.meshed.pair.pitch, displacements)


def largest_difference(unit, law, reduced, rng, places):
    """Force of the unit less that of the law, over the largest one, at places drawn over its whole range."""
    pair, found = law.pair, []
    for _ in range(places):
        angle = rng.uniform(-50.0, 50.0) * pair.pitch
        x = law.table.low + (law.table.high - law.table.low) * rng.uniform(0.0, 1.0, places)
        for displacement, force in zip(x, forces(reduced, angle, x), strict=True):
            unit.at(pair, angle, displacement)
            found.append(unit["force"] - force)
    return np.abs(found).max() / law.table.values.max()


def test_a_unit_has_the_form_that_the_standard_asks_for(tmp_path):
    validation = pytest.importorskip("fmpy.validation", reason="the form of units is checked by fmpy")
    write_fmu(small_law(), tmp_path / "mesh.fmu")
    assert validation.validate_fmu(str(tmp_path / "mesh.fmu")) == []


def test_without_a_compiler_a_unit_is_its_source(tmp_path, monkeypatch):
    monkeypatch.setattr(shutil, "which", lambda name: None)
    assert not write_fmu(small_law(), tmp_path / "mesh.fmu")
    names = zipfile.ZipFile(tmp_path / "mesh.fmu").namelist()
    assert names == ["modelDescription.xml", "sources/mesh.c", "sources/unit.h", "sources/table.h"]


def test_the_force_of_a_unit_is_that_of_the_law_within_the_tolerance_of_its_table(unit, rng):
    assert largest_difference(unit, small_law(), small_pair(centre_distance_mm=84.02), rng, 12) < 2.0 * COARSE


def test_forces_and_torques_of_both_gears_are_in_balance(unit):
    pair, distance = small_law().pair, small_law().pair.centre_distance
    unit.at(pair, 0.1, 0.01)
    force, angle = unit["force"], pair.working_pressure_angle
    np.testing.assert_allclose([unit["torque1"], unit["torque2"]],
                               -1e-3 * force * np.array([pair.pinion.base_radius, pair.wheel.base_radius]))  # fmt: skip
    on_wheel = np.array([unit[f"force2_{axis}"] for axis in "xyz"])
    np.testing.assert_allclose([unit[f"force1_{axis}"] for axis in "xyz"], -on_wheel)
    np.testing.assert_allclose(on_wheel, force * np.array([-np.cos(angle), np.sin(angle), 0.0]), atol=1e-12 * force)
    # About the pinion's axis: the torque on the wheel, and the force on it at the centre distance.
    total = unit["torque1"] + unit["torque2"] - 1e-3 * distance * on_wheel[0]
    np.testing.assert_allclose(total, 0.0, atol=1e-9)
    np.testing.assert_allclose(1e3 * unit["transmission_error"], 0.01, rtol=1e-9)


def test_the_stiffness_is_the_slope_of_the_force(unit):
    pair = small_law().pair
    for place in (0.0004, 0.003, 0.012):  # in cells of other sizes
        found = []
        for displacement in (place - 1e-6, place + 1e-6, place):
            unit.at(pair, 0.05, displacement)
            found.append(unit["force"])
        # The quotient of a cubic whose values are floats.
        np.testing.assert_allclose(unit["stiffness"], (found[1] - found[0]) / 2e-9, rtol=1e-4)


def test_a_wheel_that_moves_along_the_line_of_action_opens_the_flanks_by_as_much(unit):
    pair = small_law().pair
    angle = pair.working_pressure_angle
    unit.at(pair, 0.2, 0.012)
    expected = unit["force"]
    for x, y in ((0.0, 5e-6), (-5e-6, 0.0), (3e-6, -4e-6)):
        opened = 1e3 * (-x * np.cos(angle) + y * np.sin(angle))
        unit.at(pair, 0.2, 0.012 + opened, axis_x=x, axis_y=y)
        np.testing.assert_allclose(unit["force"], expected, rtol=1e-9)


def test_a_larger_centre_distance_is_that_of_the_law_but_for_where_pairs_enter(unit, rng):
    reduced, law = small_pair(centre_distance_mm=84.02), small_law()
    assembly = assembly_of(reduced.basis.case)
    apart = Assembly(Misalignment(centre_distance_um=5.0), assembly.pinion, assembly.wheel)
    found, x = [], np.linspace(law.table.low, 0.99 * law.table.high, 10)
    for angle in rng.uniform(0.0, law.pair.pitch, 20):
        for displacement, force in zip(x, forces(reduced, angle, x, apart), strict=True):
            unit.at(law.pair, angle, displacement, axis_y=5e-6)
            found.append((unit["force"] - force) / law.table.values.max())
    # Pairs enter and leave 0.05 % of the cycle off.
    assert np.sqrt(np.mean(np.square(found))) < 2e-3


def test_backs_of_the_teeth_carry_beyond_the_backlash_as_flanks_that_run_the_other_way(unit):
    law = small_law()
    pair, backlash = law.pair, law.backlash
    # Opening the axes by 20 um: twice their part along the line of action.
    np.testing.assert_allclose(backlash, 2.0 * 0.02 * np.sin(pair.working_pressure_angle), rtol=5e-3)
    for displacement in (-0.5 * backlash, -0.99 * backlash):
        unit.at(pair, 0.1, displacement)
        assert unit["force"] == 0.0
    unit.at(pair, 0.1, 0.01)
    front, on_wheel = unit["force"], [unit[f"force2_{axis}"] for axis in "xy"]
    # Mirrored about the line of centres: both gears turned to the other side, the pinion in the middle of its gap.
    one, two = pair.pinion.base_radius, pair.wheel.base_radius
    unit.step(phi1=-0.1 - 0.01 / one, phi2=0.1 * one / two - backlash / two)
    np.testing.assert_allclose(unit["force"], -front, rtol=1e-6)
    np.testing.assert_allclose([unit[f"force2_{axis}"] for axis in "xy"], [-on_wheel[0], on_wheel[1]], rtol=1e-6)
    unit.step(backlash=1e-3)
    assert unit["force"] == 0.0


@pytest.mark.parametrize(
    ("inputs", "message"),
    [
        ({"phi1": 0.01}, "along the line of action of 0.394671 mm: the table of the working flanks ends at"),
        ({"phi1": -0.01}, "the table of the backs of the teeth ends"),
        ({"phi1": float("nan")}, "input 0 is set to what is no finite number"),
        ({"torque1": 1.0}, "variable 5 is no input"),
        ({"backlash": -1.0}, "backlash of -1 m: below zero"),
    ],
)
def test_a_unit_says_what_it_cannot_answer(unit, inputs, message):
    with pytest.raises(Exception, match="failed with status 3"):
        unit.step(**inputs)
    assert len(unit.messages) == 1
    assert message in unit.messages[0]


def test_what_has_no_force_law_is_refused():
    reduced = small_pair(centre_distance_mm=84.02)
    case = reduced.basis.case
    shaped = dataclasses.replace(case, reduction=dataclasses.replace(case.reduction, shapes="pod"))
    with pytest.raises(CaseError, match="takes line loads, not"):
        mesh_law(dataclasses.replace(reduced, basis=dataclasses.replace(reduced.basis, case=shaped)))
    uneven = dataclasses.replace(case.pinion_modification, pitch_deviations_um=(1.0,) * 21)
    uneven = dataclasses.replace(case, pinion_modification=uneven)
    with pytest.raises(CaseError, match="leave out pitch_deviations_um"):
        mesh_law(dataclasses.replace(reduced, basis=dataclasses.replace(reduced.basis, case=uneven)))


def test_flanks_without_a_mirror_image_have_no_backs():
    reduced = small_pair(centre_distance_mm=84.02)
    case = reduced.basis.case
    slope = dataclasses.replace(case.pinion_modification, helix_slope_um=5.0)
    tilted = dataclasses.replace(case, pinion_modification=slope)
    law = mesh_law(dataclasses.replace(reduced, basis=dataclasses.replace(reduced.basis, case=tilted)), tolerance=0.05)
    assert gear_pair(tilted).centre_distance == 84.02
    assert law.backlash is None


def test_a_unit_whose_table_would_overload_a_section_is_refused_with_the_reason():
    """Under tilted axes an edge of the face carries several times the mean load."""
    reduced = small_pair()
    case = dataclasses.replace(reduced.basis.case, misalignment=Misalignment(out_of_plane_um=900.0))
    tilted = dataclasses.replace(reduced, basis=dataclasses.replace(reduced.basis, case=case))
    for torque in (5050.0, 6000.0):  # within the table alone, and at rest
        with pytest.raises(ConvergenceError, match=f"{torque:g} N m overloads a section, whose contact is wider"):
            mesh_law(tilted, torque, COARSE)
