"""Planetary sets of files in small motion: at rest they are the set that is solved, on springs and on shafts; what
phasing forbids is not there, in meshes, bearings and frequencies."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.case.motion import Motion
from pmor.core.errors import CaseError, ConvergenceError
from pmor.dynamics.whine import moving_sets
from pmor.dynamics.whine.blades import Blades
from pmor.dynamics.whine.gradient import Target, changes, cycle_with, passing_at
from pmor.dynamics.whine.live import motion_section
from pmor.dynamics.whine.modal import closed, modes_of
from pmor.dynamics.whine.moving import moving_machine
from pmor.dynamics.whine.moving_sets import machine_of_set, with_sets
from pmor.dynamics.whine.pictures import as_gearbox, moving_bodies, write_modes
from pmor.dynamics.whine.readings import bearing_names, mode_rows
from pmor.dynamics.whine.respond import respond, respond_set
from pmor.dynamics.whine.response import AIR
from pmor.dynamics.whine.run import run
from pmor.dynamics.whine.set_cycle import set_cycle
from pmor.dynamics.whine.set_response import over_planets
from pmor.gear.modification import Modification
from pmor.line.hub_law import train_coordinates, train_law_at, train_rows
from pmor.line.hubs import HUB
from pmor.machine.bodies import bodies
from pmor.machine.coupled import solve_load
from pmor.machine.loader import load
from pmor.machine.run import trains_of
from pmor.machine.view import COARSE
from pmor.sets.loader import load as load_set
from pmor.sets.loader import parse_set
from pmor.sets.run import train_of
from pmor.sets.solution import solve_set
from tests.support.set_gearboxes import EVEN_SET, bearing, one_stage, written_reducer

# Relief keeps tip corners out of mesh, where rows of sections turn with the load: 4e-4 of forces.
RELIEF = "".join(
    f"[{gear}.modification]\ntip_relief_um = 60.0\ntip_relief_length_mm = 2.0\n" for gear in ("sun", "planet", "ring")
)
SPRINGS = """[supports]
sun_radial_N_per_mm = 2e5
ring_radial_N_per_mm = 5e5
planet_radial_N_per_mm = 3e5
"""
# A floating sun, planets that tilt on pins in a carrier that tilts on soft bearings.
LOOSE = """[supports]
sun_radial_N_per_mm = "free"
sun_tilt_Nmm_per_rad = 1e8
[carrier]
radial_N_per_mm = 3e5
tilt_Nmm_per_rad = 1e9
bearings_at_mm = 20.0
[pins]
diameter_mm = 30.0
length_mm = 30.0
bearings = [{at_mm = -6.0}, {at_mm = 5.0, radial_N_per_mm = 1e6}]
"""
HELICAL = EVEN_SET.replace("face_width_mm = 20.0", "face_width_mm = 20.0\nhelix_angle_deg = 10.0")
# The FVA's tooth numbers: three planets are a third of a pitch after each other.
PHASED = EVEN_SET.replace("teeth = 18", "teeth = 17", 1).replace("teeth = 18", "teeth = 22").replace("54", "61")
# Torques, of which the difference is a tangent; what is left of the solutions' own tolerance.
STEP, TANGENT = 1e-3, 2e-6
# Of the largest order: what line contact is beyond its tangent over the cycle.
FIRST_ORDER = 0.01
TRAINS = {}
# Of meshes, N/mm.
ANY_TANGENT = 3e5
FORBIDDEN = 1e-9
# Coriolis forces on a rotation that nothing holds are left out, and they are others seen from the carrier.
LOOSE_SUN = 2e-6


@cache
def set_and_train(text):
    with TemporaryDirectory() as folder:
        path = Path(folder) / "set.toml"
        path.write_text(text)
        file = load_set(path)
    return file, train_of(file)


def trains_once(file, of_set):
    """Finite elements of a set on shafts, once for all gearboxes with it."""
    if of_set not in TRAINS:
        TRAINS[of_set] = trains_of(file.model, file.model.sections.loads)
    return TRAINS[of_set]


def closed_at(machine, train, place, moved, plan):
    """The machine with the meshes' own tangents at one angle, and their forces."""
    (one,) = machine.sets
    law = train_law_at(train.place(place, plan.displacement), moved)
    whole = np.kron(one.coordinates.blades.matrix, np.eye(len(moved) // one.coordinates.blades.count))
    tangent = np.zeros((len(machine.meshes), len(machine.meshes)))
    tangent[one.own, one.own] = whole.T @ law.tangent[0] @ whole
    return closed(machine, tangent), law.force[0]


@pytest.mark.parametrize("text", [EVEN_SET + SPRINGS, HELICAL + LOOSE], ids=["springs", "pins"])
def test_at_rest_a_set_gives_way_as_the_one_that_is_solved(text):
    """At one angle: forces on the coordinates, and displacements of all hubs by a little more torque."""
    file, train = set_and_train(text + RELIEF)
    torque, place = file.plan.torque_Nm, 2
    torques = torque * np.array([1.0 - STEP, 1.0, 1.0 + STEP])
    solution = solve_set(file.plan, train, torques, file.angles_per_pitch, file.pitches)
    machine, displacement = machine_of_set(file, train), solution.hub_displacement[:, place].reshape(3, -1)
    moved = train_coordinates(train).T @ displacement[1]
    stiffness, force = closed_at(machine, train, solution.placed.phi[[place]], moved, file.plan)
    expected = solution.found.force[1, place] @ train_rows(solution.placed)[place]
    assert_allclose(force, expected, atol=1e-9 * abs(expected).max())
    acting, free = np.zeros(len(machine.mass)), machine.free
    acting[HUB - 1] = 1e3 * torque * STEP  # the sun's hub comes first
    (one,) = machine.sets
    answer = free @ np.linalg.solve(free.T @ stiffness @ free, free.T @ acting)
    found = (one.coordinates.bodies @ one.by @ answer).reshape(-1, HUB)
    difference = 0.5 * (displacement[2] - displacement[0]).reshape(-1, HUB)
    for part in (slice(0, 3), slice(3, HUB)):
        assert_allclose(found[:, part], difference[:, part], atol=TANGENT * abs(difference[:, part]).max())


@pytest.mark.parametrize("torque", [300.0, -300.0])
def test_at_rest_a_set_on_shafts_gives_way_as_the_one_that_is_solved(tmp_path, torque):
    """Either way round, on soft bearings: relative to the carrier, whose hub is held about the axis."""
    text = one_stage("1e5", "1e9", torque=torque, extra=bearing("C", "carrier", 50.0, "3e5", '"free"'))
    text = text.replace(bearing("B", "carrier", 10.0), bearing("B", "carrier", 20.0, "2e5", '"free"'))
    file = load(written_reducer(tmp_path, text, EVEN_SET + SPRINGS + RELIEF))
    trains = trains_once(file, EVEN_SET + SPRINGS + RELIEF)
    solved = solve_load(file.model, file.model.sections.loads[0], {}, 6, trains=trains)
    (one_set,) = solved.sets
    plan, train, place = one_set.solution.plan, one_set.solution.train, 2
    torques = 1e-3 * one_set.torque * np.array([1.0 - STEP, 1.0, 1.0 + STEP])
    solution = solve_set(plan, train, torques, 6)
    machine = with_sets(moving_machine(file.model, solved, 15000.0), file.model, solved.sets)
    assert len(machine.gearbox.load) > len(solved.gearbox.load)  # shafts in shorter elements
    (one,), (meshing,) = machine.sets, machine.gearbox.sets
    displacement = solution.hub_displacement[:, place].reshape(3, -1)
    moved = train_coordinates(train).T @ displacement[1]
    stiffness, _ = closed_at(machine, train, solution.placed.phi[[place]], moved, plan)
    sun, carrier = (meshing.hubs[member] + 3 for member in (0, 1))
    held = machine.free @ np.linalg.svd(machine.free[[carrier]])[2][1:].T
    acting = np.zeros(len(machine.mass))
    acting[sun] = np.sign(torque) * one_set.torque * STEP
    answer = held @ np.linalg.solve(held.T @ stiffness @ held, held.T @ acting)
    found = (one.coordinates.bodies @ one.by @ answer).reshape(-1, HUB)
    difference = 0.5 * (displacement[2] - displacement[0]).reshape(-1, HUB)
    for part in (slice(0, 3), slice(3, HUB)):
        assert_allclose(found[:, part], difference[:, part], atol=TANGENT * abs(difference[:, part]).max())


def test_orders_that_phasing_forbids_are_in_no_sum_of_the_meshes_forces():
    """17 teeth, three planets: harmonics 1 and 2 cancel about the axis, 3 across it; tangents of all are the same."""
    file, train = set_and_train(PHASED)
    solution = solve_set(file.plan, train, np.array([file.plan.torque_Nm]), file.angles_per_pitch)
    (one,) = machine_of_set(file, train).sets
    blades = one.coordinates.blades
    cycle = set_cycle(one, file, solution, 0, 3)
    force = cycle.meshes.force.reshape(len(cycle.meshes.force), blades.count, -1)
    largest = abs(force[1:]).max()
    around = np.exp(1j * np.outer((0, 1, -1), blades.directions))
    for harmonic, there in ((1, 2), (2, 1), (3, 0)):
        sums = abs(around @ force[harmonic]).max(axis=1)
        assert sums[there] > 1e-3 * largest
        assert max(sums[other] for other in range(3) if other != there) < FORBIDDEN * largest
    assert cycle.uneven < FORBIDDEN
    # Modes that a planet by itself has are none of three.
    machine = machine_of_set(file, train)
    modes = modes_of(machine, closed(machine, cycle.tangent), 2e4)
    shares = one.families(modes.shape)
    assert_allclose(shares[:2].max(axis=0), 1.0, atol=1e-9)


def test_a_carrier_with_endless_mass_is_one_on_rigid_bearings_that_turns_evenly():
    """Mass and inertia that `[[masses]]` has: natural frequencies of all else are the same, beside those of rest."""
    _, train = set_and_train(EVEN_SET + SPRINGS)
    soft = "[carrier]\nradial_N_per_mm = 3e5\ntilt_Nmm_per_rad = 1e9\n"
    heavy = '[[masses]]\non = "carrier"\n' + "".join(
        f"{key} = 1e9\n" for key in ("mass_kg", "polar_inertia_kg_m2", "tilting_inertia_kg_m2")
    )
    found = []
    for more in ("", soft, soft + heavy):
        machine = machine_of_set(parse_set(EVEN_SET + SPRINGS + more, "set", "set"), train)
        whole = np.kron(machine.sets[0].coordinates.blades.matrix, np.eye(len(machine.meshes) // 3))
        found.append(modes_of(machine, closed(machine, ANY_TANGENT * whole.T @ whole), 2e4).frequency_Hz)
    rigid, light, still = found
    assert_allclose(still[still > 10.0], rigid[rigid > 10.0], rtol=1e-5)
    assert len(still) == len(rigid) + 5  # across, against tilting, about the axis
    assert light[1] < 0.99 * rigid[1]
    with pytest.raises(CaseError, match=r'on = "carrier": polar_inertia_kg_m2 = 1e\+09: must be at most twice'):
        parse_set(EVEN_SET + SPRINGS + soft + heavy.replace("tilting_inertia_kg_m2 = 1e9", ""), "set", "set")


def test_a_slow_set_moves_as_its_transmission_error_and_its_meshes_carry_the_load_alone():
    """Planets in phase, the sun free about the axis: what the sun's and the ring's meshes part adds up to that of the
    solved set, to first order in how far it is from the mean."""
    file, train = set_and_train(EVEN_SET + SPRINGS + RELIEF)
    solution = solve_set(file.plan, train, np.array([file.plan.torque_Nm]), file.alike_from(96))
    response = respond_set(file, solution, 0, Motion(harmonics=5), np.array([0.01]))
    (source,), own = response.sources, response.sources[0].ports
    assert source.why_constant == ""
    assert source.places == tuple((float(harmonic), 0) for harmonic in range(1, 6))
    moved = [order.ports(own, own)[0] @ source.lines.acting[0, n] for n, order in enumerate(source.orders)]
    sums = 2e3 * np.abs([one[:2].sum() for one in moved])  # of all planets alike
    expected = solution.mesh_orders(0)[:5]
    assert_allclose(sums, expected, atol=FIRST_ORDER * expected.max())
    assert abs(source.lines.mesh_forces).max() < 1e-7 * response.cycles[0].load.max()


def test_a_slow_set_is_in_balance_with_what_holds_its_members():
    """Forces across the axis on sun, carrier and ring of planets that are out of phase, pins among them."""
    file, train = set_and_train(PHASED + SPRINGS)
    solution = solve_set(file.plan, train, np.array([file.plan.torque_Nm]), file.angles_per_pitch)
    response = respond_set(file, solution, 0, Motion(harmonics=2), np.array([0.01]))
    (source,) = response.sources
    assert source.places == ((1.0, -1), (2.0, 1))
    held = response.bearing_forces(source.lines.readings)[0, :, :, :2]
    assert bearing_names(response) == [f"set: {member} in the housing" for member in ("sun", "carrier", "ring")]
    assert abs(held).min() > 1e-3 * abs(held).max()
    assert abs(held.sum(axis=1)).max() < 1e-6 * abs(held).max()
    # Lines whirl: forwards above a harmonic, backwards below.
    assert_allclose(held[0, :, 1], 1j * held[0, :, 0], rtol=1e-6)
    assert_allclose(held[1, :, 1], -1j * held[1, :, 0], rtol=1e-6)


def test_planets_each_by_itself_seen_from_the_carrier_are_those_that_stand_still():
    """Equal ones both ways, stiffness varying: lines, whirl and forces on the housing, and forces of the meshes."""
    file, train = set_and_train(PHASED + SPRINGS)
    off = parse_set((PHASED + SPRINGS).replace("count = 3", "count = 3\nradial_um = [1e-9, 0.0, 0.0]"), "set", "set")
    solution = solve_set(file.plan, train, np.array([file.plan.torque_Nm]), file.angles_per_pitch)
    motion, speeds = Motion(harmonics=3), np.array([400.0, 3000.0, 9000.0])
    still, carried = (respond_set(one, solution, 0, motion, speeds) for one in (file, off))
    assert carried.cycles[0].blades.carried
    assert not still.cycles[0].blades.carried
    (expected,), (found,) = still.sources, carried.sources
    assert found.why_constant == expected.why_constant == ""
    forces, frequency = carried.bearing_forces(found.lines.readings), found.frequency_Hz(speeds)
    own = still.bearing_forces(expected.lines.readings)
    for number, place in enumerate(expected.places):
        same = found.places.index(place)
        assert_allclose(frequency[:, same], expected.frequency_Hz(speeds)[:, number])
        assert_allclose(forces[:, same], own[:, number], atol=1e-6 * abs(own).max())
    others = [n for n, place in enumerate(found.places) if place not in expected.places]
    assert len(others) == 6
    assert abs(forces[:, others]).max() < 1e-6 * abs(own).max()
    squares = [(abs(one.lines.mesh_forces) ** 2).sum(axis=1) for one in (expected, found)]
    assert_allclose(*squares, rtol=1e-6)


@pytest.mark.slow
def test_stepped_planets_as_one_are_those_seen_from_the_carrier_all_together(monkeypatch):
    """Over the common cycle of both of their gears, four pitches of the sun: 20 and 15 teeth."""
    text = EVEN_SET.replace("teeth = 18", "teeth = 19", 1).replace("teeth = 18", "teeth = 20")
    text = text.replace("[ring]", "[second_planet]\nteeth = 15\nbore_radius_mm = 14.0\n[ring]") + SPRINGS
    as_one = alone(text)
    monkeypatch.setattr(moving_sets, "Blades", lambda directions, carried: Blades(directions, True))
    together = alone(text)
    (found,), (expected,) = as_one.sources, together.sources
    assert as_one.cycles[0].pitches == 4
    assert found.why_constant == expected.why_constant == ""
    own = together.bearing_forces(expected.lines.readings)[..., :3]
    for number, place in enumerate(found.places):
        force = as_one.bearing_forces(found.lines.readings)[:, number, :, :3]
        assert_allclose(force, own[:, expected.places.index(place)], atol=1e-9 * abs(own).max())
    constant = as_one.bearing_forces(found.constant.readings)[..., :3]
    assert abs(constant - as_one.bearing_forces(found.lines.readings)[..., :3]).max() > 1e-2 * abs(own).max()


def test_a_planet_that_carries_nothing_is_refused_by_name():
    """One of three is so far ahead of its place that others do not touch."""
    with pytest.raises(ConvergenceError, match="carries nothing"):
        alone((PHASED + SPRINGS).replace("count = 3", "count = 3\ntangential_um = [500.0, 0.0, 0.0]"))


def test_unequal_planets_in_coordinates_that_stand_still_are_those_seen_from_the_carrier(monkeypatch):
    """Pins out of place: as a gearbox has them that is alike all around, by what the housing does at three orders."""
    text = (PHASED + SPRINGS).replace("count = 3", "count = 3\nradial_um = [8.0, 0.0, -3.0]")
    carried = alone(text)
    monkeypatch.setattr(moving_sets, "Blades", lambda directions, carried: Blades(directions))
    still = alone(text)
    (expected,), (found,) = carried.sources, still.sources
    assert carried.cycles[0].blades.carried
    assert not still.cycles[0].blades.carried
    assert found.why_constant == ""
    own = carried.bearing_forces(expected.lines.readings)[..., :2]
    assert found.places == expected.places
    assert abs(own[:, 0::3]).max() > 1.0
    assert_allclose(still.bearing_forces(found.lines.readings)[..., :2], own, atol=LOOSE_SUN * abs(own).max())
    squares = [(abs(one.lines.mesh_forces) ** 2).sum(axis=1) for one in (expected, found)]
    assert_allclose(*squares, rtol=1e-6)


@pytest.mark.parametrize("planets", ["count = 3\nmissing = [2]", "count = 3\npositions_deg = [0.0, 106.153846, 240.0]"])
def test_planets_that_are_missing_or_uneven_are_in_balance_with_what_holds_a_slow_set(planets):
    """Of two planets and of three that are not evenly spaced."""
    file, train = set_and_train((PHASED + SPRINGS).replace("count = 3", planets))
    solution = solve_set(file.plan, train, np.array([file.plan.torque_Nm]), file.angles_per_pitch)
    response = respond_set(file, solution, 0, Motion(harmonics=2), np.array([0.01]))
    (source,) = response.sources
    assert source.why_constant == ""
    held = response.bearing_forces(source.lines.readings)[0, :, :, :2]
    assert abs(held).max() > 1.0
    assert abs(held.sum(axis=1)).max() < 1e-6 * abs(held).max()
    # Lines whirl: forwards a turn above a harmonic, backwards a turn below.
    for number, (_, sideband) in enumerate(source.places):
        assert_allclose(held[number, :, 1], -1j * sideband * held[number, :, 0], atol=1e-9 * abs(held).max())


def test_a_gearbox_with_a_set_hums_at_mesh_frequencies_and_whirls_at_their_sidebands(tmp_path):
    """Lines across the axis beside multiples of the mesh frequency alone, and the bearing feels these alone."""
    response, source = in_a_gearbox(tmp_path, 300.0, 1000.0)
    assert source.places == ((1.0, -1), (2.0, 1), (3.0, 0))
    # The ring is held: its 61 teeth pass the carrier, which turns 17 / 78 times.
    orders = 17 / 78 * np.array([61 - 1, 122 + 1, 183])
    assert_allclose(source.frequency_Hz(np.array([60.0]))[0], orders)
    forces = abs(response.bearing_forces(source.lines.readings))[..., :3].max(axis=(0, 2, 3))
    assert forces[2] < FORBIDDEN * forces.max()
    assert source.why_constant == ""
    held = abs(response.support_forces(0, source.lines.readings))
    # The ring's torque on the housing at the third alone.
    assert held[:, :2, 2, 5].max() < FORBIDDEN * held[:, 2, 2, 5].max()


def test_planets_that_go_with_their_carrier_are_drawn_where_it_carries_them(tmp_path):
    """As in the loaded machine; by its own coordinate a planet leaves its place, the other bodies stay."""
    response, _ = in_a_gearbox(tmp_path, 300.0, 1000.0)
    machine, model = response.machine, load(written_reducer(tmp_path, one_stage("1e5", "1e9"), PHASED)).model
    carried = bodies(model, machine.gearbox, COARSE)
    found, by = moving_bodies(model, machine, COARSE)
    moved = np.zeros(len(machine.mass))
    moved[: len(machine.gearbox.load)] = np.random.default_rng(1).standard_normal(len(machine.gearbox.load))
    for one, body in zip(carried, found, strict=True):
        assert_allclose(body.displacement(by @ moved), one.displacement(moved), atol=1e-9)
    moved[:] = 0.0
    moved[-HUB] = 1.0  # cos or sin of the planets' place
    left = {body.name for body in found if np.abs(body.displacement(by @ moved)).max() > 1e-12}
    assert len(left) >= 2
    assert not any(place in name for name in left for place in ("sun", "ring", "bearing"))


def test_a_set_by_itself_is_drawn_where_its_planets_stand_and_move(tmp_path):
    """Its axis along x; every mode moves each gear as it moves its hub."""
    file, response = set_and_train(PHASED + SPRINGS)[0], alone(PHASED + SPRINGS)
    model, machine = as_gearbox(file, response.machine)
    found, by = moving_bodies(model, machine, COARSE)
    (one,), shape = machine.sets, response.modes.shape[:, -1]
    hubs = (one.coordinates.bodies @ one.by @ shape).reshape(-1, HUB)
    assert [body.name for body in found] == [f"{file.name}, {body.name}" for body in file.plan.bodies]
    for body, place, hub in zip(found, file.plan.bodies, hubs, strict=True):
        assert_allclose(np.hypot(*body.centre[0, 1:]), np.hypot(place.x, place.y), atol=1e-9)
        moved = body.displacement(by @ shape).mean(axis=(0, 1))
        assert_allclose(np.hypot(*moved[1:]), np.hypot(*hub[:2]), atol=0.02 * abs(hubs[:, :2]).max())
    write_modes(file, response, [1], tmp_path / "modes.vtkhdf")
    section = motion_section(file, [response], response, mode_rows(response))
    assert {line["kind"] for line in section.data["modes"]["lines"]} == {"gear"}


def in_a_gearbox(folder, torque, speed):
    """The response of a reducer, and its only source; finite elements once."""
    text = one_stage("1e5", "1e9", torque=torque).replace("speed_rpm = 1000.0", f"speed_rpm = {speed}")
    file = load(written_reducer(folder, text, PHASED))
    solved = solve_load(file.model, file.model.sections.loads[0], {}, 6, trains=trains_once(file, PHASED))
    motion = Motion(harmonics=3, highest_frequency_Hz=4e3)
    response = respond(file.model, solved, {}, motion, np.linspace(800.0, 4000.0, 12))
    (source,) = response.sources
    return response, source


def test_a_set_run_the_other_way_by_the_other_torque_is_its_image_and_one_run_backwards_is_not(tmp_path):
    """Its lines are the same; harmonics of the meshes come in the opposite order of time then, which damping tells."""
    speeds = np.array([60.0])
    forwards, image, backwards = (
        in_a_gearbox(tmp_path, torque, speed)
        for torque, speed in ((300.0, 1000.0), (-300.0, -1000.0), (-300.0, 1000.0))
    )
    expected = abs(forwards[0].bearing_forces(forwards[1].lines.readings))[..., :3]
    for (response, source), same in ((image, True), (backwards, False)):
        assert_allclose(source.frequency_Hz(speeds), forwards[1].frequency_Hz(speeds))
        found = abs(response.bearing_forces(source.lines.readings))[..., :3]
        assert (abs(found - expected).max() < 1e-6 * expected.max()) == same


def alone(text, crowning=0.0, **motion):
    """A set by itself in motion, its sun's flanks with some crowning, um."""
    (file, train), speeds = set_and_train(text), (400.0, 3000.0, 9000.0)
    meshes = [
        replace(mesh, assembly=replace(mesh.assembly, pinion=Modification(profile_crowning_um=crowning)))
        if 0 in mesh.bodies else mesh for mesh in train.meshes
    ]  # fmt: skip
    train = replace(train, meshes=tuple(meshes))
    solution = solve_set(
        file.plan, train, np.array([file.plan.torque_Nm]), file.angles_per_pitch, file.plan.cycle
    )
    return respond_set(file, solution, 0, Motion(harmonics=3, **motion), np.array(speeds))


def on_a_housing(folder):
    """A reducer on a housing with mass and a surface, which is not alike all around: mean stiffness."""
    rng = np.random.default_rng(5)
    for name, scale, more in (("stiffness", 1e4, 3e5), ("mass", 1e-4, 5e-3), ("surface", 1.0, 0.0)):
        rows = rng.standard_normal((12, 12))
        np.savetxt(folder / f"{name}.csv", scale * rows.T @ rows + more * np.eye(12), delimiter=",")
    held = '[housing]\nstiffness = "stiffness.csv"\nmass = "mass.csv"\nsurface = "surface.csv"\n'
    file = load(written_reducer(folder, one_stage("1e5", "1e9") + held, PHASED))
    solved = solve_load(file.model, file.model.sections.loads[0], {}, 6, trains=trains_once(file, PHASED))
    return respond(file.model, solved, {}, Motion(harmonics=3, highest_frequency_Hz=4e3), np.array([800.0, 2000.0]))


def rms_with(response, source, cycle, target, place):
    """Of a target by the lines of the only set, solved with another cycle of its meshes."""
    (one,), (of_set,), own = response.machine.sets, response.cycles, source.ports
    acting = source.of_set.answer(cycle)
    orders = source.orders[:: len(source.orders) // acting.shape[1]]
    readings = np.stack([order.readings(own, acting[:, n]) for n, order in enumerate(orders)], axis=1)
    if of_set.blades.carried:
        readings = one.in_housing(readings)
    if target.kind == "bearing":
        squares = (abs(response.bearing_forces(readings)[..., target.number, :3]) ** 2).sum(axis=-1)
    elif target.kind == "power":
        omega = 2.0 * np.pi * source.frequency_Hz(response.speeds_rpm)
        normal = response.housing(readings) @ response.machine.surface.T
        squares = AIR * omega**2 * (abs(normal) ** 2).sum(axis=-1)
    else:
        moved = np.stack(
            [np.einsum("sab,sb->sa", order.ports(own, own), acting[:, n]) for n, order in enumerate(orders)], axis=1
        )
        squares = over_planets(of_set, acting - moved @ of_set.tangent.T, moved)[0][..., 0] ** 2
    return np.sqrt(2.0 * (squares * source.told[:, : squares.shape[1]]).sum(axis=1))[place]


@pytest.mark.parametrize(
    "machine",
    ["on a housing", *(pytest.param(name, marks=pytest.mark.slow) for name in ("as one", "each", "constant"))],
)
def test_what_a_micrometre_does_in_a_set_is_the_difference_of_its_solutions(monkeypatch, tmp_path, machine):
    """Equal planets as one, a planet missing, mean stiffness, and radiated power on a housing: of the sun's flanks."""
    missing = PHASED.replace("count = 3", "count = 3\nmissing = [2]") + SPRINGS
    if machine == "on a housing":
        response = on_a_housing(tmp_path)
        assert "alike" in response.sources[0].why_constant
    elif machine == "constant":
        response = alone(PHASED + SPRINGS, mesh_stiffness="mean")
    else:
        response = alone(PHASED + SPRINGS if machine == "as one" else missing)
    source, meshes, places = passing_at(response, 0)
    parameter, speed, step = "pinion.profile_crowning_um", float(response.speeds_rpm[1]), 0.005
    monkeypatch.setattr("pmor.dynamics.whine.gradient.STEP", step)  # no section begins to carry within it
    targets = [Target("bearing", speed, 0), Target("mesh", speed), Target("power", speed)]
    targets = targets if machine == "on a housing" else targets[:2]
    (found,) = changes(response, 0, targets, [parameter])
    for target, rate in zip(targets, found.targets, strict=True):
        ends = [
            rms_with(response, source, cycle_with(meshes, places, parameter, way * step), target, 1)
            for way in (-1.0, 1.0)
        ]
        assert abs(rate) > 1e-3 * ends[0]
        assert_allclose(rate, (ends[1] - ends[0]) / (2.0 * step), rtol=1e-5)


def test_a_micrometre_of_the_suns_crowning_does_to_a_set_what_two_full_runs_say():
    """Solved anew with a quarter of a micrometre more and less, all planets at once."""
    ends = [alone(PHASED + SPRINGS, amount).rms.bearings[1, 2] for amount in (0.25, -0.25)]
    (found,) = changes(alone(PHASED + SPRINGS), 0, [Target("bearing", 3000.0, 2)], ["pinion.profile_crowning_um"])
    assert_allclose(found.targets[0], 2.0 * (ends[0] - ends[1]), rtol=1e-3)


@pytest.mark.parametrize(
    ("planets", "words"),
    [("count = 2", "evenly spaced"), ("count = 4\nmissing = [2]", "evenly spaced"),
     ("count = 3\n[eccentricity]\nsun_um = 5.0", "repeat with each mesh cycle")],
)  # fmt: skip
def test_planets_that_are_not_even_on_a_carrier_that_turns_are_refused(tmp_path, planets, words):
    motion = "[dynamics]\nspeed_range_rpm = [800.0, 1000.0]\nspeeds = 2\n"
    file = load(written_reducer(tmp_path, one_stage() + motion, EVEN_SET.replace("count = 3", planets)))
    with pytest.raises(CaseError, match=words):
        run(file)
