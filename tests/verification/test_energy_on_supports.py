"""Work and energy of a pair on supports that give way: what a torque puts in is stored, and a closed cycle takes none.

The state at an angle phi under a torque T is the least of the potential

    P = F (g_0 + L u_0 + l s) + 1/2 F (D_local + L S L^T) F + sum of int delta dF + T s

over loads F and the advance s. At the state dP / dT = s, and dP / dphi is the change of P at the same F and s.
"""

from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.gear.condition import ALIGNED
from pmor.line.hubs import Hubs, hub_rows
from pmor.line.kernels.flexibility import make_all_ready
from pmor.line.kernels.law import approach_of
from pmor.line.kernels.tip_corner import LineLaw
from pmor.machine.coupled import on_hubs
from tests.support.line_pairs import models
from tests.support.stored_energy import stored_in_approach

TORQUE = 1e5
# Of the energy; measured 1.3e-10, of the integral over the torque.
STORED = 1e-9
# Of the work that goes through the mesh in a mesh cycle, torque times pitch; measured 2e-10 and less.
CYCLE = 1e-9
# Panels of the angle; those about one in which a section begins or ends to carry are parted into so many, so often.
PANELS, PARTS, ROUNDS = 96, 4, 4
# Of differences over the angle, rad.
STEP = 1e-6

pytestmark = pytest.mark.jit


@cache
def supported(name):
    """A pair on hubs that give way in all directions and coupled to each other, moved by other loads besides."""
    rng = np.random.default_rng(28)
    factor = np.diag([1.0, 1.0, 1.0, 0.02, 0.02, 0.0] * 2) @ rng.standard_normal((12, 12))
    moved = np.array([1.0, 1.0, 1.0, 0.02, 0.02, 0.0] * 2) * 1e-3 * rng.standard_normal(12)
    return on_hubs(models(name)[1], Hubs(1e-7 * factor @ factor.T, moved))


def placed_at(reduced, phi):
    """Sections at some angles, with the flexibility between all of them."""
    placed = reduced.lines.place(phi, ALIGNED)
    make_all_ready(placed.lines, placed.pair.between_flanks, placed.flexibility, np.isfinite(placed.lines.gap))
    return placed


def energies(placed, i, force):
    """Energy in gears and supports, energy in the approach of the flanks, and the work of the loads on the approach."""
    on, meshed = np.flatnonzero(force), placed.pair.meshed
    width = np.tile(meshed.width, len(force) // len(meshed.width))
    linear = 0.5 * force[on] @ placed.flexibility.between[i][np.ix_(on, on)] @ force[on]
    laws = [(LineLaw(*placed.lines.law[i, n].tolist()), force[n] / width[n], width[n]) for n in on]
    contact = sum(across * stored_in_approach(law, meshed.corners, load) for law, load, across in laws)
    return linear, contact, sum(across * load * approach_of(load, law, meshed.corners)[0] for law, load, across in laws)


def rigid_gap(lines, i, advance):
    further = np.maximum(advance - lines.corner_advance[i], 0.0)
    return lines.gap[i] + lines.lever[i] * advance + 0.5 * lines.lever_slope[i] * further**2


def potential(placed, i, force, advance):
    """P but for the work of the torque, which does not change at the same advance."""
    on, (linear, contact, work) = np.flatnonzero(force), energies(placed, i, force)
    return force[on] @ rigid_gap(placed.lines, i, advance)[on] + linear + work - contact


def gauss(ends, order):
    """Points of Gauss between the ends of panels, and their weights."""
    points, weights = np.polynomial.legendre.leggauss(order)
    half = 0.5 * np.diff(ends)
    return (ends[:-1, None] + half[:, None] * (1.0 + points)).ravel(), np.outer(half, weights).ravel()


def torque_leg(placed, low, high):
    """Integral of the advance over the torque, at all angles."""
    # Beginning contact goes with T ln T, and the slope jumps where a section begins to carry.
    ends = np.concatenate([[0.0], np.geomspace(1e-6, 1e-3, 200), np.linspace(1e-3, 1.0, 20000)[1:]])
    torques, weights = gauss(low + (high - low) * ends, 2)
    found = placed.solve(torques)
    assert found.converged.all()
    return weights @ found.advance


def angle_leg(reduced, start, end, torque):
    """Integral of dP / dphi over the angle."""
    ends = np.linspace(start, end, PANELS + 1)
    for _ in range(ROUNDS):
        carries = reduced.lines.place(ends, ALIGNED).solve(np.array([torque])).force[0] > 0.0
        near = np.convolve((carries[1:] != carries[:-1]).any(axis=1), np.ones(3), "same") > 0.0
        within = [np.linspace(*ends[i : i + 2], PARTS, endpoint=False)[1:] for i in np.flatnonzero(near)]
        ends = np.sort(np.concatenate([ends, *within]))
    phi, weights = gauss(ends, 3)
    behind, placed, ahead = (placed_at(reduced, phi + step) for step in (-STEP, 0.0, STEP))
    assert len({*behind.lines.first_pair, *ahead.lines.first_pair}) == 1
    found, total = placed.solve(np.array([torque])), 0.0
    for i, weight in enumerate(weights):
        state = found.force[0, i], found.advance[0, i]
        total += weight * (potential(ahead, i, *state) - potential(behind, i, *state)) / (2.0 * STEP)
    return total


@pytest.mark.parametrize("name", ["spur", pytest.param("helical", marks=pytest.mark.slow)])
def test_the_work_of_the_torque_is_stored_in_contact_gears_and_supports(name):
    """From no load on, at angles of a whole pitch: int T ds, against the energy in each of the three."""
    reduced = supported(name)
    phi = np.linspace(0.0, reduced.meshed.pair.pitch, 3, endpoint=False)
    placed, held = placed_at(reduced, phi), placed_at(models(name)[1], phi)
    found, area = placed.solve(np.array([TORQUE])), torque_leg(placed, 0.0, TORQUE)
    rows = hub_rows(placed.pair.meshed.pair, placed.lines, placed.pair.meshed.sections.z)
    for i, force in enumerate(found.force[0]):
        gears, contact, _ = energies(held, i, force)
        wrench = force @ rows[i]
        supports = 0.5 * wrench @ placed.pair.meshed.hubs.compliance @ wrench
        stored = np.array([contact, gears, supports])
        assert stored.min() > 0.05 * stored.sum()
        assert_allclose(TORQUE * found.advance[0, i] - area[i], stored.sum(), rtol=STORED)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["spur", "helical"])
def test_a_closed_cycle_of_torque_and_angle_takes_no_work(name):
    """Loaded, turned under the torque while a tip corner begins to carry, relieved, turned back under a fifth of it."""
    reduced, torques = supported(name), (0.2 * TORQUE, TORQUE)
    pair = reduced.meshed.pair
    ends = pair.roll_position_range[0] + np.array([-0.1, 0.02]) * pair.pitch
    loaded, relieved = torque_leg(reduced.lines.place(ends, ALIGNED), *torques)
    back, there = (angle_leg(reduced, *ends, torque) for torque in torques)
    through = TORQUE * pair.pitch
    assert abs(there) > 1e-5 * through
    assert abs(loaded + there - relieved - back) < CYCLE * through
