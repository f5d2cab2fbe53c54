"""Broken design files: one line that names the place, the value and the remedy, exit code 2, nothing left behind."""

import pytest

from tests.support.gearboxes import ASKEW, DESIGN, written_design
from tests.support.random_cases import Raw, toml
from tests.support.refusals import refused
from tests.support.small_case import case_text
from tests.support.small_sets import SMALL_CHAIN, SMALL_DESIGN, SMALL_SET
from tests.support.small_sets import written_design as written_set_design

MESH = {"profile_elements": 5, "width_elements": 2}
RELIEF = {"key": "tip_relief_um", "range": [0.0, 20.0]}
START = {"key": "tip_relief_start_roll_deg", "range": [26.0, 30.0]}
GOOD = {"case": "small.toml", "variables": [RELIEF, START]}


def text_of(document):
    """TOML of a design: keys first, then sections and lists of them."""
    lines = [f"{key} = {toml(value)}" for key, value in document.items() if not isinstance(value, dict | list)]
    for name, content in document.items():
        for table in content if isinstance(content, list) else [content] * isinstance(content, dict):
            lines.append(f"[[{name}]]" if isinstance(content, list) else f"[{name}]")
            lines += [f"{key} = {toml(value)}" for key, value in table.items()]
    return "\n".join(lines) + "\n"


# name: (what differs from the good design, what the message must hold)
BROKEN = {
    "no case": ({"case": None}, ["case: is missing", "add 'case = ...'"]),
    "case and gearbox": ({"gearbox": "box.toml"}, ["case and gearbox", "leave one out"]),
    "mesh of a case": ({"mesh": "high speed"}, ['mesh = ["high speed"]', "name the gearbox"]),
    "objective of a mesh": ({"objective": {"meshes": "high speed"}}, ['[objective] meshes = "high', "is of a gearbox"]),
    "load cases of a case": ({"load": {"names": ["drive"]}}, ['names = ["drive"]', "write torques_Nm"]),
    "case of another name": ({"case": "smal.toml"}, ["smal.toml", "there is no such case file", "small.toml"]),
    "case without line loads": ({"case": "shapes.toml"}, ["flank_lines", "set [contact] scheme"]),
    "misspelt key": ({"search": {"sample": 8}}, ["[search] sample", "did you mean samples?"]),
    "no variable": ({"variables": None}, ["[[variables]]: is missing", "add one"]),
    "one bracket": ({"variables": {"key": "tip_relief_um", "range": [0.0, 20.0]}}, ["write [[variables]]"]),
    "unknown variable": ({"variables": [RELIEF | {"key": "tip_releif_um"}]}, ["did you mean tip_relief_um?"]),
    "variable without range": ({"variables": [{"key": "tip_relief_um"}, START]}, ["[variables] range: is missing"]),
    "range upside down": ({"variables": [RELIEF | {"range": [20.0, 0.0]}, START]}, ["[20.0, 0.0]", "lowest and the"]),
    "range of nothing": ({"variables": [RELIEF | {"range": [5.0, 5.0]}, START]}, ["[5.0, 5.0]", "lowest and the"]),
    "step beyond the range": ({"variables": [RELIEF | {"step": 50.0}, START]}, ["step = 50", "lower it"]),
    "variable twice": ({"variables": [RELIEF, START, RELIEF | {"gear": "wheel"}]}, ["of the wheel", "remove one"]),
    "relief without a start": ({"variables": [RELIEF]}, ["how far it goes on the pinion", "make it a variable"]),
    "start in radians": ({"variables": [RELIEF, START | {"range": [0.45, 0.5]}]}, ["range", "looks like radians"]),
    "start beyond the tip": ({"variables": [RELIEF, START | {"range": [26.0, 60.0]}]}, ["below the tip circle"]),
    "weights for other torques": (
        {"load": {"torques_Nm": [50.0, 100.0], "weights": [1.0, 1.0, 1.0]}}, ["weights", "each of the 2 torques"],
    ),
    "no weight at all": ({"load": {"torques_Nm": [50.0], "weights": [0.0]}}, ["weights = [0.0]", "above 0"]),
    "torque twice": ({"load": {"torques_Nm": [50.0, 50.0]}}, ["torques_Nm = [50.0, 50.0]", "remove it"]),
    "robust without scatter": ({"objective": {"value": "percentile_95"}}, ["needs a scatter", "add [scatter]"]),
    "constraint without bound": ({"constraints": [{"result": "k_h_beta"}]}, ["at_most: is missing"]),
    "nested too deeply": ({"case": Raw("[" * 100_000)}, ["not valid TOML", "nested too deeply"]),
    "gear of a set": ({"variables": [RELIEF | {"gear": "sun"}, START]}, ['gear = "sun"', "a pair has none"]),
    "idle flank": ({"variables": [RELIEF | {"flank": "coast"}, START]}, ["coast flanks of both", "leave it out"]),
    "factor of a set": ({"objective": {"minimise": "k_gamma"}}, ['minimise = "k_gamma"', "write one of a pair"]),
    "against itself": ({"pareto": {"against": "peak_to_peak_um"}}, ["is the objective itself"]),
}  # fmt: skip


@pytest.mark.parametrize("name", BROKEN)
def test_broken_designs_are_refused_in_one_line_and_leave_nothing(name, tmp_path, monkeypatch):
    changes, words = BROKEN[name]
    lines = {"mesh": MESH, "contact": {"scheme": "line"}}
    (tmp_path / "small.toml").write_text(case_text(**lines, reduction=None))
    (tmp_path / "shapes.toml").write_text(case_text(mesh=MESH))
    path = tmp_path / "broken.toml"
    path.write_text(text_of({key: value for key, value in (GOOD | changes).items() if value is not None}))
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.rglob("*"))
    error = refused("design", "broken.toml", words=words)
    assert "broken.toml" in error or "smal.toml" in error
    assert sorted(tmp_path.rglob("*")) == before


REVERSE = ASKEW[ASKEW.rindex("[[loads]]") :].replace('"light"', '"back"').replace("20.0", "-20.0")
# name: (what stands in the design of a gearbox, what stands there instead, what the message must hold)
OF_A_GEARBOX = {
    "unknown mesh": ('mesh = "mesh"', 'mesh = "mush"', ['mesh = "mush"', "box has none", "did you mean mesh?"]),
    "variable of another mesh": ('gear = "pinion"', 'gear = "pinion"\nmesh = "mush"', ["did you mean mesh?"]),
    "no such gearbox": ("box.toml", "bex.toml", ["bex.toml", "there is no such gearbox file", "box.toml"]),
    "torques of its own": (
        "[load]",
        "[load]\ntorques_Nm = [5.0]",
        ["torques_Nm = [5.0]", "choose load cases by names"],
    ),
    "unknown load": ("[load]", '[load]\nnames = ["dive"]', ['"dive"', "no such load case", "did you mean drive?"]),
    "load twice": ("[load]", '[load]\nnames = ["drive", "drive"]', ["has an entry twice"]),
    "loads of both flanks": ("[load]", '[load]\nnames = ["drive", "back"]', ['"back"', "on other flanks than"]),
    "weights of other loads": ("[1.0, 2.0]", "[1.0]", ["weights = [1.0]", "each of the 2 load cases"]),
    "relief without a start": ("helix_crowning_um", "tip_relief_um", ["how far it goes on the pinion"]),
}


@pytest.mark.parametrize("name", OF_A_GEARBOX)
def test_broken_designs_of_a_gearbox_are_refused_in_one_line_and_leave_nothing(name, tmp_path, monkeypatch):
    old, new, words = OF_A_GEARBOX[name]
    assert old in DESIGN
    written_design(tmp_path, DESIGN.replace(old, new), f"{ASKEW}{REVERSE}")
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.rglob("*"))
    assert "design.toml" in refused("design", "design.toml", words=words)
    assert sorted(tmp_path.rglob("*")) == before


# name: (what stands in the design of a set, what stands there instead, what the message must hold)
OF_A_SET = {
    "set and case": ("set =", 'case = "small.toml"\nset =', ["case and set", "leave one out"]),
    "no such set": ("small.toml", "smal.toml", ["smal.toml", "there is no such set file", "small.toml"]),
    "unknown member": ('"sun"', '"son"', ['gear = "son"', "the set has", "did you mean sun?"]),
    "no member": ('gear = "sun"\n', "", ['gear = "both"', "name the member"]),
    "carrier": ('"sun"', '"carrier"', ['gear = "carrier"', '"sun", "ring", "planet"']),
    "idle flank": ('gear = "sun"', 'gear = "sun"\nflank = "coast"', ["coast flanks of sun carry nothing", '"drive"']),
    "same flank twice": (
        'key = "profile_crowning_um"',
        'key = "helix_crowning_um"',
        ["helix_crowning_um of the planet", "remove one"],
    ),
    "relief without a start": (
        'key = "profile_crowning_um"',
        'key = "tip_relief_um"',
        ["how far it goes on the planet", "[planet.coast_modification] of small"],
    ),
    "start beyond the tip": ("tip_relief_start_percent", "tip_relief_start_roll_deg", ["[sun.modification]", "tip"]),
    "load cases": ("[load]", '[load]\nnames = ["drive"]', ['names = ["drive"]', "write torques_Nm"]),
    "scatter of axes": ("[load]", "[scatter]\nin_plane_um = 1.0\n[load]", ["in_plane_um: is of pairs", "[tolerances]"]),
    "robust without scatter": ("[load]", '[objective]\nvalue = "expected"\n[load]', ["needs a scatter"]),
    "torque beyond the range": ("[300.0]", "[1e9]", ["stay below"]),
}  # fmt: skip


@pytest.mark.parametrize("name", OF_A_SET)
def test_broken_designs_of_a_set_are_refused_in_one_line_and_leave_nothing(name, tmp_path, monkeypatch):
    old, new, words = OF_A_SET[name]
    assert old in SMALL_DESIGN
    written_set_design(tmp_path, SMALL_DESIGN.replace(old, new, 1))
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.rglob("*"))
    assert ".toml" in refused("design", "design.toml", words=words)
    assert sorted(tmp_path.rglob("*")) == before


def test_runout_in_a_design_over_scatter_is_refused(tmp_path, monkeypatch):
    text = f'{SMALL_DESIGN}\n[objective]\nvalue = "expected"\n'
    written_set_design(tmp_path, text, f"{SMALL_SET}[tolerances]\nsun_eccentricity_um = 2.0\n")
    monkeypatch.chdir(tmp_path)
    refused("design", "design.toml", words=["not sun_eccentricity_um", "leave it out of small"])


def test_the_mesh_load_factor_of_gears_on_fixed_axes_is_refused(tmp_path, monkeypatch):
    text = SMALL_DESIGN.replace('"sun"', '"input"').replace('"planet"', '"idler"').replace("[300.0]", "[100.0]")
    written_set_design(tmp_path, f'{text}\n[objective]\nminimise = "k_gamma"\n', SMALL_CHAIN)
    monkeypatch.chdir(tmp_path)
    refused("design", "design.toml", words=['"k_gamma": is of planets', "small has none"])


def test_a_trained_scheme_in_a_mesh_is_refused(tmp_path, monkeypatch):
    shapes = ASKEW.replace('case = "small.toml"', 'case = "small.toml"\ncontact = { scheme = "direct" }')
    written_design(tmp_path, box=shapes)
    monkeypatch.chdir(tmp_path)
    refused("design", "design.toml", words=["a gearbox takes line loads", '"mesh"'])
