"""Planetary sets in small motion: published natural frequencies, coordinates that stand still against integration in
the carrier's frame, and what phasing forbids."""

import math
from functools import partial

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.linalg import expm, null_space

from pmor.body.beam import NODE
from pmor.dynamics.whine.blades import Blades
from pmor.dynamics.whine.hill import MeshCycle
from pmor.dynamics.whine.modal import closed, modes_of, receptance_of, transfer
from pmor.dynamics.whine.planets import HUBS, planet_matrices
from pmor.dynamics.whine.set_cycle import SetCycle
from pmor.dynamics.whine.set_response import mesh_forces_of, over_planets, set_excitation
from pmor.gear.inertia import Inertia
from tests.support.planets_in_motion import CARRIER, COLUMN, PLANET, RADIUS, RING, SUN, PlanarSet, machine_of

LIN_PARKER = partial(
    PlanarSet, mass={SUN: 0.4, RING: 2.35, CARRIER: 5.43, PLANET: 0.66},
    inertia={SUN: 0.39, RING: 3.0, CARRIER: 6.29, PLANET: 0.61}, mesh=(5e8, 5e8),
    bearing=dict.fromkeys((SUN, RING, CARRIER, PLANET), 1e8), torsion={RING: 1e9}, alpha_deg=24.6,
)  # fmt: skip
# Rotational, translational and planet modes, Hz. Of four planets the paper's 727.0 and 1091.0 are 727.27 and 1091.16.
LIN_PARKER_HZ = {
    3: ([0.0, 1475.7, 1930.3, 2658.3, 7462.8, 11775.3], [743.2, 1102.4, 1896.0, 2276.4, 6986.3, 9647.9], []),
    4: ([0.0, 1536.6, 1970.6, 2625.7, 7773.6, 13071.1], [727.27, 1091.16, 1892.8, 2342.5, 7189.9, 10437.6],
        [1808.2, 5963.8, 6981.7]),
    5: ([0.0, 1567.4, 2006.1, 2614.8, 8065.4, 14253.1], [710.0, 1072.0, 1888.1, 2425.3, 7382.4, 11172.3],
        [1808.2, 5963.8, 6981.7]),
}  # fmt: skip
COOLEY_PARKER = partial(
    PlanarSet, mass={SUN: 3.0, RING: 7.64, CARRIER: 12.0, PLANET: 1.86},
    inertia={SUN: 1.75, RING: 8.09, CARRIER: 6.80, PLANET: 1.25}, mesh=(1e8, 1e8),
    bearing={SUN: 2e7, RING: 1e8, CARRIER: 5e7, PLANET: 1e7}, torsion={SUN: 2e7, RING: 1e8, CARRIER: 1e8},
    alpha_deg=20.0,
)  # fmt: skip
# At rest, over sqrt(k_p / m_p).
COOLEY_PARKER_RATIO = {
    3: ([0.9296, 1.090, 1.358, 1.931, 5.566, 7.741], [0.7432, 1.018, 1.265, 1.487, 4.976, 6.282], []),
    4: ([0.9077, 1.046, 1.317, 2.013, 5.809, 8.383], [0.7199, 1.001, 1.317, 1.481, 5.153, 6.488],
        [0.9617, 4.320, 5.672]),
    5: ([0.8802, 1.019, 1.281, 2.090, 6.030, 8.986], [0.6992, 0.9863, 1.344, 1.496, 5.317, 6.693],
        [0.9617, 4.320, 5.672]),
}  # fmt: skip
# Digits that the papers print: one after the point, and four.
FIRST_DIGIT, FOUR_DIGITS = 0.066, 6e-4
# Of a rotation that nothing holds: the root of round-off.
AT_REST = 1e-3
TURN = np.array([[0.0, -1.0], [1.0, 0.0]])


def by_family(found, planets):
    """Frequencies of each family, those of several modes once; each as often as the structure of modes has it."""
    times = (1, 2, max(planets - 3, 1))
    for modes, count in zip(found, times, strict=True):
        assert len(modes) in (0, 6 * count, 3 * count)
        assert_allclose(modes.reshape(-1, count), np.tile(modes[::count], (count, 1)).T, rtol=1e-6, atol=AT_REST)
    return [modes[::count] for modes, count in zip(found, times, strict=True)]


@pytest.mark.parametrize("planets", [3, 4, 5])
def test_families_have_the_frequencies_of_lin_and_parker(planets):
    """J. Vib. Acoust. 121 (1999) 316, table 1."""
    for found, published in zip(by_family(LIN_PARKER(planets).modes(), planets), LIN_PARKER_HZ[planets], strict=True):
        assert_allclose(found, published, atol=FIRST_DIGIT)


@pytest.mark.parametrize("planets", [3, 4, 5])
def test_families_have_the_frequencies_of_cooley_and_parker(planets):
    """J. Vib. Acoust. 134 (2012), table 1."""
    scale = 2.0 * math.pi / math.sqrt(1e7 / 1.86)
    found = by_family(COOLEY_PARKER(planets).modes(), planets)
    for own, published in zip(found, COOLEY_PARKER_RATIO[planets], strict=True):
        assert_allclose(scale * own, published, rtol=FOUR_DIGITS)


def test_rotation_alone_has_the_frequencies_of_kahraman():
    """J. Sound Vib. 173 (1994) 125, of a ring that is held: the carrier's mass holds that of planets."""
    held = {"bearing": {}, "torsion": {RING: "rigid"}, "held": (SUN, CARRIER, RING)}
    one = PlanarSet(3, {}, {SUN: 2.0, CARRIER: 4.0, PLANET: 3.0, RING: 1.0}, (7.0, 11.0), **held)
    rotational, translational, _ = one.modes()
    assert_allclose(rotational[1:], [0.508728970094716, 0.707886793423852], atol=1e-12)
    assert_allclose(translational, math.sqrt(18.0 / 3.0) / (2.0 * math.pi), atol=1e-12)
    assert_allclose(translational, 0.389848400616838, atol=1e-12)
    assert rotational[0] < 1e-6


def carrier_frame(one):
    """Mass and stiffness of all bodies in the carrier's frame, x, y and r times the angle; what closes the meshes,
    which are not in it; the housing's springs.

    Written as the papers have it: bodies are sun, ring, carrier and planets; N, mm, t.
    """
    count, closing = 3 + one.planets, []
    mass, stiffness = np.zeros((2, 3 * count, 3 * count))
    names = [SUN, RING, CARRIER, *[PLANET] * one.planets]
    for body, name in enumerate(names):
        mass[range(3 * body, 3 * body + 3), range(3 * body, 3 * body + 3)] = 1e-3 * np.array(
            [one.mass[name], one.mass[name], one.inertia[name]]
        )
        if name != PLANET:
            stiffness[3 * body + 2, 3 * body + 2] += 1e-3 * one.torsion.get(name, 0.0)
    alpha = math.radians(one.alpha_deg)
    for planet, psi in enumerate(one.blades.directions, start=3):
        radial, around = np.array([-math.sin(psi), math.cos(psi)]), -np.array([math.cos(psi), math.sin(psi)])
        meshes = ((0, math.cos(alpha) * around + math.sin(alpha) * radial, 1.0),
                  (1, math.cos(alpha) * around - math.sin(alpha) * radial, -1.0))  # fmt: skip
        springs = []
        for body, direction, spin in meshes:
            row = np.zeros(3 * count)
            row[3 * body : 3 * body + 3] = *direction, 1.0
            row[3 * planet : 3 * planet + 3] = *-direction, spin
            closing.append(row)
        for way, turn in ((radial, 0.0), (around, 1.0)):
            row = np.zeros(3 * count)
            row[6:9], row[3 * planet : 3 * planet + 2] = [*way, turn], -way
            springs.append((row, one.bearing[PLANET]))
        stiffness += sum(1e-3 * spring * np.outer(row, row) for row, spring in springs)
    housing = [1e-3 * np.array(one.across.get(name, (one.bearing[name],) * 2)) for name in names[:3]]
    return mass, stiffness, np.array(closing), housing


def test_coordinates_that_stand_still_are_integration_in_the_carriers_frame_on_any_housing():
    """Free motion from random velocities over two thirds of a turn, the housing twice as stiff one way as the other."""
    speed, time = 2000.0, 2e-3
    across = {SUN: (1e8, 3e8), RING: (5e7, 1e8), CARRIER: (2e8, 1e8)}
    one = LIN_PARKER(4, across=across, carrier=1.0, first_deg=17.0)
    mass, stiffness, closing, housing = carrier_frame(one)
    stiffness += closing.T @ np.diag(np.tile(1e-3 * np.array(one.mesh), one.planets)) @ closing
    size = len(mass)
    spinning = np.kron(np.eye(size // 3), np.pad(TURN, (0, 1)))
    inert = 2.0 * speed * mass @ spinning
    inner = stiffness + speed**2 * mass @ spinning @ spinning

    def rate(now, state):
        angle = speed * now
        back = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
        force = -inner @ state[:size] - inert @ state[size:]
        for body, springs in enumerate(housing):
            force[3 * body : 3 * body + 2] -= back @ (springs * (back.T @ state[3 * body : 3 * body + 2]))
        return np.concatenate([state[size:], force / np.diag(mass)])

    start = np.concatenate([np.zeros(size), np.random.default_rng(3).normal(size=size)])
    expected = solve_ivp(rate, (0.0, time), start, "DOP853", rtol=1e-11, atol=1e-14).y[:size, -1]

    # The same motion in coordinates that stand still.
    inertia, springs, gyroscopic, centrifugal, held = one.matrices
    free = null_space(held)
    shown = np.zeros((size, len(inertia)))
    for body, first in enumerate(COLUMN[name] for name in (SUN, RING, CARRIER)):
        shown[3 * body : 3 * body + 3, [first, first + 1, first + 5]] = np.diag([1.0, 1.0, RADIUS])
    for planet in range(one.planets):
        rows = NODE * (2 + planet)
        shown[9 + 3 * planet : 12 + 3 * planet] = one.coordinates.bodies[[rows, rows + 1, rows + 5]]
        shown[11 + 3 * planet] *= RADIUS
    turning = speed * one.coordinates.turning
    reduced = np.linalg.solve(
        free.T @ inertia @ free,
        np.hstack([-free.T @ (springs + speed**2 * centrifugal) @ free, -speed * free.T @ gyroscopic @ free]),
    )
    begin = np.linalg.lstsq(shown @ free, start[size:], rcond=None)[0]
    count = free.shape[1]
    whole = np.vstack([np.hstack([np.zeros((count, count)), np.eye(count)]), reduced])
    moved = expm(time * whole) @ np.concatenate([np.zeros(count), begin])
    found = shown @ expm(time * turning) @ free @ moved[:count]
    assert_allclose(found, expected, atol=1e-7 * abs(expected).max())
    assert_allclose(gyroscopic, -gyroscopic.T, atol=1e-12 * abs(gyroscopic).max())
    assert_allclose(centrifugal, centrifugal.T, atol=1e-12 * abs(centrifugal).max())


def varying(one, teeth, harmonics):
    """Random forces, and stiffness that varies, of meshes one after the other; bodies couple neighbours."""
    rng, count = np.random.default_rng(5), one.planets
    most = 2 * harmonics
    later = np.exp(-1j * np.outer(np.arange(most + 1), teeth * (one.blades.directions - one.blades.directions[0])))
    force = rng.normal(size=(harmonics + 1, 1, 2)) + 1j * rng.normal(size=(harmonics + 1, 1, 2))
    force = (force * later[: harmonics + 1, :, None]).reshape(harmonics + 1, -1)
    force[0] = 0.0
    tangent = np.zeros((most + 1, count, 2, count, 2), dtype=complex)
    for harmonic in range(1, most + 1):
        own, beside = rng.normal(size=(2, 2, 2)) * 1e5 / harmonic**2
        for planet in range(count):
            tangent[harmonic, planet, :, planet] = own * later[harmonic, planet]
            tangent[harmonic, planet, :, (planet + 1) % count] += 0.3 * beside * later[harmonic, planet]
    tangent = tangent.reshape(most + 1, 2 * count, 2 * count)
    tangent[0] = np.diag(np.tile(1e-3 * np.array(one.mesh), count))
    return MeshCycle(force, tangent)


def excited(one, meshes, harmonics, speeds, teeth):
    """Response of a planar set without damping, all of its modes taken."""
    machine, load = machine_of(one, teeth), np.zeros(2 * one.planets)
    cycle = SetCycle(meshes, load, 1, one.blades, one.carrier != 0.0, 0.0)
    stiffness = closed(machine, one.tangent)
    modes = modes_of(machine, stiffness, 1e5)
    receptance = receptance_of(machine, stiffness, modes, machine.meshes, machine.meshes, 0.0)
    at_rest = transfer(receptance, np.zeros(1)).ports[0].real
    (moving,) = machine.sets
    return moving, cycle, set_excitation(receptance, at_rest, moving, cycle, harmonics, speeds, 1.0)


@pytest.mark.parametrize("planets", [3, 4, 5])
def test_planets_that_are_one_in_hills_equations_are_all_of_them_in_the_carriers_frame(planets):
    """Every harmonic of all bodies at once, without damping, and no line astray; the sun's 17 teeth pass them.

    The sun is held about the axis: Coriolis forces on a rotation that nothing holds are left out, which is 3e-7.
    """
    harmonics, teeth, speed = 4, 17, 150.0
    held = {SUN: 1e8, RING: 1e9}
    one = LIN_PARKER(planets, carrier=0.25, spins=(1.0, 0.0, 0.0), first_deg=17.0, torsion=held)
    meshes = varying(one, teeth, harmonics + 1)
    moving, cycle, found = excited(one, meshes, harmonics, np.array([speed]), teeth)
    assert found.why_constant == ""
    forces = mesh_forces_of(moving, cycle, found.lines, found.orders, found.varying)

    mass, stiffness, closing, housing = carrier_frame(one)
    for body, springs in enumerate(housing):
        stiffness[[3 * body, 3 * body + 1], [3 * body, 3 * body + 1]] += springs
    size, spinning, turns = len(mass), np.kron(np.eye(len(mass) // 3), np.pad(TURN, (0, 1))), 0.25 * speed
    orders = np.arange(-harmonics - 1, harmonics + 2)
    signed = np.concatenate([meshes.tangent[:0:-1].conj(), meshes.tangent])
    between = signed[orders[:, None] - orders + len(meshes.tangent) - 1]
    whole = np.einsum("mi,nlmk,kj->nilj", closing, between, closing).reshape(len(orders) * size, -1)
    for place, order in enumerate(orders):
        omega, own = order * 12.75 * speed, slice(place * size, (place + 1) * size)
        inert = -(omega**2) * mass + 2j * omega * turns * mass @ spinning + turns**2 * mass @ spinning @ spinning
        whole[own, own] += stiffness + inert
    acting = np.concatenate([meshes.force[:0:-1].conj(), meshes.force])
    moved = np.linalg.lstsq(whole, (acting @ closing).ravel(), rcond=1e-14)[0].reshape(len(orders), size) @ closing.T
    expected = acting - np.einsum("nlmk,lk->nm", between, moved)
    for harmonic in range(1, harmonics + 1):
        own = expected[harmonic + harmonics + 1]
        assert_allclose(forces[harmonic, 0][0], own, atol=1e-7 * abs(own).max())
    # The mean of all planets that a gearbox is told is that of each one.
    for number, line in enumerate(found.lines):
        order, acting = found.orders[number], found.varying[0, number]
        moved = order.ports(moving.own, moving.own)[0] @ acting
        told, _ = over_planets(cycle, acting - cycle.tangent @ moved, moved)
        assert_allclose(told, abs(forces[line.harmonic, 0][0, :2]), rtol=1e-6)
    largest = max(abs(force).max() for force in forces.values())
    assert max(abs(force).max() for (_, sideband), force in forces.items() if sideband) < 1e-9 * largest


def test_each_class_of_harmonics_arrives_at_one_line_in_the_housing():
    """17 teeth and four planets: h 17 mod 4 is 1, 2, 3, 0. The ring is held, with 51 teeth.

    Lines that move central members are at multiples of four turns of the carrier (McFadden & Smith, Proc. IMechE 199 C,
    1985).
    """
    one = LIN_PARKER(4, carrier=0.25, spins=(1.0, 0.0, 0.0))
    _, _, found = excited(one, varying(one, 17, 5), 4, np.array([100.0]), 17)
    assert [(line.harmonic, line.sideband) for line in found.lines] == [(1, 1), (2, 0), (3, -1), (4, 0)]
    assert_allclose([line.order for line in found.lines], [13.0, 25.5, 38.0, 51.0])
    moving = [line.order / 0.25 for line in found.lines if line.harmonic != 2]
    assert_allclose(np.mod(moving, 4.0), 0.0, atol=1e-9)


def test_on_a_housing_that_is_not_alike_all_around_stiffness_that_varies_is_not_found_and_said_so():
    """Planets see their motion at two turns of the carrier beside the mesh frequency then."""
    across = {RING: (1e8, 3e7)}
    one = LIN_PARKER(4, across=across, carrier=0.25, spins=(1.0, 0.0, 0.0))
    moving, cycle, found = excited(one, varying(one, 17, 5), 4, np.array([100.0]), 17)
    assert "alike" in found.why_constant
    assert found.varying is found.constant
    forces = mesh_forces_of(moving, cycle, found.lines, found.orders, found.constant)
    assert {sideband for (harmonic, sideband) in forces if abs(forces[harmonic, sideband]).max() > 1e-6} == {-2, 0, 2}


def test_around_a_carrier_that_stands_still_equal_planets_are_solved_alike_as_one_and_all_together():
    """With an even housing both are the same equations; all together is what unequal ones take."""
    one = LIN_PARKER(3, spins=(1.0, 0.0, 0.0))
    meshes, speeds = varying(one, 17, 4), np.array([90.0, 140.0])
    as_one = excited(one, meshes, 3, speeds, 17)[2]
    force = meshes.force.copy()
    force[1:, 0] *= 1.0 + 1e-5  # of one planet, more than equal ones may have
    together = excited(one, MeshCycle(force, meshes.tangent), 3, speeds, 17)[2]
    assert as_one.why_constant == together.why_constant == ""
    known = {(line.harmonic, line.sideband): n for n, line in enumerate(together.lines)}
    for number, line in enumerate(as_one.lines):
        own, other = as_one.varying[:, number], together.varying[:, known[line.harmonic, line.sideband]]
        assert_allclose(other, own, atol=1e-4 * abs(own).max())


def test_mean_stiffness_of_unequal_planets_is_theirs_where_they_stand_and_a_mean_where_they_turn():
    """Around the axis it is then the same whatever way one looks."""
    blades = LIN_PARKER(4).blades
    stiffness = np.diag([1.0, 2.0, 1.0, 2.0, 5.0, 2.0, 1.0, 2.0])
    meshes = MeshCycle(np.zeros((2, 8), dtype=complex), stiffness[None].astype(complex))
    still, turning = (SetCycle(meshes, np.zeros(8), 1, blades, turns, 0.0).tangent for turns in (False, True))
    each = np.linalg.inv(np.kron(blades.matrix, np.eye(2)))
    assert_allclose(each.T @ still @ each, stiffness, atol=1e-12)
    around = np.kron(blades.turning, np.eye(2))
    assert_allclose(around.T @ turning + turning @ around, 0.0, atol=1e-12)


def test_planets_that_tilt_whirl_as_rotors_do():
    """In the housing, a spinning disc on a spring against tilting: I w^2 - s I_p w - k = 0; seen by coordinates that
    turn with the carrier, and by cos and sin of its place, a turn of the carrier less, none and two."""
    polar, tilting, spring, carrier, spin = 8.0, 5.0, 4e5, 30.0, -200.0
    one = LIN_PARKER(3, first_deg=17.0)
    inertia = [Inertia(1.0, 1e-3 * polar, 1e-3 * tilting)] * 5
    compliance = np.zeros_like(one.compliance)
    tilts = NODE * (2 + np.arange(3))[:, None] + np.array([3, 4])
    compliance[tilts, tilts] = 1.0 / spring
    found = planet_matrices(one.coordinates, inertia, compliance, 0.0 * one.free, carrier, [0.0, 0.0, *[spin] * 3])
    free = null_space(np.vstack([found.constraints, np.eye(HUBS, len(found.mass))]))
    assert free.shape[1] == 6
    mass, gyroscopic, stiffness = (
        free.T @ matrix @ free for matrix in (found.mass, found.gyroscopic, found.stiffness + found.centrifugal)
    )
    whole = np.block([[np.zeros((6, 6)), np.eye(6)], [-np.linalg.solve(mass, np.hstack([stiffness, gyroscopic]))]])
    own = np.roots([tilting, -spin * polar, -spring])
    expected = np.abs(np.concatenate([own, own - carrier, own - 2.0 * carrier]))
    found_omega = np.sort(np.abs(np.linalg.eigvals(whole).imag))[::2]
    assert_allclose(found_omega, np.sort(expected), rtol=1e-9)


@pytest.mark.parametrize(("places_deg", "even"), [((0, 120, 240), True), ((0, 180, 90, 270), True), ((0, 180), False),
                                                  ((0, 110, 240), False), ((0, 90, 180), False)])  # fmt: skip
def test_planets_are_even_where_they_are_three_and_as_far_from_each_other(places_deg, even):
    """In any order of counting."""
    assert Blades(np.radians(places_deg)).even == even


def test_coordinates_at_an_angle_are_the_sum_of_their_lines():
    """1, cos and sin of the places that planets have turned to."""
    blades = Blades(np.radians(20.0) + 2.0 * np.pi * np.arange(5) / 5)
    turned = blades.directions + 0.7
    assert_allclose(blades.at(0.7)[:, :3], np.column_stack([np.ones(5), np.cos(turned), np.sin(turned)]), atol=1e-14)
    rate = (blades.at(0.7 + 1e-6) - blades.at(0.7 - 1e-6)) / 2e-6
    assert_allclose(rate, blades.at(0.7) @ blades.turning, atol=1e-8)
