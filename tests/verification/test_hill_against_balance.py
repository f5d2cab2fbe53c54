"""Small motion by Hill's equations against harmonic balance of the same machine whose flanks stay in contact.

What is left at small damping is the law's own curvature, which small motion does not have: products of harmonics.
"""

from dataclasses import replace

import numpy as np
import pytest

from pmor.dynamics.harmonic_balance import Balance, rest, solve_at
from pmor.dynamics.whine import respond
from pmor.dynamics.whine.modal import receptance_of, transfer
from pmor.dynamics.whine.parting import machine_of
from pmor.dynamics.whine.response import RPM
from pmor.machine.coupled import solve_load
from pmor.machine.loader import load
from pmor.machine.run import meshes_and_trains
from tests.support.gearboxes import SMALL, written

pytestmark = pytest.mark.slow
LOWEST, HIGHEST, SPEEDS, HARMONICS = 300.0, 2600.0, 25, 40
OWN = np.arange(2)


def _without_gyroscopic_moments(*arguments):
    found = receptance_of(*arguments)
    return replace(found, gyroscopic=0.0 * found.gyroscopic, centrifugal=0.0 * found.centrifugal)


def _rms(lines):
    return np.sqrt((abs(lines) ** 2).reshape(len(lines), -1).sum(axis=1))


# Largest over the speeds, of the six lines together: rms of the mesh, its lines as a vector, rms of all bearings.
@pytest.mark.parametrize(("helix", "mesh", "lines", "bearings"), [(0.0, 0.04, 0.08, 0.1), (15.0, 0.01, 0.03, 0.005)])
def test_hill_is_harmonic_balance_without_separation(tmp_path, monkeypatch, helix, mesh, lines, bearings):
    monkeypatch.setattr(respond, "receptance_of", _without_gyroscopic_moments)
    path = written(tmp_path, SMALL if helix else SMALL.replace("62.2", "60.0"))
    case = tmp_path / "small.toml"
    case.write_text(case.read_text() if helix else case.read_text().replace("helix_angle_deg = 15.0", ""))
    file = load(path)
    pairs, trains = meshes_and_trains(file)
    solved = solve_load(file.model, file.model.sections.loads[0], pairs, 32, trains=trains)
    motion = replace(file.model.sections.dynamics, damping_ratio=0.06, highest_frequency_Hz=12000.0)
    speeds = np.linspace(LOWEST, HIGHEST, SPEEDS) * 60.0 / abs(file.model.pairs["mesh"].pinion.teeth)
    found = respond.respond(file.model, solved, pairs, motion, speeds)
    machine, count = machine_of(found, [0], [np.inf]), found.sources[0].told.shape[1]
    balance, unknowns, forces, readings = Balance(machine.oscillator, machine.law, 1, HARMONICS), None, [], []
    for omega in RPM * found.machine.mesh_rate(0) * speeds:
        unknowns = solve_at(balance, omega, rest(balance) if unknowns is None else unknowns)
        at = np.ascontiguousarray(balance.displacement(unknowns))
        force, pushed = machine.law.mesh_forces(balance.phase, at)[0], machine.law.forces(balance.phase, at)[0]
        assert force[0].min() > 0.0
        own, beside = (np.fft.rfft(one, axis=1).T[1 : count + 1] / one.shape[1] for one in (force, pushed))
        by_ports = transfer(found.receptance, omega * np.arange(1, count + 1)).readings[..., OWN]
        forces.append(own[:, 0])
        readings.append(np.einsum("kop,kp->ko", by_ports, machine.arms * beside))
    expected, source = np.array(forces), found.sources[0]
    of_mesh = source.lines.mesh_forces[..., 0]
    of_bearings, known = (
        _rms(found.bearing_forces(one)[..., :3]) for one in (source.lines.readings, np.array(readings))
    )
    assert abs(_rms(of_mesh) / _rms(expected) - 1.0).max() < mesh
    assert (_rms(of_mesh - expected) / _rms(expected)).max() < lines
    assert abs(of_bearings / known - 1.0).max() < bearings
