"""Meshes that keep step in motion: gears in several meshes, and on one shaft those whose teeth share harmonics."""

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh

from pmor.dynamics.whine.coherent import CoherentMeshes, ahead_of, coherent_meshes, gears_of
from pmor.dynamics.whine.gradient import Target, changes, cycle_with
from pmor.dynamics.whine.hill import FURTHER, MeshCycle, hill, mesh_cycle
from pmor.dynamics.whine.readings import peak_rows
from pmor.dynamics.whine.respond import respond
from pmor.dynamics.whine.response import RPM
from pmor.dynamics.whine.run import run
from pmor.machine.coupled import solve_load
from pmor.machine.loaded import loaded
from pmor.machine.loader import load
from pmor.machine.run import meshes_and_trains
from pmor.machine.settings import Motion
from tests.support.gear_trains import DRIVE, IDLER, TEETH, box, power_split

# Of rounding; of what modes leave out at the harmonics of 1,200 rpm; of what line contact is beyond its tangent.
ROUNDING, LEFT_OUT, FIRST_ORDER = 1e-9, 1e-6, 0.02
MOTION, SPEEDS = Motion(harmonics=4, highest_frequency_Hz=2e4), np.array([0.01, 1200.0])
# The other order of gears: the last gear is called pinion of its mesh.
NAMED_FROM_BOTH_ENDS = (("one", "two"), ("three", "two"))


def responses(text, motion=MOTION, speeds=SPEEDS):
    with TemporaryDirectory() as folder:
        path = Path(folder) / "box.toml"
        path.write_text(text)
        file = load(path)
    pairs, trains = meshes_and_trains(file)
    loads = file.model.sections.loads
    solved = [solve_load(file.model, one, pairs, 16 * (motion.harmonics + FURTHER), trains=trains) for one in loads]
    return [respond(file.model, one, pairs, motion, speeds) for one in solved]


@cache
def idler():
    with TemporaryDirectory() as folder:
        text = box(Path(folder), IDLER, DRIVE, (15.0, -15.0)).read_text()
    return responses(text)[0]


def dense(response, harmonic, rpm):
    """Receptance of all meshes by all displacements, damped alike."""
    machine, omega = response.machine, RPM * rpm * harmonic * response.sources[0].rate
    free = machine.free
    mass = free.T @ machine.mass @ free
    stiffness = free.T @ (machine.stiffness + machine.meshes.T @ response.tangent @ machine.meshes) @ free
    square, shape = eigh(stiffness, mass)
    square, shape = square[1:], shape[:, 1:]  # without the rotation that nothing holds
    spin = 1j * omega * RPM * rpm * machine.sense * shape.T @ free.T @ machine.gyroscopic @ free @ shape
    matrix = np.diag(square - omega**2 + 2j * MOTION.damping_ratio * np.sqrt(square) * omega) + spin
    ports = machine.meshes @ free @ shape
    return ports @ np.linalg.solve(matrix, ports.T)


def test_hill_of_a_train_is_its_harmonic_balance_sample_by_sample():
    """By the law of both meshes over the cycle as it is, flanks of the idler that feel each other, and whole shafts."""
    response = idler()
    (source,), standing = response.sources, response.sources[0].mesh.standing
    law, orders = standing.parts[0].law(), np.arange(-MOTION.harmonics - FURTHER, MOTION.harmonics + FURTHER + 1)
    samples, size = law.force.shape
    assert abs(law.tangent[:, :2, 2:]).max() > 1e-3 * abs(law.tangent).max()  # the idler's body
    waves = np.exp(2j * np.pi * np.outer(np.arange(samples), orders) / samples)
    moving = [dense(response, abs(n), SPEEDS[1]) for n in orders]
    moving = [one if n >= 0 else one.conj() for n, one in zip(orders, moving, strict=True)]
    matrix, right = np.eye(size * len(orders), dtype=complex), (waves.conj().T @ (law.force - standing.load)) / samples
    for column, answer in enumerate(moving):
        by_sample = np.einsum("apq,a->apq", law.tangent - response.tangent, waves[:, column]) @ answer
        by_order = np.einsum("an,apq->npq", waves.conj(), by_sample) / samples
        matrix[:, size * column : size * (column + 1)] += by_order.reshape(-1, size)
    found = np.linalg.solve(matrix, right.ravel()).reshape(-1, size)[len(orders) // 2 + 1 :][: MOTION.harmonics]
    assert_allclose(source.lines.acting[1], found, atol=LEFT_OUT * abs(found).max())


def test_a_slow_train_moves_as_its_transmission_error_and_carries_the_load_alone():
    """Rotations of both gears of each mesh along its line of action, as equilibrium has them."""
    response = idler()
    (source,), machine = response.sources, response.machine
    assert abs(source.lines.mesh_forces[0]).max() < 1e-7 * response.solved.meshes[0].force
    held = machine.free @ np.linalg.svd(machine.padded(machine.gearbox.balances[0][None]) @ machine.free)[2][1:].T
    stiffness = held.T @ (machine.stiffness + machine.meshes.T @ response.tangent @ machine.meshes) @ held
    moved = held @ np.linalg.solve(stiffness, held.T @ machine.meshes.T @ source.lines.acting[0].T)
    for mesh, solved in zip(machine.gearbox.meshes, response.solved.meshes, strict=True):
        turned = sum(moved[hub + 3] * wrench[3] for hub, wrench in zip(mesh.hubs, mesh.wrenches, strict=True))
        sweep = solved.sweep.ste_um[0]
        expected = abs(np.fft.rfft(sweep)[1 : MOTION.harmonics + 1]) / len(sweep)
        assert_allclose(1e3 * abs(turned), expected, atol=FIRST_ORDER * expected.max())


@pytest.mark.parametrize(("number", "parameter"), [(0, "pinion.helix_slope_um"), (1, "wheel.profile_crowning_um")])
def test_what_a_micrometre_does_in_a_train_is_the_difference_of_its_solutions(monkeypatch, number, parameter):
    response, step = idler(), 0.005
    monkeypatch.setattr("pmor.dynamics.whine.gradient.STEP", step)  # no section begins to carry within it
    source, mesh, place = response.source_of(number)
    (found,) = changes(response, number, [Target("bearing", SPEEDS[1], 2)], [parameter])
    ends, moving = [], mesh.moving(source.orders)
    for way in (-1.0, 1.0):
        acting = hill(cycle_with(mesh, (place,), parameter, way * step), moving, mesh.cycle.mean)
        readings = [source.orders[n].readings(source.ports, acting[:, n + 1])[1] for n in range(MOTION.harmonics)]
        forces = response.bearing_forces(np.array(readings))[:, 2, :3]
        ends.append(float(np.sqrt(2.0 * (abs(forces) ** 2).sum())))
    assert_allclose(found.targets[0], (ends[1] - ends[0]) / (2.0 * step), rtol=1e-5)


class Part(SimpleNamespace):
    """Meshes whose forces and tangents over the cycle are given."""

    pitches = 1

    def cycle(self):
        found = mesh_cycle(self.force, self.tangent, self.load, self.harmonics)
        return found.conj if self.backwards else found


def made_up(rng, number, backwards=False, harmonics=3, samples=96):
    phase = 2.0 * np.pi * np.arange(samples) / samples
    waves = np.stack([function(n * phase) for n in range(9) for function in (np.cos, np.sin)], axis=1)
    force, tangent = waves[:, :10] @ rng.normal(size=(10, 2)), np.tensordot(waves, rng.normal(size=(18, 2, 2)), axes=1)
    return Part(names=(f"mesh {number}",), numbers=(number,), force=force, tangent=tangent, load=np.zeros(2),
                harmonics=harmonics, backwards=backwards)  # fmt: skip


@pytest.mark.parametrize("backwards", [False, True])
def test_harmonics_of_meshes_in_step_are_those_of_their_signals_over_the_common_cycle(rng, backwards):
    """Three cycles of one to two of the other, each ahead by its own share of a cycle."""
    parts, passes, ahead, samples = (made_up(rng, 0), made_up(rng, 1, backwards)), (3, 2), (0.2, 0.35), 96
    together = CoherentMeshes(parts, passes, ahead)
    assert together.told == (2, 3, 4, 6, 9)
    cycle = together.cycle()
    assert set(cycle.harmonics) == {count * own for count in passes for own in range(3 + FURTHER + 1)}
    at = np.arange(4 * samples) / (4 * samples)
    force, tangent = np.zeros((len(at), 4)), np.zeros((len(at), 4, 4))
    for number, (part, count, share) in enumerate(zip(parts, passes, ahead, strict=True)):
        own, place = slice(2 * number, 2 * number + 2), share + (-count if part.backwards else count) * at
        for target, values in ((force[:, own], part.force), (tangent[:, own, own], part.tangent)):
            spectrum = np.fft.fft(values, axis=0) / samples
            orders = np.fft.fftfreq(samples, 1.0 / samples)
            target[...] = np.tensordot(np.exp(2j * np.pi * np.outer(place, orders)), spectrum, axes=1).real
    expected = np.fft.fft(force, axis=0)[cycle.harmonics] / len(at)
    assert_allclose(cycle.force, expected, atol=ROUNDING)
    known = 2 * (3 + FURTHER)  # harmonics of each tangent
    expected = np.fft.fft(tangent, axis=0)[: len(cycle.tangent)] / len(at)
    for number, count in enumerate(passes):
        own, last = slice(2 * number, 2 * number + 2), count * known + 1
        assert_allclose(cycle.tangent[:last, own, own], expected[:last, own, own], atol=ROUNDING)


def test_two_equal_meshes_side_by_side_are_one_by_the_sum_of_their_receptances(rng):
    """In step, in a machine that is the same seen from both."""
    part, size = made_up(rng, 0), (2, 3 + FURTHER + 1, 2, 2)
    own, other = (1e-3 * (rng.normal(size=size) + 1j * rng.normal(size=size)) for _ in range(2))
    own[:, 0], other[:, 0] = own[:, 0].real, other[:, 0].real
    both = hill(CoherentMeshes((part, part), (1, 1), (0.4, 0.4)).cycle(), np.block([[own, other], [other, own]]))
    turned = np.exp(0.8j * np.pi * np.arange(2 * (3 + FURTHER) + 1))
    alone = part.cycle()
    alone = MeshCycle(alone.force * turned[: size[1], None], alone.tangent * turned[:, None, None])
    expected = hill(alone, own + other)
    for half in (both[..., :2], both[..., 2:]):
        assert_allclose(half, expected, atol=ROUNDING * abs(expected).max())


@pytest.mark.parametrize(
    ("rates", "passes"),
    [((19.0, 19.0), [(1, 1)]), ((19.0, 38.0), [(1, 2)]), ((20.0, 30.0), [(2, 3)]), ((19.0, 23.0), [(1,), (1,)]),
     ((12.0, 60.0), [(1,), (1,)]), ((12.0, 48.0, 16.0), [(3, 12, 4)]), ((7.0, 23.0, 14.0), [(1, 2), (1,)])],
)  # fmt: skip
def test_meshes_are_in_step_where_harmonics_that_are_told_meet(rng, monkeypatch, rates, passes):
    monkeypatch.setattr("pmor.dynamics.whine.coherent.ahead_of", lambda machine, parts: [0.0] * len(parts))
    machine = SimpleNamespace(mesh_rate=lambda number: rates[number])
    found = coherent_meshes(machine, [made_up(rng, number, harmonics=4) for number in range(len(rates))])
    assert [one.passes for one in found] == passes


def test_an_idler_stands_alike_in_both_of_its_meshes():
    """Angles of its teeth by one mesh and by the other are pitches apart, and it turns alike."""
    response = idler()
    ends = gears_of(response.machine, response.sources[0].mesh.standing.parts[0])
    (one, other), pitch = [end for end in ends if end.shaft == "two"], 2.0 * np.pi / TEETH["two"]
    apart = (one.start - other.start) / pitch
    assert abs(apart - round(apart)) < ROUNDING
    assert_allclose([one.by_cycle, other.by_cycle], one.by_cycle, rtol=ROUNDING)
    assert_allclose(abs(one.by_cycle), pitch, rtol=ROUNDING)


@pytest.mark.parametrize("meshes", [IDLER, NAMED_FROM_BOTH_ENDS], ids=["in order", "from both ends"])
@pytest.mark.parametrize("torque", [60.0, -60.0])
def test_two_gears_side_by_side_on_a_shaft_keep_step_as_an_idler_does(tmp_path, meshes, torque):
    """Teeth in line, the second mesh is as far ahead of the first; whichever gear is called the pinion."""
    text = box(tmp_path, meshes, (("one", torque), DRIVE[1])).read_text()
    one, two = text.rsplit("[[meshes]]", 1)
    boxes = []
    for boxed in (text, "[[meshes]]".join((one, two.replace("at_mm = 35.0", "at_mm = 55.0")))):
        (tmp_path / "box.toml").write_text(boxed)
        model = load(tmp_path / "box.toml").model
        boxes.append(loaded(model, model.sections.loads[0]))
    idler_box, apart = boxes
    pitches = [mesh.pair.pitch for mesh in apart.meshes]
    first, second = idler_box.groups[0].placed
    expected = first.rate * second.rate * second.start / pitches[1] / abs(first.rate * second.rate)
    expected -= first.start / pitches[0]
    parts = [SimpleNamespace(numbers=(number,)) for number in range(2)]
    ahead = ahead_of(SimpleNamespace(gearbox=apart), parts)
    turns = [{"one": 1.0, "two": -1.0, "three": 1.0}[mesh.settings.pinion.shaft] for mesh in apart.meshes]
    ways = [turn * mesh.frame.along * mesh.frame.hand for turn, mesh in zip(turns, apart.meshes, strict=True)]
    missed = ways[0] * ways[1] * ahead[1] - ahead[0] - expected
    assert abs(missed - round(missed)) < ROUNDING


@pytest.mark.slow
def test_equal_ways_of_a_split_carry_alike_and_are_one_of_twice_the_torque(tmp_path):
    """Layshafts opposite each other: all meshes are one source, forces across cancel on input and output."""
    motion, speeds = Motion(harmonics=3), np.linspace(300.0, 3000.0, 12)
    (response,) = responses(power_split(), motion, speeds)
    (source,) = response.sources
    standing = source.mesh.standing
    assert (standing.passes, standing.told) == ((3, 1), (1, 2, 3, 6, 9))
    forces = source.lines.mesh_forces
    even = 2e-2 * abs(forces).max(axis=(0, 1))  # loads are even within 2e-5, and small forces feel that
    assert (abs(forces[..., 0] - forces[..., 1]) < even[0]).all()
    assert (abs(forces[..., 2] - forces[..., 3]) < even[2]).all()
    held = abs(response.bearing_forces(source.lines.readings))[..., 1:3].max(axis=(0, 1, 3))
    names = [bearing.settings.shaft for bearing in response.machine.gearbox.bearings]
    inner = [number for number, name in enumerate(names) if name in ("input", "output")]
    assert held[inner].max() < 1e-2 * held.max()
    # One way by the sum of the receptances of both.
    folded = np.kron(np.array([[1.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 1.0]]), np.eye(2))
    moving = folded @ source.mesh.moving(source.orders) @ folded.T / 2.0
    cycle = source.mesh.cycle
    half = MeshCycle(cycle.force @ folded.T / 2.0, folded @ cycle.tangent @ folded.T / 2.0, cycle.solved)
    alone = hill(half, moving)
    both = hill(cycle, source.mesh.moving(source.orders)) @ folded.T / 2.0
    assert_allclose(alone, both, atol=1e-4 * abs(both).max())


@pytest.mark.slow
def test_a_gearbox_with_gears_in_several_meshes_moves_from_its_file(tmp_path):
    path = tmp_path / "box.toml"
    path.write_text(power_split())
    result = run(load(path), folder=tmp_path / "out")
    assert not result.failures
    result.write(tmp_path / "out", overwrite=True)
    page = (tmp_path / "out" / "report.html").read_text()
    assert "keep step" in page
    (response,) = result.loads
    assert response.rms.bearings.max() > 0.0
    assert {row["source"].count(" and ") for row in peak_rows(response)} <= {1, 3}
    rows = result.data["loads"][0]
    assert [mesh["pitches_per_turn"] for mesh in rows["meshes"]] == [18.0, 18.0, 6.0, 6.0]
    # The flank of the input that drives both ways is told once.
    told = {(row["mesh"], row["parameter"].partition(".")[0]) for row in rows["micrometres"]}
    assert ("input-left", "pinion") in told
    assert ("input-right", "pinion") not in told
