"""Waves around a gear and flanks of each tooth: orders of the transmission error, and full finite elements."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.case import parse_case
from pmor.gear.condition import Condition
from pmor.gear.modification import Modification, Wave
from pmor.gear.topography import Topography, of_teeth
from pmor.pair.sweep import sweep_ste
from pmor.results.load_distribution import line_states
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.model import online_angles
from pmor_online.sweep import sweep_reduced_pair
from tests.support.line_pairs import LINES, TORQUE, _solved, models
from tests.support.small_case import case_text

TEETH, COUNT, ANGLES = 51, 107, 6
# Relief that keeps edges of tips out of contact: off the line of action a tip meets the wave at another angle.
RELIEF = {"tip_relief_um": 25.0, "tip_relief_length_mm": 2.5}
# Amplitude of the linear part: half the difference of a wave and its opposite; the law of contact bends by its square.
SMALL = 1e-4


def pair(helix_deg=0.0, columns=2, **sections):
    return case_text(
        pair={"helix_angle_deg": helix_deg}, pinion={"teeth": TEETH, "bore_radius_mm": 60.0},
        results={"root_stress": False}, mesh={"profile_elements": 4, "width_elements": columns, "width": "whole"},
        **LINES, **sections,
    )  # fmt: skip


def ste_um(reduced, *pinions):
    """Transmission error over a revolution with flanks of the pinion, um."""
    phi = online_angles(reduced.meshed.pair.pitch, ANGLES, TEETH)
    wheel = Modification(**RELIEF)
    sweep = sweep_line_loads(reduced, phi, [Condition(torque=TORQUE, pinion=one, wheel=wheel) for one in pinions])
    assert sweep.converged.all()
    return sweep.ste_um


def of_gear(amplitude_um, **wave):
    return Modification(waves=(Wave(count=COUNT, amplitude_um=amplitude_um, **wave),), **RELIEF)


def orders(curve):
    return 2.0 / len(curve) * np.abs(np.fft.rfft(curve))


@pytest.fixture(scope="module")
def spur():
    return _solved(pair())[1]


def test_a_wave_on_a_spur_gear_is_its_own_order_alone(spur):
    """All teeth in mesh have one place on the wave, whatever they carry: the gear leads and lags by it."""
    waved, plain = ste_um(spur, of_gear(0.8, phase_deg=20.0), Modification(**RELIEF))
    found = orders(waved - plain)
    assert found[COUNT] == pytest.approx(0.8, rel=1e-9)
    assert np.delete(found, COUNT).max() < 1e-9 * found[COUNT]


def test_waves_of_a_helical_gear_count_by_their_mean_over_the_face_as_it_is_loaded():
    """Orders |107 +- 51 k| alone; 107 itself by the mean of the wave over the face, each section by its mean load.

    Along the line of contact, which crosses the face by count times the angle of the helix, it is that of a spur gear.
    With one whole wave along it, nothing if load were even over the face: it is less so at the ends of teeth.
    """
    _, reduced = _solved(pair(20.0, columns=4))
    tooth, width = reduced.meshed.pair.pinion, reduced.meshed.pair.face_width
    along, waves = -math.degrees(COUNT * tooth.twist_per_length * width), (0.0, 0.4, 1.0)
    flanks = [of_gear(SMALL, phase_deg=side, helix_phase_deg=along + 360.0 * wave)
              for wave in waves for side in (20.0, 200.0)]  # fmt: skip
    curves = ste_um(reduced, *flanks)
    linear = 0.5 * (curves[::2] - curves[1::2])
    number = np.arange(ANGLES * TEETH // 2 + 1)
    ghosts = np.isin(number % TEETH, (COUNT % TEETH, -COUNT % TEETH))
    even = Condition(torque=TORQUE, pinion=Modification(**RELIEF), wheel=Modification(**RELIEF))
    pitch = online_angles(reduced.meshed.pair.pitch, ANGLES, 1)
    share = line_states(sweep_reduced_pair(reduced, pitch, [even], recorded=True)).sensitivity[0].sum(axis=1)
    assert_allclose(share.sum(axis=1), 1.0, rtol=1e-9)
    for wave, curve in zip(waves, linear, strict=True):
        found = orders(curve) / SMALL
        assert found[~ghosts].max() < 1e-8, "rounding over the amplitude, of 40 um"
        mean = abs(share.mean(axis=0) @ np.exp(2j * np.pi * wave * reduced.layered.sections.z / width))
        assert found[COUNT] == pytest.approx(mean, abs=1e-8)
        beside = np.sort(found[ghosts])[-2]
        assert beside < 1e-8 if wave == 0.0 else beside > 0.02
        assert np.ptp(curve) < 2.0 * SMALL, "as without load"
    none, part, whole = (orders(curve)[COUNT] / SMALL for curve in linear)
    assert (none, whole / part) == (pytest.approx(1.0, rel=1e-8), pytest.approx(0.0, abs=0.05))


def test_the_period_of_waves_is_what_teeth_and_waves_divide_by():
    for count, pitches in ((COUNT, 51), (102, 1), (34, 3)):
        text = pair(online={"angles_per_pitch": ANGLES})
        text += f"[[pinion.modification.waves]]\ncount = {count}\namplitude_um = 1.0\n"
        case = parse_case(text, "waves", "waves")
        assert case.repeats_after == pitches
        assert case.pinion_modification.waves == (Wave(count=count, amplitude_um=1.0),)


def grids(amounts):
    return of_teeth([Topography((0.0, 60.0), (-20.0, 20.0), ((amount,) * 2,) * 2) for amount in amounts])


def test_even_flanks_of_each_tooth_are_pitch_deviations(spur):
    amounts = tuple(2.0 * math.sin(2.0 * j) for j in range(TEETH))
    middle = float(np.median(amounts))
    by_pitch, by_grid = ste_um(
        spur, Modification(pitch_deviations_um=amounts, **RELIEF),
        Modification(topography=grids(a - middle for a in amounts), **RELIEF),
    )  # fmt: skip
    assert_allclose(by_grid, by_pitch, atol=1e-9)
    assert np.ptp(by_pitch) > 1.0


@pytest.mark.slow
def test_flanks_of_each_tooth_are_those_of_full_finite_elements():
    full, reduced = models("spur")
    rng = np.random.default_rng(3)
    tooth = rng.uniform(-4.0, 4.0, (21, 3, 3))
    grids = of_teeth(
        [Topography((0.0, 20.0, 60.0), (-10.0, 0.0, 10.0), tuple(map(tuple, rows.tolist()))) for rows in tooth]
    )
    flanks = Modification(topography=grids, waves=(Wave(count=50, amplitude_um=1.0, helix_phase_deg=60.0),), **RELIEF)
    phi = reduced.meshed.pair.pitch * np.array([0.2, 3.7, 12.4])
    conditions = [Condition(torque=TORQUE, pinion=flanks), Condition(torque=TORQUE)]
    found = sweep_line_loads(reduced, phi, conditions).ste_um
    expected = sweep_ste(full.mesh.meshed, full.elasticity_at, phi, conditions[:1])
    assert_allclose(found[:1], expected.ste_um, rtol=2e-3)
    assert np.abs(found[0] - found[1]).max() > 1.0
