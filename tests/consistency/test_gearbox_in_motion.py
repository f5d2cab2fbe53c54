"""A gearbox in motion, from its file to its results: consistent with equilibrium, with itself, and with its parts."""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import h5py
import numpy as np
import pytest
import quickjs
from numpy.testing import assert_allclose, assert_array_equal
from scipy.linalg import eigh, expm

import pmor
from pmor.core.errors import CaseError
from pmor.dynamics.fmu.machine import EVERY, machine_law, machine_unit
from pmor.dynamics.fmu.write import write_unit
from pmor.dynamics.kernels.hub_table import closed_forces_at
from pmor.dynamics.whine import readings
from pmor.dynamics.whine.figures import bearings_figure, orders_figure, waterfall_figure
from pmor.dynamics.whine.gradient import Target, changes, cycle_with
from pmor.dynamics.whine.live import motion_section
from pmor.dynamics.whine.modal import Modes, Receptance, closed
from pmor.dynamics.whine.moving import bearing_rows
from pmor.dynamics.whine.orders import along, spinning_Hz
from pmor.dynamics.whine.output import loudest
from pmor.dynamics.whine.pictures import CYCLE_STEPS, moving_bodies
from pmor.dynamics.whine.quiet import QuietMesh
from pmor.dynamics.whine.readings import bearing_names, moved_bearings, peak_rows, shown_modes
from pmor.dynamics.whine.response import RPM
from pmor.dynamics.whine.run import about_first_load, run
from pmor.dynamics.whine.swinging import turning, unbalances
from pmor.gear.condition import Assembly
from pmor.gear.modification import Modification
from pmor.machine.coupled import solve_load
from pmor.machine.load_settings import ShaftForce
from pmor.machine.loader import load
from pmor.machine.readings import bearing_data
from pmor.machine.run import meshes_and_trains
from pmor.machine.settings import Housing
from pmor.machine.view import COARSE
from pmor.report.page import page_html
from pmor.rexs.to_toml import write_gearbox_toml
from tests.support.chromium import browser
from tests.support.gearboxes import MOTOR, SMALL, two_stages, written
from tests.support.page_solver import TEMPLATES, unpacked

ROUNDING = 1e-8
# What modes up to twice the highest frequency leave of lines below it.
CUT = 5e-3
# On the live page: of the largest force of a reading; of a mode's largest displacement.
FORCES, SHAPES = 1e-6, 2e-4
MOTION = """
[dynamics]
speed_range_rpm = [200.0, 6000.0]
speeds = 60
harmonics = 3
highest_frequency_Hz = 6000.0
"""
MOTION += MOTOR + "unbalance_deg = 30.0\n"
RIPPLE = "ripple = [{ order = 2.0, amplitude_Nm = 1.5 }]"

# Small enough for products of two changes, large beside rounding; no section begins to carry within it.
SMALL_STEP_UM = 0.005


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


def test_pictures_leave_out_bearings_that_no_dynamic_force_reaches():
    """A bearing whose shaft stands within its clearance, and one that feels 1e-12 of the meshes."""
    response = moving().loads[0]
    still, names = replace(response), bearing_names(response)
    share = np.array([0.0, 1.0, 1e-12, 1.0])
    for key in ("rms", "constant_rms"):
        total = getattr(response, key)
        still.__dict__[key] = replace(total, bearings=share * np.full(total.bearings.shape, total.meshes.max()))
    assert moved_bearings([still]) == ([1, 3], [names[0], names[2]])
    assert moved_bearings([still, response]) == ([0, 1, 2, 3], [])
    for chart in (bearings_figure([still]), orders_figure(still), waterfall_figure(still, 6000.0)):
        titles = [panel.said.get("title") for panel in chart.panels if panel.shown]
        assert [title for title in titles if title] == [names[1], names[3]]


def test_a_force_that_turns_swings_as_the_unbalance_that_it_is_of():
    machine, model = moving().loads[0].machine, moving().file.model
    (unbalance,) = unbalances(model, machine)
    (motor,), angle = model.sections.masses, np.radians(30.0)
    size = 1e-3 * motor.unbalance_kg_mm * unbalance.rate**2
    force = ShaftForce(shaft="input", at_mm=motor.at_mm, y_N=size * np.cos(angle), z_N=size * np.sin(angle), turns=True)
    (found,) = turning(replace(machine, load=replace(machine.load, forces=(force,))))
    assert not unbalance.steady
    assert found.steady
    assert_allclose(found.by_speed, unbalance.by_speed, rtol=1e-12)
    assert (found.rows == unbalance.rows).all()


def test_a_peak_names_the_line_without_which_there_is_none():
    """The squares of the other lines have no top there."""
    response = moving().loads[0]
    total = response.rms.bearings
    names = [bearing.settings.name for bearing in response.machine.gearbox.bearings]
    for row in peak_rows(response):
        place = int(np.flatnonzero(response.speeds_rpm == row["speed_rpm"])[0])
        bearing = names.index(row["bearing"])
        source = next(one for one in response.sources if one.name == row["source"])
        line = response.force_lines(source)[:, row["harmonic"] - 1, bearing]
        rest = total[place - 1 : place + 2, bearing] ** 2 - line[place - 1 : place + 2] ** 2
        assert np.diff(rest, n=2)[0] > np.diff(total[place - 1 : place + 2, bearing] ** 2, n=2)[0]
        assert_allclose(row["without_line_rms_N"] ** 2, rest[1], rtol=1e-9, atol=1e-12)
        assert row["made_by_one"] == (rest[1] < 0.95**2 * row["force_rms_N"] ** 2)


def test_files_hold_what_the_result_tells(tmp_path, undrawn):
    """Page, tables, numbers; and a second run into the folder is refused nothing of its own."""
    result = moving()
    result.write(tmp_path / "out")
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"dynamics.json", "dynamics.md", "report.html", "response.csv", "lines.csv", "campbell.svg"} <= names
    frame = np.genfromtxt(tmp_path / "out" / "response.csv", delimiter=",", names=True, usecols=range(1, 4))
    assert len(frame) == len(result.loads) * len(result.loads[0].speeds_rpm)
    arrays = pmor.load_results(tmp_path / "out" / "results.h5")
    force = arrays["motion/gearbox/drive/speed/bearing_force"].values
    assert_allclose(force, result.loads[0].rms.bearings)
    assert "In motion" in (tmp_path / "out" / "dynamics.md").read_text()
    with h5py.File(tmp_path / "out" / "modes.vtkhdf") as file:
        moved = np.linalg.norm(file["VTKHDF/PointData/displacement_mm"], axis=1)
        points = len(file["VTKHDF/Points"])
        steps, shown = file["VTKHDF/Steps/Values"][:], file.attrs["frequency_Hz"]
    assert len(moved) == points * len(steps) == points * CYCLE_STEPS * len(shown)
    of_step = moved.reshape(len(shown), CYCLE_STEPS, points).max(axis=2)
    assert_allclose(of_step, np.tile(abs(np.cos(2.0 * np.pi * np.arange(CYCLE_STEPS) / CYCLE_STEPS)), (len(shown), 1)),
                    atol=1e-6)  # fmt: skip
    frequencies = {mode["mode"]: mode["natural_frequency_Hz"] for mode in result.data["loads"][0]["modes"]}
    assert_allclose(shown, [frequencies[int(step)] for step in steps[::CYCLE_STEPS]])


def test_the_model_in_the_file_gives_the_bearing_forces_again_and_the_universal_file_holds_them(tmp_path):
    """Modes, static parts and forces of the sources alone; the universal file is read by pyuff."""
    moving().write_numbers(tmp_path / "out")
    arrays = pmor.load_results(tmp_path / "out" / "results.h5")
    own = {key.removeprefix("motion/gearbox/drive/"): one.values for key, one in arrays.items()}
    square, count = (2.0 * np.pi * own["model/frequency"]) ** 2, own["model/ports"].shape[0]
    bearing = own["model/bearing_force"].reshape(-1, len(square))
    model = Receptance(
        Modes(square, np.zeros((0, len(square))), np.inf), own["model/ports"], bearing, own["model/left_ports"],
        own["model/left_bearing_force"].reshape(-1, count), np.zeros((len(bearing), count)), own["model/gyroscopic"],
        own["model/centrifugal"], own["model/damping_ratio"],
    )  # fmt: skip
    acting = own["lines/acting"] * np.exp(1j * own["lines/acting_phase"])
    expected = own["lines/bearing_force"] * np.exp(1j * own["lines/bearing_force_phase"])
    for source, line in np.argwhere(np.isfinite(own["lines/order"])):
        order = along(model, own["lines/order"][source, line], RPM * own["speed/speed"], 1.0)
        told = np.isfinite(own["lines/frequency"][source, :, line])
        found = order.readings(slice(None), np.where(told[:, None], acting[source, :, line], 0.0))[told]
        wanted = expected[source, told, line].reshape(told.sum(), -1)
        assert_allclose(found, wanted, atol=ROUNDING * abs(wanted).max())
    pyuff = pytest.importorskip("pyuff", reason="universal files are read by pyuff")
    pmor.export_file(tmp_path / "out" / "results.h5", "uff", tmp_path / "motion.uff")
    sets = pyuff.UFF(str(tmp_path / "motion.uff")).read_sets()
    lines = np.isfinite(own["lines/frequency"]).any(axis=1)
    assert len(sets) == 3 * lines.sum() * expected.shape[3]
    one = sets[-1]
    source, line = np.argwhere(lines)[-1]
    told = np.isfinite(own["lines/frequency"][source, :, line])
    assert_allclose(one["data"], expected[source, told, line, -1, 2], rtol=1e-6)
    assert_allclose(one["x"], own["speed/speed"][told], rtol=1e-4)
    with pytest.raises(pmor.PmorError, match="takes results.h5 of a gearbox or a set in motion"):
        pmor.export_file(tmp_path / "box.toml", "uff", tmp_path / "other.uff")


def test_numbers_of_the_first_load_are_on_disk_when_the_second_is_interrupted(tmp_path, monkeypatch):
    """And nothing else: the page comes with the last."""
    response = moving().loads[0]
    second = SMALL[SMALL.index("[[loads]]") :].replace('"drive"', '"further"')
    file, asked = load(written(tmp_path, with_motion() + second)), []

    def solved(model, load, *_, **__):
        asked.append(load.name)
        if len(asked) > 1:
            raise KeyboardInterrupt
        return None

    monkeypatch.setattr("pmor.dynamics.whine.run.meshes_and_trains", lambda *_: ({}, {}))
    monkeypatch.setattr("pmor.dynamics.whine.run.solve_load", solved)
    monkeypatch.setattr("pmor.dynamics.whine.run.respond", lambda *_: response)
    with pytest.raises(KeyboardInterrupt):
        run(file, folder=tmp_path / "out")
    assert asked == ["drive", "further"]
    names = {path.name for path in (tmp_path / "out").iterdir() if path.suffix != ".jsonl"}
    assert names == {"response.csv", "results.h5"}
    force = pmor.load_results(tmp_path / "out" / "results.h5")["motion/gearbox/drive/speed/bearing_force"].values
    assert_allclose(force, response.rms.bearings)


def test_modes_and_their_static_rest_add_up_to_the_force_at_a_peak(monkeypatch):
    """In its direction and phase; the most of it is the mode that the order meets there."""
    monkeypatch.setattr(readings, "MOST_SHARES", 10**6)
    response = moving().loads[0]
    row = max(peak_rows(response), key=lambda row: row["line_rms_N"])
    source = next(one for one in response.sources if one.name == row["source"])
    place, number = int(abs(response.speeds_rpm - row["speed_rpm"]).argmin()), row["harmonic"] - 1
    names = [bearing.settings.name for bearing in response.machine.gearbox.bearings]
    left = response.receptance.left_readings[:, source.ports] @ source.lines.acting[place, number]
    whole, rest = (response.bearing_forces(part)[names.index(row["bearing"]), :3]
                   for part in (source.lines.readings[place, number], left))  # fmt: skip
    static = (rest @ whole.conj()).real / (abs(whole) ** 2).sum()
    assert_allclose(sum(one["share"] for one in row["mode_shares"]) + static, 1.0, atol=ROUNDING)
    assert row["mode_shares"][0]["mode"] == row["mode"]
    assert abs(row["resonance_rpm"] / row["speed_rpm"] - 1.0) < 0.05


def test_natural_frequencies_that_spin_are_those_of_all_displacements():
    """Lowest modes of the dense gyroscopic problem, forwards and backwards apart."""
    response = moving().loads[0]
    machine, free = response.machine, response.machine.free
    mass, gyroscopic, stiffness = (
        free.T @ one @ free for one in (machine.mass, machine.gyroscopic, closed(machine, response.tangent))
    )
    for speed in (0.0, 3000.0):
        state = np.block([[np.zeros_like(mass), np.eye(len(mass))],
                          [-np.linalg.solve(mass, stiffness), -speed * np.linalg.solve(mass, gyroscopic)]])  # fmt: skip
        dense = np.sort(np.linalg.eigvals(state).imag)
        dense = dense[dense > 1.0][:8] / (2.0 * np.pi)
        found = spinning_Hz(response.receptance, np.array([speed]), 1e5)[0, : len(dense)]
        assert_allclose(found, dense, rtol=CUT)
    assert abs(found / response.modes.frequency_Hz[response.modes.square > 0.0][: len(found)] - 1.0).max() > 2.0 * CUT


def housed(folder, mass, more=""):
    """The small box on a housing of springs, with a mass or without, and two coordinates that hang on a seat."""
    seats = SMALL.count("[[bearings]]")
    stiffness = np.zeros((6 * seats + 2, 6 * seats + 2))
    stiffness[: 6 * seats, : 6 * seats] = np.diag(np.tile([2e5, 2e5, 2e5, 1e9, 1e9, 1e9], seats))
    for n in (0, 1):
        stiffness[np.ix_([n, 6 * seats + n], [n, 6 * seats + n])] += 3e4 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    inertia = 1e-3 * mass * np.diag(np.concatenate([np.tile([1.0, 1.0, 1.0, 100.0, 100.0, 100.0], seats), [2.0, 2.0]]))
    np.savetxt(folder / "stiffness.csv", stiffness, delimiter=",")
    np.savetxt(folder / "mass.csv", inertia, delimiter=",")
    text = '[housing]\nstiffness = "stiffness.csv"\nmass = "mass.csv"\n' + more
    return load(written(folder, with_motion(more=MOTION + text)))


def test_a_gearbox_that_is_written_keeps_what_moves(tmp_path):
    """Variants of designs and campaigns are written so: masses, `[dynamics]`, matrices of the housing, ripple."""
    np.savetxt(tmp_path / "surface.csv", np.eye(26), delimiter=",")
    file = housed(tmp_path, 0.5, SURFACED)
    (tmp_path / "again").mkdir()
    write_gearbox_toml(file, tmp_path / "again" / "box.toml", overwrite=False)
    other = load(tmp_path / "again" / "box.toml")
    nowhere = {"meshes": (), "housing": Housing()}
    assert replace(other.sections, **nowhere) == replace(file.sections, **nowhere)
    assert file.sections.masses
    assert file.sections.loads[0].torques[0].ripple
    assert list(file.model.of_housing) == ["stiffness", "mass", "surface"]
    for key, matrix in file.model.of_housing.items():
        assert_array_equal(other.model.of_housing[key], matrix)
    assert file.whole_text != replace(file, model=replace(file.model, housing_matrices=None)).whole_text


def test_a_light_housing_is_one_that_has_stiffness_alone(tmp_path):
    """Lines of a housing of a milligram a seat are those of none; further coordinates follow their seats."""
    responses = []
    for mass, name in ((1e-6, "light"), (0.0, "massless")):
        (tmp_path / name).mkdir()
        responses.append(run(housed(tmp_path / name, mass)).loads[0])
    assert_allclose(responses[0].rms.bearings, responses[1].rms.bearings, rtol=5e-5)


def test_a_heavy_housing_stands_still(tmp_path):
    """Shafts move by micrometres in their bearings."""
    (tmp_path / "heavy").mkdir()
    heavy = run(housed(tmp_path / "heavy", 1e7)).loads[0]
    assert_allclose(heavy.housing(heavy.sources[0].lines.readings)[-1], 0.0, atol=1e-7)


SURFACED = 'surface = "surface.csv"\n'


@cache
def radiating():
    """A box on a housing with a surface, and its receptance at the mesh."""
    with TemporaryDirectory() as folder:
        rows = np.random.default_rng(3).standard_normal((5, 26))
        np.savetxt(Path(folder) / "surface.csv", rows.T @ rows, delimiter=",")
        return run(housed(Path(folder), 0.5, SURFACED)).loads[0]


def rms_of(response, source, acting, target, place):
    """Of the lines of the mesh, by its forces (K + 1, 2) at one speed."""
    total = 0.0
    for harmonic in range(1, source.told.shape[1] + 1):
        order = source.orders[harmonic - 1]
        force = np.broadcast_to(acting[harmonic], (len(order.speeds), 2))
        readings = order.readings(source.ports, force)[place]
        if target.kind == "bearing":
            seen = response.bearing_forces(readings)[target.number, :3]
        elif target.kind == "power":
            omega = order.order * RPM * response.speeds_rpm[place]
            seen = omega * np.sqrt(413.3e-9) * response.machine.surface @ response.housing(readings)
        else:
            moved = order.ports(source.ports, source.ports)[place] @ acting[harmonic]
            seen = (acting[harmonic] - source.mesh.cycle.mean @ moved)[:1]
        total += 2.0 * (abs(seen) ** 2).sum() * source.told[place, harmonic - 1]
    return np.sqrt(total)


@pytest.mark.parametrize("parameter", ["pinion.helix_slope_um", "wheel.profile_crowning_um"])
@pytest.mark.parametrize("target", [Target("bearing", 2000.0, 1), Target("mesh", 3500.0), Target("power", 2000.0)])
def test_adjoint_is_the_difference_of_whole_solutions(monkeypatch, parameter, target):
    """Of the equations of the mesh with a little more of an amount and a little less."""
    response, step = radiating(), SMALL_STEP_UM
    monkeypatch.setattr("pmor.dynamics.whine.gradient.STEP", step)
    source = response.sources[0]
    (found,) = changes(response, 0, [target], [parameter])
    place = int(abs(response.speeds_rpm - target.speed_rpm).argmin())
    own = source.ports
    answers = np.stack([source.mesh.at_rest + 0j, *(order.ports(own, own)[place] for order in source.orders)])
    ends = []
    for sign in (-1.0, 1.0):
        cycle = cycle_with(source.mesh, (0,), parameter, sign * step)
        # The machine stays closed by the mean stiffness that it had.
        more = np.stack([cycle.tangent[0] - source.mesh.cycle.mean, *cycle.tangent[1:]])
        ends.append(rms_of(response, source, hill_closed(cycle, more, answers), target, place))
    assert_allclose(found.targets[0], (ends[1] - ends[0]) / (2.0 * step), rtol=1e-5)


def hill_closed(cycle, tangent, receptance):
    """Forces by a dense solution with all harmonics of the stiffness, its further mean too."""
    count = len(receptance)
    orders = np.arange(-count + 1, count)
    matrix = np.eye(2 * len(orders), dtype=complex)
    signed = lambda values, order: values[order] if order >= 0 else values[-order].conj()  # noqa: E731
    for n, row in enumerate(orders):
        for j, column in enumerate(orders):
            matrix[2 * n : 2 * n + 2, 2 * j : 2 * j + 2] += signed(tangent, row - column) @ signed(receptance, column)
    right = np.concatenate([signed(cycle.force, order) for order in orders])
    return np.linalg.solve(matrix, right).reshape(-1, 2)[count - 1 :]


def test_a_micrometre_of_a_modification_does_what_two_full_runs_say():
    """A box whose wheel has half a micrometre more, and one that has less, solved from the file on."""
    target, ends, quiet = Target("bearing", 2000.0, 1), [], []
    (found,) = changes(moving().loads[0], 0, [target], ["wheel.profile_crowning_um"])
    for amount in (0.5, -0.5):
        wheel = f"modification = {{ profile_crowning_um = {amount} }}"
        place = 'wheel = { shaft = "output", at_mm = 35.0 }'
        assert place in SMALL
        text = with_motion(SMALL.replace(place, place.replace(" }", f", {wheel} }}")))
        response = moving(text).loads[0]
        at = int(abs(response.speeds_rpm - target.speed_rpm).argmin())
        lines = response.force_lines(response.sources[0])[at, :, target.number]
        ends.append(float(np.sqrt((lines**2).sum())))
        assembly = Assembly(wheel=Modification(profile_crowning_um=amount))
        own = QuietMesh(moving().loads[0], 0, response.machine.gearbox.bearings[1].settings.name, 100.0)
        quiet.append((own.results(assembly)["bearing_force_N"], response.rms.bearings[:, 1].max()))
    assert_allclose(found.targets[0], ends[0] - ends[1], rtol=3e-2)
    for by_design, by_run in quiet:
        assert_allclose(by_design, by_run, rtol=5e-3)


def test_a_design_starts_from_the_motion_of_its_gearbox():
    """With the flanks of the file its results are those of the run."""
    response = moving().loads[0]
    found = QuietMesh(response, 0, None, 100.0).results(Assembly())
    assert_allclose(found["mesh_force_N"], response.rms.meshes[:, 0].max(), rtol=1e-6)
    assert_allclose(found["bearing_force_N"], response.rms.bearings.max(), rtol=1e-6)


@pytest.mark.parametrize("torque", [60.0, -60.0])
@pytest.mark.parametrize("speed", [1500.0, -1500.0])
def test_a_mesh_passes_backwards_where_its_pinion_turns_against_its_torque(torque, speed):
    """The wheel drives then."""
    text = SMALL.replace('name = "drive"', f'name = "drive"\nspeed_rpm = {speed}').replace("60.0 }", f"{torque} }}")
    response = moving(with_motion(text)).loads[0]
    assert response.machine.backwards(0) == (torque * speed < 0.0)


@cache
def live_section():
    result = moving()
    return motion_section(result.file, result.loads, loudest(result.loads), shown_modes(result.data))


class Page:
    """The section's script with its data, in an engine without a browser."""

    def __init__(self):
        self._engine, data = quickjs.Context(), live_section().data
        for script in ("numbers.js", "motion/motion.js"):
            self._engine.eval((TEMPLATES / script).read_text(encoding="utf-8"))
        self._engine.eval(f"const DATA = {json.dumps(data)};")
        for number, one in enumerate(data["by_load"]):
            self._engine.eval(f"""DATA.by_load[{number}].values =
                unpackForces(DATA.by_load[{number}], {unpacked(one["forces"]).tolist()}, DATA.speeds.length);""")
        moves = (data["modes"]["step"] * unpacked(data["modes"]["packed"])).tolist()
        self._engine.eval(f"DATA.modes.moves = {json.dumps(moves)};")

    def value(self, expression):
        return json.loads(self._engine.eval(f"JSON.stringify({expression})"))


def test_forces_of_the_page_are_those_of_the_run():
    """Each line, and all together, at each speed, of bearings and meshes."""
    page, response = Page(), moving().loads[0]
    totals = np.concatenate([response.rms.bearings, response.rms.meshes], axis=1)
    bearings = len(bearing_names(response))
    lines = np.concatenate([response.force_lines(one) for one in response.sources], axis=1)
    frequencies = np.concatenate([one.frequency_Hz(response.speeds_rpm) for one in response.sources], axis=1)
    for reading in range(totals.shape[1]):
        over_speed = page.value(f"[...totalsOf(DATA, DATA.by_load[0], {reading})]")
        # Lines are rounded one by one.
        assert_allclose(over_speed, totals[:, reading], atol=lines.shape[1] * FORCES * totals[:, reading].max())
        for place in (3, 40):
            found = page.value(f"motionAt(DATA, DATA.by_load[0], {reading}, {place})")
            assert_allclose([one["frequency"] for one in found["lines"]], frequencies[place])
            if reading < bearings:
                own = lines[..., reading]
                assert_allclose([one["force"] for one in found["lines"]], own[place], atol=FORCES * own.max())


def test_a_mode_of_the_page_moves_as_the_machine():
    """Ends of a shaft, seen by the page's camera, over a common factor."""
    page, result = Page(), moving()
    response, modes = result.loads[0], live_section().data["modes"]
    found, by = moving_bodies(result.file.model, response.machine, COARSE)
    rigid = int((response.modes.square == 0.0).sum())
    line = modes["lines"][0]
    assert line["kind"] == found[0].kind == "shaft"
    ends, seen = [line["first"], line["first"] + line["count"] - 1], np.array([modes["across"], modes["up"]])
    for mode in (0, 3):
        still, moved = (np.array(page.value(f"shapeAt(DATA.modes, {mode}, {cosine})"))[ends] for cosine in (0.0, 1.0))
        own = (by @ response.modes.shape[:, rigid + mode])[found[0].node[:, None] + np.arange(3)]
        first, last = own[found[0].node.argmin()] @ seen.T, own[found[0].node.argmax()] @ seen.T
        shown = moved - still
        factor = (shown * [first, last]).sum() / (np.array([first, last]) ** 2).sum()
        assert_allclose(shown, factor * np.array([first, last]), atol=SHAPES * modes["reach"])


@pytest.mark.slow
def test_a_reader_goes_through_speeds_and_modes(tmp_path):
    path = tmp_path / "report.html"
    path.write_text(page_html("Motion", [live_section()]), encoding="utf-8")
    result, response = "document.getElementById('motion').result", moving().loads[0]
    with browser() as page:
        page.open(path)
        page.wait_for(f"!!{result}")
        first = page.evaluate(result)
        assert first["total"] == pytest.approx(response.rms.bearings[:, 0].max(), rel=1e-5)
        page.evaluate("document.getElementById('motion-peak').click()")
        assert page.evaluate(result)["place"] != first["place"]
        page.evaluate("""(input => { input.value = 3000; input.dispatchEvent(new Event("change")); })(
            document.getElementById("motion-rpm"))""")
        place = page.evaluate(result)["place"]
        assert place == int(abs(response.speeds_rpm - 3000.0).argmin())
        before = page.evaluate("document.querySelector('#motion-shape .shaft').getAttribute('d')")
        page.evaluate("document.getElementById('motion-play').click()")
        page.wait_for(f"document.querySelector('#motion-shape .shaft').getAttribute('d') !== {json.dumps(before)}")
        page.fit_a_phone()
        assert page.named("Runtime.consoleAPICalled", "Runtime.exceptionThrown", "Log.entryAdded") == []


@cache
def small_unit():
    """The box's law for co-simulation, with tables that are coarse."""
    with pytest.MonkeyPatch.context() as patch:
        for name, value in (("SOLVED_PHASES", 16), ("PHASES", 32), ("APPROACHES", 9), ("TILTS", 5)):
            patch.setattr(f"pmor.dynamics.whine.nonlinear.{name}", value)
        return machine_law(moving().loads[0], moving().file)


def twin_of(law, speed, steps, step, torque):
    """Forces of the mesh and of the bearings after each step, by exact drift of the modes and a kick of the meshes."""
    own, count, mean = law.arrays, len(law.arrays["OMEGA"]), law.meshes
    tables = tuple(one._replace(values=one.values[::EVERY].astype(np.float32).astype(float)) for one in mean.tables)
    meshes = mean._replace(tables=tables)
    damping = 2.0 * own["RATIO"] * own["OMEGA"]
    drift = expm(0.5 * step * np.block([[np.zeros((count, count)), np.eye(count)],
                                        [-np.diag(own["OMEGA"] ** 2), -np.diag(damping)]]))  # fmt: skip
    gyroscopic = 0.5 * step * speed * own["GYROSCOPIC"]
    state, turns, found = np.zeros(2 * count), 0.0, []

    def forces(share):
        seen = state[:count] + share * step**2 * own["TORQUE_ON_MODES"] @ torque
        moved = mean.centre + own["BY_MODES"] @ seen + own["BY_TORQUES"] @ torque
        further = mean.residual + share * step**2 * own["BY_MODES"] @ own["BY_MODES"].T
        force, at = np.empty((2, len(moved), 1))
        slope = np.empty((len(moved), len(moved), 1))
        closed_forces_at(meshes._replace(residual=further), np.array([turns]), moved[:, None].copy(), force, slope, at)
        return force[:, 0], at[:, 0], own["TORQUE_ON_MODES"] @ torque - own["BY_MODES"].T @ (force[:, 0] - mean.load)

    for _ in range(steps):
        state, turns = drift @ state, turns + 0.5 * step * speed / (2.0 * np.pi)
        push = forces(1.0 / 12.0)[2] - speed**2 * own["CENTRIFUGAL"] @ state[:count]
        right = (np.eye(count) - gyroscopic) @ state[count:] + step * push
        state[count:] = np.linalg.solve(np.eye(count) + gyroscopic, right)
        state, turns = drift @ state, turns + 0.5 * step * speed / (2.0 * np.pi)
        force, at, push = forces(-1.0 / 24.0)
        seen = state[:count] - step**2 / 24.0 * push
        mesh = force + mean.tangent @ (at - mean.centre)
        bearings = (own["FORCE_BY_MODES"] @ seen + own["FORCE_BY_MESHES"] @ (force - mean.load)
                    + own["FORCE_BY_TORQUES"] @ torque)  # fmt: skip
        found.append([*mesh[::2], *bearings])
    return np.array(found)


class SimulatedUnit:
    """A unit of a gearbox, validated and simulated by fmpy."""

    def __init__(self, law, file, folder):
        fmi2 = pytest.importorskip("fmpy.fmi2", reason="units for co-simulation are simulated by fmpy")
        fmpy = pytest.importorskip("fmpy")
        if not write_unit(machine_unit(law, file), folder / "box.fmu"):
            pytest.skip("no C compiler: the unit has no binary")
        told = fmpy.read_model_description(str(folder / "box.fmu"), validate=True)
        self.number = {one.name: one.valueReference for one in told.modelVariables}
        self.outputs = [one.valueReference for one in told.modelVariables if one.causality == "output"]
        self.unit = fmi2.FMU2Slave(
            guid=told.guid, unzipDirectory=fmpy.extract(str(folder / "box.fmu"), str(folder / "unit")),
            modelIdentifier=told.coSimulation.modelIdentifier, instanceName="box",
        )  # fmt: skip
        self.unit.instantiate()
        self.restart()

    def restart(self):
        self.unit.reset()
        self.unit.setupExperiment()
        self.unit.enterInitializationMode()
        self.unit.exitInitializationMode()
        return self

    def step(self, step, **inputs):
        self.unit.setReal([self.number[name] for name in inputs], [float(value) for value in inputs.values()])
        self.unit.doStep(0.0, step)
        return self.unit.getReal(self.outputs)

    def run(self, steps, step, **inputs):
        return np.array([self.step(step, **inputs) for _ in range(steps)])


def cut_by_itself(law, speed):
    """Step that a unit does not cut."""
    return 2.0 * np.pi / max(6.0 * law.arrays["OMEGA"].max(), 128.0 * abs(law.meshes.cycles).max() * speed)


@pytest.mark.slow
def test_a_unit_for_co_simulation_moves_as_modes_and_tables_do(tmp_path):
    """From the state under the mean load on, with a torque beside it, at one speed."""
    law, speed, torque = small_unit(), 200.0, 3.0
    unit, step = SimulatedUnit(law, moving().file, tmp_path), cut_by_itself(law, speed)
    at_rest = unit.unit.getReal(unit.outputs)
    found = unit.run(50, step, speed=speed, torque_input_1=torque)
    expected = twin_of(law, speed, 50, step, np.array([1e3 * torque, 0.0]))
    assert_allclose(found, expected, rtol=1e-7, atol=1e-7 * abs(expected).max())
    # Under the mean load the mesh carries it, and bearings have nothing beside their means.
    assert abs(at_rest[0] / moving().loads[0].solved.meshes[0].force - 1.0) < 0.1
    assert abs(np.array(at_rest[1:])).max() < 0.1 * at_rest[0]


@pytest.mark.slow
def test_a_unit_of_two_meshes_that_part_and_meet_their_backs_moves_as_modes_and_tables_do(tmp_path):
    """One mesh passes backwards, one is ahead of the other; a torque that turns over opens them."""
    file = load(two_stages(tmp_path, (0.0, 15.0), -60.0, MOTION.partition("[[masses]]")[0]))
    law, speed, torque = machine_law(about_first_load(file), file), 300.0, 150.0
    assert (law.meshes.cycles < 0.0).any()
    assert law.meshes.offset[1] != 0.0
    unit, step = SimulatedUnit(law, file, tmp_path), cut_by_itself(law, speed)
    name = next(name for name in unit.number if name.startswith("torque"))
    found = unit.run(600, step, speed=speed, **{name: torque})
    expected = twin_of(law, speed, 600, step, 1e3 * torque * np.eye(len(law.torques))[0])
    assert found[:, 0].min() < 0.0 < found[:, 0].max()
    assert abs(found[:, 0]).min() < 1e-9
    assert_allclose(found, expected, rtol=1e-6, atol=1e-6 * abs(expected).max())


@cache
def whole_unit():
    """The box's law with the tables that users have, as a unit; its folder."""
    folder = TemporaryDirectory()
    return SimulatedUnit(machine_law(moving().loads[0], moving().file), moving().file, Path(folder.name)), folder


@pytest.mark.slow
@pytest.mark.parametrize("place", [5, 20, 45, 55])
def test_a_unit_that_runs_at_one_speed_hums_as_the_lines_of_the_run(place):
    """Forces of mesh and bearings with their phases, of the largest line at a speed.

    Hill's equations leave out that stiffness changes with motion: 1.2 % of the mesh's; harmonic balance with the same
    tables is within 3e-4 of the unit. The mesh's is a small difference of large forces: of its mean 3e-5.
    """
    response, unit, samples, cycles = moving().loads[0], whole_unit()[0].restart(), 128, 300
    source, speed = response.sources[0], RPM * response.speeds_rpm[place]
    step = 2.0 * np.pi / (speed * source.rate * samples)
    unit.run(samples * cycles, step, speed=speed)
    seen = np.fft.rfft(np.roll(unit.run(samples, step, speed=speed), 1, axis=0), axis=0)[1:] / samples
    lines = source.lines
    bearings = response.bearing_forces(lines.readings[place])[..., :3].reshape(source.told.shape[1], -1)
    mean = response.solved.meshes[0].force
    for found, expected in ((seen[:, :1], lines.mesh_forces[place, :, :1]), (seen[:, 1:], bearings)):
        assert_allclose(found[: len(expected)], expected, rtol=0.0, atol=0.015 * abs(expected).max() + 3e-5 * mean)


@pytest.mark.slow
def test_torques_on_a_unit_do_what_the_loaded_machine_and_its_ripple_do():
    """Slowly: the difference of two equilibria, 0.2 % of the largest; swinging: the line of the ripple, 1e-3."""
    response, file, samples = moving().loads[0], moving().file, 64
    (turning, held), (trained, trains) = response.solved.load.torques, meshes_and_trains(file)
    source, ripple = response.sources[0], next(one for one in response.sources if one.name.startswith("torque"))
    ends, more = [], 3.0
    for sign in (-1.0, 1.0):
        torques = replace(turning, torque_Nm=turning.torque_Nm + sign * more), held
        solved = solve_load(file.model, replace(response.solved.load, torques=torques), trained, 32, trains=trains)
        unit, at_10_Hz = whole_unit()[0].restart(), {"step": 0.1 / samples, "speed": 20.0 * np.pi / source.rate}
        torques = {"torque_input_1": sign * more, "torque_output_2": sign * more * 29.0 / 19.0}
        unit.run(4 * samples, **at_10_Hz, **torques)
        expected = [solved.meshes[0].force, *np.ravel([one["force_N"] for one in bearing_data(solved)])]
        ends.append((unit.run(samples, **at_10_Hz, **torques).mean(axis=0), np.array(expected)))
    found, expected = (high - low for low, high in zip(*ends, strict=True))
    assert_allclose(found, expected, rtol=0.0, atol=2e-3 * abs(expected).max())

    place, samples, turns, unit = 30, 19 * 128, 40, whole_unit()[0].restart()
    speed = RPM * response.speeds_rpm[place]
    seen = [
        unit.step(2.0 * np.pi / (speed * samples), speed=speed,
                  torque_input_1=1.5 * np.cos(2.0 * 2.0 * np.pi * (n + 0.5) / samples))
        for n in range(turns * samples)
    ]  # fmt: skip
    found = np.fft.rfft(np.roll(seen[-samples:], 1, axis=0), axis=0)[2] / samples
    lines = ripple.lines
    expected = [lines.mesh_forces[place, 0, 0], *response.bearing_forces(lines.readings[place, 0])[:, :3].ravel()]
    assert_allclose(found, expected, rtol=0.0, atol=1e-3 * max(map(abs, expected)))


def test_what_a_unit_has_no_table_for_is_refused_before_work(tmp_path):
    place = 'pinion = { shaft = "input", at_mm = 35.0'
    uneven = f", modification = {{ pitch_deviations_um = {[1.0] + 18 * [0.0]} }}"
    path = written(tmp_path, SMALL.replace(place, place + uneven) + MOTION)
    with pytest.raises(CaseError, match="a unit for co-simulation takes gears with one mesh each"):
        pmor.export_file(path, "fmu", tmp_path / "box.fmu")
