"""The force of a mesh wherever both hubs stand: against the arrays of sections, their sweeps, and mechanics."""

from functools import cache

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.case import change_case, load_case
from pmor.gear.condition import PLAIN, Assembly, at_torques
from pmor.line.hub_force import contact_of, nothing_placed
from pmor.line.hubs import hub_rows
from pmor.line.kernels.hubs import SAME, contact_of_hubs
from pmor.pair.model import elastic_model, mesh_model
from pmor_offline.train import train
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.model import reduced_pair
from tests.support.line_pairs import TORQUE, models, random_modification

# Of the largest force; two ways of the same sums.
ROUND_OFF = 1e-9
# Of the advance under the load, and of the tilt that moves the load over the width: mm, and rad over 16 to 20 mm.
SHIFT, TILT = 4e-3, 2e-4
ADVANCE = 1.5e-4


@cache
def ring():
    mesh = {"profile_elements": 5, "width_elements": 2, "error_bar": False, "width": "whole"}
    case = change_case(load_case("cases/internal_spur.toml"), mesh=mesh, results={"root_stress": False})
    return reduced_pair(train(case, elastic_model(case, mesh_model(case))).basis)


def pair(name):
    return ring() if name == "ring" else models(name)[1]


class HubForce:
    """Forces on both hubs, one position after the other."""

    def __init__(self, lines, assembly):
        self.contact, self.placed = contact_of(lines, assembly), nothing_placed(lines)

    def at(self, phi, advance, displacement):
        converged, self.overloaded = contact_of_hubs(self.contact, self.placed, phi, advance, displacement)
        assert converged
        return self.placed.wrench


def moved(rng):
    return rng.standard_normal(12) * np.tile([SHIFT, SHIFT, SHIFT, TILT, TILT, 0.0], 2)


def flanks(reduced, rng):
    rolls = reduced.meshed.pair.active_rolls
    return Assembly(pinion=random_modification(rng, rolls[0]), wheel=random_modification(rng, rolls[1]))


def by_arrays(lines, assembly, phi, advance, displacement):
    """The slow, obvious way: sections placed anew, their gaps changed by the hubs, loads from nothing."""
    placed = lines.place(np.array([phi]), assembly.misalignment)
    rows = hub_rows(lines.meshed.pair, placed.lines, lines.meshed.sections.z)
    placed.lines.gap[:] += rows @ displacement
    found = placed.solve(np.array([advance]), True, placed.deviation(assembly))
    wrench = found.force[0, 0] @ rows[0]
    wrench[5] = -found.torque.sum()
    return wrench, bool(placed.width_limit.exceeded(found.force)[0, 0])


@pytest.mark.parametrize(
    "name", ["edges", "helical", *(pytest.param(name, marks=pytest.mark.slow) for name in ("unequal", "ring"))]
)
def test_each_position_is_that_of_sections_placed_for_it_alone(name, rng):
    reduced = pair(name)
    for assembly in (PLAIN, flanks(reduced, rng)):
        force, loaded = HubForce(reduced.lines, assembly), 0
        phi = rng.uniform(-1.0, 1.0)
        for advance in rng.uniform(0.0, 2.0 * ADVANCE, 25):
            phi += rng.choice([0.002, 0.7])
            displacement = moved(rng)
            expected, _ = by_arrays(reduced.lines, assembly, phi, advance, displacement)
            largest = np.abs(expected).max()
            assert_allclose(force.at(phi, advance, displacement), expected, rtol=0.0, atol=ROUND_OFF * largest)
            loaded += largest > 0.0
        assert loaded > 10


@pytest.mark.parametrize("name", ["helical", "ring"])
def test_the_advance_of_a_sweep_gives_its_torque(name):
    reduced = pair(name)
    force, phi = HubForce(reduced.lines, PLAIN), np.linspace(0.0, reduced.meshed.pair.pitch, 9)
    for angle, ste_um in zip(phi, sweep_line_loads(reduced, phi, at_torques([TORQUE])).ste_um[0], strict=True):
        wrench = force.at(angle, 1e-3 * ste_um / reduced.lines.base_radius, np.zeros(12))
        assert_allclose(wrench[5], -TORQUE, rtol=1e-8)


def test_forces_on_both_hubs_balance(rng):
    reduced = models("edges")[1]
    force, across = HubForce(reduced.lines, PLAIN), np.array([0.0, reduced.meshed.pair.centre_distance, 0.0])
    for phi in rng.uniform(-1.0, 1.0, 10):
        wrench = force.at(phi, ADVANCE, moved(rng))
        size = np.abs(wrench).max()
        assert_allclose(wrench[:3], -wrench[6:9], atol=ROUND_OFF * size)
        about_pinion = wrench[9:] + np.cross(across, wrench[6:9])
        # Under a corner the lever about z is that of the present advance.
        assert_allclose(about_pinion[:2], -wrench[3:5], atol=ROUND_OFF * size)
        assert_allclose(about_pinion[2], -wrench[5], rtol=1e-4)


def test_a_force_does_the_work_that_displaced_hubs_store(rng):
    """Forces are the derivatives of one energy: their own are symmetric, and d W / d u = L^T F."""
    reduced, step = models("helical")[1], 1e-6
    force, displacement = HubForce(reduced.lines, PLAIN), moved(rng)
    scale = np.tile([1.0, 1.0, 1.0, 0.05, 0.05, 0.0], 2)
    tangent = np.array([
        force.at(0.1, ADVANCE, displacement + step * one).copy() - force.at(0.1, ADVANCE, displacement - step * one)
        for one in np.diag(scale)
    ]) * scale / (2.0 * step)  # fmt: skip
    assert_allclose(tangent, tangent.T, atol=1e-5 * np.abs(tangent).max())
    assert np.linalg.eigvalsh(0.5 * (tangent + tangent.T)).max() < 1e-5 * np.abs(tangent).max()


@pytest.mark.parametrize("name", ["edges", "helical"])
def test_sections_that_stay_placed_give_the_force_of_those_placed_anew(name, rng):
    reduced = pair(name)
    assembly = flanks(reduced, rng)
    for phi in rng.uniform(-1.0, 1.0, 10):
        stays, anew = HubForce(reduced.lines, assembly), HubForce(reduced.lines, assembly)
        stays.at(phi, ADVANCE, np.zeros(12))
        there = phi + 0.999 * SAME
        found, expected = (force.at(there, ADVANCE, np.zeros(12)) for force in (stays, anew))
        # As much as the force changes over such a turn: a hundred times its share where a pair begins to carry.
        assert_allclose(found, expected, rtol=0.0, atol=100.0 * SAME * np.abs(expected).max())
        further = phi + 1.001 * SAME
        expected = HubForce(reduced.lines, assembly).at(further, ADVANCE, np.zeros(12))
        assert_allclose(stays.at(further, ADVANCE, np.zeros(12)), expected, rtol=0.0, atol=1e-11 * abs(expected[5]))


def test_overload_is_told():
    reduced = models("unequal")[1]
    force, seen = HubForce(reduced.lines, PLAIN), []
    for advance in np.geomspace(ADVANCE, 100.0 * ADVANCE, 12):
        force.at(0.1, advance, np.zeros(12))
        seen.append(by_arrays(reduced.lines, PLAIN, 0.1, advance, np.zeros(12))[1])
        assert force.overloaded == seen[-1]
    assert seen[0] < seen[-1]
