"""Orders of periodic curves, and of sweeps over several pitches."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.case import make_case
from pmor.results.sweep import mesh_orders, orders_of, ripple_um
from pmor_online.model import online_angles, sweep_angles
from tests.support.sweeps import PITCH, made_up_sweep

TEETH = 21


def sweep_of(curve, pitches, count=20):
    phi = 0.1 + online_angles(PITCH, count, pitches)
    return made_up_sweep(curve(phi), phi_rad=phi)


def whine(phi):
    """A mesh order with a run-out of the pinion, which also modulates it."""
    return 9.0 + 2.0 * np.cos(phi - 0.3) + 1.5 * np.cos(TEETH * phi + 1.0) + 0.2 * np.cos((TEETH + 1) * phi)


def test_orders_count_periods_per_turn_with_amplitude_and_phase():
    found = orders_of(sweep_of(whine, TEETH), 0)
    assert found.mean == pytest.approx(9.0)
    seen = {round(k): (a, p) for k, a, p in zip(found.order, found.amplitude, found.phase, strict=True) if a > 1e-9}
    assert sorted(seen) == [1, TEETH, TEETH + 1]
    assert_allclose(seen[1], (2.0, -0.3), atol=1e-12)
    assert_allclose(seen[TEETH], (1.5, 1.0), atol=1e-12)
    assert_allclose(seen[TEETH + 1], (0.2, 0.0), atol=1e-12)


@pytest.mark.parametrize("pitches", [1, 3, TEETH])
def test_mesh_orders_do_not_depend_on_how_many_pitches_are_swept(pitches):
    def curve(phi):
        return 9.0 + 1.5 * np.cos(TEETH * phi + 1.0) + 0.4 * np.cos(3 * TEETH * phi)

    sweep = sweep_of(curve, pitches)
    assert (sweep.pitches, sweep.span_rad) == (pitches, pytest.approx(pitches * PITCH))
    assert_allclose(mesh_orders(sweep, 0, 5), [1.5, 0.0, 0.4, 0.0, 0.0], atol=1e-12)


def test_orders_that_the_angles_do_not_resolve_are_missing():
    assert np.isnan(mesh_orders(sweep_of(whine, TEETH, 8), 0, 5)).tolist() == [False, False, False, True, True]
    holed = sweep_of(whine, TEETH)
    holed.ste_um[0, 3] = np.nan
    assert np.isnan(mesh_orders(holed, 0)).all()
    with pytest.raises(ValueError, match="uniformly"):
        orders_of(replace(holed, phi_rad=holed.phi_rad**1.01), 0)


def test_ripple_knows_where_a_sweep_of_several_pitches_ends():
    sweep = sweep_of(lambda phi: 9.0 + 0.0 * phi, 3)
    shares = np.zeros((1, 60, 2))
    shares[..., 0] = 1.0
    shares[0, 10:50, 1] = 0.5  # alone at the end and at the beginning: one run of twenty
    straight = sweep.phi_rad + sweep.span_rad * (np.arange(60) < 10)
    found = replace(sweep, ste_um=straight[None], pair_share=shares, pair_index=np.array([0, 1]))
    assert ripple_um(found, 0) < 1e-12


def test_sweeps_span_what_a_case_says():
    case = make_case(
        pinion={"teeth": 21, "bore_radius_mm": 20.0}, wheel={"teeth": 28, "bore_radius_mm": 20.0}, module_mm=4.0,
        face_width_mm=20.0, torque_Nm=100.0, online={"angles_per_pitch": 10},
    )  # fmt: skip
    for pitches, expected in [(1, 1), (5, 5), ("revolution", 21), ("hunting", 84)]:
        asked = replace(case, online=replace(case.online, pitches=pitches))
        phi = sweep_angles(asked)
        assert len(phi) == 10 * expected
        assert phi[-1] + phi[1] == pytest.approx(expected * PITCH)
