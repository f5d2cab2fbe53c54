"""Gears on light blanks in a machine in motion: what the modes have, the law of the mesh has not."""

from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.body.blank_modes import BlankModes
from pmor.dynamics.whine.cycle import StandingMesh, standing_meshes
from pmor.dynamics.whine.modal import closed, modes_of, receptance_of, transfer
from pmor.dynamics.whine.moving import moving_machine
from pmor.dynamics.whine.orders import spinning_Hz
from pmor.dynamics.whine.readings import mode_rows
from pmor.dynamics.whine.respond import respond
from pmor.dynamics.whine.ringing import MODAL_MASS, KeptModes, RingingGear, ringing_gears
from pmor.line.hub_law import laws_at, mesh_coordinates, mode_coordinates
from pmor.machine.coupled import SolvedLoad, solve_load
from pmor.machine.loader import GearboxFile, load
from pmor.machine.run import meshes_and_trains
from pmor.pair.model import sector_meshes
from tests.support.gearboxes import SMALL, SMALL_CASE

BORE = "bore_radius_mm = 14.0\n"
LIGHT = "\n[wheel.blank]\nrim_thickness_mm = 4.0\nweb_thickness_mm = 4.0\nhub_radius_mm = 18.0\n"
HIGHEST = 9000.0
# Directions of sections turn at tip corners; of the mean.
NEAREST = 2e-3
# Of sections that leave contact as the hubs' compliance is another: solutions of the law are this close.
SOLVED, ROUNDING = 1e-6, 1e-9
SPEEDS_RPM, HARMONICS = np.array([500.0, 3000.0]), 3
# Of the largest line: harmonics that are left out, and contact that is not linear about another deflection.
MORE_HARMONICS = 1e-2
# Of an open mesh; what blanks move beside the two modes, of their share.
OPEN, OF_ONE_PAIR = 1e-12, 0.05


class LightBox(NamedTuple):
    """A small box, its wheel on a web, under its load."""

    file: GearboxFile
    solved: SolvedLoad
    pairs: dict
    standing: StandingMesh
    gear: RingingGear
    kept: KeptModes


@cache
def light_box():
    with TemporaryDirectory() as name:
        folder = Path(name)
        # No corner carries where laws are compared.
        text = SMALL_CASE.replace(BORE, BORE + LIGHT).replace("hex8i", "hex20")
        (folder / "small.toml").write_text(text)
        (folder / "box.toml").write_text(SMALL)
        file = load(folder / "box.toml")
    pairs, trains = meshes_and_trains(file)
    solved = solve_load(file.model, file.model.sections.loads[0], pairs, 16, trains=trains)
    standing = standing_meshes(solved, pairs, 4)
    kept = KeptModes()
    gear = ringing_gears(file.model, solved, standing, 2.0 * HIGHEST, kept)[0]
    return LightBox(file, solved, pairs, standing[0], gear, kept)


@pytest.mark.parametrize("gear", [0, 1])
def test_motions_of_a_rigid_body_move_the_mesh_as_its_hubs_do(gear):
    """As modes of 1, 0 and 0 nodal diameters: along y and -x, about z, along z."""
    file, standing = light_box().file, light_box().standing
    lines, pair = standing.reduced.lines, standing.reduced.meshed.pair
    mesh = sector_meshes(file.cases["mesh"], pair)[gear]
    x, y, z = mesh.nodes[mesh.flank].reshape(-1, 3).T
    along = np.column_stack([-1j + 0 * x, 1.0 + 0 * x, 0 * x])
    flank = np.column_stack([along.ravel(), np.column_stack([-y, x, 0 * z]).ravel(),
                             np.column_stack([0 * x, 0 * x, 1.0 + 0 * x]).ravel()])  # fmt: skip
    phi = np.linspace(0.0, pair.pitch, 16, endpoint=False)
    found = mode_coordinates(lines, phi, standing.condition, standing.displacement, gear, np.array([1, 0, 0]), flank)
    hub = mesh_coordinates(pair)[6 * gear : 6 * gear + 6, 0]
    known = hub[[1, 0, 5, 2]] * [1.0, -1.0, 1.0, 1.0]
    assert_allclose(found[0][[0, 0, 1, 2], [0, 1, 0, 0]], known, rtol=NEAREST)


def test_a_law_without_the_modes_is_that_with_them_beside_their_deflection():
    """The same forces where the flanks are moved by what the modes give way, and compliances add."""
    standing, gear = light_box().standing, light_box().gear
    pair = standing.reduced
    by_hubs = mesh_coordinates(pair.meshed.pair).T
    for phi in (0.02, 0.1):
        at = pair.lines, np.array([phi]), standing.condition
        with_modes = laws_at(*at, (by_hubs @ standing.displacement)[None])
        moved = standing.moved(gear.compliance @ with_modes.force[0, 0]).displacement
        without = laws_at(*at, (by_hubs @ moved)[None], gear.compliance)
        assert_allclose(without.force, with_modes.force, rtol=SOLVED)
        left = np.linalg.inv(with_modes.tangent[0, 0]) - gear.compliance
        np.linalg.cholesky(left)
        assert_allclose(np.linalg.inv(without.tangent[0, 0]), left, rtol=SOLVED, atol=SOLVED * left.max())


def light_response(speeds_rpm, damping_ratio=0.02):
    """The light box over its speed, as the page has it."""
    box = light_box()
    motion = replace(box.file.model.sections.dynamics, highest_frequency_Hz=HIGHEST, harmonics=HARMONICS,
                     damping_ratio=damping_ratio)  # fmt: skip
    return respond(box.file.model, box.solved, box.pairs, motion, speeds_rpm, box.kept)


def test_at_rest_a_machine_with_ringing_gears_gives_way_as_without():
    """Force of a mesh by how far its flanks are pushed, modes and residual beside the static answer."""
    box = light_box()
    tangent = box.standing.law().tangent.mean(axis=0)
    left = np.linalg.inv(np.linalg.inv(tangent) - box.gear.compliance)
    found = []
    for stiffness, gears in ((tangent, ()), (left, (box.gear,))):
        machine = moving_machine(box.file.model, box.solved, HIGHEST, gears)
        closed_by = closed(machine, stiffness)
        modes = modes_of(machine, closed_by, HIGHEST)
        receptance = receptance_of(machine, closed_by, modes, machine.meshes, machine.meshes, 0.02)
        found.append(stiffness - stiffness @ transfer(receptance, np.zeros(1)).ports[0].real @ stiffness)
    assert_allclose(found[1], found[0], atol=SOLVED * abs(found[0]).max())


def test_slow_gears_have_the_mesh_force_of_rigid_ones(monkeypatch):
    """By inertia alone; all of the law that is left stays a stiffness."""
    slow = np.array([1.0]), 1e-9
    ringing = light_response(*slow)
    np.linalg.cholesky(ringing.sources[0].mesh.standing.parts[0].law().tangent)
    monkeypatch.setattr("pmor.dynamics.whine.respond.ringing_gears", lambda *_: [])
    lines, rigid = (one.sources[0].lines.mesh_forces[0, :HARMONICS] for one in (ringing, light_response(*slow)))
    assert_allclose(lines, rigid, atol=MORE_HARMONICS * abs(rigid).max())


def test_shares_of_modes_are_whole_and_some_are_of_the_blank():
    """Kinetic energy of shafts, gears and blanks."""
    rows = mode_rows(light_response(SPEEDS_RPM))
    assert_allclose([sum(row["kinetic_energy_share"].values()) for row in rows], 1.0, rtol=ROUNDING)
    assert [row["kind"] for row in rows if 5500.0 < row["natural_frequency_Hz"] < 6500.0] == ["blanks", "blanks"]


def test_modes_of_a_turning_blank_part_by_n_turns_on_the_campbell_diagram():
    """Alone, where the mesh is open; in mesh beside how far it parts them at rest, by as much as the blank moves."""
    box, response, spin = light_box(), light_response(SPEEDS_RPM), 2.0 * np.pi * 50.0
    machine = moving_machine(box.file.model, box.solved, HIGHEST, (box.gear,))
    open_mesh = closed(machine, OPEN * response.tangent)
    modes = modes_of(machine, open_mesh, 2.0 * HIGHEST)
    alone = receptance_of(machine, open_mesh, modes, machine.meshes, machine.meshes, 0.0)
    at_rest, turning = spinning_Hz(alone, np.array([0.0, spin]), 2.0 * HIGHEST)
    own, apart = box.gear.modes, abs(machine.rates["output"]) * spin / np.pi
    for n, frequency, c in zip(own.diameters[-2:], own.frequency_Hz[-2:], own.coriolis[-2:], strict=True):
        assert_allclose(np.sort(abs(at_rest - frequency))[:2], 0.0, atol=ROUNDING * frequency)
        pair = np.hypot(frequency, 0.5 * c * apart) + np.array([-0.5, 0.5]) * (n + c) * apart
        assert_allclose([turning[abs(turning - one).argmin()] for one in pair], pair, rtol=ROUNDING)
    two = [number for number, row in enumerate(mode_rows(response)) if 5500.0 < row["natural_frequency_Hz"] < 6500.0]
    moved = [mode_rows(response)[number]["kinetic_energy_share"]["blanks"] for number in two]
    still, parted = (np.ptp(row[two]) for row in spinning_Hz(response.receptance, np.array([0.0, spin]), HIGHEST))
    assert_allclose(parted**2 - still**2, ((2.0 + own.coriolis[-2]) * apart) ** 2 * np.prod(moved), rtol=OF_ONE_PAIR)


@pytest.mark.parametrize("n", [2, 5])
def test_modes_that_turn_under_a_load_that_stands_are_met_n_turns_apart(n):
    """Receptance of the doublet by its two waves, and its poles n W / pi apart."""
    square, omega, spin, row = (2.0 * np.pi * 1500.0) ** 2, 2.0 * np.pi * 1390.0, 2.0 * np.pi * 40.0, 0.7
    none = np.zeros(1)
    modes = BlankModes(np.array([n]), np.array([square]), np.zeros((0, 1)), np.zeros((1, 2, 6)), none, none)
    gear = RingingGear(0, 1, modes, np.array([[[row, 0.0]], [[0.0, 0.0]]]))
    own = gear.matrices(1.0)
    matrix = own.stiffness - omega**2 * own.mass + 1j * omega * spin * own.gyroscopic + spin**2 * own.spun
    phi = gear.coordinates[0]
    waves = sum(1.0 / (MODAL_MASS * (square - (omega + sign * n * spin) ** 2)) for sign in (1.0, -1.0))
    assert_allclose(phi @ np.linalg.solve(matrix, phi), 0.5 * phi[0] ** 2 * waves, rtol=ROUNDING)
    first = np.block([[np.zeros((2, 2)), np.eye(2)], [
        -(own.stiffness + spin**2 * own.spun) / MODAL_MASS, -spin * own.gyroscopic / MODAL_MASS,
    ]])  # fmt: skip
    poles = np.sort(abs(np.linalg.eigvals(first).imag))[::2] / (2.0 * np.pi)
    assert_allclose(poles[1] - poles[0], n * spin / np.pi, rtol=ROUNDING)
