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

from pmor.design.settings import Design, Goal, Load, Scatter, Search, Trade, Variable
from pmor.design.solvers import Built
from pmor.gear.condition import PLAIN, Assembly, at_torques
from pmor.gear.deviation_rates import deviation_rates
from pmor.gear.modification import AMOUNTS, RELIEF_PLACES, ExtentKey, Modification
from pmor.gear.profile import profiles
from pmor.line.hubs import Hubs
from pmor.pair.conditions import conditions_of_assembly
from pmor.results.sensitivity import sensitivities
from pmor.results.sweep import mesh_stiffness
from pmor_online.line_sweep import sweep_line_loads
from pmor_online.model import online_angles
from tests.support.judges import judge_of_pair
from tests.support.line_pairs import ABOUT_TO, NOTHING, STEP, TORQUE, models, random_modification


def relief_begins(reduced, gear, key, value, lines):
    """Whether a section that carries is within the step of where a relief begins or ends, (angles,)."""
    side, step = int(gear == "wheel"), STEP[key.split("_")[-1]]
    places = lines.roll_rad[..., side]
    if key == "end_relief_length_mm":
        low, high = reduced.meshed.pair.faces[side]
        places = np.broadcast_to(np.minimum(lines.z_mm - low, high - lines.z_mm), places.shape)
    else:
        profile = profiles(reduced.meshed.pair)[side]
        step *= abs(profile.roll_rate(MEASURES[key], value))
        value = profile.roll_at(MEASURES[key], value)
    near = np.abs(places - value) <= step
    return (near & (lines.load_N_per_mm[0] > 0.0)).any(axis=(1, 2))


@pytest.mark.parametrize(
    "name", ["spur", "edges", "helical", *(pytest.param(n, marks=pytest.mark.slow) for n in ("unequal", "quadratic"))]
)
def test_tangent_stiffness_is_the_difference_quotient_in_torque(name):
    """On plain and modified flanks; where a tip corner carries, as on plain ones, its lever turns with the advance."""
    _, reduced = models(name)
    rng, h = np.random.default_rng(18), 1e-5
    phi, radius = reduced.meshed.pair.pitch * np.linspace(0.0, 1.0, 20), reduced.meshed.pair.pinion.base_radius
    modified = [random_modification(rng, reduced.meshed.pair.active_rolls[0]) for _ in range(3)]
    for flank in (Modification(), *modified):
        assembly, torque = Assembly(pinion=flank), 1e-3 * TORQUE * rng.uniform(0.2, 1.5)
        conditions = conditions_of_assembly(assembly, [torque * (1.0 - h), torque, torque * (1.0 + h)])
        sweep = sweep_line_loads(reduced, phi, conditions)
        quotient = 2e3 * h * torque / radius / (sweep.ste_um[2] - sweep.ste_um[0])
        recorded = sweep_line_loads(reduced, phi, conditions[1:2], recorded=True)
        # Measured 1e-7 at most.
        assert_allclose(sweep.stiffness_N_per_um[1], quotient, rtol=1e-6)
        assert_allclose(recorded.stiffness_N_per_um[0], quotient, rtol=1e-6)


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
# Each gear's reliefs start and end in measures of their own.
EXTENTS = {
    "pinion": ("tip_relief_start_percent", "root_relief_end_diameter_mm", "end_relief_length_mm"),
    "wheel": ("tip_relief_length_mm", "root_relief_end_roll_deg", "end_relief_length_mm"),
}
MEASURES = {key: measure for places in RELIEF_PLACES.values() for key, measure in places.items()}
VARIABLES = tuple(
    Variable(key=key, gear=gear, range=(-1000.0, 1000.0)) for gear, extents in EXTENTS.items()
    for key in (*AMOUNTS, *extents)
)  # fmt: skip


def random_hubs(rng):
    """Supports on which hubs move by some 10 um, and tilt, under the torques of these tests."""
    factor = np.diag([1.0, 1.0, 1.0, 0.02, 0.02, 0.0] * 2) @ rng.standard_normal((12, 12))
    offset = 5e-3 * np.array([1.0, 1.0, 1.0, 0.02, 0.02, 0.0] * 2) * rng.standard_normal(12)
    return Hubs(3e-7 * factor @ factor.T, offset)


def judge_of(name, minimise, torque, hubs):
    design = Design(
        title="", case="", variables=VARIABLES, load=Load(torques_Nm=(torque,), weights=(1.0,)),
        objective=Goal(minimise=minimise), constraints=(), scatter=Scatter(), search=Search(angles=ANGLES),
        pareto=Trade(),
    )  # fmt: skip
    return judge_of_pair(models(name)[1], design, hubs)


def kinks(judge, variable, here, moved, value):
    """What is no derivative between two states, by angle: (name, which angles)."""
    load, other = here.load_N_per_mm[0], moved.load_N_per_mm[0]
    yield "section takes up or loses its load", (np.abs(other - load) > ABOUT_TO * load).any(axis=(1, 2))
    yield "patch comes to an edge", (here.edge_load_N_per_mm[0] > 0.0) != (moved.edge_load_N_per_mm[0] > 0.0)
    if variable.key in get_args(ExtentKey):
        yield "relief begins", relief_begins(judge.solvers[0].reduced, variable.gear, variable.key, value, here)


def of_a_sweep(judge, assembly):
    """Sensitivities as the results file of a sweep has them, in the order of the variables."""
    variants = judge.solvers[0].variants
    phi = online_angles(variants.reduced.meshed.pair.pitch, ANGLES)
    sweep = sweep_line_loads(
        variants.supported[0][0], phi, conditions_of_assembly(assembly, judge.design.load.torques_Nm), recorded=True
    )
    found = sensitivities(sweep, deviation_rates(variants.reduced.meshed, assembly, sweep.states.lines))
    return found.ste[[found.parameter.index(f"{v.gear}.{v.key}") for v in VARIABLES], 0]


def value_of(modification, key, profile):
    """Value of a key of a modification whose reliefs have roll angles, in the measure of the key."""
    for amount, places in RELIEF_PLACES.items():
        if key in places:
            return getattr(profile.point(profile.relief_roll(modification, amount)), places[key])
    return getattr(modification, key)


def errors_of(name, minimise, rng, named, supported):
    """Exact derivative less quotient over the largest of the curve's: of the curve (k, A), of the figure (k,)."""
    hubs = [random_hubs(rng)] if supported else []
    judge = judge_of(name, minimise, 1e-3 * TORQUE * rng.uniform(0.2, 1.5), hubs)
    (solver,) = judge.solvers
    pair = solver.reduced.meshed.pair
    flanks = [random_modification(rng, gear) for gear in pair.active_rolls]
    along = profiles(pair)
    x = np.array([value_of(flanks[v.gear == "wheel"], v.key, along[v.gear == "wheel"]) for v in VARIABLES])
    # Shapes of relief are no variables.
    base = [replace(PLAIN.pinion, tip_relief_shape=m.tip_relief_shape, root_relief_shape=m.root_relief_shape)
            for m in flanks]  # fmt: skip
    judge.base = Built((Assembly(PLAIN.misalignment, *base),))
    (state,), built = judge.solve(judge.assembly(x), differentiated=True), judge.assembly(x)
    rates = solver.ste_rates(state, built)
    exact = np.array([rates[f"{v.gear}.{v.key}"][0] for v in VARIABLES])
    assert_allclose(of_a_sweep(judge, built.flanks[0]), exact, rtol=0.0, atol=1e-9 * np.abs(exact).max())
    _, figure, _ = judge.smooth(x, SHARPNESS)
    curve_errors, figure_errors = np.full(exact.shape, np.nan), np.full(len(x), np.nan)
    for k, variable in enumerate(VARIABLES):
        h = STEP[variable.key.split("_")[-1]]
        ends = [x + sign * h * (np.arange(len(x)) == k) for sign in (1.0, -1.0)]
        states = [solver.solve(judge.assembly(end)) for end in ends]
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


@pytest.mark.parametrize("supported", [False, True], ids=["held", "on supports"])
@pytest.mark.parametrize("name", ["spur", "helical"])
@pytest.mark.parametrize(("states", "bound"), [(4, 2e-6), pytest.param(100, 1e-5, marks=pytest.mark.slow)])
def test_gradients_are_difference_quotients_at_random_states(name, states, bound, supported):
    """With the factor of the last Newton step instead of the solution's, 7e-6 off."""
    rng, named, curves, figures = np.random.default_rng(19), Counter(), [], []
    for number in range(states):
        minimise = ("peak_to_peak_um", "order_1_um", "order_2_um")[number % 3]
        curve, figure = errors_of(name, minimise, rng, named, supported)
        curves.append(curve.ravel())
        figures.append(figure)
    curves, figures = np.concatenate(curves), np.concatenate(figures)
    print(f"{name}: {np.nanmax(np.abs(curves)):.1e} of the curve, {np.nanmax(np.abs(figures)):.1e} of figures; kinks: "
          f"{np.isnan(curves).mean():.2%} of {curves.size} positions, {np.isnan(figures).mean():.1%} of figures, "
          f"{dict(named)}")  # fmt: skip
    assert np.isnan(curves).mean() < 0.02
    assert np.isnan(figures).mean() < 0.2
    assert np.nanmax(np.abs(curves)) < bound
    assert np.nanmax(np.abs(figures)) < bound
