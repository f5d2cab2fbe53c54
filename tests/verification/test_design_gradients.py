"""Gradients that designs descend by: of STE curve, smooth peak-to-peak and orders, by every modification of each gear.

Kinks have no derivative, and are named: a section takes up or loses its load, the patch of contact comes to the edge of
a tip, or a relief begins just where a section carries.
"""

from collections import Counter
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest

from pmor.design.judge import Judge
from pmor.design.settings import AMOUNT_KEYS, Design, ExtentKey, Goal, Load, Scatter, Search, Trade, Variable
from pmor.gear.condition import PLAIN, Assembly
from tests.support.line_pairs import ABOUT_TO, NOTHING, STEP, TORQUE, models, random_modification

ANGLES = 12
# So sharp that the bend of the figure itself, (sharpness step)^2 / 6, stays below what is looked for.
SHARPNESS = 5.0
VARIABLES = tuple(
    Variable(key=key, gear=gear, range=(-1000.0, 1000.0)) for gear in ("pinion", "wheel")
    for key in (*AMOUNT_KEYS, *get_args(ExtentKey))
)  # fmt: skip


def judge_of(name, minimise, torque):
    design = Design(
        title="", case="", variables=VARIABLES, load=Load(torques_Nm=(torque,), weights=(1.0,)),
        objective=Goal(minimise=minimise), constraints=(), scatter=Scatter(), search=Search(angles=ANGLES),
        pareto=Trade(),
    )  # fmt: skip
    return Judge(models(name)[1], design, PLAIN)


def kinks(judge, variable, here, moved, value, step):
    """What is no derivative between two states, by angle: (name, which angles)."""
    load, other = here.load_N_per_mm[0], moved.load_N_per_mm[0]
    yield "section takes up or loses its load", (np.abs(other - load) > ABOUT_TO * load).any(axis=(1, 2))
    yield "patch comes to an edge", (here.edge_load_N_per_mm[0] > 0.0) != (moved.edge_load_N_per_mm[0] > 0.0)
    side = int(variable.gear == "wheel")
    if variable.key in get_args(ExtentKey):
        if variable.key.endswith("deg"):
            places = np.degrees(here.roll_rad[..., side])
        else:
            low, high = judge.reduced.meshed.pair.faces[side]
            places = np.broadcast_to(np.minimum(here.z_mm - low, high - here.z_mm), load.shape)
        yield "relief begins at a section", ((np.abs(places - value) <= step) & (load > 0.0)).any(axis=(1, 2))


def errors_of(name, minimise, rng, named):
    """Exact derivative less quotient over the largest of the curve's: of the curve (k, A), of the figure (k,)."""
    judge = judge_of(name, minimise, 1e-3 * TORQUE * rng.uniform(0.2, 1.5))
    active = judge.reduced.meshed.pair.active_rolls
    flanks = [random_modification(rng, gear) for gear in active]
    x = np.array([getattr(flanks[v.gear == "wheel"], v.key) for v in VARIABLES])
    # Shapes of relief are no variables.
    base = [replace(PLAIN.pinion, tip_relief_shape=m.tip_relief_shape, root_relief_shape=m.root_relief_shape)
            for m in flanks]  # fmt: skip
    judge.base = Assembly(PLAIN.misalignment, *base)
    state = judge.solver.solve(judge.assembly(x), differentiated=True)
    exact = judge.ste_rates(state, judge.assembly(x))[:, 0]
    _, figure, _ = judge.smooth(x, SHARPNESS)
    curve_errors, figure_errors = np.full(exact.shape, np.nan), np.full(len(x), np.nan)
    for k, variable in enumerate(VARIABLES):
        h = STEP[variable.key.split("_")[-1]]
        ends = [x + sign * h * (np.arange(len(x)) == k) for sign in (1.0, -1.0)]
        states = [judge.solver.solve(judge.assembly(end)) for end in ends]
        scale = max(np.abs(exact[k]).max(), NOTHING)
        smooth = np.ones(ANGLES, dtype=bool)
        for moved in states:
            for kind, where in kinks(judge, variable, state, moved, x[k], h):
                named[kind] += int(np.count_nonzero(where & smooth))
                smooth &= ~where
        quotient = (states[0].ste_um[0] - states[1].ste_um[0]) / (2.0 * h)
        curve_errors[k, smooth] = ((exact[k] - quotient) / scale)[smooth]
        if smooth.all():
            difference = (judge.smooth(ends[0], SHARPNESS)[0] - judge.smooth(ends[1], SHARPNESS)[0]) / (2.0 * h)
            figure_errors[k] = (figure[k] - difference) / scale
    return curve_errors, figure_errors


@pytest.mark.parametrize("name", ["spur", "helical"])
@pytest.mark.parametrize("states", [2, pytest.param(100, marks=pytest.mark.slow)])
def test_gradients_are_difference_quotients_at_random_states(name, states):
    rng, named, curves, figures = np.random.default_rng(19), Counter(), [], []
    for number in range(states):
        minimise = ("peak_to_peak_um", "order_1_um", "order_2_um")[number % 3]
        curve, figure = errors_of(name, minimise, rng, named)
        curves.append(curve.ravel())
        figures.append(figure)
    curves, figures = np.concatenate(curves), np.concatenate(figures)
    print(f"{name}: {np.nanmax(np.abs(curves)):.1e} of the curve, {np.nanmax(np.abs(figures)):.1e} of figures; kinks: "
          f"{np.isnan(curves).mean():.2%} of {curves.size} positions, {np.isnan(figures).mean():.1%} of figures, "
          f"{dict(named)}")  # fmt: skip
    assert np.isnan(curves).mean() < 0.02
    assert np.isnan(figures).mean() < 0.2
    assert np.nanmax(np.abs(curves)) < 1e-5
    assert np.nanmax(np.abs(figures)) < 1e-5
