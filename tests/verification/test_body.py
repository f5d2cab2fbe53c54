"""Holes and hubs, equation (A): rows of low rank against the compliance of all nodes together."""

import pickle
from dataclasses import replace
from functools import cache

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor.lab.core.models
from pmor.core.errors import CaseError, FileFormatError
from pmor.export import vtkhdf
from pmor.gear.condition import Misalignment, at_torques
from pmor.lab.core.models import ModelStore
from pmor.lab.stability.solve import ste_only
from pmor.line.hubs import Hubs
from pmor.line.pair import LinePair
from pmor.pair.conditions import nominal_condition
from pmor.pair.model import mesh_model, model_of_solved
from pmor.storage.basis_file import read_basis, write_basis
from pmor.work.live import live_pair
from pmor_online.compare import compare_models
from pmor_online.contact_pattern import contact_patterns
from pmor_online.line_sweep import sweep_line_loads
from tests.support.broken_hdf5 import reseal
from tests.support.line_pairs import TORQUE, models

SAME = 1e-12
# Solutions by two ways of Newton's method, to its tolerance.
SOLVED = 1e-9
# Moments of forces that nodes carry in place of the flank between them.
CARRIED = 1e-4
ANGLES = 2


def made_up_hubs(rng):
    """Hubs that give way under the loads by about as much as the gears do, and stand a little askew."""
    size = np.tile([1.0, 1.0, 1.0, 0.02, 0.02, 0.02], 2)
    factor = size[:, None] * rng.standard_normal((12, 12))
    return Hubs(2e-7 * factor @ factor.T, 2e-4 * size * rng.standard_normal(12))


@cache
def holed(name):
    """Full FE and the reduced pair, with holes in a web; on hubs that give way too where teeth are helical."""
    name = {"spur": "holes", "helical": "helical holes"}[name]
    full, reduced = models(name)
    hubs = made_up_hubs(np.random.default_rng(26)) if "helical" in name else None
    mesh = replace(full.mesh, meshed=replace(full.mesh.meshed, hubs=hubs))
    return replace(full, mesh=mesh), replace(reduced, meshed=replace(reduced.meshed, hubs=hubs))


def without_holes(reduced):
    """The reduced pair on the webs alone."""
    compliance = replace(reduced.flank_compliance, supports=(None, None))
    return replace(reduced, basis=replace(reduced.basis, compliance=compliance))


def without_holes_in_full(full):
    """Full FE on the webs alone."""
    return replace(full, pinion=replace(full.pinion, support=None), wheel=replace(full.wheel, support=None))


def weights(reduced, lines, angle, n, gear):
    """Forces on all nodes of a flank that make a unit force in a section."""
    nodes, sections = (reduced.meshed.pinion, reduced.meshed.wheel)[gear].nodes, reduced.layered.sections
    found, place = np.zeros((*nodes.shape[:2], reduced.components)), n % len(sections.z)
    for a, gradient in enumerate(lines.gradient[angle, n, gear].reshape(4, -1)):
        for b, share in enumerate(sections.share[gear, place]):
            if share != 0.0 and gradient.any():
                found[lines.row[angle, n, gear] + a, sections.column[gear, place] + b] += share * gradient
    return found.ravel()


def flexibility_of_all_nodes(reduced, supports, lines, angle):
    """W (C_cyclic + B S B^T) W^T with a row of C for each node of each tooth in mesh, of both gears together."""
    sections, size = len(reduced.layered.sections.z), lines.gap.shape[1]
    pairs = lines.first_pair[angle] + np.arange(size // sections)
    total = np.zeros((size, size))
    for gear, sense in ((0, 1), (1, -1)):
        teeth, count = sense * pairs, reduced.flank_compliance.gears[gear].shape[1]
        whole = np.block([[reduced.flank_compliance.between(gear, i - k) for k in teeth] for i in teeth])
        if (support := supports[gear]) is not None:
            rows = support.rows
            whole += np.block([[rows @ support.between(i, k) @ rows.T for k in teeth] for i in teeth])
        loads = np.zeros((size, len(pairs), count))
        for n in range(size):
            loads[n, n // sections] = weights(reduced, lines, angle, n, gear)
        loads = loads.reshape(size, -1)
        total += loads @ whole @ loads.T
    return total


@pytest.mark.parametrize("name", [pytest.param("spur", marks=pytest.mark.slow), "helical"])
def test_a_part_of_low_rank_is_the_compliance_of_all_rows_together(name, monkeypatch):
    rng, reduced = np.random.default_rng(25), models({"spur": "holes", "helical": "helical holes"}[name])[1]
    rigid, supports = without_holes(reduced), reduced.flank_compliance.supports
    phi, conditions = 5.0 * rigid.meshed.pair.pitch * rng.random(ANGLES), at_torques([0.3 * TORQUE, TORQUE])
    conditions = [replace(condition, misalignment=Misalignment(8.0, -5.0)) for condition in conditions]
    placed, place = [], LinePair.place

    def keeping(self, phi, misalignment):
        placed.append(place(self, phi, misalignment))
        return placed[-1]

    def of_all_nodes(self, phi, misalignment):
        sections = place(rigid.lines, phi, misalignment)
        for angle in range(len(phi)):
            sections.flexibility.between[angle] = flexibility_of_all_nodes(rigid, supports, sections.lines, angle)
        sections.flexibility.ready[:] = True
        return sections

    monkeypatch.setattr(LinePair, "place", keeping)
    found = sweep_line_loads(reduced, phi, conditions, recorded=True)
    monkeypatch.setattr(LinePair, "place", of_all_nodes)
    expected = sweep_line_loads(reduced, phi, conditions, recorded=True)
    assert found.converged.all()
    (sections,) = placed
    lines, flexibility = sections.lines, sections.flexibility
    for angle in range(ANGLES):
        ready = np.ix_(flexibility.ready[angle], flexibility.ready[angle])
        whole = flexibility_of_all_nodes(rigid, supports, lines, angle)[ready]
        assert_allclose(flexibility.between[angle][ready], whole, rtol=0.0, atol=SAME * whole.max())
    assert_allclose(found.ste_um, expected.ste_um, rtol=SAME)
    loads, expected_loads = (s.states.lines.load_N_per_mm for s in (found, expected))
    assert_allclose(loads, expected_loads, rtol=0.0, atol=SAME * expected_loads.max())
    monkeypatch.setattr(LinePair, "place", place)
    stiff = sweep_line_loads(rigid, phi, conditions, recorded=True)
    assert (found.ste_um > 1.02 * stiff.ste_um).all(), "it gives"
    assert np.abs(stiff.states.lines.load_N_per_mm - loads).max() > 0.005 * loads.max()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["spur", "helical"])
def test_full_and_reduced_pair_agree_with_holes(name):
    full, reduced = holed(name)
    found = compare_models(reduced, full)
    assert found.reduced.converged.all()
    assert found.max_relative_error < SAME
    rigid = models("holes" if name == "spur" else "helical holes")[0]
    without_hubs = [replace(full, mesh=rigid.mesh)] if name == "helical" else []
    for part in (without_holes_in_full(full), *without_hubs):
        without = compare_models(reduced, part)
        assert (without.full.ste_um < 0.98 * found.full.ste_um).all(), "each of the two gives"


def test_contact_pattern_and_forces_on_the_flanks_share_the_load_as_the_sweep():
    _, reduced = holed("helical")
    phi, condition = 0.3 * reduced.meshed.pair.pitch, nominal_condition(reduced.basis.case)
    sweep = sweep_line_loads(reduced, np.array([phi]), [condition])
    expected = sweep.pair_share[0, 0][sweep.pair_share[0, 0] > 0.0]
    rigid = sweep_line_loads(without_holes(models("helical holes")[1]), np.array([phi]), [condition]).pair_share[0, 0]
    assert np.abs(rigid[rigid > 0.0] - expected).max() > 1e-3
    assert_allclose([pattern.share for pattern in contact_patterns(reduced, phi, condition)], expected, rtol=SOLVED)
    forces, _ = vtkhdf.flank_forces(reduced, np.array([phi]))
    nodes = reduced.meshed.pinion.nodes.reshape(-1, 3)
    on_pinion = forces[0, ..., 0].reshape(len(forces[0]), -1, 3)
    torques = on_pinion[..., 1] @ nodes[:, 0] - on_pinion[..., 0] @ nodes[:, 1]
    assert_allclose(torques / torques.sum(), expected, rtol=CARRIED)


def test_the_solver_of_single_variants_knows_the_holes():
    _, reduced = models("helical holes")
    phi, condition = np.array([0.1, 0.4]), nominal_condition(reduced.basis.case)
    sweep = sweep_line_loads(reduced, phi, [condition])
    single = ste_only(reduced.meshed, reduced.elasticity_at, phi, condition)
    assert_allclose(single, sweep.ste_um[0], rtol=SOLVED)


def test_a_pair_with_holes_goes_to_other_processes():
    _, reduced = models("helical holes")
    phi, conditions = np.array([0.02]), at_torques([TORQUE])
    again = pickle.loads(pickle.dumps(reduced.lines))
    found, expected = (
        pair.place(phi, Misalignment()).solve(np.array([TORQUE])).advance for pair in (again, reduced.lines)
    )
    assert_allclose(found, expected, rtol=0.0)
    assert_allclose(1e3 * reduced.lines.base_radius * expected, sweep_line_loads(reduced, phi, conditions).ste_um)


# --- stored, or refused ---------------------------------------------------------------------------------------------


@pytest.fixture
def stored(tmp_path):
    basis, path = models("helical holes")[1].basis, tmp_path / "basis.h5"
    write_basis(path, basis, np.empty((0, 0, 2, basis.flank_nodes[0].size)))
    return path


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        (
            "compliance",
            lambda s: s + np.triu(np.ones_like(s), 1),
            "holes of the wheel make its compliance unsymmetric",
        ),
        ("compliance", lambda s: -s, "holes of the wheel move against its load"),
        ("compliance", lambda s: s[:-1], "holes of the wheel do not repeat after 31 teeth"),
        ("compliance", lambda s: s[..., :-1], "has the shape"),
        ("compliance", lambda s: np.roll(s, 1, axis=0), "does not answer as it did"),
        ("rows", lambda s: s[::-1], "does not answer as it did"),
        ("compliance", lambda s: 1.01 * s, "does not answer as it did"),
        ("rows", None, "of the holes of the wheel it has compliance alone"),
    ],
)
def test_holes_that_cannot_be_are_refused(stored, name, value, message):
    with h5py.File(stored, "r+") as file:
        old = file[f"support/wheel/{name}"]
        data, words = old[()], dict(old.attrs)
        del file[f"support/wheel/{name}"]
        if value is not None:
            file[f"support/wheel/{name}"] = value(data)
            for key, word in words.items():
                file[f"support/wheel/{name}"].attrs[key] = word
        reseal(file)
    with pytest.raises(FileFormatError, match=message):
        read_basis(stored)


def test_holes_of_another_case_are_refused(stored):
    with h5py.File(stored, "r+") as file:
        del file["support/wheel"]
        reseal(file)
    with pytest.raises(FileFormatError, match="holes of the wheel are not those of the case"):
        read_basis(stored)


def test_penalty_contact_refuses_holes(small_model):
    support, model = models("helical holes")[0].wheel.support, small_model[1]
    with pytest.raises(ValueError, match='penalty contact takes no holes .*"line"'):
        replace(model, wheel=replace(model.wheel, support=support))


def test_models_made_of_others_keep_the_holes(monkeypatch):
    full, reduced = models("helical holes")
    case, phi = reduced.basis.case, np.array([0.01, 0.08, 0.2])
    full = model_of_solved(case, mesh_model(case), full)
    expected = ste_only(full.mesh.meshed, full, phi, nominal_condition(case))
    monkeypatch.setattr(pmor.lab.core.models, "elastic_model", lambda *_: full)
    again, _ = ModelStore().model(case)
    assert_allclose(ste_only(again.mesh.meshed, again, phi, nominal_condition(case)), expected, rtol=0.0)
    stiff = ste_only(full.mesh.meshed, without_holes_in_full(full), phi, nominal_condition(case))
    assert (expected > 1.02 * stiff).all()


def test_page_and_pictures_in_space_refuse_what_they_would_leave_out(tmp_path):
    (_, solid), (_, reduced) = models("helical"), holed("helical")
    assert "rigid hubs alone" in live_pair(replace(solid, meshed=replace(solid.meshed, hubs=reduced.meshed.hubs)))
    with pytest.raises(CaseError, match="leave the holes out"):
        vtkhdf.export(reduced, tmp_path / "pair.vtkhdf")
    assert not any(tmp_path.iterdir())
