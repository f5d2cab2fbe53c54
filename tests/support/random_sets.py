"""Planetary sets whose pins and gears are off their places at random, under random loads, and how far from balance."""

from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from pmor.sets.loader import load
from pmor.sets.model import build_train
from pmor.sets.solution import SetSolution, errors_of
from tests.support.set_variants import BASE, teeth
from tests.support.small_sets import levers_at, written_set

TEETH = {3: (18, 18, 54), 4: (40, 20, 80), 5: (40, 20, 80), 6: (40, 20, 80), 7: (42, 21, 84)}
FREE = {
    "sun": '[supports]\nsun_radial_N_per_mm = "free"\n',
    "ring": '[supports]\nring_radial_N_per_mm = "free"\n',
    "carrier": '[carrier]\nradial_N_per_mm = "free"\n',
    "sun and ring": '[supports]\nsun_radial_N_per_mm = "free"\nring_radial_N_per_mm = "free"\n',
    "sun and carrier": '[supports]\nsun_radial_N_per_mm = "free"\n[carrier]\nradial_N_per_mm = "free"\n',
}
# mm; and N m on the sun for each planet, from where backlash and errors are all that matters to a heavy load.
MOST_MM, LIGHTEST_NM, HEAVIEST_NM = 0.05, 0.1, 500.0
ANGLES = 2


@dataclass(frozen=True)
class Balance:
    """Balance of sets, (n, A): whether they converged, what is out of balance over the forces; load factors, (n,)."""

    converged: np.ndarray
    left: np.ndarray
    k_gamma: np.ndarray


@cache
def random_set(planets, free):
    """Return plan and train of a set with so many planets and these members free."""
    text = BASE
    for old, new in teeth(*TEETH[planets], planets):
        text = text.replace(old, new)
    with TemporaryDirectory() as folder:
        file = load(written_set(Path(folder), text + FREE[free]))
    plan = file.plan
    return plan, build_train(file.cases, plan.bodies, plan.meshes, plan.free, plan.compliance)


def off_at_random(rng, plan, planets):
    """Return the plan with all pins off their places, or some, and perhaps eccentric gears; sizes over two decades."""
    size = MOST_MM * 10.0 ** rng.uniform(-2.0, 0.0)
    pins = np.zeros((len(plan.bodies), 6))
    pins[-planets:, :2] = rng.uniform(-size, size, (planets, 2)) * (rng.random((planets, 1)) < rng.choice([0.4, 1.0]))
    turning = rng.uniform(-1.0, 1.0, (len(plan.bodies), 2)) * rng.choice([0.0, size / np.sqrt(2.0)])
    return replace(plan, displacement=pins.ravel(), eccentricity=turning)


def balance_of(planets, free, count, seed):
    """Solve so many sets, each at two angles of some pitch."""
    plan, train = random_set(planets, free)
    rng, found = np.random.default_rng([seed, planets, list(FREE).index(free)]), []
    pitch = train.meshes[0].pair.meshed.pair.pitch
    placed = train.place(pitch * (0.1 + np.arange(ANGLES) / ANGLES), plan.displacement)
    for _ in range(count):
        own, later = off_at_random(rng, plan, planets), int(rng.integers(1000))
        torque = planets * LIGHTEST_NM * (HEAVIEST_NM / LIGHTEST_NM) ** rng.random()
        loads = 1e3 * torque * plan.load[None]
        state = placed.solve(loads, errors_of(own, placed, later), later)
        levers, force = levers_at(placed, state.movement[0]), state.force[0]
        left = np.abs(np.einsum("an,ank->ak", force, levers) + loads)
        over = np.abs(placed.rows).max(axis=1) * force.sum(axis=1, keepdims=True)
        solution = SetSolution(own, placed, np.array([torque]), state, 1)
        shares = solution.planet_share[0].max()
        found.append((state.converged[0], (left / over).max(axis=1), planets * shares))
    return Balance(*map(np.array, zip(*found, strict=True)))
