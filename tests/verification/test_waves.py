"""Waves around a gear and flanks of each tooth: orders of the transmission error, and full finite elements."""

import math

import numpy as np
import pytest

from pmor.case import parse_case
from pmor.gear.condition import Condition
from pmor.gear.modification import UNMODIFIED, Modification, Wave
from pmor.gear.topography import Topography, of_teeth
from pmor.pair.sweep import sweep_ste
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.model import online_angles
from tests.support.line_pairs import LINES, TORQUE, _solved, models
from tests.support.small_case import case_text

TEETH, COUNT, ANGLES = 51, 107, 12
# Relief that keeps edges of tips out of contact: off the line of action a tip meets the wave at another angle.
RELIEF = {"tip_relief_um": 25.0, "tip_relief_length_mm": 2.5}


def pair(helix_deg=0.0, **sections):
    return case_text(
        pair={"helix_angle_deg": helix_deg}, pinion={"teeth": TEETH, "bore_radius_mm": 60.0},
        wheel={"teeth": 23, "bore_radius_mm": 20.0}, results={"root_stress": False},
        mesh={"profile_elements": 4, "width_elements": 2, "width": "whole"}, **LINES, **sections,
    )  # fmt: skip


def ste_um(reduced, *pinions, wheel=UNMODIFIED):
    """Transmission error over a revolution with flanks of the pinion, um."""
    phi = online_angles(reduced.meshed.pair.pitch, ANGLES, TEETH)
    sweep = sweep_line_loads(reduced, phi, [Condition(torque=TORQUE, pinion=one, wheel=wheel) for one in pinions])
    assert sweep.converged.all()
    return sweep.ste_um


def of_gear(amplitude_um, **wave):
    return Modification(waves=(Wave(count=COUNT, amplitude_um=amplitude_um, **wave),), **RELIEF)


def orders(curve):
    return 2.0 / len(curve) * np.abs(np.fft.rfft(curve))


def test_a_wave_on_a_spur_gear_is_its_own_order_alone():
    """All teeth in mesh have one place on the wave, whatever they carry: the gear leads and lags by it."""
    _, reduced = _solved(pair())
    waved, plain = ste_um(reduced, of_gear(0.8, phase_deg=20.0), Modification(**RELIEF), wheel=Modification(**RELIEF))
    found = orders(waved - plain)
    assert found[COUNT] == pytest.approx(0.8, rel=1e-9)
    assert np.delete(found, COUNT).max() < 1e-9 * found[COUNT]


def test_a_wave_on_a_helical_gear_is_its_own_order_and_those_of_the_mesh_beside_it():
    """|107 +- 51 k| alone. Half the difference of a wave and its opposite: the law of contact bends by their square."""
    _, reduced = _solved(pair(20.0))
    rising, falling = (of_gear(1e-4, phase_deg=phase) for phase in (20.0, 200.0))
    crest, valley = ste_um(reduced, rising, falling, wheel=Modification(**RELIEF))
    found, number = orders(0.5 * (crest - valley)), np.arange(ANGLES * TEETH // 2 + 1)
    ghosts = np.isin(number % TEETH, (COUNT % TEETH, -COUNT % TEETH))
    assert found[~ghosts].max() < 1e-9 * found.max()
    assert np.sort(found[ghosts])[-3] > 1e-2 * found.max()
    # At most from valley to crest, as without load.
    assert np.ptp(0.5 * (crest - valley)) < 2e-4


def test_a_wave_along_the_lines_of_contact_moves_a_helical_gear_as_a_spur_one():
    """Its phase then runs along the face as the line of contact does, by count times the angle of the helix."""
    _, reduced = _solved(pair(20.0))
    tooth, width = reduced.meshed.pair.pinion, reduced.meshed.pair.face_width
    along = -math.degrees(COUNT * tooth.twist_per_length * width)
    waved, plain = ste_um(
        reduced, of_gear(0.8, helix_phase_deg=along), Modification(**RELIEF), wheel=Modification(**RELIEF)
    )
    found = orders(waved - plain)
    assert found[COUNT] == pytest.approx(0.8, rel=1e-9)
    assert np.delete(found, COUNT).max() < 1e-9 * found[COUNT]


def test_a_wave_moves_a_helical_gear_least_where_whole_waves_lie_along_the_line_of_contact():
    """The line of contact is not loaded evenly, and shorter at its ends: measured 0.163 of a spur gear's, half 0.57."""
    _, reduced = _solved(pair(20.0))
    tooth, width = reduced.meshed.pair.pinion, reduced.meshed.pair.face_width
    along = -math.degrees(COUNT * tooth.twist_per_length * width)
    phases = along + 360.0 * np.arange(0.0, 2.5, 0.5)
    curves = ste_um(
        reduced, *(of_gear(0.1, helix_phase_deg=phase) for phase in phases), Modification(**RELIEF),
        wheel=Modification(**RELIEF),
    )  # fmt: skip
    none, half, one, more, _ = (orders(curve - curves[-1])[COUNT] for curve in curves[:-1])
    assert none == pytest.approx(0.1, rel=1e-9)
    assert one < 0.3 * half
    assert one < 0.7 * more


def test_the_period_of_waves_is_what_teeth_and_waves_divide_by():
    for count, pitches in ((COUNT, 51), (102, 1), (34, 3)):
        text = pair(online={"angles_per_pitch": ANGLES})
        text += f"[[pinion.modification.waves]]\ncount = {count}\namplitude_um = 1.0\n"
        case = parse_case(text, "waves", "waves")
        assert case.repeats_after == pitches
        assert case.pinion_modification.waves == (Wave(count=count, amplitude_um=1.0),)


def grids(amounts):
    return of_teeth([Topography((0.0, 60.0), (-20.0, 20.0), ((amount,) * 2,) * 2) for amount in amounts])


def test_even_flanks_of_each_tooth_are_pitch_deviations():
    amounts = tuple(2.0 * math.sin(2.0 * j) for j in range(TEETH))
    middle = float(np.median(amounts))
    _, reduced = _solved(pair())
    by_pitch, by_grid = ste_um(
        reduced, Modification(pitch_deviations_um=amounts, **RELIEF),
        Modification(topography=grids(a - middle for a in amounts), **RELIEF),
    )  # fmt: skip
    np.testing.assert_allclose(by_grid, by_pitch, atol=1e-9)
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
    np.testing.assert_allclose(found[:1], expected.ste_um, rtol=2e-3)
    assert np.abs(found[0] - found[1]).max() > 1.0
