"""A gearbox in motion, from its file to its results: consistent with equilibrium, with itself, and with its parts."""

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh

import pmor
from pmor.dynamics.whine.modal import closed
from pmor.dynamics.whine.moving import bearing_rows
from pmor.dynamics.whine.readings import bearing_rms, force_lines, peak_rows
from pmor.dynamics.whine.response import RPM
from pmor.dynamics.whine.run import run
from pmor.machine.loader import load
from tests.support.gearboxes import SMALL, written

ROUNDING = 1e-8
# What modes up to twice the highest frequency leave of lines below it.
CUT = 5e-3
MOTION = """
[dynamics]
speed_range_rpm = [200.0, 6000.0]
speeds = 60
harmonics = 3
highest_frequency_Hz = 6000.0
[[masses]]
name = "motor"
shaft = "input"
at_mm = 5.0
mass_kg = 0.4
polar_inertia_kg_m2 = 4e-4
tilting_inertia_kg_m2 = 3e-4
unbalance_kg_mm = 0.02
unbalance_deg = 30.0
"""
RIPPLE = "ripple = [{ order = 2.0, amplitude_Nm = 1.5 }]"


def with_motion(text=SMALL, more=MOTION):
    """The small box with a motor whose torque swings."""
    first = text.index("torque_Nm =", text.index("[[loads]]"))
    end = text.index("}", first)
    return text[:end].rstrip() + ", " + RIPPLE + " " + text[end:] + more


@cache
def moving(text=None):
    with TemporaryDirectory() as folder:
        return run(load(written(Path(folder), text or with_motion())))


def by_all_displacements(response, source, place):
    """Bearing forces of a source's lines at one speed, dense, gyroscopic, with meshes of constant stiffness."""
    machine, free = response.machine, response.machine.free
    stiffness = closed(machine, response.tangent)
    square, shape = eigh(free.T @ stiffness @ free, free.T @ machine.mass @ free)
    weighted = machine.mass @ free @ shape
    ratio = response.receptance.damping_ratio[-1]
    damping = weighted @ np.diag(2.0 * ratio * np.sqrt(np.maximum(square, 0.0))) @ weighted.T
    speed, ports = RPM * response.speeds_rpm[place], np.concatenate([machine.meshes, *source_rows(response)])
    found = []
    for harmonic in range(source.told.shape[1]):
        omega = source.rate * (harmonic + 1) * speed
        spinning = damping + machine.sense * speed * machine.gyroscopic
        matrix = stiffness - omega**2 * machine.mass + 1j * omega * spinning
        force = ports[source.ports].T @ source.constant.acting[place, harmonic]
        moved = free @ np.linalg.solve(free.T @ matrix @ free, free.T @ force)
        found.append(np.concatenate(bearing_rows(machine, response.solved)) @ moved)
    return np.array(found)


def source_rows(response):
    machine = response.machine
    return [np.array([machine.row("input", 5.0, 1), machine.row("input", 5.0, 2)]),
            machine.row("input", response.machine.load.torques[0].at_mm, 3)[None]]  # fmt: skip


def test_bearing_forces_of_all_sources_are_those_of_all_displacements():
    """Mesh, unbalance and swinging torque: by modes along orders, and by dense solutions with gyroscopic moments."""
    response = moving().loads[0]
    assert [source.name for source in response.sources] == ["mesh", "unbalance of input", "torque on input"]
    for source in response.sources:
        for place in (7, 40):
            dense = by_all_displacements(response, source, place)
            own = source.constant.readings[place, :, : dense.shape[1]]
            told = source.told[place]
            assert abs(own - dense)[told].max() < CUT * abs(dense[told]).max()


def test_a_peak_names_the_line_without_which_there_is_none():
    """The squares of the other lines have no top there."""
    response = moving().loads[0]
    total = bearing_rms(response)
    names = [bearing.settings.name for bearing in response.machine.gearbox.bearings]
    for row in peak_rows(response):
        place = int(np.flatnonzero(response.speeds_rpm == row["speed_rpm"])[0])
        bearing = names.index(row["bearing"])
        source = next(one for one in response.sources if one.name == row["source"])
        line = force_lines(response, source, source.lines)[:, row["harmonic"] - 1, bearing]
        rest = total[place - 1 : place + 2, bearing] ** 2 - line[place - 1 : place + 2] ** 2
        assert np.diff(rest, n=2)[0] > np.diff(total[place - 1 : place + 2, bearing] ** 2, n=2)[0]
        assert_allclose(row["without_line_rms_N"] ** 2, rest[1], rtol=1e-9, atol=1e-12)


def test_files_hold_what_the_result_tells(tmp_path):
    """Page, tables, numbers; and a second run into the folder is refused nothing of its own."""
    result = moving()
    result.write(tmp_path / "out")
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"dynamics.json", "dynamics.md", "report.html", "response.csv", "lines.csv", "campbell.png"} <= names
    frame = np.genfromtxt(tmp_path / "out" / "response.csv", delimiter=",", names=True, usecols=range(1, 4))
    assert len(frame) == len(result.loads) * len(result.loads[0].speeds_rpm)
    assert "In motion" in (tmp_path / "out" / "dynamics.md").read_text()


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (MOTION.replace("[200.0, 6000.0]", "[6000.0, 200.0]"), "lowest and the highest"),
        (MOTION.replace('shaft = "input"', 'shaft = "inptu"'), "there is no such shaft"),
        (MOTION.replace("at_mm = 5.0", "at_mm = 500.0"), "goes from 0 to"),
        (MOTION.replace("mass_kg = 0.4", "mass_kg = -0.4"), "mass_kg"),
        (MOTION.replace("harmonics = 3", "harmonics = 0"), "harmonics"),
        (MOTION + '[housing]\nmass = "mass.csv"\n', "give stiffness too"),
    ],
)
def test_broken_motion_is_refused_with_place_and_remedy(more, words, tmp_path):
    """One line, before any work."""
    with pytest.raises(pmor.PmorError, match=words):
        load(written(tmp_path, with_motion(more=more)))


def housed(folder, mass):
    """The small box on a housing of springs, with a mass or without, and two coordinates that hang on a seat."""
    seats = SMALL.count("[[bearings]]")
    stiffness = np.zeros((6 * seats + 2, 6 * seats + 2))
    stiffness[: 6 * seats, : 6 * seats] = np.diag(np.tile([2e5, 2e5, 2e5, 1e9, 1e9, 1e9], seats))
    for n in (0, 1):
        stiffness[np.ix_([n, 6 * seats + n], [n, 6 * seats + n])] += 3e4 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    inertia = 1e-3 * mass * np.diag(np.concatenate([np.tile([1.0, 1.0, 1.0, 100.0, 100.0, 100.0], seats), [2.0, 2.0]]))
    np.savetxt(folder / "stiffness.csv", stiffness, delimiter=",")
    np.savetxt(folder / "mass.csv", inertia, delimiter=",")
    text = '[housing]\nstiffness = "stiffness.csv"\nmass = "mass.csv"\n'
    return load(written(folder, with_motion(more=MOTION + text)))


def test_a_light_housing_is_one_that_has_stiffness_alone(tmp_path):
    """Lines of a housing of a milligram are those of none; further coordinates follow their seats."""
    responses = []
    for mass, name in ((1e-7, "light"), (0.0, "massless")):
        (tmp_path / name).mkdir()
        responses.append(run(housed(tmp_path / name, mass)).loads[0])
    assert_allclose(bearing_rms(responses[0]), bearing_rms(responses[1]), rtol=1e-5)


def test_a_heavy_housing_stands_still(tmp_path):
    """Shafts move by micrometres in their bearings."""
    (tmp_path / "heavy").mkdir()
    heavy = run(housed(tmp_path / "heavy", 1e7)).loads[0]
    assert_allclose(heavy.housing(heavy.sources[0].lines.readings)[-1], 0.0, atol=1e-7)
