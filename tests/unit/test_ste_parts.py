"""Transmission error on shafts by its parts; bounds of meshes on moved axes; fixed points; the largest pressure."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from pmor.line.train import smooth_rows
from pmor.machine.fixed_point import Mixing
from pmor.machine.loaded import loaded
from pmor.machine.loader import load
from pmor.machine.ste_parts import ste_parts
from pmor.pair.bounds import coast_gap_um
from pmor.results.load_distribution import largest_pressure
from tests.support.gear_models import gear_pair, tooth
from tests.support.gearboxes import SMALL, written
from tests.support.internal_pairs import internal_pair, ring

ROUND_OFF = 1e-9


@pytest.fixture(scope="module", params=[2, 1])
def box(request, tmp_path_factory):
    """The small box, on two bearings to a shaft, or on one that holds tilt too."""
    text = SMALL
    if request.param == 1:
        second = text[text.index('[[bearings]]\nname = "B"') : text.index('[[bearings]]\nname = "C"')]
        axial = "axial_N_per_mm = 1e5\n"
        text = text.replace(second, "").replace(axial, f"{axial}tilt_Nmm_per_rad = 1e8\n")
    path = written(tmp_path_factory.mktemp("box"), text)
    model = load(path).model
    return loaded(model, model.sections.loads[0])


def moved_rigidly(box, rng):
    """All nodes of each shaft as a rigid body, without rotation about its axis."""
    found = np.zeros(len(box.load))
    for name, beam in box.beams.items():
        origin, turn = rng.standard_normal(3), np.array([0.0, *rng.standard_normal(2)])
        for node, place in enumerate(beam.stations):
            first = box.first[name] + 6 * node
            found[first : first + 6] = [*(origin + np.cross(turn, [place, 0.0, 0.0])), *turn]
    return found


def test_shafts_that_move_as_rigid_bodies_are_carried_by_their_bearings(box):
    moved = moved_rigidly(box, np.random.default_rng(5))
    (mesh,) = box.meshes
    parts = ste_parts(box, moved, mesh)
    expected = sum(wrench @ moved[hub : hub + 6] for hub, wrench in zip(mesh.hubs, mesh.wrenches, strict=True))
    assert_allclose(parts.bearings_um, 1e3 * expected, rtol=ROUND_OFF)
    assert abs(parts.shafts_um) < ROUND_OFF * abs(parts.bearings_um)


def test_what_bends_between_bearings_that_stand_still_is_of_the_shafts(box):
    rng = np.random.default_rng(6)
    bent = rng.standard_normal(len(box.load))
    for bearing in box.bearings:
        bent[np.nonzero(bearing.rows.any(axis=0))[0]] = 0.0
    (mesh,) = box.meshes
    parts = ste_parts(box, bent, mesh)
    assert parts.bearings_um == 0.0
    assert parts.shafts_um != 0.0
    twisted = bent.copy()
    for hub in mesh.hubs:
        twisted[hub + 3] += 1.0
    assert ste_parts(box, twisted, mesh) == parts, "rotation about the axes is left out"


# A step of the axes, mm, and what is of its second order in gaps.
STEP, SECOND = 1e-3, 2e-4
PAIRS = {
    "external": gear_pair(tooth(17, 0.4), tooth(31, 0.1), extra_distance=0.3),
    "helical": gear_pair(tooth(21, 0.0, 15.0), tooth(31, 0.2, -15.0), extra_distance=0.1),
    "internal": internal_pair(tooth(20), ring(60, module=4.0, addendum=0.8), closer=0.1),
}
every_pair = pytest.mark.parametrize("pair", PAIRS.values(), ids=PAIRS.keys())


@every_pair
@pytest.mark.parametrize("place", [(0, 0), (0, 1), (1, 1), (0, 5), (1, 5)])
def test_gaps_of_both_flanks_together_change_as_the_backlash_of_the_moved_pair(place, pair):
    """Backlash depends on the centre distance alone: other movements open one side and close the other."""
    gear, direction = place
    moved = np.zeros((2, 6))
    moved[gear, direction] = STEP if direction < 3 else STEP / pair.pinion.base_radius
    apart = (moved[1, 1] - moved[0, 1]) if direction == 1 else 0.0
    both = 1e-3 * float(coast_gap_um(pair, moved)) + float((moved * smooth_rows(pair)).sum())
    opened = replace(pair, centre_distance=pair.centre_distance + apart).backlash
    assert_allclose(both, opened, atol=SECOND * STEP)


@every_pair
def test_a_pinion_that_runs_ahead_opens_its_coast_side(pair):
    moved = np.zeros((2, 6))
    moved[0, 5] = STEP / pair.pinion.base_radius
    assert_allclose(coast_gap_um(pair, moved), 1e3 * (pair.backlash + STEP), rtol=1e-12)


def test_the_fixed_point_of_a_linear_map_is_found_in_as_many_rounds_as_it_has_directions_that_return():
    rng = np.random.default_rng(7)
    turned, _ = np.linalg.qr(rng.normal(size=(20, 3)))
    back = turned @ np.diag([0.9, -1.2, 0.4]) @ turned.T
    shift, place, mixing = rng.normal(size=20), np.zeros(20), Mixing()
    for _ in range(5):
        place = mixing.next(place, back @ place + shift)
    assert_allclose(place, np.linalg.solve(np.eye(20) - back, shift), rtol=1e-10)


def test_sections_at_a_sharp_edge_do_not_count_and_nothing_is_made_up_where_they_carry_alone():
    """Without contact it is 0, at a sharp edge alone there is none, beside others these count."""
    pressure = np.array([[0.0, 0.0], [np.nan, 0.0], [np.nan, 700.0], [900.0, 700.0]])
    assert_array_equal(largest_pressure(pressure, 1), [0.0, np.nan, 700.0, 900.0])
    assert_array_equal(largest_pressure(pressure, (0, 1)), 900.0)
    assert_array_equal(largest_pressure(largest_pressure(pressure, 1), 0), 900.0)  # of parts as of the whole
