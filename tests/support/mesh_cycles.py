"""Pairs whose mesh cycles differ, by holes or lugs: motion and designs know all of them until they stand as before."""

import numpy as np
from numpy.testing import assert_allclose

from pmor.design.loader import settings_of
from pmor.dynamics.law import alike_cycles, cycles_of
from pmor.pair.conditions import assembly_of, nominal_condition
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.mesh_force import mesh_force_of
from tests.support.judges import judge_of_pair

ROUND_OFF = 1e-9
ANGLES = 8
# Of a crowning, um, and of the smooth peak-to-peak, 1/um.
AMOUNT, STEP, SHARPNESS = 5.0, 1e-3, 10.0


def _swept(reduced):
    case = reduced.basis.case
    phi = reduced.meshed.pair.pitch * np.arange(case.pair.repeats_after * ANGLES) / ANGLES
    return phi, sweep_line_loads(reduced, phi, [nominal_condition(case)]).ste_um[0]


def check_force_law(reduced):
    """The force that motion takes at the STE of a sweep is that of the torque, in each cycle."""
    case, (phi, ste) = reduced.basis.case, _swept(reduced)
    cycles = case.pair.repeats_after
    assert alike_cycles(reduced, assembly_of(case)) == tuple(range(cycles))
    assert cycles_of(case, reduced.meshed.pair) == cycles
    forces, places = mesh_force_of(reduced, assembly_of(case)), range(1, len(phi), 4)
    found = [forces(2.0 * np.pi * i / ANGLES, np.array([1e-3 * ste[i]]))[0] for i in places]
    load = 1e3 * case.torque_Nm / reduced.meshed.pair.pinion.base_radius
    assert_allclose(found, load, rtol=ROUND_OFF)


def check_design(reduced):
    """A design judges the curve of all cycles, and its orders are those of the mesh; derivatives are its own."""
    case, (_, ste) = reduced.basis.case, _swept(reduced)
    asked = {"variables": [{"key": "profile_crowning_um", "range": [0.0, 10.0]}], "search": {"angles": ANGLES}}
    judge = judge_of_pair(reduced, settings_of(case, asked).design)
    found = dict(zip(judge.design.results, judge.results(judge.base)[0], strict=True))
    assert_allclose(found["peak_to_peak_um"], np.ptp(ste), rtol=ROUND_OFF)
    order = np.abs(np.fft.rfft(ste)[case.pair.repeats_after]) * 2.0 / len(ste)
    assert_allclose(found["order_1_um"], order, rtol=1e-6)
    assert np.ptp(ste) > np.ptp(ste[:ANGLES]) + 1e-4
    more, less = (judge.smooth(np.array([AMOUNT + step]), SHARPNESS)[0] for step in (STEP, -STEP))
    assert_allclose(judge.smooth(np.array([AMOUNT]), SHARPNESS)[1][0], 0.5 * (more - less) / STEP, rtol=1e-5)
