"""The tip relief that suits a design: how much of it, the same on both gears, and where it starts on each of them."""

from __future__ import annotations

import math

import numpy as np

from pmor.design.descent import Descent, ranked
from pmor.design.elements import Elements
from pmor.design.files import DesignFile
from pmor.design.fine import best_finely
from pmor.design.judge import Judge
from pmor.design.settings import Design, Goal, Load, Scatter, Search, Trade, Variable
from pmor.design.variables import spread_evenly
from pmor.results.sweep import SteSweep
from pmor_online.model import ReducedPair

# Amounts up to twice the largest transmission error, as in Harris's rule with rigid double contact.
MOST_AMOUNT = 2.0
# Shares of the active profile between which relief starts.
EARLIEST, LATEST = 0.5, 0.95
SAMPLES = 32


def best_relief(reduced: ReducedPair, sweep: SteSweep) -> dict[str, float]:
    """Return the tip relief of the least peak-to-peak STE, the mean over the torques of the sweep of a case.

    The best of a few samples is followed downhill by the exact derivatives (`pmor.design.descent`), and the best ones
    are judged again on fine angles. What else the flanks of the case have stays as it is. Keys are those of
    `pmor.campaigns.settings.ReliefKey`.

    Raises
    ------
    ConvergenceError
    """
    case, rolls = reduced.basis.case, reduced.meshed.pair.active_rolls
    most = MOST_AMOUNT * float(np.nanmax(sweep.ste_um))
    starts = [
        tuple(math.degrees(low + share * (high - low)) for share in (EARLIEST, LATEST)) for low, high in rolls
    ]  # fmt: skip
    torques = case.online.torques_Nm
    design = Design(
        title="", case=case.name,
        variables=(
            Variable(key="tip_relief_um", range=(0.0, most)),
            Variable(key="tip_relief_start_roll_deg", gear="pinion", range=starts[0]),
            Variable(key="tip_relief_start_roll_deg", gear="wheel", range=starts[1]),
        ),
        load=Load(torques_Nm=torques, weights=(1.0,) * len(torques)), objective=Goal(), constraints=(),
        scatter=Scatter(), search=Search(samples=SAMPLES, descents=1), pareto=Trade(),
    )  # fmt: skip
    judge = Judge(Elements(DesignFile("", "", design, (), case, {case.name: case}), {case.name: reduced}))
    samples = ranked([judge.verdict(x) for x in spread_evenly(design.variables, SAMPLES)], ())
    best = best_finely(judge, ranked([*Descent(judge).run(samples[0].x), *samples], ()))
    amount, pinion, wheel = best.x.tolist()
    return {
        "best_tip_relief_um": amount,
        "best_tip_relief_start_pinion_roll_deg": pinion,
        "best_tip_relief_start_wheel_roll_deg": wheel,
        "best_ste_peak_to_peak_um": best.objective,
    }
