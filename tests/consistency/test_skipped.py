"""What the plan says is left out is left out, and the sizes are those of the run."""

import h5py
import numpy as np
import pytest

from pmor import plan
from pmor.app.skipped import computed, scene, skipped, unknowns
from pmor.case import change_case, load_case
from pmor.fe.assembly import degrees_of_freedom
from pmor.fe.condensation import condense_sector
from pmor.gear.condition import Condition
from pmor.pair.conditions import full_solves
from pmor.pair.model import mesh_model
from pmor.penalty.position import active_patches
from pmor.penalty.solve import window_depth
from pmor.storage.basis_file import read_basis
from pmor.work.offline import run_offline
from pmor.work.sizes import rows_in_contact
from tests.support.small_case import case_with, full_fe

CASES = ("paper_spur", "paper_64", "small_spur", "unequal_pair")
UNEQUAL = {
    "pinion": {"teeth": 17, "profile_shift": 0.3},
    "wheel": {"teeth": 23, "bore_radius_mm": 20.0},
    "mesh": {"profile_elements": 5, "width_elements": 3},
    "offline": {"angles_per_pitch": 4, "torques_Nm": [100.0]},
    "compare": {"torques_Nm": [100.0]},
    "output": {"plots": False, "report": False},
}


def listed(some):
    return {item.what: item for item in skipped(scene(some))}


def test_four_cases_have_four_lists():
    lists = {name: tuple(skipped(scene(load_case(f"cases/{name}.toml")))) for name in CASES}
    assert len(set(lists.values())) == 4
    what = {name: {item.what for item in items} for name, items in lists.items()}
    common = {"the flanks that carry no load", "displacements inside the gears", "tooth pairs out of mesh",
              "the compliance of distant teeth", "flank patches without contact"}  # fmt: skip
    identical = common | {"the wheel's finite elements", "half the face width"}
    trained = {"flank pressure, K_Hβ, sensitivities", "the root stress"}
    assert what["paper_64"] == identical | trained
    assert what["paper_spur"] == identical | {
        "contact points and penalty", "training of the case's own model", "finite elements of models",
    }  # fmt: skip
    assert what["small_spur"] == identical | trained | {"contact points over the width"}
    assert what["unequal_pair"] == common | {
        "contact points and penalty", "the training", "all pictures",
    }  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "why"),
    [({"results": {"root_stress": False}}, "[results] root_stress is off"),
     ({"contact": {"scheme": "direct"}, "reduction": {"shapes": "flank_lines"}}, "exact line loads alone")],
)  # fmt: skip
def test_root_stress_is_left_out_where_it_is_off_or_has_no_line_loads(changes, why):
    case = load_case("cases/paper_spur.toml")
    assert "the root stress" not in listed(case)
    assert "66 elements around a fillet, stress at 210 points of a tooth" in dict(computed(scene(case))).values()
    left = listed(change_case(case, **changes))["the root stress"]
    assert why in left.why
    assert "210 points" in left.saving


def test_the_plan_prints_what_because_and_savings():
    lines = [" ".join(line.split()) for line in plan(load_case("cases/paper_spur.toml")).splitlines()]
    assert "the wheel's finite elements the gears are identical" in lines
    assert "saves 4132 unknowns, 207 right-hand sides" in lines
    assert "half the face width spur teeth, nodes at mid width: symmetric" in lines
    assert "saves 4 of 9 columns of nodes, 3722 unknowns, as many sections" in lines
    assert not any(line.startswith("!") for line in lines)


def test_maps_are_left_out_where_they_are_not_asked_for():
    lines = {"contact": {"scheme": "line"}, "reduction": {"shapes": "line_loads"}}
    maps, pressure = "flank maps and contact pattern", "flank pressure, K_Hβ, sensitivities"
    assert not {maps, pressure} & set(listed(case_with(**lines)))
    assert maps in listed(case_with(**lines, results={"maps": False}))
    assert pressure in listed(case_with())


HEAVY = {"load": {"torque_Nm": 1e3}} | {name: {"torques_Nm": [1e3]} for name in ("offline", "online", "compare")}
TILT = {"in_plane_um": [-10.0, 0.0, 10.0], "out_of_plane_um": [0.0, 5.0]}


@pytest.mark.parametrize(
    ("changes", "usual", "words"),
    [
        (HEAVY, {}, "! Hertz pressure"),
        ({"online": {"torques_Nm": [100.0, 200.0], "extrapolate": True}}, {"online": {"extrapolate": True}},
         "! the sweep extrapolates: torque to 200 N m, trained to 160 N m; read its error bar"),
        ({"offline": {"sampling": "sobol", **TILT}}, {"offline": TILT},
         "ranges of the training torque 40 to 160 N m, in plane -10 to 10 um, out of plane 0 to 5 um"),
    ],
    ids=["beyond linear elasticity", "extrapolated", "spread over ranges"],
)  # fmt: skip
def test_the_plan_warns_of_loads_and_says_where_a_training_ends(changes, usual, words):
    said, otherwise = (" ".join(plan(case_with(**c)).split()) for c in (changes, usual))
    assert words in said
    assert " ".join(words.split()[:3]) not in otherwise


@pytest.mark.parametrize(
    ("changes", "models"), [({}, 1), ({"wheel": {"teeth": 21, "bore_radius_mm": 20.0, "poisson_ratio": 0.2}}, 2),
                            (UNEQUAL, 2), ({"mesh": {"share_identical": False}}, 2)],
    ids=["identical", "other material", "other teeth", "identical, solved twice"],
)  # fmt: skip
def test_as_many_models_are_solved_as_are_announced(changes, models, monkeypatch):
    some, sectors = case_with(**changes), []

    def counted(mesh, *rest):
        sectors.append(mesh)
        return condense_sector(mesh, *rest)

    monkeypatch.setattr("pmor.body.elastic_gear.condense_sector", counted)
    elastic = full_fe(some)
    assert len(sectors) == models
    found = scene(some)
    assert dict(computed(found))["finite-element models"].startswith(f"{models},")
    assert ("the wheel's finite elements" in listed(some)) == (models == 1)
    # All nodes of a sector that are not on the bore move.
    announced = [unknowns(sector) for sector in found.bodies]
    assert announced == [3 * len(np.setdiff1d(np.arange(len(s.nodes)), s.bore)) for s in sectors]
    assert "half the face width" not in listed(some)  # there, nodes at mid width do not move along the axis
    for gear, sector in zip((elastic.pinion, elastic.wheel), found.sectors, strict=True):
        kept, size = gear.compliance.shape[:2]
        assert size == found.flank_unknowns
        assert kept == 2 * found.pair.neighbouring_teeth + 1 < sector.teeth


def test_matrices_and_bytes_of_distant_teeth_are_those_not_held():
    some = case_with()
    saving = listed(some)["the compliance of distant teeth"].saving
    elastic = full_fe(some)
    kept, size = elastic.pinion.compliance.shape[:2]
    assert saving == f"{21 - kept} matrices, {(21 - kept) * size**2 * 8 / 2**20:.3g} MiB"


def test_pairs_and_patches_out_of_reach_are_not_in_any_window():
    some = case_with(mesh={"profile_elements": 20}, pinion={"teeth": 30})
    meshed = mesh_model(some).meshed
    found = scene(some)
    most = meshed.tooth_pair_count
    assert listed(some)["tooth pairs out of mesh"].saving == f"{30 - most} of 30 pairs in every position"
    rows = []
    for phi in meshed.pair.pitch * np.arange(12) / 12:
        position = active_patches(meshed, float(phi), window_depth(meshed, Condition(torque=1e5)))
        assert len(position.pair_index) <= most
        rows += position.windows[:, :, 3].ravel().tolist()
    assert abs(rows_in_contact(found.case, found.pair) - np.mean(rows)) <= 1.5
    assert max(rows) < 20


WIDTHS = {
    "half": (2, "half the face width", 2),
    "whole": (2, None, 3),
    "plane_strain": (2, "all but one layer over the width", 2),
    "half, odd": (3, None, 4),
}


@pytest.mark.parametrize("width", WIDTHS)
def test_what_is_meshed_of_the_width_is_what_the_plan_says(width, tmp_path):
    across, what, held = WIDTHS[width]
    mesh = {"profile_elements": 5, "width_elements": across}
    some = case_with(mesh=mesh | {"width": width.partition(",")[0]}, offline={"angles_per_pitch": 4})
    whole = case_with(mesh=mesh | {"width": "whole"})
    run_offline(some, full_fe(some), tmp_path / "b.h5")
    basis = read_basis(tmp_path / "b.h5")
    assert basis.flank_nodes[0].shape[1] == held
    names = {"half the face width", "all but one layer over the width"} & set(listed(some))
    assert names == ({what} if what else set())
    found, sector = scene(some), mesh_model(some).pinion
    assert unknowns(found.sectors[0]) == len(
        np.setdiff1d(np.arange(3 * len(sector.nodes)), np.union1d(degrees_of_freedom(sector.bore), sector.held_axially))
    )
    if what is not None:
        saved = unknowns(scene(whole).sectors[0]) - unknowns(found.sectors[0])
        expected = f"1 of 3 columns of nodes, {saved} unknowns, 11 contact points per flank"
        assert listed(some)[what].saving == expected
    # Flank nodes are all that the shapes hold: nothing of the volume.
    assert basis.shapes.gears[0].displacement.shape[2] == 3 * 6 * held


TRAININGS = {
    "grid": ({}, {}, "4 angles x 2 torques: 40, 160 N m)"),
    "grid, tilted": (TILT, {}, "4 angles x 2 torques: 40, 160 N m x 6 misalignments)"),
    "sobol": ({"sampling": "sobol", "solves": 7, **TILT}, {}, "states of a Sobol sequence, spread over"),
    "greedy": ({"sampling": "greedy", "solves": 6, "tolerance_percent": 1e-9}, {}, "at most: 4 angles, then where"),
    "static modes": (TILT, {"shapes": "static_modes"}, "static modes are unit forces: nothing is trained"),
}


@pytest.mark.jit  # a greedy sampling looks at hundreds of states
@pytest.mark.parametrize("training", TRAININGS)
def test_as_many_states_are_solved_as_are_announced(training, tmp_path, few_candidates):
    offline, reduction, text = TRAININGS[training]
    some = case_with(offline=offline, reduction=reduction)
    run_offline(some, full_fe(some), tmp_path / "b.h5")
    solved = read_basis(tmp_path / "b.h5").training.converged.size
    assert full_solves(some) == solved
    line = next(line for line in plan(some).splitlines() if "offline, full contact solves" in line)
    assert line.split()[4] == str(solved)
    assert text in line


@pytest.mark.parametrize("changes", [{}, UNEQUAL], ids=["alike", "unequal"])
def test_the_compliance_for_the_error_bar_is_as_large_as_announced(changes, tmp_path):
    some = case_with(**changes)
    run_offline(some, full_fe(some), tmp_path / "b.h5")
    with h5py.File(tmp_path / "b.h5") as file:
        stored = [item[()] for item in file["error_estimate"].values()]
    announced = dict(computed(scene(some)))["compliance for the error bar"]
    size = stored[0].shape[1]
    matrices, held = sum(map(len, stored)), sum(array.nbytes for array in stored)
    assert announced == f"{matrices} matrices of {size} x {size} in the basis, {held / 2**20:.3g} MiB"
    changes = {**changes, "reduction": {"error_estimate": False}}
    without = case_with(**changes)
    assert "compliance for the error bar" not in dict(computed(scene(without)))
