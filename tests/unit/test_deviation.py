"""Flank deviations: what each term of a modification removes where, in the kernels' words."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
import quickjs

from pmor.gear.flank_deviation import kernel_deviation
from pmor.gear.kernels.deviation import deviations_at, flank_deviation
from pmor.gear.modification import Modification, Wave
from pmor.gear.pair import GearPair
from pmor.gear.tooth import Tooth
from pmor.gear.topography import Topography, read_topography
from pmor.report.live.model import tooth_deviation

WIDTH, MIDDLE = 20.0, 1.5
LIVE = Path(__file__).parents[2] / "pmor" / "report" / "templates" / "live" / "flanks.js"
FACE = MIDDLE - 0.5 * WIDTH, MIDDLE + 0.5 * WIDTH


@pytest.fixture(scope="module")
def pair():
    pinion = Tooth(teeth=21, module=4.0, pressure_angle=math.radians(20.0))
    wheel = Tooth(teeth=33, module=4.0, pressure_angle=math.radians(20.0))
    return GearPair(pinion, wheel, WIDTH, 108.0)


@pytest.fixture(scope="module")
def amount_um(pair):
    """Deviation (um) of the pinion at fractions of its active profile and of its width, from their middles."""
    start, end = pair.active_rolls[0]

    def of(modification, xi, zeta, tooth=0):
        deviation = kernel_deviation(modification, pair.pinion, (start, end), FACE)
        u, z = 0.5 * (start + end) + xi * (end - start), MIDDLE + zeta * WIDTH
        return 1e3 * flank_deviation(deviation, u, z, tooth)

    return of


def test_active_profiles_of_both_gears_meet_tip_to_start(pair):
    (start, end), (first, last) = pair.active_rolls
    assert last == pytest.approx(pair.wheel.tip_roll_angle, rel=1e-14)
    assert end == pytest.approx(pair.pinion.tip_roll_angle, rel=1e-14)
    total = pair.action_length
    assert start * pair.pinion.base_radius + last * pair.wheel.base_radius == pytest.approx(total, rel=1e-14)
    assert end * pair.pinion.base_radius + first * pair.wheel.base_radius == pytest.approx(total, rel=1e-14)


@pytest.mark.parametrize(("shape", "halfway"), [("linear", 0.5), ("parabolic", 0.25)])
def test_reliefs_start_and_end_where_they_say(pair, shape, halfway):
    (start, end), tip = pair.active_rolls[0], pair.pinion.tip_roll_angle
    middle = 0.5 * (start + end)
    relief = Modification(
        tip_relief_um=20.0, tip_relief_start_roll_deg=math.degrees(middle), tip_relief_shape=shape,
        root_relief_um=12.0, root_relief_end_roll_deg=math.degrees(middle), root_relief_shape=shape,
    )  # fmt: skip
    deviation = kernel_deviation(relief, pair.pinion, (start, end), (-10.0, 10.0))
    u = np.array([start, 0.5 * (start + middle), middle, 0.5 * (middle + tip), tip, 2.0 * tip - middle])
    out = np.empty(6)
    deviations_at(deviation, u, np.zeros(6), np.zeros(6, dtype=np.int64), out)
    beyond = 4.0 if shape == "parabolic" else 2.0
    np.testing.assert_allclose(1e3 * out, [12.0, 12.0 * halfway, 0.0, 20.0 * halfway, 20.0, 20.0 * beyond], atol=1e-12)


@pytest.mark.parametrize(
    ("modification", "corners"),  # (start, low z), (start, high z), (tip, low z), (tip, high z)
    [
        (Modification(profile_crowning_um=8.0), (8.0, 8.0, 8.0, 8.0)),
        (Modification(profile_slope_um=8.0), (-4.0, -4.0, 4.0, 4.0)),
        (Modification(helix_crowning_um=8.0), (8.0, 8.0, 8.0, 8.0)),
        (Modification(helix_slope_um=8.0), (-4.0, 4.0, -4.0, 4.0)),
        (Modification(end_relief_um=8.0, end_relief_length_mm=4.0), (8.0, 8.0, 8.0, 8.0)),
        (Modification(twist_um=8.0), (2.0, -2.0, -2.0, 2.0)),
    ],
)
def test_amounts_at_the_corners_and_none_in_the_middle(amount_um, modification, corners):
    found = [amount_um(modification, xi, zeta) for xi in (-0.5, 0.5) for zeta in (-0.5, 0.5)]
    np.testing.assert_allclose(found, corners, atol=1e-12)
    assert amount_um(modification, 0.0, 0.0) == pytest.approx(0.0, abs=1e-12)


def test_crownings_are_parabolas_and_end_relief_is_straight(amount_um):
    assert amount_um(Modification(profile_crowning_um=8.0), 0.25, 0.4) == pytest.approx(2.0)
    assert amount_um(Modification(helix_crowning_um=8.0), 0.4, -0.25) == pytest.approx(2.0)
    end = Modification(end_relief_um=8.0, end_relief_length_mm=4.0)
    assert [amount_um(end, 0.1, zeta) for zeta in (-0.4, 0.29, 0.4)] == pytest.approx([4.0, 0.0, 4.0])


def test_modifications_add_up(amount_um):
    parts = [{"tip_relief_um": 20.0, "tip_relief_start_roll_deg": 22.0}, {"helix_crowning_um": 5.0}, {"twist_um": 3.0}]
    both = Modification(**{key: value for part in parts for key, value in part.items()})
    for xi, zeta in [(0.4, 0.3), (0.5, -0.5), (-0.2, 0.1)]:
        alone = sum(amount_um(Modification(**part), xi, zeta) for part in parts)
        assert amount_um(both, xi, zeta) == pytest.approx(alone, abs=1e-12)


def test_pitch_deviations_count_from_their_median_over_whole_turns(amount_um):
    deviations = np.zeros(21)
    deviations[3] = 7.0
    one = Modification(pitch_deviations_um=tuple(deviations))
    assert [amount_um(one, 0.0, 0.0, tooth) for tooth in (3, 3 - 21, 3 + 42)] == pytest.approx([7.0] * 3)
    assert [amount_um(one, 0.0, 0.0, tooth) for tooth in (2, 4, -3)] == [0.0] * 3
    even = Modification(pitch_deviations_um=(7.0,) * 21)
    assert amount_um(even, 0.3, 0.2, 5) == 0.0


def _grid(function, n=7, m=5):
    roll = np.sort(np.r_[8.0, 34.0, np.random.default_rng(5).uniform(9.0, 33.0, n - 2)])
    z = np.linspace(-10.0, 10.0, m)
    amounts = tuple(tuple(float(function(u, k)) for k in z) for u in roll)
    return Topography(tuple(map(float, roll)), tuple(map(float, z)), amounts)


def _on_grid(pair, topography, roll_deg, z):
    """Deviation (um) at a place along z from the middle of the face, which is not that of the pair."""
    deviation = kernel_deviation(Modification(topography=topography), pair.pinion, pair.active_rolls[0], FACE)
    return 1e3 * flank_deviation(deviation, math.radians(roll_deg), MIDDLE + z, 0)


def test_topography_is_exact_at_its_points_and_for_bilinear_flanks(pair):
    rng = np.random.default_rng(1)
    noise = _grid(lambda u, z: rng.uniform(-9.0, 9.0))
    for i, u in enumerate(noise.roll_deg):
        for k, z in enumerate(noise.z_mm):
            assert _on_grid(pair, noise, u, z) == pytest.approx(noise.amount_um[i][k], abs=1e-10)
    for n, m in [(2, 2), (7, 5), (2, 3)]:
        flat = _grid(lambda u, z: 3.0 + 0.2 * u - 0.1 * z + 0.03 * u * z, n, m)
        for u, z in rng.uniform([8.0, -10.0], [34.0, 10.0], (20, 2)):
            assert _on_grid(pair, flat, u, z) == pytest.approx(3.0 + 0.2 * u - 0.1 * z + 0.03 * u * z, abs=1e-10)


def test_topography_has_no_kinks_and_stays_at_its_border(pair):
    rng = np.random.default_rng(2)
    noise, h = _grid(lambda u, z: rng.uniform(-9.0, 9.0)), 1e-6
    for u in noise.roll_deg[1:-1]:
        left, here, right = (_on_grid(pair, noise, u + step, 3.3) for step in (-h, 0.0, h))
        assert right - here == pytest.approx(here - left, abs=2e-8)
    assert _on_grid(pair, noise, 40.0, 12.0) == pytest.approx(noise.amount_um[-1][-1], abs=1e-10)


def test_topography_reads_from_csv():
    text = "roll \\ z;-10;0;10\n10;1;2;3\n20.5;4;5;-6\n"
    wanted = Topography((10.0, 20.5), (-10.0, 0.0, 10.0), ((1.0, 2.0, 3.0), (4.0, 5.0, -6.0)))
    assert read_topography(text) == wanted
    assert read_topography(text.replace(";", ",")) == wanted
    assert hash(read_topography(text)) == hash(wanted)


def test_topography_swings_little_beyond_its_amounts_however_uneven_its_points_are(pair):
    rng = np.random.default_rng(3)
    roll = (8.0, 8.05, 15.0, 15.01, 15.02, 24.0, 33.99, 34.0)
    noise = Topography(roll, (-10.0, -9.9, 10.0), tuple(tuple(rng.uniform(-9.0, 9.0, 3)) for _ in roll))
    found = [_on_grid(pair, noise, *rng.uniform([8.0, -10.0], [34.0, 10.0])) for _ in range(2000)]
    assert max(map(abs, found)) < 25.0


def test_waves_run_along_the_face_as_they_say_and_in_the_page_as_in_the_kernel(pair, amount_um):
    """A phase that grows by a turn over the face: crests at both faces, a valley in the middle. Teeth in order."""
    wave = Wave(count=34, amplitude_um=2.0, phase_deg=25.0, helix_phase_deg=360.0)
    one = Modification(waves=(wave,))
    start, end = pair.active_rolls[0]
    crest = (math.pi - math.radians(25.0)) % (2.0 * math.pi) + 2.0 * math.pi * np.ceil(34 * start / (2.0 * math.pi))
    along = (crest / 34 - 0.5 * (start + end)) / (end - start)
    expected = [2.0, 0.0, -2.0, 0.0, 2.0]
    np.testing.assert_allclose([amount_um(one, along, zeta) for zeta in np.linspace(-0.5, 0.5, 5)], expected, atol=1e-9)
    # 34 waves on 21 teeth: from tooth to tooth 13/21 of a wave less.
    assert amount_um(one, along, 0.0, 3) == pytest.approx(-2.0 * math.cos(2.0 * math.pi * 3 * 34 / 21), abs=1e-9)

    deviation = kernel_deviation(one, pair.pinion, (start, end), FACE)
    page = quickjs.Context()
    page.eval(LIVE.read_text(encoding="utf-8"))
    for u, z, tooth in ((start, 0.0, 0), (end, -7.0, 4), (0.4, 9.0, -3)):
        there = page.eval(f"toothDeviation({json.dumps(tooth_deviation(deviation))}, {u}, {z - MIDDLE}, {tooth})")
        assert there == pytest.approx(flank_deviation(deviation, u, z, tooth), abs=1e-12)
