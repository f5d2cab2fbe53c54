"""Exact derivatives against difference quotients: tangent stiffness, sensitivities, gradients of designs.

Kinks have no derivative, and are named: a section takes up or loses its load, the patch of contact comes to the edge of
a tip, or a relief begins just where a section carries.
"""

from collections import Counter
from dataclasses import replace
from typing import get_args

import numpy as np
import pytest
from numpy.testing import assert_allclose

from pmor.design.judge import Judge
from pmor.design.settings import AMOUNT_KEYS, Design, ExtentKey, Goal, Load, Scatter, Search, Trade, Variable
from pmor.gear.condition import PLAIN, Assembly, at_torques
from pmor.gear.deviation_rates import AMOUNTS, deviation_rates
from pmor.pair.conditions import conditions_of_assembly
from pmor.results.sensitivity import sensitivities
from pmor.results.sweep import mesh_stiffness
from pmor_online.line_sweep import sweep_line_loads
from tests.support.line_pairs import ABOUT_TO, NOTHING, STEP, TORQUE, models, random_modification


def moved(assembly, parameter, by):
    gear, key = parameter.split(".")
    modification = getattr(assembly, gear)
    return replace(assembly, **{gear: replace(modification, **{key: getattr(modification, key) + by})})


def at_a_kink(sweep, near):
    """Whether a section takes up or loses its load under a step, or is about to, (conditions, angles).

    The law of a load that goes to nothing is logarithmic, and so steep that a quotient finds no slope of it. The law's
    slope also jumps, by 0.5 %, where the patch of contact comes to a sharp edge, at which there is no pressure.
    """
    (load, moved), (sharp, now) = (
        [getattr(one.states.lines, name) for one in (sweep, near)] for name in ("load_N_per_mm", "pressure_MPa")
    )
    return ((np.abs(moved - load) > ABOUT_TO * load) | (np.isnan(now) != np.isnan(sharp))).any(axis=(2, 3))


def errors_of_sensitivities(name, rng, share):
    """Exact derivative less difference quotient, over the largest one of the parameter; NaN where sections change."""
    _, reduced = models(name)
    active = reduced.meshed.pair.active_rolls
    assembly = Assembly(pinion=random_modification(rng, active[0]), wheel=random_modification(rng, active[1]))
    phi, torque = reduced.meshed.pair.pitch * share, TORQUE * 1e-3 * rng.uniform(0.2, 1.5)
    sweep = sweep_line_loads(reduced, phi, conditions_of_assembly(assembly, [torque]), recorded=True)
    found = sensitivities(sweep, deviation_rates(reduced.meshed, assembly, sweep.states.lines))
    step = [STEP[parameter.split("_")[-1]] for parameter in found.parameter]
    conditions = []
    for parameter, h in zip(found.parameter, step, strict=True):
        for by in (-h, h):
            conditions += conditions_of_assembly(moved(assembly, parameter, by), [torque])
    near = sweep_line_loads(reduced, phi, conditions, recorded=True)
    quotient = (near.ste_um[1::2] - near.ste_um[::2]) / (2.0 * np.array(step)[:, None])
    kink = at_a_kink(sweep, near)
    same = ~(kink[::2] | kink[1::2])
    for row, parameter in enumerate(found.parameter):
        gear, key = parameter.split(".")
        if key in get_args(ExtentKey):
            value = getattr(getattr(assembly, gear), key)
            same[row] &= ~relief_begins(reduced, gear, key, value, sweep.states.lines)
    exact = found.ste[:, 0]
    scale = np.abs(exact).max(axis=1, keepdims=True)
    # Below that nothing but rounding is left: where relief is felt at the tip alone, its start is not.
    return np.where(same, (exact - quotient) / np.maximum(scale, NOTHING), np.nan), found


def relief_begins(reduced, gear, key, value, lines):
    """Whether a section that carries is within the step of where a relief begins or ends, (angles,)."""
    side = int(gear == "wheel")
    places = np.degrees(lines.roll_rad[..., side])
    if key == "end_relief_length_mm":
        low, high = reduced.meshed.pair.faces[side]
        places = np.broadcast_to(np.minimum(lines.z_mm - low, high - lines.z_mm), places.shape)
    near = np.abs(places - value) <= STEP[key.split("_")[-1]]
    return (near & (lines.load_N_per_mm[0] > 0.0)).any(axis=(1, 2))


@pytest.mark.parametrize("name", ["spur", "helical"])
def test_sensitivities_are_the_difference_quotients_for_fifty_random_modifications_each(name):
    rng, errors = np.random.default_rng(17), []
    for _ in range(50):
        error, found = errors_of_sensitivities(name, rng, rng.uniform(0.0, 1.0, 3))
        assert len(found.parameter) == 2 * (len(AMOUNTS) + 3)
        errors.append(error.ravel())
    errors = np.concatenate(errors)
    # Measured 0.2 % (spur) and 0.3 % (helical).
    assert np.isnan(errors).mean() < 0.02
    # Measured 2e-7 and 1e-7; with the factor of the last Newton step instead of the solution's, 7e-6.
    assert np.nanmax(np.abs(errors)) < 2e-6


@pytest.mark.parametrize("name", ["spur", "unequal", "edges", "helical", "quadratic"])
def test_tangent_stiffness_is_the_difference_quotient_in_torque(name):
    """On modified flanks; where a tip corner carries, its lever turns with the advance."""
    _, reduced = models(name)
    rng, h = np.random.default_rng(18), 1e-5
    phi, radius = reduced.meshed.pair.pitch * np.linspace(0.0, 1.0, 20), reduced.meshed.pair.pinion.base_radius
    for _ in range(3):
        flank = random_modification(rng, reduced.meshed.pair.active_rolls[0])
        assembly, torque = Assembly(pinion=flank), 1e-3 * TORQUE * rng.uniform(0.2, 1.5)
        conditions = conditions_of_assembly(assembly, [torque * (1.0 - h), torque, torque * (1.0 + h)])
        sweep = sweep_line_loads(reduced, phi, conditions)
        quotient = 2e3 * h * torque / radius / (sweep.ste_um[2] - sweep.ste_um[0])
        # Measured 1e-7 at most.
        assert_allclose(sweep.stiffness_N_per_um[1], quotient, rtol=1e-6)


def test_stiffness_is_that_of_a_recorded_sweep_and_of_neighbouring_torques():
    """The difference over two torques, which models without a factor give, is that of the middle."""
    _, reduced = models("spur")
    phi = reduced.meshed.pair.pitch * np.linspace(0.0, 1.0, 5)
    plain, recorded = (sweep_line_loads(reduced, phi, at_torques([99e3, 100e3, 101e3]), recorded=r) for r in (0, 1))
    assert np.array_equal(plain.ste_um, recorded.ste_um)
    # A plain sweep takes it from the last Newton step's factor.
    assert_allclose(plain.stiffness_N_per_um, recorded.stiffness_N_per_um, rtol=1e-6)
    pair = reduced.meshed.pair
    exact = mesh_stiffness(plain, pair.pinion.base_radius, pair.common_width)
    difference = mesh_stiffness(replace(plain, stiffness_N_per_um=None), pair.pinion.base_radius, pair.common_width)
    assert exact.tangent.shape == (3, 5)
    assert difference.tangent.shape == (2, 5)
    # The tangent rises by 0.3 % from one to the next.
    assert_allclose(0.5 * (difference.tangent[0] + difference.tangent[1]), exact.tangent[1], rtol=1e-4)
    assert (exact.tangent > exact.secant).all()


def test_shares_of_a_torque_are_levers_of_the_line_loads_and_idle_sections_count_for_nothing():
    _, reduced = models("helical")
    phi = reduced.meshed.pair.pitch * np.linspace(0.0, 1.0, 7)
    sweep = sweep_line_loads(reduced, phi, at_torques([TORQUE]), recorded=True)
    lines = sweep.states.lines
    assert_allclose((-lines.lever_mm * lines.force_N).sum(axis=(2, 3)), TORQUE, rtol=1e-9)
    carries = lines.load_N_per_mm > 0.0
    assert (lines.sensitivity[~carries] == 0.0).all()
    assert carries.any(axis=(2, 3)).all()
    # Material off all flanks alike lets the pinion advance by as much.
    assert_allclose(lines.sensitivity.sum(axis=(2, 3)), 1.0, rtol=5e-3)


# --- gradients that designs descend by -------------------------------------------------------------------------------

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


def kinks(judge, variable, here, moved, value):
    """What is no derivative between two states, by angle: (name, which angles)."""
    load, other = here.load_N_per_mm[0], moved.load_N_per_mm[0]
    yield "section takes up or loses its load", (np.abs(other - load) > ABOUT_TO * load).any(axis=(1, 2))
    yield "patch comes to an edge", (here.edge_load_N_per_mm[0] > 0.0) != (moved.edge_load_N_per_mm[0] > 0.0)
    if variable.key in get_args(ExtentKey):
        yield "relief begins", relief_begins(judge.reduced, variable.gear, variable.key, value, here)


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
            for kind, where in kinks(judge, variable, state, moved, x[k]):
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
