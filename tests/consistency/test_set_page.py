"""The live page of a set solves all meshes as the program does, at any setting of its sliders."""

import json
from contextlib import nullcontext
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.core.errors import GeometryError
from pmor.gear.condition import ALIGNED, Assembly
from pmor.pair.model import gear_pair
from pmor.report.page import page_html
from pmor.sets import live
from pmor.sets.bounds import refuse_errors
from pmor.sets.live import live_blocks, set_section
from pmor.sets.loader import load
from pmor.sets.plan import with_errors
from pmor.sets.run import first_torques_Nm, train_of
from pmor.sets.solution import SetSolution, errors_of, solve_placed, solve_set
from tests.support.chromium import browser
from tests.support.matrix import SPLIT, STEPPED
from tests.support.page_solver import STE, PageSolver
from tests.support.small_sets import MODIFIED_SET, NO_STRESS, SMALL_CHAIN, SMALL_SET, written_set

pytestmark = pytest.mark.jit
# A floating sun, planets on springs; errors in the file, and planets whose teeth differ.
FLOATING = SMALL_SET + NO_STRESS + '[supports]\nsun_radial_N_per_mm = "free"\nplanet_radial_N_per_mm = 5e5\n'
FLOATING += "[eccentricity]\nring_um = 8.0\nring_deg = 40.0\n"
GRIDS = [[[0.2 * (tooth % 5)] * 2, [0.3 * (tooth % 3)] * 2] for tooth in range(18)]
GRIDS = f"{{ roll_deg = [0.0, 60.0], z_mm = [-10.0, 10.0], amount_um = {GRIDS[0]}, teeth_um = {GRIDS} }}"
WAVES = "waves = [{ count = 37, amplitude_um = 2.0, phase_deg = 20.0 }]\n"
FLOATING += f"[planet.modification]\ntopography = {GRIDS}\n{WAVES}"
# Rings on lugs, and teeth off their places.
LUGS = SMALL_SET.replace("rim_thickness_mm = 12.0\n", "rim_thickness_mm = 12.0\nheld = { lugs = 6, lug_deg = 20.0 }\n")
LUGS = f"{LUGS}{NO_STRESS}[planet.modification]\npitch_deviations_um = {[0.0, 4.0, -3.0] * 6}\n"


def solved(folder, text):
    """A set file, its solution under its nominal torque, and the section of its page."""
    file = load(written_set(folder, text))
    plan, pitches = file.plan, file.plan.cycle
    torque = first_torques_Nm(file)[-1:]
    found = solve_set(plan, train_of(file), torque, file.angles_per_pitch, pitches)
    return file, found, set_section(file, found)


@pytest.fixture(scope="module")
def floating(tmp_path_factory):
    return solved(tmp_path_factory.mktemp("set"), FLOATING)


def drawn(section, rng):
    """Random values of all sliders."""
    setting = json.loads(json.dumps(section.data["setting"]))
    for control in section.controls:
        value = rng.uniform(control.low, control.high)
        if control.group == "load":
            setting[control.key] = round(value) // section.data["train"]["cycle"] * section.data["train"]["cycle"] \
                if control.key == "pitch" else value
        else:
            setting["errors"][int(control.key)] = 0.5 * value
    for mesh, own in zip(section.meshes, setting["meshes"], strict=True):
        for control in mesh.controls:
            value = str(rng.choice(control.choices)) if control.choices else rng.uniform(control.low, control.high)
            own["modifications"][control.group == "wheel"][control.key] = value
    return setting


def plan_of(file, section, setting):
    """The plan of the file with the errors of a setting."""
    said, count = file.sections, file.sections.planets.count
    for entry, value in zip(section.data["train"]["toml"], setting["errors"], strict=True):
        key, place = entry["key"], entry["place"]
        if entry["name"] is not None:
            gears = [replace(gear, **{key: value}) if gear.name == entry["name"] else gear for gear in said.gears]
            said = replace(said, gears=tuple(gears))
            continue
        own = getattr(said, entry["section"])
        if place is not None:
            values = list(getattr(own, key) or (0.0,) * count)
            values[place] = value
            value = tuple(values)
        said = replace(said, **{entry["section"]: replace(own, **{key: value})})
    return with_errors(file.plan, said)


def in_python(file, found, section, setting):
    """The set at a setting of the page: its solution."""
    plan, meshes = plan_of(file, section, setting), []
    kinds = list(file.cases)
    for mesh, of_plan in zip(found.train.meshes, found.plan.meshes, strict=True):
        own = setting["meshes"][kinds.index(of_plan.case)]["modifications"]
        flanks = mesh.assembly.pinion, mesh.assembly.wheel
        flanks = [replace(flank, **keys) for flank, keys in zip(flanks, own, strict=True)]
        meshes.append(replace(mesh, assembly=Assembly(ALIGNED, *flanks)))
    train = replace(found.train, meshes=tuple(meshes))
    placed = train.place(found.placed.phi[: len(found.placed.phi)])
    torque = np.array([setting["torque_Nm"] * plan.torque_Nm / plan.nominal_Nm])
    states = solve_placed(placed, 1e3 * torque[:, None] * plan.load, errors_of(plan, placed, setting["pitch"]),
                          setting["pitch"])  # fmt: skip
    return SetSolution(plan, placed, torque, states, found.pitches)


READ = """(setting => {
  const result = solver.solve(setting, 0), { train } = solver.data, shares = sharesOf(train, result.states);
  return { ste: result.ste, shares, kGamma: kGamma(train, shares),
    forces: result.states.map(state => state.converged ? meshForces(train, state) : null) };
})"""


def assert_agrees(file, found, section, count, seed=3):
    rng, page = np.random.default_rng(seed), PageSolver(section.data)
    for _ in range(count):
        setting = drawn(section, rng)
        expected = in_python(file, found, section, setting)
        read = page.value(f"{READ}({json.dumps(setting)})")
        there = expected.converged[0]
        assert [ste is not None for ste in read["ste"]] == there.tolist()
        assert there.any()
        ste, forces = expected.ste_um[0], expected.mesh_force_N[0]
        assert_allclose(np.array(read["ste"], dtype=float), ste, rtol=0.0, atol=STE * np.nanmax(np.abs(ste)))
        own = np.array([row for row in read["forces"] if row])
        assert_allclose(own, forces[there], rtol=0.0, atol=STE * np.nanmax(forces))
        if expected.plan.planets:
            assert_allclose([row for row in read["shares"] if row], expected.planet_share[0][there], atol=STE)
            assert read["kGamma"] == pytest.approx(expected.k_gamma[0], rel=STE)
        else:
            assert_allclose([row for row in read["shares"] if row], expected.mesh_share[0][there], atol=STE)


def test_a_set_is_solved_as_by_the_program_at_any_setting(floating):
    assert_agrees(*floating, 2)


@pytest.mark.slow
@pytest.mark.parametrize("text", [MODIFIED_SET, SMALL_CHAIN, STEPPED, SPLIT, LUGS])
def test_helical_sets_on_pins_trains_stepped_planets_splits_and_lugs_are_too(text, tmp_path):
    assert_agrees(*solved(tmp_path, text), 4)


def test_a_page_begins_with_the_results_of_the_file(floating):
    _, found, section = floating
    page = PageSolver(section.data)
    read = page.value(f"{READ}(DATA.setting)")
    assert_allclose(read["ste"], found.ste_um[0], rtol=0.0, atol=STE * found.ste_um.max())
    assert_allclose([ste for _, ste in section.data["meshes"][1]["case"]["curves"][0]], found.ste_um[0], rtol=1e-6)


def test_a_reader_moves_a_pin_and_takes_the_file_along(floating, tmp_path):
    file, found, _ = floating
    path = tmp_path / "report.html"
    path.write_text(page_html("Set", live_blocks(file, found)), encoding="utf-8")
    result, row = "document.getElementById('live').result", "[data-group=pins][data-key='1'] input[type=number]"
    with browser() as page:
        page.open(path)
        page.wait_for(f"!!{result}")
        page.evaluate(f"""{result} = null; (input => {{
          input.value = 30;
          input.dispatchEvent(new Event("input"));
        }})(document.querySelector({json.dumps(row)}))""")
        page.wait_for(f"!!{result}")
        assert page.evaluate(f"{result}.setting.errors[1]") == 30.0
        page.evaluate("document.getElementById('live-toml').click()")
        text = page.evaluate("document.getElementById('live-text').value")
        assert "[planets]\ntangential_um = [10,30,0]" in text
        assert "ring_um = 8" in text
        page.evaluate("""(select => { select.selectedIndex = 3; select.dispatchEvent(new Event("input")); })(
          document.getElementById("live-mesh"))""")
        page.wait_for(f"{result}.mesh === 3")
        assert page.evaluate("[...document.querySelectorAll('#live .mesh')].map(part => part.hidden)") == [True, False]
        assert page.nameless("slider", "spinbutton", "combobox", "checkbox", "button", "textbox", "image") == []
        page.fit_a_phone()
        assert page.named("Runtime.consoleAPICalled", "Runtime.exceptionThrown", "Log.entryAdded") == []


def test_the_page_warns_of_errors_that_a_file_may_not_have(floating):
    """Tangential errors of pins hardly change distances, radial ones do."""
    file, _, section = floating
    page, setting = PageSolver(section.data), json.loads(json.dumps(section.data["setting"]))
    pairs = {name: gear_pair(case) for name, case in file.cases.items()}
    moved = [n for n, entry in enumerate(section.data["train"]["toml"]) if entry["key"] == "radial_um"]
    for amount in (0.0, 0.3, 40.0):
        setting["errors"][moved[1]] = amount
        said = replace(file.sections, planets=replace(file.sections.planets, radial_um=(0.0, amount, 0.0)))
        with pytest.raises(GeometryError) if amount > 1.0 else nullcontext():
            refuse_errors(with_errors(file.plan, said), file.cases, pairs)
        beyond = page.value(f"axesBeyond(solver.data.train, {json.dumps(setting)})")
        assert beyond == (["planet 2 - ring"] if amount > 1.0 else [])


@pytest.mark.slow
def test_a_page_that_solves_a_part_of_a_long_cycle_shows_any_of_it(tmp_path, monkeypatch):
    file, found, section = solved(tmp_path, SPLIT)
    monkeypatch.setattr(live, "MOST_ANGLES", file.angles_per_pitch)
    short = set_section(file, found)
    assert (short.data["train"]["pitches"], short.data["train"]["cycle"]) == (1, file.plan.cycle)
    assert file.plan.cycle > 1
    read = PageSolver(short.data).value(f"{READ}({json.dumps(short.data['setting'] | {'pitch': 1})})")
    expected = found.ste_um[0, file.angles_per_pitch : 2 * file.angles_per_pitch]
    assert_allclose(read["ste"], expected, rtol=0.0, atol=STE * np.abs(expected).max())
