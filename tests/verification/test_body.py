"""A body on what it stands on, equation (A): rows of low rank against the compliance of all nodes together."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.body.support import Support
from pmor.gear.condition import Misalignment, at_torques
from pmor.line.pair import LinePair
from pmor_online.line_sweep import sweep_line_loads
from tests.support.line_pairs import TORQUE, models

SAME = 1e-12
ANGLES, RANK = 3, 7


def made_up_support(reduced, rng):
    """Rows and a compliance that mean nothing, which moves the flanks about as much as the gears' own."""
    compliance = reduced.flank_compliance
    rows = tuple(rng.standard_normal((blocks.shape[1], RANK)) for blocks in compliance.gears)
    turn = tuple(np.linalg.qr(rng.standard_normal((RANK, RANK)))[0] for _ in compliance.gears)
    factor = rng.standard_normal((RANK, RANK))
    return Support(rows, turn, compliance.gears[0][0].diagonal().max() / RANK**2 * factor @ factor.T)


def weights(reduced, lines, angle, n, gear):
    """Forces on all nodes of a flank that make a unit force in a section."""
    nodes, sections = (reduced.meshed.pinion, reduced.meshed.wheel)[gear].nodes, reduced.layered.sections
    found, place = np.zeros((*nodes.shape[:2], reduced.components)), n % len(sections.z)
    for a, gradient in enumerate(lines.gradient[angle, n, gear].reshape(4, -1)):
        for b, share in enumerate(sections.share[gear, place]):
            if share != 0.0 and gradient.any():
                found[lines.row[angle, n, gear] + a, sections.column[gear, place] + b] += share * gradient
    return found.ravel()


def flexibility_of_all_nodes(reduced, support, lines, angle):
    """W (C_local + R S R^T) W^T with a row of C for each node of each tooth in mesh, of both gears together."""
    sections, size = len(reduced.layered.sections.z), lines.gap.shape[1]
    pairs = lines.first_pair[angle] + np.arange(size // sections)
    local, by_section, coordinates = [], [], []
    for gear, sense in ((0, 1), (1, -1)):
        teeth, count = sense * pairs, reduced.flank_compliance.gears[gear].shape[1]
        local.append(np.block([[reduced.flank_compliance.between(gear, i - k) for k in teeth] for i in teeth]))
        loads = np.zeros((size, len(pairs), count))
        for n in range(size):
            loads[n, n // sections] = weights(reduced, lines, angle, n, gear)
        by_section.append(loads.reshape(size, -1))
        turns = [np.linalg.matrix_power(support.turn[gear], tooth) for tooth in teeth]
        coordinates.append(np.concatenate([support.rows[gear] @ turn for turn in turns]))
    first = len(local[0])
    whole = np.zeros((first + len(local[1]),) * 2)
    whole[:first, :first], whole[first:, first:] = local
    all_rows = np.concatenate(coordinates)
    whole += all_rows @ support.compliance @ all_rows.T
    loads = np.hstack(by_section)
    return loads @ whole @ loads.T


@pytest.mark.parametrize("name", ["spur", "helical"])
def test_a_part_of_low_rank_is_the_compliance_of_all_rows_together(name, monkeypatch):
    rng, rigid = np.random.default_rng(25), models(name)[1]
    support = made_up_support(rigid, rng)
    compliance = replace(rigid.flank_compliance, support=support)
    reduced = replace(rigid, basis=replace(rigid.basis, compliance=compliance))
    phi, conditions = rigid.meshed.pair.pitch * rng.random(ANGLES), at_torques([0.3 * TORQUE, TORQUE])
    conditions = [replace(condition, misalignment=Misalignment(8.0, -5.0)) for condition in conditions]
    placed, place = [], LinePair.place

    def keeping(self, phi, misalignment):
        placed.append(place(self, phi, misalignment))
        return placed[-1]

    def of_all_nodes(self, phi, misalignment):
        sections = place(rigid.lines, phi, misalignment)
        for angle in range(len(phi)):
            sections.flexibility.between[angle] = flexibility_of_all_nodes(rigid, support, sections.lines, angle)
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
        whole = flexibility_of_all_nodes(rigid, support, lines, angle)[ready]
        assert_allclose(flexibility.between[angle][ready], whole, rtol=0.0, atol=SAME * whole.max())
    assert_allclose(found.ste_um, expected.ste_um, rtol=SAME)
    loads, expected_loads = (s.states.lines.load_N_per_mm for s in (found, expected))
    assert_allclose(loads, expected_loads, rtol=0.0, atol=SAME * expected_loads.max())
    monkeypatch.setattr(LinePair, "place", place)
    stiff = sweep_line_loads(rigid, phi, conditions, recorded=True)
    assert (found.ste_um > 1.02 * stiff.ste_um).all(), "it gives"
    assert np.abs(stiff.states.lines.load_N_per_mm - loads).max() > 0.05 * loads.max()
