"""Machines whose motion is extreme or wrongly described: refused with place and remedy, or finite.

Finite elements of the small box are those of one run; each system changes what stands around them.
"""

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

import pmor
from pmor.dynamics.whine.respond import respond
from pmor.dynamics.whine.run import ANGLES, speeds_of
from pmor.machine.coupled import solve_load
from pmor.machine.loader import load
from pmor.machine.run import meshes_and_trains
from pmor_online.model import keeping_sections
from tests.support.gearboxes import MOTOR, SMALL, written
from tests.support.set_gearboxes import EVEN_SET, one_stage, written_reducer

MOTION = """
[dynamics]
speed_range_rpm = [200.0, 6000.0]
speeds = 7
harmonics = 3
highest_frequency_Hz = 6000.0
damping_ratio = 0.02
"""
HOUSED = '[housing]\nstiffness = "k.csv"\nmass = "m.csv"\n'
SEATS = 6 * SMALL.count("[[bearings]]")
STIFFNESS = np.diag(np.tile([2e5, 2e5, 2e5, 1e9, 1e9, 1e9], SEATS // 6))
MASS = 1e-3 * np.diag(np.tile([1.0, 1.0, 1.0, 100.0, 100.0, 100.0], SEATS // 6))


def changed(matrix, row, column, value):
    found = matrix.copy()
    found[row, column] = value
    return found


def box(*changes, text=SMALL + MOTION + MOTOR, more=""):
    """The small box with texts replaced, each of which must be there."""
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new)
    return text + more


def ripple(text):
    """The small box with a torque that swings."""
    first = SMALL.index("torque_Nm =", SMALL.index("[[loads]]"))
    end = SMALL.index("}", first)
    return f"{SMALL[:end].rstrip()}, ripple = [{{ {text} }}] {SMALL[end:]}{MOTION}"


def motion(old, new):
    return box((old, new), text=SMALL + MOTION)


def motor(old, new):
    return box((old, new))


def housed(stiffness=STIFFNESS, mass=MASS, text=HOUSED):
    return box(more=text), {"k.csv": stiffness, "m.csv": mass}


RANGE = "speed_range_rpm = [200.0, 6000.0]"
REFUSED = {
    "speeds from high to low": (motion(RANGE, "speed_range_rpm = [6000.0, 200.0]"), "lowest and the highest"),
    "speeds from zero": (motion(RANGE, "speed_range_rpm = [0.0, 6000.0]"), "speed_range_rpm"),
    "negative speeds": (motion(RANGE, "speed_range_rpm = [-6000.0, -200.0]"), "speed_range_rpm"),
    "three limits of speeds": (motion(RANGE, "speed_range_rpm = [1.0, 2.0, 3.0]"), "speed_range_rpm"),
    "no speeds": (motion("speeds = 7", "speeds = 0"), "speeds"),
    "no speed at all": (motion(RANGE, ""), "no load has a speed"),
    "no harmonics": (motion("harmonics = 3", "harmonics = 0"), "harmonics"),
    "a million harmonics": (motion("harmonics = 3", "harmonics = 1000000"), "harmonics"),
    "negative damping": (motion("damping_ratio = 0.02", "damping_ratio = -0.02"), "damping_ratio"),
    "damping without end": (motion("damping_ratio = 0.02", "damping_ratio = inf"), "damping_ratio"),
    "no frequencies": (motion("highest_frequency_Hz = 6000.0", "highest_frequency_Hz = 0.0"), "highest_frequency_Hz"),
    "a frequency that is no number": (motion("highest_frequency_Hz = 6000.0", "highest_frequency_Hz = nan"), "highest"),
    "two masses of one name": (box(more=MOTOR), "motor"),
    "a mass on no shaft": (motor('shaft = "input"\nat_mm = 5.0', 'shaft = "inptu"\nat_mm = 5.0'), "no such shaft"),
    "a mass beyond its shaft": (motor("at_mm = 5.0", "at_mm = 500.0"), "goes from 0 to"),
    "a negative mass": (motor("mass_kg = 0.4", "mass_kg = -0.4"), "mass_kg"),
    "a negative inertia": (motor("polar_inertia_kg_m2 = 4e-4", "polar_inertia_kg_m2 = -4e-4"), "polar_inertia"),
    "a motor thinner than a disc": (motor("3e-4", "1e-4"), "at most twice tilting_inertia_kg_m2, 0.0001"),
    "a negative unbalance": (motor("unbalance_kg_mm = 0.02", "unbalance_kg_mm = -0.02"), "unbalance_kg_mm"),
    "an unbalance without a place": (motor("at_mm = 5.0\n", ""), "at_mm"),
    "ripple of no order": (ripple("order = 0.0, amplitude_Nm = 1.5"), "order"),
    "ripple without an order": (ripple("amplitude_Nm = 1.5"), "order"),
    "ripple of a negative amplitude": (ripple("order = 2.0, amplitude_Nm = -1.5"), "amplitude_Nm"),
    "mass of a housing without stiffness": (housed(text='[housing]\nmass = "m.csv"\n'), "give stiffness too"),
    "a mass that is not symmetric": (housed(mass=changed(MASS, 0, 1, 1e-4)), "symmetric"),
    "a stiffness that is not symmetric": (housed(stiffness=changed(STIFFNESS, 0, 1, 1e4)), "symmetric"),
    "a mass that is not positive": (housed(mass=changed(MASS, 0, 0, -1e-3)), "must not be negative"),
    "a stiffness that is not positive": (housed(stiffness=changed(STIFFNESS, 0, 0, -1e5)), "must be positive definite"),
    "a mass that is no number": (housed(mass=changed(MASS, 2, 2, np.nan)), "m.csv"),
    "a mass of another size": (housed(mass=MASS[:6, :6]), "m.csv"),
    "a matrix that is not square": (housed(stiffness=STIFFNESS[:6]), "k.csv"),
    "a matrix of too few seats": (housed(STIFFNESS[:6, :6], MASS[:6, :6]), "k.csv"),
    "a mass off the diagonal alone": (housed(mass=changed(changed(0.0 * MASS, 0, 1, 1.0), 1, 0, 1.0)), "negative"),
    "a housing without its file": ((box(more=HOUSED), {}), "k.csv"),
}
SOLVED = {
    "hardly any damping": motion("damping_ratio = 0.02", "damping_ratio = 1e-9"),
    "half of critical damping": motion("damping_ratio = 0.02", "damping_ratio = 0.5"),
    "twenty harmonics to 100 kHz": motion(
        "harmonics = 3\nhighest_frequency_Hz = 6000.0", "harmonics = 20\nhighest_frequency_Hz = 100000.0"
    ),
    "nothing below the first mode": motion("highest_frequency_Hz = 6000.0", "highest_frequency_Hz = 1.0"),
    "the speed of light": motion(RANGE, "speed_range_rpm = [1e6, 1e7]"),
    "hardly any speed": motion(RANGE, "speed_range_rpm = [0.001, 0.002]"),
    "two speeds": motion("speeds = 7", "speeds = 2"),
    "a motor of a million tons": box(("mass_kg = 0.4", "mass_kg = 1e9"), ("4e-4", "1e12"), ("3e-4", "1e12")),
    "a motor without tilting inertia": box(("mass_kg = 0.4", "mass_kg = 1e9"), ("4e-4", "0.0"), ("3e-4", "0.0")),
    "a motor without inertia": box(("polar_inertia_kg_m2 = 4e-4\ntilting_inertia_kg_m2 = 3e-4\n", "")),
    "a thousand tons off their axis": box(("unbalance_kg_mm = 0.02", "unbalance_kg_mm = 1e9")),
    "shafts that are free along the axis": box(("axial_N_per_mm = 1e5\n", "")),
    "springs of two newtons": box(("2e5", "2.0")),
    "rigid bearings": box(("axial_N_per_mm = 1e5", 'axial_N_per_mm = "rigid"'), ("= 2e5", '= "rigid"')),
    "the other flanks": box(("torque_Nm = 60.0", "torque_Nm = -60.0")),
    "a bearing under preload": box(("clearance_mm = 0.005", "clearance_mm = -0.01")),
    "shafts as thin as wires": box(("outer_mm = 20.0", "outer_mm = 5.0")),
    "a housing without mass": housed(mass=0.0 * MASS),
    "a housing of a million tons": housed(mass=1e9 * MASS),
    "a housing of a microgram": housed(mass=1e-9 * MASS),
}
# What has no equilibrium in which to move.
NOT_FOUND = {"shafts that are free along the axis": "nothing holds it", "springs of two newtons": "no equilibrium"}
ALWAYS = ("a housing without mass",)


def read(folder, described):
    text, matrices = described if isinstance(described, tuple) else (described, {})
    for name, matrix in matrices.items():
        np.savetxt(folder / name, matrix, delimiter=",")
    return load(written(folder, text))


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_move_is_refused_with_place_and_remedy(name, tmp_path):
    described, words = REFUSED[name]
    with pytest.raises(pmor.PmorError, match=words) as refusal:
        speeds_of(read(tmp_path, described))
    assert "\n" not in str(refusal.value)
    assert "box" in str(refusal.value) or ".csv" in str(refusal.value)


@pytest.mark.parametrize(("more", "words"), [("count = 2", "evenly spaced"), ("count = 4\nmissing = [2]", "evenly")])
def test_planets_that_are_missing_on_a_carrier_that_turns_are_refused(more, words, tmp_path):
    text = one_stage() + MOTION
    with pytest.raises(pmor.PmorError, match=words):
        pmor.run_dynamics(load(written_reducer(tmp_path, text, EVEN_SET.replace("count = 3", more))))


@cache
def trained():
    with TemporaryDirectory() as folder:
        return meshes_and_trains(load(written(Path(folder), SMALL)))


@pytest.mark.parametrize(
    "name", [name if name in ALWAYS else pytest.param(name, marks=pytest.mark.slow) for name in SOLVED]
)
def test_what_is_extreme_moves_by_finite_forces_or_says_why_not(name, tmp_path):
    file = read(tmp_path, SOLVED[name])
    reduced, trains = trained()
    pairs = {key: keeping_sections(one) for key, one in reduced.items()}
    motion = file.model.sections.dynamics
    for one in file.model.sections.loads:
        if name in NOT_FOUND:
            with pytest.raises(pmor.PmorError, match=NOT_FOUND[name]):
                solve_load(file.model, one, pairs, ANGLES, trains=trains)
            continue
        solved = solve_load(file.model, one, pairs, ANGLES, trains=trains)
        response = respond(file.model, solved, reduced, motion, speeds_of(file))
        assert np.isfinite(response.rms.bearings).all()
        assert all(np.isfinite(source.lines.mesh_forces).all() for source in response.sources)
