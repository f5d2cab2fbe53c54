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
WAYS = pytest.mark.parametrize(
    ("helix", "distance"),
    [pytest.param(0.0, 92.0, marks=pytest.mark.slow), (15.0, 92.0 / np.cos(np.radians(15.0)))],
)


def solved_chain(folder, helix, distance, gears, more="", angles=12):
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
    text += f"[sweep]\nangles_per_pitch = {angles}\n"
    text += f'[mesh]\nprofile_elements = 3\nwidth_elements = 2\nelement = "hex8i"\n{more}'
    return pmor.run(written_set(folder, text))


@pytest.fixture(scope="module")
def planets(tmp_path_factory):
    text = SMALL_SET.replace("[10.0, 0.0, 0.0]", "[0.0, 0.0, 0.0]").replace("torques_Nm = [100.0]", "")
    return pmor.run(written_set(tmp_path_factory.mktemp("planets"), text))


def held_against_the_pair(found, case):
    """Root stress of a set of one mesh beside that of the pair by itself; returns that of both gears."""
    expected = root_stress_and_cycles(pmor.train(case).reduced, found.solution.phi_rad, conditions_of(case, [100.0]))
    for gear, (own, cycle) in enumerate(zip(found.solution.root_stress, expected.cycle, strict=True)):
        largest = np.nanmax(expected.max_principal_MPa[:, :, gear], axis=(2, 3))
        assert_allclose(own.max_principal_MPa, largest, rtol=SOLVED)
        for name in ("range_MPa", "most_MPa", "least_MPa", "radius_mm", "z_mm"):
            assert_allclose(getattr(own.cycle, name), getattr(cycle, name), rtol=SOLVED)
        at = 0, own.worst_tooth(0, 0), 0
        ends = own.cycle.most_MPa[at], own.cycle.least_MPa[at]
        assert_allclose((own.over_turns_MPa[0].max(), own.over_turns_MPa[0].min()), ends, rtol=SOLVED)
    return found.solution.root_stress


@WAYS
def test_one_pair_as_a_set_has_the_root_stress_of_the_pair(helix, distance, tmp_path):
    found = solved_chain(tmp_path, helix, distance, 2)
    for gear in held_against_the_pair(found, found.file.cases["input-idler"]):
        assert gear.mates[1] == ()


@WAYS
def test_teeth_with_pitch_deviations_are_stressed_each_by_itself_as_those_of_the_pair(helix, distance, tmp_path):
    """A tooth that is short leaves its load to the next one."""
    deviations = f"[input.modification]\npitch_deviations_um = {[0.0] * 4 + [8.0] + [0.0] * 16}\n"
    found = solved_chain(tmp_path, helix, distance, 2, deviations, angles=4)
    pinion, wheel = held_against_the_pair(found, found.file.cases["input-idler"])
    assert found.solution.pitches == 21
    assert (pinion.cycle.range_MPa.shape[1], wheel.cycle.range_MPa.shape[1]) == (21, 1)
    assert (pinion.turns, wheel.turns) == (1, 21)
    assert pinion.cycle.range_MPa[0, :, 0].argmax() == 5


@pytest.mark.slow
def test_teeth_of_a_ring_at_lugs_are_stressed_as_those_of_the_pair(tmp_path):
    ring = "internal = true\naddendum = 0.8\nroot_fillet_mm = 0.6\nrim_thickness_mm = 12.0\n"
    text = (
        SMALL_CHAIN.split("[[gears]]")[0]
        + f"""[[gears]]
name = "input"
at_mm = [0.0, 0.0]
torque_Nm = 100.0
[[gears]]
name = "ring"
at_mm = [0.0, -48.0]
torque_Nm = "balance"
[[meshes]]
gears = ["input", "ring"]
[input]
teeth = 17
bore_radius_mm = 17.0
[ring]
teeth = 41
{ring}held = {{lugs = 5, lug_deg = 10.0, first_deg = 11.0}}
[sweep]
angles_per_pitch = 4
[mesh]
profile_elements = 3
width_elements = 2
element = "hex8i"
"""
    )
    found = pmor.run(written_set(tmp_path, text))
    _, lugs = held_against_the_pair(found, found.file.cases["input-ring"])
    ranges = lugs.cycle.range_MPa[0, :, 0]
    assert len(ranges) == 41
    assert np.ptp(ranges) > 1e-2 * ranges.mean()


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
        turn = gear.over_turns_MPa[0]
        most, least = gear.cycle.most_MPa[0, 0, side], gear.cycle.least_MPa[0, 0, side]
        assert_allclose([turn.max(), turn.min()], [most, least], rtol=SOLVED)
        high = turn > 0.5 * most
        assert (high & ~np.roll(high, 1)).sum() == (3 if number < 2 else 1)


def test_both_sides_of_the_teeth_are_told_each_with_limits_that_add_up(planets):
    """A planet is bent from both sides; a sun is pressed on the side that carries no flank."""
    for number, row in enumerate(planets.data["root_stress"]):
        cycle = planets.solution.root_stress[number].cycle
        told = [row[f"{name}_MPa"] for name in ("range", "range_other_side")]
        assert_allclose(sorted(told), np.sort(cycle.range_MPa[0].max(axis=0)), rtol=1e-12)
        for name in ("range", "range_other_side"):
            limits = row[f"{name}_most_MPa"] - row[f"{name}_least_MPa"]
            assert_allclose(limits, row[f"{name}_MPa"], rtol=1e-12)
            assert limits > 30.0


def test_positions_that_do_not_converge_have_no_root_stress(planets):
    solved = planets.solution
    converged = solved.converged.copy()
    converged[0, 2] = False
    gear = replace(solved, found=solved.found._replace(converged=converged)).root_stress[0]
    assert np.isnan(gear.max_principal_MPa[0]).nonzero()[0].tolist() == [2]
    assert (gear.cycle.range_MPa <= solved.root_stress[0].cycle.range_MPa).all()
    assert np.isnan(gear.over_turns_MPa).sum() == 18


def test_a_planet_without_load_has_no_root_stress(tmp_path):
    text = SMALL_SET.replace("[10.0, 0.0, 0.0]", "[200.0, 0.0, 0.0]").replace("torques_Nm = [100.0]", "")
    found = pmor.run(written_set(tmp_path, text))
    first = found.data["root_stress"][2]
    assert (first["name"], first["max_principal_MPa"], first["range_MPa"]) == ("planet 1", 0.0, 0.0)
    (named,) = (text for text in found.data["bounds"] if "of the load on average" in text)
    assert named.startswith("300 N m, planet 1: carries 0 % of the load on average")
    assert named in str(found), "on the screen"


def test_a_set_can_leave_root_stress_out(tmp_path):
    found = pmor.run(written_set(tmp_path, f"{SMALL_SET}[results]\nroot_stress = false\n"))
    assert found.data["root_stress"] == []
    assert "Root stress" not in str(found)
    with pytest.raises(CaseError, match="has no root stress"):
        found.plot_root_stress()
