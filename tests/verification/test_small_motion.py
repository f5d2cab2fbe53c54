"""A machine in small motion: inertia of shafts against closed forms, receptances against the whole system of equations.

The box is that of `tests/support/gearboxes.py`, two helical stages.
"""

import math
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh

from pmor.body.beam import NODE, Beam, CircularSection, ShaftMaterial, refined
from pmor.case.motion import Motion
from pmor.core.errors import ConvergenceError
from pmor.dynamics.whine.arrays import line_columns
from pmor.dynamics.whine.coherent import coherent_meshes
from pmor.dynamics.whine.cycle import settled_pair, standing_meshes
from pmor.dynamics.whine.hill import hill, mesh_forces, moved
from pmor.dynamics.whine.modal import closed, modes_of, receptance_of, transfer, truncation
from pmor.dynamics.whine.moving import bearing_rows, moving_machine
from pmor.dynamics.whine.readings import line_words
from pmor.dynamics.whine.respond import responded
from pmor.gear.modification import Modification, Wave
from pmor.line.hub_law import laws_at, mesh_coordinates
from pmor.machine.coupled import condition_of, solve_load
from pmor.machine.loader import load
from pmor.machine.run import meshes_and_trains
from tests.support.gearboxes import written

STEEL, DENSITY = ShaftMaterial(210e3, 0.3), 7.81e-9
# First twelve natural frequencies of an element are within this of those of an endless refinement, and the modes that
# a receptance has up to twice the highest frequency leave of it.
ELEMENTS, CUT = 2e-3, 2e-3
ROUNDING = 1e-9
HIGHEST, RATIO = 9000.0, 0.02
# Of ghost orders of a wave of 0.01 um: what goes with its square, and that at other orders.
FIRST_ORDER, SQUARE = 2e-2, 1e-2


def shaft(elements):
    return Beam(np.linspace(0.0, 1000.0, elements + 1), [CircularSection(50.0)] * elements, STEEL)


def test_a_shaft_of_many_elements_has_the_mass_and_the_inertia_of_its_body():
    """Rigid motions: along, across, about the axis and about a diameter through the middle."""
    beam, radius = shaft(7), 25.0
    inertia = beam.inertia(DENSITY)
    mass = math.pi * radius**2 * 1000.0 * DENSITY
    along, tilted, other = np.zeros((3, NODE * len(beam.stations)))
    along[0::NODE] = 1.0
    tilted[1::NODE], tilted[5::NODE] = beam.stations - 500.0, 1.0
    other[2::NODE], other[4::NODE] = 500.0 - beam.stations, 1.0
    assert_allclose(along @ inertia.mass @ along, mass, rtol=ROUNDING)
    assert_allclose(tilted @ inertia.mass @ tilted, mass * (3.0 * radius**2 + 1000.0**2) / 12.0, rtol=ROUNDING)
    assert_allclose(other @ inertia.gyroscopic @ tilted, 0.5 * mass * radius**2, rtol=ROUNDING)
    assert_allclose(inertia.gyroscopic, -inertia.gyroscopic.T)


def test_axial_and_torsional_frequencies_of_a_free_shaft_are_those_of_a_bar():
    """n c / (2 L), of the elements' own quadratic error."""
    beam = shaft(40)
    square = eigh(beam.stiffness(), beam.inertia(DENSITY).mass, eigvals_only=True)
    found = np.sqrt(np.maximum(square, 0.0)) / (2.0 * np.pi)
    for modulus in (STEEL.youngs_modulus, STEEL.shear_modulus):
        exact = math.sqrt(modulus / DENSITY) / 2000.0
        assert abs(found / exact - 1.0).min() < ELEMENTS


def test_first_bending_frequency_of_a_free_shaft_converges_to_that_of_a_timoshenko_beam():
    """229.28 Hz; one element alone has 275. Finer elements come to it from above (Rayleigh)."""
    first = [
        math.sqrt(eigh(shaft(n).stiffness(), shaft(n).inertia(DENSITY).mass, eigvals_only=True)[6]) / (2.0 * np.pi)
        for n in (1, 4, 16)
    ]
    assert_allclose(first, (275.52, 229.64, 229.29), rtol=1e-4)


def test_refined_stations_keep_those_that_were_there():
    """And no element is longer than it may be."""
    stations = np.array([0.0, 10.0, 35.0, 36.0])
    finer = refined(stations, 4.0)
    assert np.diff(finer).max() <= 4.0 + ROUNDING
    assert all(abs(finer - place).min() < ROUNDING for place in stations)


@cache
def loaded_box():
    with TemporaryDirectory() as folder:
        file = load(written(Path(folder)))
    pairs, trains = meshes_and_trains(file)
    solved = solve_load(file.model, file.model.sections.loads[0], pairs, 16, trains=trains)
    machine = moving_machine(file.model, solved, HIGHEST)
    cycles = [mesh.cycle() for mesh in standing_meshes(solved, pairs, 4)]
    tangent = np.zeros((2 * len(cycles), 2 * len(cycles)))
    for number, cycle in enumerate(cycles):
        rows = slice(2 * number, 2 * number + 2)
        tangent[rows, rows] = cycle.mean
    return solved, pairs, machine, cycles, closed(machine, tangent)


def receptance(highest):
    solved, _, machine, _, stiffness = loaded_box()
    modes = modes_of(machine, stiffness, highest)
    readings = np.concatenate(bearing_rows(machine, solved))
    return receptance_of(machine, stiffness, modes, machine.meshes, readings, RATIO)


def whole(omega, spin):
    """Receptances by one dense solution of all displacements, damped alike."""
    solved, _, machine, _, stiffness = loaded_box()
    free = machine.free
    stiff, mass = free.T @ stiffness @ free, free.T @ machine.mass @ free
    square, shape = eigh(stiff, mass)
    damping = mass @ shape @ np.diag(2.0 * RATIO * np.sqrt(np.maximum(square, 0.0))) @ shape.T @ mass
    matrix = stiff - omega**2 * mass + 1j * omega * (damping + spin * free.T @ machine.gyroscopic @ free)
    answer = free @ np.linalg.solve(matrix, (machine.meshes @ free).T)
    return machine.meshes @ answer, np.concatenate(bearing_rows(machine, solved)) @ answer


@pytest.mark.parametrize("share", [0.02, 0.3, 1.0])
@pytest.mark.parametrize("spin", [0.0, 300.0])
def test_receptances_by_modes_are_those_of_all_displacements(share, spin):
    """Up to half of the highest mode, what is left acts as at rest."""
    omega = 2.0 * np.pi * share * HIGHEST
    exact = whole(omega, spin)
    found = transfer(receptance(2.0 * HIGHEST), np.array([omega]), np.array([spin]))
    for own, all_of_it in zip((found.ports[0], found.readings[0][: len(exact[1])]), exact, strict=True):
        assert abs(own - all_of_it).max() < CUT * abs(all_of_it).max()


def test_all_modes_are_the_whole_machine():
    """With gyroscopic moments, at a frequency beyond what a few modes hold."""
    omega = 2.0 * np.pi * 1.7 * HIGHEST
    exact = whole(omega, 400.0)
    found = transfer(receptance(1e8), np.array([omega]), np.array([400.0]))
    assert_allclose(found.ports[0], exact[0], atol=1e-8 * abs(exact[0]).max())


@pytest.mark.parametrize("highest", [700.0, 20000.0])
def test_static_limit_is_exact_with_any_number_of_modes(highest):
    """At rest modes and what they leave are the static compliance, and bearing forces those of the loads."""
    exact = whole(1e-4, 0.0)
    found = transfer(receptance(highest), np.array([0.0]))
    assert_allclose(found.ports[0].real, exact[0].real, atol=1e-8 * abs(exact[0]).max())
    assert_allclose(found.readings[0, : len(exact[1])].real, exact[1].real, atol=1e-8 * abs(exact[1]).max())


def test_receptances_between_meshes_are_reciprocal():
    """Without gyroscopic moments the matrix is symmetric, damped too."""
    ports = transfer(receptance(HIGHEST), 2.0 * np.pi * np.array([210.0, 1900.0])).ports
    assert_allclose(ports, ports.transpose(0, 2, 1), atol=ROUNDING * abs(ports).max())


def test_tangents_on_the_coordinates_are_the_slopes_of_the_forces():
    """Of a mesh whose hubs move along both: central differences, and symmetric."""
    solved, pairs, *_ = loaded_box()
    mesh = solved.meshes[0]
    reduced = pairs[mesh.meshing.key]
    columns, condition = mesh_coordinates(reduced.meshed.pair), condition_of(reduced, mesh.torque)
    phi = np.linspace(0.0, reduced.meshed.pair.pitch, 5, endpoint=False)
    displacement = mesh.displacement.ravel() + 0.0
    displacement[5] = 1e-3 * mesh.sweep.ste_um.mean() / reduced.meshed.pair.pinion.base_radius
    places = [columns.T @ displacement]
    for number, step in enumerate((1e-6, 1e-8)):
        move = step * np.linalg.pinv(columns.T)[:, number]
        places += [columns.T @ (displacement + sign * move) for sign in (1.0, -1.0)]
    law = laws_at(reduced.lines, phi, condition, np.array(places))
    tangent = law.tangent[0]
    for number, step in enumerate((1e-6, 1e-8)):
        ends = law.force[1 + 2 * number : 3 + 2 * number]
        slope = (ends[1] - ends[0]) / (2.0 * step)
        assert_allclose(slope, tangent[:, :, number], atol=2e-3 * abs(tangent[:, :, number]).max())
    assert_allclose(tangent, tangent.transpose(0, 2, 1), rtol=1e-12)


def test_mean_force_under_the_load_is_that_of_its_torque():
    """The deflection about which motion is small gives the load that the machine is in balance with."""
    solved, pairs, *_ = loaded_box()
    for mesh, standing in zip(solved.meshes, standing_meshes(solved, pairs, 4), strict=True):
        law = standing.law()
        assert_allclose(standing.load[0], mesh.force, rtol=1e-4)
        assert_allclose(law.force.mean(axis=0), standing.load, rtol=1e-5)


def test_hill_agrees_with_the_equations_over_the_cycle():
    """Motion put into w - k x sample by sample has the mesh forces that its harmonics tell."""
    _, _, machine, cycles, _ = loaded_box()
    cycle, count, samples = cycles[0], len(cycles[0].force), 64
    omega = 2.0 * np.pi * 400.0 * np.arange(count)
    own = transfer(receptance(2.0 * HIGHEST), omega).ports[None, :, :2, :2]
    closing = hill(cycle, own)
    forces, coordinates = mesh_forces(cycle.mean, own, closing)[0], moved(own, closing)[0]

    def signal(harmonics):
        padded = np.zeros((samples // 2 + 1, *harmonics.shape[1:]), dtype=complex)
        padded[: len(harmonics)] = harmonics
        return np.fft.irfft(padded * samples, samples, axis=0)

    varying = np.einsum("abc,ac->ab", signal(cycle.tangent), signal(coordinates))
    over_cycle = np.fft.rfft(signal(cycle.force) - varying, axis=0)[:count] / samples
    assert_allclose(over_cycle, forces, atol=ROUNDING * abs(forces).max())


def test_what_modes_leave_out_is_told(rng):
    """Over twenty machines with other bearings and masses: the estimate is within 0.8 and 1.6 times of the truth.

    Of the reading with the largest miss, at 1 / 1.8 of the cut.
    """
    solved, _, box, _, _ = loaded_box()
    shares, cut = [], 1.8 * HIGHEST
    for _ in range(20):
        diagonal = np.arange(len(box.mass))
        stiffness, mass = box.stiffness.copy(), box.mass.copy()
        springs = 10.0 ** rng.uniform(2.0, 5.0, len(diagonal))
        stiffness[diagonal, diagonal] += np.where(diagonal % NODE < 3, springs, 0.0)
        mass[diagonal, diagonal] *= 10.0 ** rng.uniform(0.0, 0.5, len(diagonal))
        machine = replace(box, stiffness=stiffness, mass=mass)
        closing = closed(machine, np.diag([5e5, 1e8]))
        rows = np.concatenate(bearing_rows(machine, solved))
        few = receptance_of(machine, closing, modes_of(machine, closing, cut), machine.meshes, rows, 1e-9)
        every = receptance_of(machine, closing, modes_of(machine, closing, 1e7), machine.meshes, rows, 1e-9)
        omega = 2.0 * np.pi * HIGHEST
        missed = abs(transfer(few, np.array([omega])).readings - transfer(every, np.array([omega])).readings)[0]
        place = np.unravel_index(missed.argmax(), missed.shape)
        shares.append(truncation(few, omega, *map(int, place)) / missed[place])
    assert 0.8 < min(shares)
    assert max(shares) < 1.6


def with_flanks(harmonics=2, speeds=(0.01,), **flanks):
    """The response of the small box with other flanks of its pinion of 19 teeth and its wheel of 29."""
    solved, pairs, machine, *_ = loaded_box()
    (mesh,) = standing_meshes(solved, pairs, harmonics)
    mesh = settled_pair(replace(mesh, condition=replace(mesh.condition, **flanks), settled=None))
    together = coherent_meshes(machine, [mesh])
    return responded(machine, solved, together, (), [], Motion(harmonics=harmonics), np.array(speeds))


def lines_at_rest(**flanks):
    """How far the flanks of the slow box part by harmonics of the mesh, from zero to peak, um."""
    source = with_flanks(**flanks).sources[0]
    return {place[0]: 2e3 * abs(line) for place, line in zip(source.places, source.lines.parted[0, :, 0], strict=True)}


def test_pitch_deviations_that_are_alike_are_none():
    """All teeth 3 um off: one pitch, and not a line changes."""
    solved, pairs, *_ = loaded_box()
    (mesh,) = standing_meshes(solved, pairs, 2)
    off = mesh.with_flank(0, 0, Modification(pitch_deviations_um=(3.0,) * 19))
    assert off.pitches == 1
    assert_allclose(off.cycle().force, mesh.cycle().force, rtol=0.0, atol=ROUNDING * abs(mesh.cycle().force).max())


def test_a_single_tooth_out_of_place_is_solved_in_the_pitches_that_it_carries_in_alone():
    """Kinds of pitches: five of nineteen at most differ from the others."""
    solved, pairs, *_ = loaded_box()
    (mesh,) = standing_meshes(solved, pairs, 2)
    off = mesh.with_flank(0, 0, Modification(pitch_deviations_um=(2.0, *[0.0] * 18)))
    assert off.pitches == 19
    assert 2 < len(set(off.kinds)) < 9


def test_a_wave_is_heard_at_its_own_order_and_beside_the_harmonics_of_the_mesh_alone():
    """41 waves on 19 teeth: lines (41 + 19 k) / 19, in proportion to small amplitudes; others go with their square."""
    found = lines_at_rest(pinion=Modification(waves=(Wave(count=41, amplitude_um=0.01),)))
    ghosts = {line for line in found if round(19 * line) % 19 in (3, 16)}
    others = [found[line] for line in found if line % 1.0 and line not in ghosts]
    assert max(others) < SQUARE * max(map(found.get, ghosts))
    twice = lines_at_rest(pinion=Modification(waves=(Wave(count=41, amplitude_um=0.02),)))
    for line in ghosts:
        assert twice[line] == pytest.approx(2.0 * found[line], rel=FIRST_ORDER)


@pytest.mark.parametrize("amount", [1.0, 40.0])
def test_a_gear_out_of_centre_swings_with_its_shaft_and_loses_no_contact(amount):
    """Pitch deviations as of an eccentric wheel, up to four times the deflection: hubs follow it to a hundredth."""
    teeth = 2.0 * np.pi * np.arange(29) / 29
    response = with_flanks(wheel=Modification(pitch_deviations_um=tuple(amount * np.cos(teeth))))
    (source,) = response.sources
    parted = 2e3 * abs(source.lines.parted[0, :, 0])
    first = source.places.index((1 / 29, 0))
    assert line_words(response, source, first) == "mesh, order 1 of output"
    assert line_columns([response])["order of output"][first] == 1.0
    assert parted[first] == pytest.approx(amount, rel=1e-2)
    (mesh,) = source.mesh.standing.parts
    assert mesh.law().force[:, 0].min() > 0.5 * mesh.load[0]


def test_a_path_that_is_not_found_in_some_steps_is_no_result(monkeypatch):
    solved, pairs, *_ = loaded_box()
    (mesh,) = standing_meshes(solved, pairs, 2)
    wheel = Modification(pitch_deviations_um=tuple(40.0 * np.cos(2.0 * np.pi * np.arange(29) / 29)))
    out_of_centre = replace(mesh, condition=replace(mesh.condition, wheel=wheel), settled=None)
    monkeypatch.setattr("pmor.dynamics.whine.cycle.MOST_STEPS", 1)
    with pytest.raises(ConvergenceError, match="mesh mesh: no path of its hubs found"):
        settled_pair(out_of_centre)
