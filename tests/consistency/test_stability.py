"""Stiff and extreme variants: the matrix, its measures, the models that it keeps, and the command on a tiny case."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor.lab.stability.measure
from pmor.app.cli import main
from pmor.case import change_case, changed_text, load_case, parse_case
from pmor.core.errors import PmorError
from pmor.gear.condition import at_torques
from pmor.lab.core.models import ModelStore
from pmor.lab.stability.flank_variants import flank_variants
from pmor.lab.stability.matrix import base_case, matrix
from pmor.lab.stability.measure import measure, pinion_angles
from pmor.lab.stability.result import FILES
from pmor.lab.stability.run import penalty_law
from pmor.lab.stability.solve import newton_condition
from pmor.lab.stability.variants import REFERENCES, Variant
from pmor.penalty.elasticity import FullElasticity, ReducedElasticity
from pmor.penalty.solve import solve_position
from tests.support.small_case import case_with, write_case
from tests.support.stored_energy import stored_in_points
from tests.support.stored_files import results_in

TORQUE = 1e5


# DESIGN.md, section 5: scripts rely on these.
KEYS = {"name", "converged", "newton_steps", "condition", "difference_rel", "ok", "note"}
MORE = {"torque_balance_rel", "seconds"}


@pytest.fixture(scope="module")
def base():
    return base_case(case_with(mesh={"profile_elements": 5, "width_elements": 2}))


@pytest.fixture(scope="module")
def store():
    return ModelStore()


@pytest.fixture(scope="module")
def model(base, store):
    return store.model(base)[0]


def solved(model, share, torques=(TORQUE, 1.01 * TORQUE)):
    pair = model.mesh.meshed.pair
    phi = pair.roll_position_range[0] + share * pair.pitch
    position = solve_position(model.mesh.meshed, phi, at_torques(torques), model.elasticity_at)
    return position, model.elasticity_at(position.position)


@pytest.mark.parametrize("path", ["cases/paper_spur.toml", "cases/unequal_pair.toml"])
def test_the_matrix_is_large_and_every_change_is_one_that_a_case_file_may_say(path):
    case = base_case(load_case(path))
    variants = matrix(case)
    assert len(variants) >= 60
    assert len({v.name for v in variants}) == len(variants)
    refused = set()
    for variant in variants:
        assert variant.against in REFERENCES
        try:
            parse_case(changed_text(case.text, variant.changes), "v", "v")
        except PmorError as error:
            refused.add(variant.name)
            message = str(error)
            assert "unknown" not in message  # noqa: PT017 - most variants raise nothing
    # What is expected to be refused is; the loader refuses nothing else of the matrix.
    assert refused == {v.name for v in variants if v.against == "nothing"}


def test_energy_balances_with_facets(base, store):
    model = store.model(change_case(base, scheme="facet"))[0]
    position, elasticity = solved(model, 0.3)
    states = position.equilibria
    stored = np.diff([stored_in_points(elasticity, state) for state in states])
    turned = states[1].advance - states[0].advance
    assert_allclose(stored, 1.005 * TORQUE * turned, rtol=1e-5)  # trapezoidal rule


def test_condition_is_that_of_the_matrix_of_a_step(base, store):
    # A penalty so soft that its own compliance counts.
    position, full = solved(store.model(change_case(base, penalty_N_mm3=1e4))[0], 0.3)
    state = position.equilibria[0]
    contact = state.contact
    rows = np.stack([contact.nodal_forces(p, len(position.position.nodes)).ravel() for p in np.eye(len(contact.gap))])
    assert isinstance(full, FullElasticity)
    matrix_full = rows @ full.compliance @ rows.T + np.diag(1.0 / contact.stiffness)
    exact = np.linalg.cond(matrix_full, 1)
    assert 0.97 * exact < newton_condition(full, state) <= 1.01 * exact
    free = np.flatnonzero(full.compliance.diagonal())  # nodes in the plane of symmetry stay in it
    basis = np.zeros((len(full.compliance), len(free)))
    basis[free] = np.linalg.cholesky(full.compliance[np.ix_(free, free)])
    reduced = ReducedElasticity(basis.reshape(-1, 3, len(free)))
    columns = np.stack([reduced.coordinates_of(contact, p) for p in np.eye(len(contact.gap))])
    exact = np.linalg.cond(np.eye(columns.shape[1]) + (columns.T * contact.stiffness) @ columns, 1)
    assert 0.3 * exact < newton_condition(reduced, state) <= 1.01 * exact


def test_usual_places_hold_exact_entry_and_exit_and_the_borders_are_nodes(model):
    meshed = model.mesh.meshed
    first, last = meshed.pair.roll_position_range
    usual = pinion_angles(meshed, "usual")
    assert len(usual) == 8
    assert usual[0] == first
    assert np.abs((usual - last) / meshed.pair.pitch - np.round((usual - last) / meshed.pair.pitch)).min() < 1e-12
    rolls = meshed.pair.contact_roll_angles(pinion_angles(meshed, "borders"))
    distance = [np.abs(r[:, None] - f.roll_angle).min(axis=1)
                for r, f in zip(rolls, (meshed.pinion, meshed.wheel), strict=True)]  # fmt: skip
    assert np.minimum(*distance).max() < 1e-12


def test_an_entry_says_what_is_wrong(base, store):
    held = Variant("strict", "g", "a", {"contact": {"penalty_N_mm3": 1e4}}, "base", tolerance=1e-3)
    entry = measure(held, base, store)
    assert entry.converged
    assert not entry.ok
    assert not entry.explained
    assert entry.note.startswith("differs by")
    refused = measure(Variant("none", "g", "a", {"load": {"torque_Nm": 0.0}}), base, store)
    assert refused.explained
    assert "there is no contact to solve" in refused.note
    reversed_ = measure(Variant("back", "g", "a", {"load": {"torque_Nm": -1.0}}), base, store)
    assert "which loads the coast flanks" in reversed_.note

    known = Variant("locks", "g", "a", {"mesh": {"element": "hex8"}, "pinion": {"poisson_ratio": 0.499}}, "base",
                    tolerance=1e-3, limit="they lock")  # fmt: skip
    entry = measure(known, base, store)
    assert (entry.ok, entry.explained, entry.converged) == (False, True, True)


def test_the_law_of_the_penalty_is_fitted_where_it_is_stiff(base, store):
    from dataclasses import replace

    from pmor.lab.stability.contact_variants import PENALTY_EXPONENTS, PENALTY_LIMIT, penalty_name

    some = replace(measure(Variant("refused", "g", "a", {"load": {"torque_Nm": 0.0}}), base, store), converged=True)

    def entries(exponent):
        ste = {penalty_name(10.0**e): 5.0 + 10.0 ** (exponent * e + 4) for e in PENALTY_EXPONENTS}
        return {name: replace(some, ste_um=(value,) * 3) for name, value in (ste | {PENALTY_LIMIT: 5.0}).items()}

    assert_allclose(penalty_law(entries(-1.0)).exponent, -1.0, atol=1e-6)
    assert_allclose(penalty_law(entries(-0.5)).exponent, -0.5, atol=1e-6)
    assert penalty_law({"base case": some}) is None


# Of each group one, and both that the mesh refuses: cheap enough for every run; all of them are slow.
PICKED = (
    "helix angle 60 deg", "helix angle 20 deg, face of 0.1 modules", "faces that share 0.1 of their width, helical",
    "a kink on a row of nodes", "crowning of 0.5 mm both ways, helical", "topography: a step over the profile",
    "one tooth stands out by 0.1 mm", "relief and crowning, helical, direct",
)  # fmt: skip
DEAR = (
    "helix angle 60 deg", "crowning of 0.5 mm both ways, helical", "faces that share 0.1 of their width, helical",
    "relief and crowning, helical, direct",
)  # fmt: skip


def test_helices_and_flanks_have_forty_entries_and_more(base):
    variants = flank_variants(base)
    assert sum(variant.against != "nothing" for variant in variants) >= 40
    assert {variant.name for variant in variants} >= set(PICKED)


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if name in DEAR else name for name in PICKED]
)
def test_extreme_helices_and_flanks_hold_or_are_refused_in_words(name, base, store):
    entry = measure(next(v for v in flank_variants(base) if v.name == name), base, store)
    assert entry.ok or entry.explained, entry.note
    if entry.explained:
        assert "would bend the pinion's blank, 0.4 mm thick" in entry.note
    else:
        assert entry.torque_balance_rel is not None


# --- the command -----------------------------------------------------------------------------------------------------


@pytest.fixture
def case_path(tmp_path):
    return write_case(tmp_path)


def run(case_path, *more):
    out = case_path.parent / "out"
    code = main(["lab", "stability", str(case_path), "--out", str(out), *more])
    return code, out


@pytest.mark.jit
def test_everything_is_there_and_holds(case_path, capsys):
    code, out = run(case_path, "--only", "torque", "--jobs", "2")
    text = capsys.readouterr().out
    assert code == 0, text
    assert results_in(out) == {"stability.json", "stability.md", "report.html"} < set(FILES)
    found = json.loads((out / "stability.json").read_text())
    entries = {entry["name"]: entry for entry in found["entries"]}
    assert len(entries) == found["n_entries"] == 14
    assert found["n_failed"] == 0
    for name, entry in entries.items():
        assert set(entry) >= KEYS | MORE
        assert entry["ok"] != entry["explained"]
        if name in ("torque zero", "torque 100000 N m"):
            assert entry["explained"]
            assert entry["converged"] is entry["condition"] is entry["newton_steps"] is None
            assert entry["note"].startswith("refused: ")
        else:
            assert entry["converged"] is True
            assert entry["newton_steps"] <= 12
            assert entry["condition"] >= 1.0
            assert entry["difference_rel"] < 1e-6
    page = (out / "report.html").read_text()
    assert "torque 1000 N m: Hertz pressure" in page
    assert "14 variants: 12 ok, 2 explained limits, 0 failed" in text


@pytest.mark.slow
@pytest.mark.jit
def test_a_variant_that_crashes_is_named_and_stops_nothing(case_path, capsys, monkeypatch):
    genuine = pmor.lab.stability.measure.solve_variant

    def sometimes(meshed, elasticity_at, phi, condition, *rest):
        if condition.torque == 1e3:
            raise RuntimeError("made to crash")
        return genuine(meshed, elasticity_at, phi, condition, *rest)

    monkeypatch.setattr(pmor.lab.stability.measure, "solve_variant", sometimes)
    code, out = run(case_path, "--only", "torque 1")
    assert code == 3
    captured = capsys.readouterr()
    assert "! torque 1 N m: RuntimeError: made to crash" in captured.out
    error = "pmor: error: 1 variants failed, first: torque 1 N m: RuntimeError: made to crash"
    assert captured.err.splitlines()[-1] == error
    entries = json.loads((out / "stability.json").read_text())["entries"]
    failed = {e["name"]: (e["explained"], e["converged"]) for e in entries if not e["ok"]}
    assert failed == {"torque 1 N m": (False, False), "torque 100000 N m": (True, None)}
    assert '<p class="warning">' in (out / "report.html").read_text()


@pytest.mark.jit
def test_a_text_that_no_variant_has_is_refused(case_path, capsys):
    code, out = run(case_path, "--only", "no such thing")
    assert code == 2
    assert "no variant has this in its name or group" in capsys.readouterr().err
    assert not out.exists()


@pytest.mark.jit
@pytest.mark.slow
def test_reduced_bases_of_all_trainings_hold(case_path, capsys):
    code, out = run(case_path, "--only", "reduced basis")
    assert code == 0, capsys.readouterr().out
    entries = json.loads((out / "stability.json").read_text())["entries"]
    assert [e["name"] for e in entries if e["explained"]] == ["load beyond the training"]
    assert all(e["difference_rel"] < 0.05 for e in entries if e["ok"])
