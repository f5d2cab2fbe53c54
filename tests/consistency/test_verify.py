"""The laws of a basis: good ones of every family obey them, and each fault breaks the law that it is against."""

from dataclasses import replace
from functools import cache

import h5py
import pytest

import pmor.work.verify
import pmor_online.model
from pmor.app.cli import main
from pmor.gear.condition import Condition
from pmor.penalty.elasticity import ReducedElasticity
from pmor.reduction.flank_lines import FlankLineShapes
from pmor.storage.basis_file import read_basis, write_basis
from pmor.storage.snapshot_file import write_snapshots
from pmor.work.offline import run_offline
from pmor.work.verify import Check, checks_text, verify_basis
from pmor_offline.sampling import TrainingPosition
from pmor_offline.snapshots import solve_snapshots
from pmor_online.errors import estimate_errors
from tests.support.small_case import case_with, full_fe

pytestmark = pytest.mark.jit
FAMILIES = [
    {},
    {"shapes": "positions", "interpolation": "cubic"},
    {"shapes": "pod"},
    {"shapes": "global_pod"},
    {"shapes": "static_modes"},
]
# A change far above round-off, and far below anything that the other laws could see.
SLIGHTLY = 1.0 + 1e-7


def case_of(offline, **reduction):
    # A penalty so soft that many points share each contact: error bars jump where one of a few begins to carry.
    mesh, points = {"profile_elements": 6, "width_elements": 2}, {"lodm_profile": 4, "penalty_N_mm3": 1e3}
    return case_with(mesh=mesh, contact=points, offline=offline, reduction=reduction)


@pytest.fixture(scope="module")
def model():
    case = case_of({"angles_per_pitch": 8})
    return full_fe(case)


@pytest.fixture(scope="module")
def basis_file(model, tmp_path_factory):
    """Function from the keys of [reduction] to a basis file."""

    @cache
    def basis_path(**reduction):
        path = tmp_path_factory.mktemp("basis") / "small.h5"
        run_offline(case_of({"angles_per_pitch": 8}, **reduction), model, path)
        return path

    return basis_path


@pytest.fixture
def basis(basis_file):
    return read_basis(basis_file())


def broken(basis, model):
    return {check.name for check in verify_basis(basis, model) if not check.ok}


def with_pinion(basis, **changes):
    """The basis with other arrays in the shapes of the pinion's lines."""
    pinion, wheel = basis.shapes.gears
    return replace(basis, shapes=FlankLineShapes((replace(pinion, **changes), wheel)))


@pytest.mark.parametrize(
    "reduction",
    [FAMILIES[0], *(pytest.param(family, marks=pytest.mark.slow) for family in FAMILIES[1:])],
    ids=lambda r: " ".join(r.values()) or "flank_lines",
)
def test_a_good_basis_of_each_family_passes(reduction, basis_file, model):
    checks = verify_basis(read_basis(basis_file(**reduction)), model)
    assert all(check.ok for check in checks), checks_text(checks)
    names = ["displacements", "energy products", "orthonormality", "compliance", "training states", "unseen states"]
    untrained = reduction.get("shapes") == "static_modes"
    assert [c.name for c in checks] == [n for n in names if not (untrained and n == "training states")]


def test_without_an_error_estimate_what_needs_it_is_left_out(basis, model):
    checks = {check.name: check for check in verify_basis(replace(basis, compliance=None), model)}
    assert set(checks) == {"displacements", "energy products", "orthonormality", "training states"}
    assert "0.05 % of the STE" in checks["training states"].meaning


# --- faults ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "law"), [("displacement", "displacements"), ("gram", "energy products")])
def test_displacements_and_products_that_are_not_those_of_the_forces(name, law, basis, model):
    slightly = {name: getattr(basis.shapes.gears[0], name) * SLIGHTLY}
    assert broken(with_pinion(basis, **slightly), model) == {law}


@pytest.mark.parametrize(
    ("reduction", "name"),
    [(FAMILIES[1], "displacement"), (FAMILIES[2], "gram"),
     pytest.param(FAMILIES[1], "gram", marks=pytest.mark.slow),
     pytest.param(FAMILIES[2], "displacement", marks=pytest.mark.slow)],
)
def test_shapes_at_positions_whose_displacements_and_products_do_not_belong_together(
    reduction, name, basis_file, model
):
    """Without forces to tell which of the two is wrong: the forces behind the displacements are taken for true."""
    good = read_basis(basis_file(**reduction))
    shapes = replace(good.shapes, **{name: getattr(good.shapes, name) * SLIGHTLY})
    assert broken(replace(good, shapes=shapes), model) == {"energy products"}


@pytest.mark.slow
@pytest.mark.parametrize("shapes", ["flank_lines", "pod"])
def test_members_that_store_another_energy(shapes, basis_file, model, monkeypatch):
    """A factorisation gone wrong."""
    genuine = pmor_online.model.shape_elasticity

    def skewed(*arguments):
        active_shapes = genuine(*arguments).basis.copy()
        active_shapes[:, :, 1] += 1e-5 * active_shapes[:, :, 0]
        return ReducedElasticity(active_shapes)

    monkeypatch.setattr(pmor_online.model, "shape_elasticity", skewed)
    assert broken(read_basis(basis_file(shapes=shapes)), model) == {"orthonormality"}


def test_a_compliance_that_is_not_full_fe(basis, model):
    pinion, wheel = basis.compliance.gears
    changed = replace(basis.compliance, gears=(pinion * SLIGHTLY, wheel))
    assert broken(replace(basis, compliance=changed), model) == {"compliance"}


def test_training_states_that_are_not_those_of_the_basis(basis, model):
    training = replace(basis.training, ste_um=basis.training.ste_um * 1.01)
    assert broken(replace(basis, training=training), model) == {"training states"}
    assert broken(replace(basis, training=training, compliance=None), model) == {"training states"}


@pytest.mark.parametrize("factor", [100.0, 0.01])
def test_an_error_bar_that_is_far_from_the_error(factor, basis, model, monkeypatch):
    """A basis has errors of 0.1 %, and bars a hundred times as long, or as short."""

    def wrong(*arguments):
        ste, _ = estimate_errors(*arguments)
        return 1.001 * ste, factor * 0.001 * ste

    monkeypatch.setattr(pmor.work.verify, "estimate_errors", wrong)
    assert "unseen states" in broken(basis, model)


# --- the command -----------------------------------------------------------------------------------------------------


def test_the_command_prints_the_laws(basis_file, capsys):
    assert main(["info", str(basis_file()), "--verify"]) == 0
    lines = capsys.readouterr().out.splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("Laws of a basis"))
    assert "training/ste" in "\n".join(lines[:start]), "the usual text comes first"
    assert [line.split()[0] for line in lines[start + 1 :]] == ["ok"] * 6


def test_without_the_flag_nothing_is_solved(basis_file, capsys, monkeypatch):
    monkeypatch.setattr(pmor.work.verify, "verify_basis", lambda *_: pytest.fail("verified"))
    assert main(["info", str(basis_file())]) == 0
    assert "Laws" not in capsys.readouterr().out


def test_a_basis_that_breaks_a_law_ends_with_2(basis_file, tmp_path, capsys):
    """Whole and sealed, so that checksums say nothing, but not what full FE gives."""
    with h5py.File(basis_file()) as file:
        force = file["training/force"][()]
    good = read_basis(basis_file())
    bad = replace(good, training=replace(good.training, ste_um=good.training.ste_um * 1.01))
    write_basis(tmp_path / "bad.h5", bad, force)
    assert main(["info", str(tmp_path / "bad.h5"), "--verify"]) == 2
    out, error = capsys.readouterr()
    assert "FAILED  training states" in out
    refusal = f"pmor: error: {tmp_path / 'bad.h5'}: does not obey its own laws: training states ("
    assert error.splitlines()[-1].startswith(refusal)
    assert error.endswith(", at most 1); make it anew with 'pmor offline'\n")


def test_a_value_that_is_no_number_is_not_within_the_limit():
    assert not Check("a", float("nan"), 1.0, "").ok
    assert Check("a", 1.0, 1.0, "").ok


def test_snapshots_have_no_laws_of_a_basis(model, tmp_path, capsys):
    snapshots = solve_snapshots(model, TrainingPosition(0.0, (Condition(torque=1e5),)))
    write_snapshots(tmp_path / "s.h5", snapshots, "key")
    assert main(["info", str(tmp_path / "s.h5"), "--verify"]) == 2
    assert "pmor-basis" in capsys.readouterr().err
