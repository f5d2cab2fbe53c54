"""The page's solver in an engine without a browser, which no test skips, against the same equations in Python."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.case import change_case, load_case
from pmor.gear.condition import ALIGNED, Condition
from pmor.gear.modification import Modification, Wave
from pmor.gear.topography import Topography, of_teeth
from pmor.line.kernels import loads
from pmor.line.kernels.law import approach_of
from pmor.line.kernels.pressure import PATCH_FIELDS, line_patches
from pmor.line.kernels.tip_corner import stored_law
from pmor.report.live.section import live_section
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.model import online_angles
from tests.support.matrix import ROWS
from tests.support.page_solver import CASES, STE, TEMPLATES, PageSolver, condition_of, kernel_hashes, online_result
from tests.support.small_case import case_with

pytestmark = pytest.mark.jit
UNLIKE = ("ring at lugs",)
OVERLOAD = 1.2e7  # N mm: of some positions, not of all
HELICAL = {
    "pair": {"helix_angle_deg": 20.0}, "mesh": {"profile_elements": 5, "width_elements": 2, "element": "hex20"},
    "pinion": {"teeth": 21, "bore_radius_mm": 20.0}, "contact": None, "reduction": None, "offline": None,
}  # fmt: skip


@pytest.fixture(scope="module")
def spur():
    """The paper's pair on a coarse mesh."""
    coarse = {"profile_elements": 6, "width_elements": 2}
    return online_result(change_case(load_case(CASES / "paper_spur.toml"), mesh=coarse))


def drawn_setting(section, rng):
    """Random values of all controls: the setting as the page has it, and the values by group and key."""
    setting, values = json.loads(json.dumps(section.data["setting"])), {}
    mesh = setting["meshes"][0]
    parts = dict(zip(("pinion", "wheel"), mesh["modifications"], strict=True)) | {"axes": mesh["axes"], "load": setting}
    for control in (*section.controls, *section.meshes[0].controls):
        value = str(rng.choice(control.choices)) if control.choices else float(rng.uniform(control.low, control.high))
        parts[control.group][control.key] = values[control.group, control.key] = value
    return setting, values


def angles_of(section):
    """How many angles of a pitch the page solves."""
    return section.data["meshes"][0]["model"]["angles"]


def compare_solver(result, pair, count, angles=8):
    """The page's solver in an engine that no test skips: at random settings and angles that of Python."""
    section, rng = live_section(result, pair), np.random.default_rng(23)
    solver, total = PageSolver(section.data), angles_of(section)
    for _ in range(count):
        setting, values = drawn_setting(section, rng)
        numbers = np.sort(rng.choice(total, angles, replace=False)).tolist()
        found = solver.sweep(setting, numbers)
        phi = online_angles(pair.meshed.pair.pitch, total)[numbers]
        expected = sweep_line_loads(pair, phi, [condition_of(values, result.case)])
        assert (expected.converged | expected.overloaded).all()
        scale = np.nanmax(np.abs(expected.ste_um[0]))
        assert_allclose(np.array(found["ste"], dtype=float), expected.ste_um[0], rtol=0.0, atol=STE * scale)
        # The same way to the solution: a rounded compliance changes a step now and then.
        assert np.mean(found["steps"] == expected.newton_steps[0]) >= 0.7


def test_the_solver_without_a_browser_solves_what_python_solves(spur):
    compare_solver(*spur, 12)


@pytest.mark.slow
def test_it_does_so_at_many_settings_of_the_papers_pair():
    compare_solver(*online_result(load_case(CASES / "paper_spur.toml")), 50)


@pytest.mark.slow
def test_the_page_names_positions_that_overload_a_section_where_python_does(spur):
    result, pair = spur
    section = live_section(*spur)
    setting, total = json.loads(json.dumps(section.data["setting"])), angles_of(section)
    setting["torque_Nm"] = 1e-3 * OVERLOAD
    phi = online_angles(pair.meshed.pair.pitch, total)
    expected = sweep_line_loads(pair, phi, [Condition(torque=OVERLOAD)])
    assert 0.1 < expected.overloaded.mean() < 0.9
    solver = PageSolver(section.data)
    assert [ste is None for ste in solver.sweep(setting, range(total))["ste"]] == expected.overloaded[0].tolist()
    assert solver.warnings(setting)[0].startswith(
        f"{expected.overloaded.sum()} of {total} positions overload a section"
    )

    # The curve has gaps there.
    solver.run((TEMPLATES / "live" / "plots.js").read_text(encoding="utf-8"))
    solver.run("svgElement = (tag, attributes) => attributes;")
    drawn = 'curve([[0, 1], [1, 2], [2, NaN], [3, 1], [4, 3]], x => x, y => y, "now")[0].d'
    assert solver.value(drawn) == "M0.0 1.0L1.0 2.0M3.0 1.0L4.0 3.0"


def test_the_solver_knows_the_edge_that_undercut_leaves():
    undercut = HELICAL | {
        "pair": {}, "pinion": {"teeth": 12, "bore_radius_mm": 8.0}, "wheel": {"teeth": 40, "bore_radius_mm": 25.0},
        "load": {"torque_Nm": 50.0}, "online": {"angles_per_pitch": 32, "torques_Nm": [50.0]},
        "compare": {"torques_Nm": [50.0]},
    }  # fmt: skip
    compare_solver(*online_result(case_with(**undercut)), 5, 32)


def compare_laws(section, pair):
    """Approach and pressure of all sections at some angles; return how many are near a corner or an edge.

    From far below the least load, on which sections begin, to where contact reaches the end of the layer.
    """
    solver, total = PageSolver(section.data), angles_of(section)
    lines = pair.lines.place(online_angles(pair.meshed.pair.pitch, total), ALIGNED).lines
    solver.run("""var kinematics = kinematicsAt(model, DATA.setting.meshes[0].axes);
    function sectionsAt(i) {
      const sections = placeSections(model, kinematics, kinematics.pitch * i / model.angles);
      for (const section of sections) makeReady(Object.assign(section, { model }));
      return sections;
    }""")
    count, corners = len(pair.layered.sections.z), 0
    for angle in range(0, total, 9):
        solver.run(f"var placed = sectionsAt({angle});")
        sections = solver.value("placed.map(({ pair, section, law }) => [pair, section, law.least])")
        for number, (tooth, place, least) in enumerate(sections):
            stored = lines.law[angle, (tooth - lines.first_pair[angle]) * count + place]
            law = stored_law(stored)
            forces = [0.5 * least, least, *np.geomspace(1e-6, 3e3, 12).tolist()]
            approach = f"load => approachOf(load, placed[{number}].law, model.gears)"
            found = solver.value(f"{forces}.map({approach})")
            expected = [approach_of(force, law, pair.layered.corners) for force in forces]
            assert_allclose(found, expected, rtol=1e-11)
            found = solver.value(f"{forces}.map(load => pressureUnder(load, placed[{number}].law))")
            patches = np.empty((len(forces), 1, PATCH_FIELDS))
            line_patches(stored[None], np.array(forces)[:, None], patches)
            # Where an edge begins to carry an arc cosine is taken of nearly 1.
            assert_allclose(np.array(found, dtype=float), patches[:, 0, 2], rtol=1e-7)
            corners += math.isfinite(law.plain)
    return corners


def test_approaches_and_pressures_under_any_load_are_those_of_python(spur):
    assert compare_laws(live_section(*spur), spur[1]) > 10


# Change the page's solver with a kernel, then its hash here.
TRANSCRIBED = {
    "pmor/gear/kernels/motion.py": {
        "roll_angle": "f93197e1", "section_roll_position": "9afc5245", "_wheel_rotation": "26888920",
        "_move_parallel": "845e85cc", "_reverse": "2cf29239", "relative_motion": "43be8439", "_tilt": "8b6f5ea7",
        "section_offset": "28b81155", "axial_opening": "a100d342", "section_motion": "f9949d80",
    },
    "pmor/gear/kernels/deviation.py": {
        "flank_deviation": "b9edab52", "_relief": "f7c721d8", "_on_grid": "c70a5221", "_cell": "b4746ed1",
    },
    "pmor/gear/flank_deviation.py": {
        "kernel_deviation": "0aec1742",
    },
    "pmor/line/kernels/contact_point.py": {
        "cubic_rows": "e670fbce", "involute_foot": "6c3e16ce", "_tip_foot": "8c9785be",
        "_corner_foot": "9a56935a", "_undercut": "acd76cdc", "closest_approach": "0f1052f3", "_turned": "341f0321",
    },
    "pmor/line/kernels/places.py": {
        "_first_pair": "c7cff0de", "_within": "f6350319", "_place": "c8e1208c", "_carry": "5e80789c",
        "line_deviations": "de61c616",
    },
    "pmor/line/kernels/law.py": {
        "_smooth_approach": "fce019dc", "load_at": "c4554bcd", "widest_load": "d84dfccb", "approach_of": "bdcadf17",
        "line_law": "f0da3a83", "_corner": "46d88f0f", "_from_corner": "b2efd556", "_law_near_corner": "6ebc4515",
        "sections_alike": "df9f3b46",
    },
    "pmor/line/kernels/pressure.py": {"edge_pressure": "3b2d980f", "_patch": "ad6241b4"},
    "pmor/line/pair.py": {"line_compliance_between": "9854e29e"},
    "pmor/line/hertz.py": {"mean_layer_constant": "d90b7b6e", "width_limit": "88aad769"},
    "pmor/line/kernels/tip_corner.py": {
        "_hertz": "5174cf36", "_cut_off": "afc00315", "_across": "a9f710c5", "contact_patch": "a60b4c7e",
        "_spread_part": "de89416b", "single_mean": "8b032f55", "_felt": "4ba65c97", "_layer_end": "2bd060bf",
        "corner_approach": "c061e786",
    },
    "pmor/line/kernels/starts.py": {
        "_expected": "daf8ff6f", "start_with": "d47758ba",
    },
    "pmor/line/kernels/movements.py": {
        "turning": "42d11bd5", "place_at": "088ccb67", "out_of_balance": "33fdfe0d",
        "solve_held": "79638778", "let_go": "8f49b63b",
    },
    "pmor/line/kernels/loads.py": {
        "_solve": "9e9aa291", "linearise": "9747560a", "fill_equations": "c8e7c7a0", "_newton_step": "391758a6",
        "_accept": "6c3fdb8a", "_accept_to_first": "32b2bd33", "_deflect": "07a635f3", "_touch": "0d506109",
        "_begin": "eddfaeb9",
    },
    "pmor/line/kernels/flexibility.py": {
        "_product": "baca11b6", "_bilinear": "007b2a4d", "_between": "dabdfded", "make_ready": "89afecc4",
        "_couple": "ce20dfbf", "_move": "9fdb99f7",
    },
    "pmor/core/linear.py": {
        "eliminate": "d43d7556",
    },
    "pmor/sets/plan.py": {
        "hubs_off": "7e1a045d",
    },
}  # fmt: skip


def test_the_page_transcribes_the_kernels_as_they_are():
    for path, expected in TRANSCRIBED.items():
        found = kernel_hashes(path)
        changed = {name: found.get(name) for name, value in expected.items() if found.get(name) != value}
        assert not changed, f"{path}: bring pmor/report/templates/live up to date with {changed}, then these hashes"


def test_constants_travel_with_the_page(spur):
    """A solver that begins elsewhere takes other steps."""
    section = live_section(*spur)
    assert section.data["constants"]["BEGINNING"] == loads.BEGINNING
    setting, numbers = json.loads(json.dumps(section.data["setting"])), (0, 50)
    flank = {"helix_slope_um": 15.0, "tip_relief_um": 30.0, "tip_relief_start_roll_deg": 25.0}
    setting["meshes"][0]["modifications"][0] |= flank
    usual = PageSolver(section.data).sweep(setting, numbers)
    for name, value in (("TOLERANCE", 1e-2), ("BEGINNING", 1e9), ("PATIENCE", 0)):
        other = PageSolver({**section.data, "constants": {**section.data["constants"], name: value}})
        assert other.sweep(setting, numbers)["steps"] != usual["steps"], name


@pytest.mark.parametrize(("wheel", "bodies"), [({"teeth": 30, "bore_radius_mm": 25.0}, 2), (None, 1)])
def test_the_page_solves_helical_pairs_and_gears_that_differ_in_the_hand_alone_share_a_compliance(wheel, bodies):
    result, pair = online_result(case_with(**HELICAL, wheel=wheel))
    (data,) = live_section(result, pair).data["meshes"]
    assert len(data["bodies"]) == bodies
    assert data["body_of"][1]["mirrored"] == (bodies == 1)
    compare_solver(result, pair, 4)


@pytest.mark.parametrize("helix_deg", [pytest.param(0.0, marks=pytest.mark.slow), 15.0])
def test_the_page_solves_rings(helix_deg):
    ring = {"teeth": 60, "internal": True, "addendum": 0.8, "rim_thickness_mm": 8.0, "root_fillet_mm": 1.2}
    case = case_with(
        pair={"module_mm": 4.0, "face_width_mm": 20.0, "helix_angle_deg": helix_deg}, contact=None, reduction=None,
        offline=None, wheel=ring, mesh={"element": "hex20", "profile_elements": 4, "width_elements": 2},
    )  # fmt: skip
    compare_solver(*online_result(case), 4)


def test_what_has_no_slider_counts_as_it_stands_in_the_case():
    """Also on rounded tips, whose contact crosses the edge, and in plane strain, where all sections are alike."""
    rng = np.random.default_rng(5)
    amounts = tuple(map(tuple, rng.uniform(0.0, 5.0, (5, 3))))
    grids = [Topography(tuple(np.linspace(3.0, 36.0, 5)), (-10.0, 0.0, 10.0), amounts)]
    grids += [replace(grids[0], amount_um=amounts[::-1])] * 20
    pitch = tuple(rng.uniform(-3.0, 3.0, 21))
    more = {
        "waves": (Wave(count=30, amplitude_um=1.0, phase_deg=70.0),),
        "root_relief_um": 4.0, "root_relief_end_roll_deg": 12.0, "root_relief_shape": "parabolic", "twist_um": 6.0,
        "end_relief_um": 5.0, "end_relief_length_mm": 3.0,
    }  # fmt: skip
    flanks = Modification(topography=of_teeth(grids), pitch_deviations_um=pitch, tip_relief_um=2.0,
                          tip_relief_start_roll_deg=28.0), Modification(**more)  # fmt: skip
    gear = {"teeth": 21, "bore_radius_mm": 20.0, "tip_rounding_mm": 0.3}
    for width in "half", "plane_strain":
        mesh = {"element": "hex20", "profile_elements": 4, "width_elements": 2, "width": width}
        plain = case_with(pinion=gear, mesh=mesh, contact=None, reduction=None, offline=None)
        case = replace(plain, pinion_modification=flanks[0], wheel_modification=flanks[1])
        result, pair = online_result(case if width == "half" else plain)
        compare_solver(result, pair, 4)
        assert compare_laws(live_section(result, pair), pair) > 10


@pytest.mark.parametrize("row", ["coast flanks", *(pytest.param(row, marks=pytest.mark.slow) for row in UNLIKE)])
def test_coast_flanks_and_teeth_that_differ_are_solved_as_by_the_program(row, tmp_path):
    """Of teeth that differ the first pitch."""
    path = tmp_path / "pair.toml"
    path.write_text(ROWS[row])
    result, pair = online_result(load_case(path))
    assert any(pair.lines.supports) == (row in UNLIKE)
    compare_solver(result, pair, 4)
