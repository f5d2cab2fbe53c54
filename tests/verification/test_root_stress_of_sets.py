"""Root stress of gears with several meshes: against a pair by itself, and by the symmetries of planets and idlers."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pmor
from pmor.core.errors import CaseError
from pmor.pair.conditions import conditions_of
from pmor_online.root_cycle import root_stress_and_cycles
from tests.support.small_sets import SMALL_CHAIN, SMALL_SET, written_set

# Solutions by two ways of Newton's method, to its tolerance.
SOLVED = 1e-9
WAYS = pytest.mark.parametrize(("helix", "distance"), [(0.0, 92.0), (15.0, 92.0 / np.cos(np.radians(15.0)))])


def solved_chain(folder, helix, distance, gears):
    """A straight chain of 21, 25 and 21 teeth, or of its first two."""
    head, *_ = SMALL_CHAIN.split("[[gears]]")
    names, teeth = ("input", "idler", "output")[:gears], (21, 25, 21)
    torques = ["torque_Nm = 100.0", *[""] * (gears - 2), 'torque_Nm = "balance"']
    text = f"{head}helix_angle_deg = {helix}\n"
    for number, (name, torque) in enumerate(zip(names, torques, strict=True)):
        text += f'[[gears]]\nname = "{name}"\nat_mm = [0.0, {float(number * distance)!r}]\n{torque}\n'
        text += f"[{name}]\nteeth = {teeth[number]}\nbore_radius_mm = {float(teeth[number])}\n"
    for one, other in zip(names[:-1], names[1:], strict=True):
        text += f'[[meshes]]\ngears = ["{one}", "{other}"]\n'
    text += "[sweep]\nangles_per_pitch = 12\n[mesh]\nprofile_elements = 3\nwidth_elements = 2\n"
    return pmor.gear_set(written_set(folder, text))


@pytest.fixture(scope="module")
def planets(tmp_path_factory):
    text = SMALL_SET.replace("[10.0, 0.0, 0.0]", "[0.0, 0.0, 0.0]").replace("torques_Nm = [100.0]", "")
    return pmor.gear_set(written_set(tmp_path_factory.mktemp("planets"), text))


@WAYS
def test_one_pair_as_a_set_has_the_root_stress_of_the_pair(helix, distance, tmp_path):
    found = solved_chain(tmp_path, helix, distance, 2)
    case = found.file.cases["input-idler"]
    reduced = pmor.train(case).reduced
    expected = root_stress_and_cycles(reduced, found.solution.phi_rad, conditions_of(case, [100.0]))
    for gear, (own, cycle) in enumerate(zip(found.solution.root_stress, expected.cycle, strict=True)):
        largest = np.nanmax(expected.max_principal_MPa[:, :, gear], axis=(2, 3))
        assert_allclose(own.max_principal_MPa, largest, rtol=SOLVED)
        for name in ("range_MPa", "most_MPa", "least_MPa", "radius_mm", "z_mm"):
            assert_allclose(getattr(own.cycle, name), getattr(cycle, name), rtol=SOLVED)
        assert own.mates[1] == ()


@WAYS
def test_an_idler_between_equal_gears_bends_alike_on_both_sides(helix, distance, tmp_path):
    """Half a turn about the line of centres takes the one mesh to the other, and the angles nearly to themselves."""
    found = solved_chain(tmp_path, helix, distance, 3).solution.root_stress
    first, idler, last = (gear.cycle for gear in found)
    assert found[1].mates == ((0,), (2,))
    assert_allclose(*idler.range_MPa[0, 0], rtol=2e-3)
    assert_allclose(*idler.most_MPa[0, 0], rtol=1e-2)
    if helix:
        assert_allclose(idler.z_mm[0, 0, 0], -idler.z_mm[0, 0, 1], rtol=1e-9)
        assert idler.z_mm[0, 0, 0] != 0.0
    assert_allclose(last.range_MPa, first.range_MPa, rtol=5e-3)
    assert idler.range_MPa.max() > 1.3 * max(first.range_MPa.max(), last.range_MPa.max())


def test_equal_planets_have_equal_ranges_of_reversed_bending(planets):
    """Their meshes are in phase: 18 and 54 teeth, three planets."""
    sun, ring, *others = planets.solution.root_stress
    for one in others[1:]:
        assert_allclose(one.cycle.range_MPa, others[0].cycle.range_MPa, rtol=1e-6)
        assert_allclose(one.max_principal_MPa, others[0].max_principal_MPa, rtol=1e-6)
    assert (others[0].cycle.most_MPa > 50.0).all()
    assert (others[0].cycle.least_MPa < -50.0).all()
    assert others[0].mates == ((0,), (1,))
    for alone in (sun, ring):
        assert alone.cycle.range_MPa.max() < others[0].cycle.range_MPa.max()


def test_a_turn_passes_through_both_ends_of_the_range_once_for_each_planet(planets):
    """The sun meets three planets in a turn; a tooth of a planet meets the sun once and the ring once."""
    for number, gear in enumerate(planets.solution.root_stress):
        side = int(gear.side[0, gear.max_principal_MPa[0].argmax()])
        turn = gear.over_turn_MPa[0]
        most, least = gear.cycle.most_MPa[0, 0, side], gear.cycle.least_MPa[0, 0, side]
        assert_allclose([turn.max(), turn.min()], [most, least], rtol=1e-2)
        high = turn > 0.5 * most
        assert (high & ~np.roll(high, 1)).sum() == (3 if number < 2 else 1)


def test_positions_that_do_not_converge_have_no_root_stress(planets):
    solved = planets.solution
    converged = solved.converged.copy()
    converged[0, 2] = False
    gear = replace(solved, found=solved.found._replace(converged=converged)).root_stress[0]
    assert np.isnan(gear.max_principal_MPa[0]).nonzero()[0].tolist() == [2]
    assert np.isnan(gear.cycle.range_MPa).all()
    assert np.isnan(gear.over_turn_MPa).sum() == 18


def test_a_planet_without_load_has_no_root_stress(tmp_path):
    text = SMALL_SET.replace("[10.0, 0.0, 0.0]", "[200.0, 0.0, 0.0]").replace("torques_Nm = [100.0]", "")
    first, *_ = (gear for gear in pmor.gear_set(written_set(tmp_path, text)).data["root_stress"][2:])
    assert (first["name"], first["max_principal_MPa"], first["range_MPa"]) == ("planet 1", 0.0, 0.0)


def test_a_set_can_leave_root_stress_out(tmp_path):
    found = pmor.gear_set(written_set(tmp_path, f"{SMALL_SET}[results]\nroot_stress = false\n"))
    assert found.data["root_stress"] == []
    assert "Root stress" not in str(found)
    with pytest.raises(CaseError, match="has no root stress"):
        found.plot_root_stress()
