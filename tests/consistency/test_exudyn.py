"""A mesh in exudyn: its motion beside our own transient, bodies of all kinds beside each other, refusals.

What needs no exudyn, the forces on the coordinates of bodies, is integrated here by hand.
"""

import builtins
import runpy
import sys
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import pmor
from pmor.app.model import ReducedModel
from pmor.dynamics.exudyn_mesh import BodyOfExudyn, connector
from pmor.dynamics.force_law import mean_stiffness, static_displacement
from pmor.dynamics.force_table import tabulate
from pmor.dynamics.gear_model import gear_model
from pmor.dynamics.integration import SAMPLES, integrate
from pmor.dynamics.law import mesh_laws
from pmor.dynamics.measure import at_rest as rest_of
from pmor.dynamics.oscillator import position_under
from pmor.dynamics.solution import task_of
from pmor.pair.conditions import assembly_of
from pmor_online.mesh_force import mesh_force_of
from tests.support.line_pairs import TORQUE, small_pair
from tests.support.motion import along_line_of_action

# Of root mean square and peak-to-peak, asked for: steps of a hundredth of the natural period make half of it.
AGREED = 0.01
INERTIA = 2e-3  # kg m^2, of both gears
RATIO, DAMPING = 0.45, 0.04  # mesh frequency over the natural one, and damping over the critical one
CYCLES, LAST, STEPS = 60, 4, 192
RANGE = -0.001, 0.03  # mm
ORIGIN, ALONG_Z = np.zeros(3), np.array([0.0, 0.0, 1.0])


@cache
def own():
    """Start, damping (N s/mm), angular mesh frequency, and transmission errors of the last cycles, um."""
    reduced = small_pair()
    radius = reduced.lines.base_radius
    table = tabulate(mesh_force_of(reduced, assembly_of(reduced.basis.case)), *RANGE, tolerance=3e-4)
    # Two equal gears: m = I / (2 r^2), in t.
    mass, load = 0.5e3 * INERTIA / radius**2, TORQUE / radius
    stiffness = mean_stiffness(table, load, RANGE)
    damping, speed = 2.0 * DAMPING * np.sqrt(stiffness * mass), RATIO * np.sqrt(stiffness / mass)
    start = float(static_displacement(table, load, np.zeros(1), RANGE)[0])
    oscillator = along_line_of_action(mass, damping, load)
    found = integrate(oscillator, table, np.array([start, 0.0]), (speed, speed), CYCLES)
    return start, damping, speed, 1e3 * found.displacement.reshape(-1, SAMPLES)[-LAST:]


def same_motion(found, expected):
    for measure in (np.std, np.ptp):
        np.testing.assert_allclose(measure(found, axis=1).mean(), measure(expected, axis=1).mean(), rtol=AGREED)
    np.testing.assert_allclose(found.mean(), expected.mean(), rtol=AGREED)


def rotor(sense=1.0):
    return BodyOfExudyn("1D", np.zeros(1), ORIGIN, sense * ALONG_Z)


@pytest.mark.slow
def test_rotors_move_as_our_own_transient_does():
    """Two rotors under the forces of the connector, by the midpoint rule: no part of exudyn, nor of our integration."""
    reduced = small_pair()
    start, damping, speed, expected = own()
    mesh = connector(reduced, (rotor(), rotor(-1.0)), ALONG_Z, None, damping)
    turn = speed / reduced.meshed.pair.pinion.teeth
    # The wheel's rotor counts clockwise.
    q, rate = np.array([start / reduced.lines.base_radius, 0.0]), np.array([turn, turn])
    load, step = 1e-3 * TORQUE * np.array([1.0, -1.0]), 2.0 * np.pi / speed / STEPS
    seen = []
    for _ in range(CYCLES * STEPS):
        half_rate = rate + 0.5 * step * (load + mesh.forces(q.tolist(), rate.tolist())) / INERTIA
        change = step * (load + mesh.forces((q + 0.5 * step * rate).tolist(), half_rate.tolist())) / INERTIA
        q, rate = q + step * half_rate, rate + change
        seen.append(1e3 * reduced.lines.base_radius * (q[0] - q[1]))
    same_motion(np.reshape(seen, (CYCLES, STEPS))[-LAST:], expected)
    assert not mesh.overloaded


def test_backs_of_teeth_are_flanks_seen_from_the_other_side():
    """Half a turn about the line of centres: the same force at the mirrored angle, beyond the backlash."""
    case = pmor.change_case(small_pair().basis.case, dynamics={"backlash_um": 80.0})
    reduced = pmor.train(case).reduced
    mesh, radius = connector(reduced, (rotor(), rotor()), ALONG_Z, None, 0.0), reduced.lines.base_radius
    for phi in (0.0, 0.05, 0.2):
        front = mesh.forces([phi + 0.01 / radius, -phi], [0.0, 0.0]).copy()
        play = 0.08 / radius
        back = mesh.forces([-phi - 0.01 / radius, phi - play], [0.0, 0.0])
        np.testing.assert_allclose(back, -front, rtol=1e-9)
        assert front[0] < -10.0
    assert not mesh.forces([-0.04 / radius, 0.0], [0.0, 0.0]).any()


def test_damping_acts_along_the_line_of_action():
    reduced = small_pair()
    apart = [-0.01 / reduced.lines.base_radius, 0.0]
    mesh, radius = connector(reduced, (rotor(), rotor()), ALONG_Z, None, 2.0), reduced.lines.base_radius
    np.testing.assert_allclose(mesh.forces(apart, [3.0, 1.0]), -1e-3 * radius * 2.0 * radius * 4.0 * np.ones(2))
    assert mesh.reading(apart) == [pytest.approx(-10.0), 0.0]


def test_overload_is_kept_and_a_position_without_equilibrium_is_no_number(monkeypatch):
    mesh, radius = connector(small_pair(), (rotor(), rotor()), ALONG_Z, None, 0.0), small_pair().lines.base_radius
    mesh.forces([0.01 / radius, 0.0], [0.0, 0.0])
    assert not mesh.overloaded
    mesh.forces([1.0 / radius, 0.0], [0.0, 0.0])
    mesh.forces([0.01 / radius, 0.0], [0.0, 0.0])
    assert mesh.overloaded
    monkeypatch.setattr(mesh, "_solve", lambda *_: (False, False, 0.1, 1e-4))
    with pytest.raises(
        pmor.ConvergenceError, match="no equilibrium at a pinion angle of 5.72958 deg and an advance of"
    ):
        mesh.forces([0.0, 0.0], [0.0, 0.0])


def body(kind, *place):
    size = {"RigidBodyEP": 7, "RigidBodyRxyz": 6}[kind]
    reference = np.r_[place, np.zeros(size - 3)]
    if kind == "RigidBodyEP":
        reference[3] = 1.0
    return BodyOfExudyn(kind, reference, np.array(place), ALONG_Z)


@pytest.mark.parametrize(
    ("places", "at_m", "refused"),
    [
        (((0.0, 0.0, 0.0), (0.0, 84.0, 0.0)), None, "the middles of the gears are 84 m apart across the axis"),
        (((0.0, 0.0, 0.0), (0.0, 0.084, 0.1)), None, "0.1 m along it, and the pair has a centre distance of 0.084 m"),
        (((0.0, 0.0, 0.0), (0.0, 0.084, 0.0)), ((0.0, 0.0, 0.0), (0.0, 0.1, 0.0)), "are 0.1 m apart"),
    ],
)
def test_gears_that_do_not_face_each_other_are_refused(places, at_m, refused):
    bodies = [body("RigidBodyRxyz", *place) for place in places]
    with pytest.raises(pmor.CaseError, match=refused):
        connector(small_pair(), bodies, ALONG_Z, at_m, 0.0)


def test_a_program_that_is_missing_is_named_with_its_extra(monkeypatch):
    class System:
        def GetObject(self, number):
            return {"objectType": "RotationalMass1D"}

    importing = builtins.__import__
    refuse = {"exudyn"}

    def without(name, *rest, **keywords):
        if name.partition(".")[0] in refuse:
            raise ImportError(name)
        return importing(name, *rest, **keywords)

    monkeypatch.setattr(builtins, "__import__", without)
    with pytest.raises(pmor.ExternalProgramError, match=r"exudyn is not installed: pip install 'pmor-gear\[exudyn\]'"):
        pmor.exudyn_mesh(System(), ReducedModel(small_pair().basis), 0, 1)


# --- with exudyn ----------------------------------------------------------------------------------------------------


@pytest.fixture
def exudyn():
    found = pytest.importorskip("exudyn", reason="exudyn is not installed: pip install 'pmor-gear[exudyn]'")
    found.config.suppressWarnings = True
    return found


def move(exudyn, mbs, mesh, speed, cycles, solver="GeneralizedAlpha"):
    mbs.Assemble()
    settings = exudyn.SimulationSettings()
    settings.timeIntegration.numberOfSteps = STEPS * cycles
    settings.timeIntegration.endTime = 2.0 * np.pi * cycles / speed
    settings.timeIntegration.newton.useModifiedNewton = True
    settings.timeIntegration.newton.relativeTolerance = 1e-5
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = 0.5 * np.pi / speed / STEPS
    mbs.SolveDynamic(settings, solverType=getattr(exudyn.DynamicSolverType, solver))
    return mbs.GetSensorStoredData(mesh.sensor_number)[1:].reshape(cycles, STEPS, 3)


def rotors(exudyn):
    item, reduced = exudyn.itemInterface, small_pair()
    start, damping, speed, _ = own()
    mbs, gears = exudyn.SystemContainer().AddSystem(), []
    turn = speed / reduced.meshed.pair.pinion.teeth
    for angle, rate in ((start / reduced.lines.base_radius, turn), (0.0, -turn)):
        node = mbs.AddNode(
            item.Node1D(referenceCoordinates=[0.0], initialCoordinates=[angle], initialVelocities=[rate])
        )
        gears.append(mbs.AddObject(item.ObjectRotationalMass1D(nodeNumber=node, inertia=INERTIA)))
        marker = mbs.AddMarker(item.MarkerNodeCoordinate(nodeNumber=node, coordinate=0))
        mbs.AddLoad(item.LoadCoordinate(markerNumber=marker, load=1e-3 * TORQUE))
    return mbs, pmor.exudyn_mesh(mbs, ReducedModel(reduced.basis), *gears, damping_N_s_mm=damping)


@pytest.mark.parametrize("solver", ["GeneralizedAlpha", "VelocityVerlet"])
def test_rotors_of_exudyn_move_as_our_own_transient_does(exudyn, solver):
    mbs, mesh = rotors(exudyn)
    found = move(exudyn, mbs, mesh, own()[2], CYCLES, solver)
    same_motion(found[-LAST:, :, 1], own()[3])
    assert not mesh.overloaded
    # The mesh carries the load on average.
    load = TORQUE / small_pair().lines.base_radius
    np.testing.assert_allclose(found[-LAST:, :, 2].mean(), load, rtol=2e-3)


@pytest.mark.parametrize("node", ["RotationEulerParameters", "RotationRxyz", "RotationRotationVector"])
def test_bodies_in_joints_move_as_rotors_do(exudyn, node):
    """Turned in space, with the gear's middle beside the body's own point, on the whole width."""
    from exudyn.rigidBodyUtilities import RigidBodyInertia, RotationMatrixX

    reduced = small_pair()
    start, damping, speed, _ = own()
    turn, cycles = speed / reduced.meshed.pair.pinion.teeth, 6
    expected = move(exudyn, *rotors(exudyn), speed, cycles)[..., 1]
    axis, across = np.array([1.0, 0.0, 0.0]), 1e-3 * reduced.meshed.pair.centre_distance * np.array([0.0, 0.6, 0.8])
    mbs, gears = exudyn.SystemContainer().AddSystem(), []
    ground = mbs.CreateGround()
    for middle, angle, rate in ((0.0 * across, start / reduced.lines.base_radius, turn), (across, 0.0, -turn)):
        place = middle - 0.005 * axis
        gear = mbs.CreateRigidBody(
            inertia=RigidBodyInertia(1.0, np.diag([INERTIA, 0.6 * INERTIA, 0.6 * INERTIA])), referencePosition=place,
            initialRotationMatrix=RotationMatrixX(angle), initialAngularVelocity=rate * axis,
            nodeType=getattr(exudyn.NodeType, node),
        )  # fmt: skip
        mbs.CreateRevoluteJoint(itemNumbers=[ground, gear], position=place, axis=axis)
        mbs.CreateTorque(itemNumber=gear, loadVector=1e-3 * TORQUE * axis)
        gears.append(gear)
    mesh = pmor.exudyn_mesh(
        mbs, ReducedModel(reduced.basis), *gears, axis=axis, at_m=(0.0 * across, across), damping_N_s_mm=damping
    )
    found = move(exudyn, mbs, mesh, speed, cycles)[..., 1]
    np.testing.assert_allclose(found, expected, atol=AGREED * np.ptp(expected))


def test_a_body_that_is_no_gear_is_refused(exudyn):
    item = exudyn.itemInterface
    mbs = exudyn.SystemContainer().AddSystem()
    node = mbs.AddNode(item.NodePoint(referenceCoordinates=[0.0, 0.0, 0.0]))
    mass = mbs.AddObject(item.MassPoint(nodeNumber=node, physicsMass=1.0))
    with pytest.raises(
        pmor.CaseError, match="on a node of type Point: must be a RotationalMass1D, or a body on a node"
    ):
        pmor.exudyn_mesh(mbs, ReducedModel(small_pair().basis), mass, mass)


def test_gears_on_bearings_move_as_our_own_six_degrees_of_freedom_do(exudyn):
    """Our law is that of the axes under the mean force, and levers are those of the pitch point."""
    from exudyn.rigidBodyUtilities import RigidBodyInertia, RotationMatrixZ

    stiffness = np.array([[300.0, 300.0], [200.0, 200.0]])
    case = pmor.change_case(
        small_pair().basis.case,
        dynamics={
            "degrees_of_freedom": 6, "pinion_bearing_stiffness_N_um": list(stiffness[0]), "torques_Nm": [1e-3 * TORQUE],
            "wheel_bearing_stiffness_N_um": list(stiffness[1]), "bearing_damping_ratio": 0.05, "damping_ratio": DAMPING,
        },
    )  # fmt: skip
    model = pmor.train(case)
    pair, gears = model.reduced.meshed.pair, gear_model(case, model.reduced.meshed.pair)
    law = mesh_laws(case, model.reduced, gears)[0][0]
    at_rest = rest_of(task_of(case, gears, law.table, 1e-3 * TORQUE))
    oscillator, speed, radius = at_rest.oscillator, RATIO * at_rest.natural, pair.pinion.base_radius
    start = static_displacement(law.table, oscillator.load[0], np.zeros(1), (law.table.low, law.table.high))[0]
    position = position_under(oscillator, oscillator.load[:1], np.atleast_1d(start))
    own_motion = integrate(oscillator, law.table, np.r_[position, 0.0 * position], (speed, speed), CYCLES)
    expected = 1e3 * own_motion.states[:, 0].reshape(-1, SAMPLES)[-LAST:]
    item, mbs, bodies = exudyn.itemInterface, exudyn.SystemContainer().AddSystem(), []
    ground, turn = mbs.CreateGround(), speed / pair.pinion.teeth
    for number, (angle, rate) in enumerate(((position[0] / radius, turn), (0.0, -turn))):
        place, inertia = np.array([0.0, 1e-3 * number * pair.centre_distance, 0.0]), gears.inertias[number]
        moments = np.diag([inertia.tilting_kg_m2, inertia.tilting_kg_m2, inertia.polar_kg_m2])
        gear = mbs.CreateRigidBody(
            inertia=RigidBodyInertia(inertia.mass_kg, moments), referencePosition=place,
            initialRotationMatrix=RotationMatrixZ(angle), initialAngularVelocity=[0.0, 0.0, rate],
            nodeType=exudyn.NodeType.RotationRotationVector,
        )  # fmt: skip
        springs = 1e6 * np.array([*stiffness[number], 1e3])
        dampers = 0.1 * np.sqrt(springs * inertia.mass_kg)
        held = np.diag([*springs, 1e8, 1e8, 0.0]), np.diag([*dampers, 1e4, 1e4, 0.0])
        # `CreateRigidBodySpringDamper` makes one whose axes turn by half of the gear's angle: not this one.
        ends = [
            mbs.AddMarker(item.MarkerBodyRigid(bodyNumber=body, localPosition=at))
            for body, at in ((ground, place), (gear, [0.0, 0.0, 0.0]))
        ]
        mbs.AddObject(item.RigidBodySpringDamper(markerNumbers=ends, stiffness=held[0], damping=held[1]))
        mbs.CreateTorque(itemNumber=gear, loadVector=[0.0, 0.0, 1e-3 * TORQUE])
        bodies.append(gear)
    mesh = pmor.exudyn_mesh(mbs, model, *bodies, damping_N_s_mm=float(oscillator.damping[0, 0]))
    same_motion(move(exudyn, mbs, mesh, speed, CYCLES)[-LAST:, :, 1], expected)


@pytest.mark.slow
def test_the_example_agrees_with_our_own_motion(exudyn, tmp_path, monkeypatch):
    script = Path(__file__).parents[2] / "cases" / "exudyn_gearbox.py"
    monkeypatch.setattr(sys, "argv", [script.name, str(tmp_path / "out")])
    found = runpy.run_path(str(script), run_name="__main__")
    assert found["worst"] < AGREED
    assert (tmp_path / "out" / "exudyn_gearbox.png").stat().st_size > 10_000
