"""The live page of a gearbox solves shafts, bearings and all meshes as the program does."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor
from pmor.machine.coupled import hubs_of, mesh_force, solve_load
from pmor.machine.live import live_blocks, machine_data, machine_section
from pmor.machine.loaded import loaded
from pmor.machine.loader import load
from pmor.machine.mesh_force import f_beta_um
from pmor.machine.run import with_rigid_supports
from pmor.pair.model import elastic_model, mesh_model
from pmor.report.live.section import HELICAL_ANGLES, LiveSection
from pmor.report.page import page_html
from pmor.results.load_distribution import face_load_factor, line_states
from pmor_offline.train import train
from pmor_online.model import reduced_pair
from tests.support.chromium import browser
from tests.support.gearboxes import SMALL, fva_box, written
from tests.support.page_solver import STE, TEMPLATES, PageSolver
from tests.support.set_gearboxes import TWO_STAGES, written_reducer

pytestmark = pytest.mark.jit
# Of the largest: asked for; the flanks' compliance is rounded. Measured: 1e-7 to 4e-7.
AGREES = 1e-6
# Without contact nothing is rounded but sums of doubles.
EXACT = 1e-9
# Of a torque on the pinion: levers of tip corners.
NEARLY = 1e-3
LINEAR = ("axial_N_per_mm", "radial_N_per_mm", "tilt_Nmm_per_rad")


def two_stages():
    """Three shafts on bearings by their stiffness, the last one driving back in a second load."""
    shaft = '[[shafts]]\nname = "{}"\nat_mm = [{}, {}]\nsections = [{{ length_mm = 120.0, outer_mm = {} }}]\n'
    bearing = '[[bearings]]\nname = "{0}{1}"\nshaft = "{0}"\nat_mm = {1}.0\nradial_N_per_mm = {2}\n'
    mesh = '[[meshes]]\nname = "{}"\ncase = "small.toml"\npair = {{ helix_angle_deg = {} }}\n'
    places = 'pinion = {{ shaft = "{}", at_mm = {} }}\nwheel = {{ shaft = "{}", at_mm = {} }}\n'
    load_case = (
        '[[loads]]\nname = "{}"\ntorques = [{{ shaft = "in", at_mm = 0.0, torque_Nm = {} }}, '
        '{{ shaft = "out", at_mm = 120.0, torque_Nm = "balance" }}]\n'
        'forces = [{{ shaft = "in", at_mm = 0.0, y_N = 300.0 }}]\n'
    )
    text = 'title = "Two stages"\n'
    for name, y, z, outer in (("in", 0.0, 0.0, 20.0), ("mid", 62.2, 0.0, 24.0), ("out", 62.2, 62.2, 28.0)):
        text += shaft.format(name, y, z, outer)
        text += bearing.format(name, 10, 2e5) + "axial_N_per_mm = 1e5\n" + bearing.format(name, 110, 1.5e5)
    text += mesh.format("first", 15.0) + places.format("in", 30.0, "mid", 30.0)
    text += mesh.format("second", -15.0) + places.format("mid", 85.0, "out", 85.0)
    text += "[gravity]\nx_m_s2 = 3.0\nz_m_s2 = -9.81\n"
    return text + load_case.format("drive", 60.0) + load_case.format("back", -50.0)


def solved(folder, text):
    """Gearbox file, reduced pairs of its meshes, its loads at the page's angles, and the section of its page."""
    file = load(written(folder, text))
    pairs = {name: reduced_pair(train(case, elastic_model(case, mesh_model(case))).basis)
             for name, case in file.cases.items()}  # fmt: skip
    loads = [solve_load(file.model, one, pairs, HELICAL_ANGLES) for one in file.model.sections.loads]
    loads = with_rigid_supports(loads, pairs, {}, HELICAL_ANGLES)
    section = machine_section(loads, pairs)
    return SimpleNamespace(file=file, pairs=pairs, loads=loads, section=section, solver=PageSolver(section.data))


@pytest.fixture(scope="module")
def box(tmp_path_factory):
    return solved(tmp_path_factory.mktemp("two"), two_stages())


def setting_of(box, **changes):
    return json.loads(json.dumps(box.section.data["setting"])) | changes


def assert_page_agrees(box, setting, expected):
    for number, mesh in enumerate(expected.meshes):
        found = box.solver.sweep(setting, range(HELICAL_ANGLES), number)
        hubs = found["support"]["hubs"]
        for name in ("compliance", "offset"):
            array = getattr(mesh.hubs, name)
            values = np.reshape([*hubs[name].values()], array.shape)
            assert_allclose(values, array, rtol=0.0, atol=AGREES * np.abs(array).max())
        assert found["support"]["force"] == pytest.approx(mesh.force, rel=AGREES)
        ste = mesh.sweep.ste_um[0]
        assert_allclose(found["ste"], ste, rtol=0.0, atol=AGREES * np.abs(ste).max())


@pytest.mark.parametrize("number", [pytest.param(0, marks=pytest.mark.slow), 1])
def test_each_load_is_that_of_the_program(box, number):
    assert_page_agrees(box, setting_of(box, load=number), box.loads[number])


@pytest.mark.slow
def test_other_bearings_loads_and_flanks_are_what_the_program_solves_anew(box):
    """Flanks of the first mesh move its force, and with it the hubs of the second."""
    sections, factors = box.file.model.sections, [0.2, 3.0, 0.5, 1.0, 5.0, 0.8]
    bearings = [
        replace(bearing, **{key: 0.7 * factor * getattr(bearing, key) for key in LINEAR
                            if not isinstance(getattr(bearing, key), str)})
        for bearing, factor in zip(sections.bearings, factors, strict=True)
    ]  # fmt: skip
    drive = sections.loads[0]
    torques = tuple(
        one if one.torque_Nm == "balance" else replace(one, torque_Nm=1.3 * one.torque_Nm) for one in drive.torques
    )
    drive = replace(drive, torques=torques, forces=tuple(replace(one, y_N=1.3 * one.y_N) for one in drive.forces))
    model = replace(box.file.model, sections=replace(sections, bearings=tuple(bearings), loads=(drive,)))
    basis = box.pairs["first"].basis
    flank = replace(basis.case.pinion_modification, helix_slope_um=9.0, helix_crowning_um=4.0)
    sloped = replace(box.pairs["first"], basis=replace(basis, case=replace(basis.case, pinion_modification=flank)))
    expected = solve_load(model, drive, {**box.pairs, "first": sloped}, HELICAL_ANGLES)

    setting = setting_of(box, share=1.3, stiffness=0.7, bearings=factors)
    setting["meshes"][0]["modifications"][0] |= {"helix_slope_um": 9.0, "helix_crowning_um": 4.0}
    assert_page_agrees(box, setting, expected)
    # They matter: without the slope of the first mesh the second one's hubs are elsewhere.
    setting["meshes"][0]["modifications"][0]["helix_slope_um"] = 0.0
    with pytest.raises(AssertionError):
        assert_page_agrees(box, setting, expected)


@pytest.mark.slow
def test_meshes_beside_a_set_and_the_set_are_those_of_the_program(tmp_path):
    """Under the load that was solved; the set has a section of its own."""
    file = load(written_reducer(tmp_path, TWO_STAGES))
    found = pmor.run(file)
    blocks = live_blocks(found.loads, found.pairs)
    machine, of_set = [block for block in blocks if isinstance(block, LiveSection)]
    mesh, solver = found.loads[0].meshes[0], PageSolver(machine.data)
    read = solver.sweep(machine.data["setting"], range(HELICAL_ANGLES))
    assert read["support"]["force"] == pytest.approx(mesh.force, rel=AGREES)
    offset = mesh.hubs.offset
    assert_allclose([*read["support"]["hubs"]["offset"].values()], offset, atol=AGREES * np.abs(offset).max())
    solution = found.loads[0].sets[0].solution
    ste = PageSolver(of_set.data).value("solver.solve(DATA.setting, 0).ste")
    expected = solution.ste_um[0, : len(ste)]
    assert_allclose(ste, expected, rtol=0.0, atol=STE * np.abs(expected).max())
    html = page_html("Gearbox", blocks)
    assert 'id="live2-numbers"' in html


@pytest.mark.slow
def test_rolling_bearings_are_exact_at_the_load_that_was_solved(tmp_path):
    small = solved(tmp_path, SMALL)
    assert [bearing["rolling"] for bearing in small.section.data["machine"]["bearings"]] == [False, False, True, True]
    assert_page_agrees(small, setting_of(small), small.loads[0])
    assert "a tangent elsewhere" in small.section.note


def unloaded(model):
    """A gearbox in equilibrium with its mesh forces at the pitch points."""
    gearbox = loaded(model, model.sections.loads[0])
    meshes = [SimpleNamespace(meshing=mesh) for mesh in gearbox.meshes]
    return SimpleNamespace(gearbox=gearbox, equilibrium=gearbox.solve(), meshes=meshes, load=model.sections.loads[0])


def assert_machine_agrees(model, expected, give=0.0):
    """The machine of the page, its rigid bearings giving way (um per kN), against another model of the program."""
    machine = machine_data([unloaded(model)])
    page = PageSolver({"constants": {}, "meshes": [], "machine": machine})
    page.run(f"""const load = DATA.machine.loads[0], wrenches = load.meshes.map(mesh => mesh.wrench);
    const bearings = DATA.machine.bearings.map(({{ rigid }}) => rigid ? 0 : 1);
    const matrix = machineMatrix(DATA.machine, load, {{ share: 1, stiffness: 1, give: {give}, bearings }});
    const {{ moved, forces }} = equilibrium(DATA.machine, load, matrix, wrenches);""")
    own = unloaded(expected)
    for number, mesh in enumerate(own.gearbox.meshes):
        force = mesh_force(own.gearbox, own.equilibrium, number)
        assert page.value("forces")[number] == pytest.approx(force, rel=EXACT)
        hubs = hubs_of(own.gearbox, own.equilibrium, mesh, force)
        found = page.value(f"hubsOf(DATA.machine, load, matrix, moved, {number}, forces[{number}], wrenches[{number}])")
        for name in ("compliance", "offset"):
            array = getattr(hubs, name)
            atol = EXACT * np.abs(array).max()
            assert_allclose(np.reshape([*found[name].values()], array.shape), array, rtol=0.0, atol=atol)


def with_housing(model, rng):
    root, scale = rng.normal(size=(30, 30)), np.tile([1.0, 1.0, 1.0, 100.0, 100.0, 100.0], 5)
    return replace(model, housing=1e5 * scale[:, None] * (root @ root.T + 30.0 * np.eye(30)) * scale)


@pytest.mark.parametrize(("radial", "tilt"), [("rigid", "rigid"), ("rigid", "free"), (5e5, "free"), (2e5, 1e8)])
@pytest.mark.parametrize("housed", [pytest.param(False, marks=pytest.mark.slow), True])
def test_shafts_bearings_and_a_housing_are_condensed_without_loss(radial, tilt, housed, rng):
    """A bearing between shafts among them."""
    model = fva_box(radial, radial, tilt).model
    model = with_housing(model, rng) if housed else model
    assert_machine_agrees(model, model)


@pytest.mark.parametrize("tilt", ["free", "rigid"])
def test_rigid_bearings_give_way_as_those_of_that_stiffness(tilt):
    assert_machine_agrees(fva_box("rigid", "rigid", tilt).model, fva_box(5e5, 5e5, tilt).model, give=2.0)


def test_two_rigid_bearings_at_one_place_are_one():
    model = fva_box().model
    twice = (*model.sections.bearings, replace(model.sections.bearings[0], name="1 again"))
    assert_machine_agrees(replace(model, sections=replace(model.sections, bearings=twice)), model)


def test_figures_beside_the_curve_are_those_of_the_program(box):
    page, mesh = box.solver, box.loads[0].meshes[1]
    script = (TEMPLATES / "live" / "page.js").read_text(encoding="utf-8")
    page.run(script[: script.rindex("for (const root of")])
    found = page.value(f"""(setting => {{
      const result = solver.solve(setting, 1), axes = DATA.machine.loads[0].meshes[1].axes;
      const model = solver.models[1];
      return [misalignmentOf(model, result.support, axes), faceLoadFactor(model, result),
        findingsOf(model, result).pressure];
    }})({json.dumps(setting_of(box))})""")
    f_beta = mesh.meshing.frame.along * f_beta_um(mesh.meshing.pair, mesh.displacement)
    lines = line_states(mesh.sweep)
    expected = [f_beta, face_load_factor(lines)[0], np.nanmax(lines.pressure_MPa)]
    assert found == pytest.approx(expected, rel=1e-5)


def test_a_reader_changes_load_bearings_and_mesh(box, tmp_path):
    path = tmp_path / "report.html"
    path.write_text(page_html("Gearbox", live_blocks(box.loads, box.pairs)), encoding="utf-8")
    result = "document.getElementById('live').result"

    def put(place, value):
        page.evaluate(f"""{result} = null; (input => {{
          input.value = {json.dumps(value)};
          input.dispatchEvent(new Event("input"));
        }})(document.querySelector({json.dumps(place)}))""")
        page.wait_for(f"!!{result}")
        return page.evaluate(f"[{result}.mesh, {result}.support.torque, {result}.peakToPeak, {result}.setting.load]")

    with browser() as page:
        page.open(path)
        page.wait_for(f"!!{result}")
        drive = page.evaluate(f"[{result}.mesh, {result}.support.torque, {result}.peakToPeak, {result}.setting.load]")
        assert drive[:2] == [0, pytest.approx(6e4, rel=NEARLY)]
        field = "[data-group=bearings][data-key='{}'] input[type={}]"
        soft = put(field.format("stiffness", "number"), 0.2)
        assert soft[1] == pytest.approx(6e4, rel=NEARLY)
        assert soft[2] != drive[2]
        assert (
            page.evaluate(f"document.querySelector({json.dumps(field.format('stiffness', 'range'))}).value") == "-0.7"
        )
        put(field.format("stiffness", "range"), 0.0)
        assert put("[data-key=share] input[type=number]", 1.5)[1] == pytest.approx(9e4, rel=NEARLY)
        assert put("[data-key=load] select", "back")[1] == pytest.approx(7.5e4, rel=NEARLY)
        assert put("#live-mesh", "second")[0] == 1
        assert page.evaluate("[...document.querySelectorAll('#live .mesh')].map(part => part.hidden)") == [True, False]
        page.evaluate("document.getElementById('live-toml').click()")
        assert 'Case of the mesh "second"' in page.evaluate("document.getElementById('live-text').value")
        page.evaluate("document.getElementById('live-reset').click()")
        page.wait_for(f"{result}.setting.share === 1 && {result}.setting.load === 0")
        assert page.nameless("slider", "spinbutton", "combobox", "checkbox", "button", "textbox", "image") == []
        page.fit_a_phone()
        assert page.named("Runtime.consoleAPICalled", "Runtime.exceptionThrown", "Log.entryAdded") == []


def test_a_page_is_left_out_where_a_case_asks_for_none(box):
    basis = box.pairs["second"].basis
    off = replace(basis, case=replace(basis.case, output=replace(basis.case.output, live_page=False)))
    assert live_blocks(box.loads, {**box.pairs, "second": replace(box.pairs["second"], basis=off)}) == []
    fine = replace(basis, case=replace(basis.case, mesh=replace(basis.case.mesh, profile_elements=300)))
    blocks = live_blocks(box.loads, {**box.pairs, "second": replace(box.pairs["second"], basis=fine)})
    assert blocks[1].startswith("Left out: mesh second: the live page takes flanks of 600 nodes at most")
    assert live_blocks([], box.pairs) == []
