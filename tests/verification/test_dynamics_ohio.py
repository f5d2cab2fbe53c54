"""The pair of the Ohio State rig in motion: where it jumps with and without relief, and what coupled teeth do to it.

Figures of a prototype with the same finite elements, integrated over time, over the natural frequency, to two digits.
Slow, and prints what it finds: ``pytest -n 0 -m slow tests/verification/test_dynamics_ohio.py -s``.
"""

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from pmor.case import load_case
from pmor.dynamics.gear_model import gear_model
from pmor.dynamics.harmonic_balance import solve_at
from pmor.dynamics.integration import run_through, state_of
from pmor.dynamics.law import force_law
from pmor.dynamics.measure import at_rest, needed_harmonics
from pmor.dynamics.response import response
from pmor.dynamics.solution import reduced_of, task_of
from pmor.lab.slices.run import run_slices, sliced

CASES = Path(__file__).parents[2] / "cases"
CASE = {False: "osu_dynamics", True: "osu_dynamics_relief"}
TORQUES = 85.0, 170.0, 270.0, 340.0
# By relief and damping ratio: run-up folds of the main resonance at these torques.
PUBLISHED = {
    (False, 0.02): (0.94, 0.95, 0.96, 0.97),
    (True, 0.02): (0.87, 0.95, None, None),
    (False, 0.05): (None, None, None, None),
    (True, 0.05): (0.88, None, None, None),
}
TWO_DIGITS = 0.0075
# Folds nearer to each other than this, over their speed, are a jump that no run in steps sees.
HAIRLINE = 5e-3
LIMITS = 0.6, 1.25


@cache
def pair_of(relieved):
    case = load_case(CASES / f"{CASE[relieved]}.toml")
    return case, reduced_of(case)


@cache
def tasks(relieved, alone=False):
    case, reduced = pair_of(relieved)
    law, _, _ = force_law(case, sliced(reduced) if alone else reduced)
    model = gear_model(case, reduced.meshed.pair)
    return [task_of(case, model, law, torque_Nm) for torque_Nm in case.dynamics.torques_Nm]


@cache
def motions(relieved, damping, torque_Nm):
    task = next(task for task in tasks(relieved) if task.torque_Nm == torque_Nm)
    rest = at_rest(replace(task, damping_ratio=damping))
    limits = tuple(rest.natural * limit for limit in LIMITS)
    return task, rest, response(rest.oscillator, task.law, limits, needed_harmonics(rest, limits))


def folds(relieved, damping, torque_Nm):
    """Run-down and run-up fold over the natural frequency; None, None where nothing jumps, or by a hair."""
    _, rest, found = motions(relieved, damping, torque_Nm)
    by_kind = {f.kind: f.point.speed / rest.natural for f in found.folds}
    down, up = by_kind.get("run_down"), by_kind.get("run_up")
    return down, up


@pytest.mark.slow
@pytest.mark.parametrize(("relieved", "damping"), PUBLISHED)
def test_jumps_are_where_the_prototype_had_them(relieved, damping):
    for torque, expected in zip(TORQUES, PUBLISHED[relieved, damping], strict=True):
        down, up = folds(relieved, damping, torque)
        print(f"\nrelief {relieved}, damping {damping:g}, {torque:g} N m: down {down}, up {up}")  # noqa: T201
        if expected is None:
            # Without relief, at 5 % and 85 N m, harmonic balance finds folds 0.3 % apart, which no steps would show.
            assert up is None or up - down < HAIRLINE
        else:
            np.testing.assert_allclose(up, expected, atol=TWO_DIGITS)


@pytest.mark.slow
def test_the_run_down_at_five_per_cent_damping_jumps_at_its_fold():
    """The prototype gives 0.82, the last of its steps of 0.02 on the upper branch; a slow run goes on to the fold."""
    task, rest, found = motions(True, 0.05, 85.0)
    fold = folds(True, 0.05, 85.0)[0]
    assert 0.80 < fold < 0.82
    branch, first = found.branches[0], 0.95 * rest.natural
    near = branch.points[np.abs(branch.speed - first).argmin()]
    start = state_of(branch.balance, solve_at(branch.balance, first, near.unknowns), first)
    pieces = list(run_through(rest.oscillator, task.law, start, (first, 0.77 * rest.natural), 20_000))
    size, speed = (np.concatenate([getattr(p, name) for p in pieces]) for name in ("rms", "cycle_speed"))
    jump = speed[::20][np.abs(np.diff(np.log(size[::20]))).argmax()] / rest.natural
    print(f"\nrun-down: fold {fold:.4f}, jump of a run of 20,000 cycles {jump:.4f}")  # noqa: T201
    np.testing.assert_allclose(jump, fold, rtol=5e-3)


@pytest.mark.slow
def test_teeth_alone_vary_more_in_stiffness_and_jump_at_five_per_cent():
    jumps = {"coupled": 0, "slices": 0}
    case, reduced = pair_of(False)
    for found in run_slices(case, reduced=reduced):
        swing = {}
        for kind in jumps:
            low, mean, high = (found[kind][f"mesh_stiffness_{key}_N_per_um"] for key in ("min", "mean", "max"))
            swing[kind] = (high - low) / mean
            by_kind = {f["kind"]: f["mesh_frequency_Hz"] for f in found[kind]["responses"][1]["folds"]}
            jumps[kind] += "run_up" in by_kind and by_kind["run_up"] > (1.0 + HAIRLINE) * by_kind["run_down"]
        print(f"\n{found['torque_Nm']:g} N m: swing of the stiffness over its mean {swing}")  # noqa: T201
        assert swing["slices"] > 1.15 * swing["coupled"]
    print(f"\njumps at 5 % damping: {jumps}")  # noqa: T201
    assert jumps["coupled"] == 0
    assert jumps["slices"] >= 2
